//! From a recording and its map to the readings that the guards take: fixes, odometry, modes, set-points.
//!
//! World frame: metres east and north, of the first fix where the recording has latitude and longitude, else of the fixes' own zero. A
//! reading is made at each fix, with the mean of odometry since the reading before; where fixes fail to come for longer than the platform's
//! limit, readings with odometry alone go on at its control period. Numbers between samples are interpolated.

use wire::sensor::Odometry;
use wire::time::Instant;

use crate::columns::{Columns, in_order};
use crate::curve::Curve;
use crate::fix::{self, Place};
use crate::log::{Log, LogError};
use crate::map::{Axes, Frame, HeadingMap, Map, OdometryMap};

/// Most control periods from first to last reading: 24 h at 20 Hz, and room.
const MAX_PERIODS: u64 = 2_000_000;
/// The oldest heading that a fix or a velocity is given, microseconds.
const HEADING_US: u64 = 1_000_000;

/// The inputs cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum TrackError {
    /// A topic or field is missing.
    #[error(transparent)]
    Log(#[from] LogError),
    /// No message gives the input.
    #[error("topic `{topic}` gives no {input}: {got} messages, none with a time and finite numbers{valid}")]
    Empty {
        /// Name.
        topic: String,
        /// Input.
        input: &'static str,
        /// Messages.
        got: usize,
        /// The condition that the map states, in words.
        valid: &'static str,
    },
    /// Fix and odometry have no time in common.
    #[error(
        "fixes from {} to {} s and odometry from {} to {} s have no time in common: are both stamps of one clock?",
        fix.0 / 1_000_000, fix.1 / 1_000_000, odometry.0 / 1_000_000, odometry.1 / 1_000_000
    )]
    Apart {
        /// First and last fix, microseconds.
        fix: (u64, u64),
        /// First and last odometry, microseconds.
        odometry: (u64, u64),
    },
    /// It is longer than is judged.
    #[error(
        "stamps from {from_s} to {to_s} s, at most {MAX_PERIODS} control periods are judged: is a stamp's unit right?"
    )]
    Long {
        /// First, seconds.
        from_s: u64,
        /// Last, seconds.
        to_s: u64,
    },
}

/// A reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Step {
    pub(crate) stamp: Instant,
    pub(crate) fix: Option<Place>,
    pub(crate) odometry: Option<Odometry>,
}

/// The readings of a recording and facts about them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Track {
    pub(crate) steps: Vec<Step>,
    /// Time of the last reading or sample.
    pub(crate) end: Instant,
    /// Modes by the time from which on they hold.
    pub(crate) modes: Vec<(u64, String)>,
    pub(crate) facts: Facts,
}

/// Facts that tell how far the guards' model fits.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Facts {
    /// Fixes that were used.
    pub fixes: u64,
    /// Fixes that were not: invalid, not finite, without a heading, or with a stamp that does not increase.
    pub fixes_unused: u64,
    /// Median time between fixes, seconds.
    pub fix_period_s: f64,
    /// Samples of odometry.
    pub odometry: u64,
    /// Median time between them, seconds.
    pub odometry_period_s: f64,
    /// Median of the deviation that fixes state, metres.
    pub sigma_m: Option<f64>,
    /// Way by odometry, metres.
    pub way_m: f64,
    /// Way sideways to the body axis, metres; absent where the map does not give it.
    pub sideways_m: Option<f64>,
    /// Highest speed along the body axis, m/s.
    pub speed_m_s: f64,
    /// Set-points, and those above the platform's highest speed.
    pub setpoints: Option<(u64, u64)>,
}

/// Odometry as curves over time.
struct Motion {
    speed: Curve,
    sideways: Option<Curve>,
    rate: Option<Curve>,
}

