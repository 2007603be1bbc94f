//! Place at which the unit takes itself to be, against the true one.
//!
//! Two witnesses: the sim's truth, and the place that autonomy says it drives by. Sim and autonomy share a host, so their stamps compare.

use evidence::{Evidence, Micros};
use ground_truth::{Any, Note};
use wire::event::Event;
use wire::time::Instant;

/// East and north, millimetres.
pub(crate) type Place = (f64, f64);

/// Deviation of an undisturbed fix on each axis, millimetres.
pub(crate) const FIX_MM: f64 = 40.0;
/// Error of a fix without a fault, at most, in deviations: the sim's noise is bounded there.
pub(crate) const FIX_BOUND: f64 = 6.0;
/// Truth is known between two entries that are no further apart than this, microseconds.
const GAP_US: u64 = 250_000;
/// Time for which the unit's statement of its place counts: it makes a few a second.
const STATED_FOR_US: u64 = 500_000;

/// The pose that autonomy drives by when it saw a fix.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StatedPose {
    /// Time of the entry.
    pub at: Micros,
    /// Time of the fix, by the vehicle's host.
    pub stamp: Instant,
    /// Place at which the unit takes itself to be.
    pub pose: Place,
    /// True if the unit does not use the fix.
    pub distrusted: bool,
}

/// Poses that the unit under test stated, in order.
pub(crate) fn stated_poses(evidence: &Evidence) -> Vec<StatedPose> {
    let of_unit = evidence.entries.iter().filter(|w| w.entry.node == evidence.under.node());
    of_unit
        .filter_map(|w| match w.entry.event {
            Any::Service(Event::Located { stamp, pose_x_mm, pose_y_mm, distrusted, .. }) => {
                Some(StatedPose { at: w.at, stamp, pose: (f64::from(pose_x_mm), f64::from(pose_y_mm)), distrusted })
            }
            _ => None,
        })
        .collect()
}

/// Values at instants of the vehicle's host, in order, read in between.
pub(crate) struct Series<const N: usize>(Vec<(Instant, [f64; N])>);

impl<const N: usize> Series<N> {
    /// The last value from no later than `instant`; `None` in a gap.
    pub(crate) fn last_before(&self, instant: Instant) -> Option<[f64; N]> {
        let (t, value) = self.0.get(self.0.partition_point(|(t, _)| *t <= instant).checked_sub(1)?)?;
        (instant.since(*t).0 <= GAP_US).then_some(*value)
    }

    fn from_sim(evidence: &Evidence, pick: impl Fn(&Any, Instant) -> Option<(Instant, [f64; N])>) -> Self {
        let of_sim = evidence.entries.iter().filter(|w| w.entry.node == evidence.under.sim);
        let mut values: Vec<_> = of_sim.filter_map(|w| pick(&w.entry.event, w.entry.at)).collect();
        values.sort_by_key(|(instant, _)| *instant);
        Series(values)
    }

    /// The value at `instant`; `None` outside, and in a gap.
    pub(crate) fn value_at(&self, instant: Instant) -> Option<[f64; N]> {
        let after = self.0.partition_point(|(t, _)| *t < instant);
        let (t1, b) = self.0.get(after)?;
        if *t1 == instant {
            return Some(*b);
        }
        let (t0, a) = self.0.get(after.checked_sub(1)?)?;
        let gap = t1.since(*t0).0;
        let share = instant.since(*t0).0 as f64 / gap.max(1) as f64;
        (gap <= GAP_US).then(|| std::array::from_fn(|k| a[k] + share * (b[k] - a[k])))
    }
}

/// The true place of the unit under test.
pub(crate) fn true_places(evidence: &Evidence) -> Series<2> {
    Series::from_sim(evidence, |event, instant| match *event {
        Any::Instrument(Note::Truth { unit, x_mm, y_mm, .. }) if unit == evidence.under.unit => {
            Some((instant, [f64::from(x_mm), f64::from(y_mm)]))
        }
        _ => None,
    })
}

pub(crate) fn minus(a: Place, b: Place) -> Place {
    (a.0 - b.0, a.1 - b.1)
}

pub(crate) fn length(a: Place) -> f64 {
    a.0.hypot(a.1)
}

/// Distance of the unit from the place at which it took itself to be, millimetres, by its last word on that before `time`; none if that
/// is too old, or if the true place is not known.
pub(crate) fn place_error_at(evidence: &Evidence, time: Micros) -> Option<f64> {
    let stated = stated_poses(evidence).into_iter().rev().find(|s| s.at <= time && time - s.at <= STATED_FOR_US)?;
    let [x, y] = true_places(evidence).value_at(stated.stamp)?;
    Some(length(minus(stated.pose, (x, y))))
}
