//! The lever: the place of the position's receiver, from the point of the vehicle that does not slide, which is the middle of the rear axle.
//!
//! In a curve the receiver moves otherwise than that point, by the lever times the rate of turn; a guard that is given a false lever takes this for
//! an error of the fix. The map states the lever. Where it does not, the lever is estimated: over stretches of a second or more, the way by fixes is
//! compared with the way by odometry and heading, in least squares with outliers kept small (Huber, *Robust Estimation of a Location Parameter*, 1964).
//! Errors of the wheels' radius and of the heading's zero are estimated with it, within a few percent, so that they are not taken for a lever.

use crate::curve::Curve;
use crate::fix::Place;
use crate::motion::Motion;

/// Shortest and longest stretch, microseconds.
const STRETCH_US: std::ops::RangeInclusive<u64> = 1_000_000..=3_000_000;
/// Step of the sum over odometry, microseconds.
const STEP_US: u64 = 50_000;
/// Oldest odometry of a stretch, microseconds.
const OLD_US: u64 = 1_000_000;
/// Expected size of the unknowns before any data: lever ahead and to the left in metres, wheels' error, heading's error in radians.
const EXPECTED: [f64; 4] = [2.0, 2.0, 0.02, 0.02];
/// Least number of stretches, and least turn in all of them, radians.
const LEAST_STRETCHES: usize = 4;
const LEAST_TURN: f64 = 0.5;
/// Largest deviation of an estimate that is used, metres, and the longest lever.
const MAX_DEVIATION_M: f64 = 0.25;
const MAX_LEVER_M: f64 = 20.0;
/// Residual from which on a stretch counts less, in deviations.
const HUBER: f64 = 1.5;
/// Least deviation of a residual, metres: a fix is rounded to millimetres.
const LEAST_SIGMA_M: f64 = 0.005;
const ROUNDS: usize = 10;

/// An estimated lever, rounded to centimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Estimate {
    /// Metres ahead and to the left.
    pub(crate) lever_m: [f64; 2],
    /// One deviation of each, metres.
    pub(crate) deviation_m: [f64; 2],
    /// Stretches that it rests on, and the turn in them, radians.
    pub(crate) stretches: usize,
    pub(crate) turn: f64,
}

/// One equation: coefficients of the unknowns, and the sum that they have to explain, metres.
type Equation = ([f64; 4], f64);

/// The stretches of a drive.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stretches {
    equations: Vec<Equation>,
    turn: f64,
}

impl Stretches {
    /// Adds the values of one part of a recording.
    pub(crate) fn add(&mut self, fixes: &[(u64, Place)], turning: &Curve, motion: &Motion) {
        let mut from = 0;
        for to in 1..fixes.len() {
            let ((begin, first), (end, last)) = (&fixes[from], &fixes[to]);
            let old = motion.speed.age(*end).is_none_or(|age| age > OLD_US);
            if end - begin > *STRETCH_US.end() || old {
                from = to;
            } else if STRETCH_US.contains(&(end - begin)) {
                let way = way((*begin, *end), turning, &motion.speed);
                self.turn += autonomy::localisation::wrap(last.yaw - first.yaw).abs();
                self.equations.extend(equations((first, last), way));
                from = to;
            }
        }
    }

    /// The lever that explains them best; none where they do not determine it.
    pub(crate) fn estimate(&self) -> Option<Estimate> {
        let stretches = self.equations.len() / 2;
        if stretches < LEAST_STRETCHES || self.turn < LEAST_TURN {
            return None;
        }
        let (solved, deviations) = self.solve(EXPECTED)?;
        // A place to the left cannot be distinguished from the wheels' error in a steady curve: it is then left at zero.
        let (solved, deviations) = match deviations[1] > MAX_DEVIATION_M {
            true => self.solve([EXPECTED[0], 1e-6, EXPECTED[2], EXPECTED[3]])?,
            false => (solved, deviations),
        };
        // `+ 0.0` makes a negative zero positive.
        let rounded = |metres: f64| libm::round(metres * 100.0) / 100.0 + 0.0;
        let fine = deviations[0] <= MAX_DEVIATION_M && solved[..2].iter().all(|metres| metres.abs() <= MAX_LEVER_M);
        fine.then(|| Estimate {
            lever_m: [rounded(solved[0]), rounded(solved[1])],
            deviation_m: [deviations[0], deviations[1]],
            stretches,
            turn: self.turn,
        })
    }

    /// The unknowns and their deviations.
    fn solve(&self, expected: [f64; 4]) -> Option<([f64; 4], [f64; 4])> {
        let (mut solved, mut sigma) = ([0.0; 4], 0.1);
        let mut inverse = [[0.0; 4]; 4];
        for _ in 0..ROUNDS {
            let (mut normal, mut right) = ([[0.0; 4]; 4], [0.0; 4]);
            for (i, size) in expected.iter().enumerate() {
                normal[i][i] = sigma * sigma / (size * size);
            }
            for (coefficients, value) in &self.equations {
                let off = residual(&solved, coefficients, *value).abs();
                let weight = if off > HUBER * sigma { HUBER * sigma / off } else { 1.0 };
                for i in 0..4 {
                    right[i] += weight * coefficients[i] * value;
                    for j in 0..4 {
                        normal[i][j] += weight * coefficients[i] * coefficients[j];
                    }
                }
            }
            inverse = inverted(normal)?;
            solved = [0, 1, 2, 3].map(|i| (0..4).map(|j| inverse[i][j] * right[j]).sum());
            let mut off: Vec<f64> =
                self.equations.iter().map(|(of, value)| residual(&solved, of, *value).abs()).collect();
            off.sort_by(f64::total_cmp);
            // The median of absolute values of a normal distribution is 1 / 1.4826 of its deviation.
            sigma = (off.get(off.len() / 2)? * 1.4826).max(LEAST_SIGMA_M);
        }
        let deviations = [0, 1, 2, 3].map(|i| sigma * libm::sqrt(inverse[i][i].max(0.0)));
        solved.iter().chain(&deviations).all(|number| number.is_finite()).then_some((solved, deviations))
    }
}

