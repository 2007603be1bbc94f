//! Every reason to refuse, each with the expected and the received value.

use minicbor::{Decode, Encode};
use strum::{EnumCount, IntoStaticStr, VariantArray};

use crate::codec::Malformed;
use crate::id::{Boot, CommandId, NodeId, Nonce, PeerId, Sequence, TrackId, UnitId};
use crate::mode::Mode;
use crate::sensor::ProductMode;
use crate::time::Span;

/// A refusal, as one check decided it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// Longer than the channel carries.
    #[error("length: at most {max} bytes expected, got {got}")]
    Length {
        /// Largest length, bytes.
        max: usize,
        /// Received length, bytes.
        got: usize,
    },
    /// Not the message type that belongs here, or out of range.
    #[error("schema: unreadable at byte {at}")]
    Schema {
        /// Offset of the first unreadable byte.
        at: usize,
    },
    /// On a channel that is none of this service's.
    #[error("schema: a channel of this service's expected, got another")]
    Channel,
    /// Not the canonical encoding.
    #[error("canonical: other than the canonical encoding at byte {at}")]
    Canonical {
        /// Offset of the first byte that differs.
        at: usize,
    },
    /// Another version of the session layer.
    #[error("version: {expected} expected, got {got}")]
    Version {
        /// Version of the receiver.
        expected: u8,
        /// Version in the record.
        got: u8,
    },
    /// The age of the record may be above the limit.
    #[error("stale: at most {limit} expected, may be {age}")]
    Stale {
        /// Largest age.
        limit: Span,
        /// Upper bound of the age.
        age: Span,
    },
    /// No valid echo within the limit: no age can be bounded.
    #[error("no echo: a valid echo within {limit} expected, got none")]
    NoEcho {
        /// Longest time that an echo serves.
        limit: Span,
    },
    /// The session's peer is not the record's origin.
    #[error("origin: session of {peer} expected to carry its own records, got one of {origin}")]
    Origin {
        /// Peer that the session authenticated.
        peer: PeerId,
        /// Claimed origin of the record.
        origin: NodeId,
    },
    /// The signature does not verify with the key of the one who should have signed.
    #[error("signature: one of {signer} expected, got another")]
    Signature {
        /// Node that owns the tried key.
        signer: NodeId,
    },
    /// No key is known for the one who should have signed.
    #[error("signer: a known signer expected, got {got}")]
    Signer {
        /// Claimed sender.
        got: NodeId,
    },
    /// Another session's nonce.
    #[error("session: nonce {expected:?} expected, got {got:?}")]
    Session {
        /// Nonce that the receiver announced.
        expected: Nonce,
        /// Nonce in the record.
        got: Nonce,
    },
    /// Not of an established session.
    #[error("session: one that stands expected, got none")]
    NoSession,
    /// Number from before the sender's newest boot.
    #[error("epoch: boot {expected:?} or later expected, got {got:?}")]
    Epoch {
        /// Newest boot seen.
        expected: Boot,
        /// The boot in the record.
        got: Boot,
    },
    /// Seen before, or too old for the window.
    #[error("sequence: above {highest:?} or unseen in the window expected, got {got:?}")]
    Replayed {
        /// Highest accepted sequence.
        highest: Sequence,
        /// The number in the record.
        got: Sequence,
    },
    /// Further ahead than a sender can run.
    #[error("jump: at most {limit} ahead of {highest:?} expected, got {got:?}")]
    Jump {
        /// Largest step.
        limit: u64,
        /// Highest accepted sequence.
        highest: Sequence,
        /// The number in the record.
        got: Sequence,
    },
    /// The tag does not verify under the channel's key.
    #[error("tag: one under the key of {expected} expected, got another")]
    Tag {
        /// Node that the channel belongs to.
        expected: NodeId,
    },
    /// A live product expected, something else came.
    #[error("product: live expected, got {got:?}")]
    Product {
        /// Mode of the received product.
        got: ProductMode,
    },
    /// Not addressed to this unit.
    #[error("unit: {expected} expected, got {got}")]
    Unit {
        /// The receiving unit.
        expected: UnitId,
        /// Unit that the intent names.
        got: UnitId,
    },
    /// Not addressed to a unit of this gateway's.
    #[error("unit: one of this gateway's expected, got {got}")]
    NoUnit {
        /// Unit that the intent names.
        got: UnitId,
    },
    /// The peer or signer may not do this.
    #[error("role: one that may do this expected, got {got}")]
    Role {
        /// Identity that asked.
        got: NodeId,
    },
    /// The peer may not have a session, or not say this in one.
    #[error("role: one that may do this expected, got {got}")]
    Peer {
        /// Peer that the session authenticated.
        got: PeerId,
    },
    /// The intent repeats no nonce that is still answerable: the intent is too old, or was for another unit.
    #[error("late: a nonce issued within {limit} expected, got {got:?}")]
    Late {
        /// Largest age of the nonce.
        limit: Span,
        /// The nonce in the intent.
        got: Nonce,
    },
    /// A command of the same operator after it was already seen.
    #[error("duplicate: a command after {last:?} expected, got {got:?}")]
    Duplicate {
        /// Newest command seen.
        last: CommandId,
        /// The id in the intent.
        got: CommandId,
    },
    /// A command away from safe without its second signed step.
    #[error("confirmation: one for {expected:?} expected, got none or another's")]
    Confirmation {
        /// Command that the confirmation has to name.
        expected: CommandId,
    },
    /// A command away from safe without a reason.
    #[error("reason: one expected, got none")]
    NoReason,
    /// The machine's mode or a guard does not allow it.
    #[error("interlock: not in {mode:?} with its present guards")]
    Interlock {
        /// Mode of the unit.
        mode: Mode,
    },
    /// A table is full.
    #[error("room: at most {limit} expected")]
    Full {
        /// Places in the table.
        limit: usize,
    },
    /// The very same command, by the hash of its signed bytes, was already seen.
    #[error("duplicate: none of the last {kept} expected, got {got:?} again")]
    Repeated {
        /// Number of commands remembered.
        kept: usize,
        /// The id in the intent.
        got: CommandId,
    },
    /// Further ahead than an operator can have come.
    #[error("jump: at most {furthest:?} of its boot expected, got {got:?}")]
    Ahead {
        /// The furthest that is taken up.
        furthest: Sequence,
        /// The id in the intent.
        got: CommandId,
    },
    /// A boot further ahead than an operator's console can have come.
    #[error("jump: at most {furthest:?} expected, got {got:?}")]
    AheadBoot {
        /// The furthest that is taken up.
        furthest: Boot,
        /// The id in the intent.
        got: CommandId,
    },
    /// More of them in a short time than there can be need for.
    #[error("rate: at most {burst} at once and {per_s} a second of {got} expected, got more")]
    Rate {
        /// Commands at once.
        burst: u32,
        /// Limit in a second.
        per_s: u32,
        /// Sender of the commands.
        got: NodeId,
    },
    /// More verifications failed than there can be need for, for any claimed sender.
    #[error("rate: at most {burst} at once and {per_s} a second that do not verify expected, got more")]
    Unproven {
        /// Failed verifications at once.
        burst: u32,
        /// Limit in a second.
        per_s: u32,
    },
    /// The authority of the run has revoked the peer or signer.
    #[error("revoked: one that stands expected, got {got}")]
    Revoked {
        /// Revoked peer or signer.
        got: NodeId,
    },
    /// The time for which the peer or signer was admitted is over.
    #[error("expired: one that is still admitted expected, got {got}, over for {over}")]
    Expired {
        /// Expired peer or signer.
        got: NodeId,
        /// Time since the end of admission.
        over: Span,
    },
    /// Each value is legal, and together they are not safe.
    #[error("joint: {what} of at least {least} expected, got {got}")]
    Joint {
        /// Name of the value that is too small for the others.
        what: &'static str,
        /// Least value that is safe with the others.
        least: u32,
        /// Value asked for.
        got: u32,
    },
    /// A time tag on a command that cannot wait.
    #[error("time tag: none expected on {kind}, got one")]
    Untimed {
        /// Name of the command's kind.
        kind: &'static str,
    },
    /// A time tag too far ahead.
    #[error("time tag: at most {limit} ahead expected, got {got}")]
    AheadTag {
        /// Furthest that a time tag may lie ahead.
        limit: Span,
        /// Time from the nonce's issue to the end of the window.
        got: Span,
    },
    /// Stored, and the mode has changed since, a HOLD has come or the session at the broker is lost.
    #[error("interlock: void, since the unit is not as it was when the order was stored")]
    Voided,
    /// The order names none of the unit's newest reports, or one without the track: its operator was shown something
    /// else.
    #[error("shown: one of the last {kept} reports, with {track:?} in it, expected, got another or none")]
    Shown {
        /// Number of reports remembered.
        kept: usize,
        /// The order's track.
        track: TrackId,
    },
    /// The track is no longer where the operator was shown it.
    #[error("shown: {track:?} within {limit_mm} mm of its place on the display expected, got {got_mm} mm")]
    Moved {
        /// The order's track.
        track: TrackId,
        /// Largest distance, millimetres.
        limit_mm: u32,
        /// Distance from the displayed place, millimetres.
        got_mm: u32,
    },
    /// The window of a time tag is over.
    #[error("late: a window that is open expected, over for {over}")]
    Missed {
        /// Time since the end of the window.
        over: Span,
    },
}

