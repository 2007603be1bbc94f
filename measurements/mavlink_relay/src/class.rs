//! Classes of a cell, and its verdict: the measured class beside the required one.

use serde::{Deserialize, Serialize};

/// Class that the published rules require.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum Required {
    /// Every message is handed to the application.
    Accepted,
    /// No message is.
    Refused,
    /// The rules require neither.
    Unstated,
}

/// Class that was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum Measured {
    /// Every message was handed to the application.
    Accepted,
    /// No message was.
    Refused,
    /// Some were.
    Mixed,
}

impl Measured {
    /// Share of `k` accepted messages of `n`; `None` of none.
    pub fn from_counts(k: u64, n: u64) -> Option<Self> {
        match (k, n) {
            (_, 0) => None,
            (0, _) => Some(Measured::Refused),
            (k, n) if k == n => Some(Measured::Accepted),
            _ => Some(Measured::Mixed),
        }
    }

    /// True if it is the class that the rules require, or they require none.
    fn keeps(self, required: Required) -> bool {
        match required {
            Required::Accepted => self == Measured::Accepted,
            Required::Refused => self == Measured::Refused,
            Required::Unstated => true,
        }
    }
}

/// Verdict of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub enum Verdict {
    /// Both classes are the required ones.
    AsPublished,
    /// The rules require nothing of one of them, and the other is the required one.
    Unstated,
    /// One of them differs from the published rules.
    Finding,
    /// A message did not provably arrive, or there were none: the cell says nothing.
    Invalid,
}

impl Verdict {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::AsPublished => "as published",
            Verdict::Unstated => "unstated",
            Verdict::Finding => "FINDING",
            Verdict::Invalid => "INVALID",
        }
    }
}

/// The verdict on (measured, required) pairs of the attacker's and of the true sender's messages.
pub fn judge(undelivered: u64, pairs: [(Option<Measured>, Required); 2]) -> Verdict {
    if undelivered > 0 || pairs.iter().any(|(measured, _)| measured.is_none()) {
        return Verdict::Invalid;
    }
    if !pairs.iter().all(|(measured, required)| measured.is_some_and(|m| m.keeps(*required))) {
        return Verdict::Finding;
    }
    match pairs.iter().any(|(_, required)| *required == Required::Unstated) {
        true => Verdict::Unstated,
        false => Verdict::AsPublished,
    }
}
