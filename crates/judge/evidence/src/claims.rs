//! Statements of an admitted teammate in bad faith, added up.

/// Statements of a teammate in bad faith, and their results at the gateway.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Claims {
    /// Reports that it sent.
    pub said: u64,
    /// Reports among these that were accepted.
    pub accepted: u64,
    /// Largest distance from the truth, mm, of a report that was accepted before any reaction.
    pub believed_mm: u32,
}
