//! Climbing to one limit at a time: for each limit the sequences that came nearest to it, of which the next ones are made.
//!
//! A hill is a limit of the oracle. Each keeps its few nearest sequences (a steady state of parents, as in an evolutionary search),
//! is chosen the more rarely the longer none came nearer, and begins again from others when none does any more. Making sequences of
//! those is left to `vary`.

use std::collections::BTreeMap;

use oracle::{Approaches, Limit};

use super::learned::{FARTHEST, GAIN, Lesson, Near};

/// Sequences kept for each limit.
const KEPT: usize = 8;
/// Sequences made for a limit in a row, none of which came nearer by [`GAIN`], after which its climb begins again.
const PATIENCE: u32 = 48;

/// The climbs to every limit.
#[derive(Debug, Default)]
pub(super) struct Climb {
    /// Approach of the run without an attack: a sequence that comes no nearer is on no hill.
    nominal: Approaches,
    hills: BTreeMap<Limit, Hill>,
}

/// The climb to one limit.
#[derive(Debug, Default)]
struct Hill {
    /// Nearest first; of two that came equally near the newer one first, so that changes without effect accumulate.
    kept: Vec<Near>,
    /// The approach at which the climb last gained.
    reached: u32,
    /// Sequences made for it since.
    stuck: u32,
    /// True if it begins again: the next to be kept is a fresh sequence, no child of those before.
    begins_again: bool,
}

impl Hill {
    fn take(&mut self, near: Near, fresh: bool) {
        if self.begins_again && !fresh
            || self.kept.iter().any(|near_miss| near_miss.known.sequence == near.known.sequence)
        {
            return;
        }
        self.begins_again = false;
        if near.way >= self.reached.saturating_add(GAIN) {
            self.reached = near.way;
            self.stuck = 0;
        }
        let place = self.kept.partition_point(|known| known.way > near.way);
        self.kept.insert(place, near);
        self.kept.truncate(KEPT);
    }

    /// Sequences of the hill, from which one more is made; none after [`PATIENCE`] without a gain, and the climb begins
    /// again.
    fn parents(&mut self) -> Vec<Near> {
        if self.stuck < PATIENCE {
            self.stuck += 1;
            return self.kept.clone();
        }
        *self = Self { begins_again: true, ..Self::default() };
        Vec::new()
    }

    /// Weight of the hill in the draw: it falls with each sequence without a gain, and is zero only for an empty hill.
    fn weight(&self) -> u64 {
        if self.kept.is_empty() { 0 } else { u64::from(PATIENCE + PATIENCE / 8 - self.stuck) }
    }
}

impl Climb {
    /// Before any sequence; `nominal` is the approach of the run without an attack.
    pub(super) fn new(nominal: &Approaches) -> Self {
        Self { nominal: nominal.clone(), hills: BTreeMap::new() }
    }

    /// Learns from a trial; `fresh` where its sequence was made from no other.
    pub(super) fn take(&mut self, lesson: &Lesson, fresh: bool) {
        for (limit, way) in &lesson.approaches {
            let (limit, way) = (*limit, (*way).min(FARTHEST));
            if way > self.nominal.get(&limit).copied().unwrap_or_default() {
                let near = Near { limit, way, known: lesson.known.clone(), tried: 0 };
                self.hills.entry(limit).or_default().take(near, fresh);
            }
        }
    }

    /// Weight of each climb, in the order of the limits.
    pub(super) fn weights(&self) -> Vec<u64> {
        self.hills.values().map(Hill::weight).collect()
    }

    /// Sequences nearest to the `n`th limit, from which one more is made; none where the climb begins again.
    pub(super) fn parents(&mut self, n: usize) -> Vec<Near> {
        self.hills.values_mut().nth(n).map(Hill::parents).unwrap_or_default()
    }

    /// The nearest to the `n`th limit.
    pub(super) fn nearest(&self, n: usize) -> &[Near] {
        self.hills.values().nth(n).map_or(&[], |hill| &hill.kept)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learned::Known;
    use crate::moments::Moments;
    use crate::sequence::{Action, AttackSequence};

    fn lesson(begins: u32, way: u32) -> Lesson {
        let sequence = AttackSequence::new(vec![Action { begins, kind: 0, places: Vec::new() }]);
        let known = Known { sequence, moments: Moments::default() };
        Lesson { known, new: false, approaches: Approaches::from([(Limit::Uplink, way)]) }
    }

    #[test]
    fn hill_keeps_its_nearest_sequences_and_no_more() {
        let mut climb = Climb::new(&Approaches::from([(Limit::Uplink, 5)]));
        (0..40).for_each(|i| climb.take(&lesson(i, 1_000 * (i * 7 % 40)), true));
        let ways: Vec<u32> = climb.hills[&Limit::Uplink].kept.iter().map(|near| near.way).collect();
        assert_eq!(ways, [39, 38, 37, 36, 35, 34, 33, 32].map(|way| 1_000 * way));
    }

    #[test]
    fn approach_of_the_nominal_run_is_no_hill() {
        let mut climb = Climb::new(&Approaches::from([(Limit::Uplink, 5)]));
        climb.take(&lesson(1, 5), true);
        assert!(climb.hills.is_empty());
    }

    #[test]
    fn climb_without_gain_begins_again_from_fresh_sequences() {
        let mut climb = Climb::new(&Approaches::new());
        climb.take(&lesson(1, 9_000), true);
        let hill = climb.hills.get_mut(&Limit::Uplink).unwrap();
        let made = (0..=PATIENCE).take_while(|_| !hill.parents().is_empty()).count();
        assert_eq!((made as u32, hill.weight()), (PATIENCE, 0));
        climb.take(&lesson(2, 9_000), false);
        assert_eq!(climb.hills[&Limit::Uplink].weight(), 0, "a child of those that were given up");
        climb.take(&lesson(3, 10), true);
        assert!(climb.hills[&Limit::Uplink].weight() > 0);
    }

    #[test]
    fn gain_below_a_thousandth_does_not_count() {
        let mut climb = Climb::new(&Approaches::new());
        climb.take(&lesson(1, 9_000), true);
        climb.hills.get_mut(&Limit::Uplink).unwrap().parents();
        climb.take(&lesson(2, 9_000 + GAIN - 1), false);
        assert_eq!(climb.hills[&Limit::Uplink].stuck, 1);
        climb.take(&lesson(3, 9_000 + GAIN), false);
        assert_eq!(climb.hills[&Limit::Uplink].stuck, 0);
    }
}
