//! The rogue station: it holds a stolen signing key and gives orders with it, as a console would and when it likes.
//!
//! It has either its own station at the gateway, with a channel that is its own, or a certificate for the broker, past
//! the gateway. It reads the feed of the control host for the values that an order has to repeat (nonce, tracks, the
//! newest counter), and believes all of it. Both steps of an order away from safe go out one after the other.

use crate::plan::order::command;
use std::collections::BTreeMap;

use config::setup::Setup;
use ground_truth::Note;
use minicbor::bytes::ByteSlice;
use sha2::{Digest, Sha256};
use wire::bus::{HEADER_LEN, Sender, TAG_LEN};
use wire::codec::{self, Text};
use wire::command::{CommandKind, Confirmation, Intent, Order, ReportHash, Request};
use wire::core::{Core, Input, Output, Subject, Topic};
use wire::feed::Feed;
use wire::id::{Boot, CommandId, NodeId, Nonce, Sequence, TrackId};
use wire::report::{MAX_REPORT, Report};
use wire::sensor::Class;
use wire::sign::{Key, Purpose, Signed};
use wire::time::Instant;

use crate::opening::Opening;
use crate::outbox::Outbox;
use crate::plan::{InsiderOperatorConfig, OrderId, OrderTrack, PlanError, RogueOrders};

/// A counter before the first command.
const FIRST: (Boot, Sequence) = (Boot(1), Sequence(0));

/// A rogue station.
#[derive(Clone, Debug)]
pub struct InsiderOperator {
    config: InsiderOperatorConfig,
    key: Key,
    station: Option<Sender>,
    runs: Vec<Run>,
    /// The newest report of the unit, with its hash.
    report: Option<(Report, ReportHash)>,
    /// Newest counter of each identity, as far as it knows; of others the counter is at its start.
    counters: BTreeMap<NodeId, (Boot, Sequence)>,
    outbox: Outbox,
}

/// A run of orders, and when each is due.
#[derive(Clone, Debug)]
struct Run {
    orders: RogueOrders,
    opening: Opening,
}

impl InsiderOperator {
    /// A rogue station that starts at `now`.
    ///
    /// # Errors
    /// A magnitude of the plan outside its bounds, or no channel where it needs one.
    pub fn new(setup: Setup, config: InsiderOperatorConfig, now: Instant) -> Result<Self, PlanError> {
        config.check()?;
        let station = match config.certificate {
            Some(_) => None,
            None => Some(setup.sender(Topic::Intents)?),
        };
        let run = |orders: &RogueOrders| {
            let opening = Opening::counted(orders.step, now, orders.at_ms, (orders.count, orders.every_ms));
            Run { orders: *orders, opening }
        };
        Ok(Self {
            key: Key::from_bytes(&config.secret.0),
            station,
            runs: config.orders.iter().map(run).collect(),
            config,
            report: None,
            counters: BTreeMap::new(),
            outbox: Outbox::new(&setup, now),
        })
    }

    /// Reads the feed as it comes.
    fn see(&mut self, bytes: &[u8]) {
        let body = bytes.len().checked_sub(TAG_LEN).and_then(|end| bytes.get(HEADER_LEN..end));
        let Some(Feed::Accepted(accepted)) = body.and_then(|body| minicbor::decode(body).ok()) else { return };
        let Ok(signed) = Signed::parse(accepted.report, MAX_REPORT) else { return };
        let Ok(report) = codec::decode::<Report>(signed.payload, MAX_REPORT) else { return };
        if report.origin != self.config.unit.node() {
            return;
        }
        if let Some((id, _)) = report.last_command {
            let counter = self.counters.entry(id.operator).or_insert(FIRST);
            *counter = (*counter).max((id.boot, id.sequence));
        }
        self.report = Some((report, Sha256::digest(&**accepted.report).into()));
    }

    fn act(&mut self, now: Instant) {
        self.outbox.settle(self.runs.iter_mut().map(|run| &mut run.opening), now);
        for i in 0..self.runs.len() {
            while self.runs[i].opening.take(now) {
                let orders = self.runs[i].orders;
                self.order(now, &orders);
            }
        }
    }

