//! The map: which topic and field of a recording feeds which input of the guards, in which unit.
//!
//! A TOML file, read with the place of each error. The reference is `docs/researcher/assess.md`. Values are converted in `track`.

mod value;

pub use value::{Axes, Dimension, Field, Frame, Stamp, StampUnit, Unit};

use scenario::{Problem, Problems};
use serde::Deserialize;
use toml::Spanned;

/// The largest map that is read, bytes.
pub const MAX_MAP: u64 = 64 * 1024;
/// Most corners of a fence.
const MAX_CORNERS: usize = 256;
/// Most modes with a name, and most strengths of one injection.
const MAX_LISTED: usize = 64;
/// Where the keys are described.
const REFERENCE: &str = "docs/researcher/assess.md lists the keys";

/// A map.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Map {
    /// One line for the result.
    pub title: String,
    /// Kind of vehicle.
    pub vehicle: Vehicle,
    /// Position.
    pub fix: FixMap,
    /// Speed and rate of turn.
    pub odometry: OdometryMap,
    /// Heading, where the fix has none.
    pub heading: Option<HeadingMap>,
    /// Flight mode.
    pub mode: Option<ModeMap>,
    /// Commanded speed.
    pub setpoint: Option<SetpointMap>,
    /// Fence.
    pub fence: Option<FenceMap>,
    /// Rules of judging.
    #[serde(default)]
    pub judge: Judge,
    /// Injections.
    #[serde(default)]
    pub inject: Inject,
}

/// Kind of vehicle, as far as the guards' model of motion is concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Vehicle {
    /// Wheels that do not slide: the model of the guards.
    Wheeled,
    /// Multirotor.
    Multirotor,
    /// Fixed wing, or a hybrid of it.
    FixedWing,
    /// Boat, walker, or unknown.
    Other,
}

/// `[fix]`: position, by `x` and `y` or by `latitude` and `longitude`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FixMap {
    /// Topic.
    pub topic: String,
    /// Name of its estimator; inputs of one name are not independent.
    pub source: String,
    /// Time of the fix on the recording's clock.
    pub stamp: Stamp,
    /// Axes of `x`, `y` and `yaw`.
    #[serde(default)]
    pub frame: Frame,
    /// First axis.
    pub x: Option<Spanned<Field>>,
    /// Second axis.
    pub y: Option<Spanned<Field>>,
    /// Latitude.
    pub latitude: Option<Spanned<Field>>,
    /// Longitude.
    pub longitude: Option<Spanned<Field>>,
    /// Heading by the same source.
    pub yaw: Option<Spanned<Field>>,
    /// One standard deviation of the position, as the source states it.
    pub sigma: Option<Spanned<Field>>,
    /// The receiver's own time.
    pub time: Option<Stamp>,
    /// Condition on which a message counts.
    pub valid: Option<Valid>,
}

/// A number from which on a message counts, such as a fix type of 3.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Valid {
    /// Path of the number.
    pub field: String,
    /// Least value.
    pub at_least: f64,
}

/// `[odometry]`: `speed` along the body axis, or `velocity` in the world's axes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OdometryMap {
    /// Topic.
    pub topic: String,
    /// Name of its estimator.
    pub source: String,
    /// Time of the sample.
    pub stamp: Stamp,
    /// Axes of `velocity` and sense of `yaw_rate`.
    #[serde(default)]
    pub frame: Frame,
    /// Forward speed.
    pub speed: Option<Spanned<Field>>,
    /// Speed to the left of the body axis, to tell how far the model fits.
    pub sideways: Option<Spanned<Field>>,
    /// Velocity along the first and second axis.
    pub velocity: Option<Axes>,
    /// Rate of turn; derived from the heading where absent.
    pub yaw_rate: Option<Spanned<Field>>,
}

/// `[heading]`: by `yaw` or by a `quaternion` in the order w, x, y, z.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeadingMap {
    /// Topic.
    pub topic: String,
    /// Name of its estimator.
    pub source: String,
    /// Time of the sample.
    pub stamp: Stamp,
    /// Axes.
    #[serde(default)]
    pub frame: Frame,
    /// Angle.
    pub yaw: Option<Spanned<Field>>,
    /// Paths of w, x, y and z, body to world.
    pub quaternion: Option<[String; 4]>,
}

/// `[mode]`: a number with a name for each value.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModeMap {
    /// Topic.
    pub topic: String,
    /// Time of the sample.
    pub stamp: Stamp,
    /// Path of the number.
    pub field: String,
    /// Names by value, such as `4 = "auto-loiter"`.
    #[serde(default)]
    pub names: std::collections::BTreeMap<String, String>,
    /// Only while in one of these is judged; all if empty.
    #[serde(default)]
    pub judged: Vec<String>,
}

/// `[setpoint]`: commanded speed.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SetpointMap {
    /// Topic.
    pub topic: String,
    /// Along the body axis.
    pub speed: Option<Spanned<Field>>,
    /// Along two axes.
    pub velocity: Option<Axes>,
}

