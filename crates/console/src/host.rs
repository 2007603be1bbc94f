//! Waits of the run's services for a core: on a host with other work what is shown comes late, and a run may be INVALID
//! for it.
//!
//! The launcher counts the waits and tells them. The console cannot count them itself: a sleeper like it is woken
//! first.

use wire::time::{Instant, Span};

/// A wait is shown for so long.
const SHOWN_FOR: Span = Span::s(10);

/// The longest wait of the last ten seconds.
#[derive(Clone, Copy, Debug, Default)]
pub struct HostWait {
    longest: Option<(Instant, Span)>,
}

impl HostWait {
    /// The launcher reported a wait at `now`.
    pub fn note(&mut self, now: Instant, wait: Span) {
        if self.longest_wait(now).is_none_or(|longest| wait >= longest) {
            self.longest = Some((now, wait));
        }
    }

    /// The longest wait that was reported in the ten seconds before `now`.
    pub fn longest_wait(&self, now: Instant) -> Option<Span> {
        self.longest.filter(|(time, _)| now.since(*time) < SHOWN_FOR).map(|(_, wait)| wait)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_wait_is_shown_for_ten_seconds() {
        let [first, second] = [Instant(0) + Span::s(1), Instant(0) + Span::s(5)];
        let mut wait = HostWait::default();
        assert_eq!(wait.longest_wait(first), None);
        wait.note(first, Span::ms(120));
        wait.note(second, Span::ms(60));
        assert_eq!(wait.longest_wait(second), Some(Span::ms(120)));
        let past = first + SHOWN_FOR;
        assert_eq!(wait.longest_wait(past), None);
        wait.note(past, Span::ms(60));
        assert_eq!(wait.longest_wait(past), Some(Span::ms(60)));
    }
}
