//! `[[forge]]`: a process on a host's shared memory makes messages in another's name.

use crate::shared::overwritten;
use adversary::plan::Says;
use evidence::Planned;
use evidence::trial::Knowledge;
use ground_truth::Action;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::core::Topic;

use super::{Act, Attack, Injection};
use crate::finding::{Finding, finding};
use crate::shared::{Every, spot};
use crate::{Holder, Located, Point, Scenario, Seconds, Windowed};

/// Publishes, on a channel that is another's, messages that it made itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Forge {
    /// Start on the trial's clock; the trial's phase is added.
    pub at_s: Located<Seconds>,
    /// Length of the window.
    pub duration_s: Seconds,
    /// Time between messages.
    pub every_ms: Every,
    /// The channel.
    pub topic: Topic,
    /// The service that it holds the keys of; none for an impostor.
    #[serde(default)]
    pub holder: Option<Holder>,
    /// Content of the messages.
    pub says: Saying,
    /// Claimed place of the vehicle, or the shift of a position; metres east and north.
    #[serde(default)]
    pub place_m: Option<Point>,
}

impl Windowed for Forge {
    fn at_s(&self) -> &Located<Seconds> {
        &self.at_s
    }

    fn duration_s(&self) -> Seconds {
        self.duration_s
    }

    fn needs(&self) -> Knowledge {
        if self.holder.is_some() { Knowledge::Insider } else { Knowledge::OnPath }
    }
}

impl Attack for Forge {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let spot = spot(self.place_m.as_ref());
        let statement = match self.says {
            Saying::Echo => Says::Echo,
            Saying::Beat => Says::Beat,
            Saying::Vehicle => Says::Vehicle(spot),
            Saying::Synthetic => Says::Synthetic(spot),
            Saying::PlayedBack => Says::PlayedBack(spot),
            Saying::Elsewhere => Says::Elsewhere(spot),
        };
        let plan = overwritten(self.topic, self, phase_ms, self.every_ms.unsigned(), statement);
        Some(Act::Rogue { channel: self.topic, holder: self.holder, plan })
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Action(Action::Forge)))
    }

    fn check(&self, _whole: &Scenario) -> Vec<Finding> {
        let mut found = Vec::new();
        if !self.says.fits(self.topic) {
            found.push(finding(&self.at_s, "this cannot be said on that channel", "use `says = \"echo\"`"));
        }
        if self.says.needs_place() != self.place_m.is_some() {
            let remedy = "give `place_m` where a vehicle or another position is claimed, and nowhere else";
            found.push(finding(&self.at_s, "a place is missing or too many", remedy));
        }
        found
    }
}

/// Content of forged messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Saying {
    /// The producer's last message, with its time made new.
    Echo,
    /// A perception that lives and does no work.
    Beat,
    /// A corroborated vehicle at `place_m`.
    Vehicle,
    /// An alteration published as a synthetic product.
    Synthetic,
    /// An alteration published as a product that is played back.
    PlayedBack,
    /// The last position, shifted by `place_m`.
    Elsewhere,
}

impl Saying {
    /// True if it needs a place.
    pub fn needs_place(self) -> bool {
        matches!(self, Saying::Vehicle | Saying::Synthetic | Saying::PlayedBack | Saying::Elsewhere)
    }

    /// True if it can be said on `topic`.
    pub fn fits(self, topic: Topic) -> bool {
        match self {
            Saying::Echo => true,
            Saying::Beat | Saying::Vehicle | Saying::Synthetic | Saying::PlayedBack => topic == Topic::Tracks,
            Saying::Elsewhere => topic == Topic::Navigation,
        }
    }
}
