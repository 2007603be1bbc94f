//! Messages of unit, gateway and operator in a trial with an observer: real messages, signed with real keys, and the
//! list of their secret parts.

use minicbor::bytes::ByteSlice;
use rand_chacha::ChaCha8Rng;
use rand_core::RngCore;
use sha2::{Digest, Sha256};
use wire::codec::{self, Text};
use wire::command::{Ack, CommandKind, Confirmation, Intent, Order};
use wire::core::Subject;
use wire::id::{Boot, CommandId, NodeId, Nonce, RecordId, Sequence, TrackId, UnitId};
use wire::mode::Mode;
use wire::report::{Report, ReportedAuthority, ReportedTrack};
use wire::sensor::{Class, Modalities, Modality, Pose};
use wire::session::{SESSION_VERSION, SessionBody, SessionMessage};
use wire::sign::{Key, Purpose};
use wire::time::{Echo, PeerStamp, Span};

/// Number of records each way, and of orders with their acknowledgements.
const TURNS: u64 = 8;

/// Something that must not be read on a link.
#[derive(Clone, Debug)]
pub(super) struct Mark {
    /// Name in the findings.
    pub(super) what: String,
    /// Its bytes.
    pub(super) bytes: Vec<u8>,
}

impl Mark {
    pub(super) fn new(name: impl Into<String>, bytes: impl Into<Vec<u8>>) -> Self {
        Self { what: name.into(), bytes: bytes.into() }
    }
}

/// Speakers with their signing keys.
pub(super) struct Speakers {
    unit: UnitId,
    secrets: [[u8; 32]; 2],
    rng: ChaCha8Rng,
}

impl Speakers {
    pub(super) fn new(unit: UnitId, mut rng: ChaCha8Rng) -> Self {
        let mut secrets = [[0; 32]; 2];
        secrets.iter_mut().for_each(|secret| rng.fill_bytes(secret));
        Self { unit, secrets, rng }
    }

    /// The signing keys of unit and operator.
    pub(super) fn keys(&self) -> Vec<Mark> {
        let named = ["the unit's signing key", "the operator's signing key"];
        named.iter().zip(&self.secrets).map(|(name, secret)| Mark::new(*name, *secret)).collect()
    }

    /// A key of a channel in shared memory.
    pub(super) fn channel_key(&mut self) -> [u8; 32] {
        let mut key = [0; 32];
        self.rng.fill_bytes(&mut key);
        key
    }

    /// Records of a session, a pair of one from the unit and one from the gateway at a time, and their marks.
    pub(super) fn session(&mut self) -> (Vec<[Vec<u8>; 2]>, Vec<Mark>) {
        let (mut pairs, mut marks) = (Vec::new(), Vec::new());
        for turn in 1..=TURNS {
            let nonce = self.nonce();
            let report = self.signed(turn, nonce);
            let teammate = wire::session::Teammate {
                via: wire::id::PeerId::UNIT_C,
                age: Span::ms(40 + turn),
                report: <&ByteSlice>::from(&report[..]),
            };
            let (up, down) = match turn {
                1 => (SessionBody::Hello(nonce), SessionBody::Hello(self.nonce())),
                n if n % 2 == 0 => {
                    (SessionBody::Report(<&ByteSlice>::from(&report[..])), SessionBody::Grant(Span::ms(450)))
                }
                _ => (SessionBody::Report(<&ByteSlice>::from(&report[..])), SessionBody::Teammate(teammate)),
            };
            let pair = [self.session_message(turn, up), self.session_message(turn, down)];
            marks.push(Mark::new(format!("record {turn} of the unit"), pair[0].clone()));
            marks.push(Mark::new(format!("record {turn} of the gateway"), pair[1].clone()));
            if turn > 1 {
                marks.push(Mark::new(format!("signed report {turn}"), report.clone()));
                marks.push(Mark::new(format!("command nonce {turn}"), nonce.0.to_be_bytes()));
            }
            pairs.push(pair);
        }
        (pairs, marks)
    }

