//! The relay in the telemetry path: it sees ciphertext, holds it, loses it, repeats it, changes it, adds to it.
//!
//! Without an open action a datagram leaves in the same turn as it came, unchanged. Held datagrams wait in one bounded
//! queue ordered by (due, arrival). Every act is journaled with the hash of the bytes as they are sent; a datagram
//! that merely passes is only counted, as is one that the medium loses.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use config::setup::Setup;
use ground_truth::Action;
use wire::core::{Core, Input, Output, Side};
use wire::time::{Instant, Span};

use super::passing::{Actor, Passing};
use super::{Tally, forge};
use crate::opening::Opening;
use crate::outbox::Outbox;
use crate::plan::{DatagramAction, DatagramRelayConfig, Medium, PlanError, Timed};
use crate::schedule::stream;

/// Most datagrams held at once; further ones are dropped and counted.
const MAX_HELD: usize = 4096;
/// Most datagrams remembered for replay; the oldest goes first.
const MAX_CAPTURED: usize = 4096;

/// A relay in the telemetry path.
#[derive(Clone, Debug)]
pub struct DatagramRelay {
    plan: Arc<[Timed<DatagramAction>]>,
    medium: Arc<Medium>,
    started: Instant,
    captures: bool,
    /// Beginning and end of each action.
    openings: Vec<Opening>,
    actors: Vec<Actor>,
    held: BTreeMap<(Instant, u64), Datagram>,
    arrivals: u64,
    captured: VecDeque<(Instant, Datagram)>,
    before: [Vec<u8>; 2],
    pub(super) tally: Tally,
    outbox: Outbox,
}

/// Bytes on their way towards a side.
#[derive(Clone, Debug)]
struct Datagram {
    towards: Side,
    bytes: Arc<[u8]>,
}

impl DatagramRelay {
    /// A relay that starts at `now`.
    ///
    /// # Errors
    /// A magnitude of the plan outside its bounds.
    pub fn new(setup: Setup, config: DatagramRelayConfig, now: Instant) -> Result<Self, PlanError> {
        config.check()?;
        let opening = |timed: &Timed<DatagramAction>| Opening::from_timed(timed, now, timed.action.counted());
        Ok(Self {
            captures: config.actions.iter().any(|timed| timed.action.captures()),
            openings: config.actions.iter().map(opening).collect(),
            actors: (0..config.actions.len()).map(|i| Actor::new(stream(setup.seed, i))).collect(),
            plan: config.actions.into(),
            medium: Arc::new(config.medium),
            started: now,
            held: BTreeMap::new(),
            arrivals: 0,
            captured: VecDeque::new(),
            before: [Vec::new(), Vec::new()],
            tally: Tally::default(),
            outbox: Outbox::new(&setup, now),
        })
    }

    /// Draws from `seed` from now on.
    pub(crate) fn reseed(&mut self, seed: u64) {
        self.actors.iter_mut().enumerate().for_each(|(i, actor)| actor.rng = stream(seed, i));
    }

    /// Number of datagrams that wait to go towards `side`.
    pub fn held_towards(&self, side: Side) -> u64 {
        self.held.values().filter(|datagram| datagram.towards == side).count() as u64
    }

    fn pass(&mut self, now: Instant, from: Side, bytes: &[u8]) {
        self.tally.came[from as usize] += 1;
        let Some(travel) = self.medium.travel(now.since(self.started)) else {
            self.tally.dropped[from as usize] += 1;
            return;
        };
        let towards = from.opposite();
        let plan = Arc::clone(&self.plan);
        let mut passing = Passing::new(bytes);
        for (i, timed) in plan.iter().enumerate() {
            let opening = &self.openings[i];
            if !self.outbox.is_quiet() && opening.open(now, towards) {
                let since = opening.opens().map_or(Span::ZERO, |opens| now.since(opens));
                let before = &self.before[towards as usize];
                if !self.actors[i].apply(&timed.action, towards, since, before, &mut passing) {
                    self.tally.dropped[from as usize] += 1;
                    self.outbox.attack(now, Action::Drop, from, bytes, Span::ZERO);
                    // A datagram that the relay drops is still at hand for a replay.
                    return self.remember(now, towards, bytes);
                }
            }
        }
        for (action, delay) in &passing.done {
            self.outbox.attack(now, *action, towards, &passing.bytes, *delay);
        }
        self.remember(now, towards, bytes);
        let mut due = now + passing.hold + travel;
        let bytes: Arc<[u8]> = passing.bytes.into();
        self.send(now, due, Datagram { towards, bytes: Arc::clone(&bytes) });
        for _ in 0..passing.copies {
            due += passing.every;
            self.tally.added[towards as usize] += 1;
            self.outbox.attack(now, Action::Duplicate, towards, &bytes, due.since(now));
            self.send(now, due, Datagram { towards, bytes: Arc::clone(&bytes) });
        }
    }

    /// Keeps the parts of a datagram, as it came, that later actions need.
    fn remember(&mut self, now: Instant, towards: Side, bytes: &[u8]) {
        // A relay without a plan keeps no bytes: nothing would use them.
        if self.plan.is_empty() {
            return;
        }
        let before = &mut self.before[towards as usize];
        before.clear();
        before.extend_from_slice(bytes);
        if self.captures {
            if self.captured.len() == MAX_CAPTURED {
                self.captured.pop_front();
            }
            self.captured.push_back((now, Datagram { towards, bytes: bytes.into() }));
        }
    }

    /// Emits a datagram if due, holds it if not, drops it if there is no room.
    fn send(&mut self, now: Instant, due: Instant, datagram: Datagram) {
        if due <= now {
            self.emit(datagram);
        } else if self.held.len() < MAX_HELD {
            self.arrivals += 1;
            self.held.insert((due, self.arrivals), datagram);
        } else {
            let from = datagram.towards.opposite();
            self.tally.dropped[from as usize] += 1;
            self.outbox.attack(now, Action::Drop, from, &datagram.bytes, Span::ZERO);
        }
    }

