//! Outputs of sensors and the detector stages: frames, navigation readings, candidate observations.
//!
//! Frames: world is ENU (x east, y north, z up); body is x forward, y left, z up with its origin on the ground under
//! the chassis centre; pixels count from the upper left. Units are in the field names' docs and are integers.

use minicbor::bytes::ByteSlice;
use minicbor::{Decode, Encode};

use crate::codec::List;
use crate::id::FrameId;
use crate::motion::Spatial;
use crate::time::Instant;

/// One of the sensors that a track can rest on.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize, serde::Deserialize,
)]
#[cbor(index_only)]
#[serde(rename_all = "snake_case")]
pub enum Modality {
    /// Colour camera through the detector.
    #[n(0)]
    Rgb,
    /// Depth camera.
    #[n(1)]
    Depth,
    /// Thermal camera through the thermal stage.
    #[n(2)]
    Thermal,
    /// LiDAR.
    #[n(3)]
    Lidar,
}

impl Modality {
    /// Every modality.
    pub const ALL: [Modality; 4] = [Modality::Rgb, Modality::Depth, Modality::Thermal, Modality::Lidar];

    /// Name in logs and files.
    pub fn name(self) -> &'static str {
        match self {
            Modality::Rgb => "rgb",
            Modality::Depth => "depth",
            Modality::Thermal => "thermal",
            Modality::Lidar => "lidar",
        }
    }
}

/// A set of modalities.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Encode, Decode)]
#[cbor(transparent)]
pub struct Modalities(#[n(0)] pub u8);

impl Modalities {
    /// The set with one modality more.
    #[must_use]
    pub fn with_modality(self, m: Modality) -> Modalities {
        Modalities(self.0 | 1 << m as u8)
    }

    /// True if `m` is in the set.
    pub fn contains(self, m: Modality) -> bool {
        self.0 & (1 << m as u8) != 0
    }

    /// True if these suffice to designate a vehicle that they support: warmth, which is costly to counterfeit, and one
    /// more.
    pub fn designate(self) -> bool {
        self.count() >= 2 && self.contains(Modality::Thermal)
    }

    /// Number of modalities.
    pub fn count(self) -> u32 {
        self.0.count_ones()
    }
}

/// Names of the modalities, for people and for other programs.
impl serde::Serialize for Modalities {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(Modality::ALL.into_iter().filter(|m| self.contains(*m)))
    }
}

/// Source of a product; the paper's provenance hint against mode confusion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Encode, Decode, serde::Serialize)]
#[cbor(index_only)]
#[serde(rename_all = "snake_case")]
pub enum ProductMode {
    /// Made now, by this platform's sensors (in the twin: by the simulated ones).
    #[default]
    #[n(0)]
    Live,
    /// Made by a generator for training or test.
    #[n(1)]
    Synthetic,
    /// Played back from a recording.
    #[n(2)]
    Replay,
}

/// Class of an object.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Encode,
    Decode,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[cbor(index_only)]
#[serde(rename_all = "snake_case")]
pub enum Class {
    /// A vehicle: the class that an act may be designated on.
    #[n(0)]
    Vehicle,
    /// A person.
    #[n(1)]
    Person,
    /// Something made to look like a vehicle.
    #[n(2)]
    Decoy,
    /// Anything else that is in the way.
    #[n(3)]
    Obstacle,
}

impl Class {
    /// Every class, in the detector's channel order.
    pub const ALL: [Class; 4] = [Class::Vehicle, Class::Person, Class::Decoy, Class::Obstacle];

    /// Name in logs, files and views.
    pub fn name(self) -> &'static str {
        match self {
            Class::Vehicle => "vehicle",
            Class::Person => "person",
            Class::Decoy => "decoy",
            Class::Obstacle => "obstacle",
        }
    }

    /// Greatest apparent width and height of a thing of the class, millimetres. Perception takes no larger thing for
    /// one.
    pub fn largest_mm(self) -> [u16; 2] {
        match self {
            Class::Vehicle | Class::Decoy => [5500, 2800],
            Class::Person => [1200, 2200],
            Class::Obstacle => [4000, 4000],
        }
    }
}

