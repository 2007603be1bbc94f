//! The telemetry link of a twin: dialling, handshakes, silence, and the result of a datagram at an end or at the cookie
//! exchange.
//!
//! The records themselves are [`super::net`]'s, the flights of a handshake [`super::flights`]', the filters' notes on
//! both [`super::guard`]'s.

use ground_truth::{GuardVerdict, Note};
use link::guard::hello::before_association;
use link::guard::record::{Split, split};
use wire::core::{Input, Side};

use super::guard::UNKNOWN_PEER;
use super::net::{self, Arrival, SessionState, Spoken};
use super::queue::Micros;
use super::stopwatch::WorkStage;
use super::{Happening, Twin};

/// First and longest pause of a dialler between attempts: the live dialler's own.
pub(super) const PAUSES: (Micros, Micros) =
    (link::dtls::dial::PAUSES.0.as_micros() as Micros, link::dtls::dial::PAUSES.1.as_micros() as Micros);
/// Longest time that a handshake may take: the live listener's own bound.
const HANDSHAKE_LIMIT: Micros = link::dtls::HANDSHAKE_LIMIT.as_micros() as Micros;
/// Time between repeats of a flight, as live.
const FLIGHT_INTERVAL: Micros = link::dtls::FLIGHT_INTERVAL.as_micros() as Micros;
/// Without a record for so long a session is ended, by the dialler and by the listener, as live.
const IDLE: [Micros; 2] = [link::dtls::DIAL_IDLE.as_micros() as Micros, link::dtls::LISTEN_IDLE.as_micros() as Micros];
/// Flights that are repeated by themselves until they are answered. The request for a cookie (1) is not, as in the
/// library, and the last (5) is where the other end shows that it lacks it.
const REPEATED: [u8; 4] = [0, 2, 3, 4];

/// Event due for one end of an association, if the handshake of this number is still its.
#[derive(Clone, Copy)]
pub(super) struct Due {
    pub(super) association: u8,
    pub(super) end: u8,
    number: u32,
    what: What,
}

#[derive(Clone, Copy)]
enum What {
    /// A flight that was not answered.
    Repeat(u8),
    /// Timeout of a handshake.
    GiveUp,
    /// Timeout of a silent session.
    Idle,
    /// The core at this end ended the session.
    HangUp,
}

impl Twin {
    pub(super) fn send(&mut self, association: usize, from: usize, time: Micros, plain: &[u8]) {
        self.enter(WorkStage::Links);
        let sealed = self.associations[association].seal(from, plain);
        self.enter(WorkStage::Engine);
        if let Some(bytes) = sealed {
            self.transmit(association, from, time, bytes);
        }
    }

    /// A datagram leaves an end.
    fn transmit(&mut self, association: usize, from: usize, time: Micros, bytes: Vec<u8>) {
        let a = &self.associations[association];
        let target = a.ends[1 - from].node;
        let (source, relay) = (a.ends[from].node, a.relay);
        let hop = self.delays.datagram(self.way(source, relay.unwrap_or(target)), time);
        let due = self.in_order(source, relay.unwrap_or(target), time + hop);
        match relay {
            Some(relay) => {
                let side = if from == 0 { Side::Client } else { Side::Server };
                self.queue.push(due, relay, Happening::Input(Input::Datagram { side, bytes }));
            }
            None => {
                let datagram = Happening::Datagram { association: association as u8, end: 1 - from as u8, bytes };
                self.queue.push(due, target, datagram);
            }
        }
    }

    /// A datagram reached an end: guard, secure layer, core.
    pub(super) fn arrive(&mut self, association: u8, end: u8, bytes: &[u8]) {
        let (a, e) = (usize::from(association), usize::from(end));
        let target = self.associations[a].ends[e].node;
        if !self.nodes[usize::from(target)].alive {
            return;
        }
        if let Some(guard) = &mut self.guards[usize::from(target)] {
            guard.datagrams += 1;
        }
        self.enter(WorkStage::Links);
        let come = self.associations[a].arrive(e, bytes, self.now);
        let number = come.session.map_or(UNKNOWN_PEER, |session| session.0);
        for seen in come.seen {
            self.enter(WorkStage::Links);
            let verdict = match &seen.arrival {
                Arrival::Refused(verdict) => *verdict,
                Arrival::Delivered(_) | Arrival::Discarded | Arrival::Handshake | Arrival::Ended => {
                    GuardVerdict::Passed
                }
            };
            self.observe(target, number, seen.outside, seen.bytes, verdict);
            if let Some(guard) = &mut self.guards[usize::from(target)] {
                match &seen.arrival {
                    Arrival::Delivered(_) => guard.delivered += 1,
                    Arrival::Refused(_) => guard.refused += 1,
                    Arrival::Discarded => guard.discarded += 1,
                    Arrival::Handshake | Arrival::Ended => guard.handshake += 1,
                }
            }
            self.enter(WorkStage::Engine);
            match (seen.arrival, come.session) {
                (Arrival::Delivered(bytes), Some(session)) => self.feed(target, Input::Record { session, bytes }),
                (Arrival::Ended, _) => self.ended(a, e),
                _ => {}
            }
        }
        // The last flight leaves before the session is anybody's: what is sent on it arrives behind that flight.
        if let Some(spoken) = come.answer {
            self.say(a, e, spoken);
        }
        if come.opened {
            self.opened(a, e);
        }
        self.enter(WorkStage::Engine);
    }

