//! Messages between an autonomy core and a *guest*: a third party's program that takes the place of mission and
//! navigation.
//!
//! A guest is asked once at the start and then once a step, and answers each request with one message. Keys,
//! signatures, links and the clock stay with the core, so that a guest needs none of them. The form in which a program
//! reads and writes these messages is left to the crate `guest`; what follows from an answer to `autonomy`.

use minicbor::{Decode, Encode};
use strum::{EnumCount, IntoStaticStr, VariantArray};

use crate::codec::{List, Text};
use crate::mode::Mode;
use crate::sensor::Navigation;
use crate::time::{Instant, Span};
use crate::track::{NEARBY, Nearby, Track};

/// Most points of a route, corners of a fence, or obstacles of a map that are sent as discs.
pub const MAX_POINTS: usize = 64;
/// Most obstacles of a map that are sent as blocks.
pub const MAX_BLOCKS: usize = 256;
/// Most places of teammates in a step.
pub const MAX_TEAMMATES: usize = 4;
/// Longest name of a guest or of one of its states, bytes.
pub const MAX_NAME: usize = 40;
/// Longest reason of a failure, bytes.
pub const MAX_WHY: usize = 120;
/// Longest encoded request, bytes.
pub const MAX_REQUEST: usize = 16 * 1024;
/// Longest encoded answer, bytes.
pub const MAX_ANSWER: usize = 512;

/// East and north in the world frame, millimetres.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode, serde::Serialize, serde::Deserialize)]
pub struct Place(#[n(0)] pub i32, #[n(1)] pub i32);

/// A disc to keep clear of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Disc {
    /// Centre of the disc.
    #[n(0)]
    pub at: Place,
    /// Radius, millimetres.
    #[n(1)]
    pub radius_mm: u32,
}

/// An obstacle of the map by its length and width.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Block {
    /// Centre of the block.
    #[n(0)]
    pub at: Place,
    /// Half of the length and of the width, millimetres.
    #[n(1)]
    pub half_mm: [u32; 2],
    /// Direction of its length, milliradians counter-clockwise from east.
    #[n(2)]
    pub heading_mrad: i32,
}

/// Place, heading and height at the start, as surveyed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode, serde::Serialize, serde::Deserialize)]
pub struct StartPose {
    /// Place.
    #[n(0)]
    pub at: Place,
    /// Heading, milliradians counter-clockwise from east.
    #[n(1)]
    pub yaw_mrad: i32,
    /// Height above the ground, millimetres; none of a body that stays on it.
    #[n(2)]
    pub height_mm: Option<i32>,
}

/// Medium in which a body moves: it decides the set-points that the body can follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
#[cbor(index_only)]
#[derive(IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Medium {
    /// On wheels that steer: forward, backward, and turns on an arc.
    #[n(0)]
    Ground,
    /// In the air: each direction, and turns about the vertical axis.
    #[n(1)]
    Air,
    /// In orbit: its line of sight moves over the map.
    #[n(2)]
    Space,
}

impl Medium {
    /// The name in requests.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// Measures of the vehicle's body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Body {
    /// Medium of its motion.
    #[n(0)]
    pub medium: Medium,
    /// Length and width, millimetres; 0 for a line of sight.
    #[n(1)]
    pub size_mm: [u32; 2],
    /// Greatest curvature, 1/km.
    #[n(2)]
    pub curvature_per_km: u32,
    /// Greatest speed backwards, mm/s.
    #[n(3)]
    pub reverse_mm_s: u32,
    /// Greatest climb, mm/s; 0 on the ground.
    #[n(4)]
    pub climb_mm_s: u32,
    /// Height that is flown at, millimetres; 0 on the ground.
    #[n(5)]
    pub cruise_mm: u32,
}

