//! A bench around one core: hand-made sensor products, seals, a supervisor and an operator, on a virtual clock.
//!
//! Everything the core gets is bytes, sealed and signed as the real parts would. Each fault is a public field; the
//! bench does the rest until it is set back.

use std::collections::BTreeSet;

use autonomy::{Autonomy, AutonomyConfig, GuestConfig};
use config::platform::Limits;
use config::setup::{Ablation, Channel, Setup};
use minicbor::bytes::ByteSlice;
use sha2::{Digest, Sha256};
use wire::audit::{Entry, Seal, SealedHead};
use wire::bounds::Bounds;
use wire::bus::{ChannelKey, Sender};
use wire::codec::{self, List, Text};
use wire::command::{Ack, CommandKind, Confirmation, Intent, Order, ReportHash};
use wire::core::{Core, Input, Output, Subject, Topic};
use wire::crop::{CAMERAS, Crop};
use wire::drive::{Act, Drive, SetPoint};
use wire::event::Event;
use wire::guest::{Answer, BodyVelocity, MAX_REQUEST, Reply, Request};
use wire::id::{
    Boot, CommandId, FrameId, NodeId, Nonce, PeerId, RecordId, Sequence, SessionId, TrackId, UnitId, WorldId,
};
use wire::mode::{Cause, Guard, Mode};
use wire::policy::Policy;
use wire::report::{MAX_REPORT, Report};
use wire::sensor::{Class, Fix, Modalities, Modality, Navigation, Odometry, Pose, ProductMode, ReceiverTime};
use wire::session::{MAX_SESSION_MESSAGE, SESSION_VERSION, SessionBody, SessionMessage, Teammate};
use wire::sign::Secret;
use wire::sign::{Key, Purpose, Signed};
use wire::time::{Echo, Instant, PeerStamp, Span};
use wire::track::{StageProduct, Track, Tracks};

/// The designated track.
pub(crate) const TRACK: TrackId = TrackId(7);
/// The supervisor's clock is this far ahead of the vehicle's, microseconds.
const GATEWAY_AHEAD: u64 = 7_000_000;
const SESSION: SessionId = SessionId(1);
const SESSION_NONCE: Nonce = Nonce(0x5e55);
const STEP: Span = Span::ms(50);

pub(crate) struct Bench {
    pub(crate) core: Autonomy,
    pub(crate) now: Instant,
    /// Place and motion of the unit: mm, mm, mm/s; it drives east.
    pub(crate) at: (f64, f64),
    pub(crate) speed: f64,
    /// Products that are missing, and the designated track's class.
    pub(crate) missing: BTreeSet<Modality>,
    pub(crate) class: Class,
    /// True if no tracks are sent.
    pub(crate) no_tracks: bool,
    pub(crate) no_fix: bool,
    pub(crate) no_seals: bool,
    /// The other parts of a guest's velocity.
    pub(crate) velocity: Option<BodyVelocity>,
    /// LiDAR looks around an empty place.
    pub(crate) lidar: bool,
    pub(crate) no_grants: bool,
    /// Offset of the fix, mm north.
    pub(crate) fix_offset: i32,
    /// Offset of the receiver's time, microseconds.
    pub(crate) time_offset: i64,
    /// Outputs of the core.
    pub(crate) events: Vec<Event>,
    pub(crate) acks: Vec<Ack>,
    pub(crate) acts: Vec<Act>,
    pub(crate) drive: Option<Drive>,
    pub(crate) report: Option<Report>,
    /// Place of the track, mm.
    pub(crate) place: (i32, i32),
    /// Hash of its bytes.
    pub(crate) shown: Option<ReportHash>,
    /// Crops that perception sends with its next frame, and those that the unit has sent.
    pub(crate) cropped: List<Crop, CAMERAS>,
    pub(crate) crops: Vec<Vec<u8>>,
    /// The guest's set-point: mm/s and 10⁻⁶ per metre; no answer where absent.
    pub(crate) pilot: Option<(i32, i32)>,
    /// Requests to the guest so far.
    pub(crate) asked: Vec<Request>,
    answered: u32,
    sim: Sender,
    perception: Sender,
    recorder: Sender,
    entries: u64,
    frame: u64,
    products: [Option<StageProduct>; 4],
    theirs: Option<Nonce>,
    challenge: Option<Echo>,
    sent: u64,
    commands: u64,
}

