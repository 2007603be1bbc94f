//! `[[session_replay]]`: an admitted teammate sends its records of an earlier session again.

use adversary::plan::Resend;
use evidence::Planned;
use evidence::trial::Knowledge;
use ground_truth::Action;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Act, Attack, Deceit, Injection};
use crate::{Count, Located, Millis, Seconds, Windowed};

/// B ends its session, dials again, and sends the messages that it recorded in the session before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SessionReplay {
    /// Time at which it hangs up, on the trial's clock; the trial's phase is added.
    pub at_s: Located<Seconds>,
    /// Records sent in the next session, the newest first: each whole, and then its report alone.
    pub count: Count,
    /// Time between them.
    pub every_ms: Millis,
    /// True if B has a later boot from then on and counts from the beginning.
    #[serde(default)]
    pub restart: bool,
}

impl Windowed for SessionReplay {
    fn at_s(&self) -> &Located<Seconds> {
        &self.at_s
    }

    fn duration_s(&self) -> Seconds {
        Seconds::default()
    }

    fn needs(&self) -> Knowledge {
        Knowledge::Insider
    }
}

impl Attack for SessionReplay {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Teammate(Deceit::Resend(Resend {
            at_ms: self.start_ms(phase_ms),
            count: self.count.unsigned() as u32,
            every_ms: self.every_ms.unsigned(),
            restart: self.restart,
        })))
    }

    fn injection(&self) -> Option<Injection> {
        // The gateway determines the time that dialling again takes.
        Some(Injection::new(Planned::Action(Action::Resend)).without_end())
    }
}
