//! The insider on the command plane: it sees orders as they are published, and publishes them again.
//!
//! It holds access to the broker (or a captured order), not an operator's key: it can repeat, not make. Bytes that it
//! has seen before, its own repetitions among them, it takes no second note of.

use std::collections::VecDeque;

use wire::audit::Journal;
use wire::core::{Core, Input, Output, Side, Subject};
use wire::event::{Account, Action, Event, wire_hash};
use wire::id::WorldId;
use wire::setup::Setup;
use wire::time::{Instant, Span};

use crate::opening::{self, Opening};
use crate::plan::{Direction, InsiderCommandConfig, PlanError, RepeatLater};
use crate::schedule::Steps;

/// Most orders remembered; the oldest goes first.
const MAX_ORDERS: usize = 256;

/// See the module.
#[derive(Debug)]
pub struct InsiderCommand {
    /// Each run of copies, with when it begins and ends.
    at_once: Vec<(Opening, u32)>,
    seen: VecDeque<Order>,
    runs: Vec<Run>,
    sent: u64,
    quiet: bool,
    journal: Journal,
    out: VecDeque<Output>,
}

/// A captured order.
#[derive(Clone, Debug)]
struct Order {
    at: Instant,
    subject: Subject,
    bytes: Vec<u8>,
}

/// A run of later repetitions.
#[derive(Clone, Debug)]
struct Run {
    plan: RepeatLater,
    opening: Opening,
    /// Its times, once its beginning is settled.
    steps: Option<Steps>,
    taken: usize,
}

impl InsiderCommand {
    /// An insider that starts at `now`.
    ///
    /// # Errors
    /// A magnitude of the plan outside its bounds.
    pub fn new(setup: Setup, config: InsiderCommandConfig, now: Instant) -> Result<Self, PlanError> {
        config.check()?;
        let later = config.later.iter().map(|run| {
            let lasts = Span::ms(u64::from(run.count - 1) * run.every_ms);
            let opening = Opening::new(run.step, Direction::Up, now, run.at_ms, lasts);
            Run { plan: *run, opening, steps: None, taken: 0 }
        });
        let at_once = config
            .at_once
            .iter()
            .map(|run| (Opening::new(run.step, Direction::Up, now, run.at_ms, Span::ms(run.duration_ms)), run.copies));
        let mut insider = Self {
            at_once: at_once.collect(),
            seen: VecDeque::new(),
            runs: later.collect(),
            sent: 0,
            quiet: false,
            journal: Journal::new(setup.node, setup.boot, Some(setup.key())),
            out: VecDeque::new(),
        };
        insider.journal.write(now, Event::Started, &mut insider.out);
        insider.line_up();
        Ok(insider)
    }

    /// The same insider in a forked world.
    #[must_use]
    pub fn fork(&self, _world: WorldId) -> Self {
        Self {
            at_once: self.at_once.clone(),
            seen: self.seen.clone(),
            runs: self.runs.clone(),
            sent: self.sent,
            quiet: self.quiet,
            journal: self.journal.fork(),
            out: self.out.clone(),
        }
    }

    fn see(&mut self, now: Instant, subject: Subject, bytes: &[u8]) {
        let known = self.seen.iter().any(|order| order.bytes == bytes);
        if known || !matches!(subject, Subject::Command(_)) {
            return;
        }
        if self.seen.len() == MAX_ORDERS {
            self.seen.pop_front();
        }
        let order = Order { at: now, subject, bytes: bytes.to_vec() };
        self.seen.push_back(order.clone());
        if !self.quiet {
            (0..self.copies(now)).for_each(|_| self.repeat(now, &order));
        }
    }

    /// How many copies an order seen at `now` gets.
    fn copies(&self, now: Instant) -> u32 {
        self.at_once.iter().filter(|(opening, _)| opening.is_open(now)).map(|(_, copies)| copies).sum()
    }

    fn openings(&mut self) -> impl Iterator<Item = &mut Opening> {
        self.runs.iter_mut().map(|run| &mut run.opening).chain(self.at_once.iter_mut().map(|(opening, _)| opening))
    }

    /// What began or ended by `now` is told, and what began gets its times.
    fn settle(&mut self, now: Instant) {
        let openings = self.runs.iter_mut().map(|run| &mut run.opening);
        let openings = openings.chain(self.at_once.iter_mut().map(|(opening, _)| opening));
        opening::settle(openings, now, &mut self.journal, &mut self.out);
        self.line_up();
    }

    fn line_up(&mut self) {
        for run in self.runs.iter_mut().filter(|run| run.steps.is_none()) {
            let times = |opens| Steps::new(opens, run.plan.every_ms, run.plan.count, None);
            run.steps = run.opening.opens().map(times);
        }
    }

    /// Later repetitions that are due: the newest order first, then back in turn.
    fn act(&mut self, now: Instant) {
        for i in 0..self.runs.len() {
            while self.runs[i].steps.as_mut().is_some_and(|steps| steps.take(now)) {
                let back = self.runs[i].taken % self.seen.len().max(1);
                let Some(order) = self.seen.iter().rev().nth(back).cloned() else { continue };
                self.runs[i].taken += 1;
                self.repeat(now, &order);
            }
        }
    }

    fn repeat(&mut self, now: Instant, order: &Order) {
        let length = u16::try_from(order.bytes.len()).unwrap_or(u16::MAX);
        let (hash, delay) = (wire_hash(&order.bytes), now.since(order.at));
        let event = Event::Attack { action: Action::RepeatCommand, side: Side::Server, length, hash, delay };
        self.journal.write(now, event, &mut self.out);
        self.sent += 1;
        self.out.push_back(Output::Publish { subject: order.subject, bytes: order.bytes.clone() });
    }
}

impl Core for InsiderCommand {
    fn handle(&mut self, now: Instant, input: &Input) {
        if !self.quiet {
            if let Input::Cue { step } = input {
                self.openings().for_each(|opening| opening.cue(now, *step));
            }
            self.settle(now);
        }
        match input {
            Input::Published { subject, bytes } => self.see(now, *subject, bytes),
            Input::Quiesce => self.quiet = true,
            Input::Finish => {
                self.quiet = true;
                self.journal.write(now, Event::Count { account: Account::Sent, n: self.sent }, &mut self.out);
                return self.journal.sign(now, &mut self.out);
            }
            Input::Timeout
            | Input::Bus { .. }
            | Input::Opened { .. }
            | Input::Record { .. }
            | Input::Closed { .. }
            | Input::Datagram { .. }
            | Input::Stream { .. }
            | Input::Audit { .. }
            | Input::Cue { .. } => {}
        }
        if !self.quiet {
            self.act(now);
        }
    }

    fn deadline(&self) -> Option<Instant> {
        let due = self.runs.iter().filter_map(|run| run.steps.as_ref().and_then(Steps::due));
        let openings = self.runs.iter().map(|run| &run.opening);
        let openings = openings.chain(self.at_once.iter().map(|(opening, _)| opening));
        due.chain(openings.filter_map(Opening::due)).min().filter(|_| !self.quiet)
    }

    fn output(&mut self) -> Option<Output> {
        self.out.pop_front()
    }
}