/// Way of the axle between two times by odometry, along the heading, metres east and north.
fn way((from, to): (u64, u64), turning: &Curve, speed: &Curve) -> (f64, f64) {
    let (mut time, mut way) = (from, (0.0, 0.0));
    while time < to {
        let next = (time + STEP_US).min(to);
        let travelled = speed.mean(time, next) * (next - time) as f64 / 1e6;
        let (sin, cos) = libm::sincos(turning.value(time + (next - time) / 2));
        way = (way.0 + travelled * cos, way.1 + travelled * sin);
        time = next;
    }
    way
}

/// East and north of the difference between the way of the receiver and that of the axle.
fn equations((first, last): (&Place, &Place), way: (f64, f64)) -> [Equation; 2] {
    let ((sin_0, cos_0), (sin_1, cos_1)) = (libm::sincos(first.yaw), libm::sincos(last.yaw));
    let (ahead, left) = ((cos_1 - cos_0, sin_1 - sin_0), (sin_0 - sin_1, cos_1 - cos_0));
    [
        ([ahead.0, left.0, way.0, -way.1], last.east - first.east - way.0),
        ([ahead.1, left.1, way.1, way.0], last.north - first.north - way.1),
    ]
}

fn residual(solved: &[f64; 4], coefficients: &[f64; 4], value: f64) -> f64 {
    value - solved.iter().zip(coefficients).map(|(unknown, coefficient)| unknown * coefficient).sum::<f64>()
}

/// Inverse, by elimination with the largest pivot; `None` for a singular matrix.
fn inverted(mut matrix: [[f64; 4]; 4]) -> Option<[[f64; 4]; 4]> {
    let mut inverse = [[0.0; 4]; 4];
    (0..4).for_each(|i| inverse[i][i] = 1.0);
    for column in 0..4 {
        let pivot = (column..4).max_by(|a, b| matrix[*a][column].abs().total_cmp(&matrix[*b][column].abs()))?;
        matrix.swap(column, pivot);
        inverse.swap(column, pivot);
        let by = matrix[column][column];
        if by == 0.0 || !by.is_finite() {
            return None;
        }
        matrix[column] = matrix[column].map(|number| number / by);
        inverse[column] = inverse[column].map(|number| number / by);
        for row in (0..4).filter(|row| *row != column) {
            let factor = matrix[row][column];
            for i in 0..4 {
                matrix[row][i] -= factor * matrix[column][i];
                inverse[row][i] -= factor * inverse[column][i];
            }
        }
    }
    Some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fixes of a winding drive with this lever, four a second, wheels that are wrong by 1 % and a fix that jumps for a while.
    fn drive(lever: [f64; 2], straight: bool) -> Stretches {
        let (mut fixes, mut speeds, mut headings) = (Vec::new(), Vec::new(), Vec::new());
        let (mut x, mut y, mut yaw) = (0.0, 0.0, 0.3);
        for i in 0..400_u64 {
            let (time, t) = (i * 250_000, i as f64 / 4.0);
            let rate = if straight { 0.0 } else { 0.4 * libm::sin(0.35 * t) };
            let (sin, cos) = libm::sincos(yaw);
            let jump = if (200..230).contains(&i) { 8.0 } else { 0.0 };
            let (east, north) = (x + lever[0] * cos - lever[1] * sin + jump, y + lever[0] * sin + lever[1] * cos);
            fixes.push((time, Place { east, north, yaw, sigma_m: 0.0, time: None }));
            speeds.push((time, 1.01 * 2.0));
            headings.push((time, yaw));
            for _ in 0..250 {
                (x, y) = (x + 0.002 * libm::cos(yaw), y + 0.002 * libm::sin(yaw));
                yaw += rate / 1000.0;
            }
        }
        let motion = Motion { speed: Curve::from_samples(speeds), ..Motion::default() };
        let mut stretches = Stretches::default();
        stretches.add(&fixes, &Curve::from_samples(headings), &motion);
        stretches
    }

    #[test]
    fn lever_is_found_beside_false_wheels_and_a_jump() {
        for lever in [[0.0, 0.0], [0.6, 0.0], [-1.2, 0.5]] {
            let found = drive(lever, false).estimate().unwrap();
            let off = [0, 1].map(|i| (found.lever_m[i] - lever[i]).abs());
            assert!(off.iter().all(|metres| *metres < 0.03), "{lever:?}: {found:?}");
        }
    }

    #[test]
    fn straight_drive_tells_no_lever() {
        assert_eq!(drive([0.6, 0.0], true).estimate(), None);
    }
}