/// [`Refusal`] without its particulars: the form that is counted, acknowledged and documented.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize, serde::Deserialize,
)]
#[cbor(index_only)]
#[serde(rename_all = "snake_case")]
#[expect(missing_docs, reason = "each variant is documented at the Refusal of the same name")]
#[derive(EnumCount, VariantArray, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Reason {
    #[n(0)]
    Length,
    #[n(1)]
    Schema,
    #[n(2)]
    Canonical,
    #[n(3)]
    Version,
    #[n(4)]
    Stale,
    #[n(5)]
    NoEcho,
    #[n(6)]
    Origin,
    #[n(7)]
    Signature,
    #[n(8)]
    Signer,
    #[n(9)]
    Session,
    #[n(10)]
    Epoch,
    #[n(11)]
    Replayed,
    #[n(12)]
    Jump,
    #[n(13)]
    Tag,
    #[n(14)]
    Product,
    #[n(15)]
    Unit,
    #[n(16)]
    Role,
    #[n(17)]
    Late,
    #[n(18)]
    Duplicate,
    #[n(19)]
    Confirmation,
    #[n(20)]
    NoReason,
    #[n(21)]
    Interlock,
    #[n(22)]
    Full,
    #[n(27)]
    Rate,
    #[n(28)]
    Revoked,
    #[n(29)]
    Expired,
    #[n(30)]
    Joint,
    #[n(31)]
    TimeTag,
    #[n(32)]
    Shown,
    /// A certificate that proves no known peer, or no longer does; decided by a link before there is a session.
    #[n(41)]
    Certificate,
    /// A handshake in another version or suite, or one that does not fit together; decided by a link.
    #[n(42)]
    Handshake,
}

