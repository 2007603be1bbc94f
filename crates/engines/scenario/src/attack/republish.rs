//! `[[republish]]`: a process on a host's shared memory publishes recorded messages again.

use crate::shared::overwritten;
use adversary::plan::Says;
use evidence::Planned;
use evidence::trial::Knowledge;
use ground_truth::Action;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::core::Topic;

use super::{Act, Attack, Injection};
use crate::shared::Every;
use crate::{Located, Millis, Seconds, Windowed};

/// Publishes again the messages of the channel's own producer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Republish {
    /// Start on the trial's clock; the trial's phase is added. The messages were recorded before.
    pub at_s: Located<Seconds>,
    /// Length of the window.
    pub duration_s: Seconds,
    /// Time between messages.
    pub every_ms: Every,
    /// The channel.
    pub topic: Topic,
    /// Least age of the messages.
    pub lag_ms: Millis,
}

impl Windowed for Republish {
    fn at_s(&self) -> &Located<Seconds> {
        &self.at_s
    }

    fn duration_s(&self) -> Seconds {
        self.duration_s
    }

    fn needs(&self) -> Knowledge {
        Knowledge::OnPath
    }
}

impl Attack for Republish {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let statement = Says::Recorded { lag_ms: self.lag_ms.unsigned() };
        let plan = overwritten(self.topic, self, phase_ms, self.every_ms.unsigned(), statement);
        Some(Act::Rogue { channel: self.topic, holder: None, plan })
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Action(Action::Republish)))
    }
}
