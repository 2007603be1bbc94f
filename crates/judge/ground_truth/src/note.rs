//! Notes: what the instrument writes into the log beside the services' events.
//!
//! Their numbers are of one series with the numbers of [`wire::event::Event`], so that a number alone tells the two apart.

use minicbor::{Decode, Encode};
use wire::command::CommandKind;
use wire::core::Side;
use wire::event::Interface;
use wire::id::{Boot, CommandId, FrameId, NodeId, ObjectId, PeerId, RecordId, UnitId};
use wire::motion::Motion;
use wire::sensor::Class;
use wire::time::{Instant, Span};

use crate::bus_attack::BusAttack;
use crate::guard::GuardVerdict;
use crate::injected::{Action, FaultKind, Sensor, Suspension};
use crate::step::StepName;
use crate::stream::{Sight, StreamEffect};

/// One note. As JSON it has the form of a service's event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode, serde::Serialize)]
#[serde(tag = "is", rename_all = "snake_case")]
#[rustfmt::skip] // a table: each note with its number, each field with its own
#[expect(missing_docs, reason = "fields are named for what they hold; units as in wire's types")]
pub enum Note {
    /// Ground truth of a unit, from the plant.
    #[n(7)] Truth {
        #[n(0)] unit: UnitId, #[n(1)] x_mm: i32, #[n(2)] y_mm: i32, #[n(3)] yaw_mrad: i16, #[n(4)] speed_mm_s: i32,
        #[n(5)] set_speed_mm_s: i32,
        /// The plant is following a set-point whose lease stands.
        #[n(6)] leased: bool,
        /// Signed distance to the fence, positive inside.
        #[n(7)] fence_mm: i32,
    },
    /// True place of an object.
    #[n(8)] Object { #[n(0)] object: ObjectId, #[n(1)] class: Class, #[n(2)] x_mm: i32, #[n(3)] y_mm: i32 },
    /// The plant received an act.
    #[n(9)] PlantAct {
        #[n(0)] authority: u32, #[n(1)] command: CommandId,
        /// True object nearest to the designated place.
        #[n(2)] object: Option<ObjectId>,
        #[n(3)] class: Option<Class>, #[n(4)] distance_mm: u32,
    },
    /// A sensor fault began (true) or ended.
    #[n(10)] Fault {
        #[n(0)] sensor: Sensor, #[n(1)] kind: FaultKind, #[n(2)] active: bool,
        /// First frame with the fault, or first frame without it.
        #[n(3)] frame: FrameId,
    },
    /// An adversary acted.
    #[n(15)] Attack {
        #[n(0)] action: Action,
        /// Side it was sent towards, or that it came from when dropped.
        #[n(1)] side: Side,
        #[n(2)] length: u16,
        /// First eight bytes of the SHA-256 of the bytes on the wire.
        #[n(3)] hash: u64,
        /// Delay imposed, if any.
        #[n(4)] delay: Span,
    },
    /// The guard in front of a session saw a datagram (logged if unusual, late or repeated).
    #[n(16)] GuardSaw {
        #[n(0)] association: u32, #[n(1)] epoch: u16, #[n(2)] sequence: u64, #[n(3)] length: u16, #[n(4)] hash: u64,
        #[n(5)] verdict: GuardVerdict,
    },
    /// The launcher or twin ended a process, or saw it end.
    #[n(25)] Ended {
        #[n(0)] node: NodeId,
        /// True if the launcher or twin ended it on purpose.
        #[n(1)] killed: bool,
        /// Number of the signal that ended a process which was not killed on purpose, such as 31 (SIGSYS) for a system call that its
        /// confinement does not allow.
        #[n(2)] signal: Option<u8>,
    },
    /// The host itself overslept by this much (live only).
    #[n(26)] Stalled { #[n(0)] by: Span },
    /// An adversary did something to a byte stream.
    #[n(28)] Tampered {
        #[n(0)] deed: StreamEffect,
        /// Side that the direction leads to.
        #[n(1)] side: Side,
        /// Name of the direction ([`crate::StreamPlace`]), as it leaves the adversary.
        #[n(2)] stream: u64,
        /// Bytes of the direction before these.
        #[n(3)] offset: u64,
        #[n(4)] length: u32,
        /// Reception of these bytes, as they leave.
        #[n(5)] hash: u64,
        /// Delay imposed, if any.
        #[n(6)] delay: Span,
    },
    /// The ingress of an end saw an event of a byte stream that leads to it.
    #[n(29)] StreamSaw {
        #[n(0)] sight: Sight,
        /// Name of the direction; final once its first 128 bytes have passed.
        #[n(1)] stream: u64,
        /// Bytes of the direction before these.
        #[n(2)] offset: u64,
        #[n(3)] length: u32, #[n(4)] hash: u64,
    },
    /// A rogue station gave a command under a key that is not its own.
    #[n(50)] Rogue {
        #[n(0)] command: CommandId, #[n(1)] kind: CommandKind,
        /// Node that owns the signing key.
        #[n(2)] key: NodeId,
        /// Peer under which it was published; absent when it was asked of the gateway.
        #[n(3)] certificate: Option<PeerId>,
    },
    /// A step of an attack began (true) or ended, by the log of the process that carries it out.
    #[n(40)] Step { #[n(0)] step: StepName, #[n(1)] begun: bool },
    /// The launcher or twin keeps a process from running (true), or lets it run again. Live, it reports it once the kernel's
    /// process table does.
    #[n(41)] Suspended { #[n(0)] node: NodeId, #[n(1)] how: Suspension, #[n(2)] on: bool },
    /// The launcher or twin started a process again that had ended.
    #[n(42)] Restarted { #[n(0)] node: NodeId, #[n(1)] boot: Boot },
    /// An adversary kept a report from the display, for a time or permanently.
    #[n(46)] Withheld { #[n(0)] record: RecordId },
    /// An adversary kept a request of the operator from the gateway.
    #[n(47)] Swallowed { #[n(0)] command: CommandId },
    /// An adversary takes a session on the command plane under this certificate.
    #[n(56)] Joins { #[n(0)] certificate: PeerId },
    /// Sim: by how much faults displace the fix of this stamp (written with the truth, while they do).
    #[n(61)] Imposed { #[n(0)] stamp: Instant, #[n(1)] east_mm: i32, #[n(2)] north_mm: i32, #[n(3)] time_us: i64 },
    /// The input of a core took in bytes that an insider says it sent there.
    #[n(65)] MouthSaw { #[n(0)] reader: NodeId, #[n(1)] at: Interface, #[n(2)] length: u32, #[n(3)] hash: u64 },
    /// The guard in front of a session: peer of the certificate that an association's handshake showed.
    #[n(66)] Associated { #[n(0)] association: u32, #[n(1)] peer: PeerId },
    /// The launcher or twin stops a slow process for its share of a period (true), or lets it go on.
    #[n(67)] Halted { #[n(0)] node: NodeId, #[n(1)] on: bool },
    /// The core of a process that is to be kept from running was fed something (reported once in a few milliseconds).
    #[n(68)] Ran { #[n(0)] node: NodeId },
    /// The launcher or twin stops a process from writing to its disk (true), or lets it again.
    #[n(69)] DiskFull { #[n(0)] node: NodeId, #[n(1)] on: bool },
    /// The recording has grown to a given number of bytes, as seen from outside the recorder (reported where its disk is to be full).
    #[n(70)] Kept { #[n(0)] bytes: u64 },
    /// The sim: this object bears a print.
    #[n(87)] Printed { #[n(0)] object: ObjectId },
    /// The sim: the message with this [`wire::event::wire_hash`] would read otherwise without the faults of this kind at this sensor. Reported of the
    /// first message that a fault changes and then once in [`ALTERED_EVERY`].
    #[n(92)] Altered { #[n(0)] sensor: Sensor, #[n(1)] kind: FaultKind, #[n(2)] hash: u64 },
    /// The unit's chassis has begun to touch an object since the last truth.
    #[n(98)] Collided {
        #[n(0)] unit: UnitId, #[n(1)] object: ObjectId,
        /// Speed towards it just before.
        #[n(2)] speed_mm_s: i32,
    },
    /// True motion of a unit that leaves the ground, reported with [`Note::Truth`].
    #[n(99)] Moves { #[n(0)] unit: UnitId, #[n(1)] motion: Motion },
    /// Margin that a unit that does not stand still to be safe keeps to its platform's limits in truth, reported with [`Note::Truth`]. In
    /// thousandths of each limit, negative beyond it.
    #[n(100)] Margins {
        #[n(0)] unit: UnitId,
        /// Margin of its motion to the platform's safe set.
        #[n(1)] safe: i32,
        /// Margin of its set-point to the same set.
        #[n(2)] asked: i32,
        /// Stored energy, beyond the reserve that the way to safety takes.
        #[n(3)] energy: i32,
        /// Distance to the surface below, beyond the least.
        #[n(4)] clearance: i32,
    },
    /// The guest's adapter carried out an attack on the guest's bus for one step, and its witness counted arrivals.
    #[n(102)] GuestBus {
        /// Number of the order in the run's plan.
        #[n(0)] order: u8,
        #[n(1)] attack: BusAttack,
        /// Messages that the attacker put on the bus.
        #[n(2)] sent: u16,
        /// Those of them that reached the attacked end.
        #[n(3)] received: u16,
        /// Messages of the honest sender that reached it.
        #[n(4)] honest: u16,
        /// True if the message in force at the end of the step is the attacker's.
        #[n(5)] in_force: bool,
        /// True if the attacked end refused them.
        #[n(6)] refused: bool,
    },
    /// An insider sends a report. Its identity marks the records of the session that are the insider's actions.
    #[n(55)] Claimed {
        #[n(0)] record: RecordId,
        /// Distance between the place in it and the true one, mm.
        #[n(1)] off_mm: u32,
    },
}

/// True if an entry's content with this number is a note; no event of a service has one of these numbers.
pub(crate) const fn is_note(number: u32) -> bool {
    matches!(number, 7..=10 | 15 | 16 | 25 | 26 | 28 | 29 | 40..=42 | 46 | 47 | 50 | 55 | 56 | 61 | 65..=70 | 87 | 92 | 98..=100 | 102)
}

/// Interval at which a message that a fault changes is reported while the fault lasts.
pub const ALTERED_EVERY: Span = Span::ms(1_000);
