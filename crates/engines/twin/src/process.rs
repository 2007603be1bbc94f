//! Process faults of a twin: processes end, are kept from running, find their disk full, are started again; and the
//! calls to steps that wait for an event on the instrument plane.
//!
//! A process that does not run is fed no input and wakes at no deadline, while its host's clock goes on. Inputs for it
//! wait as they would in front of a stopped process: as much as the channel or socket keeps. A slow process is one that
//! is stopped for a part of each period, whether or not it has anything to do, which is harsher than a processor quota.

use std::collections::{BTreeMap, VecDeque};

use config::setup::Setup;
use evidence::delivery::Running;
use ground_truth::{Note, StepName, Suspension};
use topology::{Member, ProcessFault, ProcessFaultKind, Turn, next_turn};
use wire::core::{Input, Side};
use wire::id::{Boot, NodeId};
use wire::time::Instant;

use super::command::StreamEvent;
use super::part::make::core;
use super::queue::{Micros, NodeIndex};
use super::{Happening, OPENS_AT, Twin};

/// Time from an entry on the instrument plane to who is called because of it: the recorder, the launcher, a pipe.
const CUE: Micros = 500;
/// Most datagrams that wait in front of a socket: as many small ones as the kernel's usual limit on buffers holds.
const DATAGRAMS: usize = 256;
/// Anything else that waits for one process: the instrument plane's own bound, the longest of all.
const WAITING: usize = link::instrument::QUEUE;

/// Planned faults of processes, and the processes that are halted.
#[derive(Clone, Default)]
pub(super) struct Processes {
    process_faults: Vec<ProcessFault>,
    /// Beginning of each, once it has begun.
    begun: Vec<Option<Micros>>,
    /// Inputs that wait for each process that does not run, in order.
    halted: BTreeMap<NodeId, VecDeque<(NodeIndex, Happening)>>,
    /// Participants of processes that may be started again.
    spare: Vec<Member>,
    /// Processes watched at their inputs.
    running: Running,
}

impl Processes {
    pub(super) fn new(process_faults: Vec<ProcessFault>, spare: Vec<Member>, watched: &[NodeId]) -> Self {
        let running = Running::new(watched);
        Self { begun: vec![None; process_faults.len()], process_faults, halted: BTreeMap::new(), spare, running }
    }
}

impl Twin {
    /// ProcessFaults that begin by their time.
    pub(super) fn await_process_faults(&mut self) {
        for (i, fault) in self.processes.process_faults.clone().into_iter().enumerate() {
            if fault.waits.is_none() {
                self.turn_at(i, Turn::Begin, fault.at);
            }
        }
    }

    fn turn_at(&mut self, fault: usize, turn: Turn, time: Micros) {
        // The broker is no node here: it only routes.
        let node = self.index(self.processes.process_faults[fault].node).unwrap_or(0);
        self.queue.push(time, node, Happening::ProcessFault(fault, turn));
    }

    /// An entry was written: steps that waited for it are called.
    pub(super) fn watch_entry(&mut self, bytes: &[u8]) {
        if !self.cues.is_waiting() {
            return;
        }
        let Ok(entry) = ground_truth::Entry::decode(bytes) else { return };
        for step in self.cues.take(self.now, entry.node, &entry.event) {
            self.call(step);
        }
    }

    fn call(&mut self, step: StepName) {
        let due = self.now + CUE;
        for node in 0..self.nodes.len() {
            if self.nodes[node].takes_cues {
                self.queue.push(due, node as NodeIndex, Happening::Input(Input::Cue { step: step.cue() }));
            }
        }
        for (i, fault) in self.processes.process_faults.clone().into_iter().enumerate() {
            if let Some(after) = fault.waits.filter(|_| fault.step == Some(step)) {
                self.turn_at(i, Turn::Begin, due.max(fault.at) + after);
            }
        }
    }

    pub(super) fn fault(&mut self, i: usize, turn: Turn) {
        let fault = self.processes.process_faults[i];
        match (turn, fault.kind) {
            (Turn::Begin, kind) => {
                if self.processes.begun[i].replace(self.now).is_none() {
                    self.tell_step(fault, true);
                    self.begin(i, fault, kind);
                }
            }
            (Turn::Restart, _) => self.restart(fault.node),
            (Turn::Halt | Turn::Release, ProcessFaultKind::Suspend { how, lasts }) => {
                let end = self.processes.begun[i].unwrap_or(self.now) + lasts;
                self.alternate(i, fault, turn, how, end);
            }
            (Turn::Release, ProcessFaultKind::Fill { .. }) => {
                self.fill(fault.node, false);
                self.tell_step(fault, false);
            }
            (Turn::Halt, ProcessFaultKind::Fill { .. })
            | (Turn::Halt | Turn::Release, ProcessFaultKind::Kill { .. }) => {}
        }
    }

