//! The in-process twin: all cores in one thread on a virtual clock, links as a seeded model, one event queue.
//!
//! Every sender encodes and every receiver gets bytes; no Rust value crosses between cores. The same seed gives the
//! same log; the whole state can be forked. The limits of the link models are listed in [`net`] and [`stream`].

pub mod assemble;
mod branch;
pub mod clock;
mod command;
pub mod cost;
pub mod delay;
mod disk;
mod flights;
mod guard;
pub mod holder;
pub mod net;
pub mod part;
mod process;
pub mod queue;
mod records;
pub mod replay;
pub mod sabotage;
mod sessions;
pub mod stopwatch;
pub mod stream;
mod tamper;
pub mod trial;
pub mod verified;

use std::collections::{BTreeMap, VecDeque};

use evidence::cue::{Cue, Watch};
use evidence::delivery::Claims;
use evidence::log::{Logged, by_recorder};
use ground_truth::GuardVerdict;
use ground_truth::Note;
use guest::{BusOrder, BusReceipt, Failure, Session};
use topology::{BusEndpoint, Member, ProcessFault, TimedOrder, Turn};
use wire::audit::Journal;
use wire::codec;
use wire::core::{Core, Input, Output, Side, Subject, Topic};
use wire::guest::Fault;
use wire::id::{NodeId, PeerId, SessionId, WorldId};
use wire::policy::Requirement;
use wire::sign::Key;
use wire::time::Instant;

use clock::HostClock;
use command::{Relayed, StreamEvent};
use delay::{Delays, EndPair};
use disk::Disk;
use guard::Guard;
use holder::Client;
use net::Association;
use part::Part;
use process::Processes;
use queue::{Micros, NodeIndex, Queue};
use stopwatch::{Stopwatch, WorkStage};
use verified::{SignatureCounts, Verified};

pub use guard::UNKNOWN_PEER;

/// Time from the start of a process to its first dial.
const OPENS_AT: Micros = 20_000;
/// Time after the relays have ended for which a passed message may still be under way.
const UNDER_WAY: Micros = 50_000;
/// A process of the twin.
pub struct Node {
    /// Identity of the node.
    pub id: NodeId,
    /// Core of the process.
    pub part: Part,
    /// Host of the process: shared memory reaches only the nodes of one host, and they share a clock.
    pub host: u8,
    /// Channels it reads.
    pub subscribes: Vec<Topic>,
    /// Endpoint on its host's shared memory.
    pub endpoint: BusEndpoint,
    /// Role on the command plane.
    pub commands: Option<Client>,
    /// True if the process has steps that wait for a cue.
    pub takes_cues: bool,
    /// True if the process lives.
    pub alive: bool,
    armed: Option<Micros>,
    generation: u64,
}

impl Node {
    /// A running node without channels.
    pub fn new(id: NodeId, part: Part, host: u8) -> Self {
        Self {
            id,
            part,
            host,
            subscribes: Vec::new(),
            endpoint: BusEndpoint::Outside,
            commands: None,
            takes_cues: false,
            alive: true,
            armed: None,
            generation: 0,
        }
    }
}

#[derive(Clone)]
enum Happening {
    Input(Input),
    Timer(u64),
    Datagram { association: u8, end: u8, bytes: Vec<u8> },
    FromUnknownPeer { association: u8, bytes: Vec<u8> },
    Open(u8),
    Stream(StreamEvent),
    Due(sessions::Due),
    Unfinished { bytes: Vec<u8> },
    Distribute { subject: Subject, bytes: Vec<u8> },
    Connect,
    Displaced,
    ProcessFault(usize, Turn),
}

/// Most inputs that are kept for a viewer: hours of a console that is fed forty times a second.
pub const MAX_VIEWED: usize = 1 << 20;

/// An input of a core, and its outputs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JournalEntry {
    /// Time on the core's host.
    pub now: Instant,
    /// Input as fed.
    pub input: Input,
    /// Outputs, in order.
    pub outputs: Vec<Output>,
    /// Time at which the core wants to be woken after the input.
    pub deadline: Option<Instant>,
}

