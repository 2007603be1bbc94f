//! Localisation, held against odometry.
//!
//! Two estimates are carried forward by odometry between fixes. The *pose* follows fixes closely; the unit drives and
//! reports by it. The *anchor* follows them slowly: a fix that jumps, or drifts faster than wheels can explain, runs
//! away from it. Three tests, each its own guard:
//!
//! - the *gate*: the newest fix lies within reach of the anchor (with silence, [`Guard::Localisation`]);
//! - the *drift* test: fixes do not lie to one side of it for long ([`Guard::Drift`], `drift`);
//! - the *receiver's time* runs with this host's clock ([`Guard::TimeBase`], `receiver`).
//!
//! While one of them fails, no fix is used: pose and anchor use odometry alone, and only fixes that agree again end
//! that. A fix beyond the gate is the gate's: the drift test is for those no single one of which is off, and passes it
//! over. So a false position cannot make itself true by staying in place, and a flagged one is not driven by. A test
//! that the policy waives still reports its findings, and keeps no fix out.
//!
//! Odometry that repeats its last reading while the unit moves gives no new one: noise of the wheels differs from
//! reading to reading. Where that is reported ([`Localisation::telling_repeats`]), it counts as silent once it has
//! lasted. A reading faster than the body can go ([`Localisation::at_most`]) is none either.
//!
//! A unit that flies has a height on top (`height`).
//!
//! World frame, millimetres and radians. The consequence of a loss is left to `transition`.

mod drift;
mod height;
mod receiver;

use config::platform::Limits;
use wire::measured::Measured;
use wire::mode::{Because, Guard, Guards};
use wire::motion::{ReportedMotion, Spatial};
use wire::policy::Waived;
use wire::sensor::{Fix, Navigation, Odometry, Pose};
use wire::time::{Instant, Span};

use crate::consistency::CLAIMABLE_SPEED;
use crate::geofence::{Motion, Point, distance};
use drift::Drift;
use height::Height;
use receiver::Receiver;

/// Deviations of the fix that are added to the gate.
const SIGMAS: f64 = 4.0;
/// A disagreement ends within this share of the gate, so that noise does not make it flicker.
const RETURN: f64 = 0.7;
/// Time over which the anchor follows fixes, seconds.
const ANCHOR_S: f64 = 4.0;
/// Share of a fix's difference that the pose takes over at once.
const POSE_GAIN: f64 = 0.3;

/// Fixes and odometry, and whether they agree.
#[derive(Clone, Debug, Default)]
pub struct Localisation {
    newest: Option<Instant>,
    fix: Option<Instant>,
    odometry: Option<(Instant, Odometry)>,
    /// Time and content of the last odometry that moved the estimates.
    moved_by: Option<(Instant, Previous)>,
    /// True if an odometry reading is the mean since the reading before, and not the value at its stamp.
    of_means: bool,
    /// The newest odometry, also where it repeats the one before.
    heard: Option<Odometry>,
    /// Time after which repeated odometry counts as silent; absent: repetition is not judged.
    repeats: Option<Span>,
    /// True if odometry has repeated itself for that long.
    stale: bool,
    /// Greatest credible speed of odometry, mm/s; absent: no limit.
    fastest: Option<f64>,
    /// True if the newest odometry exceeds that speed.
    impossible: bool,
    track: Option<Estimates>,
    disagrees: bool,
    drift: Drift,
    receiver: Receiver,
    /// Height of a unit that flies.
    height: Option<Height>,
    /// Speed to the left of a unit that leaves the ground, by the newest reading, mm/s.
    slides: Option<f64>,
    spatial: Option<Spatial>,
    limits: Limits,
    /// Tests that the policy waives.
    passed_over: Guards,
    waived: Waived,
}

