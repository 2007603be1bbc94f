//! The shared part of all verbs: running many trials, keeping their results, and reading recorded runs.
//!
//! `context` has the options of every verb and chooses the root, `shipped` unpacks the files that a program brings. `failure` has exit
//! codes and messages. `plan` makes variations of a scenario, `bring` loads a custom detector, `search_config` prepares a search,
//! `optimizer` runs a program that proposes its sequences. `engine` runs one trial in any mode, `batch` many, with `retry`, `kept`,
//! `recording` and `lines` (each with a digest: `chain`) for resuming, `parts` and `numbered` for several machines; `out` writes the run directory, `spares` keeps reports out of it. `runs` finds
//! recorded runs, `verified` checks one to the last byte, `claimed` holds a result against it, `checked` is the one way to its content, `recorded` to its events. `start`
//! begins a program of verbs, `interrupt` watches for Ctrl-C.

pub mod batch;
pub mod bring;
mod chain;
pub mod checked;
mod claimed;
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
mod recording;
pub mod retry;
pub mod runs;
pub mod search_config;
pub mod shipped;
pub mod spares;
pub mod start;
pub mod verified;

pub use context::{Context, Root, own_line, quoted};
