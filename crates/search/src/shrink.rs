//! From a found sequence to its clearest form: the fewest actions, at canonical moments, with the smallest numbers that keep
//! class and cause; and the margin of each number.
//!
//! The order of tries is fixed, and each step takes the first success rather than a better one, so equivalent sequences end
//! as the same sequence. Where a single action suffices at a moment that the run without an attack has, the search for it
//! ignores the found sequence: only its cause is left then. Numbers are halved between a success and a failure: they find an
//! edge, and the only one where more is never less.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::moments::Moments;
use super::sequence::{Action, AttackSequence, move_of};
use super::tried::{Cause, SearchConfig, Test};

/// A word shrunk.
#[derive(Clone, Debug)]
pub struct Shrunk {
    /// The word.
    pub word: AttackSequence,
    /// Trials that it took.
    pub executions: u64,
    /// Margin of each number to its edge.
    pub margins: Vec<Margin>,
}

/// A number, and the nearest weaker one, which no longer does it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Margin {
    /// The move.
    pub of: String,
    /// `duration_s`, or the number's key.
    pub number: String,
    /// Value on the edge that suffices; milliseconds for a length.
    pub holds: f64,
    /// Next weaker value, which fails; `None` where the weakest of the range suffices.
    pub fails: Option<f64>,
}

/// Most choices of moments for several moves that are tried together.
const MOST_TOGETHER: usize = 36;

struct Shrinker<'a> {
    ground: &'a SearchConfig,
    test: Test<'a>,
    cause: &'a Cause,
    tried: BTreeMap<AttackSequence, bool>,
}

impl SearchConfig {
    /// Shrinks a word that `test` found for `cause`; `moments` are those of the run without any word.
    ///
    /// # Errors
    /// Why a word cannot be run.
    pub fn shrink(
        &self,
        word: &AttackSequence,
        test: Test<'_>,
        cause: &Cause,
        moments: &Moments,
    ) -> Result<Shrunk, String> {
        let mut shrinker = Shrinker { ground: self, test, cause, tried: BTreeMap::from([(word.clone(), true)]) };
        let mut letters = match shrinker.alone(moments)? {
            Some(letters) => letters,
            None => shrinker.canonical(word, moments)?,
        };
        let mut margins = Vec::new();
        for i in 0..letters.len() {
            let (smaller, of) = shrinker.smallest_numbers(letters, i)?;
            letters = smaller;
            margins.extend(of);
        }
        Ok(Shrunk { word: AttackSequence::new(letters), executions: shrinker.tried.len() as u64 - 1, margins })
    }
}

/// The letters with another in place of letter `i`: each keeps its place here, wherever it stands in time.
fn with(letters: &[Action], i: usize, letter: Action) -> Vec<Action> {
    let mut letters = letters.to_vec();
    letters[i] = letter;
    letters
}

