//! Where words come from: three strategies, each with one fixed way to draw.
//!
//! *Uniform* draws length, moves, moments and numbers evenly from the alphabet: what a search is measured against.
//! *Transitions* begins everything where the unit changes mode in the run without an attack, as AVIS does (Taylor et al., "AVIS:
//! In-Situ Model Checking for Unmanned Aerial Vehicles", DSN 2021), numbers evenly. *Guided* deals the moves like cards, each once
//! before any comes again, draws moments from changes, edges of bounds and evenly, and, as fresh words cease to show anything
//! new, changes words that did. Nothing has probability zero in any but the second.

use std::collections::VecDeque;

use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use serde::Serialize;

use super::moments::Moments;
use super::word::{Letter, Word, move_of};
use crate::scenario::{Alphabet, Range};

/// So many of the newest fresh words say how often a fresh word still shows something new.
const NEWEST: usize = 16;
/// Out of ten guided words, how many are made from one that showed something new, when none of the newest fresh ones did.
const FROM_KNOWN: u32 = 7;
/// Of ten guided moments, how many are a change of mode and a little after; how many of the others the edge of a bound. The
/// rest are drawn evenly.
const AT_CHANGES: u32 = 4;
const AT_EDGES: u32 = 3;
/// How long after a change of mode still counts as at it, ticks.
const AFTER_CHANGE: u32 = 30;

/// Most words that are kept to be changed; the oldest goes.
const MOST_KNOWN: usize = 4_096;

/// How words are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Strategy {
    /// Evenly.
    Uniform,
    /// At changes of mode.
    Transitions,
    /// By what was new so far.
    Guided,
}

impl Strategy {
    /// Every strategy, that which others are measured against first.
    pub const ALL: [Strategy; 3] = [Strategy::Uniform, Strategy::Transitions, Strategy::Guided];

    /// Whether it draws from the moments of the run without a word.
    pub(super) fn reads_moments(self) -> bool {
        match self {
            Strategy::Uniform => false,
            Strategy::Transitions | Strategy::Guided => true,
        }
    }
}

/// A word that showed something new.
#[derive(Clone, Debug)]
pub(super) struct Known {
    pub(super) word: Word,
    pub(super) moments: Moments,
}

/// Draws words.
#[derive(Debug)]
pub(super) struct Drawer<'a> {
    alphabet: &'a Alphabet,
    strategy: Strategy,
    rng: ChaCha8Rng,
    nominal: Moments,
    known: VecDeque<Known>,
    /// Of each word that was drawn and of which nothing was learned yet, in order: whether it is a fresh one.
    drawn: VecDeque<bool>,
    /// Of each of the newest fresh words: whether it showed something new.
    fresh: VecDeque<bool>,
    /// Moves that are still to be dealt.
    deck: Vec<usize>,
}

impl<'a> Drawer<'a> {
    /// Of the words over `alphabet`; `nominal` are the moments of the run without any.
    pub(super) fn new(alphabet: &'a Alphabet, strategy: Strategy, seed: u64, nominal: Moments) -> Self {
        Self {
            alphabet,
            strategy,
            rng: ChaCha8Rng::seed_from_u64(seed),
            nominal,
            known: VecDeque::new(),
            drawn: VecDeque::new(),
            fresh: VecDeque::new(),
            deck: Vec::new(),
        }
    }

    /// What came of the first word of which nothing was learned yet: the moments of its run where it showed something new.
    pub(super) fn learn(&mut self, word: &Word, moments: Option<Moments>) {
        if self.drawn.pop_front() == Some(true) {
            self.fresh.push_back(moments.is_some());
            if self.fresh.len() > NEWEST {
                self.fresh.pop_front();
            }
        }
        if let Some(moments) = moments {
            if self.known.len() == MOST_KNOWN {
                self.known.pop_front();
            }
            self.known.push_back(Known { word: word.clone(), moments });
        }
    }

    /// The next word.
    pub(super) fn word(&mut self) -> Word {
        let fresh = self.strategy != Strategy::Guided || self.known.is_empty() || !self.fresh_is_stale();
        self.drawn.push_back(fresh);
        if !fresh {
            let known = self.known();
            return self.changed(&known);
        }
        let longest = self.longest();
        let length = 1 + self.below(longest);
        let nominal = self.nominal.clone();
        Word::new((0..length).map(|_| self.letter(&nominal)).collect())
    }

    /// More often so the fewer of the newest fresh words showed something new: while they do, they see more than changed ones.
    fn fresh_is_stale(&mut self) -> bool {
        let stale = self.fresh.iter().filter(|new| !**new).count() as u32;
        self.below(10 * NEWEST as u32) < FROM_KNOWN * stale
    }

    /// One that showed something new: every other time one of the newest.
    fn known(&mut self) -> Known {
        let n = self.known.len() as u32;
        let from = if self.below(2) == 0 { n.saturating_sub(16) } else { 0 };
        let i = from + self.below(n - from);
        self.known[i as usize].clone()
    }

