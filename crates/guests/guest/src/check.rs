//! A guest's program exercised without a run: a straight mission, its fixes and the end of them, twice over.
//!
//! The vehicle is a point that follows each set-point at once. The report says what the guest does, step for step where it goes wrong, and
//! whether a second process answers the same: a difference makes every result of the guest one of a single run.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::bounds::Bounds;
use wire::codec::List;
use wire::guest::{Answer, Block, Body, ControlStep, Disc, Medium, MissionStart, Place, Reply, Request, StartPose};
use wire::mode::Mode;
use wire::sensor::{Fix, Navigation, Odometry, Pose, ReceiverTime};
use wire::time::{Instant, Span};

use crate::{Failure, Guest};

/// Steps of the exercise: 10 s at the platform's period.
const STEPS: u32 = 200;
/// Step from which the operator lets the vehicle drive.
const ENABLED: u32 = 10;
/// Step from which there are no fixes.
const BLIND: u32 = 160;
/// Start of the vehicle's clock: guests must not take it for zero.
const ZERO: Instant = Instant(3_600_000_000);
/// End of the straight route, east, mm.
const GOAL_MM: i32 = 20_000;

/// Findings of an exercise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Checked {
    /// Name of the guest.
    pub guest: String,
    /// Number of steps answered in the first round.
    pub steps: u32,
    /// Number of steps asked for.
    pub asked: u32,
    /// The failure that ended the first round.
    pub failure: Option<Found>,
    /// The first step that the second process answered otherwise.
    pub differs_at: Option<u32>,
    /// Distance driven towards the goal, m.
    pub driven_m: f64,
    /// Largest speed asked for while the limit was zero, m/s.
    pub before_enabled_m_s: f64,
    /// Speed asked for in the last step, when there have been no fixes for two seconds, m/s; 0 if the guest failed before.
    pub blind_m_s: f64,
    /// Remarks: behaviour that is allowed and worth a look.
    pub remarks: Vec<String>,
}

/// A failure at its step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Found {
    /// Step; 0 is the start.
    pub step: u32,
    /// Kind of the failure.
    pub fault: String,
    /// Expected and received value, in words.
    pub why: String,
}

impl Checked {
    /// True if the guest answered every step of the exercise.
    pub fn fine(&self) -> bool {
        self.failure.is_none()
    }
}

/// Exercises the guest in two processes, one after the other.
pub fn check(guest: &Guest) -> Checked {
    // A guest that failed gets no second process: its answers up to the failure decide the check.
    let (first, failed) = round(guest);
    let second = if failed.is_some() { None } else { Some(round(guest).0) };
    let differs = second.as_ref().and_then(|second| {
        let longer = first.replies.len().max(second.replies.len());
        (0..longer).find(|n| first.replies.get(*n) != second.replies.get(*n))
    });
    let speed = |reply: &Reply| f64::from(reply.speed_mm_s) / 1000.0;
    let early = first.replies.iter().filter(|reply| reply.number < ENABLED);
    let mut checked = Checked {
        guest: guest.program.name.clone(),
        steps: first.replies.len() as u32,
        asked: STEPS,
        failure: failed.map(|(step, failure)| Found { step, fault: failure.fault.name().into(), why: failure.why }),
        differs_at: differs.map(|n| n as u32 + 1),
        driven_m: first.x_mm / 1000.0,
        before_enabled_m_s: early.map(|reply| speed(reply).abs()).fold(0.0, f64::max),
        blind_m_s: first.replies.get(STEPS as usize - 1).map_or(0.0, speed),
        remarks: Vec::new(),
    };
    checked.remarks = remarks(&checked);
    checked
}

fn remarks(checked: &Checked) -> Vec<String> {
    let mut remarks = Vec::new();
    if let Some(step) = checked.differs_at {
        remarks.push(format!("not deterministic: a second process answers step {step} otherwise"));
    }
    if checked.failure.is_none() && checked.driven_m < 1.0 {
        remarks.push(format!("{:.1} m driven of {} m: the guest hardly moves", checked.driven_m, GOAL_MM / 1000));
    }
    if checked.before_enabled_m_s > 0.0 {
        remarks.push(format!("{:.2} m/s asked for while limit_m_s is 0", checked.before_enabled_m_s));
    }
    if checked.blind_m_s > 0.05 {
        remarks.push(format!("{:.2} m/s asked for after two seconds without a fix", checked.blind_m_s));
    }
    remarks
}

