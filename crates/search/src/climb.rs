//! Climbing to one limit at a time: for each limit the sequences that came nearest to it, of which the next ones are made.
//!
//! A hill is a limit of the oracle. Each keeps its few nearest sequences (a steady state of parents, as in an evolutionary search),
//! is chosen the more rarely the longer none came nearer, and begins again from others when none does any more. Variations of one
//! sequence are `vary`'s.

use std::collections::BTreeMap;

use oracle::{Approaches, Limit};

use super::draw::Drawer;
use super::learned::{FARTHEST, GAIN, Known, Lesson, Near};
use super::sequence::AttackSequence;

/// Sequences kept for each limit.
const KEPT: usize = 8;
/// Sequences made for a limit in a row, none of which came nearer by [`GAIN`], after which its climb begins again.
const PATIENCE: u32 = 48;
/// Most variations from one sequence to the next.
const VARIATIONS: u32 = 3;

/// The climbs to every limit.
#[derive(Debug, Default)]
pub(super) struct Climb {
    /// Approach of the run without an attack: what comes no nearer is on no hill.
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
    /// True if it begins again: the next to be kept is a fresh sequence, not one made of those that led nowhere.
    begins_again: bool,
}

impl Hill {
    fn take(&mut self, near: Near, fresh: bool) {
        if self.begins_again && !fresh || self.kept.iter().any(|kept| kept.known.sequence == near.known.sequence) {
            return;
        }
        self.begins_again = false;
        if near.way >= self.reached.saturating_add(GAIN) {
            self.reached = near.way;
            self.stuck = 0;
        }
        let place = self.kept.partition_point(|kept| kept.way > near.way);
        self.kept.insert(place, near);
        self.kept.truncate(KEPT);
    }

    /// Its sequences, for one more to be made of them; none where enough of them led nowhere.
    fn parents(&mut self) -> Vec<Near> {
        if self.stuck < PATIENCE {
            self.stuck += 1;
            return self.kept.clone();
        }
        *self = Self { begins_again: true, ..Self::default() };
        Vec::new()
    }

    /// The lower the longer none came nearer.
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
}

impl Drawer<'_> {
    /// A sequence made to come nearer to one limit: a variation of one of the nearest, or of two of them together. None where
    /// none came nearer than the run without an attack, or the climb begins again.
    pub(super) fn climbing(&mut self) -> Option<AttackSequence> {
        let weights: Vec<u64> = self.climb().hills.values().map(Hill::weight).collect();
        if weights.iter().all(|weight| *weight == 0) {
            return None;
        }
        let n = self.by_weight(&weights);
        let kept = self.climb().hills.values_mut().nth(n)?.parents();
        let mut near = self.parent(&kept)?;
        // The distance is that of the parent alone: nothing else is moved by it.
        let mut aim = true;
        if self.below(3) == 0
            && let Some(other) = self.on_any_hill()
        {
            near.known.sequence = self.joined(&near.known, &other.known);
            aim = false;
        }
        // One variation, and every other time one more: a step on a plateau may need two at once.
        for _ in 0..VARIATIONS {
            let aimed = if aim && self.below(3) == 0 { self.aimed(&near) } else { None };
            near.known.sequence = match aimed {
                Some(aimed) => aimed,
                None if self.below(2) == 0 => self.changed(&near.known),
                None => self.nudged(&near.known),
            };
            aim = false;
            if self.below(2) == 0 {
                break;
            }
        }
        Some(near.known.sequence)
    }

    /// The nearer of two.
    fn parent(&mut self, kept: &[Near]) -> Option<Near> {
        let n = kept.len() as u32;
        let nearer = self.below(n).min(self.below(n));
        kept.get(nearer as usize).cloned()
    }

    /// One of the nearest to any limit.
    fn on_any_hill(&mut self) -> Option<Near> {
        let kept: Vec<Vec<Near>> = self.climb().hills.values().map(|hill| hill.kept.clone()).collect();
        let n = self.below(kept.len() as u32);
        kept.get(n as usize).and_then(|kept| self.parent(kept))
    }

    /// The actions of both, each once, without any that are too many: steps towards several limits may be needed together.
    fn joined(&mut self, one: &Known, other: &Known) -> AttackSequence {
        let mut actions = [one.sequence.actions(), other.sequence.actions()].concat();
        actions.sort();
        actions.dedup();
        while actions.len() > self.longest() as usize {
            let gone = self.below(actions.len() as u32) as usize;
            actions.swap_remove(gone);
        }
        AttackSequence::new(actions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::moments::Moments;
    use crate::sequence::Action;

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
    fn approach_of_the_run_without_an_attack_is_no_hill() {
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
    fn less_than_a_thousandth_of_the_way_is_no_gain() {
        let mut climb = Climb::new(&Approaches::new());
        climb.take(&lesson(1, 9_000), true);
        climb.hills.get_mut(&Limit::Uplink).unwrap().parents();
        climb.take(&lesson(2, 9_000 + GAIN - 1), false);
        assert_eq!(climb.hills[&Limit::Uplink].stuck, 1);
        climb.take(&lesson(3, 9_000 + GAIN), false);
        assert_eq!(climb.hills[&Limit::Uplink].stuck, 0);
    }
}
