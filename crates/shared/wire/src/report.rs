//! Telemetry: a unit's report of itself, signed at its origin.
//!
//! A report keeps its origin's identity, boot, sequence and stamp wherever it is forwarded; the session it happens to
//! travel in is the business of `wire::session`.

use minicbor::{Decode, Encode};

use crate::codec::List;
use crate::crop::Pictured;
use crate::id::{Boot, CommandId, NodeId, Nonce, RecordId, Sequence, TrackId};
use crate::measured::Measured;
use crate::mode::{Cause, Guards, Mode};
use crate::motion::ReportedMotion;
use crate::refusal::Reason;
use crate::sensor::{Class, Modalities, Pose, ProductMode};
use crate::settings::Settings;
use crate::time::{Echo, PeerStamp, Span};

/// Longest encoded and signed report in bytes; leaves room for the session message in one 1,200-byte datagram.
pub const MAX_REPORT: usize = 1024;

/// Tracks in a report.
pub const MAX_TRACKS: usize = 8;
/// Newest reports that a unit remembers, for the orders that name one: longer than an order may take.
pub const REPORTS_KEPT: usize = 32;

/// A track as reported to the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct ReportedTrack {
    /// Identity within the unit's tracker.
    #[n(0)]
    pub id: TrackId,
    /// Class.
    #[n(1)]
    pub class: Class,
    /// East, millimetres.
    #[n(2)]
    pub x_mm: i32,
    /// North, millimetres.
    #[n(3)]
    pub y_mm: i32,
    /// Confidence in permille.
    #[n(4)]
    pub confidence: u16,
    /// Modalities that supported the track in one of its last five frames.
    #[n(5)]
    pub supported: Modalities,
    /// Age of the last update when the report was made.
    #[n(6)]
    pub age: Span,
    /// Modalities that contradict it.
    #[n(7)]
    pub contradicted: Modalities,
    /// Widest angle between two lines of sight along which it was borne out, milliradians.
    #[n(8)]
    pub bearings_mrad: u16,
    /// Pixels across the smaller side of its newest detection in the camera's image; zero without an image.
    #[n(9)]
    pub across_px: u16,
}

/// Authority as reported to the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct ReportedAuthority {
    /// Designated track.
    #[n(0)]
    pub track: TrackId,
    /// Time left when the report was made.
    #[n(1)]
    pub left: Span,
}

/// Contact with the supervisor, as planned when the report was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct ReportedContact {
    /// Time left in this contact; zero between contacts.
    #[n(0)]
    pub left: Span,
    /// Time to the next one; absent if the plan has no other.
    #[n(1)]
    pub next: Option<Span>,
}

/// A unit's state, 10 times a second.
#[derive(Clone, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Report {
    /// Claimed maker of the report.
    #[n(0)]
    pub origin: NodeId,
    /// Boot of the maker.
    #[n(1)]
    pub boot: Boot,
    /// Sequence of the report, from 1.
    #[n(2)]
    pub sequence: Sequence,
    /// Time by the maker's clock.
    #[n(3)]
    pub stamp: PeerStamp,
    /// Source of the content.
    #[n(4)]
    pub product: ProductMode,
    /// Mode of the state machine.
    #[n(5)]
    pub mode: Mode,
    /// Cause of the last transition.
    #[n(6)]
    pub cause: Cause,
    /// Guards that fail now.
    #[n(7)]
    pub failing: Guards,
    /// Position at which the unit holds itself to be.
    #[n(8)]
    pub pose: Pose,
    /// Forward speed, mm/s.
    #[n(9)]
    pub speed_mm_s: i32,
    /// Age of the localisation behind `pose` when the report was made.
    #[n(10)]
    pub pose_age: Span,
    /// Authority, while it is held.
    #[n(11)]
    pub authority: Option<ReportedAuthority>,
    /// Nonce that an intent has to repeat to prove that it is younger.
    #[n(12)]
    pub command_nonce: Nonce,
    /// Progress of the counter of the operator who moved one last and, if the command that did was refused, the reason.
    #[n(13)]
    pub last_command: Option<(CommandId, Option<Reason>)>,
    /// Share of the route driven, permille.
    #[n(14)]
    pub progress: u16,
    /// Tracks, at most 8, oldest first.
    #[n(15)]
    pub tracks: List<ReportedTrack, MAX_TRACKS>,
    /// The display's newest challenge and when it was first seen, so that the display can bound this report's age by
    /// itself.
    #[n(16)]
    pub watched: Option<Echo>,
    /// Number of times in this boot that the unit's session at the broker was cut or taken.
    #[n(17)]
    pub sessions_lost: u32,
    /// Measurements by which the guards were judged.
    #[n(18)]
    pub measured: Measured,
    /// Values that an operator has set, where the unit does not use the platform's own.
    #[n(19)]
    pub settings: Option<Settings>,
    /// Motion of a body that leaves the ground.
    #[n(20)]
    pub motion: Option<ReportedMotion>,
    /// Contact by the unit's own plan; absent where the link always carries.
    #[n(21)]
    pub contact: Option<ReportedContact>,
    /// Newest crops of a track, where it has images.
    #[n(22)]
    pub pictured: Option<Pictured>,
}

impl Report {
    /// The report of a unit that stands in READY at the origin of its plane, with no track, order or measurement: a
    /// start for reports that state more.
    pub fn bare(id: RecordId, stamp: PeerStamp) -> Self {
        Self {
            origin: id.node,
            boot: id.boot,
            sequence: id.sequence,
            stamp,
            product: ProductMode::Live,
            mode: Mode::Ready,
            cause: Cause::Operator,
            failing: Guards::default(),
            pose: Pose::default(),
            speed_mm_s: 0,
            pose_age: Span::ZERO,
            authority: None,
            command_nonce: Nonce(0),
            last_command: None,
            progress: 0,
            tracks: List::default(),
            watched: None,
            sessions_lost: 0,
            measured: Measured::default(),
            settings: None,
            motion: None,
            contact: None,
            pictured: None,
        }
    }

    /// The report's identity.
    pub fn id(&self) -> RecordId {
        RecordId { node: self.origin, boot: self.boot, sequence: self.sequence }
    }
}