    fn begin(&mut self, i: usize, fault: ProcessFault, kind: ProcessFaultKind) {
        match kind {
            ProcessFaultKind::Kill { restart } => {
                self.end_process(fault.node);
                if let Some(after) = restart {
                    self.turn_at(i, Turn::Restart, self.now + after);
                }
            }
            ProcessFaultKind::Suspend { how, lasts } => {
                self.note(Note::Suspended { node: fault.node, how, on: true });
                self.alternate(i, fault, Turn::Halt, how, self.now + lasts);
            }
            ProcessFaultKind::Fill { lasts } => {
                self.fill(fault.node, true);
                self.turn_at(i, Turn::Release, self.now + lasts);
            }
        }
    }

    /// Halts or releases, and says when the other is due. At `end` it is over.
    fn alternate(&mut self, i: usize, fault: ProcessFault, turn: Turn, how: Suspension, end: Micros) {
        let ended = self.now >= end;
        let halts = turn == Turn::Halt && !ended;
        if matches!(how, Suspension::Slow { .. }) {
            self.note(Note::Halted { node: fault.node, on: halts });
        }
        if halts {
            self.processes.halted.entry(fault.node).or_default();
        } else {
            self.release(fault.node);
        }
        if ended {
            self.note(Note::Suspended { node: fault.node, how, on: false });
            return self.tell_step(fault, false);
        }
        let (next, after) = next_turn(turn, how, end - self.now);
        self.turn_at(i, next, self.now + after);
    }

    /// The waiting inputs are taken in order, then the deadline that has passed.
    fn release(&mut self, id: NodeId) {
        let Some(waiting) = self.processes.halted.remove(&id) else { return };
        for (node, happening) in waiting {
            self.happen(node, happening);
        }
        if let Some(node) = self.index(id) {
            self.nodes[usize::from(node)].armed = None;
            self.arm(node);
        }
    }

    /// At the end of a run everybody runs, so that everybody can close its account.
    pub(super) fn release_all(&mut self) {
        for id in self.processes.halted.keys().copied().collect::<Vec<_>>() {
            self.release(id);
        }
    }

    /// Keeps an event of a process that does not run; gives back one that is to happen now.
    pub(super) fn keep(&mut self, node: NodeIndex, happening: Happening) -> Option<Happening> {
        if self.processes.halted.is_empty() {
            return Some(happening);
        }
        let Some(id) = self.concerned(node, &happening) else { return Some(happening) };
        if matches!(happening, Happening::Timer(_)) {
            // Armed again when it runs again.
            return None;
        }
        let overflows = overflows(self.processes.halted.get(&id)?, &happening);
        match overflows {
            Overflow::None => {}
            Overflow::Newest => {
                if let Some(guard) = self.index(id).and_then(|index| self.guards[usize::from(index)].as_mut()) {
                    guard.kernel_dropped += u64::from(!matches!(happening, Happening::Input(_)));
                }
                return None;
            }
            Overflow::Oldest(at) => {
                self.processes.halted.get_mut(&id)?.remove(at);
            }
        }
        self.processes.halted.get_mut(&id)?.push_back((node, happening));
        None
    }

    /// The halted process that this waits for, if it does.
    fn concerned(&self, node: NodeIndex, happening: &Happening) -> Option<NodeId> {
        let id = |node: NodeIndex| self.nodes[usize::from(node)].id;
        let end = |association: u8, end: usize| id(self.associations[usize::from(association)].ends[end].node);
        let halted = |id: NodeId| self.processes.halted.contains_key(&id).then_some(id);
        match happening {
            Happening::Input(_) | Happening::Timer(_) | Happening::Unfinished { .. } | Happening::Displaced => {
                halted(id(node))
            }
            Happening::Datagram { association, end: at, .. } => halted(end(*association, usize::from(*at))),
            Happening::FromUnknownPeer { association, .. } => halted(end(*association, 1)),
            Happening::Open(association) => halted(end(*association, 0)),
            Happening::Due(due) => halted(end(due.association, usize::from(due.end))),
            Happening::Distribute { .. } | Happening::Connect => halted(NodeId::BROKER),
            Happening::Stream(along) => match along {
                StreamEvent::Dial
                | StreamEvent::Patience(_)
                | StreamEvent::KeepAlive(_)
                | StreamEvent::Piece(_, Side::Client, _) => halted(id(node)),
                StreamEvent::Order(..) | StreamEvent::Handshake(_) | StreamEvent::Piece(_, Side::Server, _) => {
                    halted(NodeId::BROKER)
                }
                StreamEvent::Reset(_) => None,
            },
            Happening::ProcessFault(..) => None,
        }
    }