    /// Orders and their acknowledgements, in turn, and their marks.
    pub(super) fn commands(&mut self) -> (Vec<(Subject, Vec<u8>)>, Vec<Mark>) {
        let (mut messages, mut marks) = (Vec::new(), Vec::new());
        for turn in 1..=TURNS {
            let nonce = self.nonce();
            let reason = format!("reason {turn}: the north gate is clear");
            let id = CommandId { operator: NodeId::OPERATOR, boot: Boot(1), sequence: Sequence(turn) };
            let kind = if turn % 2 == 1 { CommandKind::Arm(TrackId(turn as u32)) } else { CommandKind::Hold };
            let intent =
                Intent { id, unit: self.unit, nonce, kind, reason: Text::new(&reason), tag: None, shown: None };
            let operator = Key::from_bytes(&self.secrets[1]);
            let intent = operator.sign(Purpose::Intent, &codec::encode(&intent));
            let hash: [u8; 32] = Sha256::digest(&intent).into();
            let second = operator.sign(Purpose::Confirmation, &codec::encode(&Confirmation { id, intent: hash }));
            let order = codec::encode(&Order {
                intent: <&ByteSlice>::from(&intent[..]),
                confirmation: (turn % 2 == 1).then_some(<&ByteSlice>::from(&second[..])),
            });
            let ack = Ack { id, intent: hash, refused: None, mode: Mode::Ready, due: None };
            let ack = Key::from_bytes(&self.secrets[0]).sign(Purpose::Ack, &codec::encode(&ack));
            marks.push(Mark::new(format!("order {turn}"), order.clone()));
            marks.push(Mark::new(format!("reason {turn}"), reason));
            marks.push(Mark::new(format!("nonce of order {turn}"), nonce.0.to_be_bytes()));
            marks.push(Mark::new(format!("acknowledgement {turn}"), ack.clone()));
            messages.extend([(Subject::Command(self.unit), order), (Subject::Ack(self.unit), ack)]);
        }
        (messages, marks)
    }

    /// Eight bytes of CBOR each, so that it can be distinguished.
    fn nonce(&mut self) -> Nonce {
        Nonce(self.rng.next_u64() | 1 << 63)
    }

    fn session_message(&mut self, turn: u64, body: SessionBody<'_>) -> Vec<u8> {
        let stamp = PeerStamp(1_000_000_000 + turn * 100_000);
        codec::encode(&SessionMessage {
            version: SESSION_VERSION,
            session: self.nonce(),
            boot: Boot(1),
            sequence: Sequence(turn),
            stamp,
            challenge: self.nonce(),
            echo: Some(Echo { nonce: self.nonce(), seen: stamp }),
            body,
        })
    }

    /// A report with values that differ from turn to turn, signed.
    fn signed(&mut self, turn: u64, command_nonce: Nonce) -> Vec<u8> {
        let (draw, n) = (self.rng.next_u32() as i32 % 100_000, turn as i32);
        let track = |id: i32| ReportedTrack {
            id: TrackId(id as u32),
            class: Class::Vehicle,
            x_mm: draw + id,
            y_mm: -draw - id,
            confidence: 900,
            supported: Modalities::default().with_modality(Modality::Rgb).with_modality(Modality::Lidar),
            age: Span::ms(30),
            contradicted: Modalities::default(),
            bearings_mrad: 0,
            across_px: 24,
        };
        let report = Report {
            mode: Mode::PrepareToAct,
            pose: Pose { x_mm: draw, y_mm: draw / 2, yaw_mrad: 700 },
            speed_mm_s: 1_500 + n,
            pose_age: Span::ms(20),
            authority: Some(ReportedAuthority { track: TrackId(1), left: Span::ms(1_900) }),
            command_nonce,
            progress: 300,
            tracks: (1..=n % 8).map(track).collect(),
            watched: Some(Echo { nonce: self.nonce(), seen: PeerStamp(1_000_000_000) }),
            ..Report::bare(
                RecordId { node: self.unit.node(), boot: Boot(1), sequence: Sequence(turn) },
                PeerStamp(1_000_000_000 + turn * 100_000),
            )
        };
        Key::from_bytes(&self.secrets[0]).sign(Purpose::Report, &codec::encode(&report))
    }
}
