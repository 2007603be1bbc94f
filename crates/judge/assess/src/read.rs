//! The inputs of the guards as they are in a recording: fixes, heading and odometry, part by part.
//!
//! Oddities about them are reported in sentences. The readings that the guards take are made of them in `track`.

use crate::curve::Curve;
use crate::error::TrackError;
use crate::fix::{self, FixColumns, Fixes};
use crate::lever;
use crate::log::Log;
use crate::map::{Dimension, Map, Vehicle};
use crate::motion::{self, HEADING_US, HeadingColumns, Motion, MotionColumns, unwrapped};
use crate::parts::{self, Back, Key, Stretches, Timed};

/// One part of a recording.
pub(crate) struct Part {
    pub(crate) key: Key,
    pub(crate) fixes: Fixes,
    pub(crate) turning: Curve,
    pub(crate) motion: Motion,
    /// First fix, and last fix or sample, microseconds.
    pub(crate) ends: (u64, u64),
}

/// The parts of a recording, one at least.
pub(crate) struct Read {
    pub(crate) parts: Vec<Part>,
    pub(crate) backs: Vec<Back>,
    /// Messages with fixes.
    pub(crate) messages: u64,
    /// True if the receiver's time can be judged.
    pub(crate) is_timed: bool,
    pub(crate) remarks: Vec<String>,
}

/// The topics, cut into parts.
struct Inputs<'a> {
    map: &'a Map,
    fixes: (FixColumns, Stretches),
    odometry: (MotionColumns, Stretches),
    heading: Option<(HeadingColumns, Stretches)>,
    /// Messages of fixes, odometry, heading.
    messages: [u64; 3],
    /// Latitude and longitude of the first fix.
    zero: Option<(f64, f64)>,
}

impl Read {
    /// Reads the inputs.
    ///
    /// # Errors
    /// When no part of the recording has all of them.
    pub(crate) fn from_log(log: &Log<'_>, map: &Map) -> Result<Self, TrackError> {
        let heading = map.heading.as_ref().map(|map| motion::heading(log, map)).transpose()?;
        let (fix_columns, fixes) = fix::fixes(log, &map.fix)?;
        let (motion_columns, odometry) = motion::motion(log, &map.odometry)?;
        let mut remarks: Vec<String> =
            [unread(&map.fix.topic, &fixes), unread(&map.odometry.topic, &odometry)].into_iter().flatten().collect();
        let backs = parts::backs(&fixes, &odometry);
        let messages = [fixes.messages, odometry.messages, heading.as_ref().map_or(0, |(_, timed)| timed.messages)];
        let mut inputs = Inputs {
            map,
            fixes: (fix_columns, Stretches::split_at(fixes, &backs)),
            odometry: (motion_columns, Stretches::split_at(odometry, &backs)),
            heading: heading.map(|(columns, timed)| (columns, Stretches::split_at(timed, &backs))),
            messages,
            zero: None,
        };
        let (mut read, mut failed) = (Vec::new(), None);
        let keys: Vec<Key> = inputs.fixes.1.keys().collect();
        for key in keys {
            match inputs.part(key) {
                Ok(part) => read.push(part),
                Err(why) => failed = failed.or(Some(why)),
            }
        }
        match (read.is_empty(), failed) {
            (true, why) => return Err(why.unwrap_or_else(|| inputs.no_fix())),
            (false, Some(why)) => remarks.push(format!("A part of the recording is not judged: {why}.")),
            (false, None) => {}
        }
        let mut read = Self { parts: read, backs, messages: messages[0], is_timed: false, remarks };
        read.settle_times(map);
        read.tell_deviations(map);
        Ok(read)
    }

    /// The lever that the recording itself tells, where the guards' model of motion has one.
    pub(crate) fn lever(&self, map: &Map) -> Option<lever::Estimate> {
        match map.vehicle {
            Vehicle::Wheeled | Vehicle::Other => {
                let mut stretches = lever::Stretches::default();
                self.parts.iter().for_each(|part| stretches.add(&part.fixes.kept, &part.turning, &part.motion));
                stretches.estimate()
            }
            Vehicle::Multirotor | Vehicle::FixedWing => None,
        }
    }

