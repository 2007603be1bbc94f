//! Actions of an attack sequence, by the names of their types: all that the reference knows of it.

use search::{AttackSequence, SearchConfig};

/// One move at one moment.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Deed {
    pub(super) of: String,
    pub(super) from_ms: f64,
    pub(super) lasts_ms: f64,
    /// The first number that it varies; 0 where there is none.
    pub(super) number: f64,
}

/// Actions of one trial, in order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Deeds {
    pub(super) alphabet: String,
    pub(super) done: Vec<Deed>,
}

impl Deed {
    pub(super) fn until_ms(&self) -> f64 {
        self.from_ms + self.lasts_ms
    }
}

impl Deeds {
    /// Those of a word.
    pub(super) fn of(ground: &SearchConfig, word: &AttackSequence) -> Self {
        let tick = ground.alphabet.tick_ms.unsigned() as f64;
        let done = word.letters().iter().map(|letter| {
            let of = &ground.alphabet.moves[letter.kind];
            let values: Vec<f64> = of.ranges().zip(&letter.places).map(|(range, place)| range.at(*place)).collect();
            let (lasts, numbers) = values.split_at(usize::from(of.lasts_ms.is_some()));
            Deed {
                of: of.name.as_str().to_owned(),
                from_ms: f64::from(letter.begins) * tick,
                lasts_ms: lasts.first().copied().unwrap_or_default(),
                number: numbers.first().copied().unwrap_or_default(),
            }
        });
        Self { alphabet: ground.alphabet.name.as_str().to_owned(), done: done.collect() }
    }

    /// True if the word is over one of these alphabets.
    pub(super) fn over(&self, alphabets: &[&str]) -> bool {
        alphabets.contains(&self.alphabet.as_str())
    }

    /// True if all that is done, and something is, are these of this alphabet.
    pub(super) fn only(&self, alphabet: &str, moves: &[&str]) -> bool {
        self.alphabet == alphabet && !self.done.is_empty() && self.done.iter().all(|d| moves.contains(&d.of.as_str()))
    }

    /// True if any of these is done, in whichever alphabet.
    pub(super) fn any(&self, moves: &[&str]) -> bool {
        self.each(moves).next().is_some()
    }

    /// Each of these.
    pub(super) fn each(&self, moves: &[&str]) -> impl Iterator<Item = &Deed> {
        self.done.iter().filter(move |d| moves.contains(&d.of.as_str()))
    }
}
