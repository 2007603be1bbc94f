//! What services write to the instrument plane: their decisions, what they saw, and their accounts.
//!
//! The oracle judges from these. Events about the world (truth), the plant, the relay and the display come from other
//! processes than the service judged, so that no service is the only witness of its own conduct.

use minicbor::{Decode, Encode};
use sha2::{Digest, Sha256};

use crate::codec::Text;
use crate::command::CommandKind;
use crate::core::{Side, Topic};
use crate::feed::CommandStage;
use crate::id::{Boot, CommandId, FrameId, NodeId, ObjectId, PeerId, RecordId, TrackId, UnitId, WorldId};
use crate::mode::{Because, Cause, Guards, Mode};
use crate::policy::Waived;
use crate::refusal::Reason;
use crate::sensor::{Class, Modalities, ReceiverTime};
use crate::step::StepName;
use crate::stream::{Deed, Sight};
use crate::time::{Instant, Span};

/// Where a record was judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode)]
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode)]
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
    /// Datagrams that the kernel dropped at our socket.
    #[n(13)]
    KernelDropped,
    /// Datagrams that a relay sent towards the server from a source address of its own; not in `RelayOut`.
    #[n(14)]
    RelayStranger,
    /// Of what a relay emitted towards a side, strangers' included, what its socket did not take.
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
}

/// What the record filter in front of a session decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Encode, Decode)]
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
    /// From a peer without an association, and not the beginning of one.
    #[n(3)]
    Stranger,
    /// A handshake that this ClientHello began came to nothing within its limit.
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

/// What an adversary did.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode)]
#[cbor(index_only)]
pub enum Action {
    /// Held a datagram back for some time.
    #[n(0)]
    Delay,
    /// Dropped it.
    #[n(1)]
    Drop,
    /// Emitted it again at once.
    #[n(2)]
    Duplicate,
    /// Let a later one overtake it.
    #[n(3)]
    Reorder,
    /// Emitted an earlier one again.
    #[n(4)]
    Replay,
    /// Changed its bytes.
    #[n(5)]
    Corrupt,
    /// Sent its bytes from another source.
    #[n(6)]
    Reoriginate,
    /// Sent bytes of its own making.
    #[n(7)]
    Inject,
    /// Sent a record under a teammate's own credentials.
    #[n(8)]
    Forward,
    /// Ended a process.
    #[n(11)]
    Kill,
    /// Published, on a shared-memory channel that is another's, a message of its own making.
    #[n(45)]
    Forge,
    /// Published there again what that channel's producer had published.
    #[n(46)]
    Republish,
    /// Sent a record of an earlier session again, under its own credentials.
    #[n(35)]
    Resend,
    /// Reported of itself what is not so.
    #[n(36)]
    Lie,
    /// Reported as a live product, in this time base, what is neither or not both.
    #[n(37)]
    Confuse,
}

/// A sensor that a fault can befall.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize, serde::Deserialize,
)]
#[cbor(index_only)]
#[serde(rename_all = "snake_case")]
pub enum Sensor {
    /// Colour camera.
    #[n(0)]
    Rgb,
    /// Depth camera.
    #[n(1)]
    Depth,
    /// Thermal camera.
    #[n(2)]
    Thermal,
    /// LiDAR.
    #[n(3)]
    Lidar,
    /// Wheel odometry.
    #[n(4)]
    Odometry,
    /// Localisation.
    #[n(5)]
    Localisation,
}

/// What befalls it.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize, serde::Deserialize,
)]
#[cbor(index_only)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// No readings.
    #[n(0)]
    Dropout,
    /// The reading from the start of the fault, under fresh stamps.
    #[n(1)]
    Freeze,
    /// More noise.
    #[n(2)]
    Noise,
    /// Something opaque before the sensor.
    #[n(3)]
    Occlusion,
    /// A slowly growing offset.
    #[n(4)]
    Drift,
    /// A sudden offset.
    #[n(5)]
    Jump,
    /// A sudden offset of the receiver's time.
    #[n(60)]
    TimeStep,
    /// A growing offset of the receiver's time.
    #[n(61)]
    TimeDrift,
}

