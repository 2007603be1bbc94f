//! Events that services write to the instrument plane: their decisions, their observations and their accounts.
//!
//! The oracle judges from these and from what others write beside them about the world, the plant and the links
//! (`ground_truth`), so that no service is the only witness of its own conduct. The numbers that are missing here are
//! of those others' notes.
//!
//! The enum stays one, since its numbers are the wire's; the terms that its events are reported in are beside it:
//! `account`, `seen`.

use minicbor::{Decode, Encode};
use sha2::{Digest, Sha256};

use crate::codec::Text;
use crate::command::{CommandKind, TimeTag};
use crate::feed::CommandStage;
use crate::guest::{Declared, Fault, MAX_NAME, MAX_WHY, Place};
use crate::id::{CommandId, FrameId, NodeId, PeerId, RecordId, TrackId, UnitId, WorldId};
use crate::mode::{Because, Cause, Guards, Mode};
use crate::person::{Act, Order, Unable};
use crate::policy::Waived;
use crate::refusal::Reason;
use crate::sensor::{Class, Modalities, Modality, Pose, ReceiverTime};
use crate::time::{Instant, Span};

mod account;
mod seen;

pub use account::{Account, Interface};
pub use seen::{Freshness, Inconsistency, ShownAs};

/// An event of a node's log. The JSON form leaves out signatures and the heads of seals, which cover the bytes of
/// entries and not their JSON.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode, serde::Serialize)]
#[serde(tag = "is", rename_all = "snake_case")]
#[rustfmt::skip] // a table: each event with its number, each field with its own
#[expect(missing_docs, reason = "fields are named for what they hold; units as in wire's types")]
pub enum Event {
    /// A core was made.
    #[n(0)] Started,
    /// A session record was accepted.
    #[n(1)] Accepted {
        #[n(0)] at: Interface, #[n(1)] record: RecordId, #[n(2)] peer: PeerId, #[n(3)] age: Option<Span>,
        #[n(4)] waived: Waived,
    },
    /// Something was refused.
    #[n(2)] Refused {
        #[n(0)] at: Interface, #[n(1)] peer: Option<PeerId>, #[n(2)] reason: Reason, #[n(3)] detail: Text<120>,
    },
    /// The state machine changed mode.
    #[n(3)] Transition {
        #[n(0)] from: Mode, #[n(1)] to: Mode, #[n(2)] cause: Cause, #[n(3)] because: Because, #[n(4)] failing: Guards,
    },
    /// Authority was minted.
    #[n(4)] Minted {
        #[n(0)] world: WorldId, #[n(1)] authority: u32, #[n(2)] track: TrackId, #[n(3)] command: CommandId,
        #[n(4)] waived: Waived,
    },
    /// Authority ended unused.
    #[n(5)] Revoked { #[n(0)] authority: u32, #[n(1)] cause: Cause },
    /// Authority was used, with every guard's value then.
    #[n(6)] Acted {
        #[n(0)] world: WorldId, #[n(1)] authority: u32, #[n(2)] track: TrackId, #[n(3)] command: CommandId,
        #[n(4)] failing: Guards,
    },
    /// Perception: content of a frame, when that changed. A modality that repeats itself brings none.
    #[n(11)] FrameSeen { #[n(0)] frame: FrameId, #[n(1)] present: Modalities },
    /// Autonomy: content of navigation, when that changed.
    #[n(12)] NavigationSeen { #[n(0)] fix: bool, #[n(1)] odometry: bool },
    /// Display of a unit.
    #[n(13)] Displayed {
        #[n(0)] unit: UnitId, #[n(1)] mode: Mode,
        /// Track that it is shown to hold authority over.
        #[n(2)] authority: Option<TrackId>,
        #[n(3)] freshness: Freshness,
        /// Age as shown.
        #[n(4)] age: Span,
        /// Tracks shown as fresh.
        #[n(5)] tracks_fresh: u8,
        /// Tracks shown as stale or lost.
        #[n(6)] tracks_stale: u8,
        /// The report behind it.
        #[n(7)] report: RecordId,
        /// Guards shown as failing.
        #[n(8)] failing: Guards,
        /// Place of the unit, where the place is shown as fresh.
        #[n(9)] place: Option<Pose>,
    },
    /// Part of a closing account.
    #[n(14)] Count { #[n(0)] account: Account, #[n(1)] n: u64 },
    /// A secure session opened (true) or ended.
    #[n(17)] Session { #[n(0)] peer: PeerId, #[n(1)] open: bool },
    /// An operator gave an intent.
    #[n(18)] Intended { #[n(0)] command: CommandId, #[n(1)] kind: CommandKind, #[n(2)] tag: Option<TimeTag> },
    /// The gateway moved a command along.
    #[n(19)] Staged { #[n(0)] command: CommandId, #[n(1)] stage: CommandStage },
    /// A unit executed a command, or refused it.
    #[n(20)] Executed { #[n(0)] command: CommandId, #[n(1)] kind: CommandKind, #[n(2)] refused: Option<Reason> },
    /// A unit stored a command until its time.
    #[n(101)] Stored { #[n(0)] command: CommandId, #[n(1)] kind: CommandKind, #[n(2)] due: Span },
    /// A verified acknowledgement reached the console.
    #[n(21)] Acknowledged { #[n(0)] command: CommandId, #[n(1)] refused: Option<Reason> },
    /// The recorder sealed its log so far.
    #[n(22)] Sealed { #[n(0)] entries: u64, #[cbor(n(1), with = "minicbor::bytes")] #[serde(skip)] head: [u8; 32] },
    /// A service signed its own chain.
    #[n(23)] Signed { #[cbor(n(0), with = "minicbor::bytes")] #[serde(skip)] signature: [u8; 64] },
    /// The recorder found a chain broken.
    #[n(24)] ChainBroken { #[n(0)] node: NodeId, #[n(1)] counter: u64 },
    /// A teammate's claim was found inconsistent.
    #[n(27)] Inconsistent { #[n(0)] unit: UnitId, #[n(1)] finding: Inconsistency, #[n(2)] record: RecordId },
    /// A service learned that the authority has revoked an identity.
    #[n(51)] Struck { #[n(0)] who: NodeId },
    /// State of an operator's command on the display, when that changed.
    #[n(45)] CommandShown { #[n(0)] command: CommandId, #[n(1)] shown: ShownAs },
    /// A second connection with this certificate took the session of the first at the broker.
    #[n(48)] TakenOver { #[n(0)] peer: PeerId },
    /// The session of this peer at the broker has ended, and not by the peer, who reports it.
    #[n(58)] SessionLost { #[n(0)] peer: PeerId },
    /// Console: how often that happened, as the display shows it.
    #[n(57)] LossesShown { #[n(0)] peer: PeerId, #[n(1)] times: u32 },
    /// Autonomy: a fix as it came, and the pose that the unit drives by after it (written a few times a second).
    #[n(60)] Located {
        /// Stamp of the reading.
        #[n(0)] stamp: Instant,
        #[n(1)] x_mm: i32, #[n(2)] y_mm: i32, #[n(3)] time: ReceiverTime, #[n(4)] pose_x_mm: i32,
        #[n(5)] pose_y_mm: i32,
        /// The unit says that it does not use such fixes now.
        #[n(6)] distrusted: bool,
    },
    /// Console: an act of a person, and its immediate result: the command given, or the reason that none was.
    #[n(80)] Act {
        #[n(0)] by: NodeId,
        /// The act's number at the window; 0 where it could not be read.
        #[n(1)] serial: u64,
        /// Absent where it could not be read.
        #[n(2)] act: Option<Act>,
        #[n(3)] command: Option<CommandId>, #[n(4)] refused: Option<Unable>,
    },
    /// Console: an order that a person had prepared lapsed by itself.
    #[n(81)] Lapsed { #[n(0)] by: NodeId, #[n(1)] order: Order, #[n(2)] why: Unable },
    /// Autonomy: basis of the unit's judgement, when that changed.
    #[n(82)] Judged {
        /// Guards that fail, waived ones too.
        #[n(0)] failing: Guards,
        /// The fix behind its place is no older than *Tf*.
        #[n(1)] placed: bool,
        /// Tracks whose last update is no older than *Tf*.
        #[n(2)] tracks: u8,
    },
    /// Perception: a modality has shown only repeated content, for so long that it gives no product until that
    /// changes (`perception::content`; where that check is waived it is reported all the same).
    #[n(83)] Repeated {
        #[n(0)] modality: Modality, #[n(1)] frame: FrameId,
        /// The frame in which this content came first: that of `frame` was to be newer.
        #[n(2)] first: FrameId,
    },
    /// Perception: a frame has many colour detections, and more than any before.
    #[n(84)] Crowded { #[n(0)] frame: FrameId, #[n(1)] detections: u8 },
    /// Perception: other modalities contradict the colour stage there, in most of the newest frames.
    #[n(85)] Doubted {
        #[n(0)] frame: FrameId, #[n(1)] class: Class,
        /// Left of the optical axis, seen from the camera.
        #[n(2)] bearing_mrad: i16,
        #[n(3)] supported: Modalities, #[n(4)] vetoed: Modalities,
    },
    /// Perception: a track is believed, or is taken for something else than before.
    #[n(86)] Followed { #[n(0)] track: TrackId, #[n(1)] class: Class, #[n(2)] x_mm: i32, #[n(3)] y_mm: i32 },
    /// The colour image of a frame, by its [`wire_hash`]: as perception was given it, and as the sim gave it with a
    /// pattern or a print in it. Of every [`PICTURED_EVERY`]th frame.
    #[n(88)] Pictured { #[n(0)] frame: FrameId, #[n(1)] hash: u64 },
    /// Autonomy: a guest drives, by this name.
    #[n(93)] GuestEngaged {
        #[n(0)] name: Text<MAX_NAME>,
        /// True if its set-points go to the plant as they are.
        #[n(1)] bare: bool,
        /// End of its route, where that does not begin again.
        #[n(2)] goal: Option<Place>,
    },
    /// Autonomy: the guest's own word on its state, when that changed.
    #[n(94)] GuestStated { #[n(0)] declared: Declared, #[n(1)] state: Text<MAX_NAME> },
    /// Autonomy: the place that the guest says it drives by (written a few times a second).
    #[n(95)] GuestPlaced { #[n(0)] x_mm: i32, #[n(1)] y_mm: i32 },
    /// Autonomy: the guest failed, and drives no longer.
    #[n(96)] GuestFailed { #[n(0)] fault: Fault, #[n(1)] why: Text<MAX_WHY> },
    /// Autonomy: steps that the guest answered, and steps of which the motion was limited, at the end of the run.
    #[n(97)] GuestSteps { #[n(0)] steps: u32, #[n(1)] limited: u32 },
}

/// Every given number of frames the colour image is reported: once a second.
pub const PICTURED_EVERY: u64 = 10;

/// The short hash of bytes on a wire, as [`Event::Pictured`] and the notes of relays and guards carry it: the first
/// eight bytes of their SHA-256, big endian. Both ends of a receipt have to use this one.
pub fn wire_hash(bytes: &[u8]) -> u64 {
    let digest: [u8; 32] = Sha256::digest(bytes).into();
    digest.iter().take(8).fold(0, |hash, byte| hash << 8 | u64::from(*byte))
}
