//! Conversion of a scenario's `[[rogue]]`, `[[takeover]]` and `[[mandate]]` tables to the plans of rogue and thief, and
//! everybody's revocation list.

use adversary::plan::{InsiderOperatorConfig, SessionThiefConfig};
use scenario::{Act, Name, Scenario, Way};
use wire::id::{NodeId, PeerId, UnitId};
use wire::trust::Validity;

use super::{RunSecret, attack};

/// The rogue's plan, when the scenario has one. Its key and its way come from the first table; the loader holds the
/// others equal to it.
pub(super) fn plan(s: &Scenario, phase: u64, secret: &RunSecret) -> Option<InsiderOperatorConfig> {
    let first = s.rogue.first()?;
    let holds = node(&first.holds)?;
    let orders =
        attack::acts(s, phase).filter_map(|act| if let Act::Orders(orders) = act { Some(orders) } else { None });
    Some(InsiderOperatorConfig {
        holds,
        secret: secret.signing_secret(holds),
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
    let occupied =
        attack::acts(s, phase).filter_map(|act| if let Act::Takeover(taken) = act { Some(taken) } else { None });
    Some(SessionThiefConfig { certificate, takeovers: occupied.collect() })
}

/// Validity of each identity with a limited mandate.
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

fn node(name: &Name) -> Option<NodeId> {
    NodeId::from_name(name.as_str())
}
