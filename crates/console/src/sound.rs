//! The sound of the alarms, and how many were raised: by the console's own clock, as data. Ringing is left to
//! a window that can.

use std::collections::VecDeque;

use wire::time::{Instant, Span};

use crate::alarm::{Priority, ShownGroup};

/// Time between two motifs of one alarm.
pub const MOTIF_EVERY: Span = Span::s(10);
/// Time for which the sound can be silenced. There is no way to switch it off.
pub const SILENCED_FOR: Span = Span::s(120);
/// Alarms an hour that an operator can deal with (EEMUA 191: about one in ten minutes).
pub const LIMIT_AN_HOUR: u32 = 6;
/// Alarms in [`FLOOD_WITHIN`] that are a flood.
pub const FLOOD: usize = 10;
/// Time over which a flood is counted.
pub const FLOOD_WITHIN: Span = Span::s(600);
/// Time over which the rate is counted.
const RATE_WITHIN: Span = Span::s(3600);
/// Alarms that are counted; beyond this number the count is one of at least so many.
pub const MAX_COUNTED: usize = 128;

/// The sound that is due.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sound {
    /// The motif, and the time at which it began: it is due then and every [`MOTIF_EVERY`]. None in silence.
    pub motif: Option<(Priority, Instant)>,
    /// Time at which the silence ends, while there is one.
    pub silenced_until: Option<Instant>,
}

impl Sound {
    /// The motif that is due after `last`, up to and at `now`.
    pub fn due(&self, last: Instant, now: Instant) -> Option<Priority> {
        let (priority, began) = self.motif?;
        let nth = |time: Instant| (time >= began).then(|| time.since(began).0 / MOTIF_EVERY.0);
        (nth(now) > nth(last) || (last < began && now >= began)).then_some(priority)
    }
}

/// A silence: from the act that began it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Silence(Option<Instant>);

impl Silence {
    /// Begins, or begins anew.
    pub(crate) fn begin(&mut self, now: Instant) {
        self.0 = Some(now);
    }

    /// End of the silence, if there is one at `now`.
    pub(crate) fn until(&self, now: Instant) -> Option<Instant> {
        self.0.map(|from| from + SILENCED_FOR).filter(|until| now < *until)
    }

    /// The sound at `now` of these groups. A group that was raised after the silence began sounds through it.
    pub(crate) fn sound<'g>(&self, now: Instant, flood: bool, groups: impl Iterator<Item = &'g ShownGroup>) -> Sound {
        let silenced_until = self.until(now);
        let after = silenced_until.and(self.0);
        let loud = groups.filter(|group| group.open() && group.unfolded(flood));
        let loud = loud.filter(|group| after.is_none_or(|from| group.since > from));
        Sound { motif: loud.map(|group| (group.priority, group.since)).min(), silenced_until }
    }
}

/// Times at which alarms were raised, at most [`MAX_COUNTED`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Rate(VecDeque<Instant>);

impl Rate {
    /// An alarm was raised.
    pub(crate) fn note(&mut self, now: Instant) {
        if self.0.len() >= MAX_COUNTED {
            self.0.pop_front();
        }
        self.0.push_back(now);
    }

    /// The alarm raised at this time turned out to be no cause of its own.
    pub(crate) fn take_back(&mut self, raised: Instant) {
        if let Some(at) = self.0.iter().rposition(|time| *time == raised) {
            self.0.remove(at);
        }
    }

    /// Forgets those too old to be counted.
    pub(crate) fn prune(&mut self, now: Instant) {
        self.0.retain(|time| now.since(*time) < RATE_WITHIN);
    }

    /// Alarms raised in the last hour, as of the last look.
    pub(crate) fn in_hour(&self) -> u32 {
        self.0.len() as u32
    }

    /// True if there are more alarms than a person can read.
    pub(crate) fn flood(&self, now: Instant) -> bool {
        self.0.iter().filter(|time| now.since(**time) < FLOOD_WITHIN).count() >= FLOOD
    }

    /// Time at which the count or the flood ends next.
    pub(crate) fn changes(&self, now: Instant) -> Option<Instant> {
        let oldest = self.0.front().map(|time| *time + RATE_WITHIN);
        let flood = self.flood(now).then(|| self.0.iter().rev().nth(FLOOD - 1)).flatten();
        [oldest, flood.map(|time| *time + FLOOD_WITHIN)].into_iter().flatten().min()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motif_is_due_at_once_and_every_ten_seconds() {
        let at = |ms: u64| Instant(1_000_000 + ms * 1000);
        let sound = Sound { motif: Some((Priority::High, at(0))), silenced_until: None };
        let mut due = Vec::new();
        for ms in (0..30_000).step_by(50) {
            let last = Instant(at(ms).0 - 50_000);
            due.extend(sound.due(last, at(ms)).map(|_| ms));
        }
        assert_eq!(due, [0, 10_000, 20_000]);
        assert_eq!(Sound::default().due(at(0), at(60_000)), None);
    }

    #[test]
    fn count_is_bounded_and_forgets_after_an_hour() {
        let mut rate = Rate::default();
        (0..2 * MAX_COUNTED as u64).for_each(|n| rate.note(Instant(n)));
        assert_eq!((rate.in_hour(), rate.flood(Instant(300))), (MAX_COUNTED as u32, true));
        rate.prune(Instant(0) + RATE_WITHIN + Span::s(1));
        assert_eq!((rate.in_hour(), rate.changes(Instant(0))), (0, None));
    }
}
