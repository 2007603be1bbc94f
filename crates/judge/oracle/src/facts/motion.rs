//! True motion of the plant: its speed in any direction, and whether it stands.
//!
//! A plant logs its speed along its own axis. Sliding sideways or being carried off shows in its true places alone.

use evidence::Micros;

/// A sample of the plant's truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Truth {
    /// Time of the sample.
    pub at: Micros,
    /// Time of the sample by the plant's own clock, which keeps step with its world: a recorder takes an entry up at some later time.
    pub stamp: Micros,
    /// True place, east and north, mm.
    pub place: (i32, i32),
    /// True speed in any direction, mm/s.
    pub speed: i32,
    /// Set-point that the plant follows, mm/s.
    pub set_speed: i32,
    /// True if the lease of the set-point stands.
    pub leased: bool,
    /// Signed distance to the envelope, positive inside, mm.
    pub fence: i32,
    /// True if its motion is within the platform's safe set: it stands, or moves as the platform's safe motion does.
    pub safe: bool,
    /// True if the set-point that it holds is within that set.
    pub asked_safe: bool,
    /// Stored energy beyond the reserve, and distance to the surface below beyond the least, thousandths of each; where the platform has such limits.
    pub reserves: Option<Reserves>,
}

/// Further margins of a platform that leaves the ground, in thousandths of what must be left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Reserves {
    /// Stored energy, beyond the reserve.
    pub energy: i32,
    /// Distance to the surface below, beyond the least.
    pub clearance: i32,
}

/// Speed below which the plant counts as standing, mm/s.
pub(crate) const STANDING: i32 = 50;
/// Least time between the two samples of a speed: over a shorter one the rounding of places to a millimetre shows.
const APART: Micros = 80_000;

/// Completes the samples: their speeds over ground, and whether one of a platform that states no safe set stands.
pub(super) fn complete_samples(truth: &mut [Truth]) {
    raise_to_ground_speed(truth);
    for sample in truth.iter_mut().filter(|sample| sample.reserves.is_none()) {
        sample.safe = sample.speed <= STANDING;
        sample.asked_safe = sample.set_speed.abs() <= STANDING;
    }
}

/// Raises the speed of each sample to that over ground, where this is higher: the lower of the speeds since a sample before it
/// and to one after it, so that a plant that has just come to rest is not taken to move still.
fn raise_to_ground_speed(truth: &mut [Truth]) {
    let speeds: Vec<i32> = (0..truth.len()).map(|k| ground_speed(truth, k)).collect();
    for (sample, speed) in truth.iter_mut().zip(speeds) {
        sample.speed = sample.speed.max(speed);
    }
}

fn ground_speed(truth: &[Truth], k: usize) -> i32 {
    let sample = &truth[k];
    let before = truth[..k].iter().rev().find(|t| sample.stamp.saturating_sub(t.stamp) >= APART);
    let after = truth[k + 1..].iter().find(|t| t.stamp.saturating_sub(sample.stamp) >= APART);
    let speeds = [before, after].into_iter().flatten().map(|other| speed_between(sample, other));
    speeds.min().unwrap_or(0)
}

/// Speed of the straight way between two samples, mm/s.
fn speed_between(a: &Truth, b: &Truth) -> i32 {
    let (dx, dy) = (f64::from(a.place.0) - f64::from(b.place.0), f64::from(a.place.1) - f64::from(b.place.1));
    // The clock is that of the plant: a recorder may take up places 100 ms apart 90 ms apart, which would make 3 m/s too fast.
    let seconds = a.stamp.abs_diff(b.stamp) as f64 / 1e6;
    (dx.hypot(dy) / seconds) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At three metres a second along x, entries taken up `late` microseconds after their stamps.
    fn samples(late: impl Fn(u64) -> u64) -> Vec<Truth> {
        let sample = |k: u64| Truth {
            at: k * 100_000 + late(k),
            stamp: 7_000_000 + k * 100_000,
            place: (300 * k as i32, 0),
            speed: 0,
            set_speed: 3000,
            leased: true,
            fence: 9000,
            safe: true,
            asked_safe: true,
            reserves: None,
        };
        (0..5).map(sample).collect()
    }

    #[test]
    fn speed_over_ground_is_by_the_plants_own_clock() {
        let mut late = samples(|k| [0, 12_000, 11_000, 1_000, 0][k as usize]);
        complete_samples(&mut late);
        assert!(late.iter().all(|sample| sample.speed == 3000 && !sample.safe), "{late:?}");
    }
}