impl Bench {
    /// A core in the yard: fence ±20 m, one vehicle in view, standing at (-10 m, 0), heading east.
    pub(crate) fn new() -> Bench {
        Bench::with_policy(Policy::default(), None)
    }

    pub(crate) fn with_policy(policy: Policy, ablation: Option<Ablation>) -> Bench {
        Bench::made(setup(policy, ablation))
    }

    /// The core as it starts the `n`th time.
    pub(crate) fn of_boot(n: u32) -> Bench {
        Bench::made(Setup { boot: Boot(n), ..setup(Policy::default(), None) })
    }

    /// A core with a guest, who asks for this set-point in every step.
    pub(crate) fn piloted(bare: bool, pilot: Option<(i32, i32)>) -> Bench {
        Bench::piloted_with(Limits::GROUND, bare, pilot)
    }

    /// A bench on a platform with these limits.
    pub(crate) fn piloted_with(limits: Limits, bare: bool, pilot: Option<(i32, i32)>) -> Bench {
        let (start_limit, step_limit) = (Span::ms(5000), Span::ms(500));
        let guest = GuestConfig { name: "test".into(), bare, start_limit, step_limit, start: None };
        let config = AutonomyConfig { guest: Some(guest), limits, ..config() };
        let mut bench = Bench::from_setup(setup(Policy::default(), None), config);
        bench.pilot = pilot;
        bench.answer(&Answer::Ready);
        bench
    }

    pub(crate) fn answer(&mut self, answer: &Answer) {
        self.feed(&Input::Guest { bytes: codec::encode(answer) });
    }

    fn made(setup: Setup) -> Bench {
        Bench::from_setup(setup, config())
    }

    fn from_setup(setup: Setup, config: AutonomyConfig) -> Bench {
        let now = Instant(50_000_000);
        let core = Autonomy::new(setup, config, now).unwrap();
        let sender = |topic, producer| Sender::new(topic, producer, Boot(1), channel_key(topic));
        let mut bench = Bench {
            core,
            now,
            at: (-10_000.0, 0.0),
            speed: 0.0,
            missing: BTreeSet::new(),
            class: Class::Vehicle,
            no_tracks: false,
            no_fix: false,
            no_seals: false,
            velocity: None,
            lidar: false,
            no_grants: false,
            fix_offset: 0,
            time_offset: 0,
            events: Vec::new(),
            acks: Vec::new(),
            acts: Vec::new(),
            drive: None,
            report: None,
            place: (9000, 6000),
            shown: None,
            cropped: List::default(),
            crops: Vec::new(),
            pilot: None,
            asked: Vec::new(),
            answered: 0,
            sim: sender(Topic::Navigation, NodeId::SIM),
            perception: sender(Topic::Tracks, NodeId::PERCEPTION),
            recorder: sender(Topic::Seals, NodeId::RECORDER),
            entries: 0,
            frame: 0,
            products: [None; 4],
            theirs: None,
            challenge: None,
            sent: 0,
            commands: 0,
        };
        bench.feed(&Input::Opened { session: SESSION, peer: PeerId::GATEWAY });
        bench
    }

    /// A bench whose core has got to `mode` (Ready or PrepareToAct) on the operator's orders.
    pub(crate) fn in_mode(mode: Mode) -> Bench {
        let mut bench = Bench::new();
        bench.reach(mode);
        bench
    }