/// The mission and its surroundings, sent once.
#[derive(Clone, Debug, PartialEq, Eq, Encode, Decode)]
pub struct MissionStart {
    /// Time on the vehicle host's clock.
    #[n(0)]
    pub now: Instant,
    /// Time between two steps, unless the guest asks for a longer one.
    #[n(1)]
    pub period: Span,
    /// Largest speed of the vehicle, mm/s.
    #[n(2)]
    pub max_speed_mm_s: u32,
    /// Deceleration that the vehicle is sure to reach, mm/s².
    #[n(3)]
    pub braking_mm_s2: u32,
    /// Way points in order; none to stand.
    #[n(4)]
    pub route: List<Place, MAX_POINTS>,
    /// True if the last way point leads to the first again.
    #[n(5)]
    pub looped: bool,
    /// Corners of the fence, in order.
    #[n(6)]
    pub fence: List<Place, MAX_POINTS>,
    /// Obstacles on the map as discs that reach to their ends, the first [`MAX_POINTS`].
    #[n(7)]
    pub obstacles: List<Disc, MAX_POINTS>,
    /// Obstacles by length and width; none in a recording from before this field.
    #[n(8)]
    pub blocks: Option<List<Block, MAX_BLOCKS>>,
    /// Pose at the start; none in a recording from before this field.
    #[n(9)]
    pub pose: Option<StartPose>,
    /// The vehicle's body; none in a recording from before this field.
    #[n(10)]
    pub body: Option<Body>,
}

/// What the unit knows at one control step.
#[derive(Clone, Debug, PartialEq, Eq, Encode, Decode)]
pub struct ControlStep {
    /// Number of the step, from 1.
    #[n(0)]
    pub number: u32,
    /// Time on the vehicle host's clock.
    #[n(1)]
    pub now: Instant,
    /// Mode of the unit's state machine.
    #[n(2)]
    pub mode: Mode,
    /// The most that may be driven now, mm/s: 0 unless an operator has enabled driving.
    #[n(3)]
    pub limit_mm_s: u32,
    /// The newest reading of position and odometry, as it passed the boundary; none before the first.
    #[n(4)]
    pub navigation: Option<Navigation>,
    /// The newest tracks.
    #[n(5)]
    pub tracks: List<Track, 16>,
    /// Places that teammates claim, as they were accepted.
    #[n(6)]
    pub teammates: List<Place, MAX_TEAMMATES>,
    /// Height above the ground by the unit's own sensors, millimetres; none of a unit on the ground.
    #[n(7)]
    pub height_mm: Option<i32>,
    /// Things that LiDAR shows nearby; none without a product of LiDAR.
    #[n(8)]
    pub nearby: Option<List<Nearby, NEARBY>>,
}

/// A request of the core.
#[derive(Clone, Debug, PartialEq, Eq, Encode, Decode)]
pub enum Request {
    /// Take this mission.
    #[n(0)]
    Start(#[n(0)] Box<MissionStart>),
    /// Answer this step.
    #[n(1)]
    Step(#[n(0)] Box<ControlStep>),
}

/// How a guest describes its own state, by the table in its file. A statement of the guest: no verdict rests on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Encode, Decode, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[cbor(index_only)]
pub enum Declared {
    /// The guest follows its mission.
    #[n(0)]
    Nominal,
    /// The guest goes on with reduced performance.
    #[n(1)]
    Degraded,
    /// The guest has brought the vehicle into its safe state, or is about to.
    #[n(2)]
    Safe,
}

impl Declared {
    /// The name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Declared::Nominal => "nominal",
            Declared::Degraded => "degraded",
            Declared::Safe => "safe",
        }
    }
}

/// Parts of a velocity beside the forward speed, in the level frame of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct BodyVelocity {
    /// To the left, mm/s; 0 on the ground.
    #[n(0)]
    pub left_mm_s: i32,
    /// Up, mm/s; 0 on the ground.
    #[n(1)]
    pub up_mm_s: i32,
    /// Turn about the vertical axis, mrad/s, counter-clockwise.
    #[n(2)]
    pub turn_mrad_s: i32,
}

