//! Heading and odometry of one stretch of a recording, as curves.

use crate::columns::{Clock, Column, Columns, in_order};
use crate::curve::Curve;
use crate::facts::Facts;
use crate::fix::east_based;
use crate::log::{Log, LogError, MessageRow};
use crate::map::{Axes, Frame, HeadingMap, OdometryMap};
use crate::parts::Timed;

/// The oldest heading that a fix or a velocity is given, microseconds.
pub(crate) const HEADING_US: u64 = 1_000_000;

/// The questions to the topic of the heading.
pub(crate) struct HeadingColumns {
    frame: Frame,
    yaw: Option<Column>,
    parts: Vec<Column>,
}

/// The questions to the topic of odometry.
pub(crate) struct MotionColumns {
    frame: Frame,
    speed: Option<Column>,
    sideways: Option<Column>,
    velocity: Option<(Column, Column)>,
    rate: Option<Column>,
}

/// Odometry as curves.
#[derive(Clone, Debug, Default)]
pub(crate) struct Motion {
    pub(crate) speed: Curve,
    /// Speed to the left.
    pub(crate) left: Option<Curve>,
    pub(crate) rate: Option<Curve>,
    /// Samples, those that were not used, median time between them, ways, highest speed.
    pub(crate) facts: Facts,
}

/// Asks for the heading.
pub(crate) fn heading(log: &Log<'_>, map: &HeadingMap) -> Result<(HeadingColumns, Timed), LogError> {
    let mut columns = Columns::new(log, &map.topic);
    let clock = columns.stamp(&map.stamp)?;
    let yaw = columns.optional(map.yaw.as_ref())?;
    let parts = map.quaternion.iter().flatten().map(|path| columns.plain(path)).collect::<Result<Vec<_>, _>>()?;
    Ok((HeadingColumns { frame: map.frame, yaw, parts }, Timed::new(columns.rows()?, clock)))
}

/// Asks for odometry.
pub(crate) fn motion(log: &Log<'_>, map: &OdometryMap) -> Result<(MotionColumns, Timed), LogError> {
    let mut columns = Columns::new(log, &map.topic);
    let clock: Clock = columns.stamp(&map.stamp)?;
    let (speed, sideways) = (columns.optional(map.speed.as_ref())?, columns.optional(map.sideways.as_ref())?);
    let velocity = map.velocity.as_ref().map(|axes| two(&mut columns, axes)).transpose()?;
    let rate = columns.optional(map.yaw_rate.as_ref())?;
    Ok((MotionColumns { frame: map.frame, speed, sideways, velocity, rate }, Timed::new(columns.rows()?, clock)))
}

/// Two columns for two axes.
pub(crate) fn two(columns: &mut Columns<'_>, axes: &Axes) -> Result<(Column, Column), LogError> {
    Ok((columns.field(axes.x.as_ref())?, columns.field(axes.y.as_ref())?))
}

/// Angles without jumps of a whole turn.
pub(crate) fn unwrapped(samples: impl IntoIterator<Item = (u64, f64)>) -> Curve {
    let mut last: Option<f64> = None;
    Curve::from_samples(samples.into_iter().map(|(time, angle)| {
        let angle = last.map_or(angle, |last| last + autonomy::localisation::wrap(angle - last));
        last = Some(angle);
        (time, angle)
    }))
}

impl HeadingColumns {
    /// The heading over these rows; none without any.
    pub(crate) fn curve(&self, rows: &[(u64, MessageRow)]) -> Option<Curve> {
        let samples = rows.iter().filter_map(|(time, row)| Some((*time, east_based(self.frame, self.angle(row)?))));
        let (samples, _) = in_order(samples);
        (!samples.is_empty()).then(|| unwrapped(samples))
    }

    fn angle(&self, row: &MessageRow) -> Option<f64> {
        match (self.yaw, self.parts.as_slice()) {
            (Some(yaw), _) => yaw.read(row),
            (None, [w, x, y, z]) => {
                let (w, x, y, z) = (w.read(row)?, x.read(row)?, y.read(row)?, z.read(row)?);
                Some(libm::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))
            }
            (None, _) => None,
        }
    }
}

impl MotionColumns {
    /// The odometry over these rows; none without any.
    pub(crate) fn curves(&self, rows: &[(u64, MessageRow)], turning: &Curve) -> Option<Motion> {
        let turn = if self.frame == Frame::Ned { -1.0 } else { 1.0 };
        let samples = rows.iter().filter_map(|(time, row)| {
            let (speed, left) = self.speeds(*time, row, turning)?;
            let rate = self.rate.map(|rate| rate.read(row)).map_or(Some(0.0), |rate| rate.map(|rate| rate * turn))?;
            Some((*time, (speed, left, rate)))
        });
        let (samples, back) = in_order(samples);
        if samples.is_empty() {
            return None;
        }
        let sideways: Option<Vec<(u64, f64)>> =
            samples.iter().map(|(time, (_, left, _))| Some((*time, (*left)?))).collect();
        let speeds = || samples.iter().map(|(time, (speed, ..))| (*time, *speed));
        let way = |samples: &mut dyn Iterator<Item = (u64, f64)>| {
            let curve = Curve::from_samples(samples.map(|(time, speed)| (time, speed.abs())));
            curve.ends().map_or(0.0, |(from, to)| curve.mean(from, to) * (to - from) as f64 / 1e6)
        };
        let facts = Facts {
            odometry: samples.len() as u64,
            odometry_unused: back,
            way_m: way(&mut speeds()),
            sideways_m: sideways.as_ref().map(|left| way(&mut left.iter().copied())),
            speed_m_s: speeds().fold(0.0, |most, (_, speed)| speed.abs().max(most)),
            ..Facts::default()
        };
        Some(Motion {
            speed: Curve::from_samples(speeds()),
            left: sideways.map(Curve::from_samples),
            rate: self.rate.map(|_| Curve::from_samples(samples.iter().map(|(time, (.., rate))| (*time, *rate)))),
            facts,
        })
    }

    /// Speeds ahead and to the left.
    fn speeds(&self, time: u64, row: &MessageRow, turning: &Curve) -> Option<(f64, Option<f64>)> {
        match (self.speed, self.velocity) {
            (Some(speed), _) => Some((speed.read(row)?, self.sideways.and_then(|sideways| sideways.read(row)))),
            (None, Some((x, y))) => {
                turning.age(time).filter(|age| *age <= HEADING_US)?;
                let (x, y) = (x.read(row)?, y.read(row)?);
                let (east, north) = if self.frame == Frame::Ned { (y, x) } else { (x, y) };
                let (sin, cos) = libm::sincos(turning.value(time));
                Some((east * cos + north * sin, Some(north * cos - east * sin)))
            }
            (None, None) => None,
        }
    }
}
