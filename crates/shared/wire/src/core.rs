//! The few verbs every core speaks, and its inputs and outputs.
//!
//! A core is handed time and bytes and gives bytes back; it never reads a clock, a socket or a generator it did not
//! seed itself. A process feeds it from the operating system, the twin from an event queue, a replay from a file.
//! Moving the bytes belongs to `link` (live) and to `twin` (virtual).
//!
//! The contract: after `handle`, call `output` until it gives `None`, then wait for the next input or until
//! `deadline`, whichever is first. Time never goes backwards.

use minicbor::{Decode, Encode};
use strum::{EnumCount, IntoStaticStr, VariantArray};

use crate::codec::Text;
use crate::id::{PeerId, SessionId, UnitId};
use crate::time::{Instant, Span};

/// A channel between processes of one host, carried over shared memory.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Encode,
    Decode,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[cbor(index_only)]
#[serde(rename_all = "snake_case")]
#[derive(EnumCount, VariantArray, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Topic {
    /// Rendered sensor frames, sim to perception.
    #[n(0)]
    Frames,
    /// Candidate observations: from the detector stages, or from sim when the twin is unrendered.
    #[n(1)]
    Candidates,
    /// Odometry and localisation, sim to autonomy.
    #[n(2)]
    Navigation,
    /// Corroborated tracks, perception to autonomy.
    #[n(3)]
    Tracks,
    /// Leased set-points, autonomy to sim.
    #[n(4)]
    Drive,
    /// The abstract act, autonomy to sim.
    #[n(5)]
    Act,
    /// Messages that the gateway accepted, gateway to console.
    #[n(6)]
    Feed,
    /// Signed intents and stage confirmations, console to gateway.
    #[n(7)]
    Intents,
    /// The recorder's seals, back to the services that depend on them.
    #[n(8)]
    Seals,
}

impl Topic {
    /// Every topic, in wire order.
    pub const ALL: [Topic; Topic::COUNT] = *Topic::VARIANTS.first_chunk().expect("as many variants as it counts");

    /// The name used in service names, policies and logs.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Number of readers of one unit for which its producer tags each message, every one under a key that no other
    /// reader has: a reader of a channel must not be able to write it to another.
    pub fn readers(self) -> usize {
        match self {
            Topic::Navigation => 2,
            Topic::Frames
            | Topic::Candidates
            | Topic::Tracks
            | Topic::Drive
            | Topic::Act
            | Topic::Feed
            | Topic::Intents
            | Topic::Seals => 1,
        }
    }

    /// The largest message, in bytes, a channel of this topic is made for.
    pub fn max_len(self) -> usize {
        match self {
            Topic::Frames => 256 * 1024,
            Topic::Candidates => 8 * 1024,
            Topic::Navigation | Topic::Drive | Topic::Act | Topic::Seals => 512,
            Topic::Tracks => 4 * 1024,
            Topic::Feed | Topic::Intents => 2 * 1024,
        }
    }
}

