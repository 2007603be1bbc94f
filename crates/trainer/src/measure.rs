//! What a trained detector is worth: recall and precision on held-out scenes, through the pure-Rust runtime and the
//! decoding that the platform uses, and how far corroboration with the other modalities gets from there.

use std::ops::Range;
use std::sync::Arc;

use minicbor::bytes::ByteSlice;
use perception::corroborate::{Limits, corroborate};
use perception::detector::{Detector, DetectorError};
use perception::stages::Stages;
use sim::scene::{Scene, Start};
use sim::{Label, Labelled, render};
use wire::id::FrameId;
use wire::sensor::{Camera, Class, Detection, Frames, Modalities, PixelBox};
use wire::time::Instant;

use crate::data::findable;
use crate::scenes::scene;

/// Shared over united area from which a detection is of an object.
const SAME: f32 = 0.5;
/// A sighting is right within this distance of an object of its class, metres (the bound of property P11).
const NEAR_M: f32 = 2.0;

/// Hits and misses of one class.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tally {
    /// Objects there were.
    pub(crate) objects: u32,
    /// Objects found, with their class.
    pub(crate) found: u32,
    /// Detections of the class.
    pub(crate) given: u32,
    /// Detections that were of an object of the class.
    pub(crate) right: u32,
}

impl Tally {
    /// Share of objects found.
    pub(crate) fn recall(&self) -> f64 {
        f64::from(self.found) / f64::from(self.objects.max(1))
    }

    /// Share of detections that were right.
    pub(crate) fn precision(&self) -> f64 {
        f64::from(self.right) / f64::from(self.given.max(1))
    }

    fn plus(self, other: &Tally) -> Tally {
        Tally {
            objects: self.objects + other.objects,
            found: self.found + other.found,
            given: self.given + other.given,
            right: self.right + other.right,
        }
    }
}

/// Tallies by class, of the detector alone and of standing sightings.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Measured {
    /// Frames.
    pub(crate) frames: u32,
    /// The detector: a box of the right class over the object.
    pub(crate) detector: [Tally; 4],
    /// Corroborated and not vetoed, in place and class.
    pub(crate) sightings: [Tally; 4],
}

/// All classes together.
pub(crate) fn overall(tallies: &[Tally; 4]) -> Tally {
    tallies.iter().fold(Tally::default(), Tally::plus)
}

/// Runs `detector` over the scenes of `seeds`, with detections of at least `least` permille.
pub(crate) fn measure(
    detector: &Arc<Detector>,
    seeds: Range<u64>,
    least: u16,
) -> Result<Measured, Box<dyn std::error::Error>> {
    let limits = Limits { score: least, ..Limits::default() };
    let stages = Stages::new(detector.clone());
    let mut measured = Measured::default();
    for seed in seeds {
        let (scene, start) = scene(seed);
        let frame = render(&scene, start, seed)?;
        measured.frames += 1;
        detections(detector, &frame, least, &mut measured.detector)?;
        sightings(&stages, &limits, &frame, (&scene, &start), &mut measured.sightings);
    }
    Ok(measured)
}

fn detections(
    detector: &Detector,
    frame: &Labelled,
    least: u16,
    tallies: &mut [Tally; 4],
) -> Result<(), DetectorError> {
    let found = detector.detect(&frame.rgb, least)?;
    let fits = |d: &Detection, l: &Label| d.class == l.class && shared(&d.bounds, &l.bounds) >= SAME;
    for label in frame.labels.iter().filter(|l| findable(l)) {
        let tally = &mut tallies[label.class as usize];
        tally.objects += 1;
        tally.found += u32::from(found.iter().any(|d| fits(d, label)));
    }
    for detection in found.iter() {
        // Whoever finds an object that nobody asked for is neither right nor wrong.
        let small = frame.labels.iter().any(|l| !findable(l) && shared(&detection.bounds, &l.bounds) > 0.1);
        if !small {
            let tally = &mut tallies[detection.class as usize];
            tally.given += 1;
            tally.right += u32::from(frame.labels.iter().any(|l| fits(detection, l)));
        }
    }
    Ok(())
}

fn sightings(
    stages: &Stages,
    limits: &Limits,
    frame: &Labelled,
    (scene, start): (&Scene, &Start),
    tallies: &mut [Tally; 4],
) {
    let frames = Frames {
        frame: FrameId(1),
        stamp: Instant(1),
        width: frame.width,
        height: frame.height,
        rgb: Some(<&ByteSlice>::from(frame.rgb.as_slice())),
        depth: Some(<&ByteSlice>::from(frame.depth.as_slice())),
        thermal: Some(<&ByteSlice>::from(frame.thermal.as_slice())),
        lidar: Some(<&ByteSlice>::from(frame.lidar.as_slice())),
    };
    let judged = corroborate(&Camera::GROUND, limits, Modalities::default(), &stages.candidates(&frames, limits.score));
    let seen: Vec<(Class, [f32; 2])> = judged
        .iter()
        .filter_map(|j| j.sighting.filter(|s| s.stands()))
        .map(|s| (s.class, world(start, s.place.map(|v| v as f32))))
        .collect();
    let near = |class: Class, at: [f32; 2], other: (Class, [f32; 2])| {
        let (dx, dy) = (at[0] - other.1[0], at[1] - other.1[1]);
        class == other.0 && (dx * dx + dy * dy).sqrt() <= NEAR_M
    };
    for label in frame.labels.iter().filter(|l| findable(l)) {
        let tally = &mut tallies[label.class as usize];
        let at = scene.objects[usize::from(label.object.0)].path[0];
        tally.objects += 1;
        tally.found += u32::from(seen.iter().any(|s| near(label.class, at, *s)));
    }
    for (class, at) in &seen {
        let tally = &mut tallies[*class as usize];
        tally.given += 1;
        tally.right += u32::from(scene.objects.iter().any(|o| near(*class, *at, (o.class, o.path[0]))));
    }
}

fn world(start: &Start, [forward, left]: [f32; 2]) -> [f32; 2] {
    let (sin, cos) = libm::sincosf(start.heading);
    [start.east + cos * forward - sin * left, start.north + sin * forward + cos * left]
}

fn shared(a: &PixelBox, b: &PixelBox) -> f32 {
    let side = |low: u16, high: u16| f32::from(high.saturating_sub(low));
    let area = |b: &PixelBox| side(b.x0, b.x1) * side(b.y0, b.y1);
    let both = side(a.x0.max(b.x0), a.x1.min(b.x1)) * side(a.y0.max(b.y0), a.y1.min(b.y1));
    both / (area(a) + area(b) - both).max(1.0)
}