    /// A receiver without a time says nothing, 0, or one time for ever: its time cannot be judged then. A few fixes without a time go on with the
    /// difference to the stamps that the last one had.
    fn settle_times(&mut self, map: &Map) {
        if map.fix.time.is_none() {
            return;
        }
        let all: u64 = self.parts.iter().map(|part| part.fixes.kept.len() as u64).sum();
        let missing: u64 = self.parts.iter().map(|part| part.fixes.untimed).sum();
        let mut times = self.parts.iter().flat_map(|part| &part.fixes.kept).filter_map(|(_, place)| place.time);
        let first = times.next();
        self.is_timed = first.is_some_and(|first| times.any(|time| time != first));
        if !self.is_timed {
            let text = first.map_or("0, or no number,".to_owned(), |time| format!("{} s", time as f64 / 1e6));
            self.remarks.push(format!(
                "The receiver's time is {text} in each of {all} fixes, which is no time: the time base is not judged."
            ));
        } else if missing > 0 {
            self.remarks.push(format!(
                "The receiver has no time in {missing} of {all} fixes: the time base is not judged there."
            ));
        }
        for part in &mut self.parts {
            let offsets = part.fixes.kept.iter().find_map(|(at, place)| Some(place.time? as i64 - *at as i64));
            let mut offset = offsets.filter(|_| self.is_timed);
            for (at, place) in &mut part.fixes.kept {
                let receiver_time = place.time.filter(|_| offset.is_some()).map(|time| time as i64 - *at as i64);
                offset = receiver_time.or(offset);
                place.time = offset.map(|offset| (*at as i64).saturating_add(offset).max(0) as u64);
            }
        }
    }

    fn tell_deviations(&mut self, map: &Map) {
        let Some(sigma) = &map.fix.sigma else { return };
        let unstated: u64 = self.parts.iter().map(|part| part.fixes.unstated).sum();
        let square = sigma.as_ref().unit.dimension() == Dimension::Variance;
        if unstated > 0 {
            let all: u64 = self.parts.iter().map(|part| part.fixes.kept.len() as u64).sum();
            self.remarks.push(format!(
                "{unstated} of {all} fixes state a {} of 0 or less, by which a source says that it does not know it: the gate is at its narrowest there.",
                if square { "variance" } else { "deviation" }
            ));
        }
        let path = sigma.as_ref().field.to_lowercase();
        if !square && ["covariance", "variance"].iter().any(|name| path.contains(name)) {
            self.remarks.push(format!(
                "`{}` is a variance by its name and a deviation by the map: the unit of a variance is `m2`.",
                sigma.as_ref().field.escape_debug()
            ));
        }
    }
}

impl Inputs<'_> {
    fn part(&mut self, key: Key) -> Result<Part, TrackError> {
        let heading = match (&self.heading, &self.map.heading) {
            (Some((columns, stretches)), Some(map)) => {
                let curve = columns.curve(stretches.rows(key));
                Some(curve.ok_or_else(|| empty(&map.topic, "heading", self.messages[2], ""))?)
            }
            (None, _) | (_, None) => None,
        };
        let (columns, stretches) = &self.fixes;
        let fixes = columns.places(stretches.rows(key), (heading.as_ref(), HEADING_US), &mut self.zero);
        let (Some((first, _)), Some((last, _))) = (fixes.kept.first(), fixes.kept.last()) else {
            return Err(self.no_fix());
        };
        let (first, last) = (*first, *last);
        let turning = heading.unwrap_or_else(|| unwrapped(fixes.kept.iter().map(|(time, fix)| (*time, fix.yaw))));
        let (columns, stretches) = &self.odometry;
        let motion = columns.curves(stretches.rows(key), &turning);
        let motion = motion.ok_or_else(|| empty(&self.map.odometry.topic, "odometry", self.messages[1], ""))?;
        let ends = motion.speed.ends().unwrap_or_default();
        if ends.0 > last || ends.1 < first {
            return Err(TrackError::Apart { fix: (first, last), odometry: ends });
        }
        Ok(Part { key, fixes, turning, motion, ends: (first, last.max(ends.1)) })
    }

    fn no_fix(&self) -> TrackError {
        let valid = if self.map.fix.valid.is_some() { " that is also valid by the map's condition" } else { "" };
        empty(&self.map.fix.topic, "fix", self.messages[0], valid)
    }
}

fn empty(topic: &str, input: &'static str, got: u64, valid: &'static str) -> TrackError {
    TrackError::Empty { topic: topic.to_owned(), input, got, valid }
}

/// A sentence about a topic's messages that could not be read.
fn unread(topic: &str, timed: &Timed) -> Option<String> {
    let reason = timed.why.as_ref()?;
    Some(format!(
        "{} of {} messages of `{topic}` could not be read; the first: {reason}.",
        timed.unread, timed.messages
    ))
}