    /// An end sends a flight, and waits for its answer where it has to come.
    fn say(&mut self, a: usize, e: usize, spoken: Spoken) {
        let Spoken { number, flight, bytes } = spoken;
        let node = self.associations[a].ends[e].node;
        let due = self.now + self.delays.flight(self.way(node, node), self.now);
        self.transmit(a, e, due, bytes);
        // The first of the due times of repeats is the one that counts.
        if flight <= 1 {
            self.due(a, e, number, self.now + HANDSHAKE_LIMIT, What::GiveUp);
        }
        if REPEATED.contains(&flight) {
            self.due(a, e, number, due + FLIGHT_INTERVAL, What::Repeat(flight));
        }
    }

    fn due(&mut self, a: usize, e: usize, number: u32, time: Micros, what: What) {
        let due = Due { association: a as u8, end: e as u8, number, what };
        self.queue.push(time, self.associations[a].ends[e].node, Happening::Due(due));
    }

    /// An event that was due for an end comes, if it still is.
    pub(super) fn come_due(&mut self, due: Due) {
        let (a, e, number) = (usize::from(due.association), usize::from(due.end), due.number);
        let association = &mut self.associations[a];
        if !self.nodes[usize::from(association.ends[e].node)].alive {
            return;
        }
        match due.what {
            What::Repeat(flight) => {
                if let Some(spoken) = association.repeat_flight(e, number, flight) {
                    self.say(a, e, spoken);
                }
            }
            What::GiveUp => self.give_up(a, e, number),
            What::Idle => match association.heard(e, number).map(|heard| heard + IDLE[e]) {
                Some(end) if end > self.now => self.due(a, e, number, end, What::Idle),
                Some(_) => self.end_session(a, e, number),
                None => {}
            },
            What::HangUp => self.end_session(a, e, number),
        }
    }

    /// The core at `e` has ended its session.
    pub(super) fn close(&mut self, a: usize, e: usize, time: Micros) {
        if let SessionState::Open(number) = self.associations[a].state(e) {
            self.due(a, e, number, time, What::HangUp);
        }
    }

    /// The session of an end is over; a dialler opens another.
    fn end_session(&mut self, a: usize, e: usize, number: u32) {
        let Some((session, notify)) = self.associations[a].hang_up(e, number) else { return };
        self.transmit(a, e, self.now, notify);
        let node = self.associations[a].ends[e].node;
        self.feed(node, Input::Closed { session });
        if e == 0 {
            self.queue.push(self.now + PAUSES.0, node, Happening::Open(a as u8));
        }
    }

    fn give_up(&mut self, a: usize, e: usize, number: u32) {
        if self.associations[a].give_up(e, number) && e == 0 {
            self.fail(a);
        }
    }

    /// A record came that ends the session at an end.
    fn ended(&mut self, a: usize, e: usize) {
        match self.associations[a].state(e) {
            SessionState::Open(number) => self.end_session(a, e, number),
            SessionState::Shaking(number) => self.give_up(a, e, number),
            SessionState::Down => {}
        }
    }

    /// A datagram from an address that has no association. A sound ClientHello begins a handshake without a sequel; all
    /// unknown peers of a run share one address, so meanwhile the rest is judged as a part of that handshake.
    pub(super) fn unknown_peer(&mut self, association: u8, bytes: &[u8]) {
        let target = self.associations[usize::from(association)].ends[1].node;
        let Some(guard) = &mut self.guards[usize::from(target)] else { return };
        if !self.nodes[usize::from(target)].alive {
            return;
        }
        guard.datagrams += 1;
        if guard.half_open > self.now {
            let mode = self.associations[usize::from(association)].guard;
            for piece in split(bytes) {
                let (bytes, verdict) = match piece {
                    Split::Record(raw) => (raw.bytes, net::judge(&raw, mode, false)),
                    Split::Remainder(bytes) => (bytes, GuardVerdict::Malformed),
                };
                self.count_unknown_peer(target, bytes, verdict);
            }
            return;
        }
        let verdict = before_association(bytes).logged();
        if verdict == GuardVerdict::Passed {
            guard.half_open = self.now + HANDSHAKE_LIMIT;
            let happening = Happening::Unfinished { bytes: bytes.to_vec() };
            self.queue.push(self.now + HANDSHAKE_LIMIT, target, happening);
        }
        self.count_unknown_peer(target, bytes, verdict);
    }

    /// The dialler's attempt.
    pub(super) fn open(&mut self, association: u8) {
        let a = usize::from(association);
        if self.nodes[usize::from(self.associations[a].ends[0].node)].alive {
            let spoken = self.associations[a].begin();
            self.say(a, 0, spoken);
        }
    }

    /// The dialler's handshake has failed: again, after a pause that doubles.
    fn fail(&mut self, a: usize) {
        let pause = &mut self.pauses[a];
        *pause = (*pause * 2).min(PAUSES.1);
        let dialler = self.associations[a].ends[0].node;
        self.queue.push(self.now + *pause, dialler, Happening::Open(a as u8));
    }

    /// The handshake of an end is complete.
    fn opened(&mut self, a: usize, e: usize) {
        let association = &self.associations[a];
        let SessionState::Open(number) = association.state(e) else { return };
        let (end, peer) = (&association.ends[e], association.ends[1 - e].peer);
        let (node, session) = (end.node, end.session(number));
        if e == 0 {
            self.pauses[a] = PAUSES.0;
        }
        self.due(a, e, number, self.now + IDLE[e], What::Idle);
        self.note_guard(node, Note::Associated { association: session.0, peer });
        self.feed(node, Input::Opened { session, peer });
    }
}