    /// Time of the report right before the loss of `guard`: the fence is near enough to be reached before an authority
    /// expires.
    pub(crate) fn before_loss(guard: Guard, mode: Mode) -> Bench {
        let mut bench = Bench::new();
        if guard == Guard::Geofence {
            bench.at = (2000.0, 0.0);
        }
        bench.reach(mode);
        bench
    }

    pub(crate) fn reach(&mut self, mode: Mode) {
        self.run(2000);
        assert_eq!(self.order(CommandKind::Enable), None);
        if mode == Mode::PrepareToAct {
            assert_eq!(self.order(CommandKind::Arm(TRACK)), None);
        }
        assert_eq!(self.core.mode(), mode);
    }

    /// Lets `ms` of virtual time pass.
    pub(crate) fn run(&mut self, ms: u64) {
        let end = self.now + Span::ms(ms);
        while self.now < end {
            self.now += STEP;
            self.at.0 += self.speed * 0.05;
            self.frame += 1;
            self.navigate();
            if self.frame.is_multiple_of(2) {
                self.perceive();
                self.supervise();
            }
            if self.frame.is_multiple_of(5) && !self.no_seals {
                self.seal();
            }
            while self.core.deadline().is_some_and(|deadline| deadline <= self.now) {
                self.feed(&Input::Timeout);
            }
        }
    }

    /// Gives an order as a prompt operator does; gives why it was refused.
    pub(crate) fn order(&mut self, kind: CommandKind) -> Option<wire::refusal::Reason> {
        let bytes = self.signed_order(kind);
        self.publish(bytes);
        self.acks.last().unwrap().refused
    }

    /// The bytes of a fresh order with both its steps.
    pub(crate) fn signed_order(&mut self, kind: CommandKind) -> Vec<u8> {
        let intent = self.intent(kind, "for a reason");
        order_bytes(&intent, !kind.towards_safe())
    }

    /// A fresh intent.
    pub(crate) fn intent(&mut self, kind: CommandKind, reason: &str) -> Intent {
        self.commands += 1;
        let id = CommandId { operator: NodeId::OPERATOR, boot: Boot(1), sequence: Sequence(self.commands) };
        let nonce = self.report.as_ref().map_or(Nonce::NONE, |report| report.command_nonce);
        let shown = kind.rests_on_display().and(self.shown);
        Intent { id, unit: UnitId::A, nonce, kind, reason: Text::new(reason), tag: None, shown }
    }

    pub(crate) fn publish(&mut self, bytes: Vec<u8>) {
        self.feed(&Input::Published { subject: Subject::Command(UnitId::A), bytes });
    }

    /// A teammate's report as the supervisor sends it, signed by `unit`, brought by `via`.
    pub(crate) fn claim(&mut self, unit: UnitId, via: PeerId, sequence: u64, (x_mm, y_mm): (i32, i32)) {
        let report = self.report_of(unit, sequence, (x_mm, y_mm));
        let signed = key_of(unit.node()).sign(Purpose::Report, &codec::encode(&report));
        let body = Teammate { via, age: Span::ms(20), report: <&ByteSlice>::from(signed.as_slice()) };
        self.downlink(SessionBody::Teammate(body));
    }

    /// Sets a speed and a heading, mm/s and mrad.
    pub(crate) fn moving(&mut self, unit: UnitId, via: PeerId, sequence: u64, place: (i32, i32), motion: (i32, i16)) {
        let mut report = self.report_of(unit, sequence, place);
        (report.speed_mm_s, report.pose.yaw_mrad) = motion;
        let signed = key_of(unit.node()).sign(Purpose::Report, &codec::encode(&report));
        let body = Teammate { via, age: Span::ms(20), report: <&ByteSlice>::from(signed.as_slice()) };
        self.downlink(SessionBody::Teammate(body));
    }

