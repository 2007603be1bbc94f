//! Identities. Two of them are deliberately different types: [`PeerId`] is who the session authenticated, [`NodeId`]
//! is who a record says it is. The project's central finding lives in the gap between them, so there is no `From`
//! between the two; comparing them is the business of `trust::attribution` alone. So a peer gives away neither name nor
//! number, by which a node could be found: it can be printed, and distinguished from other peers.

use core::fmt;

use minicbor::{Decode, Encode};

mod names;

pub use names::NODES;
use names::{GUARDS, GUARDS_END, NAMES, UNITS, UNITS_END};

macro_rules! name_id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Encode)]
        #[cbor(transparent)]
        pub struct $name(#[n(0)] u8);

        impl $name {
            /// The identity with this name, or `None` when the name is not in the table.
            pub fn from_name(name: &str) -> Option<Self> {
                names::number(name).map(Self)
            }
        }

        impl<'b, C> Decode<'b, C> for $name {
            fn decode(d: &mut minicbor::Decoder<'b>, _: &mut C) -> Result<Self, minicbor::decode::Error> {
                let n = d.u8()?;
                if names::is_assigned(n) {
                    Ok(Self(n))
                } else {
                    Err(minicbor::decode::Error::message("identity outside the table"))
                }
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(NAMES[self.0 as usize])
            }
        }

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "{}({self})", stringify!($name))
            }
        }

        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
                s.serialize_str(NAMES[self.0 as usize])
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
                let name = <std::borrow::Cow<'de, str>>::deserialize(d)?;
                Self::from_name(&name).ok_or_else(|| serde::de::Error::custom(format!("unknown identity `{name}`")))
            }
        }
    };
}

name_id! {
    /// Peer that a handshake authenticated: the subject of the certificate, `urn:holdsafe:<name>`.
    PeerId
}
name_id! {
    /// Node that a record or log entry says it is from. A claim until `trust::attribution` has tied it to evidence.
    NodeId
}
name_id! {
    /// A vehicle, as the subject of a command or of an accepted state. One unit has one node.
    UnitId
}

impl NodeId {
    /// Unit A, the platform under test.
    pub const UNIT_A: NodeId = NodeId(0);
    /// Unit B, a teammate.
    pub const UNIT_B: NodeId = NodeId(1);
    /// Unit C, a third unit.
    pub const UNIT_C: NodeId = NodeId(2);
    /// The simulation.
    pub const SIM: NodeId = NodeId(4);
    /// Perception of the platform under test.
    pub const PERCEPTION: NodeId = NodeId(5);
    /// The gateway.
    pub const GATEWAY: NodeId = NodeId(6);
    /// The command broker.
    pub const BROKER: NodeId = NodeId(7);
    /// The supervisory console.
    pub const CONSOLE: NodeId = NodeId(8);
    /// The recorder.
    pub const RECORDER: NodeId = NodeId(9);
    /// The datagram relay on the telemetry link.
    pub const RELAY_TELEMETRY: NodeId = NodeId(10);
    /// The stream relay on the command link.
    pub const RELAY_COMMAND: NodeId = NodeId(11);
    /// The insider who holds teammate B's credentials.
    pub const INSIDER_B: NodeId = NodeId(12);
    /// The first operator.
    pub const OPERATOR: NodeId = NodeId(13);
    /// The second operator: admitted in every run; in runs of some scenarios a rogue holds its key.
    pub const OPERATOR_2: NodeId = NodeId(14);
    /// The campaign engine or launcher itself.
    pub const CAMPAIGN: NodeId = NodeId(15);
    /// Signer of revocations: the launcher's, used once before the first service starts.
    pub const AUTHORITY: NodeId = NodeId::CAMPAIGN;
    /// Perception of the third unit.
    pub const PERCEPTION_C: NodeId = NodeId(20);
    /// The third unit's simulation.
    pub const SIM_C: NodeId = NodeId(21);
    /// The rogue station: gives orders under a key that is not its own.
    pub const INSIDER_OPERATOR: NodeId = NodeId(24);
    /// The insider who holds the broker's credentials.
    pub const INSIDER_BROKER: NodeId = NodeId(25);
    /// The insider who holds the gateway's keys.
    pub const INSIDER_GATEWAY: NodeId = NodeId(26);
    /// The insider with perception's keys and place.
    pub const INSIDER_PERCEPTION: NodeId = NodeId(27);
    /// The insider who controls the recorder.
    pub const INSIDER_RECORDER: NodeId = NodeId(28);
    /// An impostor: takes the place of another on a host's shared memory, or its session at the broker.
    pub const IMPOSTOR: NodeId = NodeId(30);