/// Odometry of the last movement.
#[derive(Clone, Copy, Debug)]
struct Previous {
    odometry: Odometry,
    /// Speed to the left of a unit that leaves the ground, mm/s.
    left: Option<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Estimates {
    pose: Estimate,
    anchor: Estimate,
    /// Longest distance that the unit may have gone without odometry, millimetres.
    unobserved: f64,
    /// Time for which the anchor has followed fixes, seconds; until it has done so for its time constant, it is their
    /// mean.
    followed: f64,
}

#[derive(Clone, Copy, Debug)]
struct Estimate {
    at: Point,
    yaw: f64,
}

impl Localisation {
    /// Localisation under the platform's limits; `passed_over` are the tests that the policy waives.
    pub fn new(limits: Limits, passed_over: Guards) -> Self {
        let height = limits.aloft.as_ref().map(Height::new);
        Localisation { limits, passed_over, height, ..Localisation::default() }
    }

    /// Localisation that takes odometry as silent once it has repeated one reading for `limit`. For odometry with its
    /// own noise; readings without any repeat honestly.
    #[must_use]
    pub fn telling_repeats(self, limit: Span) -> Self {
        Localisation { repeats: Some(limit), ..self }
    }

    /// Localisation that takes odometry as silent while it says that the unit goes faster than its largest speed and a
    /// quarter, mm/s. For the readings of a known body.
    #[must_use]
    pub fn at_most(self, max_speed_mm_s: u32) -> Self {
        Localisation { fastest: Some(f64::from(max_speed_mm_s) * CLAIMABLE_SPEED), ..self }
    }

    /// Localisation that takes readings of odometry taken for means of the time since the reading before, in place of
    /// values at their moment.
    #[must_use]
    pub fn of_means(self) -> Self {
        Localisation { of_means: true, ..self }
    }

    /// True unless odometry only repeats itself, or says a speed that cannot be.
    pub fn hears_odometry(&self) -> bool {
        !self.stale && !self.impossible
    }

    /// Takes an accepted reading; `waived` says which checks it passed by waiver.
    pub fn take(&mut self, reading: &Navigation, waived: Waived) {
        let elapsed = self.newest.map_or(0.0, |newest| seconds(reading.stamp.since(newest)));
        // The trapezoidal rule needs a reading at both ends of the interval: after a gap, and for odometry that is a
        // mean, the newest reading counts alone.
        let adjacent = |(time, _): &(Instant, Previous)| Some(*time) == self.newest && !self.of_means;
        let before = self.moved_by.filter(adjacent).map(|(_, previous)| previous);
        self.newest = Some(reading.stamp);
        self.waived = waived;
        if let Some(spatial) = &reading.spatial {
            self.slides = spatial.left_up_mm_s.map(|[left, _]| f64::from(left)).or(self.slides);
            self.spatial = Some(*spatial);
        }
        if let (Some(height), Some(spatial)) = (&mut self.height, &reading.spatial) {
            height.take(spatial, reading.stamp, elapsed);
        }
        let repeated = self.repeats_itself(reading);
        self.impossible = reading.odometry.is_some_and(|odometry| self.outruns_the_body(&odometry));
        let used = reading.odometry.filter(|_| self.hears_odometry());
        self.advance(used, elapsed, before);
        let left = self.slides;
        self.moved_by = used.map(|odometry| (reading.stamp, Previous { odometry, left }));
        if let Some(odometry) = reading.odometry.filter(|_| !repeated && !self.impossible) {
            self.odometry = Some((reading.stamp, odometry));
        }
        if let Some(fix) = reading.fix {
            self.fix = Some(reading.stamp);
            self.receiver.take(reading.stamp, fix.time);
            self.correct(&fix, elapsed);
        }
    }

    /// Age of the older of fix and odometry, sum of the drift, and offset of the receiver's time.
    pub fn measure(&self, measured: Measured, now: Instant) -> Measured {
        let oldest = self.fix.zip(self.odometry).map(|(fix, (odometry, _))| fix.min(odometry));
        measured
            .aged(Guard::Localisation, oldest.map(|oldest| now.since(oldest)))
            .with_value(Guard::Drift, self.fix.map(|_| self.drift.sum()))
            .with_value(Guard::TimeBase, self.receiver.time_error())
    }

    /// Finding of the drift test on the fixes.
    pub fn drifts(&self) -> Option<Because> {
        self.drift.found().then_some(Because::Itself)
    }

    /// Finding of the receiver's time on the fixes.
    pub fn mistimed(&self) -> Option<Because> {
        self.receiver.disagrees().then_some(Because::Itself)
    }

