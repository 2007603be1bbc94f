//! The fixes of a recording: place, heading, stated deviation, receiver's time.

use crate::columns::{Clock, Column, Columns, in_order};
use crate::curve::Curve;
use crate::log::{Log, LogError, MessageRow};
use crate::map::{Dimension, FixMap, Frame};
use crate::parts::Timed;

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
    /// The receiver's time, microseconds; absent where the map gives none or the receiver has none.
    pub(crate) time: Option<u64>,
}

/// The questions to the topic of fixes.
pub(crate) struct FixColumns {
    frame: Frame,
    local: Option<(Column, Column)>,
    global: Option<(Column, Column)>,
    yaw: Option<Column>,
    /// The number, and whether it is a variance.
    sigma: Option<(Column, bool)>,
    time: Option<Clock>,
    valid: Option<(Column, f64)>,
}

/// Fixes of a stretch with increasing stamps.
#[derive(Clone, Debug, Default)]
pub(crate) struct Fixes {
    pub(crate) kept: Vec<(u64, Place)>,
    /// Fixes with a stated deviation of 0 or less.
    pub(crate) unstated: u64,
    /// Fixes by a receiver that has no time.
    pub(crate) untimed: u64,
}

/// Asks for the fixes.
pub(crate) fn fixes(log: &Log<'_>, map: &FixMap) -> Result<(FixColumns, Timed), LogError> {
    let mut columns = Columns::new(log, &map.topic);
    let clock = columns.stamp(&map.stamp)?;
    let local = columns.optional(map.x.as_ref())?.zip(columns.optional(map.y.as_ref())?);
    let global = columns.optional(map.latitude.as_ref())?.zip(columns.optional(map.longitude.as_ref())?);
    let (yaw, sigma) = (columns.optional(map.yaw.as_ref())?, columns.optional(map.sigma.as_ref())?);
    let square = map.sigma.as_ref().is_some_and(|field| field.as_ref().unit.dimension() == Dimension::Variance);
    let time = map.time.as_ref().map(|time| columns.stamp(time)).transpose()?;
    let valid = match &map.valid {
        Some(valid) => Some((columns.plain(&valid.field)?, valid.at_least)),
        None => None,
    };
    let sigma = sigma.map(|sigma| (sigma, square));
    Ok((FixColumns { frame: map.frame, local, global, yaw, sigma, time, valid }, Timed::new(columns.rows()?, clock)))
}

impl FixColumns {
    /// The fixes in these rows; those without their own heading take that of `heading`, no older than `oldest` microseconds. `zero` is the
    /// first latitude and longitude of the recording.
    pub(crate) fn places(
        &self,
        rows: &[(u64, MessageRow)],
        (heading, oldest): (Option<&Curve>, u64),
        zero: &mut Option<(f64, f64)>,
    ) -> Fixes {
        let mut read = |at: u64, row: &MessageRow| {
            self.valid.is_none_or(|(column, least)| column.read(row).is_some_and(|got| got >= least)).then_some(())?;
            let yaw = match (self.yaw, heading) {
                (Some(yaw), _) => east_based(self.frame, yaw.read(row)?),
                (None, heading) => heading.filter(|curve| curve.age(at).is_some_and(|age| age <= oldest))?.value(at),
            };
            let (east, north) = match (self.local, self.global) {
                (Some((x, y)), _) => on_axes(self.frame, x.read(row)?, y.read(row)?),
                (None, Some((latitude, longitude))) => {
                    let here = (latitude.read(row)?, longitude.read(row)?);
                    tangent(*zero.get_or_insert(here), here)
                }
                (None, None) => return None,
            };
            (east.abs() < FARTHEST_M && north.abs() < FARTHEST_M).then_some(())?;
            let sigma_m = match self.sigma {
                Some((column, square)) => deviation(column.read(row)?, square),
                None => 0.0,
            };
            // A receiver without its own time says 0, or no number.
            let time = self.time.and_then(|time| time.read(row)).filter(|time| *time > 0);
            Some(Place { east, north, yaw, sigma_m, time })
        };
        let places = rows.iter().filter_map(|(at, row)| Some((*at, read(*at, row)?)));
        let (kept, _) = in_order(places);
        let count = |wanted: fn(&Place) -> bool| kept.iter().filter(|(_, place)| wanted(place)).count() as u64;
        let unstated = if self.sigma.is_some() { count(|place| place.sigma_m <= 0.0) } else { 0 };
        let untimed = if self.time.is_some() { count(|place| place.time.is_none()) } else { 0 };
        Fixes { kept, unstated, untimed }
    }
}

/// A deviation as it is stated, or out of a variance; 0 where it is not known.
fn deviation(stated: f64, square: bool) -> f64 {
    let stated = stated.max(0.0);
    if square { libm::sqrt(stated) } else { stated }
}

/// An angle of this frame as one counter-clockwise from east.
pub(crate) fn east_based(frame: Frame, angle: f64) -> f64 {
    match frame {
        Frame::Enu => angle,
        Frame::Ned => core::f64::consts::FRAC_PI_2 - angle,
    }
}

fn on_axes(frame: Frame, x: f64, y: f64) -> (f64, f64) {
    match frame {
        Frame::Enu => (x, y),
        Frame::Ned => (y, x),
    }
}

/// Metres east and north of `zero`, on the plane that touches the ellipsoid there; radians in.
fn tangent(zero: (f64, f64), place: (f64, f64)) -> (f64, f64) {
    let (sin, cos) = libm::sincos(zero.0);
    let w2 = 1.0 - ECCENTRICITY_2 * sin * sin;
    let across = RADIUS_M / libm::sqrt(w2);
    let along = across * (1.0 - ECCENTRICITY_2) / w2;
    let turned = autonomy::localisation::wrap(place.1 - zero.1);
    (turned * across * cos, (place.0 - zero.0) * along)
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
