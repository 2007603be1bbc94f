//! The gateway: where telemetry enters the control domain, and where commands leave it.
//!
//! [`Gateway`] is a deterministic core. Telemetry: session → [`admit`] → [`lease`], [`fanout`], [`feed`]. Commands:
//! console's request → [`stage`] → the unit's command subject; acknowledgements come back through the same file. It
//! holds no key that an intent, a report or an acknowledgement could be signed with.
//!
//! A reviewer of trust reads `admit` first. What the display makes of the feed is left to the console; what a unit
//! makes of grants, teammates and orders, to autonomy.

pub mod admit;
pub mod fanout;
pub mod feed;
pub mod lease;
pub mod process;
pub mod session;
pub mod stage;

use std::collections::VecDeque;

use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use serde::{Deserialize, Serialize};
use wire::account::Accounts;
use wire::audit::Journal;
use wire::bounds::Bounds;
use wire::command::{CommandKind, Request};
use wire::core::{Core, Input, Output, Subject, Topic};
use wire::event::{Account, Event, Interface};
use wire::feed::{AcceptedReport, CommandStage, Feed};
use wire::hop::HopBody;
use wire::id::{Boot, CommandId, NodeId, Nonce, PeerId, SessionId, UnitId, WorldId};
use wire::policy::{Policy, Waived};
use wire::refusal::Refusal;
use wire::setup::{NoChannel, Setup};
use wire::time::{Instant, Span};
use wire::trust::{Accepted, BusGate, SignedReport};

use crate::admit::{Admitted, Boundary, Content};
use crate::fanout::Envelope;
use crate::feed::Feeder;
use crate::lease::Leases;
use crate::session::{Session, Sessions};
use crate::stage::{Dispatch, Progress, Rejected, Rules, Staging};

/// A session without a grant still says Hello so often, so that challenges and echoes go on.
const IDLE_HELLO: Span = Span::ms(250);

/// Who is who for this gateway.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GatewayConfig {
    /// Units that may hold a session and be commanded.
    pub units: Vec<UnitId>,
    /// Units that receive teammates' reports.
    pub fanout: Vec<UnitId>,
    /// Operators whose intents are staged.
    pub operators: Vec<NodeId>,
}

/// The gateway's core.
#[derive(Debug)]
pub struct Gateway {
    config: GatewayConfig,
    policy: Policy,
    bounds: Bounds,
    boot: Boot,
    boundary: Boundary,
    sessions: Sessions,
    leases: Leases,
    staging: Staging,
    requests: BusGate,
    feed: Feeder,
    nonces: ChaCha8Rng,
    accounts: Accounts,
    journal: Journal,
    tick: Option<Instant>,
    quiet: bool,
    out: VecDeque<Output>,
}

impl Gateway {
    /// A gateway that starts at `now`. Fails when `setup` lacks the key of the feed or of the requests.
    pub fn new(setup: Setup, config: GatewayConfig, now: Instant) -> Result<Self, NoChannel> {
        let keys = setup.keyring();
        let freshness = setup.bounds.freshness();
        let rules = Rules {
            policy: setup.policy.clone(),
            keys: keys.clone(),
            operators: config.operators.clone(),
            units: config.units.clone(),
            freshness,
        };
        let mut nonces = ChaCha8Rng::seed_from_u64(setup.seed);
        nonces.set_stream(u64::from(setup.boot.0)); // A restart must not repeat the nonces of the boot before.
        let mut gateway = Self {
            boundary: Boundary::new(setup.policy.clone(), setup.bounds, keys),
            sessions: Sessions::default(),
            leases: Leases::new(&setup.bounds),
            staging: Staging::new(rules),
            requests: setup.gate(Topic::Intents, freshness)?,
            feed: Feeder::new(setup.sender(Topic::Feed)?, now),
            nonces,
            accounts: Accounts::default(),
            journal: Journal::new(setup.node, setup.boot, Some(setup.key())),
            tick: None,
            quiet: false,
            out: VecDeque::new(),
            boot: setup.boot,
            bounds: setup.bounds,
            policy: setup.policy,
            config,
        };
        gateway.note(now, Event::Started);
        Ok(gateway)
    }

    /// The same gateway in a forked world. No part of its state is bound to a world.
    #[must_use]
    pub fn fork(&self, _world: WorldId) -> Self {
        Self {
            config: self.config.clone(),
            policy: self.policy.clone(),
            bounds: self.bounds,
            boot: self.boot,
            boundary: self.boundary.clone(),
            sessions: self.sessions.clone(),
            leases: self.leases.clone(),
            staging: self.staging.clone(),
            requests: self.requests.clone(),
            feed: self.feed.clone(),
            nonces: self.nonces.clone(),
            accounts: self.accounts.clone(),
            journal: self.journal.fork(),
            tick: self.tick,
            quiet: self.quiet,
            out: self.out.clone(),
        }
    }

