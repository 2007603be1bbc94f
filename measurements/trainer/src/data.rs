//! The data set: rendered frames, and the grid of targets that the network learns.
//!
//! The grid is that of `perception::grid`: cells of 4 pixels, and in each the objectness, one channel a class, and
//! the box as offset of its middle in cells and logarithm of its sides in units of 16 pixels.

use config::platform::Sensors;
use dataset::cells::{self, Cell, Split};
use dataset::draw;
use dataset::example::{Example as Frame, ExampleError, counts};
use perception::bands::bands;
use perception::grid::{CELL, COLUMNS, ROWS, UNIT};
use rand_chacha::ChaCha8Rng;
use rand_core::SeedableRng;
use sha2::{Digest, Sha256};
use sim::Label;
use sim::scene::{Scene, StartPose};
use wire::id::ObjectId;
use wire::sensor::Class;

use crate::sense::Sense;
use crate::views::{SHIFTS, print};

/// Cells of the grid.
pub(crate) const CELLS: usize = ROWS * COLUMNS;

/// Excess over the ground's temperature from which an object is warm, by any heat, kelvin.
const WARM_K: f32 = 8.0;
/// Greatest further excess of a heated object, kelvin.
const HOTTER_K: f32 = 37.0;
/// Greatest shift of a channel of a disguised decoy's coat, of 255.
const SHIFT: f32 = 48.0;
/// Sets the randomness of disguises apart from that of heat.
const DISGUISED: u64 = 0x_D15C_015E;
/// Share of an object's sides within which cells are its own.
const MIDDLE: f32 = 0.4;

/// One frame with its labels.
pub(crate) struct Example {
    /// Image of its network: row-major, a byte a plane of each pixel.
    pub(crate) image: Vec<u8>,
    /// Objects large enough to be found.
    pub(crate) labels: Vec<Label>,
    /// Objects too small to be judged by.
    pub(crate) ignored: Vec<Label>,
}

/// Wanted output of the network for one example, cell by cell.
pub(crate) struct Target {
    /// 1 where an object is.
    pub(crate) object: Vec<f32>,
    /// 0 where no output is asked.
    pub(crate) asked: Vec<f32>,
    /// One over the root of the count of the object's cells, where one is, so that a near object does not drown a far one.
    pub(crate) weight: Vec<f32>,
    /// Four channels, one hot where an object is.
    pub(crate) class: Vec<f32>,
    /// Four channels: offset right and down in cells, logarithms of width and height in units.
    pub(crate) place: Vec<f32>,
}

/// Frames of `sensors` that may be learnt from, the cells in turn, with the hash of all that is in them. `pool`: heat that some fakes bear.
pub(crate) fn examples(
    sense: Sense,
    sensors: &Sensors,
    frames: std::ops::Range<u64>,
    pool: &[Vec<f32>],
) -> Result<(Vec<Example>, String), ExampleError> {
    let learnt: Vec<_> = cells::all()?.iter().filter(|cell| cell.learnt).collect();
    let frames: Vec<u64> = frames.collect();
    let examples = parallel::map(parallel::cores(), &frames, |k| -> Result<_, ExampleError> {
        let (cell, number) = (learnt[*k as usize % learnt.len()], k / learnt.len() as u64);
        Ok(match sense {
            Sense::Colour => seen(Frame::new(sensors, cell, Split::Training, number)?),
            Sense::Thermal => felt(heated(sensors, cell, Split::Training, number, pool)?.0),
            Sense::Fused => sensed(disguised(sensors, cell, number, pool)?),
        })
    })?;
    let mut hash = Sha256::new();
    for example in &examples {
        hash.update(&example.image);
        let mut labels: Vec<&Label> = example.labels.iter().chain(&example.ignored).collect();
        labels.sort_by_key(|l| l.object);
        for l in labels {
            let b = l.bounds;
            let numbers = [l.class as u16, b.x0, b.y0, b.x1, b.y1, l.pixels as u16];
            numbers.iter().for_each(|n| hash.update(n.to_le_bytes()));
        }
    }
    let digest: [u8; 32] = hash.finalize().into();
    Ok((examples, digest.iter().map(|b| format!("{b:02x}")).collect()))
}

/// Visible objects of a frame, with its colour image.
pub(crate) fn seen(frame: Frame) -> Example {
    let frame = frame.frame;
    let (labels, ignored) = frame.labels.into_iter().partition(counts);
    Example { image: frame.rgb, labels, ignored }
}

/// Visible objects of a frame, with the whole image of the fused network. A heated fake keeps its class.
pub(crate) fn sensed(example: Frame) -> Example {
    let image = perception::fused::image(&example.frames()).unwrap_or_default();
    let (labels, ignored) = example.frame.labels.into_iter().partition(counts);
    Example { image, labels, ignored }
}

/// Warm objects of a frame: vehicles and persons as such, any other as an obstacle, which is to say as warm and neither. Other
/// things as cold as the ground are not there.
pub(crate) fn felt(example: Frame) -> Example {
    let Frame { scene, frame, .. } = example;
    let warm = |label: &Label| scene.objects[usize::from(label.object.0)].kelvin >= scene.ground.kelvin + WARM_K;
    let known = |class| matches!(class, Class::Vehicle | Class::Person);
    let mut labels: Vec<Label> = frame.labels.into_iter().filter(|l| known(l.class) || warm(l)).collect();
    labels.iter_mut().filter(|l| !known(l.class)).for_each(|l| l.class = Class::Obstacle);
    let (labels, ignored) = labels.into_iter().partition(counts);
    let image = bands(&frame.thermal, frame.width, frame.height).unwrap_or_default();
    Example { image, labels, ignored }
}

