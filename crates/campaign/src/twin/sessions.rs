//! The telemetry link of a twin: dialling, handshakes, and what a datagram comes to at an end or at the door.
//!
//! The records themselves are [`super::net`]'s, what the filters note of them [`super::guard`]'s.

use link::guard::hello::at_the_door;
use link::guard::record::{Split, split};
use wire::core::{Input, Side};
use wire::event::{Event, GuardVerdict};

use super::net::{self, Arrival, Standing};
use super::queue::{Micros, NodeIndex};
use super::stopwatch::Stage;
use super::{Happening, Twin};
use crate::evidence::guard_verdict;

/// First and longest pause of a dialler between attempts: the live dialler's own.
pub(super) const PAUSES: (Micros, Micros) =
    (link::dtls::dial::PAUSES.0.as_micros() as Micros, link::dtls::dial::PAUSES.1.as_micros() as Micros);
/// How long a handshake may take: the live listener's own bound.
const HANDSHAKE_LIMIT: Micros = link::dtls::HANDSHAKE_LIMIT.as_micros() as Micros;

impl Twin {
    pub(super) fn send(&mut self, association: usize, from: usize, at: Micros, plain: &[u8]) {
        self.enter(Stage::Links);
        let a = &mut self.associations[association];
        let sealed = a.seal(from, plain);
        let target = a.ends[1 - from].node;
        let (source, relay) = (a.ends[from].node, a.relay);
        self.enter(Stage::Engine);
        let Some(bytes) = sealed else { return };
        let hop = self.delays.datagram(self.way(source, relay.unwrap_or(target)), at);
        let at = self.in_order(source, relay.unwrap_or(target), at + hop);
        match relay {
            Some(relay) => {
                let side = if from == 0 { Side::Client } else { Side::Server };
                self.queue.push(at, relay, Happening::Input(Input::Datagram { side, bytes }));
            }
            None => {
                let datagram = Happening::Datagram { association: association as u8, end: 1 - from as u8, bytes };
                self.queue.push(at, target, datagram);
            }
        }
    }

    /// A datagram reached an end: guard, secure layer, core.
    pub(super) fn arrive(&mut self, association: u8, end: u8, bytes: &[u8]) {
        let (a, e) = (usize::from(association), usize::from(end));
        let (target, session) = (self.associations[a].ends[e].node, self.associations[a].ends[e].session);
        if !self.nodes[usize::from(target)].alive {
            return;
        }
        if let Some(guard) = &mut self.guards[usize::from(target)] {
            guard.datagrams += 1;
        }
        let handshake = self.associations[a].standing == Standing::Handshake;
        self.enter(Stage::Links);
        for seen in self.associations[a].arrive(e, bytes) {
            self.enter(Stage::Links);
            let verdict = match &seen.arrival {
                Arrival::Refused(verdict) => *verdict,
                Arrival::Delivered(_) | Arrival::Discarded | Arrival::Handshake | Arrival::Ended => {
                    GuardVerdict::Passed
                }
            };
            self.observe(target, u32::from(association), seen.outside, seen.bytes, verdict);
            if let Some(guard) = &mut self.guards[usize::from(target)] {
                match &seen.arrival {
                    Arrival::Delivered(_) => guard.delivered += 1,
                    Arrival::Refused(_) => guard.refused += 1,
                    Arrival::Discarded => guard.discarded += 1,
                    Arrival::Handshake | Arrival::Ended => guard.handshake += 1,
                }
            }
            self.enter(Stage::Engine);
            match seen.arrival {
                Arrival::Delivered(plain) => self.feed(target, Input::Record { session, bytes: plain }),
                Arrival::Ended if handshake => self.fail(association),
                Arrival::Ended => self.close(a),
                Arrival::Refused(_) | Arrival::Discarded | Arrival::Handshake => {}
            }
        }
        self.enter(Stage::Engine);
    }

    /// A datagram from an address that has no association. A sound ClientHello begins a handshake that nobody goes on
    /// with; all strangers of a run share one address, so meanwhile the rest is judged as a part of that handshake.
    pub(super) fn stranger(&mut self, association: u8, bytes: &[u8]) {
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
                self.count_stranger(target, bytes, verdict);
            }
            return;
        }
        let verdict = guard_verdict(at_the_door(bytes));
        if verdict == GuardVerdict::Passed {
            guard.half_open = self.now + HANDSHAKE_LIMIT;
            let over = Happening::Unfinished { bytes: bytes.to_vec() };
            self.queue.push(self.now + HANDSHAKE_LIMIT, target, over);
        }
        self.count_stranger(target, bytes, verdict);
    }

    /// The dialler's attempt: a handshake when both ends are there, else the next attempt once this one has failed.
    pub(super) fn open(&mut self, association: u8) {
        let a = &mut self.associations[usize::from(association)];
        let dialler = a.ends[0].node;
        let up = |node: NodeIndex| self.nodes[usize::from(node)].alive;
        let listener = a.ends[1].node;
        if up(dialler) && up(listener) {
            let number = a.begin();
            let at = self.now + self.delays.handshake(self.way(dialler, listener), self.now);
            self.queue.push(at, dialler, Happening::Complete { association, number });
        } else {
            self.again(association, HANDSHAKE_LIMIT);
        }
    }

    /// A handshake has failed.
    pub(super) fn fail(&mut self, association: u8) {
        self.again(association, 0);
    }

    /// Dials again after a pause that doubles.
    pub(super) fn again(&mut self, association: u8, lost: Micros) {
        let pause = &mut self.pauses[usize::from(association)];
        *pause = (*pause * 2).min(PAUSES.1);
        let dialler = self.associations[usize::from(association)].ends[0].node;
        self.queue.push(self.now + lost + *pause, dialler, Happening::Open(association));
    }

    pub(super) fn complete(&mut self, association: u8, number: u32) {
        let a = usize::from(association);
        if !self.associations[a].complete(number) {
            return;
        }
        self.pauses[a] = PAUSES.0;
        let ends = [self.associations[a].ends[0].clone(), self.associations[a].ends[1].clone()];
        for (own, other) in [(1, 0), (0, 1)] {
            let peer = ends[other].peer;
            self.note_guard(ends[own].node, Event::Associated { association: association.into(), peer });
            let input = Input::Opened { session: ends[own].session, peer };
            self.feed(ends[own].node, input);
        }
    }

    /// An end has closed its session, and the other end has been told.
    pub(super) fn end_session(&mut self, a: usize, generation: u32) {
        if self.associations[a].hang_up(generation) {
            self.close(a);
        }
    }

    pub(super) fn close(&mut self, a: usize) {
        let ends = [self.associations[a].ends[0].clone(), self.associations[a].ends[1].clone()];
        for end in &ends {
            self.feed(end.node, Input::Closed { session: end.session });
        }
        self.queue.push(self.now + PAUSES.0, ends[0].node, Happening::Open(a as u8));
    }
}
