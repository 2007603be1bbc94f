//! The checks of a map by itself: units, ranges, and keys that need or exclude each other.

use scenario::{Problem, Problems};
use toml::Spanned;

use super::{Axes, Dimension, Field, Map, REFERENCE, Stamp, StampUnit, Unit};

/// Most corners of a fence.
const MAX_CORNERS: usize = 256;
/// Most modes with a name, and most strengths of one injection.
const MAX_LISTED: usize = 64;
/// Longest lever, metres.
const MAX_LEVER_M: f64 = 50.0;

impl Map {
    pub(super) fn check(&self, check: &mut Check<'_>) {
        self.check_fix(check);
        let odometry = &self.odometry;
        check.stamp(&odometry.stamp);
        check.dimension(odometry.speed.as_ref(), Dimension::Speed);
        check.dimension(odometry.sideways.as_ref(), Dimension::Speed);
        check.dimension(odometry.yaw_rate.as_ref(), Dimension::Rate);
        check.axes(odometry.velocity.as_ref());
        let heading = self.heading.is_some() || self.fix.yaw.is_some();
        match (odometry.speed.is_some(), odometry.velocity.is_some()) {
            (true, false) => {}
            (false, true) if heading => {}
            (false, true) => check.whole("[odometry] has `velocity` and there is no heading: add [heading]"),
            _ => check.whole("[odometry] has either `speed` or `velocity`"),
        }
        if odometry.yaw_rate.is_none() && !heading {
            check.whole("[odometry] has no `yaw_rate` and there is no heading to derive it from: add one");
        }
        if !heading {
            check.whole("neither [fix] `yaw` nor [heading]: the guards compare the heading of fixes");
        }
        if let Some(heading) = &self.heading {
            check.stamp(&heading.stamp);
            check.dimension(heading.yaw.as_ref(), Dimension::Angle);
            heading.quaternion.iter().flatten().for_each(|path| check.path(path));
            if heading.yaw.is_some() == heading.quaternion.is_some() {
                check.whole("[heading] has either `yaw` or `quaternion`");
            }
        }
        self.check_rest(check);
    }

    fn check_fix(&self, check: &mut Check<'_>) {
        let fix = &self.fix;
        check.stamp(&fix.stamp);
        fix.time.iter().for_each(|time| check.stamp(time));
        for (field, dimension) in [
            (&fix.x, Dimension::Length),
            (&fix.y, Dimension::Length),
            (&fix.latitude, Dimension::Angle),
            (&fix.longitude, Dimension::Angle),
            (&fix.height, Dimension::Length),
            (&fix.yaw, Dimension::Angle),
        ] {
            check.dimension(field.as_ref(), dimension);
        }
        check.deviation(fix.sigma.as_ref());
        if let Some(lever) = &fix.lever_m
            && !lever.as_ref().iter().all(|m| m.abs() <= MAX_LEVER_M)
        {
            check.report_at(
                lever,
                &format!("a lever is [ahead, left], each within {MAX_LEVER_M} m of the rear axle's middle"),
            );
        }
        fix.valid.iter().for_each(|valid| check.path(&valid.field));
        let local = (fix.x.is_some(), fix.y.is_some());
        let global = (fix.latitude.is_some(), fix.longitude.is_some());
        if !matches!((local, global), ((true, true), (false, false)) | ((false, false), (true, true))) {
            check.whole("[fix] has either `x` and `y` or `latitude` and `longitude`");
        }
        if fix.yaw.is_some() && self.heading.is_some() {
            check.whole("[fix] `yaw` and [heading] both give the heading: leave one out");
        }
    }

