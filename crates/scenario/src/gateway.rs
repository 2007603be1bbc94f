//! Attacks by the holder of the gateway's keys, on what the console is told and on what it asks for.
//!
//! It sits between the gateway and the console and holds the key of the feed; it signs nothing but with the gateway's own
//! key. Carrying it out belongs to `adversary`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operator::DisplayedState;
use super::rogue::Order;
use super::timed::timed;
use super::value::{Millis, Seconds};

timed! {
    /// Reports of the unit under test are not passed on to the display.
    FeedWithhold lasts duration_s needs Insider {
        /// Length of the window.
        duration_s: Seconds,
        /// But for those that say this state.
        #[serde(default)]
        keep: Option<DisplayedState>,
    }

    /// Reports are passed on later.
    FeedDelay lasts duration_s needs Insider {
        /// Length of the window.
        duration_s: Seconds,
        /// By how much.
        by_ms: Millis,
        /// And said to be as young as if they had just come.
        young: bool,
    }

    /// Reports are made to say something else.
    FeedForge lasts duration_s needs Insider {
        /// Length of the window.
        duration_s: Seconds,
        /// How.
        forgery: FeedForgery,
        /// The state they are made to say.
        state: DisplayedState,
    }

    /// After each report, the first one ever passed on is said to be new.
    FeedReplay lasts duration_s needs Insider {
        /// Length of the window.
        duration_s: Seconds,
    }

    /// What the operator asks for does not reach the gateway.
    IntentDrop lasts duration_s needs Insider {
        /// Length of the window.
        duration_s: Seconds,
        /// Only this.
        #[serde(default)]
        only: Option<Order>,
    }
}

/// How a report is made to say something else.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FeedForgery {
    /// Another state under the unit's old signature.
    Altered,
    /// Another state under the gateway's own signature.
    ReSigned,
    /// As it is, as another unit's.
    Relabelled,
}
