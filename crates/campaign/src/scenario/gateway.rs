//! Attacks by the holder of the gateway's keys, on what the console is told and on what it asks for.
//!
//! It sits between the gateway and the console and holds the key of the feed; it signs nothing but with the gateway's own
//! key. Carrying it out belongs to `adversary`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::attack::windowed;
use super::operator::DisplayedState;
use super::rogue::Order;
use super::step::{Knowledge, When};
use super::value::{Located, Millis, Name, Seconds};

/// Declares tables with a window, which go one way only.
macro_rules! tables {
    ($( $(#[$doc:meta])* $name:ident { $( $(#[$field_doc:meta])* $field:ident : $kind:ty ),* $(,)? } )+) => {
        $(
            $(#[$doc])*
            #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
            #[serde(deny_unknown_fields)]
            pub struct $name {
                /// Start on the trial's clock; the trial's phase is added.
                pub at_s: Located<Seconds>,
                /// Length of the window.
                pub duration_s: Seconds,
                $( $(#[$field_doc])* pub $field: $kind, )*
                /// Name of the step that this is a part of.
                #[serde(default, skip_serializing_if = "Option::is_none")]
                pub step: Option<Located<Name>>,
                /// What it waits for; `at_s` is then the earliest.
                #[serde(default, skip_serializing_if = "Option::is_none")]
                pub when: Option<Located<When>>,
                /// What may be known here, where that is less than the scenario's level.
                #[serde(default, skip_serializing_if = "Option::is_none")]
                pub knowledge: Option<Located<Knowledge>>,
            }
        )+
        windowed! { $( $name |x| x.duration_s, Insider, None; )+ }
    };
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
