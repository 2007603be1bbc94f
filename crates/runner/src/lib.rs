//! Runs many trials for a verb and keeps their records; reads recorded runs again.
//!
//! `context` is the context of every verb, `failure` its failures; `plan` makes variations of a scenario, `bring` loads a custom detector,
//! `search_config` configures a search; `engine` runs one trial in any of the three ways, `batch` many, with `retry`, `kept` and `lines` for
//! finished ones; `out` is the run directory. `runs` finds recorded runs, `verified` checks one to the last byte, and `checked` is the one
//! way to it, `recorded` to its events. Arguments and output of a verb are the verb's business.

pub mod batch;
pub mod bring;
pub mod checked;
mod context;
pub mod engine;
pub mod error;
pub mod failure;
pub mod kept;
pub mod lines;
pub mod out;
pub mod plan;
pub mod recorded;
pub mod retry;
pub mod runs;
pub mod search_config;
pub mod verified;

pub use context::{Context, own_line};
