//! Reason of each change of the platform's mode, from its services' own logs.
//!
//! No receipt is read, no relay's, guard's or insider's log, no entry of the launcher, and of the sim only its plant's
//! actions: an explainer in the field has no more. A chain goes from the *origin* (the first place at which something was
//! not as it should be) over refusals, the guard and the transition to authority, plant and display. An origin is a place of the
//! platform and never an actor: whether a link was cut or jammed the services cannot know.
//!
//! `log` is the input, `origin` finds the source of a loss (with `link` for a lapsed lease and `sensing` for products),
//! `after` its consequences, `why_not` the obstacles to a mode. The correctness of an explanation is measured by
//! taking the named cause away (`lab explain`).

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

mod after;
mod chain;
mod link;
mod log;
mod origin;
mod sensing;
mod why_not;

use evidence::{Micros, Witnessed};
use ground_truth::Sensor;
use serde::Serialize;
use wire::bounds::Bounds;
use wire::id::{NodeId, UnitId};
use wire::mode::{Because, Cause, Guards, Mode};

pub use log::Log;
pub use why_not::{WhyNot, why_not};

/// Place of the first deviation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultSite {
    /// A person asked for it.
    Operator,
    /// A sensor of the unit, or its receiver.
    Sensor(Sensor),
    /// The vehicle's world: neither frames nor navigation come.
    World,
    /// Perception: none of its products, or none that is accepted.
    Perception,
    /// The designated track.
    Track,
    /// Path from the unit to the gateway.
    Uplink,
    /// Path from the gateway to the unit.
    Downlink,
    /// Both directions of the telemetry link.
    Telemetry,
    /// The carrier of orders and acknowledgements.
    CommandPlane,
    /// The gateway itself.
    Gateway,
    /// The console itself did not run.
    Console,
    /// Claims of a teammate.
    Teammate(UnitId),
    /// The recorder and its seals.
    Recorder,
    /// The unit itself did not run.
    Unit,
    /// The unit's way towards its fence.
    Course,
    /// The state machine: a time that was over, a recovery, an act.
    Machine,
}

/// Subject of a link of a chain, in the order of the chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LinkStage {
    /// The origin.
    Cause,
    /// Refusals of a boundary because of it.
    Refusals,
    /// Findings of the unit, the gateway or perception that followed.
    Health,
    /// The guard that fails.
    Guard,
    /// The change of mode.
    Transition,
    /// Fate of authority.
    Authority,
    /// Actions of the plant.
    Actuation,
    /// Display to the operator.
    Display,
}

/// One link of a chain, with the entry that shows it where one does.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ChainStep {
    /// Its subject.
    pub stage: LinkStage,
    /// Trace time.
    pub at_us: Micros,
    /// Node with that word.
    pub by: NodeId,
    /// Description in words.
    pub what: String,
}

/// Origin of a change of mode.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Origin {
    /// The place.
    pub place: FaultSite,
    /// Places from which the log cannot tell it: it may as well have been one of these.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub or: Vec<FaultSite>,
    /// Since when, at the latest.
    pub since_us: Micros,
    /// Fault there.
    pub what: String,
    /// Steps from there to the guard.
    #[serde(skip)]
    steps: Vec<ChainStep>,
}

/// Times from the origin to the change of mode and from there to its consequences, microseconds; `None` where the log
/// does not show one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Split {
    /// Time from the origin to the change.
    pub noticed_us: Micros,
    /// Time from the change to a plant that follows the mode's speed.
    pub plant_us: Option<Micros>,
    /// Time from the change to standing still, where that is required.
    pub standing_us: Option<Micros>,
    /// Time from the change to a display that shows the mode.
    pub display_us: Option<Micros>,
}

/// A change of mode, explained.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Explanation {
    /// Trace time of the change.
    pub at_us: Micros,
    /// Mode before.
    pub from: Mode,
    /// Mode after.
    pub to: Mode,
    /// The cause that the unit names.
    pub cause: Cause,
    /// Origin of the cause.
    pub origin: Origin,
    /// The chain, in order of stage and time.
    pub chain: Vec<ChainStep>,
    /// Duration of the parts of the chain.
    pub split: Split,
}

impl Explanation {
    /// True if it took authority or freedom away without a request for it.
    pub fn restricts(&self) -> bool {
        matches!(self.cause, Cause::Lost(_) | Cause::Unrecovered(_))
    }
}

/// A change of mode as the unit wrote it.
#[derive(Clone, Copy, Debug)]
struct Change {
    at: Micros,
    /// The unit's own clock less trace time: the shift of its stamps.
    local: i128,
    from: Mode,
    to: Mode,
    cause: Cause,
    because: Because,
    failing: Guards,
}

/// Every change of mode of the unit under test, explained; in order.
pub fn explain(entries: &[Witnessed], bounds: &Bounds) -> Vec<Explanation> {
    let log = Log::from_entries(entries, *bounds);
    log.changes().iter().map(|change| explained(&log, change)).collect()
}

fn explained(log: &Log, change: &Change) -> Explanation {
    let mut origin = origin::find(log, change);
    let mut chain = std::mem::take(&mut origin.steps);
    let (after, mut split) = after::follow(log, change);
    chain.push(ChainStep {
        stage: LinkStage::Transition,
        at_us: change.at,
        by: NodeId::UNIT_A,
        what: change_text(change),
    });
    chain.extend(after);
    chain.sort_by_key(|step| (step.stage, step.at_us));
    split.noticed_us = change.at.saturating_sub(origin.since_us);
    let Change { at, from, to, cause, .. } = *change;
    Explanation { at_us: at, from, to, cause, origin, chain, split }
}

fn change_text(change: &Change) -> String {
    format!("{} to {}, {}", change.from.name(), change.to.name(), change.cause.label())
}
