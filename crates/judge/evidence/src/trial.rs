//! Row of one trial, the same for the twin and for live runs.
//!
//! The engines fill a [`Trial`]; the oracle gives its [`Outcome`]; `report` folds trials into rows. No code here judges.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, Serializer};

use crate::InjectionRow;
use crate::claims::Claims;
use crate::mission::Mission;
use crate::process_fault::Response;

/// Outcome of a trial; the first class that matches, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub enum Outcome {
    /// A safety property was broken (P1, P4, P5, P7, P8, P9, P11, P12).
    Unsafe,
    /// The guest that drove failed: it ended, was silent, or broke its protocol.
    GuestFailed,
    /// The evidence does not hold: no receipt, the accounts do not balance, the log does not verify, the host stalled, or
    /// the mission that the scenario presumes did not take place.
    Invalid,
    /// Only a time bound was missed (P2, P3).
    Late,
    /// Authority or freedom was lost without a fault or a true hazard.
    FalseTrip,
    /// Ended in HOLD_SAFE.
    HoldSafe,
    /// Ended in DEGRADED.
    Degraded,
    /// Refused, or shown to the operator as an alarm; no change of mode.
    Rejected,
    /// Accepted, no response, no property broken.
    Undetected,
    /// No attack and no event, and the vehicle made no progress though its mode let it drive and way points were left.
    Stuck,
    /// No attack and no event.
    Nominal,
}

impl Outcome {
    /// Every class, in the order in which they are checked.
    pub const ALL: [Outcome; 11] = [
        Outcome::Unsafe,
        Outcome::GuestFailed,
        Outcome::Invalid,
        Outcome::Late,
        Outcome::FalseTrip,
        Outcome::HoldSafe,
        Outcome::Degraded,
        Outcome::Rejected,
        Outcome::Undetected,
        Outcome::Stuck,
        Outcome::Nominal,
    ];

    /// True if it counts as unexpected. Without an expectation, only the outcomes that no run should have count.
    pub fn is_unexpected(self, expected: &[Outcome]) -> bool {
        if expected.is_empty() {
            matches!(self, Outcome::Unsafe | Outcome::GuestFailed | Outcome::Invalid)
        } else {
            !expected.contains(&self)
        }
    }

    /// The name in every file and table.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Unsafe => "UNSAFE",
            Outcome::GuestFailed => "GUEST_FAILED",
            Outcome::Invalid => "INVALID",
            Outcome::Late => "LATE",
            Outcome::FalseTrip => "FALSE_TRIP",
            Outcome::HoldSafe => "HOLD_SAFE",
            Outcome::Degraded => "DEGRADED",
            Outcome::Rejected => "REJECTED",
            Outcome::Undetected => "UNDETECTED",
            Outcome::Stuck => "STUCK",
            Outcome::Nominal => "NOMINAL",
        }
    }
}

/// Count of each class; classes without trials are left out.
pub type Outcomes = BTreeMap<Outcome, u64>;

/// Writes counts in the alphabetical order of the classes' names, and not in the order of severity that [`Outcome`] has.
///
/// # Errors
/// When the serializer fails.
pub fn by_name<S: Serializer>(outcomes: &Outcomes, to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(outcomes.iter().map(|(class, n)| (class.name(), n)).collect::<BTreeMap<_, _>>())
}

/// Knowledge of an adversary about the run while it is on. Each level includes the ones before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Knowledge {
    /// Its own clock and its own steps; it acts on passing traffic without reading it.
    #[default]
    Blind,
    /// Lengths, times and directions of passing traffic, and the bytes as ciphertext.
    OnPath,
    /// Messages that its credentials let it receive.
    Insider,
    /// The instrument plane: modes and transitions as they are written.
    WhiteBox,
}

impl Knowledge {
    /// Its name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Knowledge::Blind => "blind",
            Knowledge::OnPath => "on-path",
            Knowledge::Insider => "insider",
            Knowledge::WhiteBox => "white-box",
        }
    }
}

/// A change of mode of the platform under test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TransitionRow {
    /// Trace time from the start of the trial, in milliseconds.
    pub t_ms: f64,
    /// Mode before, as in `wire`.
    pub from: String,
    /// Mode after.
    pub to: String,
    /// The named cause.
    pub cause: String,
}

/// The beginning of a step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepRow {
    /// Its name.
    pub step: String,
    /// Trace time from the start of the trial, in milliseconds.
    pub t_ms: f64,
}

/// Times from the receipt of the injection to its effects, in milliseconds; `None` where the effect did not happen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Latency {
    /// Time to DEGRADED (or straight to HOLD_SAFE).
    pub to_degraded: Option<f64>,
    /// Time to HOLD_SAFE.
    pub to_hold_safe: Option<f64>,
    /// Time to the loss of authority.
    pub to_authority_revoked: Option<f64>,
}

/// The guest that drove in a trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GuestRow {
    /// Its name.
    pub name: String,
    /// True if its set-points went to the plant as they were.
    pub bare: bool,
    /// Steps that it answered.
    pub steps: u32,
    /// Set-points that the guards limited.
    pub limited: u32,
    /// Its failure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<GuestFailure>,
    /// Properties that are not judged, each with the reason.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub not_judged: Vec<String>,
}

