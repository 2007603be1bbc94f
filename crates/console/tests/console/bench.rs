//! A console on a bench, behind a scripted gateway.

use config::setup::{Channel, Setup};
use console::eye::Eye;
use console::operator::{Action, ScriptStep, When};
use console::{Console, ConsoleConfig};
use sha2::{Digest, Sha256};
use wire::audit::Entry;
use wire::bounds::Bounds;
use wire::bus::{ChannelKey, Sender};
use wire::codec::{self, List, Text};
use wire::command::{Ack, CommandKind, Confirmation, Intent, Request};
use wire::core::{Core, Input, Output, Topic};
use wire::crop::{Crop, PIXELS, Pictured, Pixels, WIDTH};
use wire::event::{Event, Freshness};
use wire::feed::{AcceptedReport, CommandStage, Feed};
use wire::id::{Boot, CommandId, FrameId, NodeId, Nonce, PeerId, RecordId, Sequence, TrackId, UnitId, WorldId};
use wire::mode::{Cause, Mode};
use wire::person::{Act, Numbered, Order, Role, Unable};
use wire::policy::{Policy, Waived};
use wire::refusal::Reason;
use wire::report::{Report, ReportedTrack};
use wire::sensor::{Class, Modalities, Modality, Pose};
use wire::sign::Secret;
use wire::sign::{Key, Purpose, Signed};
use wire::time::{Echo, Instant, PeerStamp, Span};
use wire::trust::Revocation;

const FEED: ChannelKey = ChannelKey([1; 32]);
const INTENTS: ChannelKey = ChannelKey([2; 32]);
/// Time at which a bench begins.
const START: Instant = Instant(5_000_000);
/// A tag and a header around a body, bytes.
const AROUND: (usize, usize) = (wire::bus::HEADER_LEN, wire::bus::TAG_LEN);

pub(crate) fn key_of(node: NodeId) -> Key {
    Key::from_bytes(&[node.index() as u8 + 1; 32])
}

/// A request of the console to the gateway.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Asked {
    Stage(Intent, Vec<u8>),
    Release(Confirmation),
    Watch(Nonce),
    Revoke(Vec<u8>),
}

pub(crate) struct Bench {
    pub(crate) console: Console,
    pub(crate) now: Instant,
    pub(crate) gateway: Sender,
    pub(crate) events: Vec<(Instant, Event)>,
    pub(crate) asked: Vec<Asked>,
    pub(crate) texts: Vec<String>,
    pub(crate) pictures: Vec<serde_json::Value>,
    /// The display's challenge as a unit at the console's side first saw it; a unit's clock is the console's here.
    pub(crate) watched: Option<Echo>,
    /// Every input so far, with its outputs.
    pub(crate) journal: Vec<(Instant, Input, Vec<Output>)>,
    sequence: u64,
    serial: u64,
}

impl Bench {
    pub(crate) fn new(policy: Policy, script: Vec<ScriptStep>) -> Self {
        Self::with_script(policy, Role::Supervise, script, Vec::new())
    }

    /// The revocation that [`Bench::seating`] has at hand.
    pub(crate) fn revocations() -> Vec<(NodeId, Vec<u8>)> {
        let node = NodeId::OPERATOR_2;
        vec![(node, Revocation { of: node }.sign(&key_of(NodeId::AUTHORITY)))]
    }

    /// A console with a person in this role and no script.
    pub(crate) fn seating(role: Role) -> Self {
        Self::with_script(Policy::default(), role, Vec::new(), Self::revocations())
    }

    /// A console with the full policy, and these revocations at hand.
    pub(crate) fn revoking(script: Vec<ScriptStep>, revocations: Vec<(NodeId, Vec<u8>)>) -> Self {
        Self::with_script(Policy::default(), Role::Supervise, script, revocations)
    }

    fn with_script(policy: Policy, role: Role, script: Vec<ScriptStep>, revocations: Vec<(NodeId, Vec<u8>)>) -> Self {
        Self::from_console(console(policy, role, script, revocations, START))
    }

    /// A console with a person in this role, who commands these units.
    pub(crate) fn with_units(units: &[UnitId], policy: Policy, role: Role) -> Self {
        Self::from_console(console_of(units, policy, role, Vec::new(), Vec::new(), START))
    }

