//! The colour detector: one ONNX model, `[1, 3, 120, 160]` in 0..1 to the grid of [`crate::grid`].
//!
//! Input and output are checked when the model is loaded, so that a model of another shape is refused before the
//! first frame. A session is shared by all forks of a core; a run depends on its image alone.

use std::sync::{Mutex, PoisonError};

use ndarray::Array4;
use ort::session::Session;
use ort::session::builder::GraphOptimizationLevel;
use ort::value::TensorRef;
use wire::codec::List;
use wire::sensor::Detection;

use crate::grid::{CHANNELS, COLUMNS, HEIGHT, ROWS, WIDTH, decode};
use crate::model::{Model, ModelError};
use crate::runtime::{RuntimeError, environment};

const OUTPUT: [i64; 4] = [1, CHANNELS as i64, ROWS as i64, COLUMNS as i64];

/// Why there is no detector, or no detections.
#[derive(Debug, thiserror::Error)]
pub enum DetectorError {
    /// The model is not the pinned one.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// There is no runtime.
    #[error(transparent)]
    Runtime(#[from] RuntimeError),
    /// The runtime refused the model or failed on an image.
    #[error("detector: {0}")]
    Session(String),
    /// The model does not give what a detector gives.
    #[error("detector gives {got}, expected {OUTPUT:?}")]
    Shape {
        /// What it gives.
        got: String,
    },
    /// The image is not of the camera's size.
    #[error("image of {got} bytes, expected {}", 3 * WIDTH * HEIGHT)]
    Image {
        /// Its length in bytes.
        got: usize,
    },
}

/// A loaded detector.
#[derive(Debug)]
pub struct Detector {
    /// A run needs the session alone; the lock is held for one frame.
    session: Mutex<Session>,
    input: String,
}

impl Detector {
    /// The detector that this crate ships.
    ///
    /// # Errors
    /// It was edited, or the runtime refused it.
    pub fn built_in() -> Result<Self, DetectorError> {
        Detector::new(Model::built_in()?)
    }

    /// Loads a pinned model and runs it once on a black image.
    ///
    /// # Errors
    /// The runtime refused it, or its shape is not a detector's.
    pub fn new(model: Model<'_>) -> Result<Self, DetectorError> {
        let session = session(model).map_err(|e| DetectorError::Session(e.to_string()))?;
        let [input] = session.inputs() else {
            return Err(DetectorError::Shape { got: format!("{} inputs", session.inputs().len()) });
        };
        let input = input.name().to_owned();
        let detector = Detector { session: Mutex::new(session), input };
        detector.detect(&[0; 3 * WIDTH * HEIGHT], 1000)?;
        Ok(detector)
    }

    /// Detections of at least `least` permille in a row-major RGB image, best first.
    ///
    /// # Errors
    /// The image is of another size, or the runtime failed.
    pub fn detect(&self, rgb: &[u8], least: u16) -> Result<List<Detection, 32>, DetectorError> {
        let image = image(rgb)?;
        let failed = |e: ort::Error| DetectorError::Session(e.to_string());
        let mut session = self.session.lock().unwrap_or_else(PoisonError::into_inner);
        let tensor = TensorRef::from_array_view(&image).map_err(failed)?;
        let outputs = session.run(ort::inputs![self.input.as_str() => tensor]).map_err(failed)?;
        let Some(first) = outputs.values().next() else {
            return Err(DetectorError::Shape { got: "nothing".to_owned() });
        };
        let (shape, raw) = first.try_extract_tensor::<f32>().map_err(failed)?;
        if shape[..] != OUTPUT || raw.len() != CHANNELS * ROWS * COLUMNS {
            return Err(DetectorError::Shape { got: format!("{shape:?}") });
        }
        Ok(decode(raw, least))
    }
}

fn session(model: Model<'_>) -> Result<Session, Box<dyn std::error::Error>> {
    let builder = Session::builder(environment()?)?.with_intra_threads(1)?.with_inter_threads(1)?;
    Ok(builder.with_optimization_level(GraphOptimizationLevel::Level3)?.commit_from_memory(model.bytes())?)
}

/// Planes of red, green and blue in 0..1.
fn image(rgb: &[u8]) -> Result<Array4<f32>, DetectorError> {
    if rgb.len() != 3 * WIDTH * HEIGHT {
        return Err(DetectorError::Image { got: rgb.len() });
    }
    let value = |(_, channel, row, column): (usize, usize, usize, usize)| {
        f32::from(rgb[3 * (row * WIDTH + column) + channel]) / 255.0
    };
    Ok(Array4::from_shape_fn((1, 3, HEIGHT, WIDTH), value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_detector_repeats_itself_to_the_last_bit() {
        let detector = Detector::built_in().unwrap();
        let rgb: Vec<u8> = (0..3 * WIDTH * HEIGHT).map(|k| (k * 7 % 251) as u8).collect();
        assert_eq!(detector.detect(&rgb, 10).unwrap(), detector.detect(&rgb, 10).unwrap());
    }

    #[test]
    fn bytes_that_are_no_model_and_images_of_another_size_are_refused_by_name() {
        let junk = b"not a model";
        let model = Model::pinned(junk, &crate::model::hex_digest(junk)).unwrap();
        assert!(matches!(Detector::new(model), Err(DetectorError::Session(_))));
        let detector = Detector::built_in().unwrap();
        assert!(matches!(detector.detect(&[0; 12], 500), Err(DetectorError::Image { got: 12 })));
    }
}
