//! The guards over a recording: the product's own localisation and geofence, run at the platform's control period.
//!
//! No test is repeated here: `autonomy::localisation` and `autonomy::geofence` are handed readings and asked for their findings, as
//! the unit's own cycle does. Judging begins once fix and odometry are both there, after the start and after each restart.

use autonomy::geofence::Geofence;
use autonomy::localisation::Localisation;
use wire::bounds::Bounds;
use wire::mode::{Because, Guards as GuardSet};
use wire::platform::Limits;
use wire::policy::Waived;
use wire::sensor::{Fix, Navigation, Pose, ReceiverTime};
use wire::time::{Instant, Span};

use crate::falsify::Placed;
use crate::fix::Place;
use crate::track::Step;

/// A test of a guard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Check {
    /// Localisation: fix or odometry is older than the platform's limit.
    Silence,
    /// Localisation: a fix lies beyond the gate around odometry, or has another heading.
    Gate,
    /// Fixes drift away from odometry.
    Drift,
    /// The receiver's time does not run with the recorder's clock.
    TimeBase,
    /// The place, or the place after braking, is outside the fence or within its margin.
    Geofence,
}

impl Check {
    /// Every test, in the order of the results.
    pub const ALL: [Check; 5] = [Check::Silence, Check::Gate, Check::Drift, Check::TimeBase, Check::Geofence];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Check::Silence => "silence",
            Check::Gate => "gate",
            Check::Drift => "drift",
            Check::TimeBase => "time base",
            Check::Geofence => "geofence",
        }
    }
}

/// The tests that fail at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Failing(u8);

impl Failing {
    pub(crate) fn has(self, check: Check) -> bool {
        self.0 & (1 << check as u8) != 0
    }

    pub(crate) fn any(self) -> bool {
        self.0 != 0
    }

    fn with(self, check: Check, failing: bool) -> Self {
        Self(if failing { self.0 | 1 << check as u8 } else { self.0 })
    }
}

/// The guards at a moment of the recording.
#[derive(Clone, Debug)]
pub(crate) struct Guards<'a> {
    localisation: Localisation,
    fence: Option<&'a Geofence>,
    bounds: Bounds,
    /// Time in failure after which localisation starts anew.
    restart: Option<Span>,
    next: usize,
    ready: bool,
    failing_since: Option<Instant>,
    /// Number of restarts.
    pub(crate) restarts: u64,
}

impl<'a> Guards<'a> {
    pub(crate) fn new(bounds: &Bounds, fence: Option<&'a Geofence>, restart: Option<Span>) -> Self {
        Self {
            localisation: Localisation::new(Limits::GROUND, GuardSet::default()),
            fence,
            bounds: *bounds,
            restart,
            next: 0,
            ready: false,
            failing_since: None,
            restarts: 0,
        }
    }

    /// Takes the readings up to `now`, changed as `placed` says, and judges; none while there is not yet a fix and odometry.
    pub(crate) fn tick(&mut self, now: Instant, steps: &[Step], placed: Option<&Placed<'_>>) -> Option<Failing> {
        while let Some(step) = steps.get(self.next).filter(|step| step.stamp <= now) {
            self.next += 1;
            let fix = step.fix.and_then(|fix| placed.map_or(Some(fix), |placed| placed.alter(step.stamp, fix)));
            let reading = Navigation {
                stamp: step.stamp,
                fix: fix.map(|fix| as_read(&fix, step.stamp)),
                odometry: step.odometry,
                spatial: None,
            };
            // A message with neither would say no more than silence does.
            if reading.fix.is_some() || reading.odometry.is_some() {
                self.localisation.take(&reading, Waived::default());
            }
        }
        let lost = self.localisation.lost(now, self.bounds.product_limit());
        self.ready |= lost.is_none();
        if !self.ready {
            return None;
        }
        let localised = Failing::default()
            .with(Check::Silence, matches!(lost, Some(Because::Silence(_))))
            .with(Check::Gate, matches!(lost, Some(Because::Itself)))
            .with(Check::Drift, self.localisation.drifts().is_some())
            .with(Check::TimeBase, self.localisation.mistimed().is_some());
        let motion = self.localisation.motion();
        let breached =
            self.fence.zip(motion).and_then(|(fence, motion)| fence.breached(&motion, &self.bounds, &Limits::GROUND));
        self.restart_after(now, localised.any());
        Some(localised.with(Check::Geofence, breached.is_some()))
    }

    fn restart_after(&mut self, now: Instant, failing: bool) {
        self.failing_since = if failing { self.failing_since.or(Some(now)) } else { None };
        let due = self.failing_since.zip(self.restart).is_some_and(|(since, after)| now.since(since) >= after);
        if due {
            self.localisation = Localisation::new(Limits::GROUND, GuardSet::default());
            (self.ready, self.failing_since) = (false, None);
            self.restarts += 1;
        }
    }
}

/// A fix as the unit reads it: integers on the wire. Without a receiver's time of its own, the stamp stands for it.
fn as_read(fix: &Place, stamp: Instant) -> Fix {
    let mm = |metres: f64| libm::round(metres * 1000.0) as i32;
    let yaw_mrad = libm::round(autonomy::localisation::wrap(fix.yaw) * 1000.0) as i16;
    let sigma_mm = libm::round(fix.sigma_m * 1000.0).min(f64::from(u16::MAX)) as u16;
    let time = ReceiverTime(fix.time.unwrap_or(stamp.0));
    Fix { pose: Pose { x_mm: mm(fix.east), y_mm: mm(fix.north), yaw_mrad }, sigma_mm, time }
}