    /// Observer at the ingress of this node's secure sessions, which logs arrivals, when the node has one: the record
    /// filter of datagrams; at the broker, which has streams only, the observer of their bytes.
    pub const fn guard(self) -> Option<NodeId> {
        match self {
            NodeId::BROKER => Some(NodeId(23)),
            NodeId::GATEWAY => Some(NodeId(16)),
            NodeId::UNIT_A => Some(NodeId(17)),
            NodeId::UNIT_B | NodeId::INSIDER_B => Some(NodeId(18)),
            NodeId::UNIT_C => Some(NodeId(19)),
            NodeId(number @ UNITS..UNITS_END) => Some(NodeId(number - UNITS + GUARDS)),
            NodeId(_) => None,
        }
    }

    /// True if it is the observer at the ingress of a node's secure sessions ([`NodeId::guard`]).
    pub fn is_mouth(self) -> bool {
        matches!(self.0, 16..=19 | 23) || (GUARDS..GUARDS_END).contains(&self.0)
    }

    /// True if it holds a place or credentials in the platform and misuses them: its own statements of sending need
    /// confirmation by the receiver's ingress observer.
    pub fn is_insider(self) -> bool {
        matches!(self.0, 12 | 22 | 24..=28 | 30)
    }

    /// The name, as in scenario files and logs.
    pub fn name(self) -> &'static str {
        NAMES[self.0 as usize]
    }

    /// Every identity of the table, in the order of their numbers.
    pub fn all() -> impl Iterator<Item = NodeId> {
        (0..=u8::MAX).filter(|number| names::is_assigned(*number)).map(NodeId)
    }

    /// Number in the table of identities.
    pub fn index(self) -> usize {
        self.0 as usize
    }

    /// The node with a number of the table: of a peer's, by `trust::attribution` alone.
    pub(crate) fn numbered(number: u8) -> NodeId {
        NodeId(number)
    }

    /// The unit this node speaks for, when it is one.
    pub fn unit(self) -> Option<UnitId> {
        (self.0 < 4 || (UNITS..UNITS_END).contains(&self.0)).then_some(UnitId(self.0))
    }
}

impl PeerId {
    /// The gateway's certificate.
    pub const GATEWAY: PeerId = PeerId(6);
    /// The command broker's certificate.
    pub const BROKER: PeerId = PeerId(7);
    /// Unit A's certificate.
    pub const UNIT_A: PeerId = PeerId(0);
    /// Unit B's certificate.
    pub const UNIT_B: PeerId = PeerId(1);
    /// Unit C's certificate.
    pub const UNIT_C: PeerId = PeerId(2);

    /// The subject alternative name in this peer's certificate.
    pub fn uri(self) -> String {
        format!("urn:holdsafe:{self}")
    }

    /// Number in the table of identities, for `trust::attribution` alone.
    pub(crate) fn number(self) -> u8 {
        self.0
    }

    /// Reads the subject alternative name of a certificate.
    pub fn from_uri(uri: &str) -> Option<Self> {
        uri.strip_prefix("urn:holdsafe:").and_then(Self::from_name)
    }
}

