//! The model of the secure telemetry link: DTLS associations as bytes on a wire, without sockets.
//!
//! A datagram has the DTLS 1.2 record header, a ciphertext and a tag; without a key only lengths, epochs and sequence
//! numbers can be seen. The record filter is the real one's judgement (`link::guard`). The model behind it acts as the
//! real stack does: one suite of properties runs over both (`tests/properties/conformance`), and
//! `docs/developer/link-model.md` lists where they still differ, and in which direction.

use ground_truth::GuardVerdict;
use link::dtls::MAX_RECORD;
use link::guard::record::{ALERT, APPLICATION_DATA, HANDSHAKE, RawRecord, Split, split};
use link::guard::{GuardMode, RESENDS};
use wire::id::{PeerId, SessionId};
use wire::policy::Requirement;

use super::flights::{FLIGHTS, Flights};
use super::queue::{Micros, NodeIndex};
use super::records::Open;

/// The body of a close_notify (RFC 5246 §7.2.1): a warning, and its number.
const CLOSE_NOTIFY: [u8; 2] = [1, 0];
/// Distance from one handshake's handle of a session to the next one's: more than there are associations.
const HANDLES: u32 = 256;

/// An end of an association.
#[derive(Clone, Debug)]
pub struct End {
    /// Node of the end.
    pub node: NodeIndex,
    /// Identity, by its certificate.
    pub peer: PeerId,
    /// Handle of the first session at this end.
    first: SessionId,
    shaking: Option<Shaking>,
    open: Option<Open>,
    /// Number of the next plaintext record in the end's newest handshake.
    sequence: u64,
}

/// A handshake under way, as one end sees it.
#[derive(Clone, Copy, Debug)]
struct Shaking {
    number: u32,
    /// The flight that is to come next; this end has sent the one before.
    expects: u8,
}

/// Fate of a record at its target.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// Delivered to the application.
    Delivered(Vec<u8>),
    /// Refused by the guard in front.
    Refused(GuardVerdict),
    /// Discarded by the secure layer.
    Discarded,
    /// Taken for a part of a handshake.
    Handshake,
    /// The record ends the session, or the handshake that was to lead to one: a close_notify, or a plaintext record
    /// that no guard kept out. The end has yet to hang up, or to give up.
    Ended,
}

/// A record of a datagram, with its fate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seen<'a> {
    /// Part that anyone on the path could read.
    pub outside: Outside,
    /// Header and body.
    pub bytes: &'a [u8],
    /// Fate of the record.
    pub arrival: Arrival,
}

/// Progress of an end, with the number of the handshake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SessionState {
    /// Neither a session nor a handshake.
    Down,
    /// A handshake is under way.
    Shaking(u32),
    /// A session carries records.
    Open(u32),
}

/// Message of an end in its handshake.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Spoken {
    /// Number of the handshake.
    pub number: u32,
    /// Number of the flight, from 0.
    pub flight: u8,
    /// Bytes of the datagram.
    pub bytes: Vec<u8>,
}

/// Result of a datagram.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Come<'a> {
    /// Records of the datagram.
    pub seen: Vec<Seen<'a>>,
    /// The session that its end took it to belong to, if there is any.
    pub session: Option<SessionId>,
    /// The answer of its end.
    pub answer: Option<Spoken>,
    /// True if the session opened with it.
    pub opened: bool,
}

/// Header fields as anyone on the path can read them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outside {
    /// Epoch of the record.
    pub epoch: u16,
    /// Sequence of the record.
    pub sequence: u64,
}

/// A secure association between two nodes, possibly through a relay.
///
/// Each end knows only its arrivals: a handshake is six flights on the wire, and the ends open one after the other. An
/// arrival at an end is taken to belong to its newest handshake, as behind a relay, which carries one client.
#[derive(Clone, Debug)]
pub struct Association {
    /// The end that dials, then the end that listens.
    pub ends: [End; 2],
    /// The relay in between, if any.
    pub relay: Option<NodeIndex>,
    /// The record filter in front of both ends.
    pub guard: Requirement,
    /// Number of handshakes begun.
    begun: u32,
    secret: [u8; 32],
    /// Datagrams of the dialling end, over all handshakes.
    dialled: u64,
}

impl Association {
    /// An association between `client` and `server` that has yet to be opened.
    pub fn new(
        client: (NodeIndex, SessionId, PeerId),
        server: (NodeIndex, SessionId, PeerId),
        relay: Option<NodeIndex>,
        guard: Requirement,
        secret: [u8; 32],
    ) -> Self {
        let end = |(node, first, peer)| End { node, peer, first, shaking: None, open: None, sequence: 0 };
        Self { ends: [end(client), end(server)], relay, guard, begun: 0, secret, dialled: 0 }
    }

