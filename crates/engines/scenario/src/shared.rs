//! A host's shared memory, where a rogue process speaks on channels which are others'.
//!
//! The channel determines the host, `holder` the service that the process has the keys of. Without one it is an impostor of the
//! same user with no key; with one it is an insider in that service's place. A rogue has no steps: its tables begin at their
//! time.

use adversary::plan::{RogueMove, Says, Spot};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::core::Topic;
use wire::id::NodeId;

use super::Windowed;
use super::scene::Point;
use super::value::Whole;

/// Time between two messages.
pub type Every = Whole<1, 60_000>;

/// True if a channel is on the control host; the others are on the vehicle's.
pub fn on_control(topic: Topic) -> bool {
    matches!(topic, Topic::Feed | Topic::Intents)
}

/// The rogue's action on a channel, from the start of a table to its end.
pub(crate) fn overwritten(
    topic: Topic,
    windowed: &dyn Windowed,
    phase_ms: u64,
    every_ms: u64,
    says: Says,
) -> RogueMove {
    RogueMove {
        topic,
        producer: producer(topic),
        at_ms: windowed.start_ms(phase_ms),
        duration_ms: windowed.length_ms(),
        every_ms,
        says,
    }
}

fn producer(topic: Topic) -> NodeId {
    match topic {
        Topic::Candidates | Topic::Frames | Topic::Navigation => NodeId::SIM,
        Topic::Tracks => NodeId::PERCEPTION,
        Topic::Drive | Topic::Act => NodeId::UNIT_A,
        Topic::Seals => NodeId::RECORDER,
        Topic::Feed => NodeId::GATEWAY,
        Topic::Intents => NodeId::CONSOLE,
    }
}

/// A service that a rogue may hold the keys of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Holder {
    /// The vehicle's world and plant.
    Sim,
    /// Perception.
    Perception,
    /// Autonomy.
    Autonomy,
    /// The recorder.
    Recorder,
    /// The gateway.
    Gateway,
    /// The console.
    Console,
}

impl Holder {
    /// True if it runs on the control host; the others run on the vehicle's.
    pub fn on_control(self) -> bool {
        matches!(self, Holder::Gateway | Holder::Console)
    }

    /// The service's identity.
    pub fn node(self) -> NodeId {
        match self {
            Holder::Sim => NodeId::SIM,
            Holder::Perception => NodeId::PERCEPTION,
            Holder::Autonomy => NodeId::UNIT_A,
            Holder::Recorder => NodeId::RECORDER,
            Holder::Gateway => NodeId::GATEWAY,
            Holder::Console => NodeId::CONSOLE,
        }
    }
}

/// A place in an adversary's plan; the origin where none is given.
pub(crate) fn spot(place: Option<&Point>) -> Spot {
    let mm = |metres: f64| (metres * 1000.0) as i32;
    place.map_or(Spot::default(), |[x, y]| Spot { x_mm: mm(x.get()), y_mm: mm(y.get()) })
}