/// The twin of a whole platform, its operator, and the adversary between them.
pub struct Twin {
    /// World of the twin; a fork has another one.
    pub world: WorldId,
    now: Micros,
    queue: Queue<Happening>,
    nodes: Vec<Node>,
    clocks: Vec<HostClock>,
    associations: Vec<Association>,
    /// The dialler's next pause, by association.
    pauses: Vec<Micros>,
    /// Guards by node; those without secure sessions have none.
    guards: Vec<Option<Guard>>,
    broker: Option<broker::Broker>,
    /// The command path with the stream relay in it.
    commands: Option<Relayed>,
    delays: Delays,
    /// Arrival of the last message from one node to another: channels and sockets keep their order.
    latest: Vec<Micros>,
    processes: Processes,
    /// The recorder's disk, where it is to be full for a time.
    disk: Option<Disk>,
    cues: Watch,
    log: Vec<Logged>,
    journal: Journal,
    /// Journal of the broker's refusals.
    refusals: Journal,
    /// Messages that insiders claim to have sent.
    claims: Claims,
    journals: Option<Vec<Vec<JournalEntry>>>,
    /// The node with inputs that are kept for a viewer, and these.
    viewed: Option<(NodeIndex, Vec<JournalEntry>)>,
    verified: Verified,
    stopwatch: Option<Stopwatch>,
    /// The guest that drives the unit under test. It is a process, of which a fork has none.
    guest: Option<Session>,
    /// Attacks on the bus of the guest's own programs.
    bus_orders: Vec<TimedOrder>,
}

/// Parts that a twin is put together from.
pub struct Assembly {
    /// Nodes, in the order that breaks ties.
    pub nodes: Vec<Node>,
    /// Clock of each host.
    pub clocks: Vec<HostClock>,
    /// Secure associations between nodes.
    pub associations: Vec<Association>,
    /// The client with the way to the broker through a stream relay, that relay, and the secret of the model's keys.
    pub commands: Option<(NodeIndex, NodeIndex, [u8; 32])>,
    /// State of the broker's table of rights.
    pub rights: Requirement,
    /// Delays of stages and links.
    pub delays: Delays,
    /// Faults of processes, by plan.
    pub process_faults: Vec<ProcessFault>,
    /// Participants of processes that may be started again.
    pub spare: Vec<Member>,
    /// Processes watched at their inputs for being kept from running.
    pub watched: Vec<NodeId>,
    /// True if the recorder's disk is to be full for a time.
    pub fills: bool,
    /// Steps that wait for an event on the instrument plane.
    pub cues: Vec<Cue>,
    /// True if the inputs and outputs of every core are to be kept.
    pub journals: bool,
    /// The keys of guards and launcher.
    pub witnesses: BTreeMap<NodeId, Key>,
    /// Knowledge of good signatures that the cores share.
    pub verified: Verified,
    /// The guest that drives the unit under test, started.
    pub guest: Option<Session>,
    /// Attacks on the bus of the guest's own programs.
    pub bus_orders: Vec<TimedOrder>,
}

impl Twin {
    /// A twin at time zero.
    pub fn new(assembly: Assembly) -> Twin {
        let mut broker = broker::Broker::with_rights(assembly.rights);
        for peer in assembly.nodes.iter().filter_map(|n| n.commands.as_ref().map(|client| client.peer)) {
            // A refusal here is the broker's answer; such a peer then hears nothing.
            let filter = if peer == PeerId::GATEWAY { "hs/ack/+".to_owned() } else { format!("hs/cmd/{peer}") };
            let _ = broker.subscribe(peer, &filter);
        }
        let key = |node: NodeId| assembly.witnesses.get(&node).cloned();
        let guard = |n: &Node| n.id.guard().map(|id| Guard::new(id, key(id)));
        let guards = assembly.nodes.iter().map(guard).collect();
        let (ingress, notes) = (key(command::BROKER_INGRESS), key(NodeId::CAMPAIGN));
        let mut twin = Twin {
            world: WorldId(0),
            now: 0,
            queue: Queue::default(),
            journals: assembly.journals.then(|| vec![Vec::new(); assembly.nodes.len()]),
            latest: vec![0; assembly.nodes.len() * assembly.nodes.len()],
            nodes: assembly.nodes,
            pauses: vec![sessions::PAUSES.0; assembly.associations.len()],
            clocks: assembly.clocks,
            associations: assembly.associations,
            guards,
            broker: Some(broker),
            commands: assembly.commands.map(|(client, relay, secret)| Relayed::new(client, relay, secret, ingress)),
            delays: assembly.delays,
            processes: Processes::new(assembly.process_faults, assembly.spare, &assembly.watched),
            disk: assembly.fills.then(Disk::new),
            cues: Watch::new(&assembly.cues),
            viewed: None,
            log: Vec::new(),
            journal: Journal::new(NodeId::CAMPAIGN, wire::id::Boot(1), notes),
            refusals: Journal::new(NodeId::BROKER, wire::id::Boot(1), None),
            claims: Claims::default(),
            verified: assembly.verified,
            stopwatch: None,
            guest: assembly.guest,
            bus_orders: assembly.bus_orders,
        };
        for association in 0..twin.associations.len() {
            let [dialler, listener] = [0, 1].map(|end| twin.associations[association].ends[end].node);
            let due = twin.delays.start(twin.way(dialler, listener));
            twin.queue.push(due, dialler, Happening::Open(association as u8));
        }
        twin.open_commands();
        twin.await_process_faults();
        (0..twin.nodes.len()).for_each(|n| twin.settle(n as NodeIndex, None));
        twin
    }

