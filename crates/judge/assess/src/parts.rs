//! The stretches of a recording that are judged apart: between two of them its stamps go back, or a part could not be read.
//!
//! A player that begins again, or a clock that is set back, gives two stretches under the same stamps. Messages that come a little late start no stretch:
//! a stretch begins where several in a row are well behind. The stamps of fixes and of odometry tell where; other topics are cut at their own
//! step back, if they have one near, else at the same place of the file.

use std::collections::BTreeMap;

use crate::columns::Clock;
use crate::log::{MessageRow, Rows};

/// Messages in a row that are behind.
const IN_A_ROW: usize = 3;
/// The least by which the first of them is, microseconds.
const BACK_US: u64 = 200_000;
/// Most steps back of one topic; messages behind further ones are left out, message by message.
const MAX_BACKS: usize = 1000;

/// A topic's rows with readable stamps, in the order of the file.
#[derive(Clone, Debug, Default)]
pub(crate) struct Timed {
    pub(crate) rows: Vec<(u64, MessageRow)>,
    /// Messages in all.
    pub(crate) messages: u64,
    /// Messages that could not be read, and the reason for the first.
    pub(crate) unread: u64,
    pub(crate) why: Option<String>,
}

/// Place at which the stamps of a topic go back.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Back {
    /// First message after it.
    place: u64,
    /// Expected stamp of this message, microseconds: the newest one, and the last interval between stamps.
    pub(crate) at: u64,
    /// Difference of its stamp from the expected one, microseconds.
    pub(crate) by: u64,
}

/// Mark of a stretch: places lost before it, steps back before it.
pub(crate) type Key = (u32, usize);

impl Timed {
    pub(crate) fn new(rows: Rows, clock: Clock) -> Self {
        let (messages, unread, why) = (rows.rows.len() as u64 + rows.unread, rows.unread, rows.why);
        let rows = rows.rows.into_iter().filter_map(|row| Some((clock.read(&row)?, row))).collect();
        Self { rows, messages, unread, why }
    }

    /// Every step back that lasts.
    fn backs(&self) -> Vec<Back> {
        let (mut backs, mut newest, mut gap) = (Vec::new(), 0, 0);
        for (i, (at, row)) in self.rows.iter().enumerate() {
            let next = self.rows.get(i..i + IN_A_ROW).unwrap_or_default();
            let goes_back = next.iter().all(|(time, _)| *time < newest) && next.is_sorted_by(|a, b| a.0 <= b.0);
            if goes_back && !next.is_empty() && at + BACK_US <= newest && backs.len() < MAX_BACKS {
                let due = newest + gap;
                backs.push(Back { place: row.place, at: due, by: due - at });
                (newest, gap) = (*at, 0);
            }
            if *at > newest {
                gap = if newest > 0 { at - newest } else { 0 };
                newest = *at;
            }
        }
        backs
    }

    /// The rows of each stretch, for steps back found in all.
    fn split(self, backs: &[Back]) -> BTreeMap<Key, Vec<(u64, MessageRow)>> {
        let cuts = self.cuts(backs);
        let mut parts: BTreeMap<Key, Vec<(u64, MessageRow)>> = BTreeMap::new();
        for (at, row) in self.rows {
            let key = (row.part, cuts.partition_point(|cut| *cut <= row.place));
            parts.entry(key).or_default().push((at, row));
        }
        parts
    }

    /// The place in this topic of each step back: its own nearest one of about the size, if any.
    fn cuts(&self, backs: &[Back]) -> Vec<u64> {
        let intervals: Vec<(u64, u64)> = self
            .rows
            .windows(2)
            .filter_map(|two| Some((two[1].1.place, two[0].0.checked_sub(two[1].0).filter(|step| *step > 0)?)))
            .collect();
        let cut = |i: usize, back: &Back| {
            let after = i.checked_sub(1).map_or(0, |before| backs[before].place);
            let before = backs.get(i + 1).map_or(u64::MAX, |next| next.place);
            let first = intervals.partition_point(|(place, _)| *place <= after);
            let near = intervals[first..].iter().take_while(|(place, _)| *place < before);
            let similar = near.filter(|(_, step)| *step >= back.by / 2);
            similar.map(|(place, _)| *place).min_by_key(|place| place.abs_diff(back.place)).unwrap_or(back.place)
        };
        let mut cuts: Vec<u64> = backs.iter().enumerate().map(|(i, back)| cut(i, back)).collect();
        // Cuts stay in order, so that no stretch ends before it begins.
        (1..cuts.len()).for_each(|i| cuts[i] = cuts[i].max(cuts[i - 1]));
        cuts
    }
}

