//! `[[feed_delay]]`: the gateway insider passes reports on to the display later.

use adversary::plan::FeedAction;
use evidence::{Planned, Takes};

use super::{Act, Attack, Injection, during};
use crate::timed::timed;
use crate::{Direction, Millis, Seconds};

timed! {
    /// Reports are passed on later.
    FeedDelay lasts duration_s needs Insider {
        /// Length of the window.
        duration_s: Seconds,
        /// The delay.
        by_ms: Millis,
        /// Claim that the reports are as young as if they had just come.
        young: bool,
    }
}

impl Attack for FeedDelay {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let action = FeedAction::Delay { ms: self.by_ms.unsigned(), young: self.young };
        Some(Act::Feed(during(self, Direction::Both, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Late(self.by_ms.unsigned() * 1000)).taking(Takes::Reports))
    }
}
