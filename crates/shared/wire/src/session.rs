//! Session layer of the telemetry link: records that two session peers exchange.
//!
//! Every record asks and answers: it carries the sender's challenge, echoes the receiver's, and names the receiver's
//! session nonce. A payload carried for others (a report) is opaque here and keeps its own origin.

use minicbor::bytes::ByteSlice;
use minicbor::{Decode, Encode};

use crate::id::{Boot, Nonce, PeerId, Sequence};
use crate::time::{Echo, PeerStamp, Span};

/// Version of this layer; another one is refused.
pub const SESSION_VERSION: u8 = 1;

/// Longest record in bytes; DTLS application records are never fragmented.
pub const MAX_SESSION_MESSAGE: usize = 1200;

/// Most teammates whose reports one unit gets: the gateway tells it of no more, and its memory has no more room.
pub const MAX_TEAMMATES: usize = 3;

/// A record of a secure session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct SessionMessage<'b> {
    /// Version of the session layer, [`SESSION_VERSION`].
    #[n(0)]
    pub version: u8,
    /// The session nonce that the receiver announced; zero until its Hello has come.
    #[n(1)]
    pub session: Nonce,
    /// The sender's boot.
    #[n(2)]
    pub boot: Boot,
    /// The sender's sequence within the session, from 1.
    #[n(3)]
    pub sequence: Sequence,
    /// The sender's clock.
    #[n(4)]
    pub stamp: PeerStamp,
    /// A nonce that the receiver is to echo.
    #[n(5)]
    pub challenge: Nonce,
    /// The receiver's newest challenge and when it was first seen.
    #[n(6)]
    pub echo: Option<Echo>,
    /// Content of the record.
    #[b(7)]
    pub body: SessionBody<'b>,
}

/// Content of a session record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub enum SessionBody<'b> {
    /// "Put this session nonce into your records to me." Repeated until the peer does.
    #[n(0)]
    Hello(#[n(0)] Nonce),
    /// A signed report (COSE_Sign1 over [`crate::report::Report`]), the sender's own or, if it forwards, another's.
    #[n(1)]
    Report(#[b(0)] &'b ByteSlice),
    /// A supervision lease: control is supervised for so long from this record's stamp.
    #[n(2)]
    Grant(#[n(0)] Span),
    /// A teammate's report, verbatim, in the gateway's envelope.
    #[n(3)]
    Teammate(#[b(0)] Teammate<'b>),
    /// The display's challenge: "repeat it in your reports, with when you first saw it".
    #[n(4)]
    Watch(#[n(0)] Nonce),
    /// A crop ([`crate::crop::Crop`]) that the sender's reports vouch for.
    #[n(5)]
    Crop(#[b(0)] &'b ByteSlice),
    /// A signed revocation ([`crate::trust::Revocation`]), as the authority made it. Repeated while the session lasts.
    #[n(50)]
    Revoked(#[b(0)] &'b ByteSlice),
}

/// The gateway's envelope around a teammate's report.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Teammate<'b> {
    /// Session peer that brought it.
    #[n(0)]
    pub via: PeerId,
    /// Upper bound of its age when the envelope was made.
    #[n(1)]
    pub age: Span,
    /// The signed report as it came.
    #[b(2)]
    pub report: &'b ByteSlice,
}
