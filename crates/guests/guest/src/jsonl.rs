//! `jsonl/1`: the core's requests and a guest's answers as lines of JSON, with plain names and SI units.
//!
//! One line goes in, one comes back. World frame: x east, y north, metres; angles counter-clockwise from east, radians; times in
//! seconds of the vehicle's clock. `holdsafe guest schema` prints the JSON Schema of both directions, made from these types. Which
//! answers a guest may give is left to [`crate::session`].

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::guest as wired;
use wire::sensor::Class;
use wire::time::Instant;

use crate::file::{Input, Program};

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
    /// Version of the protocol: `jsonl/1`.
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
}

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
}

/// The guest has taken the mission.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ready {}

/// A set-point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reply {
    /// Number of the answered step.
    pub number: u32,
    /// Forward speed, m/s, within ±100.
    pub speed_m_s: f64,
    /// Curvature, 1/m, positive to the left, within ±10.
    pub curvature_per_m: f64,
    /// Name of the guest's state, one of its file's `states`. Needed where the file gives `state`, and refused where not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<String>,
    /// The place that the guest drives by, m, within ±10,000. Where the file gives `place`, needed of a guest that drives, and refused where not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<Position>,
    /// Time until the guest wants the next step, s, up to 1; the set-point stands meanwhile. Null for the next period.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wake_s: Option<f64>,
}

/// The JSON Schema of both directions.
pub fn schema() -> serde_json::Value {
    serde_json::json!({
        "protocol": crate::file::PROTOCOL,
        "request": schemars::schema_for!(Request),
        "response": schemars::schema_for!(Response),
        "file": schemars::schema_for!(crate::file::Written),
    })
}

/// A request of the core in the words of the protocol, with the inputs that the guest takes.
pub fn request(request: &wired::Request, program: &Program) -> Request {
    match request {
        wired::Request::Start(start) => Request::Start(start_of(start)),
        wired::Request::Step(step) => Request::Step(step_of(step, program)),
    }
}

fn start_of(start: &wired::MissionStart) -> Start {
    Start {
        protocol: crate::file::PROTOCOL.to_owned(),
        time_s: seconds(start.now),
        period_s: start.period.0 as f64 / 1e6,
        max_speed_m_s: metres(start.max_speed_mm_s),
        braking_m_s2: metres(start.braking_mm_s2),
        route: start.route.iter().map(place).collect(),
        looped: start.looped,
        fence: start.fence.iter().map(place).collect(),
        obstacles: start.obstacles.iter().map(|d| Disc { at: place(&d.at), radius_m: metres(d.radius_mm) }).collect(),
        blocks: start.blocks.iter().flat_map(|blocks| blocks.iter()).map(block).collect(),
    }
}

fn step_of(step: &wired::ControlStep, program: &Program) -> Step {
    let navigation = step.navigation.filter(|_| program.takes(Input::Navigation));
    let stamp_s = navigation.map_or(0.0, |reading| seconds(reading.stamp));
    let fix = navigation.and_then(|reading| reading.fix).map(|fix| Fix {
        stamp_s,
        at: [metres(fix.pose.x_mm), metres(fix.pose.y_mm)],
        yaw_rad: metres(fix.pose.yaw_mrad),
        sigma_m: metres(fix.sigma_mm),
        receiver_s: fix.time.0 as f64 / 1e6,
    });
    let odometry = navigation.and_then(|reading| reading.odometry).map(|odometry| Odometry {
        stamp_s,
        speed_m_s: metres(odometry.speed_mm_s),
        yaw_rate_rad_s: metres(odometry.yaw_rate_mrad_s),
    });
    let tracks = step.tracks.iter().filter(|_| program.takes(Input::Tracks));
    let teammates = step.teammates.iter().filter(|_| program.takes(Input::Teammates));
    Step {
        number: step.number,
        time_s: seconds(step.now),
        limit_m_s: metres(step.limit_mm_s),
        mode: step.mode.name().to_owned(),
        fix,
        odometry,
        tracks: tracks.map(track).collect(),
        teammates: teammates.map(place).collect(),
    }
}

fn track(track: &wire::track::Track) -> Track {
    let class: Class = track.class;
    Track {
        id: track.id.0,
        class: class.name().to_owned(),
        at: [metres(track.x_mm), metres(track.y_mm)],
        velocity: [metres(track.vx_mm_s), metres(track.vy_mm_s)],
        confidence: metres(track.confidence),
        updated_s: seconds(track.updated),
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
