//! Bearings: the angle around a track from which it was supported.
//!
//! A flat fake, or one made to be seen from one place, may look right from there and not from elsewhere. A platform may
//! therefore ask (`designation_bearings_mrad`) that a track was fit from lines of sight that far apart. A line of sight
//! goes from the unit's own place to the track's. A contradicted track adds no line. A contradiction that lasts, or a
//! frame without the track, begins the count again. Fitness itself is judged in [`crate::fitness`].

use arrayvec::ArrayVec;
use wire::bounds::Bounds;
use wire::id::TrackId;
use wire::time::{Instant, Span};
use wire::track::Tracks;

use crate::fitness::{Stage, fit};
use crate::geofence::Point;
use crate::localisation::wrap;

/// Most tracks with lines of sight: as many as one message of tracks may hold.
const MOST: usize = 16;
/// A contradiction that lasts longer begins the count again: two decisions of the tracker. Chosen on one scene, in
/// which the networks disagree on a true vehicle for half a second (`docs/researcher/perception.md`, *Bearings*).
const DOUBT: Span = Span::ms(1000);

/// Lines of sight along which each track was borne out without a break.
#[derive(Clone, Debug, Default)]
pub struct Bearings {
    tracks: ArrayVec<Lines, MOST>,
}

/// Lines of sight to one track, radians.
#[derive(Clone, Copy, Debug)]
struct Lines {
    track: TrackId,
    /// The first, counter-clockwise from east.
    first: f64,
    /// The furthest on either side, from the first.
    right: f64,
    left: f64,
    /// Stamp of the last message in which no modality contradicted the track.
    uncontradicted: Instant,
}

impl Bearings {
    /// Takes accepted tracks as seen from `place`; none is borne out while the unit does not know its place.
    pub fn note(&mut self, tracks: &Tracks, place: Option<Point>, bounds: &Bounds) {
        self.tracks.retain(|lines| {
            let Some(track) = tracks.tracks.iter().find(|track| track.id == lines.track) else { return false };
            lines.uncontradicted = if track.vetoed.count() == 0 { tracks.stamp } else { lines.uncontradicted };
            tracks.stamp.since(lines.uncontradicted) <= DOUBT
        });
        let Some((east, north)) = place else { return };
        let seen =
            tracks.tracks.iter().filter(|track| track.updated == tracks.stamp && fit(track, Stage::Held, bounds));
        for track in seen {
            let line = libm::atan2(f64::from(track.y_mm) - north, f64::from(track.x_mm) - east);
            match self.tracks.iter_mut().find(|lines| lines.track == track.id) {
                Some(lines) => lines.widen(line),
                None => {
                    let uncontradicted = tracks.stamp;
                    let lines = Lines { track: track.id, first: line, right: 0.0, left: 0.0, uncontradicted };
                    // A message holds no more tracks than there is room for, and those that are gone have made it.
                    let _full = self.tracks.try_push(lines);
                }
            }
        }
    }

    /// True if a track was borne out from as far around as the platform asks.
    pub fn suffice(&self, track: TrackId, bounds: &Bounds) -> bool {
        self.apart_mrad(track) >= bounds.designation_bearings_mrad
    }

    /// Widest angle between two lines of sight to a track, milliradians.
    pub(crate) fn apart_mrad(&self, track: TrackId) -> u32 {
        let lines = self.tracks.iter().find(|lines| lines.track == track);
        lines.map_or(0, |lines| ((lines.left - lines.right) * 1000.0) as u32)
    }
}

impl Lines {
    fn widen(&mut self, line: f64) {
        let from_first = wrap(line - self.first);
        (self.right, self.left) = (self.right.min(from_first), self.left.max(from_first));
    }
}

#[cfg(test)]
mod tests {
    use wire::codec::List;
    use wire::id::FrameId;
    use wire::sensor::{Class, Modalities, Modality, ProductMode};
    use wire::track::Track;

    use super::*;

    const TRACK: TrackId = TrackId(7);

    fn tracks(ms: u64, vetoed: bool) -> Tracks {
        let (frame, stamp) = (FrameId(1), Instant(ms * 1000));
        let modality = |m| Modalities::default().with_modality(m);
        let track = Track {
            id: TRACK,
            class: Class::Vehicle,
            x_mm: 0,
            y_mm: 0,
            vx_mm_s: 0,
            vy_mm_s: 0,
            sigma_mm: 100,
            confidence: 900,
            supported: modality(Modality::Thermal).with_modality(Modality::Lidar),
            vetoed: if vetoed { modality(Modality::Thermal) } else { Modalities::default() },
            updated: stamp,
            frame,
            across_px: 0,
        };
        let tracks = [track].into_iter().collect();
        Tracks {
            frame,
            stamp,
            mode: ProductMode::Live,
            products: [None; 4],
            tracks,
            crops: List::default(),
            nearby: None,
        }
    }

    #[test]
    fn bearings_add_up_until_a_contradiction() {
        let mut bearings = Bearings::default();
        let mut ms = 0;
        let mut from = |degrees: f64, vetoed| {
            ms += 600;
            let (sin, cos) = libm::sincos(degrees.to_radians());
            bearings.note(&tracks(ms, vetoed), Some((10_000.0 * cos, 10_000.0 * sin)), &Bounds::GROUND);
            bearings.apart_mrad(TRACK)
        };
        assert_eq!(from(-10.0, false), 0, "across the cut of the angle");
        assert_eq!((from(5.0, false), from(0.0, false)), (261, 261));
        assert_eq!(from(-25.0, false), 523);
        assert_eq!((from(80.0, true), from(0.0, false)), (523, 523), "a short doubt adds none and takes none");
        assert_eq!((from(0.0, true), from(0.0, true), from(10.0, false)), (523, 0, 0), "from here on anew");
        assert_eq!(from(40.0, false), 523);
        bearings.note(&Tracks { tracks: Default::default(), ..tracks(9_000, false) }, None, &Bounds::GROUND);
        assert_eq!(bearings.apart_mrad(TRACK), 0, "a track that is gone");
    }

    #[test]
    fn lost_place_or_weak_track_bears_nothing_out() {
        let mut bearings = Bearings::default();
        bearings.note(&tracks(1, false), None, &Bounds::GROUND);
        let old = Tracks { stamp: Instant(2), ..tracks(1, false) };
        for place in [(10_000.0, 0.0), (0.0, 10_000.0)] {
            bearings.note(&old, Some(place), &Bounds::GROUND);
        }
        assert!(bearings.tracks.is_empty());
    }
}
