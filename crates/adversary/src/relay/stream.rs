//! The relay in the command path: it sees TLS, and can hold, slow, end and damage it, but not read it.
//!
//! A stream keeps its order: a piece is never due before the one ahead of it. When a piece may leave is settled when it
//! comes, by the windows that are known then: one that waits for something does not reach pieces that are already held.
//! An empty piece is the end of its direction. When the medium stops to carry, every connection ends, and none begins
//! until it carries again.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use config::setup::Setup;
use ground_truth::{Note, StreamEffect, StreamPlace};
use rand_chacha::ChaCha8Rng;
use wire::core::{Core, Input, Output, Side};
use wire::event::wire_hash;
use wire::id::SessionId;
use wire::time::{Instant, Span};

use super::{SIDES, Tally, forge};
use crate::opening::Opening;
use crate::outbox::Outbox;
use crate::plan::{Medium, PlanError, StreamAction, StreamRelayConfig, Timed};
use crate::schedule::{chance, stream};

/// Most bytes held for one direction of a connection; beyond, the connection is cut.
const MAX_HELD_BYTES: usize = 1 << 20;
/// Most connections at once, and most cut ones with late bytes that are still recognised.
const MAX_CONNECTIONS: usize = 64;

/// A relay in the command path.
#[derive(Clone, Debug)]
pub struct StreamRelay {
    plan: Arc<[Timed<StreamAction>]>,
    medium: Arc<Medium>,
    started: Instant,
    /// Times at which the medium stops to carry, in order.
    ends: VecDeque<Instant>,
    /// Beginning and end of each action of the plan.
    openings: Vec<Opening>,
    rngs: Vec<ChaCha8Rng>,
    /// Half-closes, resets and cuts that have not yet begun.
    strikes: Vec<bool>,
    connections: BTreeMap<SessionId, [Lane; 2]>,
    cut: VecDeque<SessionId>,
    pub(super) tally: Tally,
    outbox: Outbox,
}

/// Direction of a connection: the bytes held towards one side.
#[derive(Clone, Debug, Default)]
struct Lane {
    pieces: VecDeque<(Instant, Vec<u8>)>,
    bytes: usize,
    last_due: Instant,
    /// Arrival of the newest piece, if no action holds it.
    arrives: Instant,
    /// True once no byte passes any more: the end was sent, or the direction was ended here.
    ended: bool,
    /// Name and place, as the bytes leave: the key that both this journal and the far end's ingress observer can give.
    place: StreamPlace,
}

impl Lane {
    /// The journal's entry for the action on `bytes`, which come next.
    fn tampered(&self, deed: StreamEffect, side: Side, bytes: &[u8], delay: Span) -> Note {
        let mut named = self.place.clone();
        named.pass(bytes);
        Note::Tampered {
            deed,
            side,
            stream: named.name(),
            offset: self.place.offset(),
            length: u32::try_from(bytes.len()).unwrap_or(u32::MAX),
            hash: wire_hash(bytes),
            delay,
        }
    }
}

impl StreamRelay {
    /// A relay that starts at `now`.
    ///
    /// # Errors
    /// A magnitude of the plan outside its bounds.
    pub fn new(setup: Setup, config: StreamRelayConfig, now: Instant) -> Result<Self, PlanError> {
        config.check()?;
        let strike = |timed: &Timed<StreamAction>| match timed.action {
            StreamAction::HalfClose | StreamAction::Reset | StreamAction::Cut => true,
            StreamAction::Delay { .. }
            | StreamAction::Stall
            | StreamAction::Throttle { .. }
            | StreamAction::Corrupt { .. } => false,
        };
        Ok(Self {
            openings: config.actions.iter().map(|timed| Opening::from_timed(timed, now, None)).collect(),
            rngs: (0..config.actions.len()).map(|i| stream(setup.seed, i)).collect(),
            strikes: config.actions.iter().map(strike).collect(),
            plan: config.actions.into(),
            ends: config.medium.ends().map(|end| now + end).collect(),
            medium: Arc::new(config.medium),
            started: now,
            connections: BTreeMap::new(),
            cut: VecDeque::new(),
            tally: Tally::default(),
            outbox: Outbox::new(&setup, now),
        })
    }

    /// Draws from `seed` from now on.
    pub(crate) fn reseed(&mut self, seed: u64) {
        self.rngs.iter_mut().enumerate().for_each(|(i, rng)| *rng = stream(seed, i));
    }

    /// Number of pieces that wait to go towards `side`.
    pub fn held_towards(&self, side: Side) -> u64 {
        self.connections.values().map(|lanes| lanes[side as usize].pieces.len() as u64).sum()
    }

