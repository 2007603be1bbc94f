//! Quaternions, scalar first, of unit length: one turns a vector's components along its own axes into those along the
//! frame it is given in.

use crate::vector::{Matrix, Vector, add, cross, dot, norm, scale, transposed, unit};

/// Scalar and vector part.
pub type Quaternion = [f64; 4];

/// No turn.
pub const NONE: Quaternion = [1.0, 0.0, 0.0, 0.0];

/// The turn by `b` and by `a` after it: if `b` takes A to B and `a` takes B to C, it takes A to C.
pub fn product(a: Quaternion, b: Quaternion) -> Quaternion {
    let ([s, ..], u) = (a, axis_part(a));
    let ([t, ..], v) = (b, axis_part(b));
    let [x, y, z] = add(add(scale(v, s), scale(u, t)), cross(u, v));
    [s * t - dot(u, v), x, y, z]
}

/// The turn back.
pub fn inverse([w, x, y, z]: Quaternion) -> Quaternion {
    [w, -x, -y, -z]
}

/// Vector part.
pub fn axis_part([_, x, y, z]: Quaternion) -> Vector {
    [x, y, z]
}

/// The quaternion at unit length; [`NONE`] for one of no length or of no number.
pub fn normalized(q: Quaternion) -> Quaternion {
    let length = q.iter().map(|part| part * part).sum::<f64>().sqrt();
    if length.is_finite() && length > 0.0 { q.map(|part| part / length) } else { NONE }
}

/// An equal turn with a scalar part that is not negative: the short way round.
pub fn short(q: Quaternion) -> Quaternion {
    if q[0] < 0.0 { q.map(|part| -part) } else { q }
}

/// A vector of body axes in the outer frame.
pub fn rotate(q: Quaternion, v: Vector) -> Vector {
    let u = axis_part(q);
    let doubled = scale(cross(u, v), 2.0);
    add(add(v, scale(doubled, q[0])), cross(u, doubled))
}

/// A vector of the outer frame in body axes.
pub fn rotate_back(q: Quaternion, v: Vector) -> Vector {
    rotate(inverse(q), v)
}

/// The turn about `axis` by `angle`, radians; [`NONE`] about no axis.
pub fn from_axis_angle(axis: Vector, angle: f64) -> Quaternion {
    let Some(axis) = unit(axis) else { return NONE };
    let (sin, cos) = libm::sincos(0.5 * angle);
    let [x, y, z] = scale(axis, sin);
    [cos, x, y, z]
}

/// The rotation vector of a turn the short way round: axis times angle, radians.
pub fn rotation_vector(q: Quaternion) -> Vector {
    let [w, ..] = short(q);
    let part = axis_part(short(q));
    let sin = norm(part);
    // Below this the angle is twice the vector part to the last digit.
    if sin < 1e-9 { scale(part, 2.0) } else { scale(part, 2.0 * libm::atan2(sin, w) / sin) }
}

/// The angle between two attitudes, radians in [0, π].
pub fn angle(a: Quaternion, b: Quaternion) -> f64 {
    norm(rotation_vector(product(inverse(a), b)))
}

/// The attitude whose body axes are these in the outer frame: three of unit length, each at right angles to the others
/// and right-handed (Shepperd, *Quaternion from Rotation Matrix*, Journal of Guidance and Control 1, 1978).
pub fn of_axes(x: Vector, y: Vector, z: Vector) -> Quaternion {
    let [[xx, yx, zx], [xy, yy, zy], [xz, yz, zz]]: Matrix = transposed(&[x, y, z]);
    let trace = xx + yy + zz;
    let largest = trace.max(xx).max(yy).max(zz);
    let q = if largest == trace {
        [1.0 + trace, yz - zy, zx - xz, xy - yx]
    } else if largest == xx {
        [yz - zy, 1.0 + 2.0 * xx - trace, xy + yx, zx + xz]
    } else if largest == yy {
        [zx - xz, xy + yx, 1.0 + 2.0 * yy - trace, yz + zy]
    } else {
        [xy - yx, zx + xz, yz + zy, 1.0 + 2.0 * zz - trace]
    };
    short(normalized(q))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::sub;

    fn nearly_equal(a: Vector, b: Vector) -> bool {
        norm(sub(a, b)) < 1e-14
    }

    #[test]
    fn a_quarter_turn_about_z_takes_x_to_y() {
        let q = from_axis_angle([0.0, 0.0, 2.0], std::f64::consts::FRAC_PI_2);
        assert!(nearly_equal(rotate(q, [1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]));
        assert!(nearly_equal(rotate_back(q, [0.0, 1.0, 0.0]), [1.0, 0.0, 0.0]));
    }

    #[test]
    fn a_product_turns_by_its_right_factor_first() {
        let (a, b) = (from_axis_angle([1.0, 2.0, 3.0], 0.7), from_axis_angle([-3.0, 1.0, 0.5], 2.1));
        let v = [0.3, -0.2, 0.9];
        assert!(nearly_equal(rotate(product(a, b), v), rotate(a, rotate(b, v))));
    }

    #[test]
    fn an_attitude_has_the_axes_it_is_of() {
        for i in 0..200 {
            let i = f64::from(i);
            let q = from_axis_angle([libm::sin(i), libm::cos(1.7 * i), libm::sin(0.3 * i)], 0.1 * i);
            let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| rotate(q, axis));
            assert!(angle(q, of_axes(x, y, z)) < 1e-14, "{i}");
        }
    }

    #[test]
    fn an_angle_is_that_of_the_short_way() {
        assert!((angle(NONE, from_axis_angle([1.0, 0.0, 0.0], 5.0)) - (std::f64::consts::TAU - 5.0)).abs() < 1e-14);
        assert!((angle(NONE, from_axis_angle([1.0, 0.0, 0.0], 1e-12)) - 1e-12).abs() < 1e-20);
    }

    #[test]
    fn a_quaternion_of_no_number_is_no_turn() {
        assert_eq!(normalized([f64::NAN; 4]), NONE);
        assert_eq!(normalized([0.0; 4]), NONE);
        assert_eq!(from_axis_angle([0.0; 3], 1.0), NONE);
    }
}