impl Reason {
    /// Every reason, in wire order.
    pub const ALL: [Reason; Reason::COUNT] = *Reason::VARIANTS.first_chunk().expect("as many variants as it counts");

    /// Name in logs, tables and documents.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

impl Refusal {
    /// The reason without its particulars.
    pub fn reason(&self) -> Reason {
        match self {
            Refusal::Length { .. } => Reason::Length,
            Refusal::Schema { .. } | Refusal::Channel => Reason::Schema,
            Refusal::Canonical { .. } => Reason::Canonical,
            Refusal::Version { .. } => Reason::Version,
            Refusal::Stale { .. } => Reason::Stale,
            Refusal::NoEcho { .. } => Reason::NoEcho,
            Refusal::Origin { .. } => Reason::Origin,
            Refusal::Signature { .. } => Reason::Signature,
            Refusal::Signer { .. } => Reason::Signer,
            Refusal::Session { .. } | Refusal::NoSession => Reason::Session,
            Refusal::Epoch { .. } => Reason::Epoch,
            Refusal::Replayed { .. } => Reason::Replayed,
            Refusal::Jump { .. } => Reason::Jump,
            Refusal::Tag { .. } => Reason::Tag,
            Refusal::Product { .. } => Reason::Product,
            Refusal::Unit { .. } | Refusal::NoUnit { .. } => Reason::Unit,
            Refusal::Role { .. } | Refusal::Peer { .. } => Reason::Role,
            Refusal::Late { .. } | Refusal::Missed { .. } => Reason::Late,
            Refusal::Duplicate { .. } | Refusal::Repeated { .. } => Reason::Duplicate,
            Refusal::Confirmation { .. } => Reason::Confirmation,
            Refusal::NoReason => Reason::NoReason,
            Refusal::Interlock { .. } | Refusal::Voided => Reason::Interlock,
            Refusal::Full { .. } => Reason::Full,
            Refusal::Ahead { .. } | Refusal::AheadBoot { .. } => Reason::Jump,
            Refusal::Rate { .. } | Refusal::Unproven { .. } => Reason::Rate,
            Refusal::Revoked { .. } => Reason::Revoked,
            Refusal::Expired { .. } => Reason::Expired,
            Refusal::Joint { .. } => Reason::Joint,
            Refusal::Untimed { .. } | Refusal::AheadTag { .. } => Reason::TimeTag,
            Refusal::Shown { .. } | Refusal::Moved { .. } => Reason::Shown,
        }
    }
}

impl From<Malformed> for Refusal {
    fn from(malformed: Malformed) -> Self {
        match malformed {
            Malformed::TooLong { max, got } => Refusal::Length { max, got },
            Malformed::Schema { at } => Refusal::Schema { at },
            Malformed::NonCanonical { at } => Refusal::Canonical { at },
        }
    }
}
