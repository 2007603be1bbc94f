//! The command plane of a twin: publications through the broker, and the one path with the adversary in it.
//!
//! The unit under test reaches the broker over a [`Stream`] through the stream relay's core, as live; the others have a
//! hop to it without a relay. The view of each ingress of the stream is logged by its own chain.

use std::collections::VecDeque;

use broker::Receivers;
use broker::acl::{self, Pattern, Verb};
use broker::gate::{Denial, Event as Told};
use ground_truth::{Note, Sight};
use wire::audit::Journal;
use wire::core::{Input, Side, Subject};
use wire::event::wire_hash;
use wire::id::{Boot, NodeId, PeerId};
use wire::sign::Key;
use wire::time::Instant;

use super::holder::Redial;
use super::queue::{Micros, NodeIndex};
use super::stream::{Effect, Stream};
use super::{Happening, Node, OPENS_AT, Twin};

/// Ingress observer of the broker.
pub(super) const BROKER_INGRESS: NodeId = match NodeId::BROKER.guard() {
    Some(ingress) => ingress,
    None => NodeId::BROKER,
};
/// Time for which the client waits for a session (its library's default).
const PATIENCE: Micros = 5_000_000;
/// Time for which the broker waits for a handshake.
const HANDSHAKE: Micros = 3_000_000;
/// Period at which the client asks for the broker.
const KEEP_ALIVE: Micros = link::mqtt::KEEP_ALIVE_S as Micros * 1_000_000;

/// The relayed path and the nodes at its ends.
#[derive(Clone)]
pub(super) struct Relayed {
    /// Node that dials.
    pub(super) client: NodeIndex,
    /// Relay in between.
    pub(super) relay: NodeIndex,
    pub(super) stream: Stream,
    redial: Redial,
    /// Log of the observer at the broker's ingress.
    ingress: Journal,
    /// Arrival of the last piece of each leg: client to relay, broker to relay, relay to client, relay to broker.
    latest: [Micros; 4],
}

impl Relayed {
    pub(super) fn new(client: NodeIndex, relay: NodeIndex, secret: [u8; 32], ingress: Option<Key>) -> Self {
        let ingress = Journal::new(BROKER_INGRESS, Boot(1), ingress);
        Self { client, relay, stream: Stream::new(secret), redial: Redial::default(), ingress, latest: [0; 4] }
    }

    /// Node at the `side` end of the path.
    fn end(&self, side: Side, nodes: &[Node]) -> NodeId {
        if side == Side::Client { nodes[usize::from(self.client)].id } else { NodeId::BROKER }
    }
}

/// Event on the relayed path.
#[derive(Clone)]
pub(super) enum StreamEvent {
    /// The client dials.
    Dial,
    /// A publication for the client reaches the broker.
    Order(Subject, Vec<u8>),
    /// Bytes, or the end, reach an end of this connection.
    Piece(u32, Side, Vec<u8>),
    /// The relay cut this connection.
    Reset(u32),
    /// The broker's patience with the handshake of this connection is over.
    Handshake(u32),
    /// The client's patience with this connection is over.
    Patience(u32),
    /// Time for the client of this connection to ask whether the broker is there.
    KeepAlive(u32),
}

impl Twin {
    /// The first dial.
    pub(super) fn open_commands(&mut self) {
        if let Some(client) = self.commands.as_ref().map(|c| c.client) {
            self.queue.push(OPENS_AT, client, Happening::Stream(StreamEvent::Dial));
        }
    }

    /// A node publishes at `time`.
    pub(super) fn publish_command(&mut self, node: NodeIndex, time: Micros, subject: Subject, bytes: Vec<u8>) {
        // So does the live client.
        if bytes.len() > link::mqtt::MAX_PAYLOAD {
            return;
        }
        if self.nodes[usize::from(node)].id == NodeId::INSIDER_BROKER {
            return self.impose(node, time, subject, &bytes);
        }
        let holds = self.holds(usize::from(node));
        match self.commands.as_mut().filter(|c| c.client == node) {
            Some(commands) => {
                if let Some(sealed) = commands.stream.publish(Side::Client, subject, bytes) {
                    self.write(Side::Client, time, sealed);
                }
            }
            None if holds => self.hand_in(node, time, subject, bytes),
            None => self.keep_publication(node, subject, bytes),
        }
    }