    fn emit(&mut self, datagram: Datagram) {
        self.tally.out[datagram.towards as usize] += 1;
        self.outbox.put(Output::Datagram { side: datagram.towards, bytes: datagram.bytes.to_vec() });
    }

    fn release(&mut self, now: Instant) {
        while let Some(first) = self.held.first_entry() {
            if first.key().0 > now {
                break;
            }
            let datagram = first.remove();
            self.emit(datagram);
        }
    }

    /// Shows the traffic and the calls to the actions that wait; beginnings and ends are logged.
    fn notice(&mut self, now: Instant, input: &Input) {
        // Before it passes, so that a silence that it ends counts as one.
        self.outbox.settle(self.openings.iter_mut(), now);
        let passes = if let Input::Datagram { side, .. } = input { Some(side.opposite()) } else { None };
        self.outbox.notice(&mut self.openings, now, input, passes);
    }

    /// The relay's own datagrams, as far as they are due.
    fn act(&mut self, now: Instant) {
        let plan = Arc::clone(&self.plan);
        for (i, timed) in plan.iter().enumerate() {
            let mut due = 0;
            while self.openings[i].take(now) {
                due += 1;
            }
            if due > 0 {
                self.originate(now, i, timed, due);
            }
        }
    }

    fn originate(&mut self, now: Instant, i: usize, timed: &Timed<DatagramAction>, due: usize) {
        match timed.action {
            DatagramAction::Replay { lag_ms, every_ms, .. } => {
                for datagram in self.old_enough(now, Span::ms(lag_ms), timed, every_ms == 0, due) {
                    self.add(now, Action::Replay, datagram.towards, datagram.bytes);
                }
            }
            DatagramAction::Reoriginate { .. } => {
                let newest = self.captured.iter().rev().find(|(_, datagram)| datagram.towards == Side::Server);
                let Some(bytes) = newest.map(|(_, datagram)| Arc::clone(&datagram.bytes)) else { return };
                // Sent from an address of the relay's own: the bytes are genuine, and only their source tells them
                // apart.
                (0..due).for_each(|_| self.unknown_peer(now, Action::Reoriginate, bytes.to_vec()));
            }
            DatagramAction::Inject { content, .. } if content.from_unknown_peer() => {
                for _ in 0..due {
                    let bytes = forge::inject(content, &mut self.actors[i].rng);
                    self.unknown_peer(now, Action::Inject, bytes);
                }
            }
            DatagramAction::Inject { content, .. } => {
                for _ in 0..due {
                    for towards in timed.direction.destinations() {
                        let bytes = forge::inject(content, &mut self.actors[i].rng);
                        self.add(now, Action::Inject, towards, bytes.into());
                    }
                }
            }
            DatagramAction::Delay { .. }
            | DatagramAction::Jitter { .. }
            | DatagramAction::Loss { .. }
            | DatagramAction::BurstLoss { .. }
            | DatagramAction::Duplicate { .. }
            | DatagramAction::Reorder { .. }
            | DatagramAction::Corrupt { .. } => {}
        }
    }

    /// The `n` newest captured datagrams of that age, oldest first; or the newest, `n` times.
    fn old_enough(
        &self,
        now: Instant,
        lag: Span,
        timed: &Timed<DatagramAction>,
        burst: bool,
        n: usize,
    ) -> Vec<Datagram> {
        let mut old = self
            .captured
            .iter()
            .rev()
            .filter(|(time, datagram)| *time + lag <= now && timed.direction.covers(datagram.towards))
            .map(|(_, datagram)| datagram.clone());
        if burst {
            let mut newest: Vec<Datagram> = old.take(n).collect();
            newest.reverse();
            newest
        } else {
            old.next().map(|datagram| vec![datagram; n]).unwrap_or_default()
        }
    }

    fn add(&mut self, now: Instant, action: Action, towards: Side, bytes: Arc<[u8]>) {
        self.tally.added[towards as usize] += 1;
        self.outbox.attack(now, action, towards, &bytes, Span::ZERO);
        self.emit(Datagram { towards, bytes });
    }

    fn unknown_peer(&mut self, now: Instant, action: Action, bytes: Vec<u8>) {
        self.tally.unknown_peers += 1;
        self.outbox.attack(now, action, Side::Server, &bytes, Span::ZERO);
        self.outbox.put(Output::Stranger { bytes });
    }

    /// The closing account. Datagrams still held will never be sent: they count as dropped.
    fn account(&mut self, now: Instant) {
        for (_, datagram) in std::mem::take(&mut self.held) {
            self.tally.dropped[datagram.towards.opposite() as usize] += 1;
        }
        self.tally.write(now, &mut self.outbox);
    }
}

impl Core for DatagramRelay {
    fn handle(&mut self, now: Instant, input: &Input) {
        self.release(now);
        if !self.outbox.is_quiet() {
            self.notice(now, input);
        }
        if let Input::Datagram { side, bytes } = input {
            self.pass(now, *side, bytes);
        }
        if matches!(input, Input::Finish) {
            self.account(now);
        }
        if !self.outbox.heed(now, input) && !self.outbox.is_quiet() {
            self.act(now);
        }
    }

    fn deadline(&self) -> Option<Instant> {
        let held = self.held.keys().next().map(|(due, _)| *due);
        let actions = self.openings.iter().filter_map(Opening::due);
        held.into_iter().chain(actions.filter(|_| !self.outbox.is_quiet())).min()
    }

    fn output(&mut self) -> Option<Output> {
        self.outbox.next()
    }
}
