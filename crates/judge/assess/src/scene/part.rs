//! The longest part of a recording as places of the body's origin, with the readings between them; heights of a flight.

use super::error::SceneError;
use crate::Terms;
use crate::columns::Columns;
use crate::error::TrackError;
use crate::log::Log;
use crate::map::Map;
use crate::replay::mount;
use crate::track::{Step, Track};

/// One place of a drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    /// Time, microseconds.
    pub(super) us: u64,
    /// East and north of the recording's zero, metres.
    pub(super) at_m: [f64; 2],
    /// Heading, radians counter-clockwise from east.
    pub(super) yaw: f64,
    /// Displacement since the reading before by odometry, metres ahead and to the left; none without odometry.
    pub(super) moved_m: Option<[f64; 2]>,
}

/// A part of a recording.
pub(super) struct Part {
    pub(super) spots: Vec<Spot>,
    /// Speeds by odometry, m/s.
    pub(super) speeds: Vec<f64>,
    /// Its start, seconds after the recording's first fix, and its number among all.
    pub(super) start_s: f64,
    pub(super) number: usize,
    /// Parts of the recording.
    pub(super) of: usize,
}

impl Part {
    /// The longest one.
    pub(super) fn longest(track: &Track, terms: &Terms) -> Result<Self, SceneError> {
        let first = track.steps.first().map_or(0, |step| step.stamp.0);
        let mut parts: Vec<&[Step]> = Vec::new();
        let mut rest = track.steps.as_slice();
        for (_, begin) in &track.pauses {
            let (part, next) = rest.split_at(rest.partition_point(|step| step.stamp < *begin));
            parts.push(part);
            rest = next;
        }
        parts.push(rest);
        let length =
            |part: &&[Step]| part.first().zip(part.last()).map_or(0, |(first, last)| last.stamp.since(first.stamp).0);
        let longest = parts.iter().enumerate().max_by_key(|(_, part)| length(part));
        let Some((number, steps)) = longest.filter(|(_, steps)| !steps.is_empty()) else {
            return Err(SceneError::Still { within_m: 0.0 });
        };
        let start_s = (steps[0].stamp.0 - first) as f64 / 1e6;
        let lever = track.facts.lever_m.unwrap_or_default();
        let (spots, speeds) = (spots(steps, mount(&terms.limits, lever)), speeds(steps));
        Ok(Self { spots, speeds, start_s, number: number + 1, of: parts.len() })
    }

    /// Its length, seconds.
    pub(super) fn seconds(&self) -> f64 {
        self.spots.first().zip(self.spots.last()).map_or(0.0, |(first, last)| (last.us - first.us) as f64 / 1e6)
    }
}

/// The fixes as places of the body's origin, and the way by odometry from one to the next.
fn spots(steps: &[Step], (ahead, left): (f64, f64)) -> Vec<Spot> {
    let mut spots = Vec::new();
    let (mut before, mut moved) = (steps.first().map_or(0, |step| step.stamp.0), Some([0.0; 2]));
    for step in steps {
        let seconds = (step.stamp.0 - before) as f64 / 1e6;
        before = step.stamp.0;
        moved = moved.zip(step.odometry).map(|(moved, odometry)| {
            let speed = [odometry.speed_mm_s, step.left_mm_s.unwrap_or_default()].map(|mm_s| f64::from(mm_s) / 1000.0);
            [moved[0] + speed[0] * seconds, moved[1] + speed[1] * seconds]
        });
        let Some(fix) = step.fix else { continue };
        let (sin, cos) = libm::sincos(fix.yaw);
        let at_m = [fix.east + (ahead * cos - left * sin) / 1000.0, fix.north + (ahead * sin + left * cos) / 1000.0];
        spots.push(Spot { us: step.stamp.0, at_m, yaw: fix.yaw, moved_m: moved });
        moved = Some([0.0; 2]);
    }
    spots
}

fn speeds(steps: &[Step]) -> Vec<f64> {
    let speed = |step: &Step| {
        let left = f64::from(step.left_mm_s.unwrap_or_default());
        step.odometry.map(|odometry| libm::hypot(f64::from(odometry.speed_mm_s), left) / 1000.0)
    };
    steps.iter().filter_map(speed).collect()
}

/// Heights of a flight that the platform's envelope holds: their median and nine tenths, metres above the lowest.
///
/// # Errors
/// When the map gives none, or they are not within floor and ceiling.
pub(super) fn heights(log: &Log<'_>, map: &Map, terms: &Terms, platform: &str) -> Result<[f64; 2], SceneError> {
    let Some(height) = &map.fix.height else {
        return Err(SceneError::NoHeight { platform: platform.to_owned() });
    };
    let mut columns = Columns::new(log, &map.fix.topic);
    let column = columns.field(height.as_ref()).map_err(TrackError::from)?;
    let rows = columns.rows().map_err(TrackError::from)?;
    let mut all: Vec<f64> = rows.rows.iter().filter_map(|row| column.read(row)).collect();
    all.sort_by(f64::total_cmp);
    let Some(lowest) = all.first().copied() else {
        return Err(SceneError::NoHeight { platform: platform.to_owned() });
    };
    // The lowest place is the ground: climb and landing are a small part of a flight.
    let share = |tenths: usize| all[(all.len() - 1) * tenths / 10] - lowest;
    let heights_m = [share(5), share(9)];
    let band = terms.limits.aloft.map_or([0; 2], |aloft| aloft.floor_ceiling_mm);
    let band_m = band.map(|mm| f64::from(mm) / 1000.0);
    match band_m[0] <= heights_m[0] && heights_m[1] <= band_m[1] {
        true => Ok(heights_m),
        false => Err(SceneError::Height { heights_m, band_m, platform: platform.to_owned() }),
    }
}
