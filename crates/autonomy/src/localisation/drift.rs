//! The drift test: do fixes walk away from odometry more slowly than any single one would give away?
//!
//! Page's cumulative sum (E. S. Page, *Continuous inspection schemes*, Biometrika 41, 1954), two-sided, for east and
//! for north. The summed quantity is the innovation: the distance of a fix from the anchor as odometry has carried it.
//! The anchor follows fixes with a time constant τ, so a drift at the rate *v* holds the innovation at *v·τ*, while
//! noise leaves it around zero. The error of wheels is a share of the way that the anchor still remembers, so it is
//! allowed for as long as it is remembered: a unit that has just stopped is judged by the way it came. At rest the test
//! is four times as sharp as at full speed. The figures are derived in `docs/reference/bounds.md`.

use wire::measured::DRIFT_MM_S;

/// Innovation that noise of a good fix accounts for, millimetres: one deviation of it. A fix that states more is
/// allowed that deviation.
const NOISE_MM: f64 = 40.0;
/// The sum of excesses at which fixes are taken to drift; the excess of a fix with a greater deviation count for less
/// in proportion.
const LIMIT_MM_S: f64 = DRIFT_MM_S as f64;
/// Longest time that one reading may count for, seconds.
const LONGEST_S: f64 = 0.25;

/// The four sums: east, west, north, south.
#[derive(Clone, Debug, Default)]
pub(super) struct Drift {
    sums: [f64; 4],
    /// The way by odometry that the anchor has not yet forgotten, millimetres.
    way: f64,
    found: bool,
}

impl Drift {
    /// Takes the innovation `(east, north)` of a fix and its deviation, `elapsed` seconds after the one before, at
    /// `speed`. Odometry may be wrong by `share` of the way, and `unobserved` millimetres were travelled without it.
    ///
    /// A finding stays until every sum has run empty again.
    pub(super) fn take(
        &mut self,
        ((east, north), sigma_mm): ((f64, f64), f64),
        elapsed: f64,
        speed: f64,
        (share, unobserved): (f64, f64),
    ) {
        self.way += speed.abs() * elapsed;
        let noise = sigma_mm.max(NOISE_MM);
        let allowed = noise + share * self.way + unobserved;
        let counted = elapsed.min(LONGEST_S) * NOISE_MM / noise;
        for (sum, off) in self.sums.iter_mut().zip([east, -east, north, -north]) {
            // Twice the limit at most, so that the end of a drift is found as soon as its beginning.
            *sum = (*sum + (off - allowed) * counted).clamp(0.0, 2.0 * LIMIT_MM_S);
        }
        let above = self.sums.iter().any(|sum| *sum > LIMIT_MM_S);
        let empty = self.sums.iter().all(|sum| *sum <= 0.0);
        self.found = above || self.found && !empty;
    }

    /// A fix that another test keeps out: the way is remembered, and the sums stay as they are, with a finding from
    /// before.
    pub(super) fn pass(&mut self, elapsed: f64, speed: f64) {
        self.way += speed.abs() * elapsed;
    }

    /// The anchor took over this share of the newest innovation, and forgot as much of the way.
    pub(super) fn forget(&mut self, share: f64) {
        self.way *= 1.0 - share;
    }

    /// The largest of the sums, millimetre seconds, rounded up.
    pub(super) fn sum(&self) -> i32 {
        self.sums.into_iter().fold(0.0, f64::max).ceil() as i32
    }

    /// True if fixes drift.
    pub(super) fn found(&self) -> bool {
        self.found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Share that an anchor forgets with a reading in its steady state.
    const SHARE: f64 = 0.05 / 4.0;

    /// Error of the wheels, one percent of the way, and no way without odometry.
    const WHEELS: (f64, f64) = (0.01, 0.0);

    /// A unit that has long gone at `speed`.
    fn driven(speed: f64) -> Drift {
        let mut drift = Drift::default();
        for _ in 0..1000 {
            drift.take(((0.0, 0.0), 40.0), 0.05, speed, WHEELS);
            drift.forget(SHARE);
        }
        drift
    }

    /// Seconds until a constant innovation is found at `speed`; `None` within a minute.
    fn found_after(innovation: f64, speed: f64) -> Option<f64> {
        let mut drift = driven(speed);
        (1..1200).find_map(|i| {
            drift.take(((0.0, innovation), 40.0), 0.05, speed, WHEELS);
            drift.forget(SHARE);
            drift.found().then_some(f64::from(i) * 0.05)
        })
    }

    /// At rest wheels explain little.
    #[test]
    fn explainable_drift_is_never_found() {
        assert_eq!(found_after(159.0, 3000.0), None);
        assert!(found_after(260.0, 3000.0).is_some_and(|s| s < 0.3), "{:?}", found_after(260.0, 3000.0));
        assert!(found_after(82.0, 0.0).is_some_and(|s| s < 0.6), "{:?}", found_after(82.0, 0.0));
    }

    /// A unit that has just stopped is judged by the way it came.
    #[test]
    fn wheel_error_is_no_drift_after_a_stop() {
        let (mut drift, mut off) = (driven(3000.0), 120.0);
        for _ in 0..400 {
            drift.take(((off, 0.0), 40.0), 0.05, 0.0, WHEELS);
            drift.forget(SHARE);
            off *= 1.0 - SHARE;
            assert!(!drift.found());
        }
    }

    /// Delay of the finding after the beginning of a drift, with the drift in units of the stated deviation.
    #[test]
    fn drift_of_a_receiver_that_states_more_is_found_as_late() {
        let found = |sigma_mm: f64| {
            let mut drift = Drift::default();
            (0..100).position(|_| {
                drift.take(((2.5 * sigma_mm, 0.0), sigma_mm), 0.05, 0.0, WHEELS);
                drift.found()
            })
        };
        assert!(found(40.0).is_some_and(|readings| readings > 3));
        assert_eq!((found(80.0), found(200.0)), (found(40.0), found(40.0)));
    }

    #[test]
    fn finding_lasts_until_fixes_agree_as_long() {
        let mut drift = Drift::default();
        (0..100).for_each(|_| drift.take(((-300.0, 0.0), 40.0), 0.05, 0.0, WHEELS));
        assert!(drift.found());
        drift.take(((0.0, 0.0), 40.0), 0.05, 0.0, WHEELS);
        assert!(drift.found(), "one good fix is none");
        (0..30).for_each(|_| drift.take(((0.0, 0.0), 40.0), 0.05, 0.0, WHEELS));
        assert!(!drift.found());
    }
}
