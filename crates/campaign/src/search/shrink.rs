//! From a word that was found to the one that says it best: the fewest moves, at canonical moments, with the smallest
//! numbers that keep class and cause; and the margin of each number.
//!
//! What is tried in which order is fixed, and each step looks for the first that holds and not for a better one than before,
//! so words that mean the same end as the same word. Numbers are halved between what holds and what does not: what they find
//! is an edge, and the only one where more is never less.

use std::collections::BTreeMap;

use serde::Serialize;

use super::moments::Moments;
use super::tried::{Cause, Ground, Test};
use super::word::{Letter, Word, move_of};
use crate::scenario::{Move, Range};

/// A word shrunk.
#[derive(Clone, Debug)]
pub struct Shrunk {
    /// The word.
    pub word: Word,
    /// Trials that it took.
    pub executions: u64,
    /// Where each number stands to its edge.
    pub margins: Vec<Margin>,
}

/// A number, and the nearest weaker one, which no longer does it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Margin {
    /// The move.
    pub of: String,
    /// `duration_s`, or the number's key.
    pub number: String,
    /// What does it; milliseconds for a length.
    pub holds: f64,
    /// What does not; nothing where the weakest of the range does it.
    pub fails: Option<f64>,
}

struct Shrinker<'a> {
    ground: &'a Ground,
    test: Test<'a>,
    cause: &'a Cause,
    tried: BTreeMap<Word, bool>,
}

impl Ground {
    /// Shrinks a word that `test` found for `cause`; `moments` are those of the run without any word.
    ///
    /// # Errors
    /// Why a word cannot be run.
    pub fn shrink(&self, word: &Word, test: Test<'_>, cause: &Cause, moments: &Moments) -> Result<Shrunk, String> {
        let mut shrinker = Shrinker { ground: self, test, cause, tried: BTreeMap::from([(word.clone(), true)]) };
        let mut word = shrinker.fewest(word.clone())?;
        for i in 0..word.letters().len() {
            word = shrinker.simplest(word, i)?;
            word = shrinker.canonical_moment(word, i, moments)?;
        }
        let mut margins = Vec::new();
        for i in 0..word.letters().len() {
            let (smaller, of) = shrinker.smallest_numbers(word, i)?;
            word = smaller;
            margins.extend(of);
        }
        Ok(Shrunk { word, executions: shrinker.tried.len() as u64 - 1, margins })
    }
}

impl Shrinker<'_> {
    fn holds(&mut self, word: &Word) -> Result<bool, String> {
        if let Some(known) = self.tried.get(word) {
            return Ok(*known);
        }
        let holds = (self.test)(&self.ground.try_word(word)?).as_ref() == Some(self.cause);
        self.tried.insert(word.clone(), holds);
        Ok(holds)
    }

    /// The first of the words that holds.
    fn first(&mut self, words: impl IntoIterator<Item = Word>) -> Result<Option<Word>, String> {
        for word in words {
            if self.holds(&word)? {
                return Ok(Some(word));
            }
        }
        Ok(None)
    }

    /// Fewer of its letters; or one other move, at its strongest, where one of them begins.
    fn fewest(&mut self, word: Word) -> Result<Word, String> {
        for n in 1..word.letters().len() {
            if let Some(fewer) = self.first(word.subwords(n))? {
                return Ok(fewer);
            }
            if n == 1 {
                let begins = word.letters().iter().map(|letter| letter.begins);
                let alone: Vec<Word> =
                    begins.flat_map(|at| self.strongest(at)).map(|one| Word::new(vec![one])).collect();
                if let Some(one) = self.first(alone)? {
                    return Ok(one);
                }
            }
        }
        Ok(word)
    }

    /// The earliest move of the alphabet that does it in place of letter `i`, at its strongest; else the letter itself.
    fn simplest(&mut self, word: Word, i: usize) -> Result<Word, String> {
        let letter = word.letters()[i].clone();
        let others = self.strongest(letter.begins).into_iter().take(letter.kind + 1);
        let others: Vec<Word> = others.map(|other| word.with(i, other)).collect();
        Ok(self.first(others)?.unwrap_or(word))
    }

    /// Letter `i` at the first moment that does it: the first of the alphabet, then each change of mode in order; else the
    /// earliest, by halving.
    fn canonical_moment(&mut self, word: Word, i: usize, moments: &Moments) -> Result<Word, String> {
        let letter = word.letters()[i].clone();
        let (first, _) = self.ground.alphabet.begins();
        let moved = |begins: u32| word.with(i, Letter { begins, ..letter.clone() });
        let candidates = std::iter::once(first).chain(moments.changes.iter().copied());
        let candidates: Vec<Word> = candidates.filter(|at| *at <= letter.begins).map(moved).collect();
        if let Some(word) = self.first(candidates)? {
            return Ok(word);
        }
        let before = moments.changes.iter().rev().find(|at| **at < letter.begins).copied().unwrap_or(first);
        let begins = self.edge(before, letter.begins, moved)?;
        Ok(moved(begins))
    }

    /// Each number of letter `i`, in turn, as small as it can be.
    fn smallest_numbers(&mut self, mut word: Word, i: usize) -> Result<(Word, Vec<Margin>), String> {
        let mut margins = Vec::new();
        for n in 0..word.letters()[i].places.len() {
            let letter = word.letters()[i].clone();
            let with = |place: u32| {
                let mut places = letter.places.clone();
                places[n] = place;
                word.with(i, Letter { places, ..letter.clone() })
            };
            let place = if self.holds(&with(0))? { 0 } else { self.edge(0, letter.places[n], with)? };
            word = with(place);
            margins.push(self.margin(&letter, n, place));
        }
        Ok((word, margins))
    }

    fn margin(&self, letter: &Letter, n: usize, place: u32) -> Margin {
        let of = move_of(&self.ground.alphabet, letter);
        let lasts = of.lasts_ms.is_some();
        let range = of.ranges().nth(n).expect("invariant: a letter has a place for each range of its move");
        let key = || of.varies[n - usize::from(lasts)].key.as_str().to_owned();
        Margin {
            of: of.name.as_str().to_owned(),
            number: if lasts && n == 0 { "duration_ms".to_owned() } else { key() },
            holds: range.at(place),
            fails: place.checked_sub(1).map(|weaker| range.at(weaker)),
        }
    }

    /// The least of `(low, high]` that holds, where `low` does not and `high` does.
    fn edge(&mut self, mut low: u32, mut high: u32, word: impl Fn(u32) -> Word) -> Result<u32, String> {
        while high > low + 1 {
            let middle = low + (high - low) / 2;
            if self.holds(&word(middle))? {
                high = middle;
            } else {
                low = middle;
            }
        }
        Ok(high)
    }

    /// Each move, at its strongest, to begin then.
    fn strongest(&self, begins: u32) -> Vec<Letter> {
        let moves = self.ground.alphabet.moves.iter().enumerate();
        let letter =
            |(kind, of): (usize, &Move)| Letter { begins, kind, places: of.ranges().map(Range::last).collect() };
        moves.map(letter).collect()
    }
}
