//! A bench around one gateway: units with their own clocks and keys, a console, and every output of the gateway.

use std::collections::BTreeMap;

use config::setup::{Channel, Setup};
use gateway::fanout::Interest;
use gateway::{Gateway, GatewayConfig};
use wire::audit::Entry;
use wire::bounds::Bounds;
use wire::bus::{ChannelKey, HEADER_LEN, Sender, TAG_LEN};
use wire::codec::{self, Text};
use wire::command::{Ack, CommandKind, Confirmation, Intent, Request};
use wire::core::{Core, Input, Output, Subject, Topic};
use wire::event::{Account, Event, Interface};
use wire::feed::{CommandStage, Feed};
use wire::id::{Boot, CommandId, NodeId, Nonce, PeerId, RecordId, Sequence, SessionId, UnitId, WorldId};
use wire::policy::{Check, Policy, Requirement};
use wire::refusal::Reason;
use wire::report::Report;
use wire::sensor::{Pose, ProductMode};
use wire::session::{MAX_SESSION_MESSAGE, SESSION_VERSION, SessionBody, SessionMessage};
use wire::sign::Secret;
use wire::sign::{Key, Purpose};
use wire::time::{Echo, Instant, PeerStamp, Span};

pub(crate) const INTENTS: ChannelKey = ChannelKey([2; 32]);
/// The key of a second station's channel.
pub(crate) const SECOND: ChannelKey = ChannelKey([3; 32]);
const FEED: ChannelKey = ChannelKey([1; 32]);

pub(crate) fn key_of(node: NodeId) -> Key {
    Key::from_bytes(&[node.index() as u8 + 1; 32])
}

/// A policy with these checks waived.
pub(crate) fn waiving(checks: &[Check]) -> Policy {
    Policy { boundary: checks.iter().map(|c| (*c, Requirement::Waived)).collect(), ..Policy::default() }
}

pub(crate) fn setup(policy: Policy) -> Setup {
    let known = [NodeId::UNIT_A, NodeId::UNIT_B, NodeId::UNIT_C, NodeId::OPERATOR, NodeId::GATEWAY];
    let known = known.into_iter().chain([NodeId::OPERATOR_2, NodeId::AUTHORITY]);
    Setup {
        node: NodeId::GATEWAY,
        boot: Boot(1),
        world: WorldId(0),
        seed: 11,
        policy,
        bounds: Bounds::GROUND,
        secret: Secret([NodeId::GATEWAY.index() as u8 + 1; 32]),
        public_keys: known.map(|node| (node, key_of(node).public())).collect(),
        channels: vec![
            Channel { topic: Topic::Feed, producer: NodeId::GATEWAY, key: FEED },
            Channel { topic: Topic::Intents, producer: NodeId::CONSOLE, key: INTENTS },
            Channel { topic: Topic::Intents, producer: NodeId::INSIDER_OPERATOR, key: SECOND },
        ],
        ablation: None,
        verifier: None,
    }
}

/// Three units, of which two are informed of the others.
pub(crate) fn config() -> GatewayConfig {
    let units = vec![UnitId::A, UnitId::B, UnitId::C];
    let rest = |of: UnitId| units.iter().copied().filter(|unit| *unit != of).collect();
    GatewayConfig {
        interests: [UnitId::A, UnitId::B].map(|unit| Interest { unit, hears: rest(unit) }).to_vec(),
        units,
        operators: vec![NodeId::OPERATOR, NodeId::OPERATOR_2],
        mandates: Vec::new(),
        contacts: Vec::new(),
    }
}