    /// A console with the units A and B admitted, of which only these take part.
    pub(crate) fn awaiting(awaited: &[UnitId]) -> Self {
        let (setup, config) =
            making(&[UnitId::A, UnitId::B], Policy::default(), Role::Supervise, Vec::new(), Vec::new());
        let config = ConsoleConfig { awaited: awaited.to_vec(), ..config };
        Self::from_console(Console::new(setup, config, START).unwrap())
    }

    /// A console with an operator who follows this script and looks with this eye.
    pub(crate) fn with_eye(script: Vec<ScriptStep>, eye: Option<Eye>) -> Self {
        let (setup, config) = making(&[UnitId::A, UnitId::B], Policy::default(), Role::Supervise, script, Vec::new());
        Self::from_console(Console::new(setup, ConsoleConfig { eye, ..config }, START).unwrap())
    }

    /// A console with a person and these units, which writes no text: for long times.
    pub(crate) fn quiet(units: &[UnitId]) -> Self {
        let (setup, config) = making(units, Policy::default(), Role::Supervise, Vec::new(), Self::revocations());
        Self::from_console(Console::new(setup, ConsoleConfig { text: false, ..config }, START).unwrap())
    }

    fn from_console(console: Console) -> Self {
        let mut bench = Self {
            console,
            now: START,
            gateway: Sender::new(Topic::Feed, NodeId::GATEWAY, Boot(1), FEED),
            events: Vec::new(),
            asked: Vec::new(),
            texts: Vec::new(),
            pictures: Vec::new(),
            watched: None,
            journal: Vec::new(),
            sequence: 0,
            serial: 0,
        };
        bench.give(&Input::Timeout);
        bench
    }

    pub(crate) fn give(&mut self, input: &Input) {
        self.console.handle(self.now, input);
        let outputs: Vec<Output> = std::iter::from_fn(|| self.console.output()).collect();
        for output in &outputs {
            match output {
                Output::Audit { bytes } => self.events.push((self.now, Entry::decode(bytes).unwrap().event)),
                Output::Bus { topic: Topic::Intents, bytes } => match read(bytes) {
                    Asked::Watch(nonce) => self.watched = Some(Echo { nonce, seen: self.now.stamp() }),
                    asked => self.asked.push(asked),
                },
                Output::Text { text, picture } => {
                    self.texts.push(text.clone());
                    self.pictures.push(serde_json::from_str(picture).unwrap());
                }
                other => panic!("unexpected {other:?}"),
            }
        }
        self.journal.push((self.now, input.clone(), outputs));
    }

    pub(crate) fn feed(&mut self, message: &Feed<'_>) {
        let bytes = self.gateway.seal(self.now, &codec::encode(message));
        self.give(&Input::Bus { topic: Topic::Feed, bytes });
    }

    /// Lets `span` pass, with every deadline in it.
    pub(crate) fn pass(&mut self, span: Span) {
        let until = self.now + span;
        while let Some(deadline) = self.console.deadline().filter(|time| *time <= until) {
            assert!(deadline >= self.now, "a deadline in the past");
            self.now = deadline;
            self.give(&Input::Timeout);
        }
        self.now = until;
    }

    /// Unit A's next report in this mode.
    pub(crate) fn next(&mut self, mode: Mode) -> Report {
        self.sequence += 1;
        self.with_challenge(report(self.sequence, self.now.0, mode))
    }

    /// The report with the display's newest challenge in it.
    pub(crate) fn with_challenge(&self, report: Report) -> Report {
        Report { watched: self.watched, ..report }
    }

    /// Feeds a report of A that was `age` old when the gateway had it, just now.
    pub(crate) fn heard(&mut self, report: &Report, age: Span) {
        let signed = sign(report.origin, report);
        self.heard_as(&signed, UnitId::A, Some(age), self.now);
    }

    pub(crate) fn heard_as(&mut self, signed: &[u8], unit: UnitId, age: Option<Span>, received: Instant) {
        let waived = Waived::default();
        self.feed(&Feed::Accepted(AcceptedReport {
            via: PeerId::UNIT_A,
            unit,
            received,
            age,
            waived,
            report: signed.into(),
        }));
    }

    /// Unit A reports every 100 ms for `span`.
    pub(crate) fn reports(&mut self, mode: Mode, span: Span) {
        for _ in 0..span.0 / 100_000 {
            let report = self.next(mode);
            self.heard(&report, Span::ms(20));
            self.pass(Span::ms(100));
        }
    }