/// A set-point with what the guest says about itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Reply {
    /// The step that it answers.
    #[n(0)]
    pub number: u32,
    /// Forward speed, mm/s.
    #[n(1)]
    pub speed_mm_s: i32,
    /// Curvature, 10⁻⁶ per metre, positive to the left.
    #[n(2)]
    pub curvature_um: i32,
    /// The guest's own name for its state, and its place in the guest's table; none from a guest that declares no
    /// states.
    #[n(3)]
    pub state: Option<(Declared, Text<MAX_NAME>)>,
    /// The place that the guest drives by; none from a guest that states no place.
    #[n(4)]
    pub place: Option<Place>,
    /// Time until the guest wants the next step; none for the next period.
    #[n(5)]
    pub wake: Option<Span>,
    /// The other parts of a velocity; none from a guest that asks for speed and curvature.
    #[n(6)]
    pub velocity: Option<BodyVelocity>,
}

/// The kind of a guest's failure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cbor(index_only)]
#[derive(EnumCount, VariantArray, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Fault {
    /// The program could not be started.
    #[n(0)]
    NotStarted,
    /// The program ended.
    #[n(1)]
    Ended,
    /// No answer within the limit of time.
    #[n(2)]
    Silent,
    /// A line longer than allowed, or more than one line for a request.
    #[n(3)]
    Flood,
    /// A line that is no message of the protocol.
    #[n(4)]
    Malformed,
    /// An answer to another step than the one that was asked about.
    #[n(5)]
    OutOfStep,
    /// A value that is no number or outside its range.
    #[n(6)]
    Value,
    /// A state that the guest's file does not name, or an output that the file does not promise.
    #[n(7)]
    Undeclared,
    /// No guest can go on here: the run was forked.
    #[n(8)]
    Unavailable,
}

impl Fault {
    /// Every kind, in wire order.
    pub const ALL: [Fault; Fault::COUNT] = *Fault::VARIANTS.first_chunk().expect("as many variants as it counts");

    /// The name in files and reports.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// An answer to a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub enum Answer {
    /// The guest has taken the mission.
    #[n(0)]
    Ready,
    /// The guest's set-point for the step.
    #[n(1)]
    Reply(#[n(0)] Reply),
    /// The guest failed; no further request is answered.
    #[n(2)]
    Failed {
        /// Kind of the failure.
        #[n(0)]
        fault: Fault,
        /// Expected and got.
        #[n(1)]
        why: Text<MAX_WHY>,
    },
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec;

    #[test]
    fn the_largest_start_fits_into_a_request() {
        let at = Place(i32::MIN, i32::MIN);
        let block = Block { at, half_mm: [u32::MAX; 2], heading_mrad: i32::MIN };
        let start = MissionStart {
            now: Instant(u64::MAX),
            period: Span(u64::MAX),
            max_speed_mm_s: u32::MAX,
            braking_mm_s2: u32::MAX,
            route: std::iter::repeat_n(at, MAX_POINTS).collect(),
            looped: true,
            fence: std::iter::repeat_n(at, MAX_POINTS).collect(),
            obstacles: std::iter::repeat_n(Disc { at, radius_mm: u32::MAX }, MAX_POINTS).collect(),
            blocks: Some(std::iter::repeat_n(block, MAX_BLOCKS).collect()),
            pose: Some(StartPose { at, yaw_mrad: i32::MIN, height_mm: Some(i32::MIN) }),
            body: Some(Body {
                medium: Medium::Space,
                size_mm: [u32::MAX; 2],
                curvature_per_km: u32::MAX,
                reverse_mm_s: u32::MAX,
                climb_mm_s: u32::MAX,
                cruise_mm: u32::MAX,
            }),
        };
        assert!(codec::encode(&Request::Start(Box::new(start))).len() <= MAX_REQUEST);
    }
}