    /// True if fixes are kept out: a test fails that the policy does not waive.
    pub fn distrusted(&self) -> bool {
        let is_followed = |guard: Guard| !self.passed_over.contains(guard);
        self.disagrees
            || self.drift.found() && is_followed(Guard::Drift)
            || self.receiver.disagrees() && is_followed(Guard::TimeBase)
    }

    /// Reason that localisation fails, if it does: silence of a source for more than `limit`, or disagreement of the
    /// two.
    pub fn lost(&self, now: Instant, limit: Span) -> Option<Because> {
        let sources = [self.fix, self.odometry.map(|(time, _)| time)];
        let oldest = sources.into_iter().map(Option::unwrap_or_default).min().unwrap_or_default();
        if now.since(oldest) > limit || self.track.is_none() {
            Some(Because::Silence(oldest))
        } else if self.disagrees {
            Some(Because::Itself)
        } else {
            self.height.as_ref().and_then(|height| height.lost(now, limit))
        }
    }

    /// Place and motion of the unit, as far as known; absent before the first fix.
    pub fn motion(&self) -> Option<Motion> {
        let Estimates { pose, .. } = self.track?;
        Some(Motion { at: pose.at, yaw: pose.yaw, speed: self.speed() })
    }

    /// The pose for others to read, and the age of the fix behind it; absent before the first fix.
    pub fn reported(&self, now: Instant) -> Option<(Pose, Span)> {
        let (Estimates { pose, .. }, fix) = (self.track?, self.fix?);
        let yaw_mrad = libm::round(wrap(pose.yaw) * 1000.0) as i16;
        Some((Pose { x_mm: pose.at.0 as i32, y_mm: pose.at.1 as i32, yaw_mrad }, now.since(fix)))
    }

    /// Forward speed by the newest odometry, mm/s.
    pub fn speed(&self) -> f64 {
        self.odometry.map_or(0.0, |(_, odometry)| f64::from(odometry.speed_mm_s))
    }

    /// Height of a unit that flies, millimetres; absent before the first reading of it.
    pub fn height(&self) -> Option<f64> {
        self.height.as_ref()?.estimate()
    }

    /// Height, velocity, charge and attitude of a unit that leaves the ground, as it reports them.
    pub fn flight(&self) -> Option<ReportedMotion> {
        let Spatial { fix_up_mm, left_up_mm_s, charge, attitude, sunlit, .. } = self.spatial?;
        let estimate = self.height().map(|height| height.round() as i64);
        let (up_mm, left_up_mm_s) = (estimate.or(fix_up_mm)?, left_up_mm_s.unwrap_or_default());
        Some(ReportedMotion { up_mm, left_up_mm_s, charge: charge.unwrap_or_default(), attitude, sunlit })
    }

    /// Checks that were waived on the way of the newest reading.
    pub fn waived(&self) -> Waived {
        self.waived
    }

    /// True if odometry gives its last reading again, which wheels that turn do not, or at rest none; notes for how
    /// long.
    fn repeats_itself(&mut self, reading: &Navigation) -> bool {
        let moves = |odometry: &Odometry| (odometry.speed_mm_s, odometry.yaw_rate_mrad_s) != (0, 0);
        let repeated = self.repeats.is_some() && reading.odometry.filter(moves).is_some_and(|o| self.heard == Some(o));
        self.heard = reading.odometry.or(self.heard);
        let lasts =
            |(time, _): (Instant, Odometry)| self.repeats.is_some_and(|limit| reading.stamp.since(time) >= limit);
        self.stale = repeated && self.odometry.is_some_and(lasts);
        repeated
    }

    fn outruns_the_body(&self, odometry: &Odometry) -> bool {
        self.fastest.is_some_and(|fastest| f64::from(odometry.speed_mm_s).abs() > fastest)
    }

