//! `[[feed_replay]]`: the gateway insider says of an old report that it is new.

use adversary::plan::FeedAction;
use evidence::{Planned, Takes};
use ground_truth::Action;

use super::{Act, Attack, Injection, during};
use crate::timed::timed;
use crate::{Direction, Seconds};

timed! {
    /// After each report, the first one ever passed on is said to be new.
    FeedReplay lasts duration_s needs Insider {
        /// Length of the window.
        duration_s: Seconds,
    }
}

impl Attack for FeedReplay {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Feed(during(self, Direction::Both, phase_ms, FeedAction::Replay)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Feed(Action::Republish)).taking(Takes::Reports))
    }
}
