//! `[[feed_withhold]]`: the gateway insider keeps reports from the display.

use adversary::plan::FeedAction;
use evidence::{Planned, Takes};
use ground_truth::Action;
use wire::mode::Mode;

use super::{Act, Attack, Injection, during};
use crate::timed::timed;
use crate::{Direction, Seconds};

timed! {
    /// Reports of the unit under test are not passed on to the display.
    FeedWithhold lasts duration_s needs Insider {
        /// Length of the window.
        duration_s: Seconds,
        /// But for those that say this state.
        #[serde(default)]
        keep: Option<Mode>,
    }
}

impl Attack for FeedWithhold {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let action = FeedAction::Withhold { keep: self.keep };
        Some(Act::Feed(during(self, Direction::Both, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Feed(Action::Drop)).taking(Takes::Reports))
    }
}