    /// Moves both estimates by the mean of this reading of odometry and the one before (the trapezoidal rule), or by
    /// this one alone where there is none before: at the end of a turn the heading would then be off by half of the
    /// last reading.
    fn advance(&mut self, odometry: Option<Odometry>, elapsed: f64, before: Option<Previous>) {
        let reach = self.speed().abs() * elapsed;
        let left_before = before.and_then(|before| before.left);
        let slides = self.slides.map(|now| (left_before.unwrap_or(now) + now) / 2.0);
        let Limits { rear_axle_mm, unobserved_mm, .. } = self.limits;
        let Some(estimates) = &mut self.track else { return };
        match odometry {
            Some(odometry) => {
                let before = before.map_or(odometry, |before| before.odometry);
                let mean = |a: i32, b: i32| (f64::from(a) + f64::from(b)) / 2.0;
                let speed = mean(before.speed_mm_s, odometry.speed_mm_s);
                let rate = mean(before.yaw_rate_mrad_s.into(), odometry.yaw_rate_mrad_s.into()) / 1000.0;
                let left = slides.unwrap_or(f64::from(rear_axle_mm) * rate) * elapsed;
                estimates.pose.move_on((speed * elapsed, left), rate, elapsed);
                estimates.anchor.move_on((speed * elapsed, left), rate, elapsed);
            }
            None => estimates.unobserved = (estimates.unobserved + reach).min(f64::from(unobserved_mm)),
        }
    }

    fn correct(&mut self, fix: &Fix, elapsed: f64) {
        let pose = &fix.pose;
        let seen =
            Estimate { at: (f64::from(pose.x_mm), f64::from(pose.y_mm)), yaw: f64::from(pose.yaw_mrad) / 1000.0 };
        let Some(Estimates { anchor, unobserved, .. }) = self.track else {
            // The first fix is taken as it is: there is nothing yet to hold it against, so a false position before the
            // start is not detected here.
            self.track = Some(Estimates { pose: seen, anchor: seen, unobserved: 0.0, followed: 0.0 });
            return;
        };
        self.disagrees = beyond_gate(&self.limits, (&seen, &anchor), fix.sigma_mm, unobserved, self.disagrees);
        let sigma_mm = believed(&self.limits, fix.sigma_mm);
        let innovation = (seen.at.0 - anchor.at.0, seen.at.1 - anchor.at.1);
        let share = f64::from(self.limits.odometry_permille) / 1000.0;
        if self.disagrees {
            self.drift.pass(elapsed, self.speed());
        } else {
            self.drift.take((innovation, sigma_mm), elapsed, self.speed(), (share, unobserved));
        }
        let usable = !self.distrusted();
        if let Some(estimates) = self.track.as_mut().filter(|_| usable) {
            let share = estimates.follow(&seen, elapsed);
            self.drift.forget(share);
        }
    }
}

/// The deviation that a fix states, millimetres, as far as the platform believes it.
fn believed(limits: &Limits, sigma_mm: u16) -> f64 {
    f64::from(u32::from(sigma_mm).min(limits.fix_sigma_mm))
}

/// True if a fix lies further from the anchor than wheels and terrain can explain.
fn beyond_gate(
    limits: &Limits,
    (seen, anchor): (&Estimate, &Estimate),
    sigma_mm: u16,
    unobserved: f64,
    before: bool,
) -> bool {
    let gate = f64::from(limits.fix_gate_mm) + SIGMAS * believed(limits, sigma_mm) + unobserved;
    let share = if before { RETURN } else { 1.0 };
    let turned = wrap(seen.yaw - anchor.yaw).abs();
    distance(seen.at, anchor.at) > gate * share || turned > f64::from(limits.yaw_gate_mrad) / 1000.0 * share
}

impl Estimates {
    /// Lets a trusted fix correct both. Gives the share of it that the anchor took over.
    fn follow(&mut self, seen: &Estimate, elapsed: f64) -> f64 {
        // After a way without odometry neither estimate knows better than the fix, so the pose takes the fix over and
        // the anchor begins a new mean. The gate was widened by that way.
        let regained = self.unobserved > 0.0;
        self.followed = if regained { 0.0 } else { (self.followed + elapsed).min(ANCHOR_S) };
        let share = if self.followed > 0.0 { elapsed / (self.followed + elapsed).min(ANCHOR_S) } else { 1.0 };
        let share = share.min(1.0);
        self.unobserved = 0.0;
        self.anchor.approach(seen, share);
        self.pose.approach(seen, if regained { 1.0 } else { POSE_GAIN });
        share
    }
}

impl Estimate {
    /// Moves by `(ahead, left)` millimetres while it turns at `rate` rad/s for `elapsed` seconds.
    fn move_on(&mut self, (ahead, left): (f64, f64), rate: f64, elapsed: f64) {
        let yaw = self.yaw + rate * elapsed / 2.0;
        let (sin, cos) = libm::sincos(yaw);
        self.at.0 += ahead * cos - left * sin;
        self.at.1 += ahead * sin + left * cos;
        self.yaw = wrap(self.yaw + rate * elapsed);
    }

