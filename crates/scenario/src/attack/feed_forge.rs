//! `[[feed_forge]]`: the gateway insider makes reports say something else.

use adversary::plan::{self, FeedAction};
use evidence::{Planned, Takes};
use instrument::Action;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Act, Attack, Injection, during};
use crate::timed::timed;
use crate::{Direction, DisplayedState, Seconds};

timed! {
    /// Reports are made to say something else.
    FeedForge lasts duration_s needs Insider {
        /// Length of the window.
        duration_s: Seconds,
        /// Kind of the forgery.
        forgery: FeedForgery,
        /// The state they are made to say.
        state: DisplayedState,
    }
}

impl Attack for FeedForge {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let forgery = match self.forgery {
            FeedForgery::Altered => plan::FeedForgery::Altered,
            FeedForgery::ReSigned => plan::FeedForgery::ReSigned,
            FeedForgery::Relabelled => plan::FeedForgery::Relabelled,
        };
        let action = FeedAction::Forge { forgery, mode: self.state.mode() };
        Some(Act::Feed(during(self, Direction::Both, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Feed(Action::Forge)).taking(Takes::Reports))
    }
}

/// Kind of a forged report.
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
