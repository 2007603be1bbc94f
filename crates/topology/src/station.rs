//! From a scenario's `[[rogue]]`, `[[takeover]]` and `[[mandate]]` tables to the plans of rogue and thief, and everybody's
//! revocation list.

use adversary::plan::{InsiderOperatorConfig, OrderId, OrderTrack, RogueOrders, SessionThiefConfig, Takeover};
use scenario::{Name, Scenario, Way};
use wire::id::{NodeId, PeerId, UnitId};
use wire::trust::Validity;

use super::RunSecret;
use super::attack::broker::kind;
use super::attack::step;
use super::start::start_ms;

/// The rogue's plan, when the scenario has one. Its key and its way are those of the first table; the loader holds the
/// others equal to it.
pub(super) fn plan(s: &Scenario, phase: u64, secret: &RunSecret) -> Option<InsiderOperatorConfig> {
    let first = s.rogue.first()?;
    let holds = node(&first.holds)?;
    let orders = s.rogue.iter().filter_map(|r| {
        Some(RogueOrders {
            at_ms: start_ms(r, phase),
            count: r.count.unsigned() as u32,
            every_ms: r.every_ms.unsigned(),
            claim: r.claims.as_ref().map_or(Some(holds), |name| node(name))?,
            order: kind(r.order),
            values: r.values.map(|values| values.settings()),
            ahead: r.ahead.unsigned(),
            id: id(r.id),
            track: track(r.track),
            step: step(r),
        })
    });
    Some(InsiderOperatorConfig {
        holds,
        secret: secret.of(holds),
        certificate: certificate(s),
        unit: UnitId::A,
        orders: orders.collect(),
    })
}

/// The rogue's station at the gateway, when it has one.
pub(super) fn channel(s: &Scenario) -> Option<NodeId> {
    let first = s.rogue.first()?;
    (first.way == Way::Station).then_some(NodeId::INSIDER_OPERATOR)
}

/// The thief's plan, when the scenario has one.
pub(super) fn thief(s: &Scenario, phase: u64) -> Option<SessionThiefConfig> {
    let certificate = PeerId::from_name(s.takeover.first()?.certificate.as_str())?;
    let takeover = |t: &scenario::Takeover| Takeover {
        at_ms: start_ms(t, phase),
        duration_ms: (t.duration_s.get() * 1000.0) as u64,
        step: step(t),
    };
    Some(SessionThiefConfig { certificate, takeovers: s.takeover.iter().map(takeover).collect() })
}

/// For how long identities are admitted.
pub(super) fn mandates(s: &Scenario) -> Vec<Validity> {
    let mandate =
        |m: &scenario::Mandate| Some(Validity { who: node(&m.who)?, until_ms: (m.until_s.get() * 1000.0) as u64 });
    s.mandate.iter().filter_map(mandate).collect()
}

fn certificate(s: &Scenario) -> Option<PeerId> {
    let first = s.rogue.first().filter(|first| first.way == Way::Broker)?;
    let name = first.certificate.as_ref().unwrap_or(&first.holds);
    PeerId::from_name(name.as_str())
}

fn id(id: scenario::OrderId) -> OrderId {
    match id {
        scenario::OrderId::Next => OrderId::Next,
        scenario::OrderId::Last => OrderId::Last,
        scenario::OrderId::OlderBoot => OrderId::OlderBoot,
    }
}

fn track(track: scenario::OrderTrack) -> OrderTrack {
    match track {
        scenario::OrderTrack::Seen => OrderTrack::Seen,
        scenario::OrderTrack::Other => OrderTrack::Other,
    }
}

fn node(name: &Name) -> Option<NodeId> {
    NodeId::from_name(name.as_str())
}