    /// What has been counted so far.
    pub fn accounts(&self) -> &Accounts {
        &self.accounts
    }

    fn opened(&mut self, now: Instant, id: SessionId, peer: PeerId) {
        let unit = UnitId::from_name(peer.name()).filter(|unit| self.config.units.contains(unit));
        let Some(unit) = unit else { return self.sessions.bar(id, peer) };
        let nonce = fresh_nonce(&mut self.nonces);
        self.sessions.open(Session::new(id, peer, unit, nonce, &self.bounds));
        self.note(now, Event::Session { peer, open: true });
        self.tell(now, &Feed::Session(peer, true));
        if self.tick.is_none() {
            self.tick = Some(now + Span::ms(self.bounds.grant_period_ms));
        }
        self.keep_up(now, Some(id));
    }

    fn closed(&mut self, now: Instant, id: SessionId) {
        let Some(peer) = self.sessions.close(id) else { return };
        self.note(now, Event::Session { peer, open: false });
        self.tell(now, &Feed::Session(peer, false));
    }

    /// One record, one verdict.
    fn record(&mut self, now: Instant, id: SessionId, bytes: &[u8]) {
        let session = match self.sessions.get_mut(id) {
            Ok(session) => session,
            Err((peer, refusal)) => return self.refuse(now, Interface::Uplink, peer, &refusal),
        };
        let peer = session.peer();
        match self.boundary.admit(session, now, bytes) {
            Err(refusal) => self.refuse(now, Interface::Uplink, Some(peer), &refusal),
            Ok(admitted) => self.admitted(now, id, peer, admitted),
        }
    }

    fn admitted(&mut self, now: Instant, id: SessionId, peer: PeerId, admitted: Admitted<'_>) {
        self.accounts.accepted(Interface::Uplink);
        let age = admitted.evidence().age.map(|age| age.upper());
        let (record, waived) = (admitted.record(), admitted.waived());
        self.note(now, Event::Accepted { at: Interface::Uplink, record, peer, age, waived });
        match &admitted.content {
            Content::Exchange(_) => {}
            Content::Report(report) => self.report(now, id, report, waived),
        }
    }

    /// An accepted report: supervision of its unit, display, teammates.
    fn report(&mut self, now: Instant, id: SessionId, report: &Accepted<SignedReport<'_>>, waived: Waived) {
        let (signed, evidence) = (report.message(), report.evidence());
        let age = evidence.age.map(|age| age.upper());
        let Some(unit) = signed.report.origin.unit() else { return };
        let Ok(session) = self.sessions.get_mut(id) else { return };
        if let Some(age) = age
            && session.unit() == unit
        {
            session.heard(evidence.received, age);
        }
        let envelope = Envelope::new(session, report, now);
        let (via, received, report) = (session.peer(), evidence.received, signed.bytes.into());
        self.tell(now, &Feed::Accepted(AcceptedReport { via, unit, received, age, waived, report }));
        self.fan_out(now, &envelope);
    }

    fn fan_out(&mut self, now: Instant, envelope: &Envelope<'_>) {
        for session in self.sessions.iter_mut().filter(|_| !self.quiet) {
            if let Some(body) = envelope.addressed_to(session, &self.config.fanout) {
                session.renew(now, || fresh_nonce(&mut self.nonces));
                self.out.push_back(session.seal(now, self.boot, body));
                self.accounts.count(Account::Sent);
            }
        }
    }

    /// Keeps sessions going (all, or just one): a grant where one is due and deserved, else a Hello where one is due.
    fn keep_up(&mut self, now: Instant, only: Option<SessionId>) {
        let due = |session: &Session| only.is_none_or(|id| id == session.id());
        for session in self.sessions.iter_mut().filter(|s| due(s) && !self.quiet) {
            let idle = session.sent().is_none_or(|at| now.since(at) >= IDLE_HELLO);
            let hello = || (!session.established() || idle).then_some(HopBody::Hello(session.nonce));
            let Some(body) = self.leases.grant(session, now).or_else(hello) else { continue };
            session.renew(now, || fresh_nonce(&mut self.nonces));
            self.out.push_back(session.seal(now, self.boot, body));
            self.accounts.count(Account::Sent);
        }
    }

