//! Summary of one run for a reviewer: the attacks, the services' reports and actions, and the reasons for each change
//! of mode.
//!
//! It is made from the recording; times are seconds from the start of the run.

use serde::{Deserialize, Serialize};

/// A run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunSummary {
    /// Its name: a scenario or a folder.
    pub name: String,
    /// Length, seconds.
    pub seconds: f64,
    /// Reason for which it is INVALID, or the fault of its log; `None` if it is sound.
    pub flaw: Option<String>,
    /// Modes of the unit under test, one after the other.
    pub modes: Vec<Lasted>,
    /// Periods of authority.
    pub authority: Vec<Lasted>,
    /// Injections, as reported by their actors: ground truth, unknown to the services.
    pub done: Vec<Lasted>,
    /// Refusals at boundaries, by reason.
    pub refused: Vec<Refusals>,
    /// Reason for each loss of the mode.
    pub why: Vec<Why>,
}

/// Something that lasted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lasted {
    /// Description.
    pub what: String,
    /// From, seconds.
    pub from: f64,
    /// To, seconds.
    pub to: f64,
}

/// Refusals of one boundary for one reason.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Refusals {
    /// The refusing service.
    pub by: String,
    /// Reason, by its name.
    pub reason: String,
    /// Count.
    pub n: u64,
    /// Times, seconds; those within a tenth of a second are one.
    pub at: Vec<Lasted>,
}

/// Reason for the loss of a mode.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Why {
    /// Time, seconds.
    pub at: f64,
    /// From and to.
    pub change: String,
    /// The cause by its name.
    pub cause: String,
    /// From the cause to the display.
    pub chain: Vec<Link>,
}

/// A link of the chain.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Link {
    /// Which kind of link.
    pub stage: String,
    /// Time, seconds.
    pub at: f64,
    /// Source of the log entry.
    pub by: String,
    /// Description.
    pub what: String,
}

/// A recording behind results or runs over time, and its verification.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Recording {
    /// Its folder.
    pub name: String,
    /// SHA-256 of its files, one behind the other.
    pub sha256: String,
    /// True if its chains, signatures, seals and heads hold.
    pub holds: bool,
    /// The class in which its trial ended, where that is told.
    pub outcome: Option<String>,
    /// Reason for which it is INVALID, by its verification or by the class of its trial; `None` if it is valid.
    pub invalid: Option<String>,
}
