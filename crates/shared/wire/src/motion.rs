//! Motion in three dimensions: position, attitude and rates, beside the planar [`crate::sensor::Pose`].
//!
//! Every unit has a planar place, which way points, fences and tracks are in. A body that leaves the ground has these
//! messages on top. Positions are 64 bits wide: 32 bits of millimetres end below any orbit.

use minicbor::{Decode, Encode};

/// Attitude as a unit quaternion from body to world, `w x y z` in 10⁻⁹, `w` not negative.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode, serde::Serialize)]
#[cbor(transparent)]
pub struct Attitude(#[n(0)] pub [i32; 4]);

impl Attitude {
    /// Body axes along the world's.
    pub const LEVEL: Attitude = Attitude([1_000_000_000, 0, 0, 0]);

    /// Attitude of a quaternion `w x y z` of about unit length.
    pub fn new(q: [f64; 4]) -> Self {
        let sign = if q[0] < 0.0 { -1e9 } else { 1e9 };
        Attitude(q.map(|part| (part * sign).round() as i32))
    }

    /// The quaternion `w x y z`.
    pub fn parts(self) -> [f64; 4] {
        self.0.map(|part| f64::from(part) / 1e9)
    }
}

impl Default for Attitude {
    /// [`Attitude::LEVEL`].
    fn default() -> Self {
        Self::LEVEL
    }
}

/// Position, attitude and rates of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Encode, Decode, serde::Serialize)]
pub struct Motion {
    /// East, north and up in the world frame, mm.
    #[n(0)]
    pub position_mm: [i64; 3],
    /// Body to world.
    #[n(1)]
    pub attitude: Attitude,
    /// Velocity in the world frame, mm/s.
    #[n(2)]
    pub velocity_mm_s: [i32; 3],
    /// Rates about the body's axes, µrad/s.
    #[n(3)]
    pub rates_urad_s: [i32; 3],
}

/// Readings of a body that leaves the ground, beside fix and odometry. A source that gives none is absent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Encode, Decode)]
pub struct Spatial {
    /// Height of the fix above the world's origin, mm.
    #[n(0)]
    pub fix_up_mm: Option<i64>,
    /// Height by air pressure above the world's origin, mm.
    #[n(1)]
    pub pressure_up_mm: Option<i32>,
    /// Distance to the surface below, mm.
    #[n(2)]
    pub range_mm: Option<u32>,
    /// Velocity in the level frame by inertial and optical-flow sensors: left and up, mm/s.
    #[n(3)]
    pub left_up_mm_s: Option<[i32; 2]>,
    /// Charge of the battery, permille.
    #[n(4)]
    pub charge: Option<u16>,
    /// Attitude, body to the world's level axes.
    #[n(5)]
    pub attitude: Option<Attitude>,
    /// True in sunlight, false in the Earth's shadow; absent near the ground.
    #[n(6)]
    pub sunlit: Option<bool>,
}

/// State of a body that leaves the ground, as it reports it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct ReportedMotion {
    /// Height above the world's origin, mm.
    #[n(0)]
    pub up_mm: i64,
    /// Velocity in the level frame: left and up, mm/s.
    #[n(1)]
    pub left_up_mm_s: [i32; 2],
    /// Charge of the battery, permille.
    #[n(2)]
    pub charge: u16,
    /// Attitude, body to the world's level axes.
    #[n(3)]
    pub attitude: Option<Attitude>,
    /// True in sunlight, false in the Earth's shadow; absent near the ground.
    #[n(4)]
    pub sunlit: Option<bool>,
}