pub(crate) struct Bench {
    pub(crate) gateway: Gateway,
    pub(crate) now: Instant,
    pub(crate) units: BTreeMap<SessionId, Unit>,
    pub(crate) events: Vec<Event>,
    pub(crate) published: Vec<(Subject, Vec<u8>)>,
    pub(crate) feeds: usize,
    /// Progress of commands as reported to the display, with the reason of a refusal.
    pub(crate) progress: Vec<(CommandStage, Option<Reason>)>,
    /// Losses as reported to the display.
    pub(crate) losses: Vec<u32>,
    /// Crops as passed on to the display.
    pub(crate) crops: Vec<(UnitId, Vec<u8>)>,
    /// Refusals as reported to the display, each with its count.
    pub(crate) refusals: Vec<(Reason, Option<PeerId>, u64)>,
    pub(crate) ended: Vec<SessionId>,
    pub(crate) console: Sender,
    pub(crate) delivered: u64,
}

impl Bench {
    pub(crate) fn new(policy: Policy) -> Self {
        Self::from_setup(setup(policy), config())
    }

    pub(crate) fn from_setup(setup: Setup, config: GatewayConfig) -> Self {
        let now = Instant(1_000_000);
        let mut bench = Self {
            gateway: Gateway::new(setup, config, now).unwrap(),
            now,
            units: BTreeMap::new(),
            events: Vec::new(),
            published: Vec::new(),
            feeds: 0,
            progress: Vec::new(),
            losses: Vec::new(),
            crops: Vec::new(),
            refusals: Vec::new(),
            ended: Vec::new(),
            console: Sender::new(Topic::Intents, NodeId::CONSOLE, Boot(1), INTENTS),
            delivered: 0,
        };
        bench.drain();
        bench
    }

    /// Opens a session for `node`, with a clock far from the gateway's.
    pub(crate) fn open(&mut self, session: u32, node: NodeId) -> SessionId {
        let id = SessionId(session);
        self.units.insert(id, Unit::new(node));
        self.give(&Input::Opened { session: id, peer: PeerId::from_name(node.name()).unwrap() });
        id
    }

    /// A session that has exchanged nonces and brought its first report.
    pub(crate) fn reporting(&mut self, session: u32, node: NodeId) -> SessionId {
        let id = self.open(session, node);
        self.hello(id);
        assert_eq!(self.report(id), None);
        id
    }

    pub(crate) fn give(&mut self, input: &Input) {
        self.gateway.handle(self.now, input);
        self.drain();
    }

    pub(crate) fn drain(&mut self) {
        while let Some(output) = self.gateway.output() {
            match output {
                Output::Audit { bytes } => self.events.push(Entry::decode(&bytes).unwrap().event),
                Output::Record { session, bytes } => {
                    self.units.get_mut(&session).expect("a session of ours").take(self.now, &bytes);
                }
                Output::Publish { subject, bytes } => self.published.push((subject, bytes)),
                Output::Bus { topic: Topic::Feed, bytes } => {
                    self.feeds += 1;
                    let body = &bytes[HEADER_LEN..bytes.len() - TAG_LEN];
                    match codec::decode(body, body.len()) {
                        Ok(Feed::Command(_, stage, why)) => self.progress.push((stage, why)),
                        Ok(Feed::SessionsLost(times)) => self.losses.push(times),
                        Ok(Feed::Crop(unit, bytes)) => self.crops.push((unit, bytes.to_vec())),
                        Ok(Feed::Refused(reason, peer, counted)) => self.refusals.push((reason, peer, counted)),
                        _ => {}
                    }
                }
                Output::Close { session } => self.ended.push(session),
                other => panic!("unexpected {other:?}"),
            }
        }
    }

    /// Lets `span` pass, with every deadline in it.
    pub(crate) fn pass(&mut self, span: Span) {
        let until = self.now + span;
        while let Some(deadline) = self.gateway.deadline().filter(|time| *time <= until) {
            self.now = self.now.max(deadline);
            self.give(&Input::Timeout);
        }
        self.now = until;
    }

    /// Delivers a session record; gives the reason when it was refused.
    pub(crate) fn deliver(&mut self, session: SessionId, bytes: Vec<u8>) -> Option<Reason> {
        self.delivered += 1;
        let from = self.events.len();
        self.give(&Input::Record { session, bytes });
        let verdicts: Vec<Option<Reason>> = self.events[from..].iter().filter_map(verdict).collect();
        assert_eq!(verdicts.len(), 1, "one verdict for a record: {verdicts:?}");
        verdicts[0]
    }