impl UnitId {
    /// The platform under test.
    pub const A: UnitId = UnitId(0);
    /// The teammate.
    pub const B: UnitId = UnitId(1);
    /// The third unit.
    pub const C: UnitId = UnitId(2);

    /// The name, as in scenario files and logs.
    pub fn name(self) -> &'static str {
        NAMES[self.0 as usize]
    }

    /// Every unit of the table, in the order of their numbers.
    pub fn all() -> impl Iterator<Item = UnitId> {
        (0..4).chain(UNITS..UNITS_END).map(UnitId)
    }

    /// The node that speaks for this unit.
    pub fn node(self) -> NodeId {
        NodeId(self.0)
    }

    /// The certificate of that node.
    pub fn peer(self) -> PeerId {
        PeerId(self.0)
    }
}

/// A table with one `T` for each peer.
#[derive(Debug)]
pub struct ByPeer<T>([T; NODES]);

impl<T> ByPeer<T> {
    /// A table with one value of `make` for each peer.
    pub fn new(mut make: impl FnMut() -> T) -> Self {
        Self(core::array::from_fn(|_| make()))
    }
}

impl<T> core::ops::Index<PeerId> for ByPeer<T> {
    type Output = T;

    fn index(&self, peer: PeerId) -> &T {
        &self.0[usize::from(peer.0)]
    }
}

/// Local handle of a secure session or relayed connection; never sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode)]
#[cbor(transparent)]
pub struct SessionId(#[n(0)] pub u32);

/// Counts the starts of a node; only ever rises.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Encode,
    Decode,
    serde::Serialize,
    serde::Deserialize,
)]
#[cbor(transparent)]
pub struct Boot(#[n(0)] pub u32);

/// Sequence number within one boot, from 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize)]
#[cbor(transparent)]
pub struct Sequence(#[n(0)] pub u64);

impl Sequence {
    /// The number after this one.
    pub fn next(self) -> Sequence {
        Sequence(self.0.saturating_add(1))
    }
}

/// An unguessable number that a receiver issues and a sender repeats. It has no default, so that none is made up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode)]
#[cbor(transparent)]
pub struct Nonce(#[n(0)] pub u64);

impl Nonce {
    /// Stands on the wire where none is known yet.
    pub const NONE: Nonce = Nonce(0);
}

/// A record, wherever it travels: (node, boot, sequence).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize)]
pub struct RecordId {
    /// Claimed maker of the record.
    #[n(0)]
    pub node: NodeId,
    /// Boot of the maker.
    #[n(1)]
    pub boot: Boot,
    /// Sequence of the record within the boot.
    #[n(2)]
    pub sequence: Sequence,
}

impl fmt::Display for RecordId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}/{}", self.node, self.boot.0, self.sequence.0)
    }
}

macro_rules! count_id {
    ($(#[$doc:meta])* $name:ident($inner:ty)) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize, serde::Deserialize)]
        #[cbor(transparent)]
        pub struct $name(#[n(0)] pub $inner);
    };
}

count_id! {
    /// A set of sensor readings taken at one instant.
    FrameId(u64)
}
count_id! {
    /// A track of the platform's tracker; never reused within a boot.
    TrackId(u32)
}
count_id! {
    /// A true object of the simulated world; ground truth only.
    ObjectId(u16)
}
count_id! {
    /// A world of the twin; a fork makes a new one. Live runs have world 0.
    WorldId(u64)
}

/// A command of one operator: (operator, boot, sequence); the idempotency key of the command plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize)]
pub struct CommandId {
    /// Operator whose key signed it.
    #[n(0)]
    pub operator: NodeId,
    /// Boot of the console.
    #[n(1)]
    pub boot: Boot,
    /// Sequence within the boot, from 1.
    #[n(2)]
    pub sequence: Sequence,
}

impl fmt::Display for CommandId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}/{}", self.operator, self.boot.0, self.sequence.0)
    }
}
