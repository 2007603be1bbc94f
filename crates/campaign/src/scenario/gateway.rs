//! Attacks by the holder of the gateway's keys, on what the console is told and on what it asks for.
//!
//! It sits between the gateway and the console and holds the key of the feed; it signs nothing but with the gateway's own
//! key. Carrying it out belongs to `adversary`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::attack::Windowed;
use super::operator::{DisplayedState, Verb};
use super::value::{Located, Millis, Seconds};

/// Declares tables with a window, which go one way only.
macro_rules! tables {
    ($( $(#[$doc:meta])* $name:ident { $( $(#[$field_doc:meta])* $field:ident : $kind:ty ),* $(,)? } )+) => {$(
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            /// Start on the trial's clock; the trial's phase is added.
            pub at_s: Located<Seconds>,
            /// Length of the window.
            pub duration_s: Seconds,
            $( $(#[$field_doc])* pub $field: $kind, )*
        }

        impl Windowed for $name {
            fn at_s(&self) -> &Located<Seconds> {
                &self.at_s
            }
            fn duration_s(&self) -> Seconds {
                self.duration_s
            }
        }
    )+};
}

tables! {
    /// Reports of the unit under test are not passed on to the display.
    FeedWithhold {
        /// But for those that say this state.
        #[serde(default)]
        keep: Option<DisplayedState>,
    }

    /// Reports are passed on later.
    FeedDelay {
        /// By how much.
        by_ms: Millis,
        /// And said to be as young as if they had just come.
        young: bool,
    }

    /// Reports are made to say something else.
    FeedForge {
        /// How.
        forgery: FeedForgery,
        /// The state they are made to say.
        state: DisplayedState,
    }

    /// After each report, the first one ever passed on is said to be new.
    FeedReplay {}

    /// What the operator asks for does not reach the gateway.
    IntentDrop {
        /// Only this.
        #[serde(default)]
        only: Option<Verb>,
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