/// The failure of a guest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GuestFailure {
    /// Time of the run, ms.
    pub at_ms: f64,
    /// Kind.
    pub fault: String,
    /// Expected and received value.
    #[serde(rename = "why")]
    pub reason: String,
}

/// One trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// The seed that reproduces it.
    pub seed: u64,
    /// The cell it belongs to, where the scenario has cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cell: Option<String>,
    /// Knowledge of the adversary.
    #[serde(default)]
    pub knowledge: Knowledge,
    /// Beginnings of the named steps of the attack, milliseconds of the run, in order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub steps: Vec<StepRow>,
    /// The class that the oracle gave.
    pub outcome: Outcome,
    /// Reason for that class: the broken property, the missing receipt; empty where the class alone is enough.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<String>,
    /// True if a second witness saw an injection at its target, and the obstacle of each that did not arrive is known (true without an
    /// injection).
    pub receipt: bool,
    /// Fate of each planned injection.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub injections: Vec<InjectionRow>,
    /// SHA-256 over the canonical events, hexadecimal.
    pub log_hash: String,
    /// SHA-256 over modes, verdicts, reasons and ticks, hexadecimal.
    pub decision_hash: String,
    /// Records delivered to the boundary: `accepted` and the sum of `dropped`. Datagrams that a guard refused do not count.
    pub received: u64,
    /// Records that it accepted.
    pub accepted: u64,
    /// Records that it refused, by reason.
    pub dropped: BTreeMap<String, u64>,
    /// Refusals of the record filters in front of the sessions of gateway and unit, and handshakes that were not
    /// completed, by reason.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub guard_refused: BTreeMap<String, u64>,
    /// Datagrams that no process of the run sent, by the socket that received them: counted apart, and no part of the class. Live only.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub outsiders: BTreeMap<String, u64>,
    /// Longest time for which the host overslept or kept a service waiting for a core, milliseconds. Live only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub host_late_ms: Option<f64>,
    /// That time, where it alone makes this live trial INVALID.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub host_stall_ms: Option<f64>,
    /// That time of each earlier attempt at this trial, which was repeated because of it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub host_spoilt_ms: Vec<f64>,
    /// Confinement of its services: `full`, or `partial` or `none` with the reasons. Live only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confinement: Option<String>,
    /// Statements of an admitted teammate in bad faith, where it made any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub claims: Option<Claims>,
    /// The guest that drove in place of the platform's own mission and navigation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub guest: Option<GuestRow>,
    /// Progress of the mission; none on the real stacks, which have no mission.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mission: Option<Mission>,
    /// Changes of mode, in order.
    pub transitions: Vec<TransitionRow>,
    /// Times from the injection.
    pub latency_ms: Latency,
    /// SHA-256 of the `held.json` in its run directory, hexadecimal: a receiver of the directory compares the two.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held: Option<String>,
    /// Responses to each process that was killed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub responses: Vec<Response>,
    /// Simulated (twin) or real (live) seconds.
    pub sim_seconds: f64,
    /// Losses of authority or freedom without an injected fault or true hazard.
    #[serde(skip)]
    pub false_trips: u32,
    /// Seconds in nominal control (READY or above).
    #[serde(skip)]
    pub nominal_seconds: f64,
    /// CPU time it took, all processes together.
    #[serde(skip)]
    pub cpu_seconds: f64,
}

impl Trial {
    /// A trial of ten seconds with this outcome and invented figures, for tests of code that reads trials.
    pub fn example(seed: u64, outcome: Outcome) -> Trial {
        Trial {
            seed,
            cell: None,
            knowledge: Knowledge::Blind,
            steps: Vec::new(),
            outcome,
            findings: Vec::new(),
            receipt: true,
            injections: Vec::new(),
            log_hash: format!("{seed:064x}"),
            decision_hash: format!("{:064x}", seed % 3),
            received: 100,
            accepted: 90,
            dropped: BTreeMap::from([("stale".to_owned(), 10)]),
            guard_refused: BTreeMap::new(),
            outsiders: BTreeMap::new(),
            host_late_ms: None,
            host_stall_ms: None,
            host_spoilt_ms: Vec::new(),
            confinement: None,
            claims: None,
            guest: None,
            mission: None,
            transitions: Vec::new(),
            latency_ms: Latency { to_degraded: Some(seed as f64), ..Latency::default() },
            responses: Vec::new(),
            held: None,
            sim_seconds: 10.0,
            false_trips: 0,
            nominal_seconds: 4.0,
            cpu_seconds: 0.01,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_expectation_excludes_unsafe_and_invalid_only() {
        assert!(Outcome::Unsafe.is_unexpected(&[]) && Outcome::Invalid.is_unexpected(&[]));
        assert!(!Outcome::HoldSafe.is_unexpected(&[]));
        assert!(Outcome::HoldSafe.is_unexpected(&[Outcome::Rejected]));
    }

    #[test]
    fn a_class_is_written_as_it_is_named() {
        for class in Outcome::ALL {
            assert_eq!(serde_json::to_string(&class).unwrap(), format!("\"{}\"", class.name()));
        }
    }
}