    /// The gateway moves the command with this signed intent along.
    pub(crate) fn staged(&mut self, signed: &[u8], stage: CommandStage) {
        let reason = (stage == CommandStage::Refused).then_some(Reason::Late);
        self.feed(&Feed::Command(Sha256::digest(signed).into(), stage, reason));
    }

    pub(crate) fn acknowledged(&mut self, author: NodeId, ack: &Ack) {
        let bytes = key_of(author).sign(Purpose::Ack, &codec::encode(ack));
        self.feed(&Feed::Acknowledged(bytes.as_slice().into()));
    }

    /// The person does this, under the next number, and is answered.
    pub(crate) fn act(&mut self, act: Act) -> Result<Option<CommandId>, Unable> {
        self.serial += 1;
        self.numbered(self.serial, act)
    }

    pub(crate) fn numbered(&mut self, serial: u64, act: Act) -> Result<Option<CommandId>, Unable> {
        self.give(&Input::Act { bytes: codec::encode(&Numbered { serial, act }) });
        self.console.shown(self.now).answers.last().unwrap().outcome
    }

    /// Away from safe, in two steps.
    pub(crate) fn order(&mut self, kind: CommandKind) -> Result<Option<CommandId>, Unable> {
        let order = Order::Command(UnitId::A, kind);
        self.act(Act::Prepare(order))?;
        self.act(Act::Confirm(order, Text::new("as planned")))
    }

    /// The intents asked for so far.
    pub(crate) fn intents(&self) -> Vec<(Intent, Vec<u8>)> {
        let stage = |requested: &Asked| match requested {
            Asked::Stage(intent, bytes) => Some((*intent, bytes.clone())),
            Asked::Release(_) | Asked::Watch(_) | Asked::Revoke(_) => None,
        };
        self.asked.iter().filter_map(stage).collect()
    }

    pub(crate) fn refusals(&self) -> Vec<Reason> {
        let reason = |(_, event): &(Instant, Event)| match event {
            Event::Refused { reason, .. } => Some(*reason),
            _ => None,
        };
        self.events.iter().filter_map(reason).collect()
    }

    /// Time, freshness and age of each display of A.
    pub(crate) fn displayed(&self) -> Vec<(Instant, Freshness, Span)> {
        let shown = |(time, event): &(Instant, Event)| match event {
            Event::Displayed { unit: UnitId::A, freshness, age, .. } => Some((*time, *freshness, *age)),
            _ => None,
        };
        self.events.iter().filter_map(shown).collect()
    }
}

/// A console that starts at `now`.
pub(crate) fn console(
    policy: Policy,
    role: Role,
    script: Vec<ScriptStep>,
    revocations: Vec<(NodeId, Vec<u8>)>,
    now: Instant,
) -> Console {
    console_of(&[UnitId::A, UnitId::B], policy, role, script, revocations, now)
}

fn console_of(
    units: &[UnitId],
    policy: Policy,
    role: Role,
    script: Vec<ScriptStep>,
    revocations: Vec<(NodeId, Vec<u8>)>,
    now: Instant,
) -> Console {
    let (setup, config) = making(units, policy, role, script, revocations);
    Console::new(setup, config, now).unwrap()
}

/// A console that follows a recording of one with a person in this role, without any of its secrets.
pub(crate) fn retracing(role: Role, now: Instant) -> Console {
    let revocations = Bench::revocations().into_iter().map(|(node, _)| (node, Vec::new())).collect();
    let (mut setup, config) = making(&[UnitId::A, UnitId::B], Policy::default(), role, Vec::new(), revocations);
    setup.secret = Secret([0; 32]);
    setup.channels.iter_mut().filter(|c| c.topic == Topic::Intents).for_each(|c| c.key = ChannelKey([0; 32]));
    Console::retrace(setup, ConsoleConfig { operator_secret: Secret([0; 32]), ..config }, now).unwrap()
}

