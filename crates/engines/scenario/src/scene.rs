//! The world of a trial: the platform's start, route and fence, and the objects that stand and move there.
//!
//! World frame: east, north, up, right-handed, metres; headings anticlockwise from east, radians.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::perturbation::Perturbation;
use super::print::Print;
use super::value::{Extent, List, Located, Name, Radians, Real, Seconds};
use wire::sensor::Class;

/// A point on the ground: east, north.
pub type Point = [Real<-500_000, 500_000>; 2];

/// The world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Start of the platform under test.
    pub start: Located<Pose>,
    /// Way points, in order.
    pub route: Located<List<Located<Point>, 64>>,
    /// The polygon that the platform may not leave: at least three corners, in order.
    pub geofence: Located<List<Point, 64>>,
    /// Ground.
    #[serde(default)]
    pub ground: Ground,
    /// Light and air; anything but a clear noon needs rendered sensors.
    #[serde(default)]
    pub weather: Weather,
    /// Shifts that faults of that kind add to colour images; needs rendered sensors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub perturbation: Option<Perturbation>,
    /// Objects that stand and move there.
    #[serde(default)]
    pub object: List<Object, 64>,
}

/// A place and a heading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// East, north.
    pub at_m: Point,
    /// Anticlockwise from east.
    #[serde(default)]
    pub heading_rad: Radians,
}

/// Smooth uneven ground, drawn from its own seed so that every trial has the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Ground {
    /// Seed of the relief.
    pub seed: u32,
    /// Greatest height above or below the mean.
    pub amplitude_m: Real<0, 1_000>,
    /// Distance between neighbouring hills.
    pub wavelength_m: Real<10_000, 200_000>,
    /// Temperature of ground and air.
    pub temperature_k: Real<200_000, 350_000>,
}

impl Default for Ground {
    fn default() -> Self {
        Self {
            seed: 1,
            amplitude_m: Real::constant(0.35),
            wavelength_m: Real::constant(22.0),
            temperature_k: Real::constant(288.0),
        }
    }
}

/// The conditions under which sensors measure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Weather {
    /// Light as a share of a clear noon's.
    pub light: Real<20, 1_500>,
    /// Meteorological visibility, metres; without it the air is clear.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub visibility_m: Option<Real<5_000, 100_000_000>>,
    /// Rate of rain.
    pub rain_mm_h: Real<0, 50_000>,
    /// Length of the smear of the colour image along its rows, pixels.
    #[schemars(range(max = 16))]
    pub smear_px: u16,
}

impl Default for Weather {
    fn default() -> Self {
        Self { light: Real::constant(1.0), visibility_m: None, rain_mm_h: Real::constant(0.0), smear_px: 0 }
    }
}

/// Wind with gusts (`sim::wind`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Wind {
    /// Mean towards the east, metres per second.
    pub east_m_s: Real<-20_000, 20_000>,
    /// Mean towards the north.
    pub north_m_s: Real<-20_000, 20_000>,
    /// Deviation of the gusts.
    pub gust_m_s: Real<0, 10_000>,
    /// Length of the gusts, metres.
    pub length_m: Real<1_000, 1_000_000>,
}

impl Default for Wind {
    fn default() -> Self {
        let calm = Real::constant(0.0);
        Self { east_m_s: calm, north_m_s: calm, gust_m_s: Real::constant(0.0), length_m: Real::constant(50.0) }
    }
}

/// One object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Object {
    /// Its name in the report.
    pub name: Located<Name>,
    /// Its class.
    pub class: Class,
    /// Its place, east and north: one point and it stands there, more and it goes from point to point.
    pub path_m: Located<List<Point, 64>>,
    /// Heading while it stands; on its way it faces where it goes.
    #[serde(default)]
    pub heading_rad: Radians,
    /// Length along its heading, width, height.
    pub size_m: [Extent; 3],
    /// Temperature of its warm parts.
    pub temperature_k: Real<200_000, 650_000>,
    /// Times at which its heating begins and ends, from the ground's temperature to its own; without them it is warm all along.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heated_s: Option<Located<[Seconds; 2]>>,
    /// Paint: red, green, blue.
    #[serde(default = "grey")]
    pub colour: [u8; 3],
    /// The class of its paint, if not its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub painted_as: Option<Class>,
    /// The class that is warm where it is, if not its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub warm_as: Option<Class>,
    /// The print on its sides; needs rendered sensors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub print: Option<Print>,
    /// Speed along the path.
    #[serde(default)]
    pub speed_m_s: Real<0, 15_000>,
    /// Time at which it sets out.
    #[serde(default)]
    pub departs_s: Seconds,
    /// True if it goes on from the last point to the first, for ever.
    #[serde(default)]
    pub closed: bool,
    /// True if it stops 3 m before the unit, and turns back when it has stood there for 10 s.
    #[serde(default)]
    pub yields: bool,
}

fn grey() -> [u8; 3] {
    [110, 110, 110]
}