    pub(super) fn end_process(&mut self, id: NodeId) {
        self.processes.halted.remove(&id);
        match self.index(id) {
            Some(node) => {
                let n = &mut self.nodes[usize::from(node)];
                n.alive = false;
                n.generation += 1;
                self.note(Note::Ended { node: id, killed: true, signal: None });
                self.killed_on_path(node);
            }
            None if id == NodeId::BROKER => {
                self.broker = None;
                self.broker_killed();
                self.note(Note::Ended { node: id, killed: true, signal: None });
            }
            None => {}
        }
    }

    /// A new core under the next boot, as a supervisor would start it: it knows no state of the one before.
    fn restart(&mut self, id: NodeId) {
        let member = self.processes.spare.iter().find(|m| m.node() == id).cloned();
        let (Some(member), Some(node)) = (member, self.index(id)) else { return };
        let member = member.restarted(self.now);
        let boot = Boot(member.setup.boot.0 + 1);
        let setup = Setup { boot, verifier: Some(self.verified.shared()), ..member.setup };
        // An equal setup made the first one.
        let Ok(part) = core(&member.role, setup, self.local(node)) else { return };
        let n = &mut self.nodes[usize::from(node)];
        (n.part, n.alive, n.armed) = (part, true, None);
        n.generation += 1;
        // A viewer follows one core: its second start is another one.
        if let Some((of, _)) = self.viewed.as_mut().filter(|(of, _)| *of == node) {
            *of = NodeIndex::MAX;
        }
        self.note(Note::Restarted { node: id, boot });
        for a in 0..self.associations.len() {
            for end in [0, 1] {
                if self.associations[a].ends[end].node == node {
                    self.associations[a].forget(end);
                }
            }
            if self.associations[a].ends[0].node == node {
                self.queue.push(self.now + OPENS_AT, node, Happening::Open(a as u8));
            }
        }
        if self.commands.as_ref().is_some_and(|commands| commands.client == node) {
            self.queue.push(self.now + OPENS_AT, node, Happening::Stream(StreamEvent::Dial));
        }
        self.settle(node, None);
    }

    fn tell_step(&mut self, fault: ProcessFault, begun: bool) {
        if let Some(step) = fault.step {
            self.note(Note::Step { step, begun });
        }
    }

    /// The core of a node that is watched at its inputs is fed: reported once in a few milliseconds.
    pub(super) fn note_running(&mut self, node: NodeIndex) {
        let (id, now) = (self.nodes[usize::from(node)].id, self.now);
        if self.processes.running.note_due(id, now) {
            self.note(Note::Ran { node: id });
        }
    }

    /// The launcher signs its notes, where it made any, for the last time.
    pub(super) fn sign_notes(&mut self) {
        if self.journal.counter() > 0 {
            let mut out = VecDeque::new();
            self.journal.sign(Instant(self.now), &mut out);
            self.record_all(NodeId::CAMPAIGN, out);
        }
    }

    /// An entry of the campaign's own.
    pub(super) fn note(&mut self, event: Note) {
        let mut out = VecDeque::new();
        self.journal.write(Instant(self.now), event, &mut out);
        self.record_all(NodeId::CAMPAIGN, out);
    }
}

/// Input that has to go to make room.
enum Overflow {
    None,
    /// The newest: a socket's buffer is full.
    Newest,
    /// The one at this place: a channel keeps the newest.
    Oldest(usize),
}

fn overflows(waiting: &VecDeque<(NodeIndex, Happening)>, happening: &Happening) -> Overflow {
    let datagram = |h: &Happening| {
        let relayed = matches!(h, Happening::Input(Input::Datagram { .. }));
        relayed || matches!(h, Happening::Datagram { .. } | Happening::FromUnknownPeer { .. })
    };
    if let Happening::Input(Input::Bus { topic, .. }) = happening {
        let same = |h: &Happening| matches!(h, Happening::Input(Input::Bus { topic: t, .. }) if t == topic);
        let full = waiting.iter().filter(|(_, h)| same(h)).count() >= link::bus::buffer_depth(*topic);
        let oldest = waiting.iter().position(|(_, h)| same(h)).filter(|_| full);
        return oldest.map_or(Overflow::None, Overflow::Oldest);
    }
    let full = datagram(happening) && waiting.iter().filter(|(_, h)| datagram(h)).count() >= DATAGRAMS;
    if full || waiting.len() >= WAITING { Overflow::Newest } else { Overflow::None }
}