pub(crate) fn making(
    units: &[UnitId],
    policy: Policy,
    role: Role,
    script: Vec<ScriptStep>,
    revocations: Vec<(NodeId, Vec<u8>)>,
) -> (Setup, ConsoleConfig) {
    let setup = Setup {
        node: NodeId::CONSOLE,
        boot: Boot(1),
        world: WorldId(0),
        seed: 3,
        policy,
        bounds: Bounds::GROUND,
        secret: Secret([9; 32]),
        public_keys: units.iter().map(|unit| (unit.node(), key_of(unit.node()).public())).collect(),
        channels: vec![
            Channel { topic: Topic::Feed, producer: NodeId::GATEWAY, key: FEED },
            Channel { topic: Topic::Intents, producer: NodeId::CONSOLE, key: INTENTS },
        ],
        ablation: None,
        verifier: None,
    };
    let config = ConsoleConfig {
        units: units.to_vec(),
        awaited: units.to_vec(),
        operator: NodeId::OPERATOR,
        operator_secret: Secret([NodeId::OPERATOR.index() as u8 + 1; 32]),
        role,
        script,
        eye: None,
        revocations,
        text: true,
    };
    (setup, config)
}

pub(crate) fn report(sequence: u64, stamp: u64, mode: Mode) -> Report {
    let track = ReportedTrack {
        id: TrackId(4),
        class: Class::Vehicle,
        x_mm: 10_000,
        y_mm: 0,
        confidence: 900,
        supported: Modalities::default().with_modality(Modality::Thermal).with_modality(Modality::Lidar),
        age: Span::ms(50),
        contradicted: Modalities::default(),
        bearings_mrad: 0,
        across_px: 24,
    };
    Report {
        mode,
        cause: Cause::Start,
        pose: Pose { x_mm: 1, y_mm: 2, yaw_mrad: 3 },
        pose_age: Span::ms(10),
        command_nonce: Nonce(sequence + 500),
        tracks: [track].into_iter().collect::<List<_, 8>>(),
        ..Report::bare(RecordId { node: NodeId::UNIT_A, boot: Boot(1), sequence: Sequence(sequence) }, PeerStamp(stamp))
    }
}

pub(crate) fn sign(author: NodeId, report: &Report) -> Vec<u8> {
    key_of(author).sign(Purpose::Report, &codec::encode(report))
}

pub(crate) fn step(at_ms: u64, action: Action, mode: Mode) -> ScriptStep {
    ScriptStep {
        at_ms: Some(at_ms),
        unit: UnitId::A,
        when: When { mode: Some(mode), track: None },
        action,
        reason: "as planned".into(),
        within_ms: 2000,
        tag: None,
    }
}

fn read(bytes: &[u8]) -> Asked {
    let body = &bytes[AROUND.0..bytes.len() - AROUND.1];
    match codec::decode(body, body.len()).unwrap() {
        Request::Stage(intent) => {
            let signed = Signed::parse(intent, 1024).unwrap();
            Asked::Stage(codec::decode(signed.payload, 1024).unwrap(), intent.to_vec())
        }
        Request::Release(confirmation) => {
            let signed = Signed::parse(confirmation, 1024).unwrap();
            Asked::Release(codec::decode(signed.payload, 1024).unwrap())
        }
        Request::Watch(nonce) => Asked::Watch(nonce),
        Request::Revoke(revocation) => Asked::Revoke(revocation.to_vec()),
    }
}

/// Encoded crops of a track in one shade, and the entry that vouches for them.
pub(crate) fn crops_of(track: TrackId, shade: u8) -> (Vec<Vec<u8>>, Pictured) {
    let body = |at: usize| (6..18).contains(&(at % WIDTH)) && (7..12).contains(&(at / WIDTH));
    let shades: [u8; PIXELS] = std::array::from_fn(|index| if body(index) { shade.saturating_add(120) } else { shade });
    let mut colour = [shade; 2 * PIXELS];
    (0..PIXELS).filter(|index| body(*index)).for_each(|index| colour[2 * index + 1] = shade / 2);
    let crop = |pixels| Crop { track, frame: FrameId(7), scale: 2, pixels };
    let all = [
        crop(Pixels::Colour(colour.into())),
        crop(Pixels::Warmth(28_700, 31_000, shades.into())),
        crop(Pixels::Depth(9_000, 12_500, shades.into())),
    ];
    let bytes: Vec<Vec<u8>> = all.iter().map(codec::encode).collect();
    let crops = bytes.iter().map(|bytes| <[u8; 32]>::from(Sha256::digest(bytes)).into()).collect();
    (bytes, Pictured { track, age: Span::ms(130), crops })
}
