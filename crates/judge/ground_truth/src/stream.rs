//! Terms of those who see only the bytes of a byte stream: the relay that alters it, and the ingress observer
//! of the end that it reaches. The meaning of the bytes is [`crate::StreamPlace`]'s.

use minicbor::{Decode, Encode};

/// Action of an adversary on one direction of a byte stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cbor(index_only)]
pub enum StreamEffect {
    /// Held bytes back for some time.
    #[n(0)]
    Held,
    /// Changed bytes.
    #[n(1)]
    Damaged,
    /// Ended the direction, the other stays.
    #[n(2)]
    HalfClosed,
    /// Ended the connection.
    #[n(3)]
    Reset,
}

/// Observation at the ingress of an end, of the stream that leads to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cbor(index_only)]
pub enum Sight {
    /// Bytes arrived.
    #[n(0)]
    Arrived,
    /// The far side ended the direction.
    #[n(1)]
    Closed,
    /// This end hung up first.
    #[n(2)]
    HungUp,
    /// The secure layer of this end refused the bytes received.
    #[n(3)]
    Refused,
    /// A whole message came out of the stream; length and hash are of its payload.
    #[n(4)]
    Delivered,
}