    /// The dialling end begins a handshake.
    pub fn begin(&mut self) -> Spoken {
        self.begun += 1;
        self.ends[0].open = None;
        self.ends[0].shake(self.begun, 1);
        self.speak(0, self.begun, 0)
    }

    /// `flight` of the handshake `number` again, when the end `at` still waits for an answer to it.
    pub fn repeat_flight(&mut self, at: usize, number: u32, flight: u8) -> Option<Spoken> {
        let waits = self.ends[at].shaking.is_some_and(|s| s.number == number && s.expects == flight + 1);
        waits.then(|| self.speak(at, number, flight))
    }

    /// The end `at` gives up the handshake `number`; false when it is over already.
    pub fn give_up(&mut self, at: usize, number: u32) -> bool {
        self.ends[at].shaking.take_if(|s| s.number == number).is_some()
    }

    /// The end `at` ends the session that stands on the handshake `number`, and reports it: a sealed close_notify.
    pub fn hang_up(&mut self, at: usize, number: u32) -> Option<(SessionId, Vec<u8>)> {
        self.ends[at].open.as_ref().filter(|open| open.number == number)?;
        let bytes = self.record_of(at, ALERT, &CLOSE_NOTIFY)?;
        self.ends[at].open = None;
        Some((self.ends[at].session(number), bytes))
    }

    /// The end `at` forgets everything, as a process does that is started again.
    pub fn forget(&mut self, at: usize) {
        (self.ends[at].shaking, self.ends[at].open) = (None, None);
    }

    /// Progress of the end `at` with its newest handshake.
    pub fn state(&self, at: usize) -> SessionState {
        let end = &self.ends[at];
        match (&end.shaking, &end.open) {
            (Some(shaking), _) => SessionState::Shaking(shaking.number),
            (None, Some(open)) => SessionState::Open(open.number),
            (None, None) => SessionState::Down,
        }
    }

    /// Time at which a record last came out at the end `at`, or its session opened, if that stands on the handshake
    /// `number`.
    pub fn heard(&self, at: usize, number: u32) -> Option<Micros> {
        self.ends[at].open.as_ref().filter(|open| open.number == number).map(|open| open.heard)
    }

    /// The end at `node` with the session `session`.
    pub fn end_of(&self, node: NodeIndex, session: SessionId) -> Option<usize> {
        let is_open = |end: &End| end.open.as_ref().is_some_and(|open| end.session(open.number) == session);
        self.ends.iter().position(|end| end.node == node && is_open(end))
    }

    /// Datagrams that the dialling end has sent.
    pub fn sent_by_client(&self) -> u64 {
        self.dialled
    }

    /// Seals a record of the end `from` into a datagram; `None` when it is longer than a record may be or there is no
    /// association to carry it.
    pub fn seal(&mut self, from: usize, plain: &[u8]) -> Option<Vec<u8>> {
        if plain.len() > MAX_RECORD { None } else { self.record_of(from, APPLICATION_DATA, plain) }
    }

    fn record_of(&mut self, from: usize, content: u8, plain: &[u8]) -> Option<Vec<u8>> {
        let open = self.ends[from].open.as_mut()?;
        self.dialled += u64::from(from == 0);
        Some(open.seal(content, plain))
    }