/// A synchronous set of sensor readings. A modality without a reading is absent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Frames<'b> {
    /// Counts from 1 within a boot.
    #[n(0)]
    pub frame: FrameId,
    /// Time at which the readings were taken, on the vehicle host's clock.
    #[n(1)]
    pub stamp: Instant,
    /// Image width in pixels; all image modalities share it.
    #[n(2)]
    pub width: u16,
    /// Image height in pixels.
    #[n(3)]
    pub height: u16,
    /// Row-major RGB, 3 bytes a pixel.
    #[b(4)]
    pub rgb: Option<&'b ByteSlice>,
    /// Row-major depth along the optical axis, u16 little-endian millimetres, 0 = no return.
    #[b(5)]
    pub depth: Option<&'b ByteSlice>,
    /// Row-major temperature, u16 little-endian centikelvin.
    #[b(6)]
    pub thermal: Option<&'b ByteSlice>,
    /// Range of each beam, ring-major (16 × 360), u16 little-endian millimetres, 0 = no return.
    #[b(7)]
    pub lidar: Option<&'b ByteSlice>,
}

/// A planar pose from localisation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Encode, Decode, serde::Serialize)]
pub struct Pose {
    /// East, millimetres.
    #[n(0)]
    pub x_mm: i32,
    /// North, millimetres.
    #[n(1)]
    pub y_mm: i32,
    /// Heading, counter-clockwise from east, milliradians in (−π, π].
    #[n(2)]
    pub yaw_mrad: i16,
}

/// Time as a satellite receiver gives it with a fix, microseconds of its own count. It is an input like the position
/// beside it: no age, lease or freshness rests on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Encode, Decode, serde::Serialize)]
#[cbor(transparent)]
pub struct ReceiverTime(#[n(0)] pub u64);

/// A localisation reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Fix {
    /// World pose.
    #[n(0)]
    pub pose: Pose,
    /// One standard deviation of position as the source states it, millimetres.
    #[n(1)]
    pub sigma_mm: u16,
    /// The receiver's time at the fix.
    #[n(2)]
    pub time: ReceiverTime,
}

/// A wheel-odometry reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Odometry {
    /// Forward speed, mm/s.
    #[n(0)]
    pub speed_mm_s: i32,
    /// Yaw rate, mrad/s, counter-clockwise.
    #[n(1)]
    pub yaw_rate_mrad_s: i16,
}

/// Localisation and odometry, sim to perception and autonomy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Navigation {
    /// Time at which it was taken, on the vehicle host's clock.
    #[n(0)]
    pub stamp: Instant,
    /// Absent while localisation gives no fix.
    #[n(1)]
    pub fix: Option<Fix>,
    /// Absent while odometry gives no reading.
    #[n(2)]
    pub odometry: Option<Odometry>,
    /// Values of a body that leaves the ground.
    #[n(3)]
    pub spatial: Option<Spatial>,
}

/// A box in pixels, upper left inclusive, lower right exclusive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct PixelBox {
    /// Left.
    #[n(0)]
    pub x0: u16,
    /// Top.
    #[n(1)]
    pub y0: u16,
    /// Right.
    #[n(2)]
    pub x1: u16,
    /// Bottom.
    #[n(3)]
    pub y1: u16,
}

impl PixelBox {
    /// Pixels inside.
    pub fn area(&self) -> u32 {
        self.overlap(self)
    }

    /// Shared over united area.
    pub fn shared(&self, other: &PixelBox) -> f32 {
        let both = self.overlap(other);
        both as f32 / (self.area() + other.area() - both).max(1) as f32
    }

    /// Pixels inside both.
    pub fn overlap(&self, other: &PixelBox) -> u32 {
        let side = |low: u16, high: u16| u32::from(high.saturating_sub(low));
        side(self.x0.max(other.x0), self.x1.min(other.x1)) * side(self.y0.max(other.y0), self.y1.min(other.y1))
    }
}

