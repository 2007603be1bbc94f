//! The shared part of all verbs: running many trials, keeping their results, and reading recorded runs.
//!
//! `context` has the options of every verb and chooses the root, `shipped` unpacks the files that a program brings. `failure` has exit
//! codes and messages. `plan` makes variations of a scenario, `bring` loads a custom detector, `search_config` prepares a search,
//! `optimizer` runs a program that proposes its sequences. `engine` runs one trial in any mode, `batch` many, with `retry`, `kept`,
//! `unfinished` and `lines` (each with a digest: `chain`) for resuming, `parts` and `numbered` for several machines; `out` writes the run directory, `spares` keeps reports out of it. `checked`
//! opens recorded runs for a command, `claimed` holds the results around against one, `recorded` has the log of a run in the twin beside theirs. `start`
//! begins a program of verbs, `interrupt` watches for Ctrl-C.

pub mod batch;
pub mod bring;
mod chain;
pub mod checked;
pub mod claimed;
mod context;
pub mod engage;
pub mod engine;
pub mod error;
pub mod failure;
mod interrupt;
pub mod kept;
pub mod lines;
pub mod numbered;
pub mod optimizer;
pub mod out;
pub mod parts;
pub mod plan;
pub mod probe;
pub mod recorded;
pub mod retry;
pub mod search_config;
pub mod shipped;
pub mod spares;
pub mod start;
mod unfinished;

pub use context::{Context, Root, own_line, quoted};
