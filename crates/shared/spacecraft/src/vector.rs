//! Vectors of three and rotations of them: the arithmetic that the other modules share.
//!
//! Frames are the caller's. Matrices are rows; as rotations they turn a vector into the frame whose axes are their
//! rows.

/// Three components in one frame.
pub type Vector = [f64; 3];

/// Rows of a rotation.
pub type Matrix = [Vector; 3];

/// Sum.
pub fn add(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Difference `a - b`.
pub fn sub(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Vector times a number.
pub fn scale(a: Vector, factor: f64) -> Vector {
    a.map(|part| part * factor)
}

/// Component by component, as a diagonal matrix multiplies.
pub fn times(a: Vector, b: Vector) -> Vector {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}

/// Inner product.
pub fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Cross product.
pub fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Length.
pub fn norm(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

/// Direction; none of a vector of no length or of no number.
pub fn unit(a: Vector) -> Option<Vector> {
    let length = norm(a);
    (length.is_finite() && length > 0.0).then(|| scale(a, 1.0 / length))
}

/// The vector scaled down, its direction kept, so that no component exceeds its limit.
pub fn limited(a: Vector, limits: Vector) -> Vector {
    let excess = |part: f64, limit: f64| if part.abs() > limit { limit.max(0.0) / part.abs() } else { 1.0 };
    let share = excess(a[0], limits[0]).min(excess(a[1], limits[1])).min(excess(a[2], limits[2]));
    scale(a, share)
}

/// Components of `a` along the rows of `m`.
pub fn apply(m: &Matrix, a: Vector) -> Vector {
    [dot(m[0], a), dot(m[1], a), dot(m[2], a)]
}

/// The inverse of a rotation.
pub fn transposed(m: &Matrix) -> Matrix {
    [[m[0][0], m[1][0], m[2][0]], [m[0][1], m[1][1], m[2][1]], [m[0][2], m[1][2], m[2][2]]]
}

/// The rotation that applies `b` first and `a` after it.
pub fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let columns = transposed(b);
    a.map(|row| apply(&columns, row))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotation_times_its_inverse_is_none() {
        let (sin, cos) = libm::sincos(0.7);
        let m = [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]];
        let one = product(&m, &transposed(&m));
        for (i, row) in one.iter().enumerate() {
            for (j, part) in row.iter().enumerate() {
                assert!((part - f64::from(u8::from(i == j))).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn a_limited_vector_keeps_its_direction() {
        let short = limited([4.0, -2.0, 1.0], [1.0; 3]);
        assert_eq!(short, [1.0, -0.5, 0.25]);
        assert_eq!(limited([0.5, 0.0, 0.0], [1.0; 3]), [0.5, 0.0, 0.0]);
    }

    #[test]
    fn a_vector_of_no_length_has_no_direction() {
        assert_eq!(unit([0.0; 3]), None);
        assert_eq!(unit([f64::NAN, 0.0, 0.0]), None);
    }
}