/// Answers of one process, and the way that the vehicle went by them.
struct Round {
    replies: Vec<Reply>,
    x_mm: f64,
}

fn round(guest: &Guest) -> (Round, Option<(u32, Failure)>) {
    let mut round = Round { replies: Vec::new(), x_mm: 0.0 };
    let failed = drive(guest, &mut round).err();
    (round, failed)
}

fn drive(guest: &Guest, round: &mut Round) -> Result<(), (u32, Failure)> {
    let mut session = guest.session();
    session.ask(&Request::Start(Box::new(start()))).map_err(|failure| (0, failure))?;
    let (mut y_mm, mut yaw, mut speed) = (0.0, 0.0_f64, 0.0);
    for number in 1..=STEPS {
        let pose = Pose { x_mm: round.x_mm as i32, y_mm: y_mm as i32, yaw_mrad: (yaw * 1e3) as i16 };
        let answer = session.ask(&Request::Step(Box::new(step(number, pose, speed)))).map_err(|f| (number, f))?;
        if let Answer::Reply(reply) = answer {
            let limit = if number < ENABLED { 0.0 } else { f64::from(Bounds::GROUND.max_speed_mm_s) };
            speed = f64::from(reply.speed_mm_s).clamp(-limit, limit);
            // The angle on the wire is an `i16` of milliradians: unwrapped it would overflow in a guest that circles.
            yaw = wrapped(yaw + speed * f64::from(reply.curvature_um) * 1e-9 * 0.05);
            round.x_mm += speed * 0.05 * libm::cos(yaw);
            y_mm += speed * 0.05 * libm::sin(yaw);
            round.replies.push(reply);
        }
    }
    Ok(())
}

fn wrapped(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    let turned = (angle + PI).rem_euclid(TAU) - PI;
    if turned <= -PI { PI } else { turned }
}

fn start() -> MissionStart {
    let at = Place(10_000, 10_000);
    let corners = [(-10_000, -30_000), (60_000, -30_000), (60_000, 30_000), (-10_000, 30_000)];
    MissionStart {
        now: ZERO,
        period: Span::ms(Bounds::GROUND.control_period_ms),
        max_speed_mm_s: Bounds::GROUND.max_speed_mm_s,
        braking_mm_s2: Bounds::GROUND.braking_mm_s2,
        route: [Place(GOAL_MM / 2, 0), Place(GOAL_MM, 0)].into_iter().collect(),
        looped: false,
        fence: corners.into_iter().map(|(x, y)| Place(x, y)).collect(),
        obstacles: [Disc { at, radius_mm: 500 }].into_iter().collect(),
        blocks: Some([Block { at, half_mm: [500, 300], heading_mrad: 0 }].into_iter().collect()),
        pose: Some(StartPose { at: Place(0, 0), yaw_mrad: 0, height_mm: None }),
        body: Some(Body {
            medium: Medium::Ground,
            size_mm: [1600, 900],
            curvature_per_km: 400,
            reverse_mm_s: 1000,
            climb_mm_s: 0,
            cruise_mm: 0,
        }),
    }
}

fn step(number: u32, pose: Pose, speed_mm_s: f64) -> ControlStep {
    let now = ZERO + Span::ms(u64::from(number) * Bounds::GROUND.control_period_ms);
    let fix = (number < BLIND).then_some(Fix { pose, sigma_mm: 40, time: ReceiverTime(now.0) });
    let odometry = Odometry { speed_mm_s: speed_mm_s as i32, yaw_rate_mrad_s: 0 };
    ControlStep {
        number,
        now,
        mode: if number < ENABLED { Mode::Idle } else { Mode::Ready },
        limit_mm_s: if number < ENABLED { 0 } else { Bounds::GROUND.max_speed_mm_s },
        navigation: Some(Navigation { stamp: now, fix, odometry: Some(odometry), spatial: None }),
        tracks: List::default(),
        teammates: List::default(),
        height_mm: None,
        nearby: Some(List::default()),
    }
}
