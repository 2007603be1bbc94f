//! Process faults of a scenario, with their times: the live form of `twin::process`.
//!
//! Ending is SIGKILL, stopping SIGSTOP; a slow process is stopped for a part of each period; a full disk is a limit on
//! the size of files. Only observed effects are reported: a kill by the wait status, a stop by the kernel's process
//! table, a limit by the kernel's answer.

use ground_truth::{Note, StepName, Suspension};
use topology::{ProcessFault, ProcessFaultKind, Topology, Turn, next_turn};
use wire::id::NodeId;

use super::child::Child;
use rustix::process::Rlimit;

use super::disk::{fill, free};

/// The process faults of a run, with their pending turns.
pub(super) struct ProcessFaults {
    list: Vec<ProcessFault>,
    /// Start of each fault that has begun, microseconds of the run.
    begun: Vec<Option<u64>>,
    /// Pending turns: time, fault, turn.
    turns: Vec<(u64, usize, Turn)>,
    /// Applied and observed faults, in order.
    events: Vec<(u64, Note)>,
    /// The limit on the recorder's files before its disk was filled.
    usual: Option<Rlimit>,
}

impl ProcessFaults {
    pub(super) fn new(topology: &Topology) -> Self {
        let by_time = |(i, fault): (usize, &ProcessFault)| fault.waits.is_none().then_some((fault.at, i, Turn::Begin));
        Self {
            begun: vec![None; topology.process_faults.len()],
            turns: topology.process_faults.iter().enumerate().filter_map(by_time).collect(),
            list: topology.process_faults.clone(),
            events: Vec::new(),
            usual: None,
        }
    }

    /// Time of the next turn, microseconds of the run.
    pub(super) fn next_due(&self) -> Option<u64> {
        self.turns.iter().map(|(due_us, ..)| *due_us).min()
    }

    /// Calls a step at `now`: the faults that wait for it get their first turn.
    pub(super) fn call(&mut self, now: u64, step: StepName) {
        for (i, fault) in self.list.iter().enumerate() {
            if let Some(delay) = fault.waits.filter(|_| fault.step == Some(step) && self.begun[i].is_none()) {
                self.turns.push((now.max(fault.at) + delay, i, Turn::Begin));
            }
        }
    }

    /// Applied and observed faults so far, in order.
    pub(super) fn events(&self) -> &[(u64, Note)] {
        &self.events
    }

    /// True if the end of `node` is recorded already.
    pub(super) fn has_ended(&self, node: NodeId) -> bool {
        self.events.iter().any(|(_, event)| matches!(event, Note::Ended { node: n, .. } if *n == node))
    }

    /// Carries out the turn that is due at `now`, if one is; `clock` gives the time of the run after slow operations.
    /// Returns the node to restart, where that is due.
    pub(super) fn carry_out(&mut self, now: u64, children: &mut [Child], clock: &dyn Fn() -> u64) -> Option<NodeId> {
        let due = self.turns.iter().enumerate().filter(|(_, (due_us, ..))| *due_us <= now);
        let next = due.min_by_key(|(_, (due_us, ..))| *due_us)?.0;
        let (due_us, i, turn) = self.turns.remove(next);
        let fault = self.list[i];
        let child = children.iter_mut().rfind(|child| child.node == fault.node);
        match (turn, fault.kind) {
            (Turn::Begin, kind) => {
                if self.begun[i].replace(due_us).is_none() {
                    self.record_step(now, fault, true);
                    self.begin(now, i, kind, child, clock);
                }
            }
            (Turn::Halt | Turn::Release, ProcessFaultKind::Suspend { how, lasts }) => {
                let left = (self.begun[i].unwrap_or(due_us) + lasts).saturating_sub(due_us);
                let halts = turn == Turn::Halt && left > 0;
                // A resumed process may run before the call returns, and a halted one may run until it is seen stopped: so a resumption has
                // the time before the call, a halt the time after it.
                let before = clock();
                let done = child.is_some_and(|child| if halts { child.halt() } else { child.resume() });
                let changed_us = if halts { clock() } else { before };
                if matches!(how, Suspension::Slow { .. }) {
                    self.events.extend(done.then_some((changed_us, Note::Halted { node: fault.node, on: halts })));
                }
                if left > 0 {
                    let (next, delay) = next_turn(turn, how, left);
                    self.turns.push((due_us + delay, i, next));
                } else {
                    let end = Note::Suspended { node: fault.node, how, on: false };
                    self.events.extend(done.then_some((before, end)));
                    self.record_step(clock(), fault, false);
                }
            }
            (Turn::Restart, _) => return Some(fault.node),
            (Turn::Release, ProcessFaultKind::Fill { .. }) => {
                let before = clock();
                let done = child.zip(self.usual).is_some_and(|(child, usual)| free(child.pid(), usual));
                self.events.extend(done.then_some((before, Note::DiskFull { node: fault.node, on: false })));
                self.record_step(clock(), fault, false);
            }
            (Turn::Halt, ProcessFaultKind::Fill { .. })
            | (Turn::Halt | Turn::Release, ProcessFaultKind::Kill { .. }) => {}
        }
        None
    }

    fn begin(
        &mut self,
        now: u64,
        i: usize,
        kind: ProcessFaultKind,
        child: Option<&mut Child>,
        clock: &dyn Fn() -> u64,
    ) {
        let node = self.list[i].node;
        match kind {
            ProcessFaultKind::Kill { restart } => {
                let killed = child.is_some_and(Child::kill);
                self.events.push((now, Note::Ended { node, killed, signal: None }));
                self.turns.extend(restart.map(|delay| (now + delay, i, Turn::Restart)));
            }
            ProcessFaultKind::Suspend { how, lasts } => {
                if child.is_some_and(Child::halt) {
                    let halted_us = clock();
                    self.events.push((halted_us, Note::Suspended { node, how, on: true }));
                    if matches!(how, Suspension::Slow { .. }) {
                        self.events.push((halted_us, Note::Halted { node, on: true }));
                    }
                }
                let (next, delay) = next_turn(Turn::Halt, how, lasts);
                self.turns.push((now + delay, i, next));
            }
            ProcessFaultKind::Fill { lasts } => {
                let filled = child.and_then(|child| fill(child.pid()));
                self.usual = self.usual.or(filled);
                self.events.extend(filled.is_some().then_some((clock(), Note::DiskFull { node, on: true })));
                self.turns.push((now + lasts, i, Turn::Release));
            }
        }
    }

    /// Records an event that the launcher saw.
    pub(super) fn note(&mut self, time_us: u64, event: Note) {
        self.events.push((time_us, event));
    }

    fn record_step(&mut self, time_us: u64, fault: ProcessFault, begun: bool) {
        self.events.extend(fault.step.map(|step| (time_us, Note::Step { step, begun })));
    }
}
