//! The picture: the newest accepted tracks, and how fresh each perception stage's product is.
//!
//! Freshness is judged by the stamp of the frame that a product was made from, on the clock that vehicle processes
//! share. A stage that repeats itself, or stays silent while tracks go on, grows stale here.

use wire::id::TrackId;
use wire::measured::Measured;
use wire::mode::{Because, Guard};
use wire::policy::Waived;
use wire::sensor::Modality;
use wire::time::{Instant, Span};
use wire::track::{Nearby, Track, Tracks};

use crate::health::Findings;

/// The newest accepted tracks message.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    newest: Option<Tracks>,
    waived: Waived,
}

impl Picture {
    /// Takes accepted tracks; `waived` says which checks they passed by waiver.
    pub fn take(&mut self, tracks: Tracks, waived: Waived) {
        self.newest = Some(tracks);
        self.waived = waived;
    }

    /// Stamp of the newest picture; the clock's zero before the first.
    pub fn stamp(&self) -> Instant {
        self.newest.as_ref().map_or(Instant(0), |tracks| tracks.stamp)
    }

    /// Checks that were waived on the way of the newest picture.
    pub fn waived(&self) -> Waived {
        self.waived
    }

    /// All tracks, oldest first.
    pub fn tracks(&self) -> &[Track] {
        self.newest.as_ref().map_or(&[], |tracks| &tracks.tracks)
    }

    /// Things nearby by LiDAR alone; `None` before the first picture, and where LiDAR gave no product for the newest.
    pub fn nearby(&self) -> Option<&[Nearby]> {
        self.newest.as_ref()?.nearby.as_deref()
    }

    /// The track of this number.
    pub fn track(&self, id: TrackId) -> Option<&Track> {
        self.tracks().iter().find(|track| track.id == id)
    }

    /// Ages of the newest tracks and of each stage's last product.
    pub fn measure(&self, measured: Measured, now: Instant) -> Measured {
        let measured = measured.aged(Guard::Tracks, self.newest.as_ref().map(|tracks| now.since(tracks.stamp)));
        Modality::ALL.into_iter().fold(measured, |measured, modality| {
            let product = self.newest.as_ref().and_then(|tracks| tracks.products[modality as usize]);
            measured.aged(Guard::from_modality(modality), product.map(|product| now.since(product.stamp)))
        })
    }

    /// Judges the guards of tracks and stages: a product older than `limit` is lost.
    pub fn judge(&self, findings: Findings, now: Instant, limit: Span) -> Findings {
        let silent = |stamp: Instant| (now.since(stamp) > limit).then_some(Because::Silence(stamp));
        let findings = findings.with_finding(Guard::Tracks, self.newest.as_ref().map_or(NEVER, |t| silent(t.stamp)));
        Modality::ALL.into_iter().fold(findings, |findings, modality| {
            let product = self.newest.as_ref().and_then(|t| t.products[modality as usize]);
            findings.with_finding(Guard::from_modality(modality), product.map_or(NEVER, |p| silent(p.stamp)))
        })
    }
}

/// Silence since the clock's zero.
const NEVER: Option<Because> = Some(Because::Silence(Instant(0)));
