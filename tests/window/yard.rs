//! A yard with units that report, move and obey, before a real console: every picture is made of signed reports.
//!
//! The gateway and the units are scripted; the console is the real one, and its pictures are its model's.

use std::cell::Cell;

use console::shown::Shown;
use console::site::{Relief, Site, SiteBox};
use sha2::{Digest, Sha256};
use wire::bounds::Bounds;
use wire::codec::List;
use wire::command::{Ack, CommandKind, Confirmation, Intent};
use wire::crop::Pictured;
use wire::event::Inconsistency;
use wire::feed::{AcceptedReport, CommandStage, Feed};
use wire::id::{Boot, CommandId, Nonce, PeerId, RecordId, Sequence, TrackId, UnitId};
use wire::measured::{Limit, Measured};
use wire::mode::{Cause, Guard, Guards, Mode};
use wire::motion::{Attitude, ReportedMotion};
use wire::person::Role;
use wire::policy::{Policy, Waived};
use wire::refusal::Reason;
use wire::report::{Report, ReportedAuthority, ReportedContact, ReportedTrack};
use wire::sensor::{Class, Modalities, Modality, Pose};
use wire::settings::Settings;
use wire::time::{Echo, PeerStamp, Span};

use crate::bench::{Asked, Bench, crops_of, sign};

/// Time between two reports.
const PERIOD: Span = Span::ms(100);

/// A unit as it is, and so as it reports.
pub(crate) struct Actor {
    pub(crate) unit: UnitId,
    pub(crate) mode: Mode,
    pub(crate) cause: Cause,
    pub(crate) failing: Guards,
    settings: Option<Settings>,
    pub(crate) authority: Option<ReportedAuthority>,
    pub(crate) tracks: Vec<ReportedTrack>,
    pub(crate) pose: Pose,
    pub(crate) speed_mm_s: i32,
    /// Its turn to the left in each period, mrad.
    pub(crate) turn_mrad: i16,
    /// True if it says anything.
    pub(crate) heard: bool,
    /// Peer of the session that brings its reports.
    pub(crate) via: PeerId,
    /// True if it answers orders.
    pub(crate) obeys: bool,
    /// Excess of its clock's rate over the console's, millionths.
    pub(crate) fast_ppm: i64,
    pub(crate) motion: Option<ReportedMotion>,
    pub(crate) contact: Option<ReportedContact>,
    pub(crate) pictured: Option<Pictured>,
    sequence: u64,
    last: Option<(CommandId, Option<Reason>)>,
}

/// Kind of the units of a yard.
#[allow(dead_code, reason = "the gallery draws every scene in every domain")]
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Domain {
    Ground,
    Air,
    Orbit,
}

thread_local! {
    /// Kind of the units of the next yard of this thread.
    static DOMAIN: Cell<Domain> = const { Cell::new(Domain::Ground) };
}

/// Makes the units of this thread's next yards of this kind.
#[allow(dead_code, reason = "the gallery draws every scene in every domain")]
pub(crate) fn set_domain(domain: Domain) {
    DOMAIN.set(domain);
}

/// Motion and contact that a unit of this thread's kind reports.
fn aloft() -> (Option<ReportedMotion>, Option<ReportedContact>) {
    let attitude = |w, x, y| Some(Attitude::new([w, x, y, 0.0]));
    match DOMAIN.get() {
        Domain::Ground => (None, None),
        Domain::Air => {
            let attitude = attitude(1.0, 0.02, 0.06);
            (Some(ReportedMotion { up_mm: 2_960, left_up_mm_s: [20, -40], charge: 830, attitude, sunlit: None }), None)
        }
        Domain::Orbit => {
            let attitude = attitude(0.17, 0.98, 0.1);
            let motion =
                ReportedMotion { up_mm: 518_140_000, left_up_mm_s: [0, 0], charge: 790, attitude, sunlit: Some(true) };
            (Some(motion), Some(ReportedContact { left: Span::s(212), next: Some(Span::s(5_400)) }))
        }
    }
}

