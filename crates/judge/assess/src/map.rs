//! The map: which topic and field of a recording feeds which input of the guards, in which unit.
//!
//! A TOML file, read with the place of each error. The reference is `docs/researcher/assess.md`. Values are converted in `track`.

mod check;
mod value;

pub use value::{Axes, Dimension, Field, Frame, Stamp, StampUnit, Unit};

use check::Check;
use scenario::{Problem, Problems};
use serde::Deserialize;
use toml::Spanned;

/// The largest map that is read, bytes.
pub const MAX_MAP: u64 = 64 * 1024;
/// Page that describes the keys.
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
    /// Height, above any level: a scenario of a body that flies needs it, and no guard is handed it.
    pub height: Option<Spanned<Field>>,
    /// Heading by the same source.
    pub yaw: Option<Spanned<Field>>,
    /// One standard deviation of the position, as the source states it; in `m2`, its variance.
    pub sigma: Option<Spanned<Field>>,
    /// Place of the receiver, metres ahead and to the left of the rear axle's middle; estimated where absent.
    pub lever_m: Option<Spanned<[f64; 2]>>,
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
    /// Time in failure after which the guards start again, seconds; never if absent.
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
        fn unlocated<T>(value: T) -> Spanned<T> {
            Spanned::new(0..0, value)
        }
        Self {
            placements: unlocated(20),
            window_s: unlocated(10.0),
            drift_m_s: unlocated(vec![0.3, 1.0]),
            jump_m: unlocated(vec![1.0, 5.0, 20.0]),
            delay_s: unlocated(vec![0.5, 2.0]),
            replay_s: unlocated(vec![10.0]),
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
                Some(bytes) => Problem::new(file, text, bytes, message, REFERENCE),
                None => Problem::with_file(file, message, REFERENCE),
            }
        })?;
        let mut check = Check::new(file, text);
        map.check(&mut check);
        check.end().map(|()| map)
    }
}
