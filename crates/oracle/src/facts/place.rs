//! Place at which the unit takes itself to be, against the true one.
//!
//! Two witnesses: the sim's truth, and the place that autonomy says it drives by. Sim and autonomy share a host, so their stamps compare.

use evidence::{Evidence, Finding, Micros, Property};
use instrument::{Any, Note, Sensor};
use wire::event::Event;
use wire::mode::Mode;
use wire::time::Instant;

use crate::finding;
use crate::speed::OVERSPEED;
use crate::timeline::Timeline;

/// East and north, millimetres.
pub(crate) type Place = (f64, f64);

/// Deviation of an undisturbed fix on each axis, millimetres.
pub(crate) const FIX_MM: f64 = 40.0;
/// A fix is never off by more than so many deviations without a fault: the sim's noise is bounded there.
pub(crate) const BOUNDED: f64 = 6.0;
/// Truth is known between two entries that are no further apart than this, microseconds.
const GAP_US: u64 = 250_000;
/// Time for which the unit's word on its place counts: it says so a few times a second.
const SAID_US: u64 = 500_000;
/// Error that odometry may have while fixes are not used: millimetres, a share of the way, and mm/s however slowly the
/// unit goes: wheels that hold it on a slope were seen to turn by 1 to 2 mm/s.
const ODOMETRY: (f64, f64, f64) = (100.0, 0.05, 5.0);

/// The pose that autonomy drives by when it saw a fix.
#[derive(Clone, Copy, Debug)]
struct Sight {
    at: Micros,
    stamp: Instant,
    pose: Place,
    distrusted: bool,
}

fn sights(evidence: &Evidence) -> Vec<Sight> {
    let of_unit = evidence.entries.iter().filter(|w| w.entry.node == evidence.under.node());
    of_unit
        .filter_map(|w| match w.entry.event {
            Any::Service(Event::Located { stamp, pose_x_mm, pose_y_mm, distrusted, .. }) => {
                Some(Sight { at: w.at, stamp, pose: (f64::from(pose_x_mm), f64::from(pose_y_mm)), distrusted })
            }
            _ => None,
        })
        .collect()
}

/// Values at instants of the vehicle's host, in order, read in between.
pub(crate) struct Series<const N: usize>(Vec<(Instant, [f64; N])>);

impl<const N: usize> Series<N> {
    /// The last value from no later than `at`; `None` in a gap.
    pub(crate) fn before(&self, at: Instant) -> Option<[f64; N]> {
        let (t, value) = self.0.get(self.0.partition_point(|(t, _)| *t <= at).checked_sub(1)?)?;
        (at.since(*t).0 <= GAP_US).then_some(*value)
    }

    fn of(evidence: &Evidence, pick: impl Fn(&Any, Instant) -> Option<(Instant, [f64; N])>) -> Self {
        let of_sim = evidence.entries.iter().filter(|w| w.entry.node == evidence.under.sim);
        let mut values: Vec<_> = of_sim.filter_map(|w| pick(&w.entry.event, w.entry.at)).collect();
        values.sort_by_key(|(at, _)| *at);
        Series(values)
    }

    /// The value at `at`; `None` outside, and in a gap.
    fn at(&self, at: Instant) -> Option<[f64; N]> {
        let after = self.0.partition_point(|(t, _)| *t < at);
        let (t1, b) = self.0.get(after)?;
        if *t1 == at {
            return Some(*b);
        }
        let (t0, a) = self.0.get(after.checked_sub(1)?)?;
        let gap = t1.since(*t0).0;
        let share = at.since(*t0).0 as f64 / gap.max(1) as f64;
        (gap <= GAP_US).then(|| std::array::from_fn(|k| a[k] + share * (b[k] - a[k])))
    }
}