    fn pass(&mut self, now: Instant, connection: SessionId, from: Side, bytes: &[u8]) {
        self.tally.came[from as usize] += 1;
        let side = from.opposite();
        if self.cut.contains(&connection) {
            self.tally.dropped[from as usize] += 1;
            return;
        }
        let travel = self.medium.travel(now.since(self.started));
        // A connection beyond the bound gets an entry all the same, so that its reset is logged and its late bytes are
        // recognised.
        let room = self.connections.contains_key(&connection) || self.connections.len() < MAX_CONNECTIONS;
        self.connections.entry(connection).or_default();
        if !room || (!self.outbox.is_quiet() && self.cutting(now)) {
            self.tally.dropped[from as usize] += 1;
            return self.reset(now, connection);
        }
        let Some(travel) = travel else {
            self.tally.dropped[from as usize] += 1;
            return self.hang_up(connection);
        };
        let lane = self.connections.get(&connection).map(|lanes| &lanes[side as usize]);
        if let Some(lane) = lane.filter(|lane| lane.ended) {
            self.tally.dropped[from as usize] += 1;
            let event = lane.tampered(StreamEffect::HalfClosed, side, bytes, Span::ZERO);
            self.outbox.write(now, event);
            return;
        }
        let (bytes, damaged) = self.damaged(now, side, bytes);
        self.queue(now, travel, (connection, side), bytes, damaged);
    }

    /// True if connections are cut at `now`.
    fn cutting(&self, now: Instant) -> bool {
        let mut actions = self.plan.iter().zip(&self.openings);
        actions.any(|(timed, opening)| matches!(timed.action, StreamAction::Cut) && opening.is_open(now))
    }

    /// The piece, with a flipped bit where the plan asks for it, and whether it has one.
    fn damaged(&mut self, now: Instant, side: Side, bytes: &[u8]) -> (Vec<u8>, bool) {
        let (mut bytes, mut damaged) = (bytes.to_vec(), false);
        if self.outbox.is_quiet() || bytes.is_empty() {
            return (bytes, damaged);
        }
        let plan = Arc::clone(&self.plan);
        for ((timed, opening), rng) in plan.iter().zip(&self.openings).zip(&mut self.rngs) {
            let StreamAction::Corrupt { permille } = timed.action else { continue };
            if opening.open(now, side) && chance(rng, permille) {
                forge::flip(&mut bytes, rng);
                damaged = true;
            }
        }
        (bytes, damaged)
    }

    fn queue(&mut self, now: Instant, travel: Span, way: (SessionId, Side), bytes: Vec<u8>, damaged: bool) {
        let (connection, side) = way;
        let Some(lanes) = self.connections.get_mut(&connection) else { return };
        let lane = &mut lanes[side as usize];
        if lane.bytes + bytes.len() > MAX_HELD_BYTES {
            self.tally.dropped[side.opposite() as usize] += 1;
            return self.reset(now, connection);
        }
        lane.arrives = lane.arrives.max(now + travel);
        let earliest = lane.arrives.max(lane.last_due);
        let due = if self.outbox.is_quiet() {
            earliest
        } else {
            let actions = self.plan.iter().zip(&self.openings).map(|(timed, opening)| (&timed.action, opening));
            due(actions, now, earliest, side, bytes.len())
        };
        lane.last_due = due;
        lane.bytes += bytes.len();
        if damaged {
            let event = lane.tampered(StreamEffect::Damaged, side, &bytes, due.since(now));
            self.outbox.write(now, event);
        }
        if due > lane.arrives {
            let event = lane.tampered(StreamEffect::Held, side, &bytes, due.since(now));
            self.outbox.write(now, event);
        }
        lane.place.pass(&bytes);
        lane.pieces.push_back((due, bytes));
    }

    /// Cuts a connection in both directions and forgets the bytes it held.
    fn reset(&mut self, now: Instant, connection: SessionId) {
        for side in SIDES {
            if let Some(lanes) = self.connections.get(&connection) {
                self.outbox.write(now, lanes[side as usize].tampered(StreamEffect::Reset, side, &[], Span::ZERO));
            }
        }
        self.hang_up(connection);
    }

    /// Ends a connection in both directions and forgets the bytes it held.
    fn hang_up(&mut self, connection: SessionId) {
        let Some(lanes) = self.connections.remove(&connection) else { return };
        for side in SIDES {
            self.tally.dropped[side.opposite() as usize] += lanes[side as usize].pieces.len() as u64;
        }
        if self.cut.len() == MAX_CONNECTIONS {
            self.cut.pop_front();
        }
        self.cut.push_back(connection);
        self.outbox.put(Output::Reset { connection });
    }

    /// Shows the traffic and the calls to the actions that wait; beginnings and ends are logged.
    fn notice(&mut self, now: Instant, input: &Input) {
        let passes = if let Input::Stream { side, .. } = input { Some(side.opposite()) } else { None };
        self.outbox.notice(&mut self.openings, now, input, passes);
    }

    /// Ends every connection when the medium carries no more.
    fn lose(&mut self, now: Instant) {
        if self.ends.pop_front_if(|end| *end <= now).is_some() {
            let open: Vec<SessionId> = self.connections.keys().copied().collect();
            open.into_iter().for_each(|connection| self.hang_up(connection));
        }
    }

