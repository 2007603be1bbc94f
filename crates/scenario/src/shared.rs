//! Attacks on a host's shared memory: a process there that speaks on channels which are others'.
//!
//! The channel says which host; whose keys the process holds, `holder`. Without one it is an impostor of the same user with
//! no key; with one it is an insider in that service's place.

use evidence::trial::Knowledge;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::scene::Point;
use super::timed::Windowed;
use super::value::{Located, Millis, Seconds, Whole};

/// Time between two messages.
pub type Every = Whole<1, 60_000>;

/// Publishes, on a channel that is another's, messages of its own making.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Forge {
    /// Start on the trial's clock; the trial's phase is added.
    pub at_s: Located<Seconds>,
    /// Length of the window.
    pub duration_s: Seconds,
    /// Time between messages.
    pub every_ms: Every,
    /// Which channel.
    pub topic: Channel,
    /// The service whose keys it holds; none for an impostor.
    #[serde(default)]
    pub holder: Option<Holder>,
    /// What the messages say.
    pub says: Saying,
    /// Where the vehicle is said to stand, or by how much a position is shifted; metres east and north.
    #[serde(default)]
    pub place_m: Option<Point>,
}

/// Publishes again what the channel's own producer published.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Republish {
    /// Start on the trial's clock; the trial's phase is added. What is published again was recorded before.
    pub at_s: Located<Seconds>,
    /// Length of the window.
    pub duration_s: Seconds,
    /// Time between messages.
    pub every_ms: Every,
    /// Which channel.
    pub topic: Channel,
    /// Least age of what is published again.
    pub lag_ms: Millis,
}

/// In perception's place: passes on each of its messages with a vehicle that is not there in place of those that are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Alter {
    /// Start on the trial's clock; the trial's phase is added.
    pub at_s: Located<Seconds>,
    /// Length of the window.
    pub duration_s: Seconds,
    /// The service whose keys it holds; none for an impostor.
    #[serde(default)]
    pub holder: Option<Holder>,
    /// Where the vehicle is said to stand; metres east and north.
    pub place_m: Point,
}

/// A rogue has no steps: its tables begin at their time. What it needs to know follows from whose keys it holds.
macro_rules! windowed {
    ($($name:ident $needs:expr;)+) => {$(
        impl Windowed for $name {
            fn at_s(&self) -> &Located<Seconds> {
                &self.at_s
            }
            fn duration_s(&self) -> Seconds {
                self.duration_s
            }
            fn needs(&self) -> Knowledge {
                let needs: fn(&Self) -> Knowledge = $needs;
                needs(self)
            }
        }
    )+};
}

windowed! {
    Forge |x| if x.holder.is_some() { Knowledge::Insider } else { Knowledge::OnPath };
    Republish |_| Knowledge::OnPath;
    Alter |_| Knowledge::Insider;
}

/// A channel of shared memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Channel {
    /// Candidate observations, sim to perception.
    Candidates,
    /// Rendered frames, sim to perception.
    Frames,
    /// Positions, sim to perception and autonomy.
    Navigation,
    /// Tracks, perception to autonomy.
    Tracks,
    /// Set-points, autonomy to sim.
    Drive,
    /// The act, autonomy to sim.
    Act,
    /// Seals, recorder to autonomy.
    Seals,
    /// What was accepted, gateway to console.
    Feed,
    /// The operator's requests, console to gateway.
    Intents,
}

impl Channel {
    /// Whether it is on the control host; the others are on the vehicle's.
    pub fn on_control(self) -> bool {
        matches!(self, Channel::Feed | Channel::Intents)
    }
}

/// A service whose keys a rogue may hold.
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
    /// Whether it runs on the control host; the others run on the vehicle's.
    pub fn on_control(self) -> bool {
        matches!(self, Holder::Gateway | Holder::Console)
    }
}

/// What forged messages say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Saying {
    /// What the producer said last, with its time made new.
    Echo,
    /// A perception that lives and does no work.
    Beat,
    /// A corroborated vehicle at `place_m`.
    Vehicle,
    /// The same as a synthetic product.
    Synthetic,
    /// The same as a product that is played back.
    PlayedBack,
    /// The last position, shifted by `place_m`.
    Elsewhere,
}

impl Saying {
    /// Whether it needs a place.
    pub fn needs_place(self) -> bool {
        matches!(self, Saying::Vehicle | Saying::Synthetic | Saying::PlayedBack | Saying::Elsewhere)
    }

    /// Whether it can be said on `topic`.
    pub fn fits(self, topic: Channel) -> bool {
        match self {
            Saying::Echo => true,
            Saying::Beat | Saying::Vehicle | Saying::Synthetic | Saying::PlayedBack => topic == Channel::Tracks,
            Saying::Elsewhere => topic == Channel::Navigation,
        }
    }
}