    /// The same word with one thing changed.
    fn changed(&mut self, known: &Known) -> Word {
        let mut letters = known.word.letters().to_vec();
        let some = self.below(letters.len() as u32) as usize;
        match (self.below(5), letters.get(some).cloned()) {
            (0, _) if (letters.len() as u32) < self.longest() => letters.push(self.letter(&known.moments)),
            (1, Some(_)) if letters.len() > 1 => drop(letters.remove(some)),
            (2 | 0, Some(letter)) => letters[some] = Letter { begins: self.moment(&known.moments), ..letter },
            (3 | 1, Some(letter)) => {
                let places = self.places(letter.kind, &known.moments);
                letters[some] = Letter { places, ..letter };
            }
            (_, Some(letter)) => letters[some] = Letter { begins: letter.begins, ..self.letter(&known.moments) },
            (_, None) => letters.push(self.letter(&known.moments)),
        }
        Word::new(letters)
    }

    fn letter(&mut self, moments: &Moments) -> Letter {
        let kind = match self.strategy {
            Strategy::Uniform | Strategy::Transitions => self.below(self.alphabet.moves.len() as u32) as usize,
            Strategy::Guided => self.dealt(),
        };
        let begins = self.moment(moments);
        Letter { begins, kind, places: self.places(kind, moments) }
    }

    /// A move, of those that were not dealt since all were.
    fn dealt(&mut self) -> usize {
        if self.deck.is_empty() {
            self.deck.extend(0..self.alphabet.moves.len());
        }
        let i = self.below(self.deck.len() as u32) as usize;
        self.deck.swap_remove(i)
    }

    fn moment(&mut self, moments: &Moments) -> u32 {
        let (first, last) = self.alphabet.begins();
        let even = |drawer: &mut Self| first + drawer.below(last - first + 1);
        match self.strategy {
            Strategy::Uniform => even(self),
            Strategy::Transitions => self.one_of(&moments.changes).unwrap_or(first),
            Strategy::Guided => {
                let drawn = self.below(10);
                let moment = if drawn < AT_CHANGES {
                    let after = self.below(AFTER_CHANGE);
                    self.one_of(&moments.changes).map(|at| at + after)
                } else if drawn < AT_CHANGES + AT_EDGES {
                    self.one_of(&moments.edges)
                } else {
                    None
                };
                moment.map_or_else(|| even(self), |at| at.clamp(first, last))
            }
        }
    }

    fn places(&mut self, of: usize, moments: &Moments) -> Vec<u32> {
        let letter = Letter { begins: 0, kind: of, places: Vec::new() };
        let ranges: Vec<Range> = move_of(self.alphabet, &letter).ranges().copied().collect();
        ranges.iter().map(|range| self.place(range, moments)).collect()
    }

    fn place(&mut self, range: &Range, moments: &Moments) -> u32 {
        let even = |drawer: &mut Self| drawer.below(range.last() + 1);
        match self.strategy {
            Strategy::Uniform | Strategy::Transitions => even(self),
            Strategy::Guided => match self.below(3) {
                0 => range.last(),
                1 => self.one_of(&moments.lengths).map_or(0, |length| range.place(f64::from(length))),
                _ => even(self),
            },
        }
    }

    fn longest(&self) -> u32 {
        self.alphabet.longest.unsigned() as u32
    }

    fn one_of(&mut self, of: &[u32]) -> Option<u32> {
        let i = self.below(of.len() as u32) as usize;
        of.get(i).copied()
    }

    /// Even below `n`, to within 2^-32; 0 where `n` is 0.
    fn below(&mut self, n: u32) -> u32 {
        ((u64::from(self.rng.next_u32()) * u64::from(n)) >> 32) as u32
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::scenario::find_root;

    fn alphabet() -> Alphabet {
        let root = find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
        Alphabet::load(&root.join("scenarios/alphabets/sensors.toml")).unwrap()
    }

    #[test]
    fn guided_drawing_deals_every_move_before_any_comes_again() {
        let alphabet = alphabet();
        let mut drawer = Drawer::new(&alphabet, Strategy::Guided, 1, Moments::default());
        let letters: Vec<usize> = (0..100)
            .flat_map(|_| drawer.word().letters().iter().map(|letter| letter.kind).collect::<Vec<_>>())
            .collect();
        let mut counts = vec![0; alphabet.moves.len()];
        letters.iter().for_each(|kind| counts[*kind] += 1);
        assert!(counts.iter().max().unwrap() - counts.iter().min().unwrap() <= 1, "{counts:?}");
    }

    #[test]
    fn known_words_are_changed_only_once_fresh_ones_cease_to_show_anything_new() {
        let alphabet = alphabet();
        let changed = |new: bool| {
            let mut drawer = Drawer::new(&alphabet, Strategy::Guided, 1, Moments::default());
            for i in 0..200 {
                let word = drawer.word();
                drawer.learn(&word, (new || i == 0).then(Moments::default));
            }
            (0..100)
                .filter(|_| {
                    drawer.word();
                    !drawer.drawn.back().unwrap()
                })
                .count()
        };
        assert_eq!(changed(true), 0);
        let stale = changed(false);
        assert!((50..=90).contains(&stale), "{stale} of 100, where seven of ten are meant");
    }
}
