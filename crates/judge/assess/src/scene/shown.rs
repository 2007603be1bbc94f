//! Quantities that a recording shows of its sensors: speed, noise of fixes, rates, the longest silence.

use super::part::{Part, Spot};
use crate::facts::Facts;

/// Longest time between two fixes that are compared, microseconds: odometry hides more error over a longer one.
const NEAR_US: u64 = 1_000_000;
/// Least number of comparisons that tell a noise.
const LEAST_PAIRS: usize = 20;
/// Share of the samples of speed that may be higher, as from a false sample of odometry.
const ABOVE: f64 = 0.05;

/// The quantities.
pub(super) struct Shown {
    /// Speed that 95 % of the samples do not exceed, m/s.
    pub(super) speed_m_s: f64,
    /// Deviation of a fix on each axis beside odometry, metres; none from too few fixes.
    pub(super) noise_m: Option<f64>,
    /// Median of the deviation that fixes state, metres.
    pub(super) stated_m: Option<f64>,
    /// Median time between fixes, and between samples of odometry, seconds.
    pub(super) periods_s: [f64; 2],
    /// Longest time between two fixes: its beginning after the part's start, its length, seconds.
    pub(super) silence_s: [f64; 2],
}

impl Shown {
    pub(super) fn of_part(part: &Part, facts: &Facts) -> Self {
        let mut speeds = part.speeds.clone();
        speeds.sort_by(f64::total_cmp);
        let last = speeds.len().saturating_sub(1);
        let speed_m_s = speeds.get(last - (last as f64 * ABOVE) as usize).copied().unwrap_or(0.0);
        Self {
            speed_m_s,
            noise_m: noise(&part.spots),
            stated_m: facts.sigma_m.filter(|sigma| *sigma > 0.0),
            periods_s: [facts.fix_period_s, facts.odometry_period_s],
            silence_s: silence(&part.spots),
        }
    }
}

/// Deviation of a fix: of the difference between the way by two fixes and by odometry, of which each fix has half of the variance.
fn noise(spots: &[Spot]) -> Option<f64> {
    let pairs = spots.windows(2).filter(|two| two[1].us - two[0].us <= NEAR_US);
    let mut off: Vec<f64> = Vec::new();
    for two in pairs {
        let Some([ahead, left]) = two[1].moved_m else { continue };
        let turned = autonomy::localisation::wrap(two[1].yaw - two[0].yaw);
        let (sin, cos) = libm::sincos(two[0].yaw + turned / 2.0);
        let way = [ahead * cos - left * sin, ahead * sin + left * cos];
        off.extend([0, 1].map(|axis| (two[1].at_m[axis] - two[0].at_m[axis] - way[axis]).abs()));
    }
    off.sort_by(f64::total_cmp);
    // The median of absolute values of a normal distribution is 1 / 1.4826 of its deviation.
    let median = off.get(off.len() / 2).filter(|_| off.len() >= 2 * LEAST_PAIRS)?;
    Some(median * 1.4826 / core::f64::consts::SQRT_2)
}

fn silence(spots: &[Spot]) -> [f64; 2] {
    let longest = spots.windows(2).max_by_key(|two| two[1].us - two[0].us);
    longest.map_or([0.0; 2], |two| [two[0].us - spots[0].us, two[1].us - two[0].us].map(|us| us as f64 / 1e6))
}
