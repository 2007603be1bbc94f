//! `jsonl/1` and `jsonl/2`: the core's requests and a guest's answers as lines of JSON, with plain names and SI units.
//!
//! One line goes in, one comes back. A field that version 1 lacks is absent there, and so is one without a value. World frame: x east, y north, metres; angles counter-clockwise from east, radians; times in
//! seconds of the vehicle's clock. `holdsafe guest schema` prints the JSON Schema of both directions, made from these types. Which
//! answers a guest may give is left to [`crate::session`].

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::guest as wired;
use wire::sensor::Class;
use wire::time::Instant;

use crate::bus::{BusOrder, BusReceipt};
use crate::file::{Input, Program, Protocol};

/// A request to the guest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Request {
    /// The mission and its surroundings; the guest answers [`Response::Ready`].
    Start(Start),
    /// One control step; the guest answers [`Response::Reply`].
    Step(Step),
}

/// An answer of the guest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Response {
    /// The guest has taken the mission.
    Ready(Ready),
    /// Set-point of a step.
    Reply(Reply),
}

/// East and north, m.
pub type Position = [f64; 2];

/// The mission and its surroundings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Start {
    /// Version of the protocol: `jsonl/1` or `jsonl/2`.
    pub protocol: String,
    /// Time of the vehicle's clock, s. The clock has an arbitrary zero.
    pub time_s: f64,
    /// Time between two steps, unless the guest asks for a longer one, s.
    pub period_s: f64,
    /// Largest speed of the vehicle, m/s.
    pub max_speed_m_s: f64,
    /// Deceleration that the vehicle is sure to reach, m/s².
    pub braking_m_s2: f64,
    /// Way points in order.
    pub route: Vec<Position>,
    /// True if the last way point leads to the first again.
    pub looped: bool,
    /// Corners of the area that must not be left, in order.
    pub fence: Vec<Position>,
    /// Obstacles on the map as discs that reach to their ends, the first 64.
    pub obstacles: Vec<Disc>,
    /// The same obstacles by length and width, at most 256.
    #[serde(default)]
    pub blocks: Vec<Block>,
    /// Pose at the start, as surveyed. From `jsonl/2` on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose: Option<StartPose>,
    /// The vehicle's body. From `jsonl/2` on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<Body>,
    /// Geodetic place of the world frame's origin. From `jsonl/2` on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
}

/// A pose as surveyed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StartPose {
    /// East and north, m.
    pub at: Position,
    /// Heading, rad.
    pub yaw_rad: f64,
    /// Height above the ground, m; absent on the ground.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
}

/// Measures of the vehicle's body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Body {
    /// `ground`, `air` or `space`.
    pub medium: String,
    /// Length and width, m; 0 for a line of sight.
    pub size_m: [f64; 2],
    /// Greatest curvature, 1/m.
    pub max_curvature_per_m: f64,
    /// Greatest speed backwards, m/s.
    pub max_reverse_m_s: f64,
    /// Greatest climb, m/s; 0 on the ground.
    pub max_climb_m_s: f64,
    /// Height that is flown at, m; 0 on the ground.
    pub cruise_height_m: f64,
}

/// Geodetic place of the world frame's origin, WGS 84.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Origin {
    /// Latitude, degrees.
    pub latitude_deg: f64,
    /// Longitude, degrees.
    pub longitude_deg: f64,
    /// Height above the ellipsoid, m.
    pub height_m: f64,
}

/// The origin of each world, by convention: the scenes are of no real place, and programs for GPS receivers need one.
pub const ORIGIN: Origin = Origin { latitude_deg: 47.0, longitude_deg: 8.0, height_m: 400.0 };

/// A disc to keep clear of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Disc {
    /// Centre.
    pub at: Position,
    /// Radius, m.
    pub radius_m: f64,
}

/// An obstacle by its length and width.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Block {
    /// Its middle.
    pub at: Position,
    /// Half of length and width, m.
    pub half_m: [f64; 2],
    /// Direction of its longer axis, rad.
    pub heading_rad: f64,
}

/// One control step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Step {
    /// Number of the step, from 1; the answer repeats it.
    pub number: u32,
    /// Time of the vehicle's clock, s.
    pub time_s: f64,
    /// The most that may be driven now, m/s: 0 unless an operator has enabled driving.
    pub limit_m_s: f64,
    /// Mode of the platform's state machine.
    pub mode: String,
    /// Position fix of the newest navigation message; null without one, or if `navigation` is not taken.
    pub fix: Option<Fix>,
    /// Wheel odometry of the newest navigation message; null without it, or if `navigation` is not taken.
    pub odometry: Option<Odometry>,
    /// Objects that perception tracks; empty where `tracks` is not taken.
    pub tracks: Vec<Track>,
    /// Places that other units claim; empty where `teammates` is not taken.
    pub teammates: Vec<Position>,
    /// Height above the ground by the unit's own sensors, m. From `jsonl/2` on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
    /// Returns of LiDAR nearby; absent without a product of LiDAR, or if `nearby` is not taken. From `jsonl/2` on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nearby: Option<Vec<Nearby>>,
    /// Attacks for the adapter to carry out on the guest's bus in this step; absent without one. From `jsonl/2` on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bus: Vec<BusOrder>,
}