/// The steps back of fixes, and the steps of odometry at other places.
pub(crate) fn backs(fixes: &Timed, odometry: &Timed) -> Vec<Back> {
    let mut all = fixes.backs();
    let own_count = all.len();
    for back in odometry.backs() {
        let same = all[..own_count].iter().any(|other| {
            let index = fixes.rows.partition_point(|(_, row)| row.place < other.place);
            let place = |i: usize| fixes.rows.get(i).map(|(_, row)| row.place);
            let from = index.checked_sub(IN_A_ROW).and_then(place).unwrap_or(0);
            (from..=place(index + IN_A_ROW).unwrap_or(u64::MAX)).contains(&back.place)
        });
        if !same {
            all.push(back);
        }
    }
    all.sort_by_key(|back| back.place);
    all
}

/// A topic cut into stretches, to be asked for each.
#[derive(Default)]
pub(crate) struct Stretches(BTreeMap<Key, Vec<(u64, MessageRow)>>);

impl Stretches {
    pub(crate) fn split_at(timed: Timed, backs: &[Back]) -> Self {
        Self(timed.split(backs))
    }

    /// The stretches in their order.
    pub(crate) fn keys(&self) -> impl Iterator<Item = Key> + '_ {
        self.0.keys().copied()
    }

    /// The rows of one; none where the topic has no message in it.
    pub(crate) fn rows(&self, key: Key) -> &[(u64, MessageRow)] {
        self.0.get(&key).map_or(&[], Vec::as_slice)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timed(stamps: &[u64], step: u64) -> Timed {
        let row = |(i, time): (usize, &u64)| {
            (*time * 100_000, MessageRow { log_us: None, place: i as u64 * step, part: 0, values: Vec::new() })
        };
        Timed { rows: stamps.iter().enumerate().map(row).collect(), ..Timed::default() }
    }

    #[test]
    fn lasting_step_back_begins_a_stretch() {
        let fixes = timed(&[10, 20, 30, 40, 10, 20, 30, 40, 50], 2);
        assert_eq!(backs(&fixes, &Timed::default()), [Back { place: 8, at: 5_000_000, by: 4_000_000 }]);
        for late in [
            &[10, 20, 19, 30, 40, 50][..],
            &[10, 20, 30, 5, 40, 50, 60],
            &[10, 20, 30, 40, 10, 20],
            &[10, 10, 10, 10, 20],
        ] {
            assert_eq!(backs(&timed(late, 1), &Timed::default()), [], "{late:?}");
        }
    }

    #[test]
    fn other_topics_are_cut_at_their_own_step() {
        let fixes = timed(&[10, 20, 30, 40, 10, 20, 30, 40, 50], 2);
        let mut odometry = timed(&[10, 20, 30, 40, 50, 10, 20, 30, 40], 2);
        odometry.rows.iter_mut().for_each(|(_, row)| row.place += 1);
        let found = backs(&fixes, &odometry);
        assert_eq!(found.len(), 1, "{found:?}");
        let parts = Stretches::split_at(odometry, &found);
        assert_eq!(parts.keys().map(|key| parts.rows(key).len()).collect::<Vec<_>>(), [5, 4]);
        let silent = Stretches::split_at(timed(&[10, 20, 30, 40, 50, 60], 3), &found);
        assert_eq!(silent.keys().map(|key| silent.rows(key).len()).collect::<Vec<_>>(), [3, 3]);
    }
}