    fn approach(&mut self, seen: &Estimate, gain: f64) {
        self.at.0 += gain * (seen.at.0 - self.at.0);
        self.at.1 += gain * (seen.at.1 - self.at.1);
        self.yaw = wrap(self.yaw + gain * wrap(seen.yaw - self.yaw));
    }
}

/// An angle brought into (−π, π].
pub fn wrap(angle: f64) -> f64 {
    let turns = libm::ceil(angle / core::f64::consts::TAU - 0.5);
    angle - turns * core::f64::consts::TAU
}

fn seconds(span: Span) -> f64 {
    span.0 as f64 / 1e6
}

#[cfg(test)]
mod tests {
    use wire::sensor::ReceiverTime;

    use super::*;

    const LIMIT: Span = Span::ms(300);

    /// Drives east at 2 m/s for `n` readings from `from`, 20 a second, with the fix displaced by `offset(seconds)`.
    fn drive(localisation: &mut Localisation, from: u64, n: u64, offset: impl Fn(f64) -> f64) -> Instant {
        for i in from..from + n {
            let t = i as f64 * 0.05;
            let pose = Pose { x_mm: (2000.0 * t) as i32, y_mm: offset(t) as i32, yaw_mrad: 0 };
            let odometry = Some(Odometry { speed_mm_s: 2000, yaw_rate_mrad_s: 0 });
            let fix = Some(Fix { pose, sigma_mm: 40, time: ReceiverTime(instant(i).0) });
            localisation.take(&Navigation { stamp: instant(i), fix, odometry, spatial: None }, Waived::default());
        }
        instant(from + n - 1)
    }

    fn instant(i: u64) -> Instant {
        Instant(1_000_000 + i * 50_000)
    }

    #[test]
    fn jump_loses_localisation_and_never_heals_itself() {
        let mut localisation = Localisation::default();
        let now = drive(&mut localisation, 0, 60, |_| 0.0);
        assert_eq!(localisation.lost(now, LIMIT), None);
        let now = drive(&mut localisation, 60, 1, |_| 2000.0);
        assert_eq!(localisation.lost(now, LIMIT), Some(Because::Itself));
        let now = drive(&mut localisation, 61, 400, |_| 2000.0);
        assert_eq!(localisation.lost(now, LIMIT), Some(Because::Itself), "still, 20 s later");
        let now = drive(&mut localisation, 461, 1, |_| 0.0);
        assert_eq!(localisation.lost(now, LIMIT), None, "the true fix is taken again");
    }

    #[test]
    fn a_drift_that_wheels_cannot_explain_is_found() {
        let mut localisation = Localisation::default();
        drive(&mut localisation, 0, 60, |_| 0.0);
        let now = drive(&mut localisation, 60, 10, |t| (t - 3.0) * 300.0);
        assert_eq!(localisation.drifts(), None, "not yet more than noise");
        drive(&mut localisation, 70, 90, |t| (t - 3.0) * 300.0);
        assert_eq!((localisation.drifts(), localisation.distrusted()), (Some(Because::Itself), true), "{now:?}");
    }

    #[test]
    fn flagged_fixes_move_the_pose_only_when_waived() {
        let strayed = |passed_over: Guards| {
            let mut localisation = Localisation::new(Limits::GROUND, passed_over);
            drive(&mut localisation, 0, 60, |_| 0.0);
            drive(&mut localisation, 60, 400, |t| (t - 3.0) * 100.0);
            assert!(localisation.drifts().is_some());
            localisation.motion().unwrap().at.1
        };
        let deviation = strayed(Guards::default());
        assert!(deviation < 400.0, "{deviation}");
        let followed = strayed(Guards::default().with_guard(Guard::Drift));
        assert!(followed > 1800.0, "{followed}");
    }

