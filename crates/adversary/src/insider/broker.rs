//! The hostile broker: the holder of the broker's certificate and key, in the broker's place.
//!
//! It is handed every publication and delivers to the subscribers as its plan says: fewer, later, in another order,
//! more often, or others. It reads the publications it carries, for the command plane keeps no secret from the broker,
//! and holds no operator's and no unit's key. Making orders and acknowledgements is left to `forgery`.

#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use wire::command::OrderKind;

use config::setup::Setup;
use ground_truth::Action;
use wire::core::{Core, Input, Output, Side, Subject};
use wire::event::{Account, Event};
use wire::id::{PeerId, UnitId};
use wire::time::{Instant, Span};

use super::forgery::Forger;
use crate::opening::Opening;
use crate::outbox::Outbox;
use crate::plan::{BrokerAction, Direction, InsiderBrokerConfig, PlanError, Timed};

/// Most publications remembered; the oldest goes first.
const MAX_SEEN: usize = 256;
/// Most publications held back at once; further ones are not passed on.
const MAX_HELD: usize = 256;

/// A hostile broker.
#[derive(Clone, Debug)]
pub struct InsiderBroker {
    actions: Vec<Timed<BrokerAction>>,
    /// Beginning and end of each action.
    openings: Vec<Opening>,
    seen: VecDeque<Publication>,
    held: Vec<Held>,
    runs: Vec<Run>,
    forger: Forger,
    sent: u64,
    outbox: Outbox,
}

#[derive(Clone, Debug)]
struct Publication {
    at: Instant,
    subject: Subject,
    bytes: Vec<u8>,
}

/// A publication that waits for its time, or for the next of its direction.
#[derive(Clone, Debug)]
struct Held {
    due: Instant,
    overtaken: bool,
    publication: Publication,
}

/// A run of publications by itself.
#[derive(Clone, Debug)]
struct Run {
    /// Number of the action in the plan.
    index: usize,
    action: BrokerAction,
    direction: Direction,
    taken: usize,
}

impl InsiderBroker {
    /// A broker that starts at `now`.
    ///
    /// # Errors
    /// A magnitude of the plan outside its bounds.
    pub fn new(setup: Setup, config: InsiderBrokerConfig, now: Instant) -> Result<Self, PlanError> {
        config.check()?;
        let run = |(index, timed): (usize, &Timed<BrokerAction>)| {
            timed.action.counted()?;
            Some(Run { index, action: timed.action, direction: timed.direction, taken: 0 })
        };
        let opening = |timed: &Timed<BrokerAction>| Opening::from_timed(timed, now, timed.action.counted());
        Ok(Self {
            openings: config.actions.iter().map(opening).collect(),
            seen: VecDeque::new(),
            held: Vec::new(),
            runs: config.actions.iter().enumerate().filter_map(run).collect(),
            actions: config.actions,
            forger: Forger::new(setup.key()),
            sent: 0,
            outbox: Outbox::new(&setup, now),
        })
    }

    /// A publication came.
    fn take(&mut self, now: Instant, subject: Subject, bytes: &[u8]) {
        let publication = Publication { at: now, subject, bytes: bytes.to_vec() };
        let side = destination_side(subject);
        let kind = self.forger.note(subject, bytes);
        self.remember(publication.clone());
        if let (false, Subject::Command(unit)) = (self.outbox.is_quiet(), subject) {
            self.acknowledge(now, unit, bytes);
        }
        let open: Vec<BrokerAction> = if self.outbox.is_quiet() { Vec::new() } else { self.open(now, side).collect() };
        let matches_kind = |only: Option<OrderKind>| only.is_none() || only == kind;
        if open.iter().any(|action| matches!(action, BrokerAction::Drop { only } if matches_kind(*only))) {
            return self.log_attack(now, Action::Drop, &publication, Span::ZERO);
        }
        let delay: u64 = open
            .iter()
            .map(|action| {
                if let BrokerAction::Delay { ms, only } = action
                    && matches_kind(*only)
                {
                    *ms
                } else {
                    0
                }
            })
            .sum();
        if delay > 0 {
            self.log_attack(now, Action::Delay, &publication, Span::ms(delay));
            return self.hold(now, Held { due: now + Span::ms(delay), overtaken: false, publication });
        }
        let waits = self.held.iter().any(|held| held.overtaken && destination_side(held.publication.subject) == side);
        let reorder = open.iter().find_map(|action| {
            if let BrokerAction::Reorder { hold_ms } = action { Some(Span::ms(*hold_ms)) } else { None }
        });
        if let Some(hold) = reorder.filter(|_| !waits) {
            return self.hold(now, Held { due: now + hold, overtaken: true, publication });
        }
        self.deliver(publication.clone());
        self.release(now, |held| held.overtaken && destination_side(held.publication.subject) == side);
        let copies: u32 =
            open.iter().map(|action| if let BrokerAction::Duplicate { copies } = action { *copies } else { 0 }).sum();
        for _ in 0..copies {
            self.log_attack(now, Action::Duplicate, &publication, Span::ZERO);
            self.deliver(publication.clone());
        }
    }

    /// The actions that are open for publications towards `side`.
    fn open(&self, now: Instant, side: Side) -> impl Iterator<Item = BrokerAction> {
        let actions = self.actions.iter().zip(&self.openings);
        actions.filter(move |(_, opening)| opening.open(now, side)).map(|(timed, _)| timed.action)
    }

    /// Shows the traffic and the calls to the actions that wait; beginnings and ends are logged.
    fn notice(&mut self, now: Instant, input: &Input) {
        let passes = if let Input::Published { subject, .. } = input { Some(destination_side(*subject)) } else { None };
        self.outbox.notice(&mut self.openings, now, input, passes);
    }

