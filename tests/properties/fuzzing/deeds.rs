//! Actions of an attack sequence, by the names of their types: all that the reference knows of it.

use search::{AttackSequence, SearchConfig};

/// One move at one moment.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Deed {
    pub(super) of: String,
    pub(super) from_ms: f64,
    pub(super) lasts_ms: f64,
    /// First number that the move varies; 0 without one.
    pub(super) number: f64,
}

/// Actions of one trial, in order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Deeds {
    pub(super) space: String,
    pub(super) done: Vec<Deed>,
}

impl Deed {
    pub(super) fn until_ms(&self) -> f64 {
        self.from_ms + self.lasts_ms
    }
}

impl Deeds {
    /// Deeds of a sequence.
    pub(super) fn from_sequence(config: &SearchConfig, sequence: &AttackSequence) -> Self {
        let tick = config.space.tick_ms.unsigned() as f64;
        let done = sequence.actions().iter().map(|action| {
            let action_type = &config.space.moves[action.kind];
            let values: Vec<f64> =
                action_type.ranges().zip(&action.places).map(|(range, place)| range.value_at(*place)).collect();
            let (lasts, numbers) = values.split_at(usize::from(action_type.lasts_ms.is_some()));
            Deed {
                of: action_type.name.as_str().to_owned(),
                from_ms: f64::from(action.begins) * tick,
                lasts_ms: lasts.first().copied().unwrap_or_default(),
                number: numbers.first().copied().unwrap_or_default(),
            }
        });
        Self { space: config.space.name.as_str().to_owned(), done: done.collect() }
    }

    /// True if the sequence is over one of these attack spaces.
    pub(super) fn in_any_space(&self, spaces: &[&str]) -> bool {
        spaces.contains(&self.space.as_str())
    }

    /// True if all that is done, and something is, are these of this attack space.
    pub(super) fn only(&self, space: &str, moves: &[&str]) -> bool {
        self.space == space && !self.done.is_empty() && self.done.iter().all(|d| moves.contains(&d.of.as_str()))
    }

    /// True if any of these is done, in whichever attack space.
    pub(super) fn any(&self, moves: &[&str]) -> bool {
        self.each(moves).next().is_some()
    }

    /// Deeds of these moves.
    pub(super) fn each(&self, moves: &[&str]) -> impl Iterator<Item = &Deed> {
        self.done.iter().filter(move |d| moves.contains(&d.of.as_str()))
    }
}
