//! Climbing to one limit at a time: for each limit the sequences that came nearest to it, of which the next ones are made.
//!
//! A hill is a limit of the oracle. Each keeps its few nearest sequences (a steady state of parents, as in an evolutionary search),
//! is chosen the more rarely the longer none came nearer, and begins again from others when none does any more. Variations of one
//! sequence are `vary`'s.

use std::collections::BTreeMap;

use oracle::{Approaches, Limit};

use super::draw::Drawer;
use super::learned::{Known, Lesson, Near};
use super::sequence::AttackSequence;

/// Sequences kept for each limit.
const KEPT: usize = 8;
/// Sequences made for a limit in a row, none of which came nearer, after which its climb begins again.
const PATIENCE: u32 = 160;
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
    /// Sequences made for it since one came nearer.
    stuck: u32,
}

impl Hill {
    fn take(&mut self, near: Near) {
        if self.kept.iter().any(|kept| kept.known.sequence == near.known.sequence) {
            return;
        }
        if self.kept.first().is_none_or(|first| near.way > first.way) {
            self.stuck = 0;
        }
        let place = self.kept.partition_point(|kept| kept.way > near.way);
        self.kept.insert(place, near);
        self.kept.truncate(KEPT);
    }
}

impl Climb {
    /// Before any sequence; `nominal` is the approach of the run without an attack.
    pub(super) fn new(nominal: &Approaches) -> Self {
        Self { nominal: nominal.clone(), hills: BTreeMap::new() }
    }

    /// Learns from a trial.
    pub(super) fn take(&mut self, lesson: &Lesson) {
        for (limit, way) in &lesson.approaches {
            if self.nominal.get(limit).is_none_or(|nominal| way > nominal) {
                let near = Near { limit: *limit, way: *way, known: lesson.known.clone(), tried: 0 };
                self.hills.entry(*limit).or_default().take(near);
            }
        }
    }

    /// Weight of each hill: the lower the longer none came nearer.
    fn weights(&self) -> Vec<u64> {
        self.hills
            .values()
            .map(|hill| if hill.kept.is_empty() { 0 } else { u64::from(2 * PATIENCE - hill.stuck) })
            .collect()
    }
}

impl Drawer<'_> {
    /// A sequence made to come nearer to one limit: a variation of one of the nearest, or of two of them together. None where
    /// none came nearer than the run without an attack.
    pub(super) fn climbing(&mut self) -> Option<AttackSequence> {
        let weights = self.climb().weights();
        if weights.iter().all(|weight| *weight == 0) {
            return None;
        }
        let n = self.by_weight(&weights);
        let kept = {
            let hill = self.climb().hills.values_mut().nth(n)?;
            hill.stuck += 1;
            if hill.stuck > PATIENCE {
                hill.stuck = 0;
                std::mem::take(&mut hill.kept)
            } else {
                hill.kept.clone()
            }
        };
        let mut near = self.parent(&kept)?;
        if self.below(3) == 0
            && let Some(other) = self.on_any_hill()
        {
            near.known.sequence = self.joined(&near.known, &other.known);
        }
        // One variation, and every other time one more: a step on a plateau may need two at once.
        for _ in 0..VARIATIONS {
            near.known.sequence = match self.below(3) {
                0 => self.changed(&near.known),
                1 => self.nudged(&near.known),
                _ => self.aimed(&near).unwrap_or_else(|| self.nudged(&near.known)),
            };
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

    /// The actions of both, without any that are too many: that which brings an action near to one limit may be missing on the
    /// way to another.
    fn joined(&mut self, one: &Known, other: &Known) -> AttackSequence {
        let mut actions = [one.sequence.actions(), other.sequence.actions()].concat();
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
        (0..40).for_each(|i| climb.take(&lesson(i, i * 7 % 40)));
        let ways: Vec<u32> = climb.hills[&Limit::Uplink].kept.iter().map(|near| near.way).collect();
        assert_eq!(ways, [39, 38, 37, 36, 35, 34, 33, 32]);
    }

    #[test]
    fn approach_of_the_run_without_an_attack_is_no_hill() {
        let mut climb = Climb::new(&Approaches::from([(Limit::Uplink, 5)]));
        climb.take(&lesson(1, 5));
        assert!(climb.hills.is_empty());
    }
}
