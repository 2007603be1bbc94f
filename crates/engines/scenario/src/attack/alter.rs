//! `[[alter]]`: an insider in perception's place makes up where vehicles stand.

use crate::shared::overwritten;
use adversary::plan::Says;
use evidence::Planned;
use evidence::trial::Knowledge;
use ground_truth::Action;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::core::Topic;

use super::{Act, Attack, Injection};
use crate::shared::spot;
use crate::{Holder, Located, Point, Seconds, Windowed};

/// Time between two messages of perception, milliseconds.
const EVERY_MS: u64 = 100;

/// A stand-in for perception: passes on each of its messages with a vehicle that is not there in place of those that
/// are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Alter {
    /// Start on the trial's clock; the trial's phase is added.
    pub at_s: Located<Seconds>,
    /// Length of the window.
    pub duration_s: Seconds,
    /// The service that it holds the keys of; none for an impostor.
    #[serde(default)]
    pub holder: Option<Holder>,
    /// Claimed place of the vehicle; metres east and north.
    pub place_m: Point,
    /// True if the vehicles that perception sees are moved there, under their own identities.
    #[serde(default)]
    pub moves: bool,
}

impl Windowed for Alter {
    fn at_s(&self) -> &Located<Seconds> {
        &self.at_s
    }

    fn duration_s(&self) -> Seconds {
        self.duration_s
    }

    fn needs(&self) -> Knowledge {
        Knowledge::Insider
    }
}

impl Attack for Alter {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let place = spot(Some(&self.place_m));
        let statement = if self.moves { Says::Moved(place) } else { Says::Altered(place) };
        let plan = overwritten(Topic::Tracks, self, phase_ms, EVERY_MS, statement);
        Some(Act::Rogue { channel: Topic::Tracks, holder: self.holder, plan })
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Action(Action::Forge)))
    }
}