/// A subject of the command plane (MQTT).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode)]
pub enum Subject {
    /// Commands to a unit: `hs/cmd/<unit>`.
    #[n(0)]
    Command(#[n(0)] UnitId),
    /// Acknowledgements from a unit: `hs/ack/<unit>`.
    #[n(1)]
    Ack(#[n(0)] UnitId),
}

impl Subject {
    /// The MQTT topic name of this subject.
    pub fn topic(self) -> String {
        match self {
            Subject::Command(unit) => format!("hs/cmd/{unit}"),
            Subject::Ack(unit) => format!("hs/ack/{unit}"),
        }
    }

    /// The subject with this MQTT topic name; `None` outside the table of units (only vehicles are subjects).
    pub fn from_topic(topic: &str) -> Option<Self> {
        let vehicle = |name| UnitId::from_name(name).filter(|unit| unit.node().unit().is_some());
        match topic.strip_prefix("hs/")?.split_once('/')? {
            ("cmd", name) => vehicle(name).map(Subject::Command),
            ("ack", name) => vehicle(name).map(Subject::Ack),
            _ => None,
        }
    }
}

/// Longest name of a step in [`Input::Cue`], bytes.
pub const MAX_CUE: usize = 24;

/// One side of a byte stream or datagram path that passes through a relay.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cbor(index_only)]
pub enum Side {
    /// The side that opened the path.
    #[n(0)]
    Client,
    /// The side that listens.
    #[n(1)]
    Server,
}

impl Side {
    /// The other side.
    pub fn opposite(self) -> Side {
        match self {
            Side::Client => Side::Server,
            Side::Server => Side::Client,
        }
    }
}

/// Inputs that wake a core.
#[derive(Clone, Debug, PartialEq, Eq, Encode, Decode)]
pub enum Input {
    /// The deadline that the core asked for has come.
    #[n(0)]
    Timeout,
    /// A message on a shared-memory channel.
    #[n(1)]
    Bus {
        /// Channel of the message.
        #[n(0)]
        topic: Topic,
        /// Sealed bus message (`wire::bus`).
        #[cbor(n(1), with = "minicbor::bytes")]
        bytes: Vec<u8>,
    },
    /// A secure session was established.
    #[n(2)]
    Opened {
        /// Local handle of the session.
        #[n(0)]
        session: SessionId,
        /// Peer that the handshake authenticated.
        #[n(1)]
        peer: PeerId,
    },
    /// An application record of a secure session.
    #[n(3)]
    Record {
        /// Local handle of the session.
        #[n(0)]
        session: SessionId,
        /// Decrypted record.
        #[cbor(n(1), with = "minicbor::bytes")]
        bytes: Vec<u8>,
    },
    /// A secure session has ended.
    #[n(4)]
    Closed {
        /// Local handle of the session.
        #[n(0)]
        session: SessionId,
    },
    /// A publication on the command plane. Only the signatures in the payload name the publisher.
    #[n(5)]
    Published {
        /// Subject of the publication.
        #[n(0)]
        subject: Subject,
        /// Payload of the publication.
        #[cbor(n(1), with = "minicbor::bytes")]
        bytes: Vec<u8>,
    },
    /// A datagram reached a relay from `side` (ciphertext).
    #[n(6)]
    Datagram {
        /// Peer that sent it.
        #[n(0)]
        side: Side,
        /// Bytes on the wire.
        #[cbor(n(1), with = "minicbor::bytes")]
        bytes: Vec<u8>,
    },
    /// A piece of a byte stream reached a relay from `side`; an empty piece is the end of that direction.
    #[n(7)]
    Stream {
        /// Local handle of the connection.
        #[n(0)]
        connection: SessionId,
        /// Peer that sent it.
        #[n(1)]
        side: Side,
        /// Bytes on the wire.
        #[cbor(n(2), with = "minicbor::bytes")]
        bytes: Vec<u8>,
    },
    /// An audit entry reached the recorder.
    #[n(8)]
    Audit {
        /// Encoded `wire::audit::Entry`.
        #[cbor(n(0), with = "minicbor::bytes")]
        bytes: Vec<u8>,
    },
    /// The run is over: stop sending, keep accounting for late arrivals.
    #[n(9)]
    Quiesce,
    /// Write the closing account; no input follows.
    #[n(10)]
    Finish,
    /// The event that a step of an attack or a fault waits for has come (adversaries and sensors only).
    #[n(40)]
    Cue {
        /// Name of the step.
        #[n(0)]
        step: Text<MAX_CUE>,
    },
    /// The service's session at the broker has ended, and not by the service: the session was cut, or another
    /// connection under the same certificate has taken it over. The dialler of the service dials again.
    #[n(41)]
    SessionLost,
    /// The host kept a service of the run waiting for a core so long, by the launcher's count (the console only, live
    /// only).
    #[n(42)]
    HostWait {
        /// Length of the wait.
        #[n(0)]
        wait: Span,
    },
    /// The guest answered (autonomy only).
    #[n(90)]
    Guest {
        /// Encoded [`crate::guest::Answer`].
        #[cbor(n(0), with = "minicbor::bytes")]
        bytes: Vec<u8>,
    },
    /// A person at the console did something (the console only).
    #[n(80)]
    Act {
        /// Encoded [`crate::person::Numbered`].
        #[cbor(n(0), with = "minicbor::bytes")]
        bytes: Vec<u8>,
    },
}

/// Outputs of a core.
#[derive(Clone, Debug, PartialEq, Eq, Encode, Decode)]
pub enum Output {
    /// Publish on a shared-memory channel.
    #[n(0)]
    Bus {
        /// Channel of the message.
        #[n(0)]
        topic: Topic,
        /// Sealed bus message.
        #[cbor(n(1), with = "minicbor::bytes")]
        bytes: Vec<u8>,
    },
    /// Send one record into a secure session.
    #[n(1)]
    Record {
        /// Local handle of the session.
        #[n(0)]
        session: SessionId,
        /// Record to be encrypted.
        #[cbor(n(1), with = "minicbor::bytes")]
        bytes: Vec<u8>,
    },
    /// Publish on the command plane.
    #[n(2)]
    Publish {
        /// Subject of the publication.
        #[n(0)]
        subject: Subject,
        /// Payload of the publication.
        #[cbor(n(1), with = "minicbor::bytes")]
        bytes: Vec<u8>,
    },
    /// Emit a datagram towards `side` (relay only).
    #[n(3)]
    Datagram {
        /// Side that receives the datagram.
        #[n(0)]
        side: Side,
        /// Bytes on the wire.
        #[cbor(n(1), with = "minicbor::bytes")]
        bytes: Vec<u8>,
    },
    /// Emit a piece of a byte stream towards `side` (relay only); an empty piece ends that direction.
    #[n(4)]
    Stream {
        /// Local handle of the connection.
        #[n(0)]
        connection: SessionId,
        /// Side that receives the bytes.
        #[n(1)]
        side: Side,
        /// Bytes on the wire.
        #[cbor(n(2), with = "minicbor::bytes")]
        bytes: Vec<u8>,
    },
    /// Cut a relayed stream in both directions at once.
    #[n(5)]
    Reset {
        /// Local handle of the connection.
        #[n(0)]
        connection: SessionId,
    },
    /// An encoded `wire::audit::Entry` for the instrument plane.
    #[n(6)]
    Audit {
        /// Encoded `wire::audit::Entry`.
        #[cbor(n(0), with = "minicbor::bytes")]
        bytes: Vec<u8>,
    },
    /// Display of the console, for a person at a terminal and for a program; never read by another core.
    #[n(7)]
    Text {
        /// UTF-8 without control characters other than newline.
        #[n(0)]
        text: String,
        /// The picture as one JSON object in one line.
        #[n(1)]
        picture: String,
    },
    /// End a secure session; the end that dialled it dials again.
    #[n(55)]
    Close {
        /// Local handle of the session.
        #[n(0)]
        session: SessionId,
    },
    /// Take a session on the command plane, under the certificate that the process has (adversaries only; services are
    /// connected from their start).
    #[n(41)]
    Join,
    /// Give that session up.
    #[n(42)]
    Leave,
    /// Ask the guest (autonomy only). One request is under way at a time.
    #[n(90)]
    Guest {
        /// Encoded [`crate::guest::Request`].
        #[cbor(n(0), with = "minicbor::bytes")]
        bytes: Vec<u8>,
    },
    /// Emit a datagram towards the server from a source address of the relay's own, which no session knows and no
    /// credential covers (relay only).
    #[n(8)]
    Stranger {
        /// Bytes on the wire.
        #[cbor(n(0), with = "minicbor::bytes")]
        bytes: Vec<u8>,
    },
}

/// A deterministic service core.
pub trait Core {
    /// Take one input at local time `now`.
    fn handle(&mut self, now: Instant, input: &Input);

    /// Time at which the core next wants [`Input::Timeout`]; `None` while it only waits for input.
    fn deadline(&self) -> Option<Instant>;

    /// The next output, until `None`.
    fn output(&mut self) -> Option<Output>;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subjects_and_topics_convert_both_ways() {
        for unit in [UnitId::A, UnitId::B, UnitId::C] {
            for subject in [Subject::Command(unit), Subject::Ack(unit)] {
                assert_eq!(Subject::from_topic(&subject.topic()), Some(subject));
            }
        }
        for topic in ["", "hs/cmd/", "hs/cmd/unit-a/x", "hs/ack/nobody", "hs/cmd/+", "#", "$SYS/x", "hs/CMD/unit-a"] {
            assert_eq!(Subject::from_topic(topic), None, "{topic}");
        }
    }
}
