//! State of a search run: the sequences with new situations, the nearest to each limit, and the value of each action type.
//!
//! Drawing from it is `draw`'s.

use std::collections::{BTreeMap, VecDeque};

use super::moments::Moments;
use super::sequence::AttackSequence;
use oracle::{AT_LIMIT, Approaches, Limit};

/// Number of newest fresh sequences by which the search judges whether fresh ones still show something new.
pub(super) const NEWEST: usize = 16;
/// Most sequences that are kept because they were new; the oldest goes.
const MOST_KNOWN: usize = 4_096;
/// Most sequences that are kept because they came nearest; beyond it no new set of action types is kept.
const MOST_NEAREST: usize = 1_024;
/// Bound beyond a limit at which approach no longer counts: the oracle has seen the value and accepted it.
pub(super) const FARTHEST: u32 = 2 * AT_LIMIT;
/// Least approach that counts as nearer, a thousandth of the way: less is the jitter of a run.
pub(super) const GAIN: u32 = AT_LIMIT / 1_000;

/// A sequence worth changing.
#[derive(Clone, Debug)]
pub(super) struct Known {
    pub(super) sequence: AttackSequence,
    /// The moments of its run.
    pub(super) moments: Moments,
}

/// The sequence that came nearest to a limit.
#[derive(Clone, Debug)]
pub(super) struct Near {
    pub(super) limit: Limit,
    /// Its approach, in millionths of the way.
    pub(super) way: u32,
    pub(super) known: Known,
    /// Sequences that were made from it.
    pub(super) tried: u32,
}

/// Lesson of one trial.
#[derive(Clone, Debug)]
pub(super) struct Lesson {
    pub(super) known: Known,
    /// True if it showed something new.
    pub(super) new: bool,
    /// Its approach to each limit; empty where the attack did not arrive.
    pub(super) approaches: Approaches,
}

/// Sequences in which a move was, and the number that showed something new or came nearer than any before.
#[derive(Clone, Copy, Debug, Default)]
struct Worth {
    tried: u32,
    gained: u32,
}

/// Everything learned.
#[derive(Debug)]
pub(super) struct Learned {
    known: VecDeque<Known>,
    /// Approach of the run without an attack to each limit, and the furthest of any.
    nominal: Approaches,
    furthest: Approaches,
    /// The sequence nearest to each limit, for each set of action types: a set that cannot come any nearer does not displace
    /// one that can.
    nearest: BTreeMap<(Limit, Vec<usize>), Near>,
    /// Novelty of each of the newest fresh sequences: whether it showed something new.
    fresh: VecDeque<bool>,
    moves: Vec<Worth>,
}

impl Learned {
    /// The initial state, for a given number of action types; `nominal` is the approach of the run without an attack.
    pub(super) fn new(moves: usize, nominal: &Approaches) -> Self {
        Self {
            known: VecDeque::new(),
            nominal: nominal.clone(),
            furthest: nominal.clone(),
            nearest: BTreeMap::new(),
            fresh: VecDeque::new(),
            moves: vec![Worth::default(); moves],
        }
    }

    /// Learns from a trial; `fresh` where its sequence was made from no other.
    pub(super) fn take(&mut self, lesson: Lesson, fresh: bool) {
        if fresh {
            self.fresh.push_back(lesson.new);
            if self.fresh.len() > NEWEST {
                self.fresh.pop_front();
            }
        }
        let nearer = self.nearer(&lesson);
        for action in lesson.known.sequence.actions() {
            let worth = &mut self.moves[action.kind];
            worth.tried = worth.tried.saturating_add(1);
            worth.gained = worth.gained.saturating_add(u32::from(lesson.new || nearer));
        }
        if lesson.new {
            if self.known.len() == MOST_KNOWN {
                self.known.pop_front();
            }
            self.known.push_back(lesson.known);
        }
    }

    /// Keeps the sequence for each limit to which it came nearer than the run without a sequence, and than any of the
    /// same moves. True if it came nearer to a limit than any sequence before.
    fn nearer(&mut self, lesson: &Lesson) -> bool {
        let mut moves: Vec<usize> = lesson.known.sequence.actions().iter().map(|action| action.kind).collect();
        moves.sort_unstable();
        let mut any = false;
        for (limit, way) in &lesson.approaches {
            let (limit, way) = (*limit, (*way).min(FARTHEST));
            if self.nominal.get(&limit).is_some_and(|nominal| way <= *nominal) {
                continue;
            }
            let furthest = self.furthest.entry(limit).or_default();
            if way >= furthest.saturating_add(GAIN) {
                any = true;
                *furthest = way;
            }
            let key = (limit, moves.clone());
            let best = self.nearest.get(&key).map(|near| near.way);
            if best.map_or(self.nearest.len() < MOST_NEAREST, |best| way >= best.saturating_add(GAIN)) {
                self.nearest.insert(key, Near { limit, way, known: lesson.known.clone(), tried: 0 });
            }
        }
        any
    }

    /// Number of the newest fresh sequences without a new situation.
    pub(super) fn stale(&self) -> u32 {
        self.fresh.iter().filter(|new| !**new).count() as u32
    }

    /// The sequences that showed something new, oldest first.
    pub(super) fn known(&self) -> &VecDeque<Known> {
        &self.known
    }

    /// Weight of changing each of the sequences nearest to a limit: higher for nearer ones, lower with each try since it came
    /// so near.
    pub(super) fn nearest(&self) -> impl Iterator<Item = u64> + '_ {
        self.nearest.values().map(|near| u64::from(near.way).pow(2) / (8 + u64::from(near.tried)))
    }

    /// The `n`th of them, to be changed.
    pub(super) fn take_nearest(&mut self, n: usize) -> Option<Near> {
        let near = self.nearest.values_mut().nth(n)?;
        near.tried = near.tried.saturating_add(1);
        Some(near.clone())
    }

    /// Weight of each action type, by its place in the attack space: in proportion to its gains, never zero.
    pub(super) fn weights(&self) -> impl Iterator<Item = u64> + '_ {
        self.moves.iter().map(|worth| 1_000 * u64::from(worth.gained + 1) / u64::from(worth.tried + 1) + 1)
    }
}
