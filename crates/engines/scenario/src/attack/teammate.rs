//! `[[teammate]]`: an admitted teammate forwards a third unit's telemetry.

use adversary::plan::{Form, Forward};
use evidence::Planned;
use ground_truth::Action;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Act, Attack, Deceit, Injection};
use crate::timed::timed;
use crate::{Millis, Seconds, Windowed};

timed! {
    /// An admitted teammate B forwards a third unit C's telemetry: the paper's central finding.
    Teammate lasts duration_s needs Insider sees Insider {
        /// Form of the forwarding.
        form: Form,
        /// Presence of C's own reports meanwhile.
        c: ThirdUnit,
        /// Length.
        duration_s: Seconds,
        /// Age of C's telemetry when it is forwarded.
        #[serde(default)]
        lag_ms: Millis,
    }
}

impl Attack for Teammate {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Teammate(Deceit::Forward(Forward {
            form: self.form,
            at_ms: self.start_ms(phase_ms),
            duration_ms: self.length_ms(),
            lag_ms: self.lag_ms.unsigned(),
            own_reports: self.form == Form::Verbatim,
            step: self.actor_step(),
        })))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Action(Action::Forward)).longer_by(self.lag_ms.unsigned()))
    }
}

/// Presence of C's reports while B forwards its telemetry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ThirdUnit {
    /// C reports.
    Present,
    /// Its own telemetry stops when the forwarding starts.
    Silent,
}