    /// Copy of the state in its own world; the two do not affect each other, and the new one is not watched.
    #[must_use]
    pub fn fork(&self, world: WorldId) -> Twin {
        Twin { log: self.log.clone(), ..self.copy(world) }
    }

    /// A fork without the log so far.
    fn copy(&self, world: WorldId) -> Twin {
        let nodes = self.nodes.iter().map(|n| Node {
            id: n.id,
            part: n.part.fork(world),
            host: n.host,
            subscribes: n.subscribes.clone(),
            endpoint: n.endpoint,
            commands: n.commands.clone(),
            takes_cues: n.takes_cues,
            alive: n.alive,
            armed: n.armed,
            generation: n.generation,
        });
        Twin {
            world,
            now: self.now,
            queue: self.queue.clone(),
            nodes: nodes.collect(),
            clocks: self.clocks.clone(),
            associations: self.associations.clone(),
            pauses: self.pauses.clone(),
            guards: self.guards.clone(),
            broker: self.broker.clone(),
            commands: self.commands.clone(),
            delays: self.delays,
            processes: self.processes.clone(),
            disk: self.disk.clone(),
            cues: self.cues.clone(),
            latest: self.latest.clone(),
            log: Vec::new(),
            journal: self.journal.clone(),
            refusals: self.refusals.clone(),
            claims: self.claims.clone(),
            journals: self.journals.clone(),
            viewed: None,
            verified: self.verified.clone(),
            stopwatch: None,
            guest: None,
            bus_orders: Vec::new(),
        }
    }

    /// True time of the twin.
    pub fn now(&self) -> Micros {
        self.now
    }

    /// Every audit entry so far, in the order in which it was written.
    pub fn log(&self) -> &[Logged] {
        &self.log
    }

    /// True if the recorder's disk takes no bytes, and so the recording lacks its end.
    pub fn cut_short(&self) -> bool {
        self.disk.as_ref().is_some_and(Disk::full)
    }

    /// The log and the stopwatch of a twin that has ended.
    pub fn into_log(self) -> (Vec<Logged>, Option<Stopwatch>) {
        (self.log, self.stopwatch)
    }

    /// Keeps the inputs and outputs of the first start of one node from now on, at most [`MAX_VIEWED`], for a viewer of
    /// its display.
    pub fn view(&mut self, node: NodeId) {
        self.viewed = self.index(node).map(|index| (index, Vec::new()));
    }

    /// The inputs and outputs kept since [`view`](Self::view).
    pub fn take_viewed(&mut self) -> Vec<JournalEntry> {
        self.viewed.take().map_or_else(Vec::new, |(_, entries)| entries)
    }

    /// Adds up the time spent from now on by stage.
    pub fn watch(&mut self, stopwatch: Stopwatch) {
        self.stopwatch = Some(stopwatch);
        self.enter(WorkStage::Engine);
    }

    /// Number of signatures that its cores asked about, and of those verified.
    pub fn signatures(&self) -> SignatureCounts {
        self.verified.counts()
    }

    /// Nodes in the order that breaks ties.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Inputs and outputs of every core, by node, when they were asked for.
    pub fn journals(&self) -> Option<&[Vec<JournalEntry>]> {
        self.journals.as_deref()
    }

    /// Journals of a twin that has ended.
    pub fn into_journals(self) -> Vec<Vec<JournalEntry>> {
        self.journals.unwrap_or_default()
    }