/// The yard.
pub(crate) struct Yard {
    pub(crate) bench: Bench,
    pub(crate) actors: Vec<Actor>,
    /// The pictures after each period, oldest first.
    pub(crate) film: Vec<Shown>,
    /// Refusals a second at the gateway, which tells of twenty of them.
    pub(crate) flood: u64,
    /// Number of those reported.
    told: u64,
    /// Orders that were taken care of.
    done: usize,
}

/// Values that go with `failing`.
pub(crate) fn measured(failing: Guards) -> Measured {
    let claimed = failing.contains(Guard::Teammates).then_some((UnitId::B, Inconsistency::Kinematics));
    Guard::ALL.into_iter().fold(Measured::default().claimed(claimed), |measured, guard| {
        let value = Limit::for_guard(guard, &Bounds::GROUND).map(|limit| match (limit, failing.contains(guard)) {
            (Limit::Age(most), true) => most + 112,
            (Limit::Age(_), false) => 84,
            (Limit::Spare(_), true) => -1_240,
            (Limit::Spare(_), false) => 21_600,
            (Limit::Drift(_), true) => 27,
            (Limit::Drift(_), false) => 0,
            (Limit::Offset(_), true) => -7_300,
            (Limit::Offset(_), false) => 200,
        });
        measured.with_value(guard, value)
    })
}

impl Yard {
    /// Two units that drive, and a person who may do all.
    pub(crate) fn new() -> Self {
        Self::with_role(&[UnitId::A, UnitId::B], Policy::default(), Role::Supervise)
    }

    pub(crate) fn with_role(units: &[UnitId], policy: Policy, role: Role) -> Self {
        Self::from_bench(Bench::with_units(units, policy, role), units)
    }

    /// Around a console that has shown no picture yet.
    pub(crate) fn from_bench(mut bench: Bench, units: &[UnitId]) -> Self {
        for unit in units {
            bench.feed(&Feed::Session(unit.peer(), true));
        }
        let actors = units.iter().enumerate().map(|(index, unit)| Actor::new(*unit, index as i32)).collect();
        Self { bench, actors, film: Vec::new(), flood: 0, told: 0, done: 0 }
    }

    pub(crate) fn actor(&mut self, unit: UnitId) -> &mut Actor {
        self.actors.iter_mut().find(|actor| actor.unit == unit).expect("a unit of the yard")
    }

    /// The present picture.
    pub(crate) fn shown(&self) -> Shown {
        self.bench.console.shown(self.bench.now)
    }

    /// Lets time pass: units report and move, orders are carried out.
    pub(crate) fn run(&mut self, span: Span) {
        for _ in 0..span.0 / PERIOD.0 {
            self.obey();
            for at in 0..self.actors.len() {
                self.report(at);
            }
            if self.flood > 0 {
                self.refuse();
                self.refuse();
            }
            self.wait(PERIOD);
        }
    }

    /// The gateway tells of one more refusal, reason by reason and peer by peer, with how many there were of each.
    fn refuse(&mut self) {
        let (kinds, peers) = (Reason::ALL.len() as u64 * 2, [PeerId::UNIT_A, PeerId::UNIT_B]);
        let kind = (self.told % kinds) as usize;
        let counted = (self.told / kinds + 1) * self.flood / 20;
        self.told += 1;
        self.bench.feed(&Feed::Refused(Reason::ALL[kind / 2], Some(peers[kind % 2]), counted));
    }

    /// The unit sends images of its first track, and vouches for them from its next report on.
    pub(crate) fn picture(&mut self, unit: UnitId) {
        let actor = self.actor(unit);
        let (crops, pictured) = crops_of(actor.tracks[0].id, 90);
        actor.pictured = Some(pictured);
        crops.iter().for_each(|crop| self.bench.feed(&Feed::Crop(unit, crop.as_slice().into())));
    }

    /// Advances time in silence.
    pub(crate) fn wait(&mut self, span: Span) {
        for _ in 0..span.0 / PERIOD.0 {
            self.bench.pass(PERIOD);
            self.film.push(self.shown());
        }
    }

