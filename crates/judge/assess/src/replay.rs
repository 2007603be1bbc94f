//! The guards over a recording: the product's own localisation and geofence, run at the platform's control period.
//!
//! No test is repeated here: `autonomy::localisation` and `autonomy::geofence` are handed readings and asked for their findings, as
//! the unit's own cycle does. Judging begins once fix and odometry are both there, after the start and after each restart. The guards know the place of the body's origin, half of a wheelbase ahead of the rear axle: a fix is moved
//! there from the receiver's own place, by the lever and the heading.

use autonomy::geofence::Geofence;
use autonomy::localisation::Localisation;
use config::platform::Limits;
use wire::bounds::Bounds;
use wire::mode::{Because, Guards as GuardSet};
use wire::motion::Spatial;
use wire::policy::Waived;
use wire::sensor::{Fix, Navigation, Pose, ReceiverTime};
use wire::time::{Instant, Span};

use crate::Terms;
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
    pub(crate) fn contains(self, check: Check) -> bool {
        self.0 & (1 << check as u8) != 0
    }

    pub(crate) fn any(self) -> bool {
        self.0 != 0
    }

    fn with_check(self, check: Check, failing: bool) -> Self {
        Self(if failing { self.0 | 1 << check as u8 } else { self.0 })
    }
}

/// The guards at a moment of the recording.
#[derive(Clone, Debug)]
pub(crate) struct Guards<'a> {
    localisation: Localisation,
    fence: Option<&'a Geofence>,
    bounds: Bounds,
    limits: Limits,
    /// Offset from the receiver to the body's origin, millimetres ahead and to the left.
    mount: (f64, f64),
    /// Pauses between parts: the end of one, and the beginning of the next.
    pauses: &'a [(Instant, Instant)],
    /// Time in failure after which localisation starts again.
    restart: Option<Span>,
    next: usize,
    ready: bool,
    failing_since: Option<Instant>,
    /// Number of restarts.
    pub(crate) restarts: u64,
}

/// Offset from a receiver at this lever to the body's origin, millimetres ahead and to the left.
pub(crate) fn mount(limits: &Limits, lever_m: [f64; 2]) -> (f64, f64) {
    let [ahead, left] = lever_m.map(|metres| metres * 1000.0);
    (f64::from(limits.rear_axle_mm) - ahead, -left)
}

impl<'a> Guards<'a> {
    /// Guards of a platform, for a receiver `lever_m` metres ahead and to the left of the rear axle's middle.
    pub(crate) fn new(
        terms: &Terms,
        lever_m: [f64; 2],
        fence: Option<&'a Geofence>,
        restart: Option<Span>,
        pauses: &'a [(Instant, Instant)],
    ) -> Self {
        // A recording has no heights that the guards could be handed.
        let limits = Limits { aloft: None, ..terms.limits };
        Self {
            // `track::steps` gives the mean of odometry since the reading before.
            localisation: Localisation::new(limits, GuardSet::default()).of_means(),
            fence,
            bounds: terms.bounds,
            limits,
            mount: mount(&limits, lever_m),
            pauses,
            restart,
            next: 0,
            ready: false,
            failing_since: None,
            restarts: 0,
        }
    }

    /// Takes the readings up to `now`, changed as `placed` says, and judges; none until there was a fix and odometry.
    pub(crate) fn tick(&mut self, now: Instant, steps: &[Step], placed: Option<&Placed<'_>>) -> Option<Failing> {
        if self.pauses(now) {
            self.restart();
            self.next += steps.get(self.next..).map_or(0, |rest| rest.partition_point(|step| step.stamp <= now));
            return None;
        }
        while let Some(step) = steps.get(self.next).filter(|step| step.stamp <= now) {
            self.next += 1;
            let fix = step.fix.and_then(|fix| placed.map_or(Some(fix), |placed| placed.alter(step.stamp, fix)));
            // A body without wheels has a speed to the left beside the one ahead.
            let left = step.left_mm_s.filter(|_| self.limits.free);
            let reading = Navigation {
                stamp: step.stamp,
                fix: fix.map(|fix| self.as_read(&fix, step.stamp)),
                odometry: step.odometry,
                spatial: left.map(|left| Spatial { left_up_mm_s: Some([left, 0]), ..Spatial::default() }),
            };
            // Autonomy takes no reading without fix and odometry: their absence must count as silence.
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
            .with_check(Check::Silence, matches!(lost, Some(Because::Silence(_))))
            .with_check(Check::Gate, matches!(lost, Some(Because::Itself)))
            .with_check(Check::Drift, self.localisation.drifts().is_some())
            .with_check(Check::TimeBase, self.localisation.mistimed().is_some());
        let motion = self.localisation.motion();
        let breached =
            self.fence.zip(motion).and_then(|(fence, motion)| fence.breached(&motion, &self.bounds, &self.limits));
        self.restart_after(now, localised.any());
        Some(localised.with_check(Check::Geofence, breached.is_some()))
    }

    fn restart_after(&mut self, now: Instant, failing: bool) {
        self.failing_since = if failing { self.failing_since.or(Some(now)) } else { None };
        let due = self.failing_since.zip(self.restart).is_some_and(|(since, after)| now.since(since) >= after);
        if due {
            self.restart();
            self.restarts += 1;
        }
    }

    /// True between two parts of the recording.
    fn pauses(&self, now: Instant) -> bool {
        let next = self.pauses.partition_point(|(end, _)| *end < now);
        next.checked_sub(1).is_some_and(|last| now < self.pauses[last].1)
    }

    fn restart(&mut self) {
        self.localisation = Localisation::new(self.limits, GuardSet::default()).of_means();
        (self.ready, self.failing_since) = (false, None);
    }

    /// A fix as the unit reads it: the place of the body's origin, integers on the wire. Without the receiver's time, the stamp
    /// represents it.
    fn as_read(&self, fix: &Place, stamp: Instant) -> Fix {
        let (sin, cos) = libm::sincos(fix.yaw);
        let (ahead, left) = self.mount;
        let mm = |metres: f64, more: f64| libm::round(metres * 1000.0 + more) as i32;
        let yaw_mrad = libm::round(autonomy::localisation::wrap(fix.yaw) * 1000.0) as i16;
        let sigma_mm = libm::round(fix.sigma_m * 1000.0).min(f64::from(u16::MAX)) as u16;
        let time = ReceiverTime(fix.time.unwrap_or(stamp.0));
        let (x_mm, y_mm) = (mm(fix.east, ahead * cos - left * sin), mm(fix.north, ahead * sin + left * cos));
        Fix { pose: Pose { x_mm, y_mm, yaw_mrad }, sigma_mm, time }
    }
}
