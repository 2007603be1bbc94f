//! Runs many trials for a verb and keeps what they leave; reads recorded runs again.
//!
//! `context` is what every verb works with, `failure` how one ends that does not end well; `plan` makes variations of a scenario, `bring` loads a
//! detector from outside, `ground` what a search works on; `engine` runs one trial in any of the three ways, `batch` many, with `retry`, `kept`
//! and `lines` for what is finished already; `out` is the run directory. `start` begins a program of verbs, `interrupt` watches for Ctrl-C. `runs` finds recorded runs, `verified` checks one to the last byte, and
//! `checked` is the one way to it, `recorded` to its events. Arguments of a verb and what it prints are the verb's business.

pub mod batch;
pub mod bring;
pub mod checked;
mod context;
pub mod engine;
pub mod error;
pub mod failure;
pub mod ground;
mod interrupt;
pub mod kept;
pub mod lines;
pub mod out;
pub mod plan;
pub mod recorded;
pub mod retry;
pub mod runs;
pub mod start;
pub mod verified;

pub use context::{Context, own_line};
