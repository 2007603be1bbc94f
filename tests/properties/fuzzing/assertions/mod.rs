//! Properties of every trial, under any attack.
//!
//! `properties` are the oracle's; the others compare a trial with `reference`: `supervision` the effect of silence, `losses`
//! that of losing a part, `insiders` the limits of credential holders, `orders` the authority behind orders, `display` the
//! display, `accounts` the sums. Each comes with a trial that satisfies it and one that breaks it. Where a check of the policy
//! carries one by itself, that is waived and the assertion seen to break.

mod accounts;
mod display;
mod insiders;
mod losses;
mod orders;
mod properties;
mod supervision;

use super::deeds::{Deed, Deeds};
use super::reference::{Change, Limits};
use super::witness::Witness;

/// Input of an assertion.
#[derive(Clone, Debug, Default)]
pub(super) struct Facts {
    /// The oracle's findings.
    pub(super) findings: Vec<String>,
    /// Digest of every decision of the trial; the witness has its own.
    pub(super) decisions: String,
    /// The unit's changes of mode, in the trial and in the mission.
    pub(super) changes: Vec<Change>,
    pub(super) mission: Vec<Change>,
    /// Changes in a trial in which every silence lasts longer, where the attack is silence alone.
    pub(super) longer: Option<Vec<Change>>,
    pub(super) deeds: Deeds,
    pub(super) witness: Witness,
    pub(super) limits: Limits,
    pub(super) duration_ms: f64,
}

/// One assertion.
pub(super) struct Assertion {
    pub(super) name: &'static str,
    pub(super) holds: fn(&Facts) -> Result<(), String>,
    /// A trial that it holds of, and one that breaks it.
    pub(super) examples: fn() -> (Facts, Facts),
    /// The check that carries it, and an attack space that breaks it without.
    pub(super) carried_by: Option<(&'static str, &'static str)>,
}

/// All of them.
pub(super) fn all() -> impl Iterator<Item = &'static Assertion> {
    let assertions = [supervision::ALL, losses::ALL, insiders::ALL, orders::ALL, display::ALL, accounts::ALL];
    properties::ALL.iter().chain(assertions.into_iter().flatten())
}

fn names(changes: &[Change]) -> Vec<(&str, &str)> {
    changes.iter().map(|change| (change.from.as_str(), change.to.as_str())).collect()
}

fn same_modes(facts: &Facts) -> Result<(), String> {
    let (trial, mission) = (names(&facts.changes), names(&facts.mission));
    if trial == mission { Ok(()) } else { Err(format!("the unit went {trial:?}, without the word {mission:?}")) }
}

/// Fails with the first that there is.
fn none(found: Option<String>) -> Result<(), String> {
    found.map_or(Ok(()), Err)
}

fn change(at_ms: f64, from: &str, to: &str) -> Change {
    Change { at_ms, from: from.to_owned(), to: to.to_owned() }
}

/// A trial that goes as its mission does, with these moves at 3 s for 4 s.
fn trial(space: &str, moves: &[&str]) -> Facts {
    let deed = |name: &&str| Deed { of: (*name).to_owned(), from_ms: 3_000.0, lasts_ms: 4_000.0, number: 1.0 };
    let mission = vec![change(1_000.0, "IDLE", "READY")];
    Facts {
        changes: mission.clone(),
        mission,
        deeds: Deeds { space: space.to_owned(), done: moves.iter().map(deed).collect() },
        duration_ms: 9_000.0,
        limits: Limits {
            hold: 1_000.0,
            degraded: 550.0,
            lease: 600.0,
            grace: 250.0,
            seal: 1_100.0,
            rest: 1_350.0,
            report: 100.0,
            shown: 500.0,
            obeyed: 150.0,
            slack_m: 1.5,
        },
        ..Facts::default()
    }
}

/// The facts, but that the unit holds from 4 s on.
fn holding(space: &str, moves: &[&str]) -> Facts {
    let mut facts = trial(space, moves);
    facts.changes.push(change(4_000.0, "READY", "HOLD_SAFE"));
    facts
}
