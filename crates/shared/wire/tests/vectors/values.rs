//! The named values behind the vectors. Numbers are chosen to differ from each other and to need every width.

use ground_truth::{
    Action, Any, BusAttack, Entry, FaultKind, GuardVerdict, Note, Sensor, Sight, StepName, StreamEffect, Suspension,
};
use minicbor::bytes::ByteSlice;
use wire::audit::{Head, Seal, SealedHead};
use wire::bearing::{Bearings, Direction};
use wire::codec::{self, List, Malformed, Text};
use wire::command::{Ack, CommandKind, Confirmation, Intent, Order, Request, TimeTag};
use wire::core::{Input, Output, Side, Subject, Topic};
use wire::crop::{Crop, PIXELS, Pictured, Pixels};
use wire::drive::{Act, Drive, SetPoint};
use wire::event::{Account, Event, Freshness, Inconsistency, Interface, ShownAs};
use wire::feed::{AcceptedReport, CommandStage, Feed};
use wire::guest::{self, Answer, Block, Declared, Disc, Fault, MissionStart, Place, Reply};
use wire::id::{
    Boot, CommandId, FrameId, NodeId, Nonce, ObjectId, PeerId, RecordId, Sequence, SessionId, TrackId, UnitId, WorldId,
};
use wire::measured::Measured;
use wire::mode::{Because, Cause, Guard, Guards, Mode};
use wire::motion::{Attitude, Motion, ReportedMotion, Spatial};
use wire::person::{self, Alarm, Numbered, Shelf, Unable};
use wire::policy::{Check, Waived};
use wire::refusal::{Reason, Refusal};
use wire::report::{Report, ReportedAuthority, ReportedContact, ReportedTrack};
use wire::sensor::{
    Blob, Candidates, Class, Cluster, DepthSample, Detection, Fix, Frames, Modalities, Modality, Navigation, Odometry,
    PixelBox, Pose, ProductMode, ReceiverTime,
};
use wire::session::{SESSION_VERSION, SessionBody, SessionMessage, Teammate};
use wire::settings::Settings;
use wire::sign::{Key, Purpose, Signed};
use wire::time::{Echo, Instant, PeerStamp, Span};
use wire::track::{Nearby, StageProduct, Track, Tracks};
use wire::trust::Revocation;

/// A decoder of one message: bytes and the longest length allowed in, whether it is the named value out.
pub(crate) type Decode = Box<dyn Fn(&[u8], usize) -> Result<bool, Malformed>>;

/// A value with its name and its encoding.
pub(crate) struct Named {
    /// Name in the vector file.
    pub name: &'static str,
    /// Encoding by the codec.
    pub bytes: Vec<u8>,
    /// Decodes and compares with it.
    pub decode: Decode,
    /// For entries, the event's number.
    pub event: u8,
}

macro_rules! named {
    ($name:expr, $message:ty, $value:expr) => {{
        let value: $message = $value;
        let bytes = codec::encode(&value);
        let decode: Decode = Box::new(move |bytes, max| codec::decode::<$message>(bytes, max).map(|got| got == value));
        Named { name: $name, bytes, decode, event: 0 }
    }};
}

/// Every message with its values, in the order of the vector files.
pub(crate) fn all() -> Vec<(&'static str, Vec<Named>)> {
    vec![
        ("report", reports()),
        ("hop", session_messages()),
        ("intent", intents()),
        ("confirmation", vec![named!("of-arm", Confirmation, Confirmation { id: COMMAND, intent: [0xab; 32] })]),
        ("order", orders()),
        ("ack", acks()),
        ("request", requests()),
        ("feed", feeds()),
        ("frames", frames()),
        ("candidates", candidates()),
        ("bearings", bearings()),
        ("navigation", navigation()),
        ("crop", crop_vectors()),
        ("tracks", tracks()),
        (
            "drive",
            vec![
                named!("left-turn", Drive, drive()),
                named!("velocity", Drive, moving(SetPoint::Velocity { mm_s: [1200, -300, 80], turn_mrad_s: -200 })),
                named!("rest", Drive, moving(SetPoint::Rest)),
            ],
        ),
        ("act", vec![named!("confirmed", Act, act())]),
        ("entry", entries()),
        ("seal", seals()),
        ("revocation", revocations()),
        ("head", vec![named!("unit-a", Head, head()), named!("guard-unit-64", Head, head_of_guard())]),
        ("sign1", signed()),
        ("numbered-act", acts()),
        ("input", inputs()),
        ("output", outputs()),
        ("guest-request", guest_requests()),
        ("guest-answer", guest_answers()),
    ]
}

pub(crate) const COMMAND: CommandId = CommandId { operator: NodeId::OPERATOR, boot: Boot(2), sequence: Sequence(7) };
const RECORD: RecordId = RecordId { node: NodeId::UNIT_C, boot: Boot(3), sequence: Sequence(1000) };

const VALUES: Settings = Settings { speed_mm_s: 2500, margin_mm: 1000, arm_permille: 600, keep_permille: 450 };