impl Shrinker<'_> {
    fn holds(&mut self, word: &AttackSequence) -> Result<bool, String> {
        if let Some(known) = self.tried.get(word) {
            return Ok(*known);
        }
        let holds = (self.test)(&self.ground.try_word(word)?).as_ref() == Some(self.cause);
        self.tried.insert(word.clone(), holds);
        Ok(holds)
    }

    /// The first of the words that holds.
    fn first(&mut self, words: impl IntoIterator<Item = Vec<Action>>) -> Result<Option<Vec<Action>>, String> {
        for letters in words {
            if self.holds(&AttackSequence::new(letters.clone()))? {
                return Ok(Some(letters));
            }
        }
        Ok(None)
    }

    /// The earliest move of the alphabet that does it by itself, at its strongest, at the first moment of the alphabet or at a
    /// change of mode.
    fn alone(&mut self, moments: &Moments) -> Result<Option<Vec<Action>>, String> {
        let (first, _) = self.ground.alphabet.begins();
        let begins: Vec<u32> = std::iter::once(first).chain(moments.changes.iter().copied()).collect();
        let mut letters: Vec<Action> = begins.into_iter().flat_map(|at| self.strongest(at)).collect();
        letters.sort_by_key(|letter| (letter.kind, letter.begins));
        self.first(letters.into_iter().map(|letter| vec![letter]))
    }

    /// The fewest letters of a word, each the simplest that does it, at its canonical moment.
    fn canonical(&mut self, word: &AttackSequence, moments: &Moments) -> Result<Vec<Action>, String> {
        let mut letters = self.fewest(word.clone())?.letters().to_vec();
        // By move and not by time: which of them was found to begin first decides nothing.
        letters.sort_by_key(|letter| (letter.kind, letter.begins));
        if let Some(together) = self.together(&letters, moments)? {
            letters = together;
            for i in 0..letters.len() {
                letters = self.simplest(letters, i)?;
            }
            letters.sort_by_key(|letter| (letter.kind, letter.begins));
            return Ok(self.together(&letters, moments)?.unwrap_or(letters));
        }
        for i in 0..letters.len() {
            letters = self.simplest(letters, i)?;
            letters = self.canonical_moment(letters, i, moments)?;
        }
        Ok(letters)
    }

    /// The same action types, all at their strongest, at the first canonical moments that suffice. The requirement on one of
    /// several depends on the others: taken together, only their types are left of the way they were found.
    fn together(&mut self, letters: &[Action], moments: &Moments) -> Result<Option<Vec<Action>>, String> {
        let (first, _) = self.ground.alphabet.begins();
        let begins: Vec<u32> = std::iter::once(first).chain(moments.changes.iter().copied()).collect();
        let mut words = vec![Vec::new()];
        for letter in letters {
            let places = move_of(&self.ground.alphabet, letter).strongest();
            let later = |word: Vec<Action>| {
                let next = |at: &u32| Action { begins: *at, kind: letter.kind, places: places.clone() };
                begins.iter().map(|at| [&word[..], &[next(at)]].concat()).collect::<Vec<_>>()
            };
            words = words.into_iter().flat_map(later).take(MOST_TOGETHER).collect();
        }
        self.first(words)
    }

    /// Fewer of its letters.
    fn fewest(&mut self, word: AttackSequence) -> Result<AttackSequence, String> {
        for n in 1..word.letters().len() {
            let fewer = word.subwords(n).into_iter().map(|word| word.letters().to_vec());
            if let Some(letters) = self.first(fewer)? {
                return Ok(AttackSequence::new(letters));
            }
        }
        Ok(word)
    }

    /// The earliest move of the alphabet that does it in place of letter `i`, at its strongest; else the letter itself.
    fn simplest(&mut self, letters: Vec<Action>, i: usize) -> Result<Vec<Action>, String> {
        let others = self.strongest(letters[i].begins).into_iter().take(letters[i].kind + 1);
        let others: Vec<_> = others.map(|other| with(&letters, i, other)).collect();
        Ok(self.first(others)?.unwrap_or(letters))
    }

    /// Action `i` at the first moment that does it: the first of the alphabet, then each change of mode in order; else the
    /// earliest, by halving.
    fn canonical_moment(&mut self, letters: Vec<Action>, i: usize, moments: &Moments) -> Result<Vec<Action>, String> {
        let found = letters[i].begins;
        let (first, _) = self.ground.alphabet.begins();
        let moved = |begins: u32| with(&letters, i, Action { begins, ..letters[i].clone() });
        let candidates = std::iter::once(first).chain(moments.changes.iter().copied());
        if let Some(letters) = self.first(candidates.filter(|at| *at <= found).map(moved))? {
            return Ok(letters);
        }
        let before = moments.changes.iter().rev().find(|at| **at < found).copied().unwrap_or(first);
        self.edge(before, found, moved).map(moved)
    }

    /// Each number of letter `i`, in turn, as small as it can be.
    fn smallest_numbers(&mut self, mut letters: Vec<Action>, i: usize) -> Result<(Vec<Action>, Vec<Margin>), String> {
        let mut margins = Vec::new();
        for n in 0..letters[i].places.len() {
            let letter = letters[i].clone();
            let at = |place: u32| {
                let mut places = letter.places.clone();
                places[n] = place;
                with(&letters, i, Action { places, ..letter.clone() })
            };
            let weakest = self.holds(&AttackSequence::new(at(0)))?;
            let place = if weakest { 0 } else { self.edge(0, letter.places[n], at)? };
            margins.push(self.margin(&letter, n, place));
            letters = at(place);
        }
        Ok((letters, margins))
    }

    fn margin(&self, letter: &Action, n: usize, place: u32) -> Margin {
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
    fn edge(&mut self, mut low: u32, mut high: u32, word: impl Fn(u32) -> Vec<Action>) -> Result<u32, String> {
        while high > low + 1 {
            let middle = low + (high - low) / 2;
            if self.holds(&AttackSequence::new(word(middle)))? {
                high = middle;
            } else {
                low = middle;
            }
        }
        Ok(high)
    }

    /// Each move, at its strongest, to begin then.
    fn strongest(&self, begins: u32) -> Vec<Action> {
        let moves = self.ground.alphabet.moves.iter().enumerate();
        moves.map(|(kind, of)| Action { begins, kind, places: of.strongest() }).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::tried::Tried;
    use super::*;
    use evidence::trial::Outcome;
    use scenario::{Alphabet, Range, Setup, find_root};

    fn ground() -> SearchConfig {
        let root = find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
        let scenario = scenario::load(&root.join("scenarios/control/nominal.toml")).unwrap();
        let setup = Setup::load(&root, &scenario, None, false).unwrap();
        let alphabet = Alphabet::load(&root.join("scenarios/alphabets/path.toml")).unwrap();
        SearchConfig::new(scenario, setup, 1, alphabet).unwrap()
    }

    fn kind(ground: &SearchConfig, name: &str) -> usize {
        ground.alphabet.moves.iter().position(|of| of.name.as_str() == name).unwrap()
    }

    /// Every sequence with a silence of half a second and a delay of at least 300 ms in it, at any time, is a finding.
    #[test]
    fn equivalent_words_shrink_to_the_same_word() {
        let ground = ground();
        let (silence, delay, copies) =
            (kind(&ground, "command-stall"), kind(&ground, "hold-up"), kind(&ground, "copy"));
        let cause = Cause { outcome: Outcome::Unsafe, broken: "both".to_owned() };
        let test = |tried: &Tried| {
            let has = |kind: usize, n: usize, least: f64| {
                let ranges: Vec<Range> = ground.alphabet.moves[kind].ranges().copied().collect();
                let mut of = tried.word.letters().iter().filter(|letter| letter.kind == kind);
                of.any(|letter| ranges[n].at(letter.places[n]) >= least)
            };
            (has(silence, 0, 500.0) && has(delay, 1, 300.0)).then(|| cause.clone())
        };
        let letter = |kind: usize, begins: u32, places: &[u32]| Action { kind, begins, places: places.to_vec() };
        let found = [
            vec![letter(silence, 600, &[300]), letter(delay, 300, &[20, 150])],
            vec![letter(delay, 700, &[390, 299]), letter(silence, 200, &[60]), letter(copies, 400, &[10, 3])],
        ];
        let moments = Moments { changes: vec![100, 250], ..Moments::default() };
        let shrunk =
            found.map(|letters| ground.shrink(&AttackSequence::new(letters), &test, &cause, &moments).unwrap());
        assert_eq!(shrunk[0].word, shrunk[1].word);
        let told = shrunk[0].word.told(&ground.alphabet);
        assert_eq!(told, "hold-up at 0.50 s for 0.05 s (by_ms = 300), command-stall at 0.50 s for 0.50 s");
        assert!(shrunk.iter().all(|shrunk| shrunk.executions <= 100), "{shrunk:?}");
        let edge = |margin: &Margin| (margin.number.clone(), margin.holds, margin.fails);
        let edges: Vec<_> = shrunk[0].margins.iter().map(edge).collect();
        let expected =
            [("duration_ms", 50.0, None), ("by_ms", 300.0, Some(290.0)), ("duration_ms", 500.0, Some(490.0))];
        assert_eq!(edges, expected.map(|(number, holds, fails)| (number.to_owned(), holds, fails)));
    }
}
