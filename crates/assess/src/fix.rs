//! The fixes of a recording: place, heading, stated deviation, receiver's time.

use crate::columns::{Column, Columns, in_order};
use crate::curve::Curve;
use crate::log::{Log, Row};
use crate::map::{FixMap, Frame};
use crate::track::{TrackError, east_based};

/// Equatorial radius and square of the eccentricity of WGS 84 (NIMA TR8350.2), metres.
const RADIUS_M: f64 = 6_378_137.0;
const ECCENTRICITY_2: f64 = 6.694_379_990_14e-3;
/// Farthest place that a reading can carry, metres from zero.
const FARTHEST_M: f64 = 2.0e6;

/// A fix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    /// Metres.
    pub(crate) east: f64,
    /// Metres.
    pub(crate) north: f64,
    /// Heading, radians counter-clockwise from east.
    pub(crate) yaw: f64,
    /// One standard deviation as stated, metres; 0 where the map gives none.
    pub(crate) sigma_m: f64,
    /// The receiver's time, microseconds.
    pub(crate) time: Option<u64>,
}

/// Fixes with increasing stamps, at least one.
pub(crate) struct Fixes {
    pub(crate) kept: Vec<(u64, Place)>,
    pub(crate) unused: u64,
}

/// Reads the fixes; those without a heading of their own take that of `heading`, no older than `oldest` microseconds.
pub(crate) fn read(log: &Log<'_>, map: &FixMap, heading: Option<&Curve>, oldest: u64) -> Result<Fixes, TrackError> {
    let mut columns = Columns::of(log, &map.topic);
    let clock = columns.stamp(&map.stamp)?;
    let local = columns.optional(map.x.as_ref())?.zip(columns.optional(map.y.as_ref())?);
    let global = columns.optional(map.latitude.as_ref())?.zip(columns.optional(map.longitude.as_ref())?);
    let (yaw, sigma) = (columns.optional(map.yaw.as_ref())?, columns.optional(map.sigma.as_ref())?);
    let time = map.time.as_ref().map(|time| columns.stamp(time)).transpose()?;
    let valid = map.valid.as_ref().map(|valid| Ok((columns.plain(&valid.field)?, valid.at_least)));
    let valid: Option<(Column, f64)> = valid.transpose().map_err(|error: crate::log::LogError| error)?;
    let rows = columns.rows()?;
    let mut zero = None;
    let fix = |row: &Row| {
        let at = clock.read(row)?;
        valid.is_none_or(|(column, least)| column.read(row).is_some_and(|got| got >= least)).then_some(())?;
        let yaw = match (yaw, heading) {
            (Some(yaw), _) => east_based(map.frame, yaw.read(row)?),
            (None, heading) => {
                let heading = heading.filter(|curve| curve.age(at).is_some_and(|age| age <= oldest))?;
                heading.value(at)
            }
        };
        let (east, north) = match (local, global) {
            (Some((x, y)), _) => on_axes(map.frame, x.read(row)?, y.read(row)?),
            (None, Some((latitude, longitude))) => {
                let here = (latitude.read(row)?, longitude.read(row)?);
                tangent(*zero.get_or_insert(here), here)
            }
            (None, None) => return None,
        };
        (east.abs() < FARTHEST_M && north.abs() < FARTHEST_M).then_some(())?;
        let sigma_m = sigma.map_or(Some(0.0), |sigma| sigma.read(row))?;
        let time = time.map(|time| time.read(row)).map_or(Some(None), |time| time.map(Some))?;
        Some((at, Place { east, north, yaw, sigma_m: sigma_m.abs(), time }))
    };
    let (kept, _) = in_order(rows.iter().filter_map(fix));
    if kept.is_empty() {
        let valid = if map.valid.is_some() { " that is also valid by the map's condition" } else { "" };
        return Err(TrackError::Empty { topic: map.topic.clone(), input: "fix", got: rows.len(), valid });
    }
    let unused = (rows.len() - kept.len()) as u64;
    Ok(Fixes { kept, unused })
}

fn on_axes(frame: Frame, x: f64, y: f64) -> (f64, f64) {
    match frame {
        Frame::Enu => (x, y),
        Frame::Ned => (y, x),
    }
}

/// Metres east and north of `zero`, on the plane that touches the ellipsoid there; radians in.
fn tangent(zero: (f64, f64), here: (f64, f64)) -> (f64, f64) {
    let (sin, cos) = libm::sincos(zero.0);
    let w2 = 1.0 - ECCENTRICITY_2 * sin * sin;
    let across = RADIUS_M / libm::sqrt(w2);
    let along = across * (1.0 - ECCENTRICITY_2) / w2;
    let turned = autonomy::localisation::wrap(here.1 - zero.1);
    (turned * across * cos, (here.0 - zero.0) * along)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A minute of latitude at 45° is 1852.2 m, one of longitude 1314.2 m (length of a degree on WGS 84: 111,132 and 78,847 m).
    #[test]
    fn a_minute_of_arc_has_its_length() {
        let degree = core::f64::consts::PI / 180.0;
        let zero = (45.0 * degree, 179.995 * degree);
        let (east, north) = tangent(zero, ((45.0 + 1.0 / 60.0) * degree, (-180.0 + 0.7 / 60.0) * degree));
        assert!((north - 111_132.0 / 60.0).abs() < 1.0, "{north}");
        assert!((east - 78_847.0 / 60.0).abs() < 1.0, "{east}");
    }
}