/// How a shown value stands to its limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode)]
#[cbor(index_only)]
pub enum Freshness {
    /// Within its limit.
    #[n(0)]
    Fresh,
    /// One period beyond it.
    #[n(1)]
    Late,
    /// Not to be relied on.
    #[n(2)]
    Stale,
    /// Its source is gone.
    #[n(3)]
    Lost,
}

/// How far the display says that a command has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode)]
#[cbor(index_only)]
pub enum ShownAs {
    /// Asked of the gateway.
    #[n(0)]
    Requested,
    /// Waiting at the gateway for the operator's confirmation.
    #[n(1)]
    Staged,
    /// Confirmed by the operator.
    #[n(2)]
    Released,
    /// On its way to the unit.
    #[n(3)]
    Sent,
    /// Executed by the unit.
    #[n(4)]
    Executed,
    /// Refused by the unit.
    #[n(5)]
    Refused,
    /// Refused by the gateway, or waited too long there.
    #[n(6)]
    Void,
    /// Not answered in time: an alarm.
    #[n(7)]
    NotAcknowledged,
}

/// How a process is kept from running while it lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Encode, Decode)]
pub enum Suspension {
    /// It does nothing at all.
    #[n(0)]
    Hang,
    /// It runs for a share of each period.
    #[n(1)]
    Slow {
        /// The share, permille.
        #[n(0)]
        quota: u16,
        /// The period.
        #[n(1)]
        period: Span,
    },
}

