//! Plan of the gateway insider: actions on messages of the gateway to the console, and on requests of the console.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::command::OrderKind;
use wire::mode::Mode;

use super::{MAX_HOLD_MS, PlanError, Timed, at_most, check_range};

/// Plan of the holder of the gateway's keys. Without actions it passes everything.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InsiderGatewayConfig {
    /// Actions; among those open for a report, the first that applies is carried out.
    #[serde(default)]
    pub actions: Vec<Timed<FeedAction>>,
}

/// Action on the reports of the unit under test on their way to the display, or on intents on their way back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum FeedAction {
    /// Reports are not passed on.
    Withhold {
        /// Mode of the reports that are passed on all the same.
        keep: Option<Mode>,
    },
    /// Reports are passed on later.
    Delay {
        /// Delay, milliseconds.
        ms: u64,
        /// True if their stated age is as of reports that have just come.
        young: bool,
    },
    /// Reports are changed.
    Forge {
        /// Content forged.
        forgery: FeedForgery,
        /// Mode in the changed reports.
        mode: Mode,
    },
    /// After each, the first one ever passed on is said to be new.
    Replay,
    /// Requests of the operator do not reach the honest half.
    Swallow {
        /// Kind of command that the action is limited to; absent: every request.
        only: Option<OrderKind>,
    },
}

/// Kind of a forged report.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FeedForgery {
    /// Another state under the unit's old signature.
    Altered,
    /// Another state under the gateway's own signature.
    ReSigned,
    /// The report unchanged, attributed to another unit.
    Relabelled,
}

impl InsiderGatewayConfig {
    /// Every magnitude within its bounds.
    pub fn check(&self) -> Result<(), PlanError> {
        at_most(self.actions.len())?;
        self.actions.iter().try_for_each(|timed| {
            timed.check_window(true)?;
            match timed.action {
                FeedAction::Delay { ms, young: _ } => check_range("ms", ms, 1, MAX_HOLD_MS),
                FeedAction::Withhold { .. }
                | FeedAction::Forge { .. }
                | FeedAction::Replay
                | FeedAction::Swallow { .. } => Ok(()),
            }
        })
    }
}
