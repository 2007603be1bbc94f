//! What a recorded run has beside what its console showed, moment by moment: what the unit's sensors gave, and why its mode changed.

use std::path::Path;
use std::sync::Arc;

use console::beside::{Beside, Evidence, Image, Mark, Sight};
use link::mouth::MouthError;
use perception::corroborate::Limits;
use perception::stages::Stages;
use viewer::LARGEST;
use wire::bus::body;
use wire::codec::decode;
use wire::core::Topic;
use wire::id::NodeId;
use wire::sensor::{Class, Frames, Lidar, PixelBox};
use wire::time::{Instant, Span};

use super::failure::{Exit, Failure};
use super::recorded::Recorded;
use crate::explain::explain;
use crate::oracle::Micros;
use crate::passed::{Passed, recorded};
use crate::report::explained;

/// Side of the LiDAR's picture from above, pixels, and how much of the ground that is, metres.
const ABOVE: (usize, f32) = (120, 48.0);
/// Temperatures that are black and white, kelvin.
const WARMTH: [f32; 2] = [270.0, 320.0];

/// What a recorded run has beside what was shown.
pub(super) struct Beheld {
    frames: Vec<Passed>,
    /// What looks at frames once more; absent where there are none.
    stages: Option<Stages>,
    /// Every change of mode, with its reasons: when it was, and in words.
    changes: Vec<(Micros, Arc<str>)>,
    /// The run's time less the console's clock, microseconds.
    ahead: i128,
    /// The frame that was looked at last.
    last: Option<(usize, Arc<[Sight]>)>,
}

impl Beheld {
    /// Of the recording in `run`; nothing where it has nothing of the console.
    ///
    /// # Errors
    /// When a log of it is damaged before its end, or the stages cannot be made.
    pub(super) fn open(run: &Path, stages: impl FnOnce() -> Result<Stages, Failure>) -> Result<Option<Self>, Failure> {
        let Recorded { entries, bounds, .. } = Recorded::read(run)?;
        let Some(first) = entries.iter().find(|w| w.entry.node == NodeId::CONSOLE) else { return Ok(None) };
        let ahead = i128::from(first.at) - i128::from(first.entry.at.0);
        let unread = |why: MouthError| Failure::new(Exit::NoEvidence, format!("{}: mouth logs: {why}", run.display()));
        let mut frames = recorded(run, &entries).map_err(unread)?;
        frames.retain(|of| of.topic == Topic::Frames);
        let stages = if frames.is_empty() { None } else { Some(stages()?) };
        let changes = explain(&entries, &bounds).into_iter().map(|of| (of.at_us, explained(&of).into())).collect();
        Ok(Some(Self { frames, stages, changes, ahead, last: None }))
    }

    /// The newest frame at this time of the run, and how long before it was taken in.
    fn sensed(&mut self, on_run: Micros) -> Option<(Arc<[Sight]>, Span)> {
        let place = self.frames.partition_point(|of| of.at <= on_run).checked_sub(1)?;
        let before = Span(on_run - self.frames.get(place)?.at);
        if self.last.as_ref().is_none_or(|(last, _)| *last != place) {
            self.last = Some((place, self.read(place)?.into()));
        }
        self.last.as_ref().map(|(_, sights)| (Arc::clone(sights), before))
    }

    fn read(&self, place: usize) -> Option<Vec<Sight>> {
        let frames: Frames<'_> = decode(body(&self.frames.get(place)?.bytes)?, LARGEST).ok()?;
        let found = self.stages.as_ref()?.candidates(&frames, Limits::default().score);
        let size = (usize::from(frames.width), usize::from(frames.height));
        let image =
            |rgb: Vec<u8>| (rgb.len() == size.0 * size.1 * 3).then_some(Image { width: size.0, height: size.1, rgb });
        let colours = found.rgb.iter().flat_map(|list| list.iter()).map(|d| mark(d.bounds, d.class, d.score)).collect();
        let warm =
            found.thermal.iter().flat_map(|list| list.iter()).map(|b| mark(b.bounds, b.class, b.score)).collect();
        Some(vec![
            sight("colour", "as seen", frames.rgb.and_then(|plane| image(plane.to_vec())), colours),
            sight("depth", "near is bright", frames.depth.and_then(|plane| image(shades(plane, near))), Vec::new()),
            sight(
                "thermal",
                "270 K black, 320 K white",
                frames.thermal.and_then(|plane| image(shades(plane, warmth))),
                warm,
            ),
            sight("LiDAR", "from above, 48 m wide", frames.lidar.map(|ranges| above(ranges)), Vec::new()),
        ])
    }
}

impl Evidence for Beheld {
    fn at(&mut self, at: Instant) -> Beside {
        let Ok(on_run) = Micros::try_from(i128::from(at.0) + self.ahead) else { return Beside::default() };
        let change = self.changes.partition_point(|(at, _)| *at <= on_run).checked_sub(1);
        let because = change.and_then(|place| Some(Arc::clone(&self.changes.get(place)?.1)));
        Beside { sensed: self.sensed(on_run), because }
    }
}

fn sight(name: &'static str, legend: &'static str, image: Option<Image>, marks: Vec<Mark>) -> Sight {
    Sight { name, legend, image, marks }
}

fn mark(bounds: PixelBox, class: Class, score: u16) -> Mark {
    let edges = [bounds.x0, bounds.y0, bounds.x1, bounds.y1].map(f32::from);
    Mark { edges, says: format!("{} {} %", class.name(), score / 10) }
}

/// A plane of 16-bit numbers in grey.
fn shades(plane: &[u8], shade: fn(u16) -> u8) -> Vec<u8> {
    plane.chunks_exact(2).flat_map(|b| [shade(u16::from_le_bytes([b[0], b[1]])); 3]).collect()
}

/// Millimetres: near is bright, black is no return.
fn near(mm: u16) -> u8 {
    if mm == 0 { 0 } else { (255.0 * 3_000.0 / (3_000.0 + f32::from(mm))) as u8 }
}

/// Hundredths of a kelvin.
fn warmth(centikelvin: u16) -> u8 {
    let [black, white] = WARMTH;
    ((f32::from(centikelvin) / 100.0 - black) / (white - black) * 255.0).clamp(0.0, 255.0) as u8
}

/// Where beams came back, from above; the unit stands in the middle.
fn above(ranges: &[u8]) -> Image {
    let ((side, metres), beams) = (ABOVE, Lidar::GROUND);
    let mut rgb = vec![20; side * side * 3];
    let mut dot = |right: f32, up: f32, shade: u8| {
        let [x, y] = [right, -up].map(|at| at / metres * side as f32 + side as f32 / 2.0);
        if (0.0..side as f32).contains(&x) && (0.0..side as f32).contains(&y) {
            let at = (y as usize * side + x as usize) * 3;
            rgb[at..at + 3].fill(shade);
        }
    };
    for (k, range) in ranges.chunks_exact(2).enumerate() {
        let (ring, azimuth) = (k / usize::from(beams.azimuths), k % usize::from(beams.azimuths));
        let range = f32::from(u16::from_le_bytes([range[0], range[1]])) / 1e3;
        let reach = range * libm::cosf((beams.lowest_deg + beams.ring_step_deg * ring as f32).to_radians());
        let (left, ahead) = libm::sincosf((360.0 / f32::from(beams.azimuths) * azimuth as f32).to_radians());
        if range > 0.0 {
            dot(-reach * left, reach * ahead, 210);
        }
    }
    dot(0.0, 0.0, 255);
    Image { width: side, height: side, rgb }
}