    /// Result of a datagram that reached the end `at` at `now`.
    pub fn arrive<'a>(&mut self, at: usize, datagram: &'a [u8], now: Micros) -> Come<'a> {
        let flight = Flights::which(&self.secret, self.begun, datagram);
        if at == 1 && flight == Some(0) && self.ends[1].newest() < self.begun {
            self.ends[1].shake(self.begun, 0);
        }
        let newest = self.ends[at].newest();
        let flight = flight.filter(|_| newest == self.begun);
        let complete = matches!(self.state(at), SessionState::Open(_));
        let mut seen: Vec<Seen<'a>> =
            split(datagram).map(|piece| self.record(at, piece, flight.is_some(), now)).collect();
        let ended = seen.iter().position(|seen| seen.arrival == Arrival::Ended);
        // An ended session delivers no more. What a guard refused stays refused: guards judge each record before the
        // session.
        let later = ended.map_or(&mut [][..], |ended| &mut seen[ended + 1..]);
        later
            .iter_mut()
            .filter(|seen| !matches!(seen.arrival, Arrival::Refused(_)))
            .for_each(|s| s.arrival = Arrival::Discarded);
        let whole = seen.iter().all(|seen| seen.arrival == Arrival::Handshake);
        let (answer, opened) = match flight.filter(|_| whole && !complete) {
            Some(flight) => self.advance(at, flight, now),
            None => (if complete && asks(datagram) { self.repeat_last(at) } else { None }, false),
        };
        Come { seen, session: (newest > 0).then(|| self.ends[at].session(newest)), answer, opened }
    }

    fn record<'a>(&mut self, at: usize, piece: Split<'a>, of_flight: bool, now: Micros) -> Seen<'a> {
        let end = &self.ends[at];
        let (raw, verdict) = match piece {
            Split::Remainder(bytes) => (RawRecord::unframed(bytes), GuardVerdict::Malformed),
            Split::Record(raw) if end.newest() == 0 => (raw, GuardVerdict::Stranger),
            Split::Record(raw) => (raw, judge(&raw, self.guard, end.shaking.is_none())),
        };
        let arrival = match verdict {
            GuardVerdict::Passed if of_flight && end.shaking.is_some() => Arrival::Handshake,
            GuardVerdict::Passed if raw.epoch == 0 => plaintext(&raw),
            GuardVerdict::Passed => self.authenticate(at, &raw, now),
            GuardVerdict::Plaintext
            | GuardVerdict::Malformed
            | GuardVerdict::Stranger
            | GuardVerdict::Unfinished
            | GuardVerdict::Shed => Arrival::Refused(verdict),
        };
        Seen { outside: Outside { epoch: raw.epoch, sequence: raw.sequence }, bytes: raw.bytes, arrival }
    }

    fn authenticate(&mut self, at: usize, raw: &RawRecord<'_>, now: Micros) -> Arrival {
        let end = &mut self.ends[at];
        let Some(open) = end.open.as_mut().filter(|_| end.shaking.is_none()) else { return Arrival::Discarded };
        let Some(plain) = open.unseal(raw) else { return Arrival::Discarded };
        if raw.content == ALERT {
            return Arrival::Ended;
        }
        open.heard = now;
        Arrival::Delivered(plain)
    }

    /// A flight of the handshake under way came whole to the end `at`: its answer, and whether the session opens with
    /// it.
    fn advance(&mut self, at: usize, flight: u8, now: Micros) -> (Option<Spoken>, bool) {
        let Some(shaking) = self.ends[at].shaking.as_mut() else { return (None, false) };
        let number = shaking.number;
        // A cookie request is not repeated by a timer, but once for each first hello.
        let repeated = flight == 0 && shaking.expects == 2;
        if flight != shaking.expects && !repeated {
            return (None, false);
        }
        shaking.expects = flight + 2;
        let opens = flight + 2 >= FLIGHTS;
        if opens {
            self.ends[at].shaking = None;
            self.ends[at].open = Some(Open::new(&self.secret, number, at, now));
        }
        ((flight + 1 < FLIGHTS).then(|| self.speak(at, number, flight + 1)), opens)
    }

    /// The flight that completed the handshake at the end `at`, once more: the other end may lack it.
    fn repeat_last(&mut self, at: usize) -> Option<Spoken> {
        let open = self.ends[at].open.as_mut().filter(|open| open.repeats < RESENDS)?;
        open.repeats += 1;
        let number = open.number;
        Some(self.speak(at, number, FLIGHTS - 2 + at as u8))
    }

    fn speak(&mut self, at: usize, number: u32, flight: u8) -> Spoken {
        self.dialled += u64::from(at == 0);
        Spoken {
            number,
            flight,
            bytes: Flights::new(&self.secret, number).datagram(flight, &mut self.ends[at].sequence),
        }
    }
}

/// A plaintext record of no flight that the guard let pass: alerts and data end what there is, others do not.
fn plaintext(raw: &RawRecord<'_>) -> Arrival {
    if matches!(raw.content, ALERT | APPLICATION_DATA) { Arrival::Ended } else { Arrival::Handshake }
}

/// True if a plaintext handshake record is in a datagram: to an end that has completed, a sign that its last flight was
/// lost.
fn asks(datagram: &[u8]) -> bool {
    split(datagram).any(|piece| matches!(piece, Split::Record(raw) if raw.epoch == 0 && raw.content == HANDSHAKE))
}

impl End {
    /// A handshake begins.
    fn shake(&mut self, number: u32, expects: u8) {
        (self.shaking, self.sequence) = (Some(Shaking { number, expects }), 0);
    }

    /// Handle at this end of the session that stands on the handshake `number`.
    pub fn session(&self, number: u32) -> SessionId {
        SessionId(self.first.0 + HANDLES * (number - 1))
    }

    /// Number of the end's newest handshake, or 0.
    fn newest(&self) -> u32 {
        self.shaking.map(|s| s.number).or(self.open.as_ref().map(|o| o.number)).unwrap_or(0)
    }
}

/// Verdict of the real record filter on a record, in the words of the log.
pub fn judge(raw: &RawRecord<'_>, guard: Requirement, complete: bool) -> GuardVerdict {
    let mode = match guard {
        Requirement::Required => GuardMode::Required,
        Requirement::Waived => GuardMode::Waived,
    };
    link::guard::judge(raw, mode, complete).logged()
}
