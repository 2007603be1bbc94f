//! Newest crops of a track: their hashes for the unit's report, and the crops themselves until they are sent.

use sha2::{Digest, Sha256};
use wire::codec;
use wire::crop::Pictured;
use wire::time::{Instant, Span};
use wire::track::Tracks;

/// The newest crops of one track, with those that are still to be sent.
#[derive(Clone, Debug, Default)]
pub struct Crops {
    newest: Option<(Pictured, Instant)>,
    unsent: Vec<Vec<u8>>,
}

impl Crops {
    /// Takes the crops in an accepted message, if there are any, in place of those before. Of a track that is gone none
    /// stays.
    pub fn take(&mut self, tracks: &Tracks) {
        self.newest.take_if(|(newest, _)| tracks.tracks.iter().all(|track| track.id != newest.track));
        let Some(first) = tracks.crops.first() else { return };
        self.unsent = tracks.crops.iter().map(codec::encode).collect();
        let crops = self.unsent.iter().map(|bytes| <[u8; 32]>::from(Sha256::digest(bytes)).into()).collect();
        self.newest = Some((Pictured { track: first.track, age: Span::ZERO, crops }, tracks.stamp));
    }

    /// Hashes of the newest crops, for a report made at `now`.
    pub fn pictured(&self, now: Instant) -> Option<Pictured> {
        self.newest.as_ref().map(|(pictured, stamp)| Pictured { age: now.since(*stamp), ..pictured.clone() })
    }

    /// Takes out those that were not sent yet.
    pub fn unsent(&mut self) -> Vec<Vec<u8>> {
        core::mem::take(&mut self.unsent)
    }
}
