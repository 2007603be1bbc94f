//! `[[feed_forge]]`: the gateway insider makes reports say something else.

use adversary::plan::{FeedAction, FeedForgery};
use evidence::{Planned, Takes};
use ground_truth::Action;
use wire::mode::Mode;

use super::{Act, Attack, Injection, during};
use crate::timed::timed;
use crate::{Direction, Seconds};

timed! {
    /// Reports are made to say something else.
    FeedForge lasts duration_s needs Insider {
        /// Length of the window.
        duration_s: Seconds,
        /// Kind of the forgery.
        forgery: FeedForgery,
        /// The state they are made to say.
        state: Mode,
    }
}

impl Attack for FeedForge {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let action = FeedAction::Forge { forgery: self.forgery, mode: self.state };
        Some(Act::Feed(during(self, Direction::Both, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Feed(Action::Forge)).taking(Takes::Reports))
    }
}