    /// The transitions so far: from, to, cause.
    pub(crate) fn transitions(&self) -> Vec<(Mode, Mode, Cause)> {
        let transition_of = |event: &Event| match event {
            Event::Transition { from, to, cause, .. } => Some((*from, *to, *cause)),
            _ => None,
        };
        self.events.iter().filter_map(transition_of).collect()
    }

    pub(crate) fn feed(&mut self, input: &Input) {
        self.core.handle(self.now, input);
        while let Some(output) = self.core.output() {
            self.take(output);
        }
        if let (Some(Request::Step(step)), Some((speed_mm_s, curvature_um))) = (self.asked.last(), self.pilot)
            && self.answered < step.number
        {
            self.answered = step.number;
            let number = step.number;
            let reply = Reply {
                number,
                speed_mm_s,
                curvature_um,
                state: None,
                place: None,
                wake: None,
                velocity: self.velocity,
            };
            self.answer(&Answer::Reply(reply));
        }
    }

    /// A record of the supervisor.
    pub(crate) fn downlink(&mut self, body: SessionBody<'_>) {
        self.sent += 1;
        let outer = SessionMessage {
            version: SESSION_VERSION,
            session: self.theirs.unwrap_or(Nonce::NONE),
            boot: Boot(1),
            sequence: Sequence(self.sent),
            stamp: self.gateway_clock(),
            challenge: Nonce(0xc4a1),
            echo: self.challenge,
            body,
        };
        self.feed(&Input::Record { session: SESSION, bytes: codec::encode(&outer) });
    }

    fn report_of(&self, unit: UnitId, sequence: u64, (x_mm, y_mm): (i32, i32)) -> Report {
        Report {
            pose: Pose { x_mm, y_mm, yaw_mrad: 0 },
            command_nonce: Nonce(1),
            ..Report::bare(
                RecordId { node: unit.node(), boot: Boot(1), sequence: Sequence(sequence) },
                PeerStamp(1_000_000 + sequence * 100_000),
            )
        }
    }

    /// Forward speed of the newest set-point, mm/s.
    pub(crate) fn driven(&self) -> i32 {
        match self.drive.expect("a set-point").set_point {
            SetPoint::Course { speed_mm_s, .. } => speed_mm_s,
            SetPoint::Velocity { mm_s: [ahead, ..], .. } => ahead,
            SetPoint::Rest => 0,
        }
    }

    fn gateway_clock(&self) -> PeerStamp {
        PeerStamp(self.now.0 + GATEWAY_AHEAD)
    }

    fn navigate(&mut self) {
        let pose = Pose { x_mm: self.at.0 as i32, y_mm: self.at.1 as i32 + self.fix_offset, yaw_mrad: 0 };
        let time = ReceiverTime(self.now.0.saturating_add_signed(self.time_offset));
        let fix = (!self.no_fix).then_some(Fix { pose, sigma_mm: 40, time });
        // Wheels that turn never read the same for long.
        let noise = (self.now.0 / 50_000 % 2) as i32;
        let speed_mm_s = if self.speed == 0.0 { 0 } else { self.speed as i32 + noise };
        let odometry = Some(Odometry { speed_mm_s, yaw_rate_mrad_s: 0 });
        let bytes =
            self.sim.seal(self.now, &codec::encode(&Navigation { stamp: self.now, fix, odometry, spatial: None }));
        self.feed(&Input::Bus { topic: Topic::Navigation, bytes });
    }

