//! Points, turns and colours in Foxglove's terms.

use foxglove::messages::{Color, Point3, Pose, Quaternion, Vector3};
use wire::sensor::Class;

/// Turn from our convention of a body (x ahead, y left, z up) to an optical frame (x right, y down, z ahead).
pub(crate) const OPTICAL: Quaternion = Quaternion { x: -0.5, y: 0.5, z: -0.5, w: 0.5 };
/// No turn.
pub(crate) const STRAIGHT: Quaternion = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };

pub(crate) fn vector(x: f64, y: f64, z: f64) -> Vector3 {
    Vector3 { x, y, z }
}

pub(crate) fn point(x: f64, y: f64, z: f64) -> Point3 {
    Point3 { x, y, z }
}

/// A turn about the vertical, radians counter-clockwise.
pub(crate) fn heading(yaw: f64) -> Quaternion {
    let (sin, cos) = libm::sincos(yaw / 2.0);
    Quaternion { x: 0.0, y: 0.0, z: sin, w: cos }
}

pub(crate) fn pose(x: f64, y: f64, z: f64, orientation: Quaternion) -> Pose {
    Pose { position: Some(vector(x, y, z)), orientation: Some(orientation) }
}

pub(crate) fn metres(mm: i32) -> f64 {
    f64::from(mm) / 1e3
}

/// Colour of a class. Each has its own lightness, so that classes differ without hue as well.
pub(crate) fn of_class(class: Class, a: f64) -> Color {
    let (r, g, b) = match class {
        Class::Vehicle => (0.90, 0.62, 0.00),
        Class::Person => (0.34, 0.71, 0.91),
        Class::Decoy => (0.80, 0.47, 0.65),
        Class::Obstacle => (0.45, 0.45, 0.45),
    };
    Color { r, g, b, a }
}

/// Not to be relied on, or out of normal: the console's own colour for that.
pub(crate) fn caution(a: f64) -> Color {
    Color { r: 0.90, g: 0.62, b: 0.00, a }
}

pub(crate) fn grey(light: f64) -> Color {
    Color { r: light, g: light, b: light, a: 1.0 }
}