    /// A publication of `node` reaches the broker, which takes it at once, or when it runs again.
    fn hand_in(&mut self, node: NodeIndex, time: Micros, subject: Subject, bytes: Vec<u8>) {
        let happening = Happening::Distribute { subject, bytes };
        if let Some(Happening::Distribute { subject, bytes }) = self.keep(node, happening) {
            self.distribute(node, time, subject, bytes);
        }
    }

    /// The broker takes a publication of `node` and forwards it; a hostile broker decides by its plan.
    pub(super) fn distribute(&mut self, node: NodeIndex, time: Micros, subject: Subject, bytes: Vec<u8>) {
        let Some(publisher) = self.nodes[usize::from(node)].commands.as_ref().map(|client| client.peer) else { return };
        if let Some(hostile) = self.index(NodeId::INSIDER_BROKER) {
            let hop = self.delays.datagram(self.way(node, hostile), time);
            let due = self.in_order(node, hostile, time + hop);
            return self.queue.push(due, hostile, Happening::Input(Input::Published { subject, bytes }));
        }
        let Some(broker) = &self.broker else { return };
        match broker.publish(publisher, subject) {
            Ok(receivers) => self.hand_on(node, time, &receivers, subject, &bytes),
            Err(refusal) => {
                self.say_broker(&Told::Denied(Denial::Access { peer: publisher, refusal }));
            }
        }
    }

    /// A publication of a hostile broker goes to all who would hear of the subject.
    fn impose(&mut self, node: NodeIndex, time: Micros, subject: Subject, bytes: &[u8]) {
        let hears = |peer: PeerId| acl::permit(peer, Verb::Subscribe, Pattern::One(subject)).is_ok();
        let peers = self.nodes.iter().filter_map(|n| n.commands.as_ref().map(|client| client.peer));
        let receivers: Receivers = peers.filter(|peer| hears(*peer)).collect();
        self.hand_on(node, time, &receivers, subject, bytes);
    }

    fn hand_on(&mut self, node: NodeIndex, time: Micros, receivers: &[PeerId], subject: Subject, bytes: &[u8]) {
        for reader in 0..self.nodes.len() {
            let hears = self.nodes[reader].commands.as_ref().is_some_and(|client| receivers.contains(&client.peer));
            let relayed = self.commands.as_ref().is_some_and(|commands| usize::from(commands.client) == reader);
            if hears && (relayed || self.holds(reader)) {
                let hop = self.delays.command(self.way(node, reader as NodeIndex), time);
                let due = self.in_order(node, reader as NodeIndex, time + hop);
                let bytes = bytes.to_vec();
                let happening = if relayed {
                    Happening::Stream(StreamEvent::Order(subject, bytes))
                } else {
                    Happening::Input(Input::Published { subject, bytes })
                };
                self.queue.push(due, reader as NodeIndex, happening);
            }
        }
    }

    /// Something happens on the relayed path.
    pub(super) fn relay_stream(&mut self, along: StreamEvent) {
        let Some(commands) = &mut self.commands else { return };
        let present = commands.stream.connection;
        match along {
            StreamEvent::Dial => self.dial(),
            StreamEvent::Order(subject, bytes) => {
                if let Some(sealed) = commands.stream.publish(Side::Server, subject, bytes) {
                    self.write(Side::Server, self.now, sealed);
                }
            }
            StreamEvent::Piece(connection, side, bytes) if connection == present => self.piece(side, &bytes),
            StreamEvent::Reset(connection) if connection == present => {
                for side in [Side::Client, Side::Server] {
                    self.end(side, Sight::Closed);
                }
            }
            StreamEvent::Handshake(connection) if connection == present && !commands.stream.up => {
                self.hang_up(Side::Server);
            }
            StreamEvent::Patience(connection) if connection == present && !commands.stream.up => {
                self.hang_up(Side::Client);
            }
            StreamEvent::KeepAlive(connection) if connection == present && commands.stream.up => self.keep_alive(),
            // A piece of a connection that is over.
            StreamEvent::Piece(..)
            | StreamEvent::Reset(_)
            | StreamEvent::Handshake(_)
            | StreamEvent::Patience(_)
            | StreamEvent::KeepAlive(_) => {}
        }
    }

