//! Changes of pixels, by strength, that fool the detector when its weights are known, and the share of them that the other
//! modalities let stand.
//!
//! Projected gradient descent (Madry et al. 2018) on the colour image alone, bounded in each channel of each pixel and rounded to
//! whole bytes as a camera gives them: once to hide objects, once to have decoys taken for vehicles. Beside it noise of the same
//! size without a purpose. Depth, thermal and LiDAR are as they were: this is one modality deceived, and fusion has the others.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};
use config::platform::Sensors;
use dataset::cells::{self, Split};
use dataset::example::{Example as Frame, counts};
use dataset::sightings::stands_near;
use perception::corroborate::CorroborationLimits;
use perception::detector::Detector;
use perception::letterbox::{HEIGHT, WIDTH};
use perception::model::{Model, hex_digest};
use perception::stages::Stages;
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use wire::sensor::Class;

use crate::data::{Example, target};
use crate::interval::wilson;
use crate::net::{Net, loss};
use crate::sense::Sense;
use crate::train::{paint, wanted};

/// Strengths, of 255, fixed before anything was measured.
const STRENGTHS: [u8; 7] = [0, 1, 2, 4, 8, 16, 32];
/// Steps of descent.
const STEPS: usize = 10;
/// Frames, the cells that are learnt from in turn.
const FRAMES: u64 = 60;

#[derive(Clone, Copy, PartialEq)]
enum Goal {
    /// Noise, for comparison.
    None,
    /// No object is found.
    Hide,
    /// Decoys are vehicles.
    Impersonate,
}

/// Results of one goal at one strength.
#[derive(Clone, Copy, Default)]
struct Tally {
    /// Count of the objects, and of those that are found under their own class.
    objects: [u32; 2],
    /// Count of the decoys, of those that the detector calls vehicles, and of those that stand as vehicles after corroboration.
    decoys: [u32; 3],
}

/// Attacks `directory/detector.onnx` through the weights beside it and writes `robustness.md`.
pub(crate) fn write(directory: &Path, frames: Option<u64>) -> Result<(), Box<dyn Error>> {
    let device = Device::default().autodiff();
    let net = Net::new(Sense::Colour, &Device::default()).try_load_file(directory.join("detector.bpk"))?;
    let bytes = std::fs::read(directory.join("detector.onnx"))?;
    let sha256 = hex_digest(&bytes);
    let stages = Stages::new(
        &Sensors::GROUND,
        Arc::new(Detector::new(Model::pinned(&bytes, &sha256)?)?),
        Arc::new(Detector::thermal(&Sensors::GROUND.camera)?),
    );
    let mut rows = String::new();
    for goal in [Goal::None, Goal::Hide, Goal::Impersonate] {
        for strength in STRENGTHS {
            let mut tally = Tally::default();
            let learnt: Vec<_> = cells::all()?.iter().filter(|cell| cell.learnt).collect();
            for k in 0..frames.unwrap_or(FRAMES) {
                let frame =
                    Frame::new(&Sensors::GROUND, learnt[k as usize % learnt.len()], Split::HeldOut, 10_000 + k)?;
                let rgb = perturb(&net, &frame, goal, strength, &device)?;
                judge(&stages, frame, rgb, &mut tally);
            }
            let row = row(goal, strength, &tally);
            eprint!("{row}");
            rows += &row;
        }
    }
    let text = page(&sha256, frames.unwrap_or(FRAMES), &rows);
    std::fs::write(directory.join("robustness.md"), &text)?;
    println!("{text}");
    Ok(())
}