    fn check_rest(&self, check: &mut Check<'_>) {
        if let Some(mode) = &self.mode {
            check.stamp(&mode.stamp);
            check.path(&mode.field);
            let unknown = mode.judged.iter().find(|name| !mode.names.values().any(|known| known == *name));
            if let Some(name) = unknown {
                check.whole(&format!("[mode] `judged` has `{name}`, which `names` does not"));
            }
            if mode.names.len() > MAX_LISTED {
                check.whole(&format!("[mode] names at most {MAX_LISTED} modes"));
            }
        }
        if let Some(setpoint) = &self.setpoint {
            check.dimension(setpoint.speed.as_ref(), Dimension::Speed);
            check.axes(setpoint.velocity.as_ref());
            if setpoint.speed.is_some() == setpoint.velocity.is_some() {
                check.whole("[setpoint] has either `speed` or `velocity`");
            }
        }
        if let Some(corners) = self.fence.as_ref().map(|fence| &fence.corners) {
            let fine = |corner: &[f64; 2]| corner.iter().all(|m| m.abs() <= 1e6);
            let listed = (3..=MAX_CORNERS).contains(&corners.as_ref().len());
            if !listed || !corners.as_ref().iter().all(fine) {
                check.report_at(corners, &format!("a fence has 3 to {MAX_CORNERS} corners within 1000 km"));
            }
        }
        if let Some(restart) = &self.judge.restart_s {
            check.range(restart, 0.1, 3600.0);
        }
        check.range(&self.inject.window_s, 1.0, 60.0);
        if !(1..=1000).contains(self.inject.placements.as_ref()) {
            check.report_at(&self.inject.placements, "out of range, expected 1 to 1000");
        }
        for (list, most) in [
            (&self.inject.drift_m_s, 100.0),
            (&self.inject.jump_m, 1e5),
            (&self.inject.delay_s, 60.0),
            (&self.inject.replay_s, 600.0),
        ] {
            let fine = |value: &f64| (1e-3..=most).contains(value);
            if list.as_ref().len() > MAX_LISTED || !list.as_ref().iter().all(fine) {
                check.report_at(list, &format!("expected at most {MAX_LISTED} numbers from 0.001 to {most}"));
            }
        }
    }
}

/// The problems found so far.
pub(super) struct Check<'a> {
    file: &'a str,
    text: &'a str,
    problems: Vec<Problem>,
}

impl<'a> Check<'a> {
    pub(super) fn new(file: &'a str, text: &'a str) -> Self {
        Self { file, text, problems: Vec::new() }
    }

    pub(super) fn end(self) -> Result<(), Problems> {
        Problems::none_or(self.problems)
    }

    fn whole(&mut self, message: &str) {
        self.problems.push(Problem::with_file(self.file, message, REFERENCE));
    }

    fn report_at<T>(&mut self, value: &Spanned<T>, message: &str) {
        self.problems.push(Problem::new(self.file, self.text, value.span(), message, REFERENCE));
    }

    fn range(&mut self, value: &Spanned<f64>, least: f64, most: f64) {
        if !(least..=most).contains(value.as_ref()) {
            self.report_at(value, &format!("{} is out of range, expected {least} to {most}", value.as_ref()));
        }
    }

    fn path(&mut self, path: &str) {
        if let Err(error) = path.parse::<crate::log::Path>() {
            self.whole(&error.to_string());
        }
    }

    fn stamp(&mut self, stamp: &Stamp) {
        match (&stamp.field, stamp.unit) {
            (None, StampUnit::Log) => {}
            (Some(field), unit) if unit != StampUnit::Log => self.path(field),
            (Some(_), _) => self.whole("a stamp with the unit `log` has no `field`: it is the recorder's time"),
            (None, _) => self.whole("a stamp has a `field`, unless its unit is `log`"),
        }
    }

    /// A deviation, or its square.
    fn deviation(&mut self, field: Option<&Spanned<Field>>) {
        let square = field.is_some_and(|field| field.as_ref().unit.dimension() == Dimension::Variance);
        self.dimension(field, if square { Dimension::Variance } else { Dimension::Length });
    }

    fn dimension(&mut self, field: Option<&Spanned<Field>>, wanted: Dimension) {
        let Some(field) = field else { return };
        let got = field.as_ref().unit.dimension();
        if got != wanted {
            self.report_at(field, &format!("a unit of {got}, expected one of {wanted}: {}", Unit::names_for(wanted)));
        }
        if !field.as_ref().scale.is_finite() || field.as_ref().scale == 0.0 {
            self.report_at(field, "`scale` is a finite number other than 0");
        }
        if let Err(error) = field.as_ref().field.parse::<crate::log::Path>() {
            self.report_at(field, &error.to_string());
        }
    }

    fn axes(&mut self, axes: Option<&Axes>) {
        for field in axes.iter().flat_map(|axes| [&axes.x, &axes.y]) {
            self.dimension(Some(field), Dimension::Speed);
        }
    }
}
