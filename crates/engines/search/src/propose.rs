//! Sources of the sequences of a search run: a strategy of this crate, or an optimizer outside it, which is asked for them a round at
//! a time and gets their results.
//!
//! Talking to a program is left to the caller; a sequence from outside is checked by [`AttackSequence::checked`].

use std::fmt;

use clap::ValueEnum;
use clap::builder::PossibleValue;
use serde::{Deserialize, Serialize};

use super::draw::{Drawer, Strategy};
use super::error::SearchError;
use super::learned::{Known, Lesson};
use super::moments::Moments;
use super::sequence::AttackSequence;
use super::tried::{Counted, Tried};

/// Prefix of a program's name, which could be that of a strategy.
const PROGRAM: &str = "optimizer:";

/// Source of the sequences, as a result names it: `guided`, or `optimizer:evolution.py`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub enum Source {
    /// A strategy of this crate.
    Strategy(Strategy),
    /// A program of the user's, by its file name.
    Program(String),
}

impl Source {
    /// True if it is uniform drawing, with which others are compared.
    pub fn is_uniform(&self) -> bool {
        *self == Source::Strategy(Strategy::Uniform)
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Source::Strategy(strategy) => {
                let value = strategy.to_possible_value();
                f.write_str(value.as_ref().map_or("", PossibleValue::get_name))
            }
            Source::Program(name) => write!(f, "{PROGRAM}{name}"),
        }
    }
}

impl From<Source> for String {
    fn from(source: Source) -> Self {
        source.to_string()
    }
}

impl TryFrom<String> for Source {
    type Error = String;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        match text.strip_prefix(PROGRAM) {
            Some(name) => Ok(Source::Program(name.to_owned())),
            None => Strategy::from_str(&text, false).map(Source::Strategy),
        }
    }
}

/// Result of a proposed sequence, for its proposer.
#[derive(Clone, Copy, Debug)]
pub struct Lore<'a> {
    /// The sequence and its trial.
    pub tried: &'a Tried,
    /// The trial as the result of the search counts it.
    pub counted: &'a Counted,
    /// True if it showed a situation that no earlier one did.
    pub new: bool,
}

/// An optimizer: proposes sequences and learns from their results.
pub trait Proposer {
    /// The sequences of a round: at least one, at most `most`.
    ///
    /// # Errors
    /// The reason why it cannot go on, in words.
    fn propose(&mut self, most: usize) -> Result<Vec<AttackSequence>, SearchError>;

    /// Takes the result of the first sequence that was proposed and has none yet.
    fn take(&mut self, result: Lore<'_>);
}

impl Proposer for Drawer<'_> {
    fn propose(&mut self, most: usize) -> Result<Vec<AttackSequence>, SearchError> {
        Ok((0..most).map(|_| self.sequence()).collect())
    }

    fn take(&mut self, Lore { tried, counted, new }: Lore<'_>) {
        let moments = Moments::from_run(tried, self.space(), self.bounds());
        let known = Known { sequence: tried.sequence.clone(), moments };
        self.learn(Lesson { known, new, approaches: counted.approaches.clone() });
    }
}
