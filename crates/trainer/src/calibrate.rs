//! Calibration of scores: logistic recalibration (Platt 1999) on tuning frames, folded into the objectness of the network's head,
//! so that no file beside the model has to carry it.
//!
//! A score is objectness times the confidence in the class. Where the class is sure, which is nearly everywhere, the score's
//! logit is the objectness, and the correction of the one is right for the other.

use std::error::Error;
use std::path::Path;

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};
use dataset::cells::{self, Split};
use dataset::example::Example as Frame;
use dataset::precision::judge;
use perception::grid::decode;
use perception::letterbox::{HEIGHT, WIDTH};
use sim::Label;
use wire::platform::Sensors;

use crate::data::{felt, heated, seen};
use crate::net::Net;
use crate::sense::Sense;
use crate::train::{paint, save};

/// Tuning frames of each cell that is learnt from.
const FRAMES: u64 = 80;
/// Detections below this score are as good as none, permille.
const LEAST: u16 = 100;
/// Steps of Newton's method; it has converged after far fewer.
const STEPS: usize = 30;

/// Recalibrates a model and the weights beside it.
pub(crate) fn write(sense: Sense, sensors: &Sensors, directory: &Path) -> Result<(), Box<dyn Error>> {
    let device = Device::default();
    let path = sense.model(directory);
    let net = Net::new(sense, &device).try_load_file(path.with_extension("bpk"))?;
    let (slope, offset) = fit(&sample(sense, sensors, &net, &device)?);
    println!("objectness: {slope:.3} x {offset:+.3}");
    save(&net.calibrated(slope as f32, offset as f32, &device), &path)
}

/// Logit of each detection's score, and whether it was right.
fn sample(sense: Sense, sensors: &Sensors, net: &Net, device: &Device) -> Result<Vec<(f64, bool)>, Box<dyn Error>> {
    let mut sample = Vec::new();
    for cell in cells::all()?.iter().filter(|cell| cell.learnt) {
        for number in 0..FRAMES {
            let example = match sense {
                Sense::Colour => seen(Frame::new(sensors, cell, Split::Tuning, number)?),
                Sense::Thermal => felt(heated(sensors, cell, Split::Tuning, number, &[])?.0),
            };
            let mut plane = vec![0.0; 3 * HEIGHT * WIDTH];
            paint(&example.image, false, 1.0, &mut plane);
            let input = Tensor::<4>::from_data(TensorData::new(plane, [1, 3, HEIGHT, WIDTH]), device);
            let raw = net.forward(input).into_data().try_to_vec::<f32>()?;
            let labels: Vec<Label> = example.labels.into_iter().chain(example.ignored).collect();
            let judged = judge(&labels, &decode(&raw, LEAST)).judged;
            let share = |score: u16| (f64::from(score) / 1000.0).clamp(0.001, 0.999);
            sample.extend(judged.iter().map(|j| (libm::log(share(j.score) / (1.0 - share(j.score))), j.right)));
        }
    }
    Ok(sample)
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
