//! The model of the command path between a unit and the broker: TLS-like records over a byte stream, without sockets.
//!
//! A stream keeps its order and loses no byte while it stands; held bytes hold back all behind them. Each end takes
//! whole records, authenticated under keys that follow from both hellos as that end saw them: one changed bit, in a
//! hello or later, and the end that finds it refuses the stream and hangs up. An ended connection takes with it the
//! bytes under way; the client dials again after the pauses of the live client and a session starts clean. An attacker
//! without a key can hold, cut and damage: the adversary's stream relay, the same core as live, is in between.
//!
//! Left out, each with a live row: the certificates (both ends are who they are), TCP's windows and retransmission, the
//! broker's own limit on silence (7.5 s) and its bounded queues.

use std::collections::VecDeque;

use ground_truth::StreamPlace;
use wire::codec;
use wire::core::{Input, Side, Subject};
use wire::id::SessionId;

use super::records::mask;

/// Type, version, length.
const HEADER: usize = 5;
const TAG: usize = 16;
const HELLO: usize = 160;
const HANDSHAKE: u8 = 22;
const APPLICATION_DATA: u8 = 23;
/// The longest body of a record, as TLS has it.
const MAX_BODY: usize = (1 << 14) + 256;
/// Publications that wait for a session at the client.
const WAITING: usize = link::mqtt::OUTBOUND;

/// Kind of a record's content.
const CONNECT: u8 = 0;
const CONNACK: u8 = 1;
const PUBLISH: u8 = 2;
const PUBACK: u8 = 3;
const PING: u8 = 4;
const PONG: u8 = 5;

/// Response of an end to an arrival.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Effect {
    /// The end at this side writes bytes.
    Write(Side, Vec<u8>),
    /// A publication was delivered at this side.
    Published(Side, Subject, Vec<u8>),
    /// The client asks the broker for its session.
    Connects,
    /// The client's session stands.
    Up,
    /// The secure layer at this side refuses a record, and hangs up.
    Refused(Side),
}

/// An end of a connection.
#[derive(Clone, Debug, Default)]
struct End {
    open: bool,
    /// The hello it sent and the one that came.
    hellos: [Vec<u8>; 2],
    keys: Option<[[u8; 32]; 2]>,
    sent: u64,
    got: u64,
    buffer: Vec<u8>,
    place: StreamPlace,
}

/// The connection of one client to the broker, and the state that outlives it.
#[derive(Clone, Debug)]
pub struct Stream {
    /// Number of the present connection, from 1.
    pub connection: u32,
    /// True if the client's session stands.
    pub up: bool,
    /// Pings that were not answered yet.
    pub unanswered: u32,
    waiting: VecDeque<(Subject, Vec<u8>)>,
    /// Publications for which there was no room.
    pub lost: u64,
    ends: [End; 2],
    secret: [u8; 32],
}

impl Stream {
    /// A client that has yet to dial.
    pub fn new(secret: [u8; 32]) -> Self {
        Self {
            connection: 0,
            up: false,
            unanswered: 0,
            waiting: VecDeque::new(),
            lost: 0,
            ends: Default::default(),
            secret,
        }
    }

    /// The connection as the relay names it.
    pub fn session(&self) -> SessionId {
        SessionId(self.connection)
    }

    /// Begins a new connection with the client's hello.
    pub fn dial(&mut self) -> Vec<u8> {
        self.connection += 1;
        (self.up, self.unanswered) = (false, 0);
        self.ends = [(); 2].map(|()| End { open: true, ..End::default() });
        self.hello(Side::Client)
    }

    fn hello(&mut self, side: Side) -> Vec<u8> {
        let mut noise = blake3::Hasher::new_keyed(&self.secret);
        noise.update(&self.connection.to_le_bytes()).update(&[side as u8]);
        let mut body = vec![0; HELLO];
        noise.finalize_xof().fill(&mut body);
        self.ends[side as usize].hellos[0].clone_from(&body);
        record(HANDSHAKE, &body)
    }

    /// True if the end at `side` of the present connection is open.
    pub fn open(&self, side: Side) -> bool {
        self.ends[side as usize].open
    }

    /// Name of the direction towards `side`, and how many of its bytes have arrived.
    pub fn place(&self, side: Side) -> &StreamPlace {
        &self.ends[side as usize].place
    }

    /// The end at `side` is over. True when it was open.
    pub fn close(&mut self, side: Side) -> bool {
        self.up &= side != Side::Client;
        std::mem::take(&mut self.ends[side as usize].open)
    }

    /// Seals a publication of the end at `side`, or keeps the client's until a session stands. The broker's, without a
    /// session, is lost.
    pub fn publish(&mut self, side: Side, subject: Subject, bytes: Vec<u8>) -> Option<Vec<u8>> {
        let ready = match side {
            Side::Client => self.up,
            Side::Server => self.held(),
        };
        if ready {
            return self.seal(side, PUBLISH, &codec::encode(&Input::Published { subject, bytes }));
        }
        if side == Side::Client && self.waiting.len() < WAITING {
            self.waiting.push_back((subject, bytes));
        } else {
            self.lost += 1;
        }
        None
    }

