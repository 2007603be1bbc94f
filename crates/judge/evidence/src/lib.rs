//! The evidence of a trial: the types between those crates that run one, the oracle that judges it, and those that report it.
//!
//! `log` is the log as it is kept, with the two hashes of a trial; `verification` verifies it against keys and heads from elsewhere; `reading` gives the
//! events in order. [`Evidence`] is the oracle's input, with the plan of the attack (`plan`), of the operator (`mission`) and of the way (`progress`); `fate`, `process_fault` and `claims`
//! are parts of its answer, and [`trial::Trial`] is the verdict as a row. `cue` has the triggers of attack steps, `delivery` the receipt of
//! insiders' messages, `truth` the injected faults and attacks in words, `messages` the messages between services, `diff` two logs side by side,
//! `ablation` the checks that a policy can waive. Nothing here judges.

pub mod ablation;
pub mod claims;
pub mod cue;
pub mod delivery;
pub mod diff;
mod evidence;
mod fate;
pub mod log;
pub mod messages;
pub mod mission;
mod plan;
pub mod process_fault;
pub mod progress;
pub mod reading;
pub mod trial;
pub mod truth;
mod under;
pub mod verification;
mod witnessed;

pub use evidence::Evidence;
pub use fate::{Fate, FateName, Injection, InjectionRow, Mask};
pub use plan::{Needs, Plan, Planned, Takes};
pub use under::Under;
pub use witnessed::{Micros, Witnessed};

/// Version of every JSON object that this build prints.
pub const SCHEMA_VERSION: u32 = 1;
