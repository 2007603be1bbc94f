//! A look from another side: the way around a track for which authority was asked before the track was seen from
//! bearings far enough apart.
//!
//! The unit drives at a slant to the line of sight: the track stays in view of the cameras, and the unit comes nearer.
//! With enough bearings the unit stands and waits for the operator. The look ends when the track or the mode ends, when
//! the unit is near, and after a limited time. Fence, obstacles and speed limits apply as on any way
//! ([`crate::navigation`]).

use wire::id::TrackId;
use wire::time::{Instant, Span};

use crate::geofence::{Motion, Point, distance};
use crate::localisation::wrap;

/// Angle between the way and the line of sight, radians: within half of the view of a camera of 90°, with 10° to spare
/// for the way that lags behind.
const SLANT: f64 = 0.6;
/// Length of way that is planned ahead, millimetres.
const AHEAD_MM: f64 = 4000.0;
/// No nearer than this, millimetres: twice the distance that is kept from anything seen.
const NEAREST_MM: f64 = 6000.0;
/// A look takes no longer, and after it the unit waits no longer for the operator.
const LONGEST: Span = Span::s(20);
const WAIT: Span = Span::s(5);

/// A look under way.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// Track to look at.
    pub track: TrackId,
    /// To which side the unit passes it, as a sign: 1 leaves it on the left.
    side: f64,
    until: Instant,
    done: bool,
}

/// Demand of a look on driving.
#[derive(Clone, Debug, PartialEq)]
pub enum Aside {
    /// Drive this way, which begins at the unit.
    Way(Vec<Point>),
    /// To stand: the track is borne out, and the operator may ask again.
    Stand,
}

impl Look {
    /// Begins a look at `track`, which is at `place`, to the side on which the unit is under way already.
    pub fn begin(track: TrackId, place: Point, motion: &Motion, now: Instant) -> Look {
        let to_left = wrap(line(motion.at, place) - motion.yaw) >= 0.0;
        Look { track, side: if to_left { 1.0 } else { -1.0 }, until: now + LONGEST, done: false }
    }

    /// The look with the track borne out: it waits from the first time on that this is so.
    #[must_use]
    pub fn done(self, now: Instant) -> Look {
        if self.done { self } else { Look { until: now + WAIT, done: true, ..self } }
    }

    /// True once its time is over.
    pub fn expired(&self, now: Instant) -> bool {
        now >= self.until
    }

    /// The look turned to the other side.
    #[must_use]
    pub fn turned(self) -> Look {
        Look { side: -self.side, ..self }
    }

    /// Next point of the way from `position` around a track at `place`; none where that is near.
    pub fn next(&self, position: Point, place: Point) -> Option<Point> {
        let room = distance(position, place) - NEAREST_MM;
        if room <= 0.0 {
            return None;
        }
        let (sin, cos) = libm::sincos(line(position, place) - self.side * SLANT);
        Some((position.0 + AHEAD_MM * cos, position.1 + AHEAD_MM * sin))
    }
}

fn line(from: Point, to: Point) -> f64 {
    libm::atan2(to.1 - from.1, to.0 - from.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn look_gains_bearing_while_the_track_stays_in_view() {
        let (track, place) = (TrackId(1), (0.0, 0.0));
        for (yaw, side) in [(0.2, -1.0), (-0.2, 1.0)] {
            let mut motion = Motion { at: (-20_000.0, 0.0), yaw, speed: 0.0 };
            let look = Look::begin(track, place, &motion, Instant(0));
            let (first, mut steps) = (line(motion.at, place), 0);
            while let Some(next) = look.next(motion.at, place) {
                let (way, sight) = (line(motion.at, next), line(motion.at, place));
                assert!(wrap(way - sight).abs() < core::f64::consts::FRAC_PI_4);
                motion.at = (motion.at.0 + 0.1 * (next.0 - motion.at.0), motion.at.1 + 0.1 * (next.1 - motion.at.1));
                steps += 1;
                assert!(steps < 100, "it comes to an end");
            }
            let gained = wrap(line(motion.at, place) - first);
            assert!(side * gained > 0.6, "{gained} rad from {yaw}");
        }
        let look = Look::begin(track, place, &Motion { at: (-20_000.0, 0.0), yaw: 0.0, speed: 0.0 }, Instant(0));
        assert!(!look.expired(Instant(19_999_999)) && look.expired(Instant(20_000_000)));
        let done = look.done(Instant(8_000_000)).done(Instant(9_000_000));
        assert!(!done.expired(Instant(12_999_999)) && done.expired(Instant(13_000_000)));
    }
}