    fn perceive(&mut self) {
        if self.no_tracks {
            return;
        }
        let (frame, stamp) = (FrameId(self.frame), self.now);
        for modality in Modality::ALL.into_iter().filter(|m| !self.missing.contains(m)) {
            self.products[modality as usize] = Some(StageProduct { frame, stamp });
        }
        let track = Track {
            id: TRACK,
            class: self.class,
            x_mm: self.place.0,
            y_mm: self.place.1,
            vx_mm_s: 0,
            vy_mm_s: 0,
            sigma_mm: 100,
            confidence: 900,
            supported: Modalities::default().with_modality(Modality::Rgb).with_modality(Modality::Thermal),
            vetoed: Modalities::default(),
            updated: stamp,
            frame,
            across_px: 24,
        };
        let tracks = [track].into_iter().collect();
        let crops = core::mem::take(&mut self.cropped);
        let tracks = Tracks {
            frame,
            stamp,
            mode: ProductMode::Live,
            products: self.products,
            tracks,
            crops,
            nearby: self.lidar.then(Default::default),
        };
        let bytes = self.perception.seal(self.now, &codec::encode(&tracks));
        self.feed(&Input::Bus { topic: Topic::Tracks, bytes });
    }

    fn supervise(&mut self) {
        if self.theirs.is_some_and(|_| self.report.is_some()) {
            if !self.no_grants {
                self.downlink(SessionBody::Grant(Span::ms(500)));
            }
        } else {
            self.downlink(SessionBody::Hello(SESSION_NONCE));
        }
    }

    fn seal(&mut self) {
        let heads = [SealedHead { node: NodeId::UNIT_A, boot: Boot(1), counter: self.entries }].into_iter().collect();
        let seal = Seal { entries: self.entries, head: [0; 32], heads };
        let bytes = self.recorder.seal(self.now, &codec::encode(&seal));
        self.feed(&Input::Bus { topic: Topic::Seals, bytes });
    }

    fn take(&mut self, output: Output) {
        match output {
            Output::Audit { bytes } => {
                let entry = Entry::decode(&bytes).unwrap();
                self.entries = entry.counter;
                self.events.push(entry.event);
            }
            Output::Record { bytes, .. } => self.uplink(&bytes),
            Output::Publish { subject, bytes } => {
                assert_eq!(subject, Subject::Ack(UnitId::A));
                let signed = Signed::parse(&bytes, 1024).unwrap();
                self.acks.push(codec::decode(signed.payload, 1024).unwrap());
            }
            Output::Bus { topic: Topic::Drive, bytes } => self.drive = Some(codec::decode(body(&bytes), 512).unwrap()),
            Output::Bus { topic: Topic::Act, bytes } => self.acts.push(codec::decode(body(&bytes), 512).unwrap()),
            Output::Guest { bytes } => self.asked.push(codec::decode(&bytes, MAX_REQUEST).unwrap()),
            other => panic!("no such output expected: {other:?}"),
        }
    }

    fn uplink(&mut self, bytes: &[u8]) {
        let outer: SessionMessage<'_> = codec::decode(bytes, MAX_SESSION_MESSAGE).unwrap();
        if self.challenge.is_none_or(|echo| echo.nonce != outer.challenge) {
            self.challenge = Some(Echo { nonce: outer.challenge, seen: self.gateway_clock() });
        }
        match outer.body {
            SessionBody::Hello(nonce) => self.theirs = Some(nonce),
            SessionBody::Report(bytes) => {
                assert_eq!(outer.session, SESSION_NONCE);
                let bytes: &[u8] = bytes;
                let signed = Signed::parse(bytes, MAX_REPORT).unwrap();
                self.report = Some(codec::decode(signed.payload, MAX_REPORT).unwrap());
                self.shown = Some(Sha256::digest(bytes).into());
            }
            SessionBody::Crop(bytes) => self.crops.push(bytes.to_vec()),
            SessionBody::Grant(_) | SessionBody::Teammate(_) | SessionBody::Watch(_) | SessionBody::Revoked(_) => {
                panic!("a unit says nothing of others")
            }
        }
    }
}

/// An order's bytes, with or without its second step.
pub(crate) fn order_bytes(intent: &Intent, confirmed: bool) -> Vec<u8> {
    let key = key_of(intent.id.operator);
    let signed = key.sign(Purpose::Intent, &codec::encode(intent));
    let hash = Sha256::digest(&signed).into();
    let second = key.sign(Purpose::Confirmation, &codec::encode(&Confirmation { id: intent.id, intent: hash }));
    let confirmation = confirmed.then(|| <&ByteSlice>::from(second.as_slice()));
    codec::encode(&Order { intent: <&ByteSlice>::from(signed.as_slice()), confirmation })
}