fn opaque(bytes: &'static [u8]) -> &'static ByteSlice {
    bytes.into()
}

pub(crate) fn report() -> Report {
    Report {
        origin: NodeId::UNIT_A,
        boot: Boot(1),
        sequence: Sequence(41),
        stamp: PeerStamp(5_000_000_000),
        product: ProductMode::Live,
        mode: Mode::PrepareToAct,
        cause: Cause::Operator,
        failing: Guards::default(),
        pose: Pose { x_mm: -12_000, y_mm: 300, yaw_mrad: -1571 },
        speed_mm_s: 1500,
        pose_age: Span(20_000),
        authority: Some(ReportedAuthority { track: TrackId(3), left: Span::ms(4200) }),
        command_nonce: Nonce(u64::MAX),
        last_command: Some((COMMAND, None)),
        progress: 250,
        tracks: [ReportedTrack {
            id: TrackId(3),
            class: Class::Vehicle,
            x_mm: 8000,
            y_mm: -70_000,
            confidence: 870,
            supported: Modalities::default().with_modality(Modality::Rgb).with_modality(Modality::Lidar),
            age: Span::ms(80),
            contradicted: Modalities::default().with_modality(Modality::Thermal),
            bearings_mrad: 524,
            across_px: 17,
        }]
        .into_iter()
        .collect(),
        watched: Some(Echo { nonce: Nonce(11), seen: PeerStamp(4_999_000_000) }),
        sessions_lost: 2,
        measured: Measured::default()
            .aged(Guard::Rgb, Some(Span::ms(84)))
            .aged(Guard::SealedLog, Some(Span(u64::MAX)))
            .with_value(Guard::Geofence, Some(-120)),
        settings: Some(VALUES),
        motion: None,
        contact: None,
        pictured: None,
    }
}

fn reports() -> Vec<Named> {
    let bare = Report {
        mode: Mode::Degraded,
        cause: Cause::Lost(Guard::Thermal),
        failing: Guards::default().with_guard(Guard::Thermal).with_guard(Guard::Designation),
        authority: None,
        last_command: None,
        tracks: List::default(),
        watched: None,
        sessions_lost: 0,
        measured: Measured::default()
            .aged(Guard::Thermal, Some(Span::ms(412)))
            .claimed(Some((UnitId::B, Inconsistency::Residual))),
        settings: None,
        ..report()
    };
    let refused = Report { last_command: Some((COMMAND, Some(Reason::Interlock))), ..bare.clone() };
    let left_up_mm_s = [-30, 12];
    let (attitude, sunlit) = (Some(Attitude::new([0.6, 0.0, 0.8, 0.0])), Some(true));
    let motion = ReportedMotion { up_mm: 2480, left_up_mm_s, charge: 871, attitude: None, sunlit: None };
    let aloft = Report { motion: Some(motion), ..bare.clone() };
    let crops = [[0xab; 32].into(), [0xcd; 32].into()].into_iter().collect();
    let pictured = Some(Pictured { track: TrackId(3), age: Span::ms(80), crops });
    let pictured = Report { pictured, ..bare.clone() };
    let contact = Some(ReportedContact { left: Span::ZERO, next: Some(Span::s(30)) });
    let passing = Report { motion: Some(ReportedMotion { attitude, sunlit, ..motion }), contact, ..bare.clone() };
    vec![
        named!("with-authority-and-a-track", Report, report()),
        named!("aloft", Report, aloft),
        named!("between-contacts", Report, passing),
        named!("with-crops", Report, pictured),
        named!("degraded-without-either", Report, bare),
        named!("last-command-refused", Report, refused),
    ]
}

pub(crate) fn session_message(body: SessionBody<'static>) -> SessionMessage<'static> {
    SessionMessage {
        version: SESSION_VERSION,
        session: Nonce(0x0102_0304_0506_0708),
        boot: Boot(1),
        sequence: Sequence(300),
        stamp: PeerStamp(70_000),
        challenge: Nonce(23),
        echo: Some(Echo { nonce: Nonce(24), seen: PeerStamp(65_000) }),
        body,
    }
}

fn session_messages() -> Vec<Named> {
    let first = SessionMessage {
        session: Nonce(0),
        sequence: Sequence(1),
        echo: None,
        ..session_message(SessionBody::Hello(Nonce(99)))
    };
    let teammate = Teammate { via: PeerId::UNIT_B, age: Span::ms(12), report: opaque(b"signed") };
    vec![
        named!("hello-before-any-challenge", SessionMessage<'_>, first),
        named!("report", SessionMessage<'_>, session_message(SessionBody::Report(opaque(b"signed")))),
        named!("grant", SessionMessage<'_>, session_message(SessionBody::Grant(Span::ms(500)))),
        named!("teammate", SessionMessage<'_>, session_message(SessionBody::Teammate(teammate))),
        named!("watch", SessionMessage<'_>, session_message(SessionBody::Watch(Nonce(11)))),
        named!("crop", SessionMessage<'_>, session_message(SessionBody::Crop(opaque(b"crop")))),
        named!("revoked", SessionMessage<'_>, session_message(SessionBody::Revoked(opaque(b"signed")))),
    ]
}

/// Time tag of a command for later.
const TAG: TimeTag = TimeTag { after: Span::s(40), within: Span::s(1) };

pub(crate) fn intent(kind: CommandKind, reason: &str) -> Intent {
    let shown = kind.rests_on_display().map(|_| [0xef; 32]);
    Intent { id: COMMAND, unit: UnitId::A, nonce: Nonce(77), kind, reason: Text::new(reason), tag: None, shown }
}

/// The unit with this name, numbered by rule.
fn ruled(name: &str) -> UnitId {
    UnitId::from_name(name).expect("a unit of the table")
}

fn revocations() -> Vec<Named> {
    let last = NodeId::from_name("perception-52").expect("the last identity of the table");
    vec![
        named!("of-operator-2", Revocation, Revocation { of: NodeId::OPERATOR_2 }),
        named!("of-unit-5", Revocation, Revocation { of: ruled("unit-5").node() }),
        named!("of-the-last-identity", Revocation, Revocation { of: last }),
    ]
}

fn head_of_guard() -> Head {
    Head { node: ruled("unit-64").node().guard().expect("a unit has one"), ..head() }
}

fn intents() -> Vec<Named> {
    vec![
        named!("hold", Intent, intent(CommandKind::Hold, "")),
        named!("disarm", Intent, intent(CommandKind::Disarm, "")),
        named!("enable", Intent, intent(CommandKind::Enable, "start of the mission")),
        named!("resume", Intent, intent(CommandKind::Resume, "cause understood")),
        named!("arm", Intent, intent(CommandKind::Arm(TrackId(3)), "vehicle in view")),
        named!("confirm", Intent, intent(CommandKind::Confirm(TrackId(3)), "still in view")),
        named!("configure", Intent, intent(CommandKind::Configure(VALUES), "wet ground")),
        named!("hold-at-a-time", Intent, Intent { tag: Some(TAG), ..intent(CommandKind::Hold, "") }),
        named!("hold-of-unit-64", Intent, Intent { unit: ruled("unit-64"), ..intent(CommandKind::Hold, "") }),
    ]
}

fn orders() -> Vec<Named> {
    let (intent, confirmation) = (opaque(b"intent"), opaque(b"confirmation"));
    vec![
        named!("towards-safe", Order<'_>, Order { intent, confirmation: None }),
        named!("away-from-safe", Order<'_>, Order { intent, confirmation: Some(confirmation) }),
    ]
}

fn acks() -> Vec<Named> {
    let executed = Ack { id: COMMAND, intent: [0xcd; 32], refused: None, mode: Mode::HoldSafe, due: None };
    let refused = Ack { refused: Some(Reason::Late), mode: Mode::Ready, ..executed };
    let stored = Ack { due: Some(Span::ms(39_700)), mode: Mode::Ready, ..executed };
    vec![named!("executed", Ack, executed), named!("refused", Ack, refused), named!("stored", Ack, stored)]
}

fn requests() -> Vec<Named> {
    vec![
        named!("stage", Request<'_>, Request::Stage(opaque(b"intent"))),
        named!("release", Request<'_>, Request::Release(opaque(b"confirmation"))),
        named!("watch", Request<'_>, Request::Watch(Nonce(11))),
        named!("revoke", Request<'_>, Request::Revoke(opaque(b"revocation"))),
    ]
}

fn feeds() -> Vec<Named> {
    let report = AcceptedReport {
        via: PeerId::UNIT_A,
        unit: UnitId::A,
        received: Instant(9_000_000),
        age: Some(Span::ms(31)),
        waived: Waived::default(),
        report: opaque(b"signed"),
    };
    let waived = Waived::default().with_check(Check::Freshness).with_check(Check::Signature);
    let unknown_age = AcceptedReport { age: None, waived, ..report };
    vec![
        named!("accepted", Feed<'_>, Feed::Accepted(report)),
        named!("accepted-of-unknown-age", Feed<'_>, Feed::Accepted(unknown_age)),
        named!("refused-from-a-peer", Feed<'_>, Feed::Refused(Reason::Stale, Some(PeerId::UNIT_B), 70_000)),
        named!("refused-from-nobody-known", Feed<'_>, Feed::Refused(Reason::Tag, None, 1)),
        named!("session-open", Feed<'_>, Feed::Session(PeerId::UNIT_C, true)),
        named!("command-sent", Feed<'_>, Feed::Command([7; 32], CommandStage::Sent, None)),
        named!("command-refused", Feed<'_>, Feed::Command([7; 32], CommandStage::Refused, Some(Reason::Late))),
        named!("acknowledged", Feed<'_>, Feed::Acknowledged(opaque(b"ack"))),
        named!("sessions-lost", Feed<'_>, Feed::SessionsLost(2)),
        named!("crop", Feed<'_>, Feed::Crop(UnitId::A, opaque(b"crop"))),
    ]
}

fn frames() -> Vec<Named> {
    let none = Frames {
        frame: FrameId(12),
        stamp: Instant(1_200_000),
        width: 2,
        height: 1,
        rgb: None,
        depth: None,
        thermal: None,
        lidar: None,
    };
    let full = Frames {
        rgb: Some(opaque(&[1, 2, 3, 4, 5, 6])),
        depth: Some(opaque(&[0x10, 0x27, 0, 0])),
        thermal: Some(opaque(&[0x72, 0x72, 0x90, 0x72])),
        lidar: Some(opaque(&[0xe8, 3])),
        ..none
    };
    vec![
        named!("all-modalities", Frames<'_>, full),
        named!("thermal-lost", Frames<'_>, Frames { thermal: None, ..full }),
        named!("lidar-lost", Frames<'_>, Frames { lidar: None, ..full }),
        named!("nothing", Frames<'_>, none),
    ]
}

fn candidates() -> Vec<Named> {
    let bounds = PixelBox { x0: 10, y0: 20, x1: 40, y1: 300 };
    let full = Candidates {
        frame: FrameId(12),
        stamp: Instant(1_200_000),
        mode: ProductMode::Live,
        rgb: Some([Detection { class: Class::Decoy, score: 640, bounds }].into_iter().collect()),
        depth: Some([DepthSample { detection: 0, median_mm: 9000 }].into_iter().collect()),
        thermal: Some(
            [Blob { bounds, mean_ck: 30_500, peak_ck: 31_000, class: Class::Person, score: 730 }].into_iter().collect(),
        ),
        lidar: Some([Cluster { x_mm: 9100, y_mm: -400, width_mm: 1800, height_mm: 1500 }].into_iter().collect()),
        grain: Some([0, 7, u32::MAX, 1]),
    };
    let looked = Candidates { rgb: Some(List::default()), depth: None, thermal: Some(List::default()), ..full.clone() };
    let none = Candidates {
        mode: ProductMode::Replay,
        rgb: None,
        depth: None,
        thermal: None,
        lidar: None,
        grain: None,
        ..looked.clone()
    };
    vec![
        named!("nothing-from-any-stage", Candidates, none),
        named!("looked-and-saw-nothing-without-depth", Candidates, looked),
        named!("all-stages", Candidates, full),
    ]
}

fn navigation() -> Vec<Named> {
    let fix =
        Some(Fix { pose: Pose { x_mm: 1, y_mm: -2, yaw_mrad: 3141 }, sigma_mm: 50, time: ReceiverTime(7_000_000) });
    let odometry = Some(Odometry { speed_mm_s: -200, yaw_rate_mrad_s: 100 });
    let stamp = Instant(1_250_000);
    vec![
        named!("both", Navigation, Navigation { stamp, fix, odometry, spatial: None }),
        named!("localisation-lost", Navigation, Navigation { stamp, fix: None, odometry, spatial: None }),
        named!("odometry-lost", Navigation, Navigation { stamp, fix, odometry: None, spatial: None }),
        named!("neither", Navigation, Navigation { stamp, fix: None, odometry: None, spatial: None }),
        named!("aloft", Navigation, Navigation { stamp, fix, odometry, spatial: Some(spatial()) }),
        named!(
            "aloft-without-pressure",
            Navigation,
            Navigation { spatial: Some(Spatial { pressure_up_mm: None, ..spatial() }), stamp, fix, odometry }
        ),
        named!(
            "aloft-without-anything",
            Navigation,
            Navigation { stamp, fix: None, odometry: None, spatial: Some(Spatial::default()) }
        ),
    ]
}

fn bearings() -> Vec<Named> {
    let all = Bearings {
        frame: FrameId(12),
        stamp: Instant(1_200_000),
        mode: ProductMode::Live,
        stars: Some(Attitude::new([0.5, -0.5, 0.5, 0.5])),
        sun: Some(Direction::new([0.0, 0.6, -0.8])),
        horizon: Some(Direction::new([0.0, 0.0, 1.0])),
        field: Some(Direction::new([1.0, 0.0, 0.0])),
    };
    let eclipse = Bearings { stars: None, sun: Some(Direction::default()), ..all };
    let no_field = Bearings { field: None, ..all };
    vec![
        named!("all", Bearings, all),
        named!("no-stars-and-the-sun-hidden", Bearings, eclipse),
        named!("no-field", Bearings, no_field),
    ]
}

fn spatial() -> Spatial {
    Spatial {
        fix_up_mm: Some(6_871_000_000),
        pressure_up_mm: Some(2480),
        range_mm: Some(2390),
        left_up_mm_s: Some([-30, 12]),
        charge: Some(871),
        attitude: Some(Attitude::new([0.6, 0.0, 0.8, 0.0])),
        sunlit: Some(false),
    }
}

/// One of each camera.
fn crops() -> [Crop; 3] {
    let crop = |pixels| Crop { track: TrackId(3), frame: FrameId(12), scale: 2, pixels };
    [
        crop(Pixels::Colour([0x5a; 2 * PIXELS].into())),
        crop(Pixels::Warmth(28_700, 31_000, [0x40; PIXELS].into())),
        crop(Pixels::Depth(9_100, 12_400, [0; PIXELS].into())),
    ]
}

fn crop_vectors() -> Vec<Named> {
    let [colour, warmth, depth] = crops();
    vec![named!("colour", Crop, colour), named!("warmth", Crop, warmth), named!("depth", Crop, depth)]
}

fn tracks() -> Vec<Named> {
    let product = Some(StageProduct { frame: FrameId(12), stamp: Instant(1_200_000) });
    let track = Track {
        id: TrackId(3),
        class: Class::Person,
        x_mm: 8000,
        y_mm: -70_000,
        vx_mm_s: 0,
        vy_mm_s: -1200,
        sigma_mm: 300,
        confidence: 999,
        supported: Modalities(0b1011),
        vetoed: Modalities(0b0100),
        updated: Instant(1_200_000),
        frame: FrameId(12),
        across_px: 17,
    };
    let nearby = Nearby { number: 4, x_mm: -2000, y_mm: 3500, vx_mm_s: 1400, vy_mm_s: 0, width_mm: 450 };
    let full = Tracks {
        frame: FrameId(12),
        stamp: Instant(1_200_000),
        mode: ProductMode::Live,
        products: [product; 4],
        tracks: [track].into_iter().collect(),
        crops: crops().into_iter().collect(),
        nearby: Some([nearby].into_iter().collect()),
    };
    let bare = Tracks {
        products: [product, None, None, None],
        tracks: List::default(),
        crops: List::default(),
        nearby: None,
        ..full.clone()
    };
    vec![named!("one-track", Tracks, full), named!("before-any-but-rgb", Tracks, bare)]
}

pub(crate) fn drive() -> Drive {
    moving(SetPoint::Course { speed_mm_s: 2500, curvature_um: 40_000 })
}

fn moving(set_point: SetPoint) -> Drive {
    Drive { stamp: Instant(1_300_000), set_point, lease: Span::ms(300) }
}

fn act() -> Act {
    Act {
        stamp: Instant(1_400_000),
        world: WorldId(0),
        authority: 2,
        track: TrackId(3),
        x_mm: 8000,
        y_mm: -70_000,
        command: COMMAND,
    }
}

fn seals() -> Vec<Named> {
    let head = SealedHead { node: NodeId::UNIT_A, boot: Boot(1), counter: 17 };
    let one = Seal { entries: 17, head: [0xee; 32], heads: [head].into_iter().collect() };
    let none = Seal { entries: 0, head: [0; 32], heads: List::default() };
    vec![named!("of-one-chain", Seal, one), named!("of-nothing-yet", Seal, none)]
}

fn head() -> Head {
    Head { node: NodeId::UNIT_A, boot: Boot(1), counter: 17, hash: [0x11; 32] }
}

/// COSE_Sign1 is private to `wire::sign`, so its vectors go through the parser.
fn signed() -> Vec<Named> {
    let key = Key::from_bytes(&[7; 32]);
    let purposes = [
        ("report", Purpose::Report),
        ("intent", Purpose::Intent),
        ("confirmation", Purpose::Confirmation),
        ("ack", Purpose::Ack),
        ("head", Purpose::Head),
    ];
    let one = |(name, purpose)| {
        let payload: &[u8] = b"payload";
        let decode: Decode = Box::new(move |bytes, max| match Signed::parse(bytes, max) {
            Ok(signed) => Ok(signed.payload == payload),
            Err(Refusal::Length { max, got }) => Err(Malformed::TooLong { max, got }),
            Err(Refusal::Schema { at }) => Err(Malformed::Schema { at }),
            Err(Refusal::Canonical { at }) => Err(Malformed::NonCanonical { at }),
            Err(other) => panic!("{other}"),
        });
        Named { name, bytes: key.sign(purpose, payload), decode, event: 0 }
    };
    purposes.into_iter().map(one).collect()
}

fn inputs() -> Vec<Named> {
    let (bytes, session, subject) = (vec![1, 2], SessionId(4), Subject::Command(UnitId::A));
    let stream = Input::Stream { connection: session, side: Side::Server, bytes: Vec::new() };
    vec![
        named!("timeout", Input, Input::Timeout),
        named!("bus", Input, Input::Bus { topic: Topic::Tracks, bytes: bytes.clone() }),
        named!("opened", Input, Input::Opened { session, peer: PeerId::UNIT_B }),
        named!("record", Input, Input::Record { session, bytes: bytes.clone() }),
        named!("closed", Input, Input::Closed { session }),
        named!("published", Input, Input::Published { subject, bytes: bytes.clone() }),
        named!("datagram", Input, Input::Datagram { side: Side::Client, bytes: bytes.clone() }),
        named!("stream-end", Input, stream),
        named!("audit", Input, Input::Audit { bytes }),
        named!("quiesce", Input, Input::Quiesce),
        named!("finish", Input, Input::Finish),
        named!("cue", Input, Input::Cue { step: step("cut").cue() }),
        named!("session-lost", Input, Input::SessionLost),
        named!("host-wait", Input, Input::HostWait { wait: Span::ms(120) }),
        named!("guest", Input, Input::Guest { bytes: codec::encode(&Answer::Ready) }),
        named!("act", Input, Input::Act { bytes: codec::encode(&numbered(person::Act::Withdraw)) }),
    ]
}

fn outputs() -> Vec<Named> {
    let (bytes, session, side) = (vec![1, 2], SessionId(4), Side::Server);
    let stream = Output::Stream { connection: session, side, bytes: bytes.clone() };
    vec![
        named!("bus", Output, Output::Bus { topic: Topic::Drive, bytes: bytes.clone() }),
        named!("record", Output, Output::Record { session, bytes: bytes.clone() }),
        named!("publish", Output, Output::Publish { subject: Subject::Ack(UnitId::A), bytes: bytes.clone() }),
        named!("datagram", Output, Output::Datagram { side, bytes: bytes.clone() }),
        named!("stream", Output, stream),
        named!("reset", Output, Output::Reset { connection: session }),
        named!("audit", Output, Output::Audit { bytes: bytes.clone() }),
        named!("text", Output, Output::Text { text: "HOLD_SAFE\n".into(), picture: "{}".into() }),
        named!("guest", Output, Output::Guest { bytes: bytes.clone() }),
        named!("stranger", Output, Output::Stranger { bytes }),
        named!("join", Output, Output::Join),
        named!("leave", Output, Output::Leave),
    ]
}

fn guest_requests() -> Vec<Named> {
    let (now, at) = (Instant(3_600_000_000), Place(-1000, 2000));
    let block = Block { at, half_mm: [500, 300], heading_mrad: -1571 };
    let body = guest::Body {
        medium: guest::Medium::Air,
        size_mm: [500, 400],
        curvature_per_km: 400,
        reverse_mm_s: 1000,
        climb_mm_s: 800,
        cruise_mm: 2500,
    };
    let start = |points: usize| MissionStart {
        now,
        period: Span::ms(50),
        max_speed_mm_s: 3000,
        braking_mm_s2: 3000,
        route: std::iter::repeat_n(at, points).collect(),
        looped: points > 1,
        fence: std::iter::repeat_n(at, points).collect(),
        obstacles: std::iter::repeat_n(Disc { at, radius_mm: 500 }, points).collect(),
        blocks: (points > 0).then(|| std::iter::repeat_n(block, points).collect()),
        pose: None,
        body: None,
    };
    let fix = Fix { pose: Pose { x_mm: 1, y_mm: -2, yaw_mrad: 3 }, sigma_mm: 40, time: ReceiverTime(9) };
    let nearby = Nearby { number: 3, x_mm: 4000, y_mm: -500, vx_mm_s: 0, vy_mm_s: 900, width_mm: 450 };
    let step = |fixed: bool| guest::ControlStep {
        number: 7,
        now,
        mode: Mode::Ready,
        limit_mm_s: 3000,
        navigation: fixed.then_some(Navigation { stamp: now, fix: Some(fix), odometry: None, spatial: None }),
        tracks: List::default(),
        teammates: std::iter::repeat_n(at, usize::from(fixed)).collect(),
        height_mm: None,
        nearby: None,
    };
    let starting = |points| guest::Request::Start(Box::new(start(points)));
    let stepping = |fixed| guest::Request::Step(Box::new(step(fixed)));
    let pose = Some(guest::StartPose { at, yaw_mrad: 500, height_mm: Some(2500) });
    let of_a_body = MissionStart { pose, body: Some(body), ..start(1) };
    let aloft =
        guest::ControlStep { height_mm: Some(2480), nearby: Some(std::iter::once(nearby).collect()), ..step(true) };
    vec![
        named!("start-of-a-body", guest::Request, guest::Request::Start(Box::new(of_a_body))),
        named!("step-aloft", guest::Request, guest::Request::Step(Box::new(aloft))),
        named!("start", guest::Request, starting(0)),
        named!("start-of-two-points", guest::Request, starting(2)),
        named!("step", guest::Request, stepping(true)),
        named!("step-without-a-fix", guest::Request, stepping(false)),
    ]
}

fn guest_answers() -> Vec<Named> {
    let full = Reply {
        number: 7,
        speed_mm_s: 1500,
        curvature_um: -100_000,
        state: Some((Declared::Nominal, Text::new("DRIVING"))),
        place: Some(Place(-1000, 2000)),
        wake: Some(Span::ms(200)),
        velocity: None,
    };
    let velocity = guest::BodyVelocity { left_mm_s: -300, up_mm_s: 200, turn_mrad_s: 400 };
    vec![
        named!("ready", Answer, Answer::Ready),
        named!("reply", Answer, Answer::Reply(full)),
        named!("reply-with-a-velocity", Answer, Answer::Reply(Reply { velocity: Some(velocity), ..full })),
        named!("reply-with-a-place", Answer, Answer::Reply(Reply { state: None, wake: None, ..full })),
        named!("reply-bare", Answer, Answer::Reply(Reply { state: None, place: None, wake: None, ..full })),
        named!("failed", Answer, Answer::Failed { fault: Fault::Ended, why: Text::new("exit status 1") }),
    ]
}

/// Numbers of the kinds of event.
pub(crate) fn events() -> impl Iterator<Item = u8> {
    (0..30)
        .chain(40..43)
        .chain(45..49)
        .chain(50..52)
        .chain(56..59)
        .chain(60..62)
        .chain(65..71)
        .chain(80..89)
        .chain(92..103)
}

fn entries() -> Vec<Named> {
    let entry = |(name, event): (&'static str, Any)| {
        let entry = Entry {
            node: NodeId::GATEWAY,
            boot: Boot(1),
            counter: 2,
            at: Instant(1_000_000),
            event,
            previous: [0x22; 32],
        };
        let mut named = named!(name, Entry, entry);
        // An event is [number, fields], the first array within the entry.
        let items = crate::item::items(&named.bytes);
        let event = items.iter().skip(1).position(|item| item.major == 4).expect("the event");
        named.event = items[event + 2].argument as u8;
        named
    };
    let of_services = decisions().into_iter().map(|(name, event)| (name, Any::Service(event)));
    of_services.chain(witnesses()).chain(instrument()).map(entry).collect()
}

/// Decisions of services.
fn decisions() -> Vec<(&'static str, Event)> {
    let interface = Interface::Uplink;
    let waived = Waived::default();
    let transition = |cause, because| Event::Transition {
        from: Mode::Ready,
        to: Mode::Degraded,
        cause,
        because,
        failing: Guards::default().with_guard(Guard::Lidar),
    };
    vec![
        ("started", Event::Started),
        (
            "accepted",
            Event::Accepted { at: interface, record: RECORD, peer: PeerId::UNIT_C, age: Some(Span::ms(9)), waived },
        ),
        (
            "accepted-of-unknown-age",
            Event::Accepted {
                at: Interface::Bus(Topic::Tracks),
                record: RECORD,
                peer: PeerId::UNIT_C,
                age: None,
                waived: waived.with_check(Check::Freshness),
            },
        ),
        (
            "refused",
            Event::Refused {
                at: interface,
                peer: Some(PeerId::UNIT_B),
                reason: Reason::Origin,
                detail: Text::new("origin: …"),
            },
        ),
        (
            "refused-from-nobody-known",
            Event::Refused { at: Interface::Broker, peer: None, reason: Reason::Role, detail: Text::new("") },
        ),
        ("transition-frame", transition(Cause::Lost(Guard::Lidar), Because::Frame(FrameId(7)))),
        ("transition-silence", transition(Cause::Unrecovered(Guard::Tracks), Because::Silence(Instant(900_000)))),
        ("transition-record", transition(Cause::Lost(Guard::Teammates), Because::Record(RECORD))),
        ("transition-claim", transition(Cause::Lost(Guard::Teammates), Because::Claim(UnitId::C))),
        ("transition-command", transition(Cause::Operator, Because::Command(COMMAND))),
        ("transition-itself", transition(Cause::Recovered, Because::Itself)),
        ("minted", Event::Minted { world: WorldId(5), authority: 1, track: TrackId(3), command: COMMAND, waived }),
        ("revoked", Event::Revoked { authority: 1, cause: Cause::Expired }),
        (
            "acted",
            Event::Acted {
                world: WorldId(5),
                authority: 1,
                track: TrackId(3),
                command: COMMAND,
                failing: Guards::default(),
            },
        ),
        ("intended", Event::Intended { command: COMMAND, kind: CommandKind::Arm(TrackId(3)), tag: None }),
        ("intended-for-later", Event::Intended { command: COMMAND, kind: CommandKind::Hold, tag: Some(TAG) }),
        ("stored", Event::Stored { command: COMMAND, kind: CommandKind::Hold, due: Span::ms(39_700) }),
        ("staged", Event::Staged { command: COMMAND, stage: CommandStage::Staged }),
        ("executed", Event::Executed { command: COMMAND, kind: CommandKind::Hold, refused: None }),
        (
            "executed-refused",
            Event::Executed { command: COMMAND, kind: CommandKind::Resume, refused: Some(Reason::Confirmation) },
        ),
        ("acknowledged", Event::Acknowledged { command: COMMAND, refused: None }),
        ("inconsistent", Event::Inconsistent { unit: UnitId::C, finding: Inconsistency::TimeBase, record: RECORD }),
        ("guest-engaged", Event::GuestEngaged { name: Text::new("follower"), bare: true, goal: None }),
        (
            "guest-engaged-with-a-goal",
            Event::GuestEngaged { name: Text::new("follower"), bare: false, goal: Some(Place(12_000, -3_000)) },
        ),
        ("guest-stated", Event::GuestStated { declared: Declared::Safe, state: Text::new("STOPPED") }),
        ("guest-placed", Event::GuestPlaced { x_mm: -1500, y_mm: 20_000 }),
        ("guest-failed", Event::GuestFailed { fault: Fault::Silent, why: Text::new("no answer") }),
        ("guest-steps", Event::GuestSteps { steps: 180, limited: 3 }),
    ]
}

/// Observations of others.
fn witnesses() -> Vec<(&'static str, Any)> {
    vec![
        (
            "truth",
            Any::Instrument(Note::Truth {
                unit: UnitId::A,
                x_mm: 1,
                y_mm: -1,
                yaw_mrad: 0,
                speed_mm_s: 3000,
                set_speed_mm_s: 2900,
                leased: true,
                fence_mm: -5,
            }),
        ),
        (
            "moves",
            Any::Instrument(Note::Moves {
                unit: UnitId::A,
                motion: Motion {
                    position_mm: [1, -6_871_000_000, 2500],
                    attitude: Attitude::new([0.8, 0.0, -0.6, 0.0]),
                    velocity_mm_s: [-7_612_000, 3, 0],
                    rates_urad_s: [-1100, 0, 250_000],
                },
            }),
        ),
        (
            "margins",
            Any::Instrument(Note::Margins { unit: UnitId::A, safe: -40, asked: 1000, energy: 29_000, clearance: 1500 }),
        ),
        (
            "guest-bus",
            Any::Instrument(Note::GuestBus {
                order: 1,
                attack: BusAttack::Odometry,
                sent: 25,
                received: 25,
                honest: 1,
                in_force: true,
                refused: false,
            }),
        ),
        ("object", Any::Instrument(Note::Object { object: ObjectId(4), class: Class::Obstacle, x_mm: 100, y_mm: 200 })),
        (
            "plant-act",
            Any::Instrument(Note::PlantAct {
                authority: 1,
                command: COMMAND,
                object: Some(ObjectId(4)),
                class: Some(Class::Vehicle),
                distance_mm: 700,
            }),
        ),
        (
            "plant-act-on-nothing",
            Any::Instrument(Note::PlantAct {
                authority: 1,
                command: COMMAND,
                object: None,
                class: None,
                distance_mm: u32::MAX,
            }),
        ),
        (
            "fault",
            Any::Instrument(Note::Fault {
                sensor: Sensor::Odometry,
                kind: FaultKind::Drift,
                active: true,
                frame: FrameId(40),
            }),
        ),
        ("frame-seen", Any::Service(Event::FrameSeen { frame: FrameId(41), present: Modalities(0b1011) })),
        (
            "repeated",
            Any::Service(Event::Repeated { modality: Modality::Thermal, frame: FrameId(44), first: FrameId(40) }),
        ),
        ("crowded", Any::Service(Event::Crowded { frame: FrameId(45), detections: 32 })),
        ("navigation-seen", Any::Service(Event::NavigationSeen { fix: false, odometry: true })),
        (
            "located",
            Any::Service(Event::Located {
                stamp: Instant(1_250_000),
                x_mm: 1000,
                y_mm: -2000,
                time: ReceiverTime(7_000_000),
                pose_x_mm: 990,
                pose_y_mm: -2010,
                distrusted: true,
            }),
        ),
        (
            "imposed",
            Any::Instrument(Note::Imposed {
                stamp: Instant(1_250_000),
                east_mm: 300,
                north_mm: -4,
                time_us: -2_000_000,
            }),
        ),
        (
            "displayed",
            Any::Service(Event::Displayed {
                unit: UnitId::A,
                mode: Mode::Ready,
                authority: Some(TrackId(3)),
                freshness: Freshness::Late,
                age: Span::ms(340),
                tracks_fresh: 2,
                tracks_stale: 1,
                report: RECORD,
                failing: Guards(0b100),
                place: Some(Pose { x_mm: 1_000, y_mm: -2_000, yaw_mrad: 30 }),
            }),
        ),
        (
            "doubted",
            Any::Service(Event::Doubted {
                frame: FrameId(41),
                class: Class::Vehicle,
                bearing_mrad: -120,
                supported: Modalities(0b0001),
                vetoed: Modalities(0b0100),
            }),
        ),
        (
            "followed",
            Any::Service(Event::Followed { track: TrackId(3), class: Class::Person, x_mm: 8_000, y_mm: -3_000 }),
        ),
        ("printed", Any::Instrument(Note::Printed { object: ObjectId(2) })),
        ("collided", Any::Instrument(Note::Collided { unit: UnitId::A, object: ObjectId(2), speed_mm_s: -400 })),
        (
            "altered",
            Any::Instrument(Note::Altered {
                sensor: Sensor::Localisation,
                kind: FaultKind::Jump,
                hash: 0x0123_4567_89ab_cdef,
            }),
        ),
        ("pictured", Any::Service(Event::Pictured { frame: FrameId(40), hash: 0x0123_4567_89ab_cdef })),
        ("judged", Any::Service(Event::Judged { failing: Guards(0b100), placed: false, tracks: 3 })),
        (
            "attack",
            Any::Instrument(Note::Attack {
                action: Action::Replay,
                side: Side::Server,
                length: 180,
                hash: 1 << 40,
                delay: Span::ms(300),
            }),
        ),
        (
            "guard-saw",
            Any::Instrument(Note::GuardSaw {
                association: 1,
                epoch: 1,
                sequence: 300,
                length: 180,
                hash: 1 << 40,
                verdict: GuardVerdict::Plaintext,
            }),
        ),
        (
            "tampered",
            Any::Instrument(Note::Tampered {
                deed: StreamEffect::Held,
                side: Side::Client,
                stream: 1 << 50,
                offset: 4_000,
                length: 340,
                hash: 1 << 40,
                delay: Span::s(2),
            }),
        ),
        (
            "stream-saw",
            Any::Instrument(Note::StreamSaw {
                sight: Sight::Arrived,
                stream: 1 << 50,
                offset: 4_000,
                length: 340,
                hash: 1 << 40,
            }),
        ),
        ("command-shown", Any::Service(Event::CommandShown { command: COMMAND, shown: ShownAs::NotAcknowledged })),
        ("withheld", Any::Instrument(Note::Withheld { record: RECORD })),
        ("swallowed", Any::Instrument(Note::Swallowed { command: COMMAND })),
        ("taken-over", Any::Service(Event::TakenOver { peer: PeerId::UNIT_A })),
        ("joins", Any::Instrument(Note::Joins { certificate: PeerId::UNIT_A })),
        ("session-lost", Any::Service(Event::SessionLost { peer: PeerId::UNIT_A })),
        (
            "act-refused",
            Any::Service(Event::Act {
                by: NodeId::OPERATOR,
                serial: 4,
                act: Some(person::Act::Withdraw),
                command: None,
                refused: Some(Unable::NotPrepared),
            }),
        ),
        (
            "act-unread",
            Any::Service(Event::Act {
                by: NodeId::OPERATOR,
                serial: 0,
                act: None,
                command: None,
                refused: Some(Unable::Malformed),
            }),
        ),
        (
            "act",
            Any::Service(Event::Act {
                by: NodeId::OPERATOR,
                serial: 5,
                act: Some(person::Act::Now(person::Order::Command(UnitId::A, CommandKind::Hold))),
                command: Some(COMMAND),
                refused: None,
            }),
        ),
        (
            "lapsed",
            Any::Service(Event::Lapsed {
                by: NodeId::OPERATOR,
                order: person::Order::Revoke(NodeId::OPERATOR_2),
                why: Unable::Interlock,
            }),
        ),
        ("losses-shown", Any::Service(Event::LossesShown { peer: PeerId::GATEWAY, times: 2 })),
        ("session", Any::Service(Event::Session { peer: PeerId::UNIT_A, open: false })),
        (
            "rogue-at-the-broker",
            Any::Instrument(Note::Rogue {
                command: COMMAND,
                kind: CommandKind::Configure(VALUES),
                key: NodeId::OPERATOR_2,
                certificate: Some(PeerId::UNIT_B),
            }),
        ),
        (
            "rogue-at-the-gateway",
            Any::Instrument(Note::Rogue {
                command: COMMAND,
                kind: CommandKind::Hold,
                key: NodeId::OPERATOR_2,
                certificate: None,
            }),
        ),
        ("struck", Any::Service(Event::Struck { who: NodeId::OPERATOR_2 })),
        ("associated", Any::Instrument(Note::Associated { association: 3, peer: PeerId::UNIT_A })),
        ("halted", Any::Instrument(Note::Halted { node: NodeId::PERCEPTION, on: true })),
        ("ran", Any::Instrument(Note::Ran { node: NodeId::PERCEPTION })),
        ("disk-full", Any::Instrument(Note::DiskFull { node: NodeId::RECORDER, on: true })),
        ("kept", Any::Instrument(Note::Kept { bytes: 70_000 })),
        (
            "mouth-saw",
            Any::Instrument(Note::MouthSaw {
                reader: NodeId::UNIT_A,
                at: Interface::Bus(Topic::Tracks),
                length: 340,
                hash: 1 << 40,
            }),
        ),
    ]
}

fn numbered(act: person::Act) -> Numbered {
    Numbered { serial: 300, act }
}

/// Acts of a person, each way; every alarm is acknowledged.
fn acts() -> Vec<Named> {
    use person::{Act, Order};
    let hold = Order::Command(UnitId::A, CommandKind::Hold);
    let configure = Order::Command(UnitId::B, CommandKind::Configure(VALUES));
    let noted = |alarm| numbered(Act::Acknowledge(alarm, Instant(1_000_000)));
    let shelved = |shelf| {
        let clock = Alarm::ClockRuns(UnitId::B);
        numbered(Act::Shelve(clock, Instant(1_000_000), shelf, Text::new("the receiver is exchanged")))
    };
    vec![
        named!("hold", Numbered, numbered(Act::Now(hold))),
        named!("prepare-revocation", Numbered, numbered(Act::Prepare(Order::Revoke(NodeId::OPERATOR_2)))),
        named!("confirm", Numbered, numbered(Act::Confirm(configure, Text::new("wet ground")))),
        named!("withdraw", Numbered, numbered(Act::Withdraw)),
        named!("noted-hold-safe", Numbered, noted(Alarm::HoldSafe(UnitId::A))),
        named!("noted-degraded", Numbered, noted(Alarm::Degraded(UnitId::B))),
        named!("noted-stale", Numbered, noted(Alarm::Stale(UnitId::A))),
        named!("noted-silent", Numbered, noted(Alarm::Silent(UnitId::C))),
        named!("noted-track-lost", Numbered, noted(Alarm::TrackLost(UnitId::A, Boot(2), TrackId(70_000)))),
        named!("noted-clock-runs", Numbered, noted(Alarm::ClockRuns(UnitId::A))),
        named!("noted-link-down", Numbered, noted(Alarm::LinkDown(PeerId::UNIT_B))),
        named!("noted-session-lost", Numbered, noted(Alarm::SessionLost(PeerId::GATEWAY))),
        named!("noted-not-acknowledged", Numbered, noted(Alarm::NotAcknowledged(COMMAND))),
        named!("noted-refused", Numbered, noted(Alarm::CommandRefused(COMMAND))),
        named!("noted-contradicts", Numbered, noted(Alarm::Contradicts(UnitId::C))),
        named!("noted-claims", Numbered, noted(Alarm::Claims(UnitId::C))),
        named!("noted-guard-lost", Numbered, noted(Alarm::GuardLost(UnitId::A, Guard::TimeBase))),
        named!("noted-held-elsewhere", Numbered, noted(Alarm::HeldElsewhere(UnitId::A))),
        named!("noted-contact-due", Numbered, noted(Alarm::ContactDue(UnitId::A))),
        named!("noted-tracks-lost", Numbered, noted(Alarm::TracksLost(UnitId::A))),
        named!("noted-gateway-silent", Numbered, noted(Alarm::GatewaySilent)),
        named!("shelve-a-minute", Numbered, shelved(Shelf::Minute)),
        named!("shelve-ten-minutes", Numbered, shelved(Shelf::TenMinutes)),
        named!("shelve-half-an-hour", Numbered, shelved(Shelf::HalfHour)),
        named!("silence", Numbered, numbered(Act::Silence)),
    ]
}

fn step(name: &str) -> StepName {
    StepName::new(name).expect("a step's name")
}

/// Statements of the instrument about itself.
fn instrument() -> Vec<(&'static str, Any)> {
    let refused = Account::Refused(Interface::Bus(Topic::Tracks), Reason::Stale);
    let slow = Suspension::Slow { quota: 250, period: Span::ms(100) };
    vec![
        ("count-sent", Any::Service(Event::Count { account: Account::Sent, n: 90 })),
        ("count-refused", Any::Service(Event::Count { account: refused, n: 3 })),
        ("count-relay", Any::Service(Event::Count { account: Account::RelayDropped(Side::Client), n: 65_536 })),
        ("sealed", Any::Service(Event::Sealed { entries: 400, head: [0x33; 32] })),
        ("signed", Any::Service(Event::Signed { signature: [0x44; 64] })),
        ("chain-broken", Any::Service(Event::ChainBroken { node: NodeId::SIM, counter: 12 })),
        ("ended", Any::Instrument(Note::Ended { node: NodeId::PERCEPTION, killed: true, signal: None })),
        ("stalled", Any::Instrument(Note::Stalled { by: Span::ms(60) })),
        ("step", Any::Instrument(Note::Step { step: step("cut"), begun: true })),
        ("hung", Any::Instrument(Note::Suspended { node: NodeId::GATEWAY, how: Suspension::Hang, on: true })),
        ("slowed", Any::Instrument(Note::Suspended { node: NodeId::GATEWAY, how: slow, on: false })),
        ("restarted", Any::Instrument(Note::Restarted { node: NodeId::UNIT_A, boot: Boot(2) })),
    ]
}