    fn report(&mut self, at: usize) {
        let now = self.bench.now;
        let actor = &mut self.actors[at];
        actor.drive();
        if !actor.heard {
            return;
        }
        let fast = actor.fast_ppm;
        let clock = |time: u64| time.saturating_add_signed(time as i64 * fast / 1_000_000);
        let stamp = clock(now.0);
        let report = self.bench.with_challenge(actor.report(stamp));
        let watched = report.watched.map(|echo| Echo { seen: PeerStamp(clock(echo.seen.0)), ..echo });
        let signed = sign(report.origin, &Report { watched, ..report });
        let (via, unit, waived) = (actor.via, actor.unit, Waived::default());
        let age = Some(Span::ms(18));
        self.bench.feed(&Feed::Accepted(AcceptedReport {
            via,
            unit,
            received: now,
            age,
            waived,
            report: signed.as_slice().into(),
        }));
    }

    /// The gateway and the units carry out the requests since the last call.
    fn obey(&mut self) {
        let requested: Vec<Asked> = self.bench.asked.iter().skip(self.done).cloned().collect();
        self.done = self.bench.asked.len();
        for asked in requested {
            match asked {
                Asked::Stage(intent, signed) if intent.kind.towards_safe() => self.carry_out(&intent, &signed),
                Asked::Stage(_, signed) => self.bench.staged(&signed, CommandStage::Staged),
                Asked::Release(Confirmation { intent, .. }) => {
                    let given =
                        self.bench.intents().into_iter().find(|(_, signed)| Sha256::digest(signed)[..] == intent);
                    let (order, signed) = given.expect("a staged intent");
                    self.carry_out(&order, &signed);
                }
                Asked::Watch(_) | Asked::Revoke(_) => {}
            }
        }
    }

    fn carry_out(&mut self, intent: &Intent, signed: &[u8]) {
        self.bench.staged(signed, CommandStage::Sent);
        self.bench.pass(Span::ms(12));
        let actor = self.actor(intent.unit);
        if !actor.obeys {
            return;
        }
        actor.execute(intent);
        let (mode, node) = (actor.mode, actor.unit.node());
        let ack = Ack { id: intent.id, intent: Sha256::digest(signed).into(), refused: None, mode, due: None };
        self.bench.acknowledged(node, &ack);
    }
}

impl Actor {
    fn new(unit: UnitId, position: i32) -> Self {
        let places = [
            (-9_000, -5_200),
            (14_000, 12_000),
            (-22_000, 21_000),
            (25_000, -24_000),
            (30_000, 28_000),
            (-30_000, -28_000),
            (-28_000, 2_000),
            (2_000, 30_000),
        ];
        let place = places[position as usize % places.len()];
        let (motion, contact) = aloft();
        let first = position as u32 * 100;
        Self {
            unit,
            mode: Mode::Ready,
            cause: Cause::Operator,
            failing: Guards::default(),
            settings: None,
            authority: None,
            tracks: tracks(first, place),
            pose: Pose { x_mm: place.0, y_mm: place.1, yaw_mrad: (position * 900) as i16 },
            speed_mm_s: 1400,
            turn_mrad: 0,
            heard: true,
            via: unit.peer(),
            obeys: true,
            fast_ppm: 0,
            motion,
            contact,
            pictured: None,
            sequence: 0,
            last: None,
        }
    }

    /// Moves on by one period, heard or not.
    fn drive(&mut self) {
        let step = self.speed_mm_s / 10;
        let yaw = f64::from(self.pose.yaw_mrad) / 1000.0;
        self.pose.x_mm += (f64::from(step) * libm::cos(yaw)) as i32;
        self.pose.y_mm += (f64::from(step) * libm::sin(yaw)) as i32;
        let turned = f64::from(self.pose.yaw_mrad + self.turn_mrad) / 1000.0;
        self.pose.yaw_mrad = (libm::atan2(libm::sin(turned), libm::cos(turned)) * 1000.0) as i16;
    }