    /// A single fix beyond the gate does not enter the drift test.
    #[test]
    fn single_outlier_is_forgotten_with_the_next_fix() {
        let mut localisation = Localisation::default();
        drive(&mut localisation, 0, 200, |_| 0.0);
        drive(&mut localisation, 200, 1, |_| 11_000.0);
        assert!(localisation.distrusted());
        let now = drive(&mut localisation, 201, 1, |_| 0.0);
        assert_eq!((localisation.lost(now, LIMIT), localisation.drifts()), (None, None));
    }

    #[test]
    fn odometry_that_repeats_itself_in_motion_is_silent() {
        let read = |localisation: &mut Localisation, i: u64, odometry: (i32, i16)| {
            let pose = Pose { x_mm: 2000 * i as i32 / 20, y_mm: 0, yaw_mrad: 0 };
            let fix = Some(Fix { pose, sigma_mm: 40, time: ReceiverTime(instant(i).0) });
            let (speed_mm_s, yaw_rate_mrad_s) = odometry;
            let odometry = Some(Odometry { speed_mm_s, yaw_rate_mrad_s });
            localisation.take(&Navigation { stamp: instant(i), fix, odometry, spatial: None }, Waived::default());
        };
        let after = |odometry: fn(i32) -> (i32, i16), repeats: bool| {
            let localisation = Localisation::default();
            let mut localisation = if repeats { localisation.telling_repeats(LIMIT) } else { localisation };
            (0..20).for_each(|i| read(&mut localisation, i, (2000 + i as i32, 0)));
            (20..30).for_each(|i| read(&mut localisation, i, odometry(i as i32)));
            (matches!(localisation.lost(instant(29), LIMIT), Some(Because::Silence(_))), localisation.hears_odometry())
        };
        assert_eq!(after(|_| (2019, 0), true), (true, false), "repeated for half a second");
        assert_eq!(after(|_| (2019, 0), false), (false, true), "not told there");
        assert_eq!(after(|i| (2000 + i % 2, 0), true), (false, true), "noise of the wheels");
        assert_eq!(after(|_| (0, 0), true), (false, true), "wheels at rest");
    }

    /// A single reading above the body's speed has no effect; fixes and the next reading go on.
    #[test]
    fn odometry_faster_than_the_body_is_silent() {
        let after = |readings: u64, speed_mm_s: i32| {
            let mut localisation = Localisation::default().at_most(2000);
            drive(&mut localisation, 0, 60, |_| 0.0);
            for i in 60..60 + readings {
                let pose = Pose { x_mm: 2000 * i as i32 / 20, y_mm: 0, yaw_mrad: 0 };
                let fix = Some(Fix { pose, sigma_mm: 40, time: ReceiverTime(instant(i).0) });
                let odometry = Some(Odometry { speed_mm_s, yaw_rate_mrad_s: 0 });
                localisation.take(&Navigation { stamp: instant(i), fix, odometry, spatial: None }, Waived::default());
            }
            let lost = localisation.lost(instant(59 + readings), LIMIT);
            (lost, localisation.hears_odometry(), localisation.distrusted())
        };
        assert_eq!(after(1, 60_000), (None, false, false));
        assert_eq!(after(7, 60_000), (Some(Because::Silence(instant(59))), false, false));
        assert_eq!(after(7, 2500), (None, true, false), "within a quarter");
    }

    #[test]
    fn silence_of_either_source_is_a_loss() {
        let mut localisation = Localisation::default();
        let now = drive(&mut localisation, 0, 3, |_| 0.0);
        let blind = Navigation {
            stamp: now + Span::ms(301),
            fix: None,
            odometry: Some(Odometry { speed_mm_s: 2000, yaw_rate_mrad_s: 0 }),
            spatial: None,
        };
        localisation.take(&blind, Waived::default());
        assert_eq!(localisation.lost(now + Span::ms(301), LIMIT), Some(Because::Silence(now)));
    }
}
