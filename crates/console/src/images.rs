//! Images of tracks: crops that a unit's signed report vouches for, by their hashes.
//!
//! Crops may come before the report that names them, so the newest wait for it; those that no report names are never
//! shown. Drawing is left to `gui`.

use std::collections::VecDeque;
use std::sync::Arc;

use sha2::{Digest, Sha256};
use wire::codec;
use wire::crop::{CAMERAS, Crop, CropHash, HEIGHT, MAX_CROP, Pixels, WIDTH};
use wire::event::Freshness;
use wire::id::{Boot, TrackId};
use wire::refusal::Refusal;
use wire::report::Report;
use wire::time::{Age, Instant};

use crate::age::{AgeLimits, Aged, Labelled};
use crate::sidecar::{Image, Sight};

/// Crops of one unit that wait for a report: crops of two tracks.
const WAITING: usize = 2 * CAMERAS;

/// Images of one track by the cameras of its unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Images {
    /// Track in the images.
    pub track: TrackId,
    /// Pixels of the camera, each way, in one of the images.
    pub scale: u8,
    /// Images, camera by camera.
    pub sights: Arc<[Sight]>,
}

impl Eq for Images {}

/// Images of one unit's tracks.
#[derive(Clone, Debug, Default)]
pub struct Gallery {
    waiting: VecDeque<(CropHash, Crop)>,
    /// Images of each reported track, at most eight, with the boot in which the track has its number.
    shown: Vec<((Boot, TrackId), Aged<Images>)>,
}

impl Gallery {
    /// Takes a crop as it came.
    ///
    /// # Errors
    /// It is none.
    pub fn take(&mut self, bytes: &[u8]) -> Result<(), Refusal> {
        let crop = codec::decode::<Crop>(bytes, MAX_CROP)?;
        self.waiting.push_front((<[u8; 32]>::from(Sha256::digest(bytes)).into(), crop));
        self.waiting.truncate(WAITING);
        Ok(())
    }

    /// Shows the waiting crops that an accepted report vouches for, and drops images of tracks that it no longer
    /// reports.
    pub fn vouched(&mut self, report: &Report, arrived: Instant, age: Option<Age>) {
        let reported = |id: TrackId| report.tracks.iter().any(|track| track.id == id);
        self.shown.retain(|((boot, id), _)| *boot == report.boot && reported(*id));
        let Some(pictured) = report.pictured.as_ref().filter(|pictured| reported(pictured.track)) else { return };
        let found = |hash: &CropHash| self.waiting.iter().find(|(known, _)| known == hash).map(|(_, crop)| crop);
        let Some(crops) = pictured.crops.iter().map(found).collect::<Option<Vec<_>>>() else { return };
        let (track, one) = (pictured.track, crops.iter().all(|crop| crop.track == pictured.track));
        let Some(scale) = crops.first().map(|crop| crop.scale).filter(|_| one) else { return };
        let images = Images { track, scale, sights: crops.into_iter().map(sight).collect() };
        // So one that is vouched for again is found no more, and its image stays with the age that it has.
        self.waiting.retain(|(hash, _)| !pictured.crops.contains(hash));
        self.shown.retain(|((_, id), _)| *id != track);
        self.shown.push(((report.boot, track), Aged::new(images, arrived, age.map(|age| age.plus(pictured.age)))));
    }

    /// The images shown at `now`; none as old as a unit that is lost.
    pub fn shown(&self, now: Instant, limits: &AgeLimits) -> Vec<Labelled<Images>> {
        let images = self.shown.iter().map(|(_, images)| images.label_at(now, limits));
        images.filter(|images| images.freshness() != Freshness::Lost).collect()
    }
}

/// A crop as a picture.
fn sight(crop: &Crop) -> Sight {
    let metres = |millimetres: u16| f64::from(millimetres) / 1000.0;
    let (name, legend) = match crop.pixels {
        Pixels::Colour(_) => ("colour", "as seen".to_owned()),
        Pixels::Warmth(least, most, _) => ("warmth", format!("{} to {} K", least / 100, most / 100)),
        Pixels::Depth(least, most, _) => ("depth", format!("{:.1} to {:.1} m", metres(least), metres(most))),
    };
    let image = Some(Image { width: WIDTH, height: HEIGHT, rgb: crop.pixels.rgb() });
    Sight { name, legend: legend.into(), image, marks: Vec::new() }
}