    /// Knowledge of signatures of its cores.
    pub(crate) fn verified(&self) -> &Verified {
        &self.verified
    }

    /// Reading of the clock of `host` at the start.
    pub(crate) fn local_start(&self, host: u8) -> Instant {
        self.clocks[usize::from(host)].read(0)
    }

    /// Runs to `end`.
    pub fn run_until(&mut self, end: Micros) {
        while self.step(end) {}
        self.now = end;
    }

    /// Lets the next event happen, if one is due by `end`; false without one.
    fn step(&mut self, end: Micros) -> bool {
        if self.queue.next_time().is_none_or(|t| t > end) {
            return false;
        }
        let Some((due, node, happening)) = self.queue.pop() else { return false };
        self.now = due;
        self.happen(node, happening);
        true
    }

    /// Ends the run: no new message is sent, those under way arrive, and everyone writes the closing account.
    pub fn finish(&mut self, grace: Micros) {
        self.release_all();
        (0..self.nodes.len() as NodeIndex).for_each(|node| self.feed(node, Input::Quiesce));
        self.run_until(self.now + grace);
        // As live: the relays first, which pass nothing more then, so that nothing is under way while its two ends
        // count.
        for relay in [NodeId::RELAY_TELEMETRY, NodeId::RELAY_COMMAND] {
            self.index(relay).into_iter().for_each(|relay| self.part_with(relay));
        }
        self.run_until(self.now + UNDER_WAY);
        (0..self.nodes.len()).for_each(|node| self.close_guard(node as NodeIndex));
        self.run_until(self.now + 1_000);
        let recorder = self.index(NodeId::RECORDER);
        (0..self.nodes.len() as NodeIndex).filter(|node| Some(*node) != recorder).for_each(|node| self.part_with(node));
        self.run_until(self.now + 1_000);
        recorder.into_iter().for_each(|recorder| self.part_with(recorder));
        self.sign_witnesses();
    }

    /// Has a node write its closing account. As live it is over then: later messages for it are lost.
    fn part_with(&mut self, node: NodeIndex) {
        self.feed(node, Input::Finish);
        self.nodes[usize::from(node)].alive = false;
    }

    fn index(&self, id: NodeId) -> Option<NodeIndex> {
        self.nodes.iter().position(|n| n.id == id).map(|n| n as NodeIndex)
    }

    fn happen(&mut self, node: NodeIndex, happening: Happening) {
        let Some(happening) = self.keep(node, happening) else { return };
        match happening {
            Happening::Timer(generation) => {
                let n = &mut self.nodes[usize::from(node)];
                if generation == n.generation && n.armed.take().is_some() {
                    self.feed(node, Input::Timeout);
                }
            }
            Happening::Input(input) => self.take(node, input),
            Happening::Datagram { association, end, bytes } => self.arrive(association, end, &bytes),
            Happening::FromUnknownPeer { association, bytes } => self.unknown_peer(association, &bytes),
            Happening::Open(association) => self.open(association),
            Happening::Stream(along) => {
                self.enter(WorkStage::Broker);
                self.relay_stream(along);
                self.enter(WorkStage::Engine);
            }
            Happening::Due(due) => self.come_due(due),
            Happening::Unfinished { bytes } => self.note_unknown_peer(node, &bytes, GuardVerdict::Unfinished),
            Happening::Distribute { subject, bytes } => self.distribute(node, self.now, subject, bytes),
            Happening::Connect => self.connect(node),
            Happening::Displaced => self.displaced(node),
            Happening::ProcessFault(fault, turn) => self.fault(fault, turn),
        }
    }

    fn local(&self, node: NodeIndex) -> Instant {
        self.clocks[usize::from(self.nodes[usize::from(node)].host)].read(self.now)
    }

    /// Something comes to a node, which takes it at once, or when it runs again.
    fn take(&mut self, node: NodeIndex, input: Input) {
        let Some(Happening::Input(input)) = self.keep(node, Happening::Input(input)) else { return };
        let Some(input) = self.written(input) else { return };
        if let Input::Published { bytes, .. } = &input {
            self.note_delivered(node, bytes);
        }
        self.feed(node, input);
    }

