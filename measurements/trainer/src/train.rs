//! The training loop: a fixed number of steps over seeded batches, then the export.

use std::path::Path;
use std::time::Duration;

use burn::module::Module;
use burn::optim::{AdamWConfig, GradientsParams};
use burn::tensor::{Device, Tensor, TensorData};
use burn_onnx::export::OnnxExporter;
use dataset::draw::uniform;
use perception::grid::{COLUMNS, ROWS};
use perception::letterbox::{HEIGHT, WIDTH};
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};

use crate::data::{Example, Target, target};
use crate::harden;
use crate::net::{Net, Wanted, loss};
use crate::sense::Sense;
use crate::worse::worsen;

/// Frames in a batch.
pub(crate) const BATCH: usize = 16;
/// Floats of a frame.
pub(crate) const FRAME: usize = 3 * HEIGHT * WIDTH;
/// Greatest learning rate, of new weights and of those that were trained before.
const RATE: f64 = 4e-3;
const RATE_AGAIN: f64 = 2e-3;
/// Steps over which the rate rises.
const WARM_UP: usize = 40;

/// Beginning of a round, and the frames that it shows.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Kind {
    /// New weights.
    New,
    /// The weights of the round before.
    Again,
    /// Also shifts and prints, and half of each batch is made harder on purpose, by at most this much of 255.
    Hardened(u8),
}

/// Trains for `steps` batches and writes the network to `path` as ONNX; the weights of the round before stand beside it. Gives
/// the processor time it took.
pub(crate) fn train(
    sense: Sense,
    examples: &[Example],
    steps: usize,
    seed: u64,
    kind: Kind,
    path: &Path,
) -> Result<Duration, Box<dyn std::error::Error>> {
    let device = Device::default().autodiff();
    device.seed(seed);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut net = Net::new(sense, &device);
    let mut greatest = RATE;
    if kind != Kind::New {
        (net, greatest) = (net.try_load_file(path.with_extension("bpk"))?, RATE_AGAIN);
    }
    let mut optimiser = AdamWConfig::new().with_weight_decay(1e-3).init();
    let mut mean = 0.0;
    for step in 0..steps {
        let mut batch = Batch::draw(sense, examples, &mut rng);
        if let Kind::Hardened(most) = kind {
            let half = batch.planes.len() / 2;
            let (planes, half) = (&mut batch.planes[..half], &batch.of[..BATCH / 2]);
            harden::perturb(&net.valid(), planes, half, &mut rng, most, &device)?;
        }
        let targets = wanted(batch.targets(), &device);
        let loss = loss(net.forward(batch.input(&device)), targets);
        let value: f32 = loss.clone().into_scalar();
        mean = if step == 0 { value } else { 0.95 * mean + 0.05 * value };
        let gradients = GradientsParams::from_grads(loss.backward(), &net);
        net = optimiser.step(greatest * rate(step, steps), net, gradients);
        if step % 20 == 0 || step + 1 == steps {
            eprintln!("step {step:5} of {steps}: loss {mean:.4}");
        }
        if step % 200 == 199 {
            save(sense, &net.valid(), path)?;
        }
    }
    save(sense, &net.valid(), path)?;
    Ok(cpu())
}

/// Processor time of this process so far.
fn cpu() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec.unsigned_abs() as u32)
}

/// Writes the network as ONNX, and its weights beside it for attacks with gradients.
pub(crate) fn save(sense: Sense, net: &Net, path: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let sample = Tensor::<4>::zeros([1, sense.inputs(), HEIGHT, WIDTH], &Device::default());
    OnnxExporter::new().export(net, sample, Net::forward)?.save(path)?;
    Ok(net.clone().save_file(path.with_extension("bpk"))?)
}

/// Share of the greatest rate: rises over the warm-up, then falls along half a cosine.
fn rate(step: usize, steps: usize) -> f64 {
    if step < WARM_UP {
        return (step + 1) as f64 / WARM_UP as f64;
    }
    let share = (step - WARM_UP) as f64 / (steps - WARM_UP).max(1) as f64;
    0.01 + 0.99 * 0.5 * (1.0 + libm::cos(core::f64::consts::PI * share))
}

/// Frames drawn at random, each perhaps mirrored, brighter or darker.
struct Batch<'a> {
    /// Planes of the network's input, one frame after another.
    planes: Vec<f32>,
    /// The example of each, and true if it is mirrored.
    of: Vec<(&'a Example, bool)>,
}

impl<'a> Batch<'a> {
    fn draw(sense: Sense, examples: &'a [Example], rng: &mut ChaCha8Rng) -> Self {
        let frame = sense.inputs() * HEIGHT * WIDTH;
        let mut batch = Batch { planes: vec![0.0; BATCH * frame], of: Vec::with_capacity(BATCH) };
        for plane in batch.planes.chunks_exact_mut(frame) {
            let example = &examples[rng.next_u32() as usize % examples.len()];
            let mirrored = rng.next_u32() & 1 == 1;
            let gain = 0.8 + 0.4 * uniform(rng);
            // A temperature has no gain.
            let gain = if sense == Sense::Colour { gain } else { 1.0 };
            paint(&example.image, mirrored, gain, plane);
            if sense == Sense::Fused {
                worsen(plane, rng);
            }
            batch.of.push((example, mirrored));
        }
        batch
    }

    fn targets(&self) -> Vec<Target> {
        self.of.iter().map(|(example, mirrored)| target(example, *mirrored)).collect()
    }

    fn input(self, device: &Device) -> Tensor<4> {
        let planes = self.planes.len() / (BATCH * HEIGHT * WIDTH);
        Tensor::from_data(TensorData::new(self.planes, [BATCH, planes, HEIGHT, WIDTH]), device)
    }
}

/// Targets as tensors.
pub(crate) fn wanted(targets: Vec<Target>, device: &Device) -> Wanted {
    let n = targets.len();
    let grid = |channels: usize, of: fn(&Target) -> &Vec<f32>| {
        let values: Vec<f32> = targets.iter().flat_map(|t| of(t).iter().copied()).collect();
        Tensor::from_data(TensorData::new(values, [n, channels, ROWS * COLUMNS]), device)
    };
    Wanted {
        object: grid(1, |t| &t.object),
        asked: grid(1, |t| &t.asked),
        weight: grid(1, |t| &t.weight),
        class: grid(4, |t| &t.class),
        place: grid(4, |t| &t.place),
    }
}

/// Planes of the network's input in 0..1, perhaps mirrored, brighter or darker.
pub(crate) fn paint(image: &[u8], mirrored: bool, gain: f32, plane: &mut [f32]) {
    for (k, pixel) in image.chunks_exact(image.len() / (HEIGHT * WIDTH)).enumerate() {
        let (row, column) = (k / WIDTH, k % WIDTH);
        let column = if mirrored { WIDTH - 1 - column } else { column };
        for (channel, byte) in pixel.iter().enumerate() {
            let value = (f32::from(*byte) / 255.0 * gain).min(1.0);
            plane[channel * HEIGHT * WIDTH + row * WIDTH + column] = value;
        }
    }
}
