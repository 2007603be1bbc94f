//! Messages of the gateway to the console. On arrival they are untrusted again: the console checks tag, schema and
//! signature.

use minicbor::bytes::ByteSlice;
use minicbor::{Decode, Encode};

use crate::command::IntentHash;
use crate::id::{PeerId, UnitId};
use crate::policy::Waived;
use crate::refusal::Reason;
use crate::time::{Instant, Span};

/// A message of the feed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub enum Feed<'b> {
    /// A report passed the boundary.
    #[n(0)]
    Accepted(#[b(0)] AcceptedReport<'b>),
    /// Refusals: the reason, the peer, and the number of both together so far in this boot. Not every refusal is
    /// reported; the difference of two numbers is the number of refusals between them.
    #[n(1)]
    Refused(#[n(0)] Reason, #[n(1)] Option<PeerId>, #[n(2)] u64),
    /// A session opened (true) or ended (false).
    #[n(2)]
    Session(#[n(0)] PeerId, #[n(1)] bool),
    /// Progress at the gateway of the command with this signed intent, and the reason where the gateway refused the
    /// command.
    #[n(3)]
    Command(#[cbor(n(0), with = "minicbor::bytes")] IntentHash, #[n(1)] CommandStage, #[n(2)] Option<Reason>),
    /// The unit's signed acknowledgement, as it came.
    #[n(4)]
    Acknowledged(#[b(0)] &'b ByteSlice),
    /// Number of times in this boot that the gateway's session at the broker was cut or taken.
    #[n(5)]
    SessionsLost(#[n(0)] u32),
    /// A crop as it came in the session of this unit; only the unit's signed report can vouch for it.
    #[n(6)]
    Crop(#[n(0)] UnitId, #[b(1)] &'b ByteSlice),
}

/// A report that passed the boundary, for display.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct AcceptedReport<'b> {
    /// Session peer that brought the report.
    #[n(0)]
    pub via: PeerId,
    /// The unit that the boundary attributes the report to.
    #[n(1)]
    pub unit: UnitId,
    /// Time at which the gateway received it, on the control host's clock.
    #[n(2)]
    pub received: Instant,
    /// Upper bound of its age at `received`; absent when freshness was waived and unknown.
    #[n(3)]
    pub age: Option<Span>,
    /// Checks that the report passed by waiver.
    #[n(4)]
    pub waived: Waived,
    /// The signed report.
    #[b(5)]
    pub report: &'b ByteSlice,
}

/// Progress of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cbor(index_only)]
pub enum CommandStage {
    /// Held at the gateway until its confirmation comes.
    #[n(0)]
    Staged,
    /// Published to the unit.
    #[n(1)]
    Sent,
    /// Refused by the gateway.
    #[n(2)]
    Refused,
    /// Staged too long without a confirmation.
    #[n(3)]
    Expired,
}