/// The colour image, changed by at most `strength` in each byte.
fn perturb(net: &Net, frame: &Frame, goal: Goal, strength: u8, device: &Device) -> Result<Vec<u8>, Box<dyn Error>> {
    let clean = &frame.frame.rgb;
    let bound = f32::from(strength) / 255.0;
    let mut rng = ChaCha8Rng::seed_from_u64(u64::from(strength));
    if strength == 0 || goal == Goal::None {
        let noise = |byte: &u8| {
            if rng.next_u32() & 1 == 0 { byte.saturating_sub(strength) } else { byte.saturating_add(strength) }
        };
        return Ok(clean.iter().map(noise).collect());
    }
    let mut labels: Vec<_> = frame.frame.labels.iter().copied().filter(counts).collect();
    if goal == Goal::Impersonate {
        labels.iter_mut().filter(|l| l.class == Class::Decoy).for_each(|l| l.class = Class::Vehicle);
    }
    let example = Example { image: clean.clone(), labels, ignored: Vec::new() };
    let mut plane = vec![0.0; 3 * HEIGHT * WIDTH];
    paint(clean, false, 1.0, &mut plane);
    let tensor = |plane: Vec<f32>| Tensor::<4>::from_data(TensorData::new(plane, [1, 3, HEIGHT, WIDTH]), device);
    let (first, step) = (tensor(plane.clone()), bound / 4.0);
    // Downhill towards the wanted labels, uphill away from the true ones.
    let sign = if goal == Goal::Impersonate { -step } else { step };
    let mut image = first.clone();
    for _ in 0..STEPS {
        let input = image.detach().require_grad();
        let gradients = loss(net.forward(input.clone()), wanted(vec![target(&example, false)], device)).backward();
        let gradient = input.grad(&gradients).ok_or("no gradient at the image")?;
        let moved = input.inner() + gradient.sign() * sign;
        let apart = (moved - first.clone().inner()).clamp(-bound, bound);
        image = (first.clone().inner() + apart).clamp(0.0, 1.0).autodiff();
    }
    let values = image.inner().into_data().convert::<f32>().iter::<f32>().collect::<Vec<_>>();
    let at = |k: usize| values[(k % 3) * HEIGHT * WIDTH + k / 3] * 255.0;
    // Rounding must not carry a byte beyond the bound.
    let byte = |(k, clean): (usize, &u8)| {
        let rounded = libm::roundf(at(k)).clamp(0.0, 255.0) as u8;
        rounded.clamp(clean.saturating_sub(strength), clean.saturating_add(strength))
    };
    Ok(clean.iter().enumerate().map(byte).collect())
}

fn judge(stages: &Stages, mut frame: Frame, rgb: Vec<u8>, tally: &mut Tally) {
    frame.frame.rgb = rgb;
    let limits = CorroborationLimits::default();
    let candidates = stages.candidates(&frame.frames(), limits.score).candidates;
    let found = candidates.rgb.as_deref().unwrap_or_default();
    for label in frame.frame.labels.iter().filter(|l| counts(l)) {
        let called = |class| found.iter().any(|d| d.class == class && d.bounds.shared(&label.bounds) >= 0.5);
        tally.objects[0] += 1;
        tally.objects[1] += u32::from(called(label.class));
        if label.class == Class::Decoy {
            tally.decoys[0] += 1;
            tally.decoys[1] += u32::from(called(Class::Vehicle));
            tally.decoys[2] += u32::from(stands_near(stages, &limits, &frame, label.object, Class::Vehicle));
        }
    }
}

fn row(goal: Goal, strength: u8, tally: &Tally) -> String {
    let name = match goal {
        Goal::None => "noise",
        Goal::Hide => "hide",
        Goal::Impersonate => "decoys as vehicles",
    };
    let mut row = format!("| {name} | {strength} |");
    for (k, n) in
        [(tally.objects[1], tally.objects[0]), (tally.decoys[1], tally.decoys[0]), (tally.decoys[2], tally.decoys[0])]
    {
        let [low, high] = wilson(k, n);
        // Writing to a String cannot fail.
        let _ = write!(row, " {k}/{n} ({:.0}–{:.0}) |", 100.0 * low, 100.0 * high);
    }
    row + "\n"
}

fn page(sha256: &str, frames: u64, rows: &str) -> String {
    format!(
        "# The colour detector under attack\n\n\
         Written by `trainer pixels` for the model with SHA-256 `{sha256}`: projected gradient descent with the model's own weights, \
         {STEPS} steps, each byte of the colour image changed by at most the strength (of 255), on {frames} held-out frames of the \
         cells that were learnt from. Strengths were fixed before measuring. *Found*: objects detected under their \
         own class. *Called vehicles*: decoys, by the detector alone. *Stand as vehicles*: decoys that corroboration with depth, \
         LiDAR and thermal, which are not attacked, leaves standing as vehicles in a single frame. Intervals are Wilson's, \
         95 %, in per cent.\n\n\
         | attack | strength | found | decoys called vehicles | decoys that stand as vehicles |\n|---|---|---|---|---|\n{rows}\n\
         An attacker who also warms the decoy is `decoy_warm`.\n"
    )
}