/// Makes `guard` fail, each in its own way.
pub(crate) fn lose(bench: &mut Bench, guard: Guard) {
    match guard {
        Guard::Rgb => drop(bench.missing.insert(Modality::Rgb)),
        Guard::Depth => drop(bench.missing.insert(Modality::Depth)),
        Guard::Thermal => drop(bench.missing.insert(Modality::Thermal)),
        Guard::Lidar => drop(bench.missing.insert(Modality::Lidar)),
        Guard::Tracks => bench.no_tracks = true,
        Guard::Localisation => bench.no_fix = true,
        // Within the gate, so that no single fix gives it away.
        Guard::Drift => bench.fix_offset = 600,
        Guard::TimeBase => bench.time_offset = -1_000_000,
        // Just below the highest speed at which odometry is believed.
        Guard::Geofence => bench.speed = 3700.0,
        Guard::Lease => bench.no_grants = true,
        Guard::SealedLog => bench.no_seals = true,
        Guard::Designation => bench.class = Class::Decoy,
        Guard::Teammates => {
            bench.claim(UnitId::B, PeerId::UNIT_B, 1, (0, 15_000));
            bench.claim(UnitId::B, PeerId::UNIT_B, 2, (0, -15_000));
        }
    }
}

pub(crate) fn key_of(node: NodeId) -> Key {
    Key::from_bytes(&[node.index() as u8 + 1; 32])
}

fn channel_key(topic: Topic) -> ChannelKey {
    ChannelKey([topic as u8; 32])
}

/// Bytes between a bus message's header and its tag.
fn body(bytes: &[u8]) -> &[u8] {
    &bytes[wire::bus::HEADER_LEN..bytes.len() - wire::bus::TAG_LEN]
}

fn config() -> AutonomyConfig {
    AutonomyConfig {
        unit: UnitId::A,
        route: vec![(15_000, 0)],
        looped: false,
        geofence: vec![(-20_000, -20_000), (20_000, -20_000), (20_000, 20_000), (-20_000, 20_000)],
        obstacles: Vec::new(),
        teammates: vec![UnitId::B, UnitId::C],
        operators: vec![NodeId::OPERATOR, NodeId::OPERATOR_2],
        mandates: Vec::new(),
        contacts: config::contact::Contacts::default(),
        supervisor: PeerId::GATEWAY,
        limits: Limits::GROUND,
        guest: None,
    }
}

fn setup(policy: Policy, ablation: Option<Ablation>) -> Setup {
    let channel = |topic, producer| Channel { topic, producer, key: channel_key(topic) };
    let public = |node: NodeId| (node, key_of(node).public());
    Setup {
        node: NodeId::UNIT_A,
        boot: Boot(1),
        world: WorldId(1),
        seed: 42,
        policy,
        bounds: Bounds::GROUND,
        secret: Secret([NodeId::UNIT_A.index() as u8 + 1; 32]),
        public_keys: [
            NodeId::UNIT_A,
            NodeId::UNIT_B,
            NodeId::UNIT_C,
            NodeId::OPERATOR,
            NodeId::OPERATOR_2,
            NodeId::AUTHORITY,
        ]
        .map(public)
        .to_vec(),
        channels: vec![
            channel(Topic::Navigation, NodeId::SIM),
            channel(Topic::Tracks, NodeId::PERCEPTION),
            channel(Topic::Seals, NodeId::RECORDER),
            channel(Topic::Drive, NodeId::UNIT_A),
            channel(Topic::Act, NodeId::UNIT_A),
        ],
        ablation,
        verifier: None,
    }
}
