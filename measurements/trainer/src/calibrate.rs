//! Calibration of scores: logistic recalibration (Platt 1999) on tuning frames, folded into the objectness of the network's head,
//! so that no file beside the model has to carry it.
//!
//! A score is objectness times a share for the confidence in the class, which the correction does not reach. So it is fitted to the scores that
//! come of the corrected objectness, again and again, until no correction is left.

use std::error::Error;
use std::path::Path;

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};
use config::platform::Sensors;
use dataset::cells::{self, Split};
use dataset::example::Example as Frame;
use dataset::precision::judge;
use perception::grid::decode;
use perception::letterbox::{HEIGHT, WIDTH};
use sim::Label;

use crate::data::{CELLS, felt, heated, seen, sensed};
use crate::net::Net;
use crate::sense::Sense;
use crate::train::{paint, save};

/// Tuning frames of each cell that is learnt from.
const FRAMES: u64 = 80;
/// Detections below this score are as good as none, permille.
const LEAST: u16 = 100;
/// Steps of Newton's method; it has converged after far fewer.
const STEPS: usize = 30;
/// Corrections of corrections; the last ones change no printed digit.
const ROUNDS: usize = 12;

/// Recalibrates a model and the weights beside it.
pub(crate) fn write(sense: Sense, sensors: &Sensors, directory: &Path) -> Result<(), Box<dyn Error>> {
    let device = Device::default();
    let path = sense.model(directory);
    let net = Net::new(sense, &device).try_load_file(path.with_extension("bpk"))?;
    let frames = frames(sense, sensors, &net, &device)?;
    let (mut slope, mut offset) = (1.0, 0.0);
    for _ in 0..ROUNDS {
        let (further, shift) = fit(&sample(&frames, slope, offset));
        (slope, offset) = (further * slope, further * offset + shift);
        println!("objectness: {slope:.3} x {offset:+.3}");
    }
    save(sense, &net.calibrated(slope as f32, offset as f32, &device), &path)
}

/// Output of the network for a frame, and the objects that there were.
struct Shown {
    raw: Vec<f32>,
    labels: Vec<Label>,
}

fn frames(sense: Sense, sensors: &Sensors, net: &Net, device: &Device) -> Result<Vec<Shown>, Box<dyn Error>> {
    let mut frames = Vec::new();
    for cell in cells::all()?.iter().filter(|cell| cell.learnt) {
        for number in 0..FRAMES {
            let example = match sense {
                Sense::Colour => seen(Frame::new(sensors, cell, Split::Tuning, number)?),
                Sense::Thermal => felt(heated(sensors, cell, Split::Tuning, number, &[])?.0),
                Sense::Fused => sensed(Frame::new(sensors, cell, Split::Tuning, number)?),
            };
            let mut plane = vec![0.0; sense.inputs() * HEIGHT * WIDTH];
            paint(&example.image, false, 1.0, &mut plane);
            let input = Tensor::<4>::from_data(TensorData::new(plane, [1, sense.inputs(), HEIGHT, WIDTH]), device);
            let raw = net.forward(input).into_data().try_to_vec::<f32>()?;
            frames.push(Shown { raw, labels: example.labels.into_iter().chain(example.ignored).collect() });
        }
    }
    Ok(frames)
}

/// Logit of each detection's score, its objectness corrected, and whether it was right.
fn sample(frames: &[Shown], slope: f64, offset: f64) -> Vec<(f64, bool)> {
    let share = |score: u16| (f64::from(score) / 1000.0).clamp(0.001, 0.999);
    let of = |Shown { raw, labels }: &Shown| {
        let mut raw = raw.clone();
        raw[..CELLS].iter_mut().for_each(|object| *object = (f64::from(*object) * slope + offset) as f32);
        let judged = judge(labels, &decode(&raw, LEAST)).judged;
        let logit = |score| libm::log(share(score) / (1.0 - share(score)));
        judged.iter().map(|j| (logit(j.score), j.right)).collect::<Vec<_>>()
    };
    frames.iter().flat_map(of).collect()
}

/// Slope and offset of the greatest likelihood, by Newton's method.
fn fit(sample: &[(f64, bool)]) -> (f64, f64) {
    let (mut slope, mut offset) = (1.0, 0.0);
    for _ in 0..STEPS {
        let (mut g, mut h) = ([0.0; 2], [1e-6, 0.0, 1e-6]);
        for (x, right) in sample {
            let p = 1.0 / (1.0 + libm::exp(-(slope * x + offset)));
            let (miss, weight) = (p - f64::from(u8::from(*right)), p * (1.0 - p));
            g = [g[0] + miss * x, g[1] + miss];
            h = [h[0] + weight * x * x, h[1] + weight * x, h[2] + weight];
        }
        let determinant = h[0] * h[2] - h[1] * h[1];
        slope -= (h[2] * g[0] - h[1] * g[1]) / determinant;
        offset -= (h[0] * g[1] - h[1] * g[0]) / determinant;
    }
    (slope, offset)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calibration_softens_overconfident_scores() {
        // At a logit of 2 (0.88) six of ten are right, at -2 four of ten.
        let sample: Vec<(f64, bool)> =
            (0..100).map(|k| (2.0, k % 10 < 6)).chain((0..100).map(|k| (-2.0, k % 10 < 4))).collect();
        let (slope, offset) = fit(&sample);
        assert!((slope - 0.2027).abs() < 1e-3 && offset.abs() < 1e-6, "{slope} {offset}");
    }
}