/// A frame to learn from in which fakes are disguised in colour as well: as [`heated`], half of the decoys are painted like vehicles, and
/// half of those that bear heat out of `pool` have a coat shifted at random. So colour alone tells no vehicle from a decoy.
fn disguised(sensors: &Sensors, cell: &Cell, number: u64, pool: &[Vec<f32>]) -> Result<Frame, ExampleError> {
    let (mut scene, start, _) = warmed(cell, Split::Training, number, pool)?;
    let mut rng = ChaCha8Rng::seed_from_u64(number ^ DISGUISED);
    for object in scene.objects.iter_mut().filter(|object| object.class == Class::Decoy) {
        let (painted, shifted) = (draw::uniform(&mut rng) < 0.5, draw::uniform(&mut rng) < 0.5);
        object.disguise.paint = painted.then_some(Class::Vehicle);
        if let Some(heat) = object.print.as_ref().map(|print| print.heat().to_vec()).filter(|_| shifted) {
            let shifts: Vec<f32> = (0..SHIFTS).map(|_| SHIFT * (2.0 * draw::uniform(&mut rng) - 1.0)).collect();
            object.print = print(&shifts, &[]).and_then(|print| print.heated(heat));
        }
    }
    Frame::from_scene(sensors, scene, start, number)
}

/// A frame of a scene in which a third of all decoys and obstacles are heated evenly, and which those are; another third bear heat
/// out of `pool`, if there is any.
pub(crate) fn heated(
    sensors: &Sensors,
    cell: &Cell,
    split: Split,
    number: u64,
    pool: &[Vec<f32>],
) -> Result<(Frame, Vec<ObjectId>), ExampleError> {
    let (scene, start, which) = warmed(cell, split, number, pool)?;
    Ok((Frame::from_scene(sensors, scene, start, number)?, which))
}

/// The scene of [`heated`], and the objects that are heated evenly.
fn warmed(
    cell: &Cell,
    split: Split,
    number: u64,
    pool: &[Vec<f32>],
) -> Result<(Scene, StartPose, Vec<ObjectId>), ExampleError> {
    let (mut scene, start) = draw::scene(cell, split, number)?;
    let mut rng = ChaCha8Rng::seed_from_u64(number);
    let ground = scene.ground.kelvin;
    let mut which = Vec::new();
    for (index, object) in scene.objects.iter_mut().enumerate() {
        if matches!(object.class, Class::Vehicle | Class::Person) {
            continue;
        }
        let mut uniform = || draw::uniform(&mut rng);
        let (lot, share) = (uniform(), uniform());
        if lot < 1.0 / 3.0 {
            object.kelvin = ground + WARM_K + HOTTER_K * share;
            which.push(ObjectId(index as u16));
        } else if let Some(heat) = pool.get((share * pool.len() as f32) as usize).filter(|_| lot < 2.0 / 3.0) {
            object.kelvin = ground + heat.iter().copied().fold(0.0, f32::max);
            object.print = print(&[0.0; SHIFTS], heat);
        }
    }
    Ok((scene, start, which))
}

/// The grid of targets. A cell belongs to the smallest object with a middle part that covers the cell's middle, and in any case
/// to the object with its middle in the cell.
pub(crate) fn target(example: &Example, mirrored: bool) -> Target {
    let mut target = Target {
        object: vec![0.0; CELLS],
        asked: vec![1.0; CELLS],
        weight: vec![0.0; CELLS],
        class: vec![0.0; 4 * CELLS],
        place: vec![0.0; 4 * CELLS],
    };
    for label in &example.ignored {
        cells(label, mirrored, 1.0).for_each(|cell| target.asked[cell] = 0.0);
    }
    let mut labels: Vec<&Label> = example.labels.iter().collect();
    labels.sort_by_key(|l| core::cmp::Reverse(l.pixels));
    for label in &labels {
        cells(label, mirrored, 0.9).for_each(|cell| target.asked[cell] = 0.0);
    }
    for label in labels {
        let [x, y, w, h] = middle(label, mirrored);
        let weight = 1.0 / (cells(label, mirrored, MIDDLE).count() as f32).sqrt();
        for cell in cells(label, mirrored, MIDDLE) {
            (target.object[cell], target.asked[cell], target.weight[cell]) = (1.0, 1.0, weight);
            for class in 0..4 {
                target.class[class * CELLS + cell] = f32::from(u8::from(class == label.class as usize));
            }
            let (column, row) = ((cell % COLUMNS) as f32 + 0.5, (cell / COLUMNS) as f32 + 0.5);
            let place = [x / CELL - column, y / CELL - row, libm::logf(w / UNIT), libm::logf(h / UNIT)];
            place.iter().enumerate().for_each(|(k, v)| target.place[k * CELLS + cell] = *v);
        }
    }
    target
}

/// Middle, width and height in pixels.
fn middle(label: &Label, mirrored: bool) -> [f32; 4] {
    let b = label.bounds;
    let (w, h) = (f32::from(b.x1 - b.x0), f32::from(b.y1 - b.y0));
    let x = f32::from(b.x0) + 0.5 * w;
    [if mirrored { COLUMNS as f32 * CELL - x } else { x }, f32::from(b.y0) + 0.5 * h, w, h]
}

fn cells(label: &Label, mirrored: bool, share: f32) -> impl Iterator<Item = usize> + use<> {
    let [x, y, w, h] = middle(label, mirrored);
    let centre = (y / CELL) as usize * COLUMNS + (x / CELL) as usize;
    (0..CELLS).filter(move |cell| {
        let (column, row) = ((cell % COLUMNS) as f32 + 0.5, (cell / COLUMNS) as f32 + 0.5);
        let inside = (column * CELL - x).abs() <= 0.5 * share * w && (row * CELL - y).abs() <= 0.5 * share * h;
        inside || *cell == centre
    })
}