/// A detector's candidate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Detection {
    /// Class with the highest score.
    #[n(0)]
    pub class: Class,
    /// Score in permille.
    #[n(1)]
    pub score: u16,
    /// Place in the image.
    #[n(2)]
    pub bounds: PixelBox,
}

/// Something warm in the thermal image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Blob {
    /// Place in the image.
    #[n(0)]
    pub bounds: PixelBox,
    /// Mean temperature, centikelvin.
    #[n(1)]
    pub mean_ck: u16,
    /// Highest temperature, centikelvin.
    #[n(2)]
    pub peak_ck: u16,
    /// Class that is warm like that: a vehicle, a person, or, as an obstacle, neither.
    #[n(3)]
    pub class: Class,
    /// Confidence of the thermal stage, permille.
    #[n(4)]
    pub score: u16,
}

/// Depth inside a detection's box.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct DepthSample {
    /// Index of the detection in the same message.
    #[n(0)]
    pub detection: u8,
    /// Median depth of the box's central half, millimetres along the optical axis.
    #[n(1)]
    pub median_mm: u16,
}

/// A group of LiDAR returns above ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Cluster {
    /// Centroid in the body frame, millimetres forward.
    #[n(0)]
    pub x_mm: i32,
    /// Centroid in the body frame, millimetres left.
    #[n(1)]
    pub y_mm: i32,
    /// Largest horizontal extent, millimetres.
    #[n(2)]
    pub width_mm: u16,
    /// Vertical extent, millimetres.
    #[n(3)]
    pub height_mm: u16,
}

/// Everything the detector stages give for one frame. An absent list says that its stage gave no product; an empty
/// one says that it looked and found none.
#[derive(Clone, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Candidates {
    /// Frame that the candidates are from.
    #[n(0)]
    pub frame: FrameId,
    /// Stamp of the frame.
    #[n(1)]
    pub stamp: Instant,
    /// Source of the product.
    #[n(2)]
    pub mode: ProductMode,
    /// Colour detections.
    #[n(3)]
    pub rgb: Option<List<Detection, 32>>,
    /// Depth inside the colour detections.
    #[n(4)]
    pub depth: Option<List<DepthSample, 32>>,
    /// Warm regions.
    #[n(5)]
    pub thermal: Option<List<Blob, 32>>,
    /// LiDAR clusters.
    #[n(6)]
    pub lidar: Option<List<Cluster, 64>>,
    /// Noise of candidates without planes: the noise of the plane that each modality's list represents, as one number,
    /// which another plane has by chance alone. Absent where there are planes.
    #[n(7)]
    pub grain: Option<[u32; 4]>,
}

/// The pinhole camera that all image modalities share, and its place on the body.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Camera {
    /// Pixels.
    pub width: u16,
    /// Pixels.
    pub height: u16,
    /// Focal length, pixels; the principal point is the image centre.
    pub focal_px: f32,
    /// Mounting point ahead of the body origin, metres; the optical axis is the body's x axis.
    pub forward_m: f32,
    /// Mounting height above the body origin, metres.
    pub up_m: f32,
}

impl Camera {
    /// 160 × 120 with a horizontal field of view of 90°.
    pub const GROUND: Camera = Camera { width: 160, height: 120, focal_px: 80.0, forward_m: 1.0, up_m: 1.2 };
}

/// The LiDAR's beams, and its place on the body. Ring 0 looks lowest; azimuth 0 of a ring looks along the body's x
/// axis, and azimuths run counter-clockwise in equal steps over the full turn.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Lidar {
    /// Rings.
    pub rings: u16,
    /// Beams in a ring.
    pub azimuths: u16,
    /// Elevation of ring 0, degrees.
    pub lowest_deg: f32,
    /// Elevation from one ring to the next, degrees.
    pub ring_step_deg: f32,
    /// Height above the body origin, metres.
    pub up_m: f32,
}

impl Lidar {
    /// 16 rings from −15° to +15°, one beam a degree.
    pub const GROUND: Lidar = Lidar { rings: 16, azimuths: 360, lowest_deg: -15.0, ring_step_deg: 2.0, up_m: 1.5 };
}