    fn remember(&mut self, publication: Publication) {
        if self.seen.len() == MAX_SEEN {
            self.seen.pop_front();
        }
        self.seen.push_back(publication);
    }

    fn hold(&mut self, now: Instant, held: Held) {
        if self.held.len() < MAX_HELD {
            self.held.push(held);
        } else {
            self.log_attack(now, Action::Drop, &held.publication, Span::ZERO);
        }
    }

    /// Delivers the publications held and `wanted`; those overtaken are logged now, when their delay is known.
    fn release(&mut self, now: Instant, wanted: impl Fn(&Held) -> bool) {
        let (released, held_back) = std::mem::take(&mut self.held).into_iter().partition(wanted);
        self.held = held_back;
        let released: Vec<Held> = released;
        for Held { overtaken, publication, .. } in released {
            if overtaken {
                self.log_attack(now, Action::Reorder, &publication, now.since(publication.at));
            }
            self.deliver(publication);
        }
    }

    /// Forged acknowledgements of an order that came.
    fn acknowledge(&mut self, now: Instant, unit: UnitId, order: &[u8]) {
        let forged: Vec<Vec<u8>> = self
            .open(now, Side::Server)
            .filter_map(|action| if let BrokerAction::Forge { forgery } = action { Some(forgery) } else { None })
            .filter_map(|forgery| self.forger.acknowledgement(forgery, order))
            .collect();
        for bytes in forged {
            let publication = Publication { at: now, subject: Subject::Ack(unit), bytes };
            self.log_attack(now, Action::Inject, &publication, Span::ZERO);
            self.deliver(publication);
        }
    }

    /// A subscriber's session stands.
    fn connected(&mut self, now: Instant, peer: PeerId) {
        let retains = |side: Side| self.open(now, side).any(|action| action == BrokerAction::Retain);
        let of_peer = |p: &&Publication| match p.subject {
            Subject::Command(unit) => unit.peer() == peer,
            Subject::Ack(_) => peer == PeerId::GATEWAY,
        };
        let newest = self.seen.iter().rev().find(of_peer).filter(|p| retains(destination_side(p.subject)));
        if let Some(publication) = newest.cloned().filter(|_| !self.outbox.is_quiet()) {
            self.log_attack(now, Action::Replay, &publication, now.since(publication.at));
            self.deliver(publication);
        }
    }

    /// Actions due by themselves.
    fn act(&mut self, now: Instant) {
        self.release(now, |held| held.due <= now);
        for i in 0..self.runs.len() {
            while self.openings[self.runs[i].index].take(now) {
                let attempts = self.runs[i].taken;
                self.runs[i].taken += 1;
                match self.runs[i].action {
                    BrokerAction::Replay { .. } => self.replay(now, self.runs[i].direction, attempts),
                    BrokerAction::Invent { kind, forgery, .. } => {
                        let Some(bytes) = self.forger.order(forgery, kind) else { continue };
                        let publication = Publication { at: now, subject: Subject::Command(UnitId::A), bytes };
                        self.log_attack(now, Action::Inject, &publication, Span::ZERO);
                        self.deliver(publication);
                    }
                    // Done to what passes, and in no run.
                    BrokerAction::Drop { .. }
                    | BrokerAction::Delay { .. }
                    | BrokerAction::Reorder { .. }
                    | BrokerAction::Duplicate { .. }
                    | BrokerAction::Retain
                    | BrokerAction::Forge { .. } => {}
                }
            }
        }
    }

    fn replay(&mut self, now: Instant, direction: Direction, attempts: usize) {
        let captured: Vec<&Publication> =
            self.seen.iter().rev().filter(|p| direction.covers(destination_side(p.subject))).collect();
        let Some(publication) = captured.get(attempts % captured.len().max(1)).map(|p| (*p).clone()) else { return };
        self.log_attack(now, Action::Replay, &publication, now.since(publication.at));
        self.deliver(publication);
    }

    fn log_attack(&mut self, now: Instant, action: Action, publication: &Publication, delay: Span) {
        self.outbox.attack(now, action, destination_side(publication.subject), &publication.bytes, delay);
    }

    fn deliver(&mut self, publication: Publication) {
        self.sent += 1;
        self.outbox.put(Output::Publish { subject: publication.subject, bytes: publication.bytes });
    }
}

/// Orders go down to the client that is a unit, acknowledgements up to the gateway.
fn destination_side(subject: Subject) -> Side {
    match subject {
        Subject::Command(_) => Side::Client,
        Subject::Ack(_) => Side::Server,
    }
}

impl Core for InsiderBroker {
    fn handle(&mut self, now: Instant, input: &Input) {
        if !self.outbox.is_quiet() {
            self.notice(now, input);
        }
        if let Input::Published { subject, bytes } = input {
            self.take(now, *subject, bytes);
        }
        if let Input::Opened { peer, .. } = input {
            self.connected(now, *peer);
        }
        if matches!(input, Input::Quiesce) {
            self.release(now, |_| true);
        }
        if matches!(input, Input::Finish) {
            self.outbox.write(now, Event::Count { account: Account::Sent, n: self.sent });
        }
        if !self.outbox.heed(now, input) && !self.outbox.is_quiet() {
            self.act(now);
        }
    }

    fn deadline(&self) -> Option<Instant> {
        let actions = self.openings.iter().filter_map(Opening::due);
        actions.chain(self.held.iter().map(|held| held.due)).min().filter(|_| !self.outbox.is_quiet())
    }

    fn output(&mut self) -> Option<Output> {
        self.outbox.next()
    }
}
