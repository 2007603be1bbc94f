//! Checks of messages from the gateway, which are untrusted again: tag, schema and order of the feed, then its content.
//!
//! A report reaches the model only as `Accepted`, which the unit's own signature earns here; an acknowledgement only
//! when its unit signed it for the very intent that the console gave. The gateway is believed only in what it alone can
//! know: which peer's session brought a report. The console itself bounds the age of a report, by a challenge that the
//! unit repeats in it. Folding is left to `model`.

use std::collections::BTreeMap;

use wire::bounds::Bounds;
use wire::command::{Ack, IntentHash};
use wire::feed::{AcceptedReport, Feed};
use wire::id::{CommandId, Nonce, UnitId};
use wire::policy::{DisplayPolicy, DisplayRule, Policy, Requirement};
use wire::refusal::Refusal;
use wire::sign::Keyring;
use wire::time::{Age, AgeBound, Instant};
use wire::trust::{Accepted, BusGate, Decoded, SignedReport, SignedStatement, Windows};

use crate::age::lost_after;

/// The console's side of the boundary.
#[derive(Clone, Debug)]
pub struct Intake {
    policy: Policy,
    display: DisplayPolicy,
    bounds: Bounds,
    keys: Keyring,
    gate: BusGate,
    reports: Windows,
    /// Ages of the units' reports, by the console's own challenges.
    ages: BTreeMap<UnitId, AgeBound>,
}

impl Intake {
    /// An intake behind `gate`.
    pub fn new(policy: Policy, bounds: Bounds, keys: Keyring, gate: BusGate, units: &[UnitId]) -> Self {
        let display = policy.of_display();
        let reports = Windows::new(bounds.replay_window, bounds.sequence_jump);
        let ages = units.iter().map(|unit| (*unit, AgeBound::new(bounds.echo_limit()))).collect();
        Self { policy, display, bounds, keys, gate, reports, ages }
    }

    /// Notes a new challenge of the console, which is on its way to the units.
    pub fn challenge(&mut self, challenge: Nonce, now: Instant) {
        self.ages.values_mut().for_each(|ages| ages.issue(challenge, now));
    }

    /// Time at which the console sent this challenge to the unit, if an echo of it is still accepted.
    pub fn sent(&self, unit: UnitId, challenge: Nonce) -> Option<Instant> {
        self.ages.get(&unit)?.sent(challenge)
    }

    /// Judges a message of the feed.
    pub fn feed<'b>(&mut self, now: Instant, bytes: &'b [u8]) -> Result<Accepted<Feed<'b>>, Refusal> {
        self.gate.admit(&self.policy, now, bytes)
    }

    /// Judges the report in a message: of the unit that the gateway names, under that unit's signature, younger than
    /// the bound beyond which a unit is lost, in order. An age above *Tf* is accepted: the display shows the age. The
    /// age is bounded by the console's own challenge, which the unit repeats under its signature; the gateway's
    /// statement can only make the report older.
    pub fn report<'b>(
        &mut self,
        now: Instant,
        message: &AcceptedReport<'b>,
    ) -> Result<Accepted<SignedReport<'b>>, Refusal> {
        let decoded = SignedReport::decode(now, message.report)?;
        let (origin, _) = decoded.claim();
        match origin.unit() {
            Some(unit) if unit == message.unit => {}
            Some(got) => return Err(Refusal::Unit { expected: message.unit, got }),
            None => return Err(Refusal::Role { got: origin }),
        }
        // Both clocks are this host's; a stated reception in the future still cannot make the report younger.
        let on_the_way = Age::on_one_host(message.received, now);
        let claimed = message.age.map(|before| on_the_way.plus(before));
        // The echo in the report is the unit's only once the report is; until then it counts for this report alone.
        let mut ages = self.ages.get(&message.unit).cloned();
        let own_age = ages.as_mut().and_then(|ages| bound(ages, &decoded, now));
        let age = match self.policy.display(DisplayRule::Watch) {
            Requirement::Required => claimed.zip(own_age).map(|(claimed, own_age)| claimed.max(own_age)),
            Requirement::Waived => claimed,
        };
        let checks = self.display.checks();
        let accepted = decoded
            .fresh(checks, age, lost_after(&self.bounds), self.bounds.echo_limit())?
            .by_signature(&self.display, &self.keys)?
            .from_origin(checks, message.via, &mut self.reports)?
            .accept(checks)?;
        if let Some(ages) = ages {
            self.ages.insert(message.unit, ages);
        }
        Ok(accepted)
    }

    /// An acknowledgement of a command that `find` knows by its signed intent, with its id and its addressee.
    pub fn acknowledgement(
        &self,
        now: Instant,
        bytes: &[u8],
        find: impl FnOnce(&IntentHash) -> Option<(CommandId, UnitId)>,
    ) -> Result<Accepted<Ack>, Refusal> {
        let decoded = Decoded::<SignedStatement<'_, Ack>>::parse_statement(now, bytes)?;
        let (expected, intent) = decoded.claimed();
        let (id, unit) = find(&intent).ok_or(Refusal::Confirmation { expected })?;
        decoded.by_signer(&self.policy, unit.node(), &self.keys)?.about_intent(id, &intent)
    }
}

/// Bound of the report's age by the console's own challenges, its own echo among them.
fn bound(ages: &mut AgeBound, decoded: &Decoded<SignedReport<'_>>, now: Instant) -> Option<Age> {
    if let Some(echo) = decoded.watched() {
        ages.prove(echo);
    }
    let (_, stamp) = decoded.claim();
    ages.age(stamp, now)
}