    fn report(&mut self, stamp: u64) -> Report {
        self.sequence += 1;
        Report {
            mode: self.mode,
            cause: self.cause,
            failing: self.failing,
            pose: self.pose,
            speed_mm_s: self.speed_mm_s,
            pose_age: Span::ms(32),
            authority: self.authority,
            command_nonce: Nonce(self.sequence + 500),
            last_command: self.last,
            progress: 430,
            tracks: self.tracks.iter().copied().collect::<List<_, 8>>(),
            measured: measured(self.failing),
            settings: self.settings,
            motion: self.motion,
            contact: self.contact,
            pictured: self.pictured.clone(),
            ..Report::bare(
                RecordId { node: self.unit.node(), boot: Boot(1), sequence: Sequence(self.sequence) },
                PeerStamp(stamp),
            )
        }
    }

    fn execute(&mut self, intent: &Intent) {
        self.last = Some((intent.id, None));
        self.cause = Cause::Operator;
        match intent.kind {
            CommandKind::Hold => (self.mode, self.authority, self.speed_mm_s) = (Mode::HoldSafe, None, 0),
            CommandKind::Disarm => self.authority = None,
            CommandKind::Enable | CommandKind::Resume => (self.mode, self.speed_mm_s) = (Mode::Ready, 1400),
            CommandKind::Arm(track) => {
                self.mode = Mode::PrepareToAct;
                self.authority = Some(ReportedAuthority { track, left: Span::ms(4800) });
            }
            CommandKind::Confirm(_) => (self.mode, self.authority, self.cause) = (Mode::Ready, None, Cause::Acted),
            CommandKind::Configure(values) => self.settings = Some(values),
        }
    }
}

/// Tracks of a unit at this place.
fn tracks(first: u32, (x, y): (i32, i32)) -> Vec<ReportedTrack> {
    let seen =
        |modalities: &[Modality]| modalities.iter().fold(Modalities::default(), |set, one| set.with_modality(*one));
    let all = seen(&Modality::ALL);
    let track = |id, class, dx, dy, confidence, supported, age| ReportedTrack {
        id: TrackId(first + id),
        class,
        x_mm: x + dx,
        y_mm: y + dy,
        confidence,
        supported,
        age: Span::ms(age),
        contradicted: Modalities::default(),
        bearings_mrad: 0,
        across_px: 24,
    };
    vec![
        track(1, Class::Vehicle, 17_000, 2_200, 930, all, 40),
        track(2, Class::Person, 7_000, 8_200, 710, seen(&[Modality::Rgb, Modality::Thermal, Modality::Lidar]), 40),
        track(3, Class::Decoy, 15_000, -9_800, 550, seen(&[Modality::Rgb, Modality::Lidar]), 90),
        track(5, Class::Obstacle, -4_000, 9_000, 640, seen(&[Modality::Depth, Modality::Lidar]), 140),
    ]
}

/// The yard as planned.
pub(crate) fn site() -> Site {
    let block = |at, half, yaw| SiteBox { at, half, yaw };
    Site {
        fence: vec![[-40.0, -40.0], [40.0, -40.0], [40.0, 40.0], [-40.0, 40.0]],
        route: vec![[8.0, -6.0], [10.0, 4.0], [0.0, 8.0], [-10.0, 6.0], [-12.0, -4.0]],
        looped: true,
        blocks: vec![block([2.0, 18.0], [3.0, 1.5], 0.3), block([-24.0, -18.0], [5.0, 3.0], 1.1)],
        relief: Some(hills()),
        ..Site::default()
    }
}

/// The yard as a region below an orbit, a kilometre for each metre.
#[allow(dead_code, reason = "the page has no ground track")]
pub(crate) fn region() -> Site {
    let second = |n: i32| [n as f32 * 1.6 + 4.0, n as f32 * 7.4];
    Site { blocks: Vec::new(), relief: None, scale_m: Some(1000.0), below: (-60..=60).map(second).collect(), ..site() }
}

/// Gentle hills, as a survey found them.
fn hills() -> Relief {
    let along = |n: usize| n as f32 * 2.0 - 44.0;
    let height = |x: f32, y: f32| 0.3 * libm::sinf(x / 9.0) * libm::cosf(y / 11.0) + 0.1 * libm::sinf((x + y) / 5.0);
    let heights = (0..45 * 45).map(|n| height(along(n % 45), along(n / 45))).collect();
    Relief { corner: [-44.0, -44.0], cell: 2.0, columns: 45, heights }
}
