//! The messages of `jsonl/1` and `jsonl/2`.
//!
//! World frame: x east, y north, metres; angles counter-clockwise from east, radians; times in seconds of the vehicle's clock, which has
//! an arbitrary zero. Fields that a request has beyond these are ignored. The loop over the lines is left to [`crate::serve`].

use serde::{Deserialize, Serialize};

/// The versions of the protocol that this crate speaks.
pub const PROTOCOLS: [&str; 2] = ["jsonl/1", "jsonl/2"];

/// Largest speed of a reply, m/s.
const MAX_SPEED: f64 = 100.0;
/// Largest curvature of a reply, 1/m.
const MAX_CURVATURE: f64 = 10.0;
/// Furthest coordinate of a reply, m.
const MAX_COORDINATE: f64 = 10_000.0;
/// Fastest turn of a reply, rad/s.
const MAX_TURN: f64 = 10.0;
/// Longest time until the next step, s.
const MAX_WAKE: f64 = 1.0;

/// East and north, m.
pub type Position = [f64; 2];

/// A request of the core.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Request {
    Start(Start),
    Step(Step),
}

/// An answer of the guest.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Response {
    Ready {},
    Reply {
        number: u32,
        #[serde(flatten)]
        reply: Written,
    },
}

/// A reply as it is written: one form of its set-point.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Written {
    #[serde(skip_serializing_if = "Option::is_none")]
    speed_m_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    curvature_per_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    velocity: Option<Velocity>,
    #[serde(skip_serializing_if = "Option::is_none")]
    state: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    place: Option<Position>,
    #[serde(skip_serializing_if = "Option::is_none")]
    wake_s: Option<f64>,
}

impl From<Reply> for Written {
    fn from(reply: Reply) -> Self {
        let Reply { speed_m_s, curvature_per_m, velocity, state, place, wake_s } = reply;
        let on_course = velocity.is_none();
        Self {
            speed_m_s: on_course.then_some(speed_m_s),
            curvature_per_m: on_course.then_some(curvature_per_m),
            velocity,
            state,
            place,
            wake_s,
        }
    }
}

/// The mission and its surroundings, sent once.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Start {
    /// Version of the protocol.
    pub protocol: String,
    /// Time of the vehicle's clock, s.
    pub time_s: f64,
    /// Time between two steps, unless the guest asks for a longer one, s.
    pub period_s: f64,
    /// Largest speed of the vehicle, m/s.
    pub max_speed_m_s: f64,
    /// Deceleration that the vehicle is sure to reach, m/s².
    pub braking_m_s2: f64,
    /// Way points in order; empty for a mission to stand.
    pub route: Vec<Position>,
    /// True if the last way point leads to the first again.
    pub looped: bool,
    /// Corners of the area that must not be left, in order.
    pub fence: Vec<Position>,
    /// The first 64 obstacles on the map, each as the disc around it.
    pub obstacles: Vec<Disc>,
    /// The same obstacles by length and width; empty from a core that does not tell them.
    #[serde(default)]
    pub blocks: Vec<Block>,
    /// Pose at the start, as surveyed; `None` in version 1.
    #[serde(default)]
    pub pose: Option<StartPose>,
    /// The vehicle's body; `None` in version 1.
    #[serde(default)]
    pub body: Option<Body>,
    /// Geodetic place of the world frame's origin, WGS 84; `None` in version 1.
    #[serde(default)]
    pub origin: Option<Origin>,
}

/// A pose as surveyed.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct StartPose {
    /// East and north, m.
    pub at: Position,
    /// Heading, rad.
    pub yaw_rad: f64,
    /// Height above the ground, m; `None` on the ground.
    #[serde(default)]
    pub height_m: Option<f64>,
}

/// Measures of the vehicle's body.
#[derive(Clone, Debug, PartialEq, Deserialize)]
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

/// A geodetic place, WGS 84.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Origin {
    /// Latitude, degrees.
    pub latitude_deg: f64,
    /// Longitude, degrees.
    pub longitude_deg: f64,
    /// Height above the ellipsoid, m.
    pub height_m: f64,
}

/// A disc to keep clear of.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Disc {
    /// Centre.
    pub at: Position,
    /// Radius, m.
    pub radius_m: f64,
}

/// An obstacle by its length and width.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Block {
    /// Its middle.
    pub at: Position,
    /// Half of length and width, m.
    pub half_m: [f64; 2],
    /// Direction of its longer axis, rad.
    pub heading_rad: f64,
}