    /// Feeds one input to a core and carries its outputs away.
    fn feed(&mut self, node: NodeIndex, input: Input) {
        let Some(Happening::Input(input)) = self.keep(node, Happening::Input(input)) else { return };
        if self.nodes[usize::from(node)].alive {
            let now = self.local(node);
            self.note_running(node);
            if let Some(delivery) = self.claims.delivered(self.nodes[usize::from(node)].id, &input) {
                self.note(delivery);
            }
            self.enter(WorkStage::from_part(&self.nodes[usize::from(node)].part));
            self.nodes[usize::from(node)].part.handle(now, &input);
            self.enter(WorkStage::Engine);
            self.settle(node, Some((now, input)));
        }
    }

    fn enter(&mut self, stage: WorkStage) {
        if let Some(stopwatch) = &mut self.stopwatch {
            stopwatch.enter(stage);
        }
    }

    /// Drains a core and re-arms its timer.
    fn settle(&mut self, node: NodeIndex, fed: Option<(Instant, Input)>) {
        let mut outputs: VecDeque<Output> = VecDeque::new();
        while let Some(output) = self.nodes[usize::from(node)].part.output() {
            outputs.push_back(output);
        }
        if let Some((now, input)) = fed {
            self.keep_turn(node, now, input, &outputs);
        }
        if !outputs.is_empty() {
            let due = self.now + self.stage_delay(node, &outputs);
            outputs.into_iter().for_each(|output| self.carry(node, due, output));
        }
        self.arm(node);
    }

    /// Keeps an input with its outputs where they are asked for.
    fn keep_turn(&mut self, node: NodeIndex, now: Instant, input: Input, outputs: &VecDeque<Output>) {
        let viewed = self.viewed.as_mut().filter(|(of, kept)| *of == node && kept.len() < MAX_VIEWED);
        if self.journals.is_none() && viewed.is_none() {
            return;
        }
        let deadline = self.nodes[usize::from(node)].part.deadline();
        let entry = JournalEntry { now, input, outputs: outputs.iter().cloned().collect(), deadline };
        viewed.into_iter().for_each(|(_, kept)| kept.push(entry.clone()));
        self.journals.iter_mut().for_each(|journals| journals[usize::from(node)].push(entry.clone()));
    }

    fn arm(&mut self, node: NodeIndex) {
        let n = &self.nodes[usize::from(node)];
        let clock = self.clocks[usize::from(n.host)];
        let due = n.part.deadline().map(|d| clock.true_time(d).max(self.now));
        if due != n.armed {
            let n = &mut self.nodes[usize::from(node)];
            n.generation += 1;
            n.armed = due;
            if let Some(due) = due {
                self.queue.push(due, node, Happening::Timer(n.generation));
            }
        }
    }

    fn stage_delay(&self, node: NodeIndex, outputs: &VecDeque<Output>) -> Micros {
        let n = &self.nodes[usize::from(node)];
        self.delays.stage(n.id, &n.part, outputs, self.now)
    }

    fn way(&self, from: NodeIndex, to: NodeIndex) -> EndPair {
        (self.nodes[usize::from(from)].id, self.nodes[usize::from(to)].id)
    }

    fn carry(&mut self, node: NodeIndex, time: Micros, output: Output) {
        match output {
            Output::Bus { topic, bytes } => self.publish_bus(node, time, topic, &bytes),
            Output::Record { session, bytes } => {
                if let Some((association, end)) = self.session(node, session) {
                    self.send(association, end, time, &bytes);
                }
            }
            Output::Close { session } => {
                if let Some((association, end)) = self.session(node, session) {
                    self.close(association, end, time + self.delays.datagram(self.way(node, node), time));
                }
            }
            Output::Publish { subject, bytes } => {
                self.enter(WorkStage::Broker);
                self.publish_command(node, time, subject, bytes);
                self.enter(WorkStage::Engine);
            }
            Output::Datagram { side, bytes } => {
                let end = if side == Side::Client { 0 } else { 1 };
                if let Some(association) = self.associations.iter().position(|a| a.relay == Some(node)) {
                    let target = self.associations[association].ends[end].node;
                    let hop = self.delays.datagram(self.way(node, target), time);
                    let due = self.in_order(node, target, time + hop);
                    let datagram = Happening::Datagram { association: association as u8, end: end as u8, bytes };
                    self.queue.push(due, target, datagram);
                }
            }
            Output::Stranger { bytes } => {
                if let Some(association) = self.associations.iter().position(|a| a.relay == Some(node)) {
                    let target = self.associations[association].ends[1].node;
                    let due = time + self.delays.datagram(self.way(node, target), time);
                    self.queue.push(due, target, Happening::FromUnknownPeer { association: association as u8, bytes });
                }
            }
            Output::Audit { bytes } => self.record(self.nodes[usize::from(node)].id, bytes),
            Output::Stream { connection, side, bytes } => {
                self.relayed(node, time, side, StreamEvent::Piece(connection.0, side, bytes));
            }
            Output::Reset { connection } => self.relayed(node, time, Side::Client, StreamEvent::Reset(connection.0)),
            Output::Join => self.want(node, true),
            Output::Leave => self.want(node, false),
            Output::Guest { bytes } => {
                let input = Input::Guest { bytes: self.ask_guest(&bytes) };
                self.queue.push(time, node, Happening::Input(input));
            }
            // For a person.
            Output::Text { .. } => {}
        }
    }