    /// True if the broker has a session over this connection.
    pub fn held(&self) -> bool {
        self.open(Side::Server) && self.ends[Side::Server as usize].got > 0
    }

    /// The client asks whether the broker is there.
    pub fn ping(&mut self) -> Option<Vec<u8>> {
        self.unanswered += 1;
        self.seal(Side::Client, PING, &[])
    }

    fn seal(&mut self, side: Side, kind: u8, content: &[u8]) -> Option<Vec<u8>> {
        let end = &mut self.ends[side as usize];
        let key = end.keys.map(|keys| keys[side as usize])?;
        end.sent += 1;
        let mut body = vec![kind];
        body.extend_from_slice(content);
        mask(&key, end.sent, &mut body);
        let tag = tag(&key, end.sent, &body);
        body.extend_from_slice(&tag);
        Some(record(APPLICATION_DATA, &body))
    }

    /// Bytes came to the open end at `side`.
    pub fn arrive(&mut self, side: Side, bytes: &[u8]) -> Vec<Effect> {
        let end = &mut self.ends[side as usize];
        end.place.pass(bytes);
        end.buffer.extend_from_slice(bytes);
        let mut effects = Vec::new();
        while self.ends[side as usize].open {
            match self.next(side) {
                Ok(Some((kind, body))) => match self.take(side, kind, body) {
                    Some(more) => effects.extend(more),
                    None => return self.refuse(side, effects),
                },
                Ok(None) => break,
                Err(()) => return self.refuse(side, effects),
            }
        }
        effects
    }

    fn refuse(&mut self, side: Side, mut effects: Vec<Effect>) -> Vec<Effect> {
        self.ends[side as usize].buffer.clear();
        effects.push(Effect::Refused(side));
        effects
    }

    /// The next whole record, if there is one; an error when there can be none.
    fn next(&mut self, side: Side) -> Result<Option<(u8, Vec<u8>)>, ()> {
        let buffer = &mut self.ends[side as usize].buffer;
        let Some(header) = buffer.first_chunk::<HEADER>() else { return Ok(None) };
        let (kind, length) = (header[0], usize::from(u16::from_be_bytes([header[3], header[4]])));
        if !matches!(kind, HANDSHAKE | APPLICATION_DATA) || header[1..3] != [3, 3] || length > MAX_BODY {
            return Err(());
        }
        if buffer.len() < HEADER + length {
            return Ok(None);
        }
        let rest = buffer.split_off(HEADER + length);
        let mut whole = std::mem::replace(buffer, rest);
        Ok(Some((kind, whole.split_off(HEADER))))
    }

    /// Result of a record; none when the secure layer refuses it.
    fn take(&mut self, side: Side, kind: u8, body: Vec<u8>) -> Option<Vec<Effect>> {
        if kind == HANDSHAKE {
            return self.greeted(side, body);
        }
        let end = &mut self.ends[side as usize];
        let key = end.keys?[side.opposite() as usize];
        let (sealed, tagged) = body.split_at_checked(body.len().checked_sub(TAG)?)?;
        end.got += 1;
        if tag(&key, end.got, sealed) != *tagged {
            return None;
        }
        let mut plain = sealed.to_vec();
        mask(&key, end.got, &mut plain);
        let (kind, content) = plain.split_first()?;
        let answer = |sealed: Option<Vec<u8>>| sealed.map(|bytes| Effect::Write(side, bytes)).into_iter().collect();
        match (*kind, side) {
            (CONNECT, Side::Server) => {
                let mut effects: Vec<Effect> = answer(self.seal(side, CONNACK, &[]));
                effects.push(Effect::Connects);
                Some(effects)
            }
            (CONNACK, Side::Client) => Some(self.stand()),
            (PUBLISH, _) => {
                let Ok(Input::Published { subject, bytes }) = minicbor::decode(content) else { return None };
                let mut effects: Vec<Effect> = answer(self.seal(side, PUBACK, &[]));
                effects.push(Effect::Published(side, subject, bytes));
                Some(effects)
            }
            (PUBACK, _) => Some(Vec::new()),
            (PING, Side::Server) => Some(answer(self.seal(side, PONG, &[]))),
            (PONG, Side::Client) => {
                self.unanswered = 0;
                Some(Vec::new())
            }
            _ => None,
        }
    }

    /// A hello came. Both ends derive the keys from both hellos, each from those it saw.
    fn greeted(&mut self, side: Side, body: Vec<u8>) -> Option<Vec<Effect>> {
        if self.ends[side as usize].keys.is_some() || body.len() != HELLO {
            return None;
        }
        let mut effects = Vec::new();
        if side == Side::Server {
            effects.push(Effect::Write(side, self.hello(side)));
        }
        let end = &mut self.ends[side as usize];
        end.hellos[1] = body;
        let [own_bytes, other] = &end.hellos;
        let (client, server) = if side == Side::Client { (own_bytes, other) } else { (other, own_bytes) };
        let key = |from: u8| {
            let mut key = blake3::Hasher::new_keyed(&self.secret);
            key.update(client).update(server).update(&[from]);
            *key.finalize().as_bytes()
        };
        end.keys = Some([key(Side::Client as u8), key(Side::Server as u8)]);
        if side == Side::Client {
            effects.extend(self.seal(side, CONNECT, &[]).map(|bytes| Effect::Write(side, bytes)));
        }
        Some(effects)
    }

