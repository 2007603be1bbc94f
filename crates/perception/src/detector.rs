//! A detector: one ONNX model over `[1, planes, H, W]` in 0..1, and the [`Head`] that reads its output. Colour has
//! three planes, and so has the thermal stage's image; the fused one ([`crate::fused`]) has seven. A run may bring a
//! custom colour detector in place of the shipped one.
//!
//! The file is inspected before the runtime reads it; input and output are checked when the model is loaded, so that
//! one of another shape is refused before the first frame. A session is shared by all forks of a core; a run depends on
//! its image alone.

use std::sync::{Mutex, PoisonError};

use ort::session::Session;
use ort::session::builder::GraphOptimizationLevel;
use ort::value::{Outlet, TensorElementType, TensorRef};
use wire::codec::List;
use wire::sensor::{Camera, Detection};

use crate::fused;
use crate::head::Head;
use crate::letterbox::{HEIGHT, Letterbox, SIDES, WIDTH};
use crate::model::{Model, ModelError, Networks};
use crate::onnx::{Inspected, OnnxError};
use crate::runtime::{RuntimeError, environment};

/// Reason for the lack of a detector, or of detections.
#[derive(Debug, thiserror::Error)]
pub enum DetectorError {
    /// The model is not the pinned one.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The file holds parts that no detector needs, or is no model.
    #[error(transparent)]
    Onnx(#[from] OnnxError),
    /// There is no runtime.
    #[error(transparent)]
    Runtime(#[from] RuntimeError),
    /// The runtime refused the model or failed on an image.
    #[error("detector: {0}")]
    Session(String),
    /// The model's input is not that of the head's detectors.
    #[error("detector takes {got}, expected one float32 tensor {wanted}")]
    Input {
        /// Sides that fit.
        wanted: String,
        /// Input of the model.
        got: String,
    },
    /// The model's output does not suit the head.
    #[error("detector gives {got}, expected one float32 tensor {wanted}")]
    Output {
        /// The shape that fits.
        wanted: String,
        /// Output of the model.
        got: String,
    },
    /// The process that it runs in ended, was silent, or refused it.
    #[error("detector: {0}")]
    Process(String),
    /// The image is not of the camera's size.
    #[error("image of {got} bytes, expected {wanted}")]
    Image {
        /// Length that fits.
        wanted: usize,
        /// Length of the image in bytes.
        got: usize,
    },
}

/// A loaded detector.
#[derive(Debug)]
pub struct Detector {
    /// A run needs the session alone; the lock is held for one frame.
    session: Mutex<Session>,
    input: String,
    /// Planes of its image.
    planes: usize,
    letterbox: Letterbox,
    head: Head,
}

impl Detector {
    /// The detector that this crate ships for views from about this camera's height.
    ///
    /// # Errors
    /// It was edited, or the runtime refused it.
    pub fn built_in(camera: &Camera) -> Result<Self, DetectorError> {
        Detector::new(Networks::for_camera(camera).detector()?)
    }

    /// The network of the thermal stage that this crate ships for them.
    ///
    /// # Errors
    /// It was edited, or the runtime refused it.
    pub fn thermal(camera: &Camera) -> Result<Self, DetectorError> {
        Detector::new(Networks::for_camera(camera).thermal()?)
    }

    /// The network over all the cameras at once that this crate ships for them, if there is one.
    ///
    /// # Errors
    /// It was edited, or the runtime refused it.
    pub fn fused(camera: &Camera) -> Result<Option<Self>, DetectorError> {
        Networks::for_camera(camera)
            .fused()?
            .map(|model| Detector::with_planes(fused::PLANES, model, Head::Grid))
            .transpose()
    }

    /// [`Detector::with_head`] for a model of the shipped one's shapes.
    ///
    /// # Errors
    /// The same.
    pub fn new(model: Model<'_>) -> Result<Self, DetectorError> {
        Detector::with_head(model, Head::Grid)
    }

    /// Inspects and loads a pinned model, and runs it once on a black image.
    ///
    /// # Errors
    /// The file is unwanted, the runtime refused it, or it does not fit the head.
    pub fn with_head(model: Model<'_>, head: Head) -> Result<Self, DetectorError> {
        Detector::with_planes(3, model, head)
    }

    /// A detector for an image of a given number of planes.
    ///
    /// # Errors
    /// The same.
    pub fn with_planes(planes: usize, model: Model<'_>, head: Head) -> Result<Self, DetectorError> {
        let session = session(&Inspected::new(model)?).map_err(|e| DetectorError::Session(one_line(&e.to_string())))?;
        let (input, letterbox) = input(session.inputs(), planes, &head)?;
        let [_] = session.outputs() else {
            return Err(DetectorError::Output { wanted: head.wanted(), got: describe_outlets(session.outputs()) });
        };
        let detector = Detector { session: Mutex::new(session), input, planes, letterbox, head };
        // Tried once: a model that fails, or gives another output than it states, is refused before the run.
        detector.detect(&vec![0; planes * WIDTH * HEIGHT], 1000)?;
        Ok(detector)
    }

    /// Detections of at least `least` permille in a row-major image with a byte a plane of each pixel, best first.
    ///
    /// # Errors
    /// The image is of another size, or the runtime failed.
    pub fn detect(&self, image: &[u8], least: u16) -> Result<List<Detection, 32>, DetectorError> {
        let wanted = self.planes * WIDTH * HEIGHT;
        if image.len() != wanted {
            return Err(DetectorError::Image { wanted, got: image.len() });
        }
        let image = self.letterbox.tensor(image);
        let failed = |e: ort::Error| DetectorError::Session(one_line(&e.to_string()));
        let other = |got: String| DetectorError::Output { wanted: self.head.wanted(), got };
        let mut session = self.session.lock().unwrap_or_else(PoisonError::into_inner);
        let tensor = TensorRef::from_array_view(&image).map_err(failed)?;
        let outputs = session.run(ort::inputs![self.input.as_str() => tensor]).map_err(failed)?;
        let first = outputs.values().next().ok_or_else(|| other("nothing".to_owned()))?;
        // A tensor without elements has no address, and must not be looked into: its shape comes first.
        let floats = first.dtype().tensor_type() == Some(TensorElementType::Float32);
        let shape = first.dtype().tensor_shape().filter(|shape| floats && self.head.reads(shape));
        let shape = shape.ok_or_else(|| other(first.dtype().to_string()))?;
        let (_, raw) = first.try_extract_tensor::<f32>().map_err(failed)?;
        Ok(self.head.decode(raw, shape, &self.letterbox, least))
    }
}

fn session(model: &Inspected<'_>) -> Result<Session, Box<dyn std::error::Error>> {
    let builder = Session::builder(environment()?)?.with_intra_threads(1)?.with_inter_threads(1)?;
    Ok(builder.with_optimization_level(GraphOptimizationLevel::Level3)?.commit_from_memory(model.bytes())?)
}

/// The name of the one input, and how the camera's image is put into it.
fn input(inputs: &[Outlet], planes: usize, head: &Head) -> Result<(String, Letterbox), DetectorError> {
    let fits = || {
        let [only] = inputs else { return None };
        let floats = only.dtype().tensor_type() == Some(TensorElementType::Float32);
        let [1, channels, height, width] = only.dtype().tensor_shape().filter(|_| floats)?[..] else { return None };
        if usize::try_from(channels) != Ok(planes) {
            return None;
        }
        let letterbox = Letterbox::new(usize::try_from(height).ok()?, usize::try_from(width).ok()?)?;
        head.sees(&letterbox).then(|| (only.name().to_owned(), letterbox))
    };
    fits().ok_or_else(|| {
        let wanted = match head {
            Head::Grid => format!("[1, {planes}, {HEIGHT}, {WIDTH}]"),
            Head::Yolo(_) => {
                format!("[1, {planes}, H, W] with H and W fixed from {} to {}", SIDES.start(), SIDES.end())
            }
        };
        DetectorError::Input { wanted, got: describe_outlets(inputs) }
    })
}

fn describe_outlets(outlets: &[Outlet]) -> String {
    let each: Vec<String> = outlets.iter().take(4).map(|outlet| outlet.dtype().to_string()).collect();
    format!("{} tensors ({})", outlets.len(), each.join(", "))
}

/// First line of a runtime's message: a message may contain whole operators.
fn one_line(words: &str) -> String {
    words.lines().next().unwrap_or_default().chars().take(300).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shipped_detectors_repeat_to_the_last_bit() {
        for detector in [Detector::built_in(&Camera::GROUND).unwrap(), Detector::thermal(&Camera::GROUND).unwrap()] {
            let image: Vec<u8> = (0..3 * WIDTH * HEIGHT).map(|k| (k * 7 % 251) as u8).collect();
            assert_eq!(detector.detect(&image, 10).unwrap(), detector.detect(&image, 10).unwrap());
        }
    }

    #[test]
    fn wrong_bytes_and_sizes_are_refused_by_name() {
        let junk = b"not a model";
        let model = Model::pinned(junk, &crate::model::hex_digest(junk)).unwrap();
        assert!(matches!(Detector::new(model), Err(DetectorError::Onnx(_))));
        let detector = Detector::built_in(&Camera::GROUND).unwrap();
        assert!(matches!(detector.detect(&[0; 12], 500), Err(DetectorError::Image { got: 12, .. })));
    }
}
