//! The evidence of a trial: the types between those crates that run one, the oracle that judges it, and those that report it.
//!
//! `log` is the log as it is kept, with the two hashes of a trial; `anchors` are the keys, heads and clocks from elsewhere that `recording` verifies it
//! against. [`Evidence`] is the oracle's input, with the plan of the attack (`plan`), of the operator (`mission`) and of the way (`progress`); `fate`, `process_fault` and `claims`
//! are parts of its answer, and [`trial::Trial`] is the verdict as a row. `cue` has the triggers of attack steps, `delivery` the receipt of
//! insiders' messages, `truth` the injected faults and attacks in words, `diff` two logs side by side,
//! `ablation` the checks that a policy can waive. Judging is left to `oracle`, reading and
//! verifying a recorded run to `recording`.

pub mod ablation;
pub mod anchors;
pub mod claims;
pub mod cue;
pub mod delivery;
pub mod diff;
mod evidence;
mod fate;
pub mod log;
pub mod mission;
mod plan;
pub mod process_fault;
pub mod progress;
pub mod trial;
pub mod truth;
mod under;
mod witnessed;

pub use evidence::{Evidence, Flaw};
pub use fate::{Fate, FateName, Injection, InjectionRow, Mask};
pub use plan::{Needs, Plan, Planned, Takes};
pub use under::Under;
pub use witnessed::{Micros, Witnessed};

/// Version of every JSON object that this build prints.
pub const SCHEMA_VERSION: u32 = 1;