/// The true place of the unit under test.
pub(crate) fn truth(evidence: &Evidence) -> Series<2> {
    Series::of(evidence, |event, at| match *event {
        Any::Instrument(Note::Truth { unit, x_mm, y_mm, .. }) if unit == evidence.under.unit => {
            Some((at, [f64::from(x_mm), f64::from(y_mm)]))
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

/// Judges the unit's idea of its place.
pub(crate) fn check(evidence: &Evidence, line: &Timeline) -> Vec<Finding> {
    let (sights, truth) = (sights(evidence), truth(evidence));
    let mut found = Vec::new();
    found.extend(lost_unnoticed(evidence, line, &sights, &truth));
    found.extend(flagged_and_used(evidence, &sights, &truth));
    found
}

/// P3: the fence margin allows for a distance of the unit from the place at which it takes itself to be. Beyond that for *Th*,
/// it has to hold.
fn lost_unnoticed(evidence: &Evidence, line: &Timeline, sights: &[Sight], truth: &Series<2>) -> Option<Finding> {
    let th = evidence.bounds.to_hold_safe_ms * 1000;
    let margin = f64::from(evidence.bounds.fence_margin_mm);
    let mut since: Option<Micros> = None;
    for s in sights {
        let Some([x, y]) = truth.at(s.stamp) else { continue };
        let off = length(minus(s.pose, (x, y)));
        since = (off > margin).then_some(since.unwrap_or(s.at));
        let mode = line.mode_at(s.at);
        if since.is_some_and(|since| s.at - since > th) && !matches!(mode, Mode::HoldSafe | Mode::Idle) {
            let what = format!("{off:.0} mm from where it takes itself to be for {} ms and {}", th / 1000, mode.name());
            return Some(finding(Property::P3, s.at, what));
        }
    }
    None
}

/// Distance of the unit from the place at which it took itself to be, millimetres, by its last word on that before `at`; none if that
/// is too old, or if the true place is not known.
pub(crate) fn off_at(evidence: &Evidence, at: Micros) -> Option<f64> {
    let said = sights(evidence).into_iter().rev().find(|s| s.at <= at && at - s.at <= SAID_US)?;
    let [x, y] = truth(evidence).at(said.stamp)?;
    Some(length(minus(said.pose, (x, y))))
}

/// Times at which odometry had a fault.
fn without_odometry(evidence: &Evidence) -> Vec<(Micros, Micros)> {
    let mut spans: Vec<(Micros, Micros)> = Vec::new();
    for w in &evidence.entries {
        match w.entry.event {
            Any::Instrument(Note::Fault { sensor: Sensor::Odometry, active: true, .. }) => {
                spans.push((w.at, Micros::MAX))
            }
            Any::Instrument(Note::Fault { sensor: Sensor::Odometry, active: false, .. }) => {
                spans.iter_mut().for_each(|(_, to)| *to = w.at.min(*to));
            }
            _ => {}
        }
    }
    spans
}

/// P5: fixes that the unit says it distrusts do not move its pose; only odometry moves it then, which goes as the unit
/// goes. While odometry has a fault of its own the pose may lag behind by all that the unit can go.
fn flagged_and_used(evidence: &Evidence, sights: &[Sight], truth: &Series<2>) -> Option<Finding> {
    let blind = without_odometry(evidence);
    let mut flagged: Option<(Micros, Place, Place)> = None;
    // A unit that goes round comes back to its place after a long way.
    let (mut way, mut last) = (0.0, (0.0, 0.0));
    for s in sights {
        let Some([x, y]) = truth.at(s.stamp) else { continue };
        if !s.distrusted {
            flagged = None;
            continue;
        }
        if flagged.is_none() {
            (way, last) = (0.0, (x, y));
        }
        let (since, pose, place) = *flagged.get_or_insert((s.at, s.pose, (x, y)));
        way += length(minus((x, y), last));
        last = (x, y);
        let (moved, went) = (minus(s.pose, pose), minus((x, y), place));
        let off = length(minus(moved, went));
        let lasted = (s.at - since) as f64 / 1e6;
        let overlap = |(from, to): &(Micros, Micros)| s.at.min(*to).saturating_sub(since.max(*from)) as f64 / 1e6;
        let fastest = f64::from(evidence.bounds.max_speed_mm_s) + f64::from(OVERSPEED);
        let unseen = blind.iter().map(overlap).sum::<f64>() * fastest;
        let allowed = ODOMETRY.0 + ODOMETRY.1 * way + ODOMETRY.2 * lasted + unseen;
        if length(moved) > ODOMETRY.0 && off > allowed {
            let what = format!("a pose moved by {off:.0} mm under fixes that the unit distrusts");
            return Some(finding(Property::P5, s.at, what));
        }
    }
    None
}
