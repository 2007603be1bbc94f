//! The shared part of all verbs: running many trials, keeping their results, and reading recorded runs.
//!
//! `start` begins a program of verbs, and `interrupt` watches for Ctrl-C. `context` has the options of every verb and chooses the root;
//! `shipped` unpacks the files that a program brings. `failure` has exit codes and messages. `plan` makes variations of a scenario,
//! `custom_detector` loads a detector from a file, `guest_options` a guest. `search_config` prepares a search, `optimizer` runs a program
//! that proposes its sequences. `engine` runs one trial in any mode, `batch` many, and `retry` repeats those that the host spoilt. `out`
//! writes the run directory; `protected` keeps reports out of recordings and results. `trial_store`, `unfinished` and `lines` (each line with
//! a digest: `chain`) resume an interrupted command, `parts` and `numbered` share one among machines. `checked` opens recorded runs for a
//! command, and `claims` compares each with the results around it. `recorded` gives a run in the twin the form of a recorded one.
//! `leaderboard` makes rows of guests. `closing` ends a command with a summary and with commands to go on with.

pub mod batch;
mod chain;
pub mod checked;
pub mod claims;
pub mod closing;
mod context;
pub mod custom_detector;
pub mod ended;
pub mod engine;
pub mod error;
pub mod failure;
pub mod guest_options;
mod interrupt;
pub mod leaderboard;
pub mod lines;
pub mod numbered;
pub mod optimizer;
pub mod out;
pub mod parts;
pub mod plan;
pub mod probe;
pub mod protected;
pub mod recorded;
pub mod retry;
pub mod search_config;
pub mod shipped;
pub mod start;
pub mod trial_store;
mod unfinished;

pub use context::{Context, Root, own_arguments, own_line, quoted};
