//! Variations of sequences: one change, one number moved a little or by the distance to a limit; and the next sequence
//! of a climb, made of one or two that came near.

use super::draw::Drawer;
use super::learned::{Known, Near};
use super::sequence::{Action, AttackSequence, move_of};
use oracle::AT_LIMIT;

/// Greatest move of an action by a nudge, ticks. A number moves by at most 1 / [`NUDGE`] of its range.
const NUDGE: u32 = 32;
/// Additions to the distance by which a sequence is moved, ticks: they cover a property's tolerance beyond its limit, and
/// the platform's rounding to its periods.
const BEYOND: [u32; 5] = [0, 1, 2, 4, 8];
/// Most variations of a climb from one sequence to the next.
const VARIATIONS: u32 = 3;

impl Drawer<'_> {
    /// A variation of the sequence nearest to a limit: half of them moved by the distance, where that is a length of time.
    pub(super) fn nearer(&mut self, near: &Near) -> AttackSequence {
        match self.uniform_below(4) {
            0 => self.changed(&near.known),
            1 => self.nudged(&near.known),
            _ => self.aimed(near).unwrap_or_else(|| self.nudged(&near.known)),
        }
    }

    /// The sequence with one of its times moved, earlier or later, by the distance to the limit or a little more.
    fn aimed(&mut self, near: &Near) -> Option<AttackSequence> {
        let limit = near.limit.length_ms(self.bounds())?;
        let missing = limit * u64::from(AT_LIMIT.saturating_sub(near.way)) / u64::from(AT_LIMIT);
        let tick = self.space().tick_ms.unsigned();
        let excess = BEYOND[self.uniform_below(BEYOND.len() as u32) as usize];
        // At least 1 ms: a sequence on its limit is still moved across it.
        let by_ms = (missing as f64).max(1.0) + f64::from(excess) * tick as f64;
        let mut actions = near.known.sequence.actions().to_vec();
        let some = self.uniform_below(actions.len() as u32) as usize;
        let action_type = move_of(self.space(), &actions[some]);
        let numbers: Vec<usize> = (0..actions[some].places.len()).filter(|n| action_type.counts_time(*n)).collect();
        let ranges: Vec<_> = action_type.ranges().copied().collect();
        let later = self.uniform_below(2) == 0;
        let moved = |from: u32, step: f64| {
            let steps = (by_ms / step).ceil() as u32;
            if later { from.saturating_add(steps) } else { from.saturating_sub(steps) }
        };
        match (self.uniform_below(1 + numbers.len() as u32) as usize).checked_sub(1).map(|i| numbers[i]) {
            None => {
                let (first, last) = self.space().begins();
                actions[some].begins = moved(actions[some].begins, tick as f64).clamp(first, last);
            }
            Some(n) => actions[some].places[n] = moved(actions[some].places[n], ranges[n].step).min(ranges[n].last()),
        }
        Some(AttackSequence::new(actions))
    }

    /// The sequence with one number or moment moved a little, at every scale alike.
    fn nudged(&mut self, known: &Known) -> AttackSequence {
        let mut actions = known.sequence.actions().to_vec();
        let some = self.uniform_below(actions.len() as u32) as usize;
        let ranges: Vec<_> = move_of(self.space(), &actions[some]).ranges().copied().collect();
        match (self.uniform_below(1 + ranges.len() as u32) as usize).checked_sub(1) {
            None => {
                let (first, last) = self.space().begins();
                actions[some].begins = self.moved(actions[some].begins, NUDGE).clamp(first, last);
            }
            Some(n) => {
                let last = ranges[n].last();
                actions[some].places[n] = self.moved(actions[some].places[n], (last / NUDGE).max(1)).min(last);
            }
        }
        AttackSequence::new(actions)
    }

    /// Up or down by 1, 2, 4 and so on, at most by `most`.
    fn moved(&mut self, from: u32, most: u32) -> u32 {
        let scales = most.ilog2() + 1;
        let scale = 1_u32 << self.uniform_below(scales);
        if self.uniform_below(2) == 0 { from.saturating_add(scale) } else { from.saturating_sub(scale) }
    }

    /// The sequence with one thing changed.
    pub(super) fn changed(&mut self, known: &Known) -> AttackSequence {
        let mut actions = known.sequence.actions().to_vec();
        let some = self.uniform_below(actions.len() as u32) as usize;
        match (self.uniform_below(5), actions.get(some).cloned()) {
            (0, _) if (actions.len() as u32) < self.longest() => actions.push(self.action(&known.moments)),
            (1, Some(_)) if actions.len() > 1 => drop(actions.remove(some)),
            (2 | 0, Some(action)) => actions[some] = Action { begins: self.moment(&known.moments), ..action },
            (3 | 1, Some(action)) => {
                let places = self.places(action.kind, &known.moments);
                actions[some] = Action { places, ..action };
            }
            (_, Some(action)) => actions[some] = Action { begins: action.begins, ..self.action(&known.moments) },
            (_, None) => actions.push(self.action(&known.moments)),
        }
        AttackSequence::new(actions)
    }

    /// A sequence made to come nearer to one limit: a variation of one of the nearest, or of two of them together. None where
    /// none came nearer than the run without an attack, or the climb begins again.
    pub(super) fn climbing(&mut self) -> Option<AttackSequence> {
        let weights = self.climb().weights();
        if weights.iter().all(|weight| *weight == 0) {
            return None;
        }
        let n = self.by_weight(&weights);
        let parents = self.climb().parents(n);
        let mut near = self.parent(&parents)?;
        // The distance is that of the parent alone: nothing else is moved by it.
        let mut aim = true;
        if self.uniform_below(3) == 0
            && let Some(other) = self.on_any_hill()
        {
            near.known.sequence = self.joined(&near.known, &other.known);
            aim = false;
        }
        // One variation, and every other time one more: a step on a plateau may need two at once.
        for _ in 0..VARIATIONS {
            let aimed = if aim && self.uniform_below(3) == 0 { self.aimed(&near) } else { None };
            near.known.sequence = match aimed {
                Some(aimed) => aimed,
                None if self.uniform_below(2) == 0 => self.changed(&near.known),
                None => self.nudged(&near.known),
            };
            aim = false;
            if self.uniform_below(2) == 0 {
                break;
            }
        }
        Some(near.known.sequence)
    }

    /// The nearer of two.
    fn parent(&mut self, parents: &[Near]) -> Option<Near> {
        let n = parents.len() as u32;
        let nearer = self.uniform_below(n).min(self.uniform_below(n));
        parents.get(nearer as usize).cloned()
    }

    /// One of the nearest to any limit.
    fn on_any_hill(&mut self) -> Option<Near> {
        let hills = self.climb().weights().len() as u32;
        let n = self.uniform_below(hills) as usize;
        let nearest = self.climb().nearest(n).to_vec();
        self.parent(&nearest)
    }

    /// Actions of both, each once, cut at random to the longest sequence: steps towards several limits may be needed
    /// together.
    fn joined(&mut self, one: &Known, other: &Known) -> AttackSequence {
        let mut actions = [one.sequence.actions(), other.sequence.actions()].concat();
        actions.sort();
        actions.dedup();
        while actions.len() > self.longest() as usize {
            let dropped = self.uniform_below(actions.len() as u32) as usize;
            actions.swap_remove(dropped);
        }
        AttackSequence::new(actions)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use oracle::{Approaches, Limit};
    use scenario::{AttackSpace, find_root};
    use wire::bounds::Bounds;

    use super::*;
    use crate::draw::Strategy;
    use crate::moments::Moments;

    #[test]
    fn sequence_short_of_a_limit_moves_to_it() {
        let root = find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
        let space = AttackSpace::load(&root.join("scenarios/spaces/path.toml")).unwrap();
        let bounds = Bounds::GROUND;
        let mut drawer = Drawer::new(&space, &bounds, Strategy::Guided, 1, Moments::default(), &Approaches::new());
        // Held up for 1 s by 500 ms, 2.5 s into the run, 100 ms short of the limit.
        let kind = space.moves.iter().position(|action_type| action_type.name.as_str() == "hold-up").unwrap();
        let action = Action { begins: 250, kind, places: vec![95, 49] };
        let sequence = AttackSequence::new(vec![action.clone()]);
        let way = AT_LIMIT - 100 * (AT_LIMIT / bounds.to_hold_safe_ms as u32);
        let known = Known { sequence: sequence.clone(), moments: Moments::default() };
        let near = |limit| Near { limit, way, known: known.clone(), tried: 0 };
        let mut moved = std::collections::BTreeSet::new();
        for _ in 0..200 {
            let aimed = drawer.aimed(&near(Limit::Uplink)).unwrap();
            let now = &aimed.actions()[0];
            let changes = [now.begins.abs_diff(action.begins), now.places[0].abs_diff(95), now.places[1].abs_diff(49)];
            assert_eq!(changes.iter().filter(|change| **change > 0).count(), 1, "{aimed:?}");
            let change = changes.iter().sum::<u32>();
            assert!((10..=18).contains(&change), "{change} ticks, where 100 ms were missing");
            moved.insert((now.begins != action.begins, now.places[0] != 95, now > &action, change));
        }
        assert_eq!(moved.len(), 2 * 3 * BEYOND.len(), "every time, both ways, each a little more: {moved:?}");
        assert!(drawer.aimed(&near(Limit::Fence)).is_none(), "a distance is not a time to move by");
    }
}