    pub(crate) fn hello(&mut self, session: SessionId) -> Option<Reason> {
        let unit = self.units.get_mut(&session).unwrap();
        let nonce = unit.nonce;
        let bytes = unit.session_message(self.now, SessionBody::Hello(nonce));
        self.deliver(session, bytes)
    }

    /// The unit's own next report.
    pub(crate) fn report(&mut self, session: SessionId) -> Option<Reason> {
        let bytes = self.units.get_mut(&session).unwrap().report(self.now);
        self.deliver(session, bytes)
    }

    /// A report made by `by`, carried by the unit of `session`.
    pub(crate) fn carry(&mut self, session: SessionId, report: &[u8]) -> Option<Reason> {
        let bytes = self.units.get_mut(&session).unwrap().session_message(self.now, SessionBody::Report(report.into()));
        self.deliver(session, bytes)
    }

    pub(crate) fn request(&mut self, request: &Request<'_>) -> Option<Reason> {
        let bytes = self.console.seal(self.now, &codec::encode(request));
        let from = self.events.len();
        self.give(&Input::Bus { topic: Topic::Intents, bytes });
        self.events[from..].iter().find_map(|event| match event {
            Event::Refused { reason, .. } => Some(*reason),
            _ => None,
        })
    }

    /// A request of the second station.
    pub(crate) fn second(&mut self, station: &mut Sender, request: &Request<'_>) -> Option<Reason> {
        std::mem::swap(&mut self.console, station);
        let refused = self.request(request);
        std::mem::swap(&mut self.console, station);
        refused
    }

    pub(crate) fn stage(&mut self, intent: &[u8]) -> Option<Reason> {
        self.request(&Request::Stage(intent.into()))
    }

    pub(crate) fn acknowledge(&mut self, unit: NodeId, ack: &Ack) {
        let bytes = key_of(unit).sign(Purpose::Ack, &codec::encode(ack));
        let subject = Subject::Ack(unit.unit().unwrap());
        self.give(&Input::Published { subject, bytes });
    }

    pub(crate) fn count(&self, account: Account) -> u64 {
        self.gateway.accounts().total(account)
    }

    /// Delivered = accepted + Σ refused, by the gateway's own account and by the bench's.
    pub(crate) fn assert_conserved(&self) {
        let interface = Interface::Uplink;
        let refused: u64 = Reason::ALL.iter().map(|reason| self.count(Account::Refused(interface, *reason))).sum();
        assert_eq!(self.count(Account::Received(interface)), self.delivered);
        assert_eq!(self.count(Account::Accepted(interface)) + refused, self.delivered);
    }
}

fn verdict(event: &Event) -> Option<Option<Reason>> {
    match event {
        Event::Accepted { at: Interface::Uplink, .. } => Some(None),
        Event::Refused { at: Interface::Uplink, reason, .. } => Some(Some(*reason)),
        _ => None,
    }
}

/// A unit's end of a session.
pub(crate) struct Unit {
    pub(crate) node: NodeId,
    pub(crate) boot: Boot,
    /// Number of the unit's session records, and number of its reports.
    pub(crate) sequence: u64,
    pub(crate) reports: u64,
    /// Session nonce of the unit, that of the gateway, and the echo due to the gateway.
    pub(crate) nonce: Nonce,
    pub(crate) theirs: Nonce,
    pub(crate) echo: Option<Echo>,
    pub(crate) product: ProductMode,
    /// Offset of the unit's clock from the gateway's.
    offset: u64,
    /// Grants and teammates' envelopes received.
    pub(crate) grants: usize,
    pub(crate) teammates: Vec<(PeerId, Span, Vec<u8>)>,
    /// The display's challenges received.
    pub(crate) watches: Vec<Nonce>,
    pub(crate) revocations: Vec<Vec<u8>>,
}

