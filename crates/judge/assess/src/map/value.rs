//! The values of a map: a field with its unit, a stamp, the axes of a frame.

use std::fmt;

use serde::Deserialize;
use toml::Spanned;

/// A number of a message: its path, its unit, a factor.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// Path, such as `vel[0]` or `pose.pose.position.x`.
    pub field: String,
    /// Unit of the number once it is scaled.
    pub unit: Unit,
    /// Factor in front of the unit; may be negative.
    #[serde(default = "one")]
    pub scale: f64,
}

fn one() -> f64 {
    1.0
}

/// A number for each of two axes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axes {
    /// First axis.
    pub x: Spanned<Field>,
    /// Second axis.
    pub y: Spanned<Field>,
}

/// A time on the recording's clock.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stamp {
    /// Path; of a `ros` stamp the path of the field that has `sec` and `nanosec`.
    pub field: Option<String>,
    /// Unit.
    pub unit: StampUnit,
}

/// Unit of a stamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StampUnit {
    /// Seconds.
    S,
    /// Milliseconds.
    Ms,
    /// Microseconds.
    Us,
    /// Nanoseconds.
    Ns,
    /// A field with `sec` and `nanosec`.
    Ros,
    /// The recorder's own time, of MCAP and of MAVLink telemetry; a ULog has none.
    Log,
}

impl StampUnit {
    /// Its length, microseconds.
    pub(crate) fn us(self) -> f64 {
        match self {
            StampUnit::S | StampUnit::Ros => 1e6,
            StampUnit::Ms => 1e3,
            StampUnit::Us | StampUnit::Log => 1.0,
            StampUnit::Ns => 1e-3,
        }
    }
}

/// Axes of a world frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Frame {
    /// East and north, angles counter-clockwise from east: ROS.
    #[default]
    Enu,
    /// North and east, angles clockwise from north: PX4.
    Ned,
}

/// Kind of quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// Length.
    Length,
    /// Square of a length: a variance.
    Variance,
    /// Angle.
    Angle,
    /// Speed.
    Speed,
    /// Rate of turn.
    Rate,
}

impl fmt::Display for Dimension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Dimension::Length => "length",
            Dimension::Variance => "variance",
            Dimension::Angle => "angle",
            Dimension::Speed => "speed",
            Dimension::Rate => "rate of turn",
        })
    }
}

/// Unit of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Unit {
    /// Metre.
    #[serde(rename = "m")]
    Metre,
    /// Centimetre.
    #[serde(rename = "cm")]
    Centimetre,
    /// Millimetre.
    #[serde(rename = "mm")]
    Millimetre,
    /// Square metre: a variance.
    #[serde(rename = "m2")]
    SquareMetre,
    /// Radian.
    #[serde(rename = "rad")]
    Radian,
    /// Degree.
    #[serde(rename = "deg")]
    Degree,
    /// Ten-millionth of a degree, of older PX4 logs.
    #[serde(rename = "1e-7deg")]
    DegreeE7,
    /// Metre a second.
    #[serde(rename = "m/s")]
    MetrePerSecond,
    /// Kilometre an hour.
    #[serde(rename = "km/h")]
    KilometrePerHour,
    /// Radian a second.
    #[serde(rename = "rad/s")]
    RadianPerSecond,
    /// Degree a second.
    #[serde(rename = "deg/s")]
    DegreePerSecond,
}

impl Unit {
    /// The quantity.
    pub fn dimension(self) -> Dimension {
        match self {
            Unit::Metre | Unit::Centimetre | Unit::Millimetre => Dimension::Length,
            Unit::SquareMetre => Dimension::Variance,
            Unit::Radian | Unit::Degree | Unit::DegreeE7 => Dimension::Angle,
            Unit::MetrePerSecond | Unit::KilometrePerHour => Dimension::Speed,
            Unit::RadianPerSecond | Unit::DegreePerSecond => Dimension::Rate,
        }
    }

    /// Names of the units of a quantity.
    pub(super) fn names_for(dimension: Dimension) -> &'static str {
        match dimension {
            Dimension::Length => "m, cm, mm",
            Dimension::Variance => "m2",
            Dimension::Angle => "rad, deg, 1e-7deg",
            Dimension::Speed => "m/s, km/h",
            Dimension::Rate => "rad/s, deg/s",
        }
    }

    /// The unit in metres, radians and seconds.
    pub(crate) fn si(self) -> f64 {
        let degree = core::f64::consts::PI / 180.0;
        match self {
            Unit::Metre | Unit::SquareMetre | Unit::Radian | Unit::MetrePerSecond | Unit::RadianPerSecond => 1.0,
            Unit::Centimetre => 1e-2,
            Unit::Millimetre => 1e-3,
            Unit::Degree | Unit::DegreePerSecond => degree,
            Unit::DegreeE7 => degree * 1e-7,
            Unit::KilometrePerHour => 1.0 / 3.6,
        }
    }
}
