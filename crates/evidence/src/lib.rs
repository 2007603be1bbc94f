//! The evidence of a trial and its verdict: everything that crosses from those who run a trial to those who judge it and tell of it.
//!
//! `log` is the log as it is kept, with the two hashes of a trial; `verification` sets it against the trust anchors
//! held elsewhere; `reading` gives the events in order; [`Evidence`] is all of it, with the plan (`plan`, `mission`).
//! The oracle answers with a [`Verdict`] (`fate`, `process_fault`, `claims`, `mission` are its parts), of which
//! [`trial::Trial`] is the row in results. `cue` has the events that actors wait for, `sights` the cores' sights of
//! insiders, `truth` the actions as they were, `passed` the messages between services, `diff` two logs side by side,
//! `ablation` the checks that a policy can waive. No module here judges.

pub mod ablation;
pub mod claims;
pub mod cue;
pub mod diff;
mod evidence;
mod fate;
pub mod log;
pub mod mission;
pub mod passed;
mod plan;
pub mod process_fault;
pub mod reading;
pub mod sights;
pub mod trial;
pub mod truth;
mod verdict;
pub mod verification;
mod witnessed;

pub use evidence::Evidence;
pub use fate::{Fate, FateName, Injection, InjectionRow, Mask};
pub use plan::{Needs, Plan, Planned, Takes};
pub use verdict::{Finding, Property, Verdict};
pub use witnessed::{Micros, Witnessed};

/// Version of every JSON object that this build prints.
pub const SCHEMA_VERSION: u32 = 1;
