//! One run as it is told to a reviewer: what was done to it, what its services said and did, and why the mode changed.
//!
//! Whoever has the recording makes it; times are seconds from the start of the run.

use serde::{Deserialize, Serialize};

/// A run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Story {
    /// Its name: a scenario or a folder.
    pub name: String,
    /// How long it was, seconds.
    pub seconds: f64,
    /// Why it is INVALID, or what does not hold of its log; nothing when all does.
    pub flaw: Option<String>,
    /// Modes of the unit under test, one after the other.
    pub modes: Vec<Lasted>,
    /// When it had authority.
    pub authority: Vec<Lasted>,
    /// What was done to it, by those who did it: ground truth, which no service knew.
    pub done: Vec<Lasted>,
    /// What boundaries refused, by reason.
    pub refused: Vec<Refusals>,
    /// Why the mode was lost, each time.
    pub why: Vec<Why>,
}

/// Something that lasted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lasted {
    /// What.
    pub what: String,
    /// From, seconds.
    pub from: f64,
    /// To, seconds.
    pub to: f64,
}

/// Refusals of one boundary for one reason.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Refusals {
    /// Who refused.
    pub by: String,
    /// Why, as the refusal is named.
    pub reason: String,
    /// How many.
    pub n: u64,
    /// When, seconds; those that came within a tenth of a second are one.
    pub at: Vec<Lasted>,
}

/// Why a mode was lost.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Why {
    /// When, seconds.
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
    /// When, seconds.
    pub at: f64,
    /// By whose log.
    pub by: String,
    /// What.
    pub what: String,
}

/// A recording that results or runs over time are from, and what was found of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Recording {
    /// Its folder.
    pub name: String,
    /// SHA-256 of its files, one behind the other.
    pub sha256: String,
    /// Whether its chains, signatures, seals and heads hold.
    pub holds: bool,
    /// The class in which its trial ended, where that is told.
    pub outcome: Option<String>,
    /// Why it is INVALID, by its custody or by the class of its trial; nothing where it is not.
    pub invalid: Option<String>,
}
