//! Verdict of the record filter in front of a session.

use minicbor::{Decode, Encode};

/// Decision of the record filter in front of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cbor(index_only)]
pub enum GuardVerdict {
    /// Passed on to the secure layer.
    #[n(0)]
    Passed,
    /// A plaintext record on a standing association.
    #[n(1)]
    Plaintext,
    /// Not a record, or a malformed handshake.
    #[n(2)]
    Malformed,
    /// A datagram from a peer without an association, and not the beginning of one.
    #[n(3)]
    Stranger,
    /// A ClientHello whose handshake did not complete within its limit.
    #[n(4)]
    Unfinished,
    /// A sound ClientHello for which there was no room.
    #[n(5)]
    Shed,
}

impl GuardVerdict {
    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            GuardVerdict::Passed => "passed",
            GuardVerdict::Plaintext => "plaintext",
            GuardVerdict::Malformed => "malformed",
            GuardVerdict::Stranger => "stranger",
            GuardVerdict::Unfinished => "unfinished",
            GuardVerdict::Shed => "shed",
        }
    }
}