    fn order(&mut self, now: Instant, run: &RogueOrders) {
        let intent = self.intent(run);
        let Intent { id, unit, kind, .. } = intent;
        let certificate = self.config.certificate;
        let event = Note::Rogue { command: id, kind, key: self.config.holds, certificate };
        self.outbox.write(now, event);
        let signed = self.key.sign(Purpose::Intent, &codec::encode(&intent));
        let confirmation = (!kind.towards_safe()).then(|| {
            let intent = Sha256::digest(&signed).into();
            self.key.sign(Purpose::Confirmation, &codec::encode(&Confirmation { id, intent }))
        });
        match &mut self.station {
            None => {
                let confirmation = confirmation.as_deref().map(<&ByteSlice>::from);
                let bytes = codec::encode(&Order { intent: signed.as_slice().into(), confirmation });
                self.outbox.put(Output::Publish { subject: Subject::Command(unit), bytes });
            }
            Some(station) => {
                let stage = Request::Stage(signed.as_slice().into());
                let release = confirmation.as_deref().map(|bytes| Request::Release(bytes.into()));
                for request in [Some(stage), release].into_iter().flatten() {
                    let bytes = station.seal(now, &codec::encode(&request));
                    self.outbox.put(Output::Bus { topic: Topic::Intents, bytes });
                }
            }
        }
    }

    fn intent(&mut self, run: &RogueOrders) -> Intent {
        let id = self.id(run);
        let nonce = self.report.as_ref().map_or(Nonce::NONE, |(report, _)| report.command_nonce);
        let kind = self.kind(run);
        let shown = kind.rests_on_display().and_then(|_| self.report.as_ref().map(|(_, hash)| *hash));
        Intent { id, unit: self.config.unit, nonce, kind, reason: Text::new("because I can"), tag: None, shown }
    }

    fn id(&mut self, run: &RogueOrders) -> CommandId {
        let (boot, sequence) = self.counters.entry(run.claim).or_insert(FIRST);
        if run.id == OrderId::Last {
            return CommandId { operator: run.claim, boot: *boot, sequence: *sequence };
        }
        *sequence = sequence.next();
        // What was run ahead counts from then on if the unit says that it heard it (`see`).
        let ahead = Sequence(sequence.0.saturating_add(run.ahead));
        let older = u32::from(run.id == OrderId::OlderBoot);
        CommandId { operator: run.claim, boot: Boot(boot.0.saturating_sub(older)), sequence: ahead }
    }

    fn kind(&self, run: &RogueOrders) -> CommandKind {
        let held = self.report.as_ref().and_then(|(report, _)| report.authority).map(|held| held.track);
        let wanted = |id: TrackId| run.track == OrderTrack::Seen || Some(id) != held;
        let tracks = self.report.iter().flat_map(|(report, _)| report.tracks.iter());
        let vehicles = tracks.filter(|track| track.class == Class::Vehicle && wanted(track.id));
        let best = vehicles.max_by_key(|track| track.confidence).map_or(TrackId(0), |track| track.id);
        let confirm = if run.track == OrderTrack::Seen { held.unwrap_or(TrackId(0)) } else { best };
        command(run.order, best, confirm, run.values)
    }
}

impl Core for InsiderOperator {
    fn handle(&mut self, now: Instant, input: &Input) {
        if let Input::Bus { topic: Topic::Feed, bytes } = input {
            self.see(bytes);
        }
        if let Input::Cue { step } = input {
            self.runs.iter_mut().for_each(|run| run.opening.cue(now, step.as_str()));
        }
        if !self.outbox.heed(now, input) && !self.outbox.is_quiet() {
            self.act(now);
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.runs.iter().filter_map(|run| run.opening.due()).min().filter(|_| !self.outbox.is_quiet())
    }

    fn output(&mut self) -> Option<Output> {
        self.outbox.next()
    }
}
