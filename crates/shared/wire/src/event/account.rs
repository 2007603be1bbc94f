//! Terms of the closing accounts: the interfaces at which records are judged, and the quantities that each node counts.
//!
//! Adding them up is left to the oracle.

use minicbor::{Decode, Encode};

use crate::core::{Side, Topic};
use crate::refusal::Reason;

/// Interface at which a record was judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Interface {
    /// Session records from a unit, at the gateway.
    #[n(0)]
    Uplink,
    /// Session records from the gateway, at a unit.
    #[n(1)]
    Downlink,
    /// Commands at a unit.
    #[n(2)]
    Commands,
    /// Acknowledgements at the gateway or console.
    #[n(3)]
    Acks,
    /// A shared-memory channel.
    #[n(4)]
    Bus(#[n(0)] Topic),
    /// Requests of the console, at the gateway.
    #[n(5)]
    Requests,
    /// Connections, publications and subscriptions at the command broker.
    #[n(6)]
    Broker,
}

/// A quantity in a service's closing account.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Account {
    /// Session records sent.
    #[n(0)]
    Sent,
    /// Records delivered to this interface.
    #[n(1)]
    Received(#[n(0)] Interface),
    /// Records accepted at it.
    #[n(2)]
    Accepted(#[n(0)] Interface),
    /// Records refused at it, by reason.
    #[n(3)]
    Refused(#[n(0)] Interface, #[n(1)] Reason),
    /// Datagrams that came to a relay from a side.
    #[n(4)]
    RelayIn(#[n(0)] Side),
    /// Datagrams that a relay emitted towards a side.
    #[n(5)]
    RelayOut(#[n(0)] Side),
    /// Datagrams from a side that a relay dropped.
    #[n(6)]
    RelayDropped(#[n(0)] Side),
    /// Copies that a relay added towards a side.
    #[n(7)]
    RelayAdded(#[n(0)] Side),
    /// Datagrams at the guard in front of a session, before it judged.
    #[n(8)]
    GuardIn,
    /// Datagrams or records that the guard refused.
    #[n(9)]
    GuardRefused,
    /// Application records that came out of the session.
    #[n(10)]
    Delivered,
    /// Datagrams that the secure layer discarded (counted where the model can see it, else derived).
    #[n(11)]
    Discarded,
    /// Handshake datagrams consumed by the secure layer.
    #[n(12)]
    Handshake,
    /// Datagrams that the kernel dropped at the node's socket.
    #[n(13)]
    KernelDropped,
    /// Datagrams that a relay sent towards the server from its own source address; not in `RelayOut`.
    #[n(14)]
    RelayStranger,
    /// Records that a relay emitted towards a side, unknown peers' included, and its socket did not take.
    #[n(15)]
    RelayUnsent(#[n(0)] Side),
    /// Datagrams that a node sent to the gateway with no relay in between.
    #[n(16)]
    SentDirect,
    /// Whole datagrams at the guard in front of a session; `GuardIn` counts the records in them.
    #[n(17)]
    Datagrams,
    /// Datagrams out of a socket that no guard judged: no room, nobody's, or their association was over.
    #[n(18)]
    Unguarded,
    /// Datagrams that no process of the run sent. In no other account.
    #[n(19)]
    Outsiders,
}
