//! Statements of an admitted teammate in bad faith, added up.

/// Statements of a teammate in bad faith, and their results at the gateway.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Claims {
    /// Reports that it sent.
    pub said: u64,
    /// Of these accepted.
    pub accepted: u64,
    /// Farthest from the truth, mm, that an accepted one was before anyone reacted.
    pub believed_mm: u32,
}