/// Makes the readings.
///
/// # Errors
/// When the recording lacks an input that the map names.
pub(crate) fn track(log: &Log<'_>, map: &Map, bounds: &wire::bounds::Bounds) -> Result<Track, TrackError> {
    let heading = map.heading.as_ref().map(|map| heading(log, map)).transpose()?;
    let fixes = fix::read(log, &map.fix, heading.as_ref(), HEADING_US)?;
    let turning = heading.unwrap_or_else(|| unwrapped(fixes.kept.iter().map(|(at, fix)| (*at, fix.yaw))));
    let (motion, odometry) = motion(log, &map.odometry, &turning)?;
    let ends = motion.speed.ends().unwrap_or_default();
    let (first, last) = (fixes.kept[0].0, fixes.kept[fixes.kept.len() - 1].0);
    if ends.0 > last || ends.1 < first {
        return Err(TrackError::Apart { fix: (first, last), odometry: ends });
    }
    let end = last.max(ends.1);
    if (end - first) / (bounds.control_period_ms.max(1) * 1000) > MAX_PERIODS {
        return Err(TrackError::Long { from_s: first / 1_000_000, to_s: end / 1_000_000 });
    }
    let mut facts = Facts { fixes: fixes.kept.len() as u64, fixes_unused: fixes.unused, ..odometry };
    facts.fix_period_s = median(fixes.kept.windows(2).map(|two| (two[1].0 - two[0].0) as f64 / 1e6)).unwrap_or(0.0);
    facts.sigma_m = map.fix.sigma.as_ref().and_then(|_| median(fixes.kept.iter().map(|(_, fix)| fix.sigma_m)));
    if let Some(setpoint) = &map.setpoint {
        let speeds = setpoints(log, setpoint)?;
        let most = f64::from(bounds.max_speed_mm_s) / 1000.0;
        facts.setpoints = Some((speeds.len() as u64, speeds.iter().filter(|speed| **speed > most).count() as u64));
    }
    let steps = steps(&fixes.kept, &motion, &turning, bounds, end);
    Ok(Track { steps, end: Instant(end), modes: modes(log, map)?, facts })
}

/// The readings: at each fix, and in gaps between fixes.
fn steps(
    fixes: &[(u64, Place)],
    motion: &Motion,
    turning: &Curve,
    bounds: &wire::bounds::Bounds,
    end: u64,
) -> Vec<Step> {
    let (limit, period) = (bounds.product_limit().0, bounds.control_period_ms.max(1) * 1000);
    let odometry = |from: u64, to: u64| {
        motion.speed.age(to).filter(|age| *age <= limit)?;
        let rate = match &motion.rate {
            Some(rate) => rate.mean(from, to),
            None => (turning.value(to) - turning.value(from)) / ((to - from).max(1) as f64 / 1e6),
        };
        let mm_s = libm::round(motion.speed.mean(from, to) * 1000.0).clamp(-1e9, 1e9) as i32;
        let mrad_s = libm::round(rate * 1000.0).clamp(f64::from(i16::MIN), f64::from(i16::MAX)) as i16;
        Some(Odometry { speed_mm_s: mm_s, yaw_rate_mrad_s: mrad_s })
    };
    let mut steps: Vec<Step> = Vec::with_capacity(fixes.len());
    let mut before = fixes.first().map_or(0, |(at, _)| *at);
    for (i, (at, fix)) in fixes.iter().enumerate() {
        steps.push(Step { stamp: Instant(*at), fix: Some(*fix), odometry: odometry(before, *at) });
        before = *at;
        let next = fixes.get(i + 1).map_or(end + 1, |(next, _)| *next);
        while next - before > period && next - at > limit {
            let to = if before == *at { (before + limit).min(next - 1) } else { before + period };
            steps.push(Step { stamp: Instant(to), fix: None, odometry: odometry(before, to) });
            before = to;
        }
    }
    steps
}

fn heading(log: &Log<'_>, map: &HeadingMap) -> Result<Curve, TrackError> {
    let mut columns = Columns::of(log, &map.topic);
    let clock = columns.stamp(&map.stamp)?;
    let yaw = columns.optional(map.yaw.as_ref())?;
    let parts = map.quaternion.iter().flatten().map(|path| columns.plain(path)).collect::<Result<Vec<_>, _>>()?;
    let rows = columns.rows()?;
    let angle = |row| match (yaw, parts.as_slice()) {
        (Some(yaw), _) => yaw.read(row),
        (None, [w, x, y, z]) => {
            let (w, x, y, z) = (w.read(row)?, x.read(row)?, y.read(row)?, z.read(row)?);
            Some(libm::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))
        }
        (None, _) => None,
    };
    let samples = rows.iter().filter_map(|row| Some((clock.read(row)?, east_based(map.frame, angle(row)?))));
    let (samples, _) = in_order(samples);
    match samples.is_empty() {
        true => Err(TrackError::Empty { topic: map.topic.clone(), input: "heading", got: rows.len(), valid: "" }),
        false => Ok(unwrapped(samples)),
    }
}

/// An angle of this frame as one counter-clockwise from east.
pub(crate) fn east_based(frame: Frame, angle: f64) -> f64 {
    match frame {
        Frame::Enu => angle,
        Frame::Ned => core::f64::consts::FRAC_PI_2 - angle,
    }
}

/// Angles without jumps of a whole turn.
fn unwrapped(samples: impl IntoIterator<Item = (u64, f64)>) -> Curve {
    let mut last: Option<f64> = None;
    Curve::of(samples.into_iter().map(|(at, angle)| {
        let angle = last.map_or(angle, |last| last + autonomy::localisation::wrap(angle - last));
        last = Some(angle);
        (at, angle)
    }))
}

