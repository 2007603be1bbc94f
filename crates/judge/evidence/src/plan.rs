//! Injections that the scenario plans, one entry for each of its tables, and their times. Each needs its own receipt: the action of
//! another table of the same kind is none.

use ground_truth::{Action, BusAttack, FaultKind, Sensor, StepName, StreamEffect};
use serde::Serialize;
use wire::core::Side;
use wire::id::{NodeId, ObjectId, PeerId};
use wire::sensor::Class;

use super::Micros;

/// Planned injection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Planned {
    /// An action of the relay, of a teammate, or of a rogue on shared memory.
    Action(Action),
    /// Something that the relay does to a byte stream.
    Stream(StreamEffect),
    /// Something that a hostile broker does to publications.
    Broker(Action),
    /// Action of a gateway insider on messages to the display.
    Feed(Action),
    /// Reports that a gateway insider passes on to the display with this delay.
    Late(Micros),
    /// A command that a gateway insider keeps from the gateway.
    Swallowed,
    /// Authenticated and broken records of an insider.
    Malformed,
    /// A fault of a sensor.
    Fault(Sensor, FaultKind),
    /// An object was to be taken for one of this class, by the paint it bears.
    Disguise(ObjectId, Class),
    /// An object was to be taken for one of this class, by the print on it.
    Print(ObjectId, Class),
    /// Objects of other classes were to be taken for ones of this class, by a pattern added to every image.
    Perturbation(Class),
    /// Orders of a rogue station.
    Rogue,
    /// The session of this identity at the broker was to be taken over.
    Takeover(PeerId),
    /// A process was to end.
    Kill(NodeId),
    /// A process was to be kept from running.
    Suspend(NodeId),
    /// The disk of a process was to be full.
    Fill(NodeId),
    /// An attack on the bus of the guest's own programs.
    GuestBus(BusAttack),
    /// A named step was to begin.
    Step(StepName),
}

/// Messages of others that an injection acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Takes {
    /// Records of the telemetry link, on their way to this side of it or, without one, to either.
    Records(Option<Side>),
    /// Pieces of the streams of the command plane, either way.
    Pieces,
    /// Publications on the command plane.
    Publications {
        /// On their way to the unit (client) or from it (server); either where none is given.
        to: Option<Side>,
        /// Only those about an order that asks this.
        asks: Option<&'static str>,
        /// True if messages before its time count as well, since they are sent again.
        ever: bool,
    },
    /// Requests of the operator to the gateway: this, or any.
    Orders(Option<&'static str>),
    /// Reports of the unit under test that the gateway accepts.
    Reports,
}

/// Conditions for an injection to arrive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Needs {
    /// Processes that run.
    pub running: &'static [NodeId],
    /// Messages that it acts on.
    pub takes: Option<Takes>,
}

/// A planned injection with its time and its conditions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Plan {
    /// Injection.
    pub what: Planned,
    /// Earliest time.
    pub from: Micros,
    /// Latest time, where it begins at its own time.
    pub until: Micros,
    /// The step that it is a part of; it then lasts from the beginning of the step to its end.
    pub step: Option<StepName>,
    /// Conditions for it to arrive.
    pub needs: Needs,
}

impl From<Planned> for Plan {
    /// A plan for any time of the run.
    fn from(injection: Planned) -> Self {
        Plan { what: injection, from: 0, until: Micros::MAX, step: None, needs: Needs::default() }
    }
}