    fn dial(&mut self) {
        let Some(commands) = &mut self.commands else { return };
        let alive = |node: NodeIndex| self.nodes[usize::from(node)].alive;
        let client = commands.client;
        if !alive(client) {
            return;
        }
        if !alive(commands.relay) || self.broker.is_none() {
            let repeated = self.now + commands.redial.pause(self.now);
            return self.queue.push(repeated, client, Happening::Stream(StreamEvent::Dial));
        }
        let hello = commands.stream.dial();
        let connection = commands.stream.connection;
        self.queue.push(self.now + HANDSHAKE, client, Happening::Stream(StreamEvent::Handshake(connection)));
        self.queue.push(self.now + PATIENCE, client, Happening::Stream(StreamEvent::Patience(connection)));
        self.write(Side::Client, self.now, hello);
    }

    fn keep_alive(&mut self) {
        let Some(commands) = &mut self.commands else { return };
        if commands.stream.unanswered > 0 {
            return self.hang_up(Side::Client);
        }
        let (client, connection) = (commands.client, commands.stream.connection);
        if let Some(ping) = commands.stream.ping() {
            self.write(Side::Client, self.now, ping);
        }
        self.queue.push(self.now + KEEP_ALIVE, client, Happening::Stream(StreamEvent::KeepAlive(connection)));
    }

    /// The end at `side` writes bytes at `time`: they go to the relay. An empty piece is the end.
    fn write(&mut self, side: Side, time: Micros, bytes: Vec<u8>) {
        let Some(commands) = &mut self.commands else { return };
        let from = commands.end(side, &self.nodes);
        let hop = self.delays.datagram((from, self.nodes[usize::from(commands.relay)].id), time);
        let latest = &mut commands.latest[side as usize];
        *latest = (time + hop).max(*latest);
        let input = Input::Stream { connection: commands.stream.session(), side, bytes };
        self.queue.push(*latest, commands.relay, Happening::Input(input));
    }

    /// The relay acted at `time`, in order with the other traffic towards `side`.
    pub(super) fn relayed(&mut self, node: NodeIndex, time: Micros, side: Side, along: StreamEvent) {
        let Some(commands) = self.commands.as_mut().filter(|c| c.relay == node) else { return };
        let to = commands.end(side, &self.nodes);
        let hop = self.delays.datagram((self.nodes[usize::from(node)].id, to), time);
        let latest = &mut commands.latest[2 + side as usize];
        *latest = (time + hop).max(*latest);
        self.queue.push(*latest, commands.client, Happening::Stream(along));
    }

    /// Bytes, or the end, reach the end at `side`.
    fn piece(&mut self, side: Side, bytes: &[u8]) {
        let Some(commands) = &mut self.commands else { return };
        if !commands.stream.open(side) {
            return;
        }
        if bytes.is_empty() {
            self.end(side, Sight::Closed);
            return self.write(side, self.now, Vec::new());
        }
        let offset = commands.stream.place(side).offset();
        let effects = commands.stream.arrive(side, bytes);
        self.saw(side, Sight::Arrived, offset, bytes);
        effects.into_iter().for_each(|effect| self.effect(effect));
    }