    fn requested(&mut self, now: Instant, topic: Topic, bytes: &[u8]) {
        if topic != Topic::Intents {
            return;
        }
        let at = Interface::Bus(topic);
        match self.requests.admit::<Request<'_>>(&self.policy, now, bytes) {
            Err(refusal) => self.refuse(now, at, None, &refusal),
            Ok(accepted) => {
                self.accounts.accepted(at);
                self.request(now, &accepted);
            }
        }
    }

    fn request(&mut self, now: Instant, accepted: &Accepted<Request<'_>>) {
        let verdict = match accepted.message() {
            Request::Stage(intent) => self.staging.stage(now, accepted.evidence().age, intent),
            Request::Release(confirmation) => self.staging.release(now, confirmation),
        };
        match verdict {
            Ok(progress) => {
                self.accounts.accepted(Interface::Requests);
                match progress {
                    Progress::Staged(id) => self.staged(now, id, CommandStage::Staged),
                    Progress::Send(dispatch) => self.send(now, dispatch),
                }
            }
            Err(Rejected { command, refusal }) => {
                self.refuse(now, Interface::Requests, None, &refusal);
                if let Some(id) = command {
                    self.staged(now, id, CommandStage::Refused);
                }
            }
        }
    }

    fn send(&mut self, now: Instant, dispatch: Dispatch) {
        let Dispatch { id, unit, kind, order } = dispatch;
        if kind == CommandKind::Hold {
            self.leases.hold(unit, id);
        }
        if self.quiet {
            return;
        }
        self.out.push_back(Output::Publish { subject: Subject::Command(unit), bytes: order });
        self.staged(now, id, CommandStage::Sent);
    }

    fn published(&mut self, now: Instant, subject: Subject, bytes: &[u8]) {
        let unit = match subject {
            Subject::Ack(unit) => unit,
            Subject::Command(_) => return,
        };
        match self.staging.acknowledged(now, unit, bytes) {
            Err(refusal) => self.refuse(now, Interface::Acks, None, &refusal),
            Ok(ack) => {
                self.accounts.accepted(Interface::Acks);
                let ack = ack.message();
                if ack.refused.is_none() {
                    self.leases.executed(unit, ack.id);
                }
                self.tell(now, &Feed::Acknowledged(bytes.into()));
            }
        }
    }

    fn timeout(&mut self, now: Instant) {
        for id in self.staging.expire(now) {
            self.staged(now, id, CommandStage::Expired);
        }
        let Some(due) = self.tick.filter(|tick| now >= *tick) else { return };
        self.keep_up(now, None);
        let period = Span::ms(self.bounds.grant_period_ms);
        let next = if now.since(due) < period { due + period } else { now + period };
        self.tick = (!self.sessions.is_empty()).then_some(next);
    }

    fn finish(&mut self, now: Instant) {
        self.accounts.close(now, &mut self.journal, &mut self.out);
        self.journal.sign(now, &mut self.out);
    }

    fn staged(&mut self, now: Instant, command: CommandId, stage: CommandStage) {
        self.note(now, Event::Staged { command, stage });
        self.tell(now, &Feed::Command(command, stage));
    }

    fn refuse(&mut self, now: Instant, at: Interface, peer: Option<PeerId>, refusal: &Refusal) {
        let event = self.accounts.refused(at, peer, refusal);
        self.note(now, event);
        if !self.quiet {
            self.out.extend(self.feed.refused(now, refusal.reason(), peer));
        }
    }

    fn tell(&mut self, now: Instant, message: &Feed<'_>) {
        if !self.quiet {
            self.out.push_back(self.feed.seal(now, message));
        }
    }

    fn note(&mut self, now: Instant, event: Event) {
        self.journal.write(now, event, &mut self.out);
    }
}

impl Core for Gateway {
    fn handle(&mut self, now: Instant, input: &Input) {
        match input {
            Input::Opened { session, peer } => self.opened(now, *session, *peer),
            Input::Record { session, bytes } => self.record(now, *session, bytes),
            Input::Closed { session } => self.closed(now, *session),
            Input::Published { subject, bytes } => self.published(now, *subject, bytes),
            Input::Bus { topic, bytes } => self.requested(now, *topic, bytes),
            Input::Timeout => self.timeout(now),
            Input::Quiesce => self.quiet = true,
            Input::Finish => self.finish(now),
            Input::Datagram { .. } | Input::Stream { .. } | Input::Audit { .. } => {}
        }
    }

    fn deadline(&self) -> Option<Instant> {
        [self.tick, self.staging.deadline()].into_iter().flatten().min()
    }

    fn output(&mut self) -> Option<Output> {
        self.out.pop_front()
    }
}

/// An unguessable number other than zero, which stands for "none yet".
fn fresh_nonce(nonces: &mut ChaCha8Rng) -> Nonce {
    Nonce(nonces.next_u64().max(1))
}
