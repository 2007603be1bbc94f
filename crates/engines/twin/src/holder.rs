//! Holder of an identity's session at the broker: one connection at a time, the newest.
//!
//! The unit under test holds its own over the modelled [`super::stream`]; the others are a hop away and dial in no
//! time. A displaced client sees its connection end and dials again after the pauses of the live client.

use std::collections::VecDeque;

use broker::gate::Event as Told;
use topology::Host;
use wire::core::{Input, Side, Subject};
use wire::id::{NodeId, PeerId};

use super::queue::{Micros, NodeIndex};
use super::{Happening, Twin};

/// Publications that wait for a session.
const WAITING: usize = link::mqtt::OUTBOUND;

/// A node as a client of the broker.
#[derive(Clone, Debug)]
pub struct Client {
    /// The peer by its certificate.
    pub peer: PeerId,
    /// True if it is after a session.
    wants: bool,
    /// True if it has one. That of the client behind the relay is its stream's business.
    stands: bool,
    redial: Redial,
    waiting: VecDeque<(Subject, Vec<u8>)>,
}

impl Client {
    /// A client that has its session from the start, or is yet to ask for one.
    pub fn new(peer: PeerId, from_start: bool) -> Self {
        let redial = Redial::default();
        Self { peer, wants: from_start, stands: from_start, redial, waiting: VecDeque::new() }
    }
}

/// Time at which a client dials again: later each time, until a session has stood for as long as the longest pause.
#[derive(Clone, Copy, Debug)]
pub(super) struct Redial {
    pause: Micros,
    since: Option<Micros>,
}

impl Default for Redial {
    fn default() -> Self {
        Self { pause: link::mqtt::PAUSES.0.as_micros() as Micros, since: None }
    }
}

impl Redial {
    /// Notes that a session is established.
    pub(super) fn session_up(&mut self, now: Micros) {
        self.since = Some(now);
    }

    /// Time to wait, now that there is none.
    pub(super) fn pause(&mut self, now: Micros) -> Micros {
        let longest = link::mqtt::PAUSES.1.as_micros() as Micros;
        if self.since.take().is_some_and(|since| now - since >= longest) {
            *self = Self::default();
        }
        let pause = self.pause;
        self.pause = (pause * 2).min(longest);
        pause
    }
}

impl Twin {
    /// True if publications for the identity of `node` reach it by its own connection, without the relay.
    pub(super) fn holds(&self, node: usize) -> bool {
        self.nodes[node].commands.as_ref().is_some_and(|client| client.stands)
    }

    /// A node wants a session, or wants none any longer.
    pub(super) fn want(&mut self, node: NodeIndex, wants: bool) {
        let Some(client) = &mut self.nodes[usize::from(node)].commands else { return };
        (client.wants, client.stands) = (wants, client.stands && wants);
        if wants {
            let due = self.now + self.to_broker(node);
            self.queue.push(due, node, Happening::Connect);
        }
    }

    fn to_broker(&self, node: NodeIndex) -> Micros {
        self.delays.command((self.nodes[usize::from(node)].id, NodeId::BROKER), self.now)
    }

    /// A node's connection reaches the broker: it has the session, and the waiting publications go out.
    pub(super) fn connect(&mut self, node: NodeIndex) {
        let n = &mut self.nodes[usize::from(node)];
        let Some(client) = n.commands.as_mut().filter(|client| n.alive && client.wants && !client.stands) else {
            return;
        };
        if self.broker.is_none() {
            let repeated = self.now + client.redial.pause(self.now);
            return self.queue.push(repeated, node, Happening::Connect);
        }
        client.stands = true;
        client.redial.session_up(self.now);
        let (peer, waiting) = (client.peer, std::mem::take(&mut client.waiting));
        self.displace(peer, node);
        for (subject, bytes) in waiting {
            self.distribute(node, self.now, subject, bytes);
        }
    }

    /// The session of `peer` is now that of `index`; the former holder is informed, and so is the log.
    pub(super) fn displace(&mut self, peer: PeerId, index: NodeIndex) {
        for node in (0..self.nodes.len() as NodeIndex).filter(|node| *node != index) {
            let same = self.nodes[usize::from(node)].commands.as_ref().is_some_and(|client| client.peer == peer);
            if same && (self.cut_off(node) || self.end_relayed(node)) {
                self.say_broker(&Told::TakenOver { peer });
            }
        }
    }

    /// The session that `node` has by its own connection is over, which it will learn; true when it had one.
    pub(super) fn cut_off(&mut self, node: NodeIndex) -> bool {
        let client = self.nodes[usize::from(node)].commands.as_mut();
        let stood = client.is_some_and(|client| std::mem::take(&mut client.stands));
        if stood {
            let due = self.now + self.to_broker(node);
            self.queue.push(due, node, Happening::Displaced);
        }
        stood
    }

    /// The broker ends the session behind the relay, if it is that of `node` and stands.
    fn end_relayed(&mut self, node: NodeIndex) -> bool {
        let held = self.commands.as_ref().is_some_and(|commands| commands.client == node && commands.stream.held());
        if held {
            self.hang_up(Side::Server);
        }
        held
    }

    /// A node learns that it has no session any longer.
    pub(super) fn displaced(&mut self, node: NodeIndex) {
        self.feed(node, Input::SessionLost);
        if let Some(client) = &mut self.nodes[usize::from(node)].commands {
            let repeated = self.now + client.redial.pause(self.now);
            self.queue.push(repeated, node, Happening::Connect);
        }
    }

    /// A client without a session keeps its publications until it has one.
    pub(super) fn keep_publication(&mut self, node: NodeIndex, subject: Subject, bytes: Vec<u8>) {
        if let Some(client) = self.nodes[usize::from(node)].commands.as_mut().filter(|c| c.waiting.len() < WAITING) {
            client.waiting.push_back((subject, bytes));
        }
    }

    /// The broker's own log.
    pub(super) fn say_broker(&mut self, event: &Told) {
        let mut out = VecDeque::new();
        let now = self.clocks[Host::Control as usize].read(self.now);
        self.refusals.write(now, broker::audit::audited(event), &mut out);
        self.record_all(wire::id::NodeId::BROKER, out);
    }
}