/// `[fence]`: corners in metres east and north of the first fix, or on the fixes' own axes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FenceMap {
    /// Corners in order, three at least.
    pub corners: Spanned<Vec<[f64; 2]>>,
}

/// `[judge]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Judge {
    /// Time in failure after which the guards start anew, seconds; never if absent.
    pub restart_s: Option<Spanned<f64>>,
}

/// `[inject]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Inject {
    /// Placements of each injection.
    pub placements: Spanned<usize>,
    /// Length of each, and the longest time to notice it, seconds.
    pub window_s: Spanned<f64>,
    /// Speeds of the drift, metres per second.
    pub drift_m_s: Spanned<Vec<f64>>,
    /// Lengths of the jump, metres.
    pub jump_m: Spanned<Vec<f64>>,
    /// Delays, seconds.
    pub delay_s: Spanned<Vec<f64>>,
    /// Ages of the replayed stretch, seconds.
    pub replay_s: Spanned<Vec<f64>>,
}

impl Default for Inject {
    fn default() -> Self {
        fn own<T>(value: T) -> Spanned<T> {
            Spanned::new(0..0, value)
        }
        Self {
            placements: own(20),
            window_s: own(10.0),
            drift_m_s: own(vec![0.3, 1.0]),
            jump_m: own(vec![1.0, 5.0, 20.0]),
            delay_s: own(vec![0.5, 2.0]),
            replay_s: own(vec![10.0]),
        }
    }
}

impl Map {
    /// Reads a map and checks it by itself.
    ///
    /// # Errors
    /// Every problem found, with `file` as its name.
    pub fn parse(file: &str, text: &str) -> Result<Self, Problems> {
        let map: Self = toml::from_str(text).map_err(|error: toml::de::Error| {
            let message = error.message().trim().to_owned();
            match error.span() {
                Some(bytes) => Problem::at(file, text, bytes, message, REFERENCE),
                None => Problem::with_file(file, message, REFERENCE),
            }
        })?;
        let mut check = Check { file, text, problems: Vec::new() };
        map.check(&mut check);
        Problems::none_or(check.problems).map(|()| map)
    }

    fn check(&self, check: &mut Check<'_>) {
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
            (&fix.yaw, Dimension::Angle),
            (&fix.sigma, Dimension::Length),
        ] {
            check.dimension(field.as_ref(), dimension);
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
                check.at(corners, &format!("a fence has 3 to {MAX_CORNERS} corners within 1000 km"));
            }
        }
        if let Some(restart) = &self.judge.restart_s {
            check.range(restart, 0.1, 3600.0);
        }
        check.range(&self.inject.window_s, 1.0, 60.0);
        if !(1..=1000).contains(self.inject.placements.as_ref()) {
            check.at(&self.inject.placements, "out of range, expected 1 to 1000");
        }
        for (list, most) in [
            (&self.inject.drift_m_s, 100.0),
            (&self.inject.jump_m, 1e5),
            (&self.inject.delay_s, 60.0),
            (&self.inject.replay_s, 600.0),
        ] {
            let fine = |value: &f64| (1e-3..=most).contains(value);
            if list.as_ref().len() > MAX_LISTED || !list.as_ref().iter().all(fine) {
                check.at(list, &format!("expected at most {MAX_LISTED} numbers from 0.001 to {most}"));
            }
        }
    }
}

/// The problems found so far.
struct Check<'a> {
    file: &'a str,
    text: &'a str,
    problems: Vec<Problem>,
}

impl Check<'_> {
    fn whole(&mut self, message: &str) {
        self.problems.push(Problem::with_file(self.file, message, REFERENCE));
    }

    fn at<T>(&mut self, value: &Spanned<T>, message: &str) {
        self.problems.push(Problem::at(self.file, self.text, value.span(), message, REFERENCE));
    }

    fn range(&mut self, value: &Spanned<f64>, least: f64, most: f64) {
        if !(least..=most).contains(value.as_ref()) {
            self.at(value, &format!("{} is out of range, expected {least} to {most}", value.as_ref()));
        }
    }

    fn path(&mut self, path: &str) {
        if let Err(why) = path.parse::<crate::log::Path>() {
            self.whole(&why);
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

    fn dimension(&mut self, field: Option<&Spanned<Field>>, wanted: Dimension) {
        let Some(field) = field else { return };
        let got = field.as_ref().unit.dimension();
        if got != wanted {
            self.at(field, &format!("a unit of {got}, expected one of {wanted}: {}", Unit::of(wanted)));
        }
        if !field.as_ref().scale.is_finite() || field.as_ref().scale == 0.0 {
            self.at(field, "`scale` is a finite number other than 0");
        }
        if let Err(why) = field.as_ref().field.parse::<crate::log::Path>() {
            self.at(field, &why);
        }
    }

    fn axes(&mut self, axes: Option<&Axes>) {
        for field in axes.iter().flat_map(|axes| [&axes.x, &axes.y]) {
            self.dimension(Some(field), Dimension::Speed);
        }
    }
}