    /// The guest's answer. Virtual time stands still meanwhile: the time that a guest takes is no part of a result.
    fn ask_guest(&mut self, request: &[u8]) -> Vec<u8> {
        self.enter(WorkStage::Guest);
        let open = self.bus_orders.iter().filter(|timed| (timed.from..timed.until).contains(&self.now));
        let orders: Vec<BusOrder> = open.map(|timed| timed.order).collect();
        let answered = self.guest.as_mut().map(|guest| guest.answer_attacked(request, &orders));
        self.enter(WorkStage::Engine);
        let none = || codec::encode(&Failure::new(Fault::Unavailable, "this world has no guest process").answer());
        let Some((answer, receipts)) = answered else { return none() };
        for (order, receipt) in orders.iter().zip(&receipts) {
            self.note(bus_note(order, receipt));
        }
        answer
    }

    /// The association, and its end at `node`, that stands as `session` there.
    fn session(&self, node: NodeIndex, session: SessionId) -> Option<(usize, usize)> {
        self.associations.iter().enumerate().find_map(|(i, a)| Some((i, a.end_of(node, session)?)))
    }

    fn publish_bus(&mut self, node: NodeIndex, time: Micros, topic: Topic, bytes: &[u8]) {
        // The live publisher refuses it too.
        if bytes.len() > topic.max_len() || !self.flushed(node, topic) {
            return;
        }
        let Node { host, endpoint, .. } = self.nodes[usize::from(node)];
        let inside = endpoint.writes_inside(topic);
        for reader in 0..self.nodes.len() {
            let n = &self.nodes[reader];
            if n.host == host && n.subscribes.contains(&topic) && n.endpoint.reads_inside(topic) == inside {
                let hop = self.delays.bus(self.way(node, reader as NodeIndex), time);
                let due = self.in_order(node, reader as NodeIndex, time + hop);
                let input = Input::Bus { topic, bytes: bytes.to_vec() };
                self.queue.push(due, reader as NodeIndex, Happening::Input(input));
            }
        }
    }

    /// `time`, or later if something from `from` to `to` is still under way.
    fn in_order(&mut self, from: NodeIndex, to: NodeIndex, time: Micros) -> Micros {
        let latest = &mut self.latest[usize::from(from) * self.nodes.len() + usize::from(to)];
        *latest = time.max(*latest);
        *latest
    }

    fn record_all(&mut self, id: NodeId, out: VecDeque<Output>) {
        for output in out {
            if let Output::Audit { bytes } = output {
                self.record(id, bytes);
            }
        }
    }

    /// Writes an entry to the log and sends it to the recorder.
    fn record(&mut self, id: NodeId, bytes: Vec<u8>) {
        if id != NodeId::RECORDER
            && by_recorder(id)
            && let Some(recorder) = self.index(NodeId::RECORDER)
        {
            let due = self.now + delay::INSTRUMENT;
            self.queue.push(due, recorder, Happening::Input(Input::Audit { bytes: bytes.clone() }));
        }
        self.claims.note(id, &bytes);
        self.watch_entry(&bytes);
        self.log.push(Logged { at: self.now, node: id, bytes });
    }
}

/// The entry of an attack on a guest's bus in one step.
fn bus_note(order: &BusOrder, receipt: &BusReceipt) -> Note {
    let count = |n: u32| u16::try_from(n).unwrap_or(u16::MAX);
    Note::GuestBus {
        order: order.id,
        attack: order.attack,
        sent: count(receipt.sent),
        received: count(receipt.received),
        honest: count(receipt.honest),
        in_force: receipt.used,
        refused: receipt.refused(),
    }
}