/// Something that LiDAR shows, of no class.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Nearby {
    /// Number, counted apart from those of tracks.
    pub id: u32,
    /// Middle of its returns.
    pub at: Position,
    /// Velocity east and north, m/s; zero of a thing that stands.
    pub velocity: Position,
    /// Largest horizontal extent of its returns, m.
    pub width_m: f64,
}

/// A position fix.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fix {
    /// Time at which it was taken, s.
    pub stamp_s: f64,
    /// East and north, m.
    pub at: Position,
    /// Heading, rad in (−π, π].
    pub yaw_rad: f64,
    /// One standard deviation of the position as its source states it, m.
    pub sigma_m: f64,
    /// The receiver's own time, s.
    pub receiver_s: f64,
    /// Height above the world frame's origin, m. From `jsonl/2` on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
}

/// A reading of the wheels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Odometry {
    /// Time at which it was taken, s.
    pub stamp_s: f64,
    /// Forward speed, m/s.
    pub speed_m_s: f64,
    /// Yaw rate, rad/s.
    pub yaw_rate_rad_s: f64,
    /// Velocity to the left, m/s, of a body that leaves the ground. From `jsonl/2` on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_m_s: Option<f64>,
    /// Velocity up, m/s, of a body that leaves the ground. From `jsonl/2` on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up_m_s: Option<f64>,
}

/// An object that perception tracks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Track {
    /// Identity.
    pub id: u32,
    /// `vehicle`, `person`, `decoy` or `other`.
    pub class: String,
    /// East and north, m.
    pub at: Position,
    /// Velocity east and north, m/s.
    pub velocity: Position,
    /// Confidence, 0 to 1.
    pub confidence: f64,
    /// Time of its last update, s.
    pub updated_s: f64,
    /// One standard deviation of its place, m. From `jsonl/2` on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_m: Option<f64>,
}

/// The guest has taken the mission.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ready {}

/// A set-point: speed and curvature, or a velocity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reply {
    /// Number of the answered step.
    pub number: u32,
    /// Forward speed, m/s, within ±100.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_m_s: Option<f64>,
    /// Curvature, 1/m, positive to the left, within ±10.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curvature_per_m: Option<f64>,
    /// Velocity in the level frame of the body, in place of speed and curvature. From `jsonl/2` on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<Velocity>,
    /// Name of the guest's state, one of its file's `states`. Needed where the file gives `state`, and refused where not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<String>,
    /// The place that the guest drives by, m, within ±10,000. Where the file gives `place`, needed of a guest that drives, and refused where not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<Position>,
    /// Time until the guest wants the next step, s, up to 1; the set-point stands meanwhile. Null for the next period.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wake_s: Option<f64>,
    /// One receipt for each order of the step's `bus`, in the same order. From `jsonl/2` on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bus: Vec<BusReceipt>,
}

/// A velocity in the level frame of the body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Velocity {
    /// Forward, m/s, within ±100.
    pub forward_m_s: f64,
    /// To the left, m/s, within ±100; 0 on the ground.
    #[serde(default)]
    pub left_m_s: f64,
    /// Up, m/s, within ±100; 0 on the ground.
    #[serde(default)]
    pub up_m_s: f64,
    /// Turn, rad/s, counter-clockwise, within ±10. On the ground it needs a forward speed.
    pub turn_rad_s: f64,
}

/// The JSON Schema of both directions.
pub fn schema() -> serde_json::Value {
    serde_json::json!({
        "protocol": Protocol::V2.name(),
        "request": schemars::schema_for!(Request),
        "response": schemars::schema_for!(Response),
        "file": schemars::schema_for!(crate::file::Written),
    })
}

/// A request of the core in the words of the program's version, with the inputs that the guest takes and the orders to its adapter.
pub fn request(request: &wired::Request, program: &Program, bus: &[BusOrder]) -> Request {
    match request {
        wired::Request::Start(start) => Request::Start(start_of(start, program.protocol)),
        wired::Request::Step(step) => Request::Step(Step { bus: bus.to_vec(), ..step_of(step, program) }),
    }
}

