//! The evidence of one trial, as the oracle is given it.

use config::contact::Contacts;
use wire::bounds::Bounds;
use wire::sensor::Camera;

use crate::mission::Script;
use crate::plan::Plan;
use crate::progress::Route;
use crate::under::Under;
use crate::witnessed::{Micros, Witnessed};

/// Flaw of a recording, with its place.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Flaw {
    /// The event of the recording, counted from 1; behind the last one for a missing part.
    pub at: usize,
    /// Description.
    pub what: String,
}

impl core::fmt::Display for Flaw {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "event {}: {}", self.at, self.what)
    }
}

/// Everything the judge gets to see.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// The unit under test, by whose behaviour the run is judged.
    pub under: Under,
    /// Events in (time, node, counter) order.
    pub entries: Vec<Witnessed>,
    /// First problem found while following the chains and seals, if any.
    pub broken_log: Option<String>,
    /// Flaws of the recording against its trust anchors outside the recorder (`recording::log`). Such a log is no
    /// evidence of safety or of its lack.
    pub log_flaws: Vec<Flaw>,
    /// Differences of a live run's cores when their input journals were replayed, each with its core and input.
    /// Empty in the twin, where no process stands between a core and its log.
    pub differences: Vec<String>,
    /// Bounds in force.
    pub bounds: Bounds,
    /// The platform's camera.
    pub camera: Camera,
    /// The plan, table by table; empty for a null attack.
    pub planned: Vec<Plan>,
    /// Duration of the run.
    pub duration: Micros,
    /// Longest time that the host itself may oversleep before a live run is void.
    pub stall_limit: Micros,
    /// Identities that may give commands, each with its end of validity; `Micros::MAX` without one.
    pub operators: Vec<(wire::id::NodeId, Micros)>,
    /// The operator's script, and the required progress of the mission.
    pub script: Script,
    /// Route of the unit under test.
    pub route: Route,
    /// Contact plan of the link between the unit and the gateway, from the start of its relays.
    pub contacts: Contacts,
    /// Nodes that were killed on purpose; no closing account is required of them.
    pub killed: Vec<wire::id::NodeId>,
}