    /// The session stands: the waiting bytes go out.
    fn stand(&mut self) -> Vec<Effect> {
        self.up = true;
        let mut effects = vec![Effect::Up];
        for (subject, bytes) in std::mem::take(&mut self.waiting) {
            effects.extend(self.publish(Side::Client, subject, bytes).map(|bytes| Effect::Write(Side::Client, bytes)));
        }
        effects
    }
}

fn record(kind: u8, body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![kind, 3, 3];
    bytes.extend_from_slice(&(body.len() as u16).to_be_bytes());
    bytes.extend_from_slice(body);
    bytes
}

fn tag(key: &[u8; 32], number: u64, body: &[u8]) -> [u8; TAG] {
    let mut tag = blake3::Hasher::new_keyed(key);
    tag.update(&number.to_le_bytes()).update(body);
    let mut short = [0; TAG];
    tag.finalize_xof().fill(&mut short);
    short
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::id::UnitId;

    /// Carries the ends' writes across, `change` in between, until both are silent; gives the rest of the effects.
    fn carry(stream: &mut Stream, first: Vec<Effect>, change: &mut dyn FnMut(&mut Vec<u8>)) -> Vec<Effect> {
        let (mut under_way, mut rest) = (VecDeque::from(first), Vec::new());
        while let Some(effect) = under_way.pop_front() {
            if let Effect::Write(side, mut bytes) = effect {
                change(&mut bytes);
                under_way.extend(stream.arrive(side.opposite(), &bytes));
            } else {
                rest.push(effect);
            }
        }
        rest
    }

    fn order() -> (Subject, Vec<u8>) {
        (Subject::Command(UnitId::A), b"hold".to_vec())
    }

    fn standing() -> Stream {
        let mut stream = Stream::new([7; 32]);
        let hello = stream.dial();
        assert_eq!(
            carry(&mut stream, vec![Effect::Write(Side::Client, hello)], &mut |_| ()),
            [Effect::Connects, Effect::Up]
        );
        stream
    }

    #[test]
    fn publications_arrive_whole_under_any_cutting() {
        let mut stream = standing();
        let (subject, bytes) = order();
        let sealed = stream.publish(Side::Server, subject, bytes.clone()).expect("a session stands");
        let effects: Vec<Effect> = sealed.iter().flat_map(|byte| stream.arrive(Side::Client, &[*byte])).collect();
        assert!(effects.contains(&Effect::Published(Side::Client, subject, bytes)), "{effects:?}");
    }

    #[test]
    fn flipped_bit_ends_stream_and_delivers_nothing() {
        let whole = standing().publish(Side::Server, order().0, order().1).expect("a session stands");
        for bit in 0..whole.len() * 8 {
            let mut stream = standing();
            let mut sealed = stream.publish(Side::Server, order().0, order().1).expect("a session stands");
            sealed[bit / 8] ^= 1 << (bit % 8);
            let effects = stream.arrive(Side::Client, &sealed);
            // A longer length leaves the end waiting for bytes; the next record that comes is taken for the rest.
            let more = stream.publish(Side::Server, order().0, vec![0; 9_000]).expect("still open there");
            let refused = [effects, stream.arrive(Side::Client, &more), stream.arrive(Side::Client, &more)].concat();
            assert!(refused.contains(&Effect::Refused(Side::Client)), "bit {bit}");
            assert!(!refused.iter().any(|e| matches!(e, Effect::Published(_, _, b) if *b == order().1)), "bit {bit}");
        }
    }

    #[test]
    fn flipped_bit_in_hello_prevents_session() {
        for hello in 0..2 {
            let mut stream = Stream::new([7; 32]);
            let first = stream.dial();
            let mut n = 0;
            let effects = carry(&mut stream, vec![Effect::Write(Side::Client, first)], &mut |bytes| {
                if n == hello {
                    bytes[60] ^= 1;
                }
                n += 1;
            });
            assert_eq!(effects, [Effect::Refused(Side::Server)], "hello {hello}");
        }
    }

    #[test]
    fn client_keeps_unsent_publications_broker_does_not() {
        let mut stream = Stream::new([7; 32]);
        let (subject, bytes) = order();
        assert_eq!(stream.publish(Side::Server, subject, bytes.clone()), None);
        assert_eq!(stream.publish(Side::Client, subject, bytes.clone()), None);
        assert_eq!(stream.lost, 1);
        let hello = stream.dial();
        let effects = carry(&mut stream, vec![Effect::Write(Side::Client, hello)], &mut |_| ());
        assert_eq!(effects, [Effect::Connects, Effect::Up, Effect::Published(Side::Server, subject, bytes)]);
    }
}