fn motion(log: &Log<'_>, map: &OdometryMap, turning: &Curve) -> Result<(Motion, Facts), TrackError> {
    let mut columns = Columns::of(log, &map.topic);
    let clock = columns.stamp(&map.stamp)?;
    let (speed, sideways) = (columns.optional(map.speed.as_ref())?, columns.optional(map.sideways.as_ref())?);
    let velocity = map.velocity.as_ref().map(|axes| two(&mut columns, axes)).transpose()?;
    let rate = columns.optional(map.yaw_rate.as_ref())?;
    let rows = columns.rows()?;
    let along = |row, at| match (speed, velocity) {
        (Some(speed), _) => Some((speed.read(row)?, sideways.and_then(|sideways| sideways.read(row)))),
        (None, Some((x, y))) => {
            turning.age(at).filter(|age| *age <= HEADING_US)?;
            let (x, y) = (x.read(row)?, y.read(row)?);
            let (east, north) = if map.frame == Frame::Ned { (y, x) } else { (x, y) };
            let (sin, cos) = libm::sincos(turning.value(at));
            Some((east * cos + north * sin, Some(north * cos - east * sin)))
        }
        (None, None) => None,
    };
    let turn = if map.frame == Frame::Ned { -1.0 } else { 1.0 };
    let samples = rows.iter().filter_map(|row| {
        let at = clock.read(row)?;
        let (speed, sideways) = along(row, at)?;
        let rate = rate.map(|rate| rate.read(row)).map_or(Some(0.0), |rate| rate.map(|rate| rate * turn))?;
        Some((at, (speed, sideways, rate)))
    });
    let (samples, _) = in_order(samples);
    if samples.is_empty() {
        return Err(TrackError::Empty { topic: map.topic.clone(), input: "odometry", got: rows.len(), valid: "" });
    }
    let motion = Motion {
        speed: Curve::of(samples.iter().map(|(at, (speed, ..))| (*at, *speed))),
        sideways: samples
            .iter()
            .map(|(at, (_, sideways, _))| Some((*at, (*sideways)?.abs())))
            .collect::<Option<Vec<_>>>()
            .map(Curve::of),
        rate: rate.map(|_| Curve::of(samples.iter().map(|(at, (.., rate))| (*at, *rate)))),
    };
    let way = |curve: &Curve| curve.ends().map_or(0.0, |(from, to)| curve.mean(from, to) * (to - from) as f64 / 1e6);
    let facts = Facts {
        odometry: samples.len() as u64,
        odometry_period_s: median(samples.windows(2).map(|two| (two[1].0 - two[0].0) as f64 / 1e6)).unwrap_or(0.0),
        way_m: way(&Curve::of(samples.iter().map(|(at, (speed, ..))| (*at, speed.abs())))),
        sideways_m: motion.sideways.as_ref().map(way),
        speed_m_s: samples.iter().fold(0.0, |most, (_, (speed, ..))| speed.abs().max(most)),
        ..Facts::default()
    };
    Ok((motion, facts))
}

fn two(columns: &mut Columns<'_>, axes: &Axes) -> Result<(crate::columns::Column, crate::columns::Column), LogError> {
    Ok((columns.field(axes.x.as_ref())?, columns.field(axes.y.as_ref())?))
}

fn modes(log: &Log<'_>, map: &Map) -> Result<Vec<(u64, String)>, TrackError> {
    let Some(map) = &map.mode else { return Ok(Vec::new()) };
    let mut columns = Columns::of(log, &map.topic);
    let (clock, value) = (columns.stamp(&map.stamp)?, columns.plain(&map.field)?);
    let rows = columns.rows()?;
    let name = |value: f64| map.names.get(&value.to_string()).cloned().unwrap_or_else(|| value.to_string());
    let samples = rows.iter().filter_map(|row| Some((clock.read(row)?, value.read(row)?)));
    let (mut samples, _) = in_order(samples);
    samples.dedup_by(|later, earlier| later.1 == earlier.1);
    Ok(samples.into_iter().map(|(at, value)| (at, name(value))).collect())
}

fn setpoints(log: &Log<'_>, map: &crate::map::SetpointMap) -> Result<Vec<f64>, TrackError> {
    let mut columns = Columns::of(log, &map.topic);
    let speed = columns.optional(map.speed.as_ref())?;
    let velocity = map.velocity.as_ref().map(|axes| two(&mut columns, axes)).transpose()?;
    let rows = columns.rows()?;
    let read = |row| match (speed, velocity) {
        (Some(speed), _) => speed.read(row).map(f64::abs),
        (None, Some((x, y))) => Some(libm::hypot(x.read(row)?, y.read(row)?)),
        (None, None) => None,
    };
    Ok(rows.iter().filter_map(read).collect())
}

/// The upper of the two in the middle of an even number.
fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
