//! What a hunt has learned so far: which words showed something new, which came nearest to a limit, and what each move is worth.
//!
//! Drawing from it is `draw`'s.

use std::collections::{BTreeMap, VecDeque};

use super::moments::Moments;
use super::word::Word;
use crate::oracle::{AT_LIMIT, Limit, Nearness};

/// So many of the newest fresh words say how often a fresh word still shows something new.
pub(super) const NEWEST: usize = 16;
/// Most words that are kept because they were new; the oldest goes.
const MOST_KNOWN: usize = 4_096;
/// Beyond so far over a limit nothing is nearer: the oracle has seen it and did not mind.
const FARTHEST: u32 = 2 * AT_LIMIT;

/// A word worth changing.
#[derive(Clone, Debug)]
pub(super) struct Known {
    pub(super) word: Word,
    /// The moments of its run.
    pub(super) moments: Moments,
}

/// The word that came nearest to a limit.
#[derive(Clone, Debug)]
pub(super) struct Near {
    pub(super) limit: Limit,
    /// How far it came, in thousandths of the way.
    pub(super) way: u32,
    pub(super) known: Known,
    /// Words that were made from it.
    pub(super) tried: u32,
}

/// What one trial taught.
#[derive(Clone, Debug)]
pub(super) struct Lesson {
    pub(super) known: Known,
    /// Whether it showed something new.
    pub(super) new: bool,
    /// How near it came; nothing where what was tried did not arrive.
    pub(super) nearness: Nearness,
}

/// Words in which a move was, and those of them that showed something new or came nearer than any before.
#[derive(Clone, Copy, Debug, Default)]
struct Worth {
    tried: u32,
    gained: u32,
}

/// Everything learned.
#[derive(Debug)]
pub(super) struct Learned {
    known: VecDeque<Known>,
    nearest: BTreeMap<Limit, Near>,
    /// Of each of the newest fresh words: whether it showed something new.
    fresh: VecDeque<bool>,
    moves: Vec<Worth>,
}

impl Learned {
    /// Nothing yet, of an alphabet of so many moves; `nominal` is how near the run without a word came.
    pub(super) fn new(moves: usize, nominal: &Nearness) -> Self {
        let nothing = Known { word: Word::default(), moments: Moments::default() };
        let none = |limit, way| Near { limit, way, known: nothing.clone(), tried: 0 };
        let nearest = nominal.iter().map(|(limit, way)| (*limit, none(*limit, *way))).collect();
        Self { known: VecDeque::new(), nearest, fresh: VecDeque::new(), moves: vec![Worth::default(); moves] }
    }

    /// Learns from a trial; `fresh` where its word was made from no other.
    pub(super) fn take(&mut self, lesson: Lesson, fresh: bool) {
        if fresh {
            self.fresh.push_back(lesson.new);
            if self.fresh.len() > NEWEST {
                self.fresh.pop_front();
            }
        }
        let nearer = self.nearer(&lesson);
        for letter in lesson.known.word.letters() {
            let worth = &mut self.moves[letter.kind];
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

    /// Keeps the word for each limit to which it came nearer than any; whether there is one.
    fn nearer(&mut self, lesson: &Lesson) -> bool {
        let mut any = false;
        for (limit, way) in &lesson.nearness {
            let way = (*way).min(FARTHEST);
            if self.nearest.get(limit).is_none_or(|before| way > before.way) {
                let near = Near { limit: *limit, way, known: lesson.known.clone(), tried: 0 };
                self.nearest.insert(*limit, near);
                any = true;
            }
        }
        any
    }

    /// How many of the newest fresh words showed nothing new.
    pub(super) fn stale(&self) -> u32 {
        self.fresh.iter().filter(|new| !**new).count() as u32
    }

    /// The words that showed something new, oldest first.
    pub(super) fn known(&self) -> &VecDeque<Known> {
        &self.known
    }

    /// The words that came nearest to a limit, of each to which any came nearer than the run without a word; and what each is
    /// worth changing: the nearer the more, and the less the more often that was tried since it came so near.
    pub(super) fn nearest(&self) -> impl Iterator<Item = (Limit, u64)> + '_ {
        let came = self.nearest.values().filter(|near| !near.known.word.letters().is_empty());
        came.map(|near| (near.limit, 1_000 * u64::from(near.way) / (8 + u64::from(near.tried)) + 1))
    }

    /// The word that came nearest to `limit`, to be changed.
    pub(super) fn take_nearest(&mut self, limit: Limit) -> Option<Near> {
        let near = self.nearest.get_mut(&limit)?;
        near.tried = near.tried.saturating_add(1);
        Some(near.clone())
    }

    /// What each move is worth, by its place in the alphabet: in proportion to how often it gained, never nothing.
    pub(super) fn weights(&self) -> impl Iterator<Item = u64> + '_ {
        self.moves.iter().map(|worth| 1_000 * u64::from(worth.gained + 1) / u64::from(worth.tried + 1) + 1)
    }
}
