//! What an admitted teammate said in bad faith, added up.

/// What a teammate said in bad faith, and what came of it at the gateway.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Claims {
    /// Reports that it sent.
    pub said: u64,
    /// Of these accepted.
    pub accepted: u64,
    /// Farthest from the truth, mm, that an accepted one was before anyone reacted.
    pub believed_mm: u32,
}
