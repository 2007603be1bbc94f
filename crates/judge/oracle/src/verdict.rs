//! Verdict on a trial.

use evidence::mission::Mission;
use evidence::process_fault::Response;
use evidence::trial::{GuestRow, Latency, Outcome, TransitionRow};
use evidence::{Injection, Micros};

use crate::properties::Finding;

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
