//! A search for attacks beyond the written scenarios: sequences from a space of attacks, tried on a scenario until a property
//! breaks; and each finding as the smallest sequence that shows it.
//!
//! Terms: a *move* is an action type of an [`scenario::AttackSpace`]; an *action* is one of these, with its moment and its
//! numbers; a *sequence* is an attack sequence, all actions of one trial. A *cause* is the class of a trial with the first property it
//! broke. `sequence` is the sequence and the scenario that it makes, `tried` one trial of it, `coverage` the situations it showed,
//! `moments` the times that may matter, `learned` the state of a search run, `draw` the strategies, `climb` the approach to one limit
//! at a time, `vary` variations of sequences, `propose` their sources, `run` the loop, `exhaust` every sequence up to a length, `shrink`
//! the smallest, `robust` one away from its edge, `sample` sequences drawn at random for comparison with live runs. The list of properties, their
//! verdicts and approaches are `oracle`'s.

mod climb;
mod coverage;
mod draw;
mod error;
mod exhaust;
mod learned;
mod moments;
mod propose;
pub mod rare;
mod robust;
mod run;
mod sample;
mod sequence;
mod shrink;
mod tried;
mod vary;

pub use coverage::Coverage;
pub use draw::Strategy;
pub use error::SearchError;
pub use moments::Moments;
pub use propose::{Lore, Proposer, Source};
pub use run::{FoundSequence, NearestRow, ROUND, RunConfig, RunResult, SearchRow};
pub use sample::{Drawn, Stratum};
pub use sequence::{Action, AttackSequence, Unfit};
pub use shrink::{Margin, Shrunk};
pub use tried::{Cause, Counted, SearchConfig, Test, Tried, ends_in};
