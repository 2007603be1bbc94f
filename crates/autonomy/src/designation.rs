//! Designation: whether one track is fit to be acted on.
//!
//! [`Designated`] is the proof. The track is in the newest accepted picture and was updated within the track limit. The
//! class is vehicle, and the confidence suffices. At least two modalities support the track, thermal among them, and
//! none vetoes. Where the platform asks for bearings, the track met all of this from lines of sight far enough apart
//! ([`crate::bearings`]). A proof holds for one judgement; the next judgement makes a new one.

use wire::bounds::Bounds;
use wire::id::TrackId;
use wire::mode::Because;
use wire::time::{Instant, Span};

use crate::bearings::Bearings;
use crate::fitness::{Stage, fit};
use crate::picture::Picture;

/// Proof that a track was fit for designation when it was made.
#[derive(Debug)]
pub struct Designated {
    track: TrackId,
    x_mm: i32,
    y_mm: i32,
}

impl Designated {
    /// Judges `track` in `picture`; the error names the cause of the unfitness.
    pub(crate) fn judge(
        (picture, bearings): (&Picture, &Bearings),
        track: TrackId,
        stage: Stage,
        bounds: &Bounds,
        now: Instant,
    ) -> Result<Designated, Because> {
        let found = picture.track(track).ok_or(Because::Silence(picture.stamp()))?;
        if now.since(found.updated) > Span::ms(bounds.track_limit_ms) {
            return Err(Because::Silence(found.updated));
        }
        if fit(found, stage, bounds) && bearings.suffice(track, bounds) {
            Ok(Designated { track, x_mm: found.x_mm, y_mm: found.y_mm })
        } else {
            Err(Because::Frame(found.frame))
        }
    }

    /// The track.
    pub fn track(&self) -> TrackId {
        self.track
    }

    /// Place at which the track is held to be: millimetres east and north.
    pub fn place(&self) -> (i32, i32) {
        (self.x_mm, self.y_mm)
    }

    /// The proof that a row of the transition table assumes.
    pub(crate) fn assumed(track: TrackId) -> Designated {
        Designated { track, x_mm: 0, y_mm: 0 }
    }
}
