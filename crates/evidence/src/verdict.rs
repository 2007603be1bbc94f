//! The verdict on one trial, as the oracle gives it.

use serde::Serialize;

use crate::fate::Injection;
use crate::mission::Mission;
use crate::process_fault::Response;
use crate::trial::{GuestRow, Latency, Outcome, TransitionRow};
use crate::witnessed::Micros;

/// The properties of `ARCHITECTURE.md`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub enum Property {
    /// No act without authority, fresh confirmation and all guards.
    P1,
    /// Loss of a subsystem revokes authority and degrades in time.
    P2,
    /// Loss of trust reaches HOLD_SAFE in time.
    P3,
    /// Never outside the envelope, moving or not, never driving into an object or faster than the margins are made for.
    P4,
    /// No content of an unaccepted record influences state.
    P5,
    /// Conservation.
    P6,
    /// No value is shown fresh beyond its limit.
    P7,
    /// Commands execute at most once, never late.
    P8,
    /// Recovery only by the rules.
    P9,
    /// The log verifies, and the cores of a live run are functions of their input journals.
    P10,
    /// No authority or act on the wrong object.
    P11,
    /// Of a platform that leaves the ground: never below the reserve of energy, or nearer than the least distance to the surface below.
    P12,
}

/// A property found broken.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Which.
    pub property: Property,
    /// Time, microseconds of trace time.
    pub at_us: Micros,
    /// Expected and seen.
    pub what: String,
}

/// Verdict of the judge on a trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The one class.
    pub outcome: Outcome,
    /// Everything found, in order.
    pub findings: Vec<Finding>,
    /// True if a planned injection provably arrived, and each that did not was provably kept from it. True for a null attack.
    pub receipt: bool,
    /// Fate of each planned injection.
    pub injections: Vec<Injection>,
    /// Time at which the first injection took hold, by its receipt.
    pub zero: Option<Micros>,
    /// Latencies from `zero`.
    pub latency: Latency,
    /// Transitions of the unit under test.
    pub transitions: Vec<TransitionRow>,
    /// Losses of authority or restrictions with no injected fault before them.
    pub false_trips: u32,
    /// Time in READY or PREPARE_TO_ACT.
    pub nominal: Micros,
    /// Progress of the mission, and its missing parts.
    pub mission: Mission,
    /// Responses to each process that was killed.
    pub responses: Vec<Response>,
    /// The guest that drove, and what is not judged of it.
    pub guest: Option<GuestRow>,
}