fn start_of(start: &wired::MissionStart, protocol: Protocol) -> Start {
    let richer = protocol >= Protocol::V2;
    Start {
        protocol: protocol.name().to_owned(),
        time_s: seconds(start.now),
        period_s: start.period.0 as f64 / 1e6,
        max_speed_m_s: metres(start.max_speed_mm_s),
        braking_m_s2: metres(start.braking_mm_s2),
        route: start.route.iter().map(place).collect(),
        looped: start.looped,
        fence: start.fence.iter().map(place).collect(),
        obstacles: start.obstacles.iter().map(|d| Disc { at: place(&d.at), radius_m: metres(d.radius_mm) }).collect(),
        blocks: start.blocks.iter().flat_map(|blocks| blocks.iter()).map(block).collect(),
        pose: start.pose.filter(|_| richer).map(start_pose),
        body: start.body.filter(|_| richer).map(body),
        origin: richer.then_some(ORIGIN),
    }
}

fn start_pose(pose: wired::StartPose) -> StartPose {
    StartPose { at: place(&pose.at), yaw_rad: metres(pose.yaw_mrad), height_m: pose.height_mm.map(metres) }
}

fn body(body: wired::Body) -> Body {
    Body {
        medium: body.medium.name().to_owned(),
        size_m: body.size_mm.map(metres),
        max_curvature_per_m: metres(body.curvature_per_km),
        max_reverse_m_s: metres(body.reverse_mm_s),
        max_climb_m_s: metres(body.climb_mm_s),
        cruise_height_m: metres(body.cruise_mm),
    }
}

fn step_of(step: &wired::ControlStep, program: &Program) -> Step {
    let richer = program.protocol >= Protocol::V2;
    let navigation = step.navigation.filter(|_| program.takes(Input::Navigation));
    let tracks = step.tracks.iter().filter(|_| program.takes(Input::Tracks));
    let teammates = step.teammates.iter().filter(|_| program.takes(Input::Teammates));
    let nearby = step.nearby.as_ref().filter(|_| program.takes(Input::Nearby));
    Step {
        number: step.number,
        time_s: seconds(step.now),
        limit_m_s: metres(step.limit_mm_s),
        mode: step.mode.name().to_owned(),
        fix: navigation.and_then(|reading| fix(&reading, richer)),
        odometry: navigation.and_then(|reading| odometry(&reading, richer)),
        tracks: tracks.map(|one| track(one, richer)).collect(),
        teammates: teammates.map(place).collect(),
        height_m: step.height_mm.filter(|_| richer && program.takes(Input::Navigation)).map(metres),
        nearby: nearby.map(|all| all.iter().map(nearby_of).collect()),
        bus: Vec::new(),
    }
}

fn fix(reading: &wire::sensor::Navigation, richer: bool) -> Option<Fix> {
    let up_mm = reading.spatial.filter(|_| richer).and_then(|spatial| spatial.fix_up_mm);
    reading.fix.map(|fix| Fix {
        stamp_s: seconds(reading.stamp),
        at: [metres(fix.pose.x_mm), metres(fix.pose.y_mm)],
        yaw_rad: metres(fix.pose.yaw_mrad),
        sigma_m: metres(fix.sigma_mm),
        receiver_s: fix.time.0 as f64 / 1e6,
        height_m: up_mm.map(|mm| mm as f64 / 1000.0),
    })
}

fn odometry(reading: &wire::sensor::Navigation, richer: bool) -> Option<Odometry> {
    let left_up = reading.spatial.filter(|_| richer).and_then(|spatial| spatial.left_up_mm_s);
    reading.odometry.map(|odometry| Odometry {
        stamp_s: seconds(reading.stamp),
        speed_m_s: metres(odometry.speed_mm_s),
        yaw_rate_rad_s: metres(odometry.yaw_rate_mrad_s),
        left_m_s: left_up.map(|[left, _]| metres(left)),
        up_m_s: left_up.map(|[_, up]| metres(up)),
    })
}

fn track(track: &wire::track::Track, richer: bool) -> Track {
    let class: Class = track.class;
    Track {
        id: track.id.0,
        class: class.name().to_owned(),
        at: [metres(track.x_mm), metres(track.y_mm)],
        velocity: [metres(track.vx_mm_s), metres(track.vy_mm_s)],
        confidence: metres(track.confidence),
        updated_s: seconds(track.updated),
        sigma_m: richer.then(|| metres(track.sigma_mm)),
    }
}

fn nearby_of(nearby: &wire::track::Nearby) -> Nearby {
    Nearby {
        id: nearby.number,
        at: [metres(nearby.x_mm), metres(nearby.y_mm)],
        velocity: [metres(nearby.vx_mm_s), metres(nearby.vy_mm_s)],
        width_m: metres(nearby.width_mm),
    }
}

fn block(block: &wired::Block) -> Block {
    Block { at: place(&block.at), half_m: block.half_mm.map(metres), heading_rad: metres(block.heading_mrad) }
}

fn place(place: &wired::Place) -> Position {
    [metres(place.0), metres(place.1)]
}

/// Thousandths as units: mm as m, mrad as rad, permille as a share.
fn metres(thousandths: impl Into<f64>) -> f64 {
    thousandths.into() / 1000.0
}

fn seconds(time: Instant) -> f64 {
    time.0 as f64 / 1e6
}
