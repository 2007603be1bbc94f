//! The independent judge of a trial.
//!
//! It reads the instrument plane's events and nothing else: no predicate of the boundary, of autonomy or of the
//! gateway is used. What a service did is judged from witnesses outside it as far as there are any: set-points as the plant
//! holds them and acts as it received them, true pose and speed, the relay's and the guards' own logs, what the display
//! showed. The unit's mode, its authority and what it executed are its own word, held against these. `ARCHITECTURE.md`
//! says of each property which witness judges it and what is the unit's word alone.
//!
//! `timeline` sorts the events by what they are about, `plan` is what was set out to be done and when, `receipt`, `stream`,
//! `planes`, `view`, `mouth`, `life` and `disguise` decide whether the fault provably arrived, `masked` what else kept it from arriving, `fate` says what became of each, `conservation` adds up the accounts, `properties` holds P1 to P11 (with `guards` for what others than the unit know of P1's guards, `speed` for the speeds of
//! every mode, `effect` for what executions bring about, `content` for P5, `display` for P7, `link` for P3 on the telemetry link, `place` for
//! where the unit takes itself to be, `takeover` for sessions that somebody else took, `stale` for the age of what was accepted, `orders` for the values that a unit was set to
//! and what a rogue sent), `demise` what is owed when a process is killed, `outcome` picks the one class. `mission` is whether
//! what the scenario presumes took place, `nearness` says how near
//! a trial came to what would have been judged, and judges nothing.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

mod conservation;
mod content;
pub mod demise;
mod disguise;
mod display;
mod effect;
pub mod fate;
mod guards;
mod life;
mod link;
mod masked;
pub mod mission;
mod mouth;
mod nearness;
mod orders;
mod outcome;
pub mod peers;
mod place;
pub mod plan;
mod planes;
mod properties;
mod receipt;
mod speed;
mod stale;
mod stream;
mod takeover;
mod timeline;
mod view;

use serde::Serialize;
use wire::audit::Entry;
use wire::bounds::Bounds;

use crate::custody::Flaw;
use crate::trial::{Latency, Outcome, TransitionRow};

pub use fate::{Fate, FateName, Injection, InjectionRow, Mask};
pub use nearness::{AT_LIMIT, Limit, Nearness, nearness};
pub use outcome::stalled;
pub use plan::{Needs, Plan, Planned, Takes};
pub use timeline::Timeline;

/// Microseconds of trace time: true time in the twin, one common host clock live. No core reads it.
pub type Micros = u64;

/// An event with the time at which the instrument plane saw it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Witnessed {
    /// Trace time.
    pub at: Micros,
    /// The audit entry.
    pub entry: Entry,
}

/// Everything the judge gets to see.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// Events in (time, node, counter) order.
    pub entries: Vec<Witnessed>,
    /// First problem found while following the chains and seals, if any.
    pub broken_log: Option<String>,
    /// What does not hold of the recording against what is held outside the recorder (`crate::custody`). Such a log is no
    /// evidence of safety or of its lack.
    pub custody: Vec<Flaw>,
    /// What the cores of a live run did otherwise when they were fed their mouth logs again, each with its core and input.
    /// Empty in the twin, where nothing stands between a core and its log.
    pub differences: Vec<String>,
    /// Bounds in force.
    pub bounds: Bounds,
    /// What was planned, table by table; empty for a null attack.
    pub planned: Vec<Plan>,
    /// Length of the run.
    pub duration: Micros,
    /// How long the host itself may oversleep before a live run is void.
    pub stall_limit: Micros,
    /// Who may give commands, and until when; `Micros::MAX` where nothing was said.
    pub operators: Vec<(wire::id::NodeId, Micros)>,
    /// What the operator was to do, and how far the mission has to come.
    pub script: mission::Script,
    /// Nodes that were killed on purpose; they owe no closing account.
    pub killed: Vec<wire::id::NodeId>,
}

/// The properties of `ARCHITECTURE.md`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub enum Property {
    /// No act without authority, fresh confirmation and all guards.
    P1,
    /// Loss of a subsystem revokes authority and degrades in time.
    P2,
    /// Loss of trust reaches HOLD_SAFE in time.
    P3,
    /// Never driving outside the geofence.
    P4,
    /// No content of an unaccepted record influences state.
    P5,
    /// Conservation.
    P6,
    /// Nothing is shown fresh beyond its limit.
    P7,
    /// Commands execute at most once, never late.
    P8,
    /// Recovery only by the rules.
    P9,
    /// The log verifies, and the cores of a live run are functions of their mouth logs.
    P10,
    /// No authority or act on the wrong object.
    P11,
}

/// A property found broken.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Which.
    pub property: Property,
    /// When, microseconds of trace time.
    pub at_us: Micros,
    /// What was expected and what was seen.
    pub what: String,
}

/// What the judge says of a trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The one class.
    pub outcome: Outcome,
    /// Everything found, in order.
    pub findings: Vec<Finding>,
    /// Whether a planned injection provably arrived, and each that did not was provably kept from it. True for a null attack.
    pub receipt: bool,
    /// What became of each planned injection.
    pub injections: Vec<Injection>,
    /// When the first injection took hold, by its receipt.
    pub zero: Option<Micros>,
    /// Latencies from `zero`.
    pub latency: Latency,
    /// Transitions of the unit under test.
    pub transitions: Vec<TransitionRow>,
    /// Losses of authority or restrictions with no injected fault before them.
    pub false_trips: u32,
    /// Time in READY or PREPARE_TO_ACT.
    pub nominal: Micros,
    /// How far the mission came, and what of it is missing.
    pub mission: mission::Mission,
    /// What came of each process that was killed.
    pub responses: Vec<demise::Response>,
}

/// Judges a trial.
pub fn judge(evidence: &Evidence) -> Verdict {
    let timeline = Timeline::of(evidence);
    let receipt = receipt::find(evidence);
    let mut findings = properties::check(evidence, &timeline, &receipt);
    findings.extend(conservation::check(evidence));
    findings.extend(orders::check(evidence));
    findings.extend(takeover::check(evidence));
    findings.extend(place::check(evidence, &timeline));
    findings.extend(stale::check(evidence, &receipt));
    let (responses, owed) = demise::judge(evidence, &timeline);
    findings.extend(owed);
    findings.sort_by_key(|f| (f.at_us, f.property));
    Verdict { responses, ..outcome::verdict(evidence, &timeline, receipt, findings) }
}

fn finding(property: Property, at_us: Micros, what: impl Into<String>) -> Finding {
    Finding { property, at_us, what: what.into() }
}