impl Unit {
    fn new(node: NodeId) -> Self {
        Self {
            node,
            boot: Boot(1),
            sequence: 0,
            reports: 0,
            nonce: Nonce(1000 + node.index() as u64),
            theirs: Nonce(0),
            echo: None,
            product: ProductMode::Live,
            offset: 77_000_000 * (node.index() as u64 + 1),
            grants: 0,
            teammates: Vec::new(),
            watches: Vec::new(),
            revocations: Vec::new(),
        }
    }

    pub(crate) fn clock(&self, now: Instant) -> PeerStamp {
        PeerStamp(now.0 + self.offset)
    }

    fn take(&mut self, now: Instant, bytes: &[u8]) {
        let outer: SessionMessage<'_> = codec::decode(bytes, MAX_SESSION_MESSAGE).unwrap();
        if self.echo.is_none_or(|echo| echo.nonce != outer.challenge) {
            self.echo = Some(Echo { nonce: outer.challenge, seen: self.clock(now) });
        }
        match outer.body {
            SessionBody::Hello(nonce) => self.theirs = nonce,
            SessionBody::Grant(_) => self.grants += 1,
            SessionBody::Teammate(t) => self.teammates.push((t.via, t.age, t.report.to_vec())),
            SessionBody::Watch(challenge) => self.watches.push(challenge),
            SessionBody::Revoked(revocation) => self.revocations.push(revocation.to_vec()),
            SessionBody::Report(_) | SessionBody::Crop(_) => panic!("a gateway reports nothing"),
        }
    }

    pub(crate) fn session_message(&mut self, now: Instant, body: SessionBody<'_>) -> Vec<u8> {
        self.sequence += 1;
        codec::encode(&self.session_message_at(self.clock(now), body))
    }

    pub(crate) fn session_message_at<'b>(&self, stamp: PeerStamp, body: SessionBody<'b>) -> SessionMessage<'b> {
        SessionMessage {
            version: SESSION_VERSION,
            session: self.theirs,
            boot: self.boot,
            sequence: Sequence(self.sequence),
            stamp,
            challenge: self.nonce,
            echo: self.echo,
            body,
        }
    }

    pub(crate) fn report(&mut self, now: Instant) -> Vec<u8> {
        let report = self.signed(now);
        self.session_message(now, SessionBody::Report(report.as_slice().into()))
    }

    /// Next report of the unit, signed.
    pub(crate) fn signed(&mut self, now: Instant) -> Vec<u8> {
        let report = self.next_report(now);
        sign(self.node, &report)
    }

    pub(crate) fn next_report(&mut self, now: Instant) -> Report {
        self.reports += 1;
        Report {
            product: self.product,
            pose: Pose { x_mm: 1, y_mm: 2, yaw_mrad: 3 },
            command_nonce: Nonce(5),
            ..Report::bare(
                RecordId { node: self.node, boot: self.boot, sequence: Sequence(self.reports) },
                self.clock(now),
            )
        }
    }
}

pub(crate) fn sign(author: NodeId, report: &Report) -> Vec<u8> {
    key_of(author).sign(Purpose::Report, &codec::encode(report))
}

pub(crate) fn command(sequence: u64) -> CommandId {
    CommandId { operator: NodeId::OPERATOR, boot: Boot(1), sequence: Sequence(sequence) }
}

pub(crate) fn intent(sequence: u64, kind: CommandKind, reason: &str) -> Intent {
    Intent {
        id: command(sequence),
        unit: UnitId::A,
        nonce: Nonce(5),
        kind,
        reason: Text::new(reason),
        tag: None,
        shown: None,
    }
}

pub(crate) fn signed_intent(intent: &Intent) -> Vec<u8> {
    key_of(NodeId::OPERATOR).sign(Purpose::Intent, &codec::encode(intent))
}

pub(crate) fn signed_confirmation(id: CommandId, intent: [u8; 32]) -> Vec<u8> {
    key_of(NodeId::OPERATOR).sign(Purpose::Confirmation, &codec::encode(&Confirmation { id, intent }))
}