/// One event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
#[expect(missing_docs, reason = "fields are named for what they hold; units as in wire's types")]
pub enum Event {
    /// A core was made.
    #[n(0)]
    Started,
    /// A session record was accepted.
    #[n(1)]
    Accepted {
        #[n(0)]
        at: Interface,
        #[n(1)]
        record: RecordId,
        #[n(2)]
        peer: PeerId,
        #[n(3)]
        age: Option<Span>,
        #[n(4)]
        waived: Waived,
    },
    /// Something was refused.
    #[n(2)]
    Refused {
        #[n(0)]
        at: Interface,
        #[n(1)]
        peer: Option<PeerId>,
        #[n(2)]
        reason: Reason,
        #[n(3)]
        detail: Text<120>,
    },
    /// The state machine changed mode.
    #[n(3)]
    Transition {
        #[n(0)]
        from: Mode,
        #[n(1)]
        to: Mode,
        #[n(2)]
        cause: Cause,
        #[n(3)]
        because: Because,
        #[n(4)]
        failing: Guards,
    },
    /// Authority was minted.
    #[n(4)]
    Minted {
        #[n(0)]
        world: WorldId,
        #[n(1)]
        authority: u32,
        #[n(2)]
        track: TrackId,
        #[n(3)]
        command: CommandId,
        #[n(4)]
        waived: Waived,
    },
    /// Authority ended unused.
    #[n(5)]
    Revoked {
        #[n(0)]
        authority: u32,
        #[n(1)]
        cause: Cause,
    },
    /// Authority was used, with every guard's value then.
    #[n(6)]
    Acted {
        #[n(0)]
        world: WorldId,
        #[n(1)]
        authority: u32,
        #[n(2)]
        track: TrackId,
        #[n(3)]
        command: CommandId,
        #[n(4)]
        failing: Guards,
    },
    /// Ground truth of a unit, from the plant.
    #[n(7)]
    Truth {
        #[n(0)]
        unit: UnitId,
        #[n(1)]
        x_mm: i32,
        #[n(2)]
        y_mm: i32,
        #[n(3)]
        yaw_mrad: i16,
        #[n(4)]
        speed_mm_s: i32,
        #[n(5)]
        set_speed_mm_s: i32,
        /// The plant is following a set-point whose lease stands.
        #[n(6)]
        leased: bool,
        /// Signed distance to the fence, positive inside.
        #[n(7)]
        fence_mm: i32,
    },
    /// True place of an object.
    #[n(8)]
    Object {
        #[n(0)]
        object: ObjectId,
        #[n(1)]
        class: Class,
        #[n(2)]
        x_mm: i32,
        #[n(3)]
        y_mm: i32,
    },
    /// The plant received an act.
    #[n(9)]
    PlantAct {
        #[n(0)]
        authority: u32,
        #[n(1)]
        command: CommandId,
        /// True object nearest to the designated place.
        #[n(2)]
        object: Option<ObjectId>,
        #[n(3)]
        class: Option<Class>,
        #[n(4)]
        distance_mm: u32,
    },
    /// A sensor fault began (true) or ended.
    #[n(10)]
    Fault {
        #[n(0)]
        sensor: Sensor,
        #[n(1)]
        kind: FaultKind,
        #[n(2)]
        active: bool,
        /// First frame affected or first frame whole again.
        #[n(3)]
        frame: FrameId,
    },
    /// Perception: what a frame brought, when that changed.
    #[n(11)]
    FrameSeen {
        #[n(0)]
        frame: FrameId,
        #[n(1)]
        present: Modalities,
    },
    /// Autonomy: what navigation brought, when that changed.
    #[n(12)]
    NavigationSeen {
        #[n(0)]
        fix: bool,
        #[n(1)]
        odometry: bool,
    },
    /// What the display shows of a unit.
    #[n(13)]
    Displayed {
        #[n(0)]
        unit: UnitId,
        #[n(1)]
        mode: Mode,
        #[n(2)]
        authority: bool,
        #[n(3)]
        freshness: Freshness,
        /// Age as shown.
        #[n(4)]
        age: Span,
        /// Tracks shown as fresh.
        #[n(5)]
        tracks_fresh: u8,
        /// Tracks shown as stale or lost.
        #[n(6)]
        tracks_stale: u8,
        /// The report behind it.
        #[n(7)]
        report: RecordId,
    },
    /// Part of a closing account.
    #[n(14)]
    Count {
        #[n(0)]
        account: Account,
        #[n(1)]
        n: u64,
    },
    /// An adversary acted.
    #[n(15)]
    Attack {
        #[n(0)]
        action: Action,
        /// Side it was sent towards, or that it came from when dropped.
        #[n(1)]
        side: Side,
        #[n(2)]
        length: u16,
        /// First eight bytes of the SHA-256 of the bytes on the wire.
        #[n(3)]
        hash: u64,
        /// Delay imposed, if any.
        #[n(4)]
        delay: Span,
    },
    /// The guard in front of a session saw a datagram (logged for what is unusual, and for what came late or twice).
    #[n(16)]
    GuardSaw {
        #[n(0)]
        association: u32,
        #[n(1)]
        epoch: u16,
        #[n(2)]
        sequence: u64,
        #[n(3)]
        length: u16,
        #[n(4)]
        hash: u64,
        #[n(5)]
        verdict: GuardVerdict,
    },
    /// A secure session opened (true) or ended.
    #[n(17)]
    Session {
        #[n(0)]
        peer: PeerId,
        #[n(1)]
        open: bool,
    },
    /// An operator gave an intent.
    #[n(18)]
    Intended {
        #[n(0)]
        command: CommandId,
        #[n(1)]
        kind: CommandKind,
    },
    /// The gateway moved a command along.
    #[n(19)]
    Staged {
        #[n(0)]
        command: CommandId,
        #[n(1)]
        stage: CommandStage,
    },
    /// A unit executed a command, or refused it.
    #[n(20)]
    Executed {
        #[n(0)]
        command: CommandId,
        #[n(1)]
        kind: CommandKind,
        #[n(2)]
        refused: Option<Reason>,
    },
    /// A verified acknowledgement reached the console.
    #[n(21)]
    Acknowledged {
        #[n(0)]
        command: CommandId,
        #[n(1)]
        refused: Option<Reason>,
    },
    /// The recorder sealed what it had.
    #[n(22)]
    Sealed {
        #[n(0)]
        entries: u64,
        #[cbor(n(1), with = "minicbor::bytes")]
        head: [u8; 32],
    },
    /// A service signed the head of its own chain.
    #[n(23)]
    Signed {
        #[cbor(n(0), with = "minicbor::bytes")]
        signature: [u8; 64],
    },
    /// The recorder found a chain broken.
    #[n(24)]
    ChainBroken {
        #[n(0)]
        node: NodeId,
        #[n(1)]
        counter: u64,
    },
    /// The launcher or twin ended a process, or saw it end.
    #[n(25)]
    Ended {
        #[n(0)]
        node: NodeId,
        /// On purpose.
        #[n(1)]
        killed: bool,
    },
    /// The host itself overslept by so much (live only).
    #[n(26)]
    Stalled {
        #[n(0)]
        by: Span,
    },
    /// A teammate's claim was found inconsistent.
    #[n(27)]
    Inconsistent {
        #[n(0)]
        unit: UnitId,
        #[n(1)]
        finding: Inconsistency,
        #[n(2)]
        record: RecordId,
    },
    /// An adversary did something to a byte stream.
    #[n(28)]
    Tampered {
        #[n(0)]
        deed: Deed,
        /// Side that the direction leads to.
        #[n(1)]
        side: Side,
        /// Name of the direction ([`crate::stream::Place`]), as it leaves the adversary.
        #[n(2)]
        stream: u64,
        /// Bytes of the direction before these.
        #[n(3)]
        offset: u64,
        #[n(4)]
        length: u32,
        /// Of these bytes, as they leave.
        #[n(5)]
        hash: u64,
        /// Delay imposed, if any.
        #[n(6)]
        delay: Span,
    },
    /// The mouth of an end saw something of a byte stream that leads to it.
    #[n(29)]
    StreamSaw {
        #[n(0)]
        sight: Sight,
        /// Name of the direction, so far as it has come.
        #[n(1)]
        stream: u64,
        /// Bytes of the direction before these.
        #[n(2)]
        offset: u64,
        #[n(3)]
        length: u32,
        #[n(4)]
        hash: u64,
    },
    /// A rogue station gave a command under a key that is not its own.
    #[n(50)]
    Rogue {
        #[n(0)]
        command: CommandId,
        #[n(1)]
        kind: CommandKind,
        /// Whose key it was signed with.
        #[n(2)]
        key: NodeId,
        /// Under whose certificate it was published; absent when it was asked of the gateway.
        #[n(3)]
        certificate: Option<PeerId>,
    },
    /// A service learned that the authority has revoked an identity.
    #[n(51)]
    Struck {
        #[n(0)]
        who: NodeId,
    },
    /// A step of an attack began (true) or ended, by the word of who carries it out.
    #[n(40)]
    Step {
        #[n(0)]
        step: StepName,
        #[n(1)]
        begun: bool,
    },
    /// The launcher or twin keeps a process from running (true), or lets it run again. Live, it says so once the kernel's
    /// process table does.
    #[n(41)]
    Suspended {
        #[n(0)]
        node: NodeId,
        #[n(1)]
        how: Suspension,
        #[n(2)]
        on: bool,
    },
    /// The launcher or twin started a process again that had ended.
    #[n(42)]
    Restarted {
        #[n(0)]
        node: NodeId,
        #[n(1)]
        boot: Boot,
    },
    /// What the display shows of a command of the operator's, when that changed.
    #[n(45)]
    CommandShown {
        #[n(0)]
        command: CommandId,
        #[n(1)]
        shown: ShownAs,
    },
    /// An adversary kept a report from the display, for a time or for good.
    #[n(46)]
    Withheld {
        #[n(0)]
        record: RecordId,
    },
    /// An adversary kept what the operator asked for from the gateway.
    #[n(47)]
    Swallowed {
        #[n(0)]
        command: CommandId,
    },
    /// A second connection with this certificate took the session of the first at the broker.
    #[n(48)]
    TakenOver {
        #[n(0)]
        peer: PeerId,
    },
    /// An adversary takes a session on the command plane under this certificate.
    #[n(56)]
    Joins {
        #[n(0)]
        certificate: PeerId,
    },
    /// The session of this peer at the broker has ended, and not by the peer, who says so.
    #[n(58)]
    SessionLost {
        #[n(0)]
        peer: PeerId,
    },
    /// Console: how often that happened, as the display shows it.
    #[n(57)]
    LossesShown {
        #[n(0)]
        peer: PeerId,
        #[n(1)]
        times: u32,
    },
    /// Autonomy: a fix as it came, and the pose that the unit drives by after it (written a few times a second).
    #[n(60)]
    Located {
        /// Stamp of the reading.
        #[n(0)]
        stamp: Instant,
        #[n(1)]
        x_mm: i32,
        #[n(2)]
        y_mm: i32,
        #[n(3)]
        time: ReceiverTime,
        #[n(4)]
        pose_x_mm: i32,
        #[n(5)]
        pose_y_mm: i32,
        /// The unit says that it does not go by such fixes now.
        #[n(6)]
        distrusted: bool,
    },
    /// Sim: by how much faults displace the fix of this stamp (written with the truth, while they do).
    #[n(61)]
    Imposed {
        #[n(0)]
        stamp: Instant,
        #[n(1)]
        east_mm: i32,
        #[n(2)]
        north_mm: i32,
        #[n(3)]
        time_us: i64,
    },
    /// The mouth of a core took in bytes that an insider says it sent there.
    #[n(65)]
    MouthSaw {
        #[n(0)]
        reader: NodeId,
        #[n(1)]
        at: Interface,
        #[n(2)]
        length: u32,
        #[n(3)]
        hash: u64,
    },
    /// The guard in front of a session: whose certificate the handshake of an association showed.
    #[n(66)]
    Associated {
        #[n(0)]
        association: u32,
        #[n(1)]
        peer: PeerId,
    },
    /// The launcher or twin stops a slow process for its share of a period (true), or lets it go on.
    #[n(67)]
    Halted {
        #[n(0)]
        node: NodeId,
        #[n(1)]
        on: bool,
    },
    /// The core of a process that is to be kept from running was fed something (told once in a few milliseconds).
    #[n(68)]
    Ran {
        #[n(0)]
        node: NodeId,
    },
    /// The launcher or twin lets a process write nothing more to its disk (true), or lets it again.
    #[n(69)]
    DiskFull {
        #[n(0)]
        node: NodeId,
        #[n(1)]
        on: bool,
    },
    /// The recording has grown to so many bytes, as seen from outside the recorder (told where its disk is to be full).
    #[n(70)]
    Kept {
        #[n(0)]
        bytes: u64,
    },
    /// An insider sends the report with this identity: which of a session's records are its deeds.
    #[n(55)]
    Claimed {
        #[n(0)]
        record: RecordId,
        /// How far the place in it is from the true one, mm.
        #[n(1)]
        off_mm: u32,
    },
}

/// The short hash of bytes on a wire, as [`Event::Attack`] and [`Event::GuardSaw`] carry it: the first eight bytes of
/// their SHA-256, big endian. Both ends of a receipt have to use this one.
pub fn wire_hash(bytes: &[u8]) -> u64 {
    let digest: [u8; 32] = Sha256::digest(bytes).into();
    digest.iter().take(8).fold(0, |hash, byte| hash << 8 | u64::from(*byte))
}

/// How a teammate's claim contradicts something.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Encode, Decode)]
#[cbor(index_only)]
pub enum Inconsistency {
    /// It moved faster than it can.
    #[n(0)]
    Kinematics,
    /// Two units claim one place.
    #[n(1)]
    Exclusion,
    /// Its own sequence or stamps run backwards, or two sources claim the same report sequence.
    #[n(2)]
    TimeBase,
    /// Over many claims its place does not go where its speed and heading lead.
    #[n(55)]
    Residual,
}
