//! Receipt sabotage (N1): the instrument is informed that an injection happened when it did not, and must not believe
//! it.
//!
//! The trial is run twice from one seed, once as it is and once with idle hands. The actors' words from the first are
//! put into the log of the second: claims that name the right bytes, sides, sensors and processes, and are all untrue.
//! Judged with the plan, that log has to be INVALID, for any kind of action.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use evidence::{Evidence, Plan, Planned, Witnessed};
use ground_truth::{Any, Note};
use oracle::{Verdict, judge};
use scenario::{Scenario, Setup};
use topology::{RunSecret, lay_out};
use wire::event::Event;
use wire::id::NodeId;

use crate::part::make::AssemblyError;
use crate::trial::{begin, conclude, start};

/// A sabotaged trial, judged.
pub struct Sabotaged {
    /// The quiet log with the claims in it.
    pub evidence: Evidence,
    /// Verdict of the oracle on it.
    pub verdict: Verdict,
    /// Number of claims put in.
    pub claims: usize,
}

/// Sabotages the receipts of one trial in the twin.
///
/// # Errors
/// When a core cannot be made from its setup.
pub fn sabotage(scenario: &Scenario, setup: &Setup, seed: u64) -> Result<Sabotaged, AssemblyError> {
    let (attackers, twin) = start(scenario, setup, seed, false)?;
    let attacked = conclude(attackers, twin, setup);
    let idle = lay_out(scenario, setup, seed, &RunSecret::seeded(seed)).disarmed(scenario);
    let twin = begin(&idle, setup, seed, false)?;
    let mut evidence = conclude(idle, twin, setup).evidence;
    let claims: Vec<Witnessed> =
        attacked.evidence.entries.iter().filter(|w| is_claim(w, &attacked.evidence.planned)).copied().collect();
    evidence.entries.extend(&claims);
    evidence.entries.sort_by_key(|w| w.at);
    evidence.planned = attacked.evidence.planned;
    // The plan of the attack: the claims are about its actions, and are judged by it.
    evidence.killed = attacked.evidence.killed;
    let verdict = judge(&evidence);
    Ok(Sabotaged { evidence, verdict, claims: claims.len() })
}

/// True if an entry is an actor's word about its action: not its count, and not another's observation.
fn is_claim(w: &Witnessed, planned: &[Plan]) -> bool {
    let node = w.entry.node;
    let adversary = node.is_insider() || node == NodeId::RELAY_TELEMETRY || node == NodeId::RELAY_COMMAND;
    match w.entry.event {
        Any::Service(Event::Started | Event::Count { .. } | Event::Signed { .. }) => false,
        Any::Instrument(Note::Fault { .. } | Note::Altered { .. }) => node == NodeId::SIM,
        // Where an object stands that is said to be in disguise.
        Any::Instrument(Note::Object { object, .. }) => {
            planned.iter().any(|p| matches!(p.what, Planned::Disguise(of, _) | Planned::Print(of, _) if of == object))
        }
        Any::Instrument(Note::Printed { .. }) => true,
        Any::Service(Event::Pictured { .. }) => node == NodeId::SIM,
        Any::Instrument(Note::Ended { killed, .. }) => killed && node == NodeId::CAMPAIGN,
        Any::Instrument(Note::Suspended { .. } | Note::Halted { .. } | Note::DiskFull { .. } | Note::Step { .. })
            if node == NodeId::CAMPAIGN =>
        {
            true
        }
        _ => adversary,
    }
}