/// One control step.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Step {
    /// Number of the step, from 1.
    pub number: u32,
    /// Time of the vehicle's clock, s.
    pub time_s: f64,
    /// The most that may be driven now, m/s: 0 unless an operator has enabled driving.
    pub limit_m_s: f64,
    /// Mode of the platform's state machine.
    pub mode: String,
    /// Position fix of the newest navigation message; `None` without one, or if the guest's file does not take
    /// `navigation`.
    pub fix: Option<Fix>,
    /// Wheel odometry of the newest navigation message; `None` as for `fix`.
    pub odometry: Option<Odometry>,
    /// Objects that perception tracks; empty where the guest's file does not take `tracks`.
    pub tracks: Vec<Track>,
    /// Places that other units claim; empty where the guest's file does not take `teammates`.
    pub teammates: Vec<Position>,
    /// Height above the ground by the unit's own sensors, m; `None` in version 1 and on the ground.
    #[serde(default)]
    pub height_m: Option<f64>,
    /// Returns of LiDAR, without a class; `None` in version 1, without a product of LiDAR, and where the guest's file does not take
    /// `nearby`.
    #[serde(default)]
    pub nearby: Option<Vec<Nearby>>,
}

/// Something that LiDAR shows.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Nearby {
    /// Number, counted apart from those of tracks.
    pub id: u32,
    /// Middle of its returns.
    pub at: Position,
    /// Velocity east and north, m/s.
    pub velocity: Position,
    /// Largest horizontal extent of its returns, m.
    pub width_m: f64,
}

/// A position fix.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
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
    /// Height above the world frame's origin, m; `None` in version 1 and on the ground.
    #[serde(default)]
    pub height_m: Option<f64>,
}

/// A reading of the wheels.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Odometry {
    /// Time at which it was taken, s.
    pub stamp_s: f64,
    /// Forward speed, m/s.
    pub speed_m_s: f64,
    /// Yaw rate, rad/s.
    pub yaw_rate_rad_s: f64,
    /// Velocity to the left, m/s; `None` in version 1 and on the ground.
    #[serde(default)]
    pub left_m_s: Option<f64>,
    /// Velocity up, m/s; `None` in version 1 and on the ground.
    #[serde(default)]
    pub up_m_s: Option<f64>,
}

/// An object that perception tracks.
#[derive(Clone, Debug, PartialEq, Deserialize)]
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
    /// Time of the last update, s.
    pub updated_s: f64,
    /// One standard deviation of its place, m; `None` in version 1.
    #[serde(default)]
    pub sigma_m: Option<f64>,
}

/// A velocity in the level frame of the body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Velocity {
    /// Forward, m/s, within ±100.
    pub forward_m_s: f64,
    /// To the left, m/s, within ±100; 0 on the ground.
    pub left_m_s: f64,
    /// Up, m/s, within ±100; 0 on the ground.
    pub up_m_s: f64,
    /// Turn, rad/s, counter-clockwise, within ±10. On the ground it needs a forward speed.
    pub turn_rad_s: f64,
}

/// A set-point; the loop adds the number of the step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reply {
    /// Forward speed, m/s, within ±100.
    pub speed_m_s: f64,
    /// Curvature, 1/m, positive to the left, within ±10.
    pub curvature_per_m: f64,
    /// Velocity in place of speed and curvature, which are then not sent. Refused in version 1.
    pub velocity: Option<Velocity>,
    /// Name of the guest's state: needed where the guest's file gives `state`, refused where not.
    pub state: Option<String>,
    /// Place that the guest drives by, m, within ±10,000: needed where the guest's file gives `place`, refused where not.
    pub place: Option<Position>,
    /// Time until the guest wants the next step, s, up to 1; none for the next period.
    pub wake_s: Option<f64>,
}

impl Reply {
    /// Holds each value to its range.
    ///
    /// # Errors
    /// The first value out of its range, with the range.
    pub fn check(&self) -> Result<(), String> {
        check_range("speed_m_s", self.speed_m_s, -MAX_SPEED, MAX_SPEED)?;
        check_range("curvature_per_m", self.curvature_per_m, -MAX_CURVATURE, MAX_CURVATURE)?;
        if let Some(Velocity { forward_m_s, left_m_s, up_m_s, turn_rad_s }) = self.velocity {
            for (name, part) in [("forward_m_s", forward_m_s), ("left_m_s", left_m_s), ("up_m_s", up_m_s)] {
                check_range(name, part, -MAX_SPEED, MAX_SPEED)?;
            }
            check_range("turn_rad_s", turn_rad_s, -MAX_TURN, MAX_TURN)?;
        }
        for coordinate in self.place.iter().flatten() {
            check_range("place", *coordinate, -MAX_COORDINATE, MAX_COORDINATE)?;
        }
        self.wake_s.map_or(Ok(()), |wake| check_range("wake_s", wake, 0.0, MAX_WAKE))
    }
}

fn check_range(name: &str, got: f64, least: f64, most: f64) -> Result<(), String> {
    if (least..=most).contains(&got) {
        return Ok(());
    }
    Err(format!("{name}: {least} to {most} expected, got {got}"))
}
