//! The evidence of one trial, as the oracle is given it.

use wire::bounds::Bounds;

use crate::custody::Flaw;
use crate::mission::Script;
use crate::plan::Plan;
use crate::witnessed::{Micros, Witnessed};

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
    pub script: Script,
    /// Nodes that were killed on purpose; they owe no closing account.
    pub killed: Vec<wire::id::NodeId>,
}