    fn effect(&mut self, effect: Effect) {
        let Some(commands) = &self.commands else { return };
        let (client, connection) = (commands.client, commands.stream.connection);
        match effect {
            Effect::Write(side, bytes) => self.write(side, self.now, bytes),
            Effect::Published(Side::Client, subject, bytes) => {
                let offset = commands.stream.place(Side::Client).offset();
                self.saw(Side::Client, Sight::Delivered, offset, &bytes);
                self.feed(client, Input::Published { subject, bytes });
            }
            Effect::Published(Side::Server, subject, bytes) => self.distribute(client, self.now, subject, bytes),
            Effect::Connects => {
                if let Some(peer) = self.nodes[usize::from(client)].commands.as_ref().map(|client| client.peer) {
                    self.displace(peer, client);
                }
            }
            Effect::Up => {
                let session = commands.stream.session();
                let now = self.now;
                self.commands.iter_mut().for_each(|commands| commands.redial.session_up(now));
                self.queue.push(self.now + KEEP_ALIVE, client, Happening::Stream(StreamEvent::KeepAlive(connection)));
                let peer = self.nodes[usize::from(client)].commands.as_ref().map(|client| client.peer);
                if let (Some(hostile), Some(peer)) = (self.index(NodeId::INSIDER_BROKER), peer) {
                    self.feed(hostile, Input::Opened { session, peer });
                }
            }
            Effect::Refused(side) => {
                let offset = commands.stream.place(side).offset();
                self.saw(side, Sight::Refused, offset, &[]);
                self.hang_up(side);
            }
        }
    }

    /// The end at `side` hangs up by itself.
    pub(super) fn hang_up(&mut self, side: Side) {
        if self.end(side, Sight::HungUp) {
            self.write(side, self.now, Vec::new());
        }
    }

    /// The end at `side` is over; a client dials again. True when it was open.
    fn end(&mut self, side: Side, sight: Sight) -> bool {
        let Some(commands) = &mut self.commands else { return false };
        let lost = side == Side::Client && commands.stream.up;
        if !commands.stream.close(side) {
            return false;
        }
        let (client, offset) = (commands.client, commands.stream.place(side).offset());
        if side == Side::Client {
            let repeated = self.now + commands.redial.pause(self.now);
            self.queue.push(repeated, client, Happening::Stream(StreamEvent::Dial));
        }
        self.saw(side, sight, offset, &[]);
        if lost {
            self.feed(client, Input::SessionLost);
        }
        true
    }

    /// Sight of the ingress at `side`, in the log of its own chain. That of a dead process sees no bytes.
    fn saw(&mut self, side: Side, sight: Sight, offset: u64, bytes: &[u8]) {
        let Some(commands) = &mut self.commands else { return };
        let client = commands.client;
        let event = Note::StreamSaw {
            sight,
            stream: commands.stream.place(side).name(),
            offset,
            length: bytes.len() as u32,
            hash: wire_hash(bytes),
        };
        match side {
            Side::Client if self.nodes[usize::from(client)].alive => self.note_guard(client, event),
            Side::Client => {}
            Side::Server => {
                let mut out = VecDeque::new();
                commands.ingress.write(Instant(self.now), event, &mut out);
                self.record_all(BROKER_INGRESS, out);
            }
        }
    }

    /// The broker's ingress observer signs its chain for the last time.
    pub(super) fn sign_broker_ingress(&mut self) {
        let Some(commands) = self.commands.as_mut().filter(|commands| commands.ingress.counter() > 0) else { return };
        let mut out = VecDeque::new();
        commands.ingress.sign(Instant(self.now), &mut out);
        self.record_all(BROKER_INGRESS, out);
    }

    /// A publication came out of the stream of a client with no relay before it.
    pub(super) fn note_delivered(&mut self, node: NodeIndex, bytes: &[u8]) {
        let (length, hash) = (bytes.len() as u32, wire_hash(bytes));
        let event = Note::StreamSaw { sight: Sight::Delivered, stream: 0, offset: 0, length, hash };
        self.note_guard(node, event);
    }

    /// The broker was killed: its ends are over, and say no more.
    pub(super) fn broker_killed(&mut self) {
        (0..self.nodes.len() as NodeIndex).for_each(|node| _ = self.cut_off(node));
        if self.commands.as_mut().is_some_and(|commands| commands.stream.close(Side::Server)) {
            self.write(Side::Server, self.now, Vec::new());
        }
    }

    /// A process on the relayed path was killed: its sockets end.
    pub(super) fn killed_on_path(&mut self, node: NodeIndex) {
        let Some(commands) = &mut self.commands else { return };
        if node == commands.client {
            commands.stream.close(Side::Client);
            self.write(Side::Client, self.now, Vec::new());
        } else if node == commands.relay {
            for side in [Side::Client, Side::Server] {
                self.end(side, Sight::Closed);
            }
        }
    }
}