    /// Half-closes, resets and cuts that are due.
    fn strike(&mut self, now: Instant) {
        let plan = Arc::clone(&self.plan);
        for (i, timed) in plan.iter().enumerate() {
            let begun = self.openings[i].opens().is_some_and(|opens| opens <= now);
            if !self.strikes[i] || !begun {
                continue;
            }
            self.strikes[i] = false;
            let open: Vec<SessionId> = self.connections.keys().copied().collect();
            for connection in open {
                match timed.action {
                    StreamAction::HalfClose => {
                        timed.direction.destinations().for_each(|side| self.half_close(now, connection, side));
                    }
                    StreamAction::Reset | StreamAction::Cut => self.reset(now, connection),
                    StreamAction::Delay { .. }
                    | StreamAction::Stall
                    | StreamAction::Throttle { .. }
                    | StreamAction::Corrupt { .. } => {}
                }
            }
        }
    }

    /// Ends the way towards `side` behind the bytes already held for it.
    fn half_close(&mut self, now: Instant, connection: SessionId, side: Side) {
        let Some(lanes) = self.connections.get_mut(&connection) else { return };
        let lane = &mut lanes[side as usize];
        if lane.ended || lane.pieces.back().is_some_and(|(_, bytes)| bytes.is_empty()) {
            return;
        }
        lane.pieces.push_back((now.max(lane.last_due), Vec::new()));
        lane.ended = true;
        self.tally.added[side as usize] += 1;
        let event = lane.tampered(StreamEffect::HalfClosed, side, &[], Span::ZERO);
        self.outbox.write(now, event);
    }

    fn release(&mut self, now: Instant) {
        for (connection, lanes) in &mut self.connections {
            for side in SIDES {
                let lane = &mut lanes[side as usize];
                while lane.pieces.front().is_some_and(|(due, _)| *due <= now) {
                    let Some((_, bytes)) = lane.pieces.pop_front() else { break };
                    lane.bytes -= bytes.len();
                    lane.ended |= bytes.is_empty();
                    self.tally.out[side as usize] += 1;
                    self.outbox.put(Output::Stream { connection: *connection, side, bytes });
                }
            }
        }
        let has_ended = |lanes: &[Lane; 2]| lanes.iter().all(|lane| lane.ended && lane.pieces.is_empty());
        self.connections.retain(|_, lanes| !has_ended(lanes));
    }

    /// Writes the closing account. Pieces still held are never sent: they count as dropped.
    fn account(&mut self, now: Instant) {
        for lanes in std::mem::take(&mut self.connections).values() {
            for side in SIDES {
                self.tally.dropped[side.opposite() as usize] += lanes[side as usize].pieces.len() as u64;
            }
        }
        self.tally.write(now, &mut self.outbox);
    }
}

/// Time at which `length` bytes that come at `now`, and may not leave before `earliest`, are through.
fn due<'a>(
    actions: impl Iterator<Item = (&'a StreamAction, &'a Opening)> + Clone,
    now: Instant,
    earliest: Instant,
    side: Side,
    length: usize,
) -> Instant {
    let mut due = earliest;
    for (action, _) in actions.clone().filter(|(_, opening)| opening.open(now, side)) {
        match action {
            StreamAction::Delay { ms } => due = due.max(now + Span::ms(*ms)),
            StreamAction::Throttle { bytes_per_s } => due += Span(length as u64 * 1_000_000 / bytes_per_s),
            StreamAction::Stall
            | StreamAction::HalfClose
            | StreamAction::Reset
            | StreamAction::Cut
            | StreamAction::Corrupt { .. } => {}
        }
    }
    // A stall may begin while a piece waits; one may follow another.
    let stalled = |time: Instant| {
        let mut stalls = actions.clone().filter(|(action, _)| matches!(action, StreamAction::Stall));
        stalls.find(|(_, opening)| opening.open(time, side)).and_then(|(_, opening)| opening.closes())
    };
    while let Some(end) = stalled(due) {
        due = end;
    }
    due
}

impl Core for StreamRelay {
    fn handle(&mut self, now: Instant, input: &Input) {
        self.release(now);
        self.lose(now);
        if !self.outbox.is_quiet() {
            self.notice(now, input);
            self.strike(now);
        }
        if let Input::Stream { connection, side, bytes } = input {
            self.pass(now, *connection, *side, bytes);
        }
        if matches!(input, Input::Finish) {
            self.account(now);
        }
        if !self.outbox.heed(now, input) {
            self.release(now);
        }
    }

    fn deadline(&self) -> Option<Instant> {
        let lanes = self.connections.values().flatten();
        let held = lanes.filter_map(|lane| lane.pieces.front().map(|(due, _)| *due));
        let strikes = self.strikes.iter().zip(&self.openings).filter(|(strikes, _)| **strikes);
        let strikes = strikes.filter_map(|(_, opening)| opening.opens());
        let begins = self.openings.iter().filter_map(Opening::due);
        held.chain(self.ends.front().copied()).chain(strikes.chain(begins).filter(|_| !self.outbox.is_quiet())).min()
    }

    fn output(&mut self) -> Option<Output> {
        self.outbox.next()
    }
}
