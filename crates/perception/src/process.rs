//! The process around the core: reads its specification and its models, makes the [`Perception`], and lets `link`
//! drive it.
//!
//! A detector from a file is [`load`]ed here alone, by the running process: read, held to its pin, inspected, tried.

pub mod try_detector;

use std::io::Read;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use link::spec::ServiceSpec;
use serde::{Deserialize, Serialize};
use wire::setup::Setup;

use crate::detector::{Brought, Detector, DetectorError};
use crate::letterbox::{HEIGHT, WIDTH};
use crate::model::{MAX_MODEL, Model, ModelError, ModelRef, hex_digest};
use crate::runtime::{self, RuntimeError};
use crate::{Perception, PerceptionConfig};

/// The largest ONNX Runtime library, bytes.
const MAX_LIBRARY: usize = 256 << 20;
/// The most CPU time that a detector may take for a frame, microseconds: half of the time between two frames. The rest
/// is for the other stages of perception, and for other processes on the host.
pub const MOST_CPU_US: u64 = 50_000;
/// Frames on which a detector is tried. The fastest counts: delays in the others are not the model's.
const TRIED: usize = 3;

/// Configuration that a launcher puts into [`ServiceSpec::config`] for perception.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProcessConfig {
    /// The making of the core. The boot is taken from the specification, because a restart raises it.
    pub setup: Setup,
    /// Perception's own configuration.
    pub config: PerceptionConfig,
}

/// Reason for which a model or library named in a configuration is not used.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file could not be read.
    #[error("{path}: {why}")]
    Read {
        /// The file.
        path: String,
        /// Reason.
        why: std::io::Error,
    },
    /// The file is not the pinned one.
    #[error("{path}: {why}")]
    Pin {
        /// The file.
        path: String,
        /// Reason.
        why: ModelError,
    },
    /// The runtime was refused.
    #[error(transparent)]
    Runtime(#[from] RuntimeError),
    /// The detector was refused.
    #[error(transparent)]
    Detector(#[from] DetectorError),
    /// The detector would be behind with its frames.
    #[error("the detector takes {got} us of CPU for a frame on this host, at most {MOST_CPU_US} allowed")]
    Slow {
        /// Measured time, microseconds.
        got: u64,
    },
}

/// Runs the service until its launcher ends it.
pub fn main() -> ExitCode {
    match make() {
        Ok((spec, core)) => link::drive::run(spec, Box::new(core)),
        Err(why) => link::drive::refuse("perception", &why.to_string()),
    }
}

fn make() -> Result<(ServiceSpec, Perception), Box<dyn std::error::Error>> {
    let spec = link::confined::from_stdin("perception")?;
    let ProcessConfig { setup, config } = spec.config()?;
    let setup = Setup { boot: spec.boot, ..setup };
    if let Some(library) = config.runtime.as_ref().filter(|_| config.rendered) {
        adopt(library)?;
    }
    let mut config = config;
    if let Some(brought) = config.detector.as_mut().filter(|_| config.rendered) {
        brought.loaded = Some(Arc::new(load(brought)?));
    }
    let core = Perception::new(setup, config, spec.started())?;
    Ok((spec, core))
}

/// Reads a pinned detector from its file and tries it.
///
/// # Errors
///
/// Unreadable, too large, not the pinned bytes, with parts that a detector does not need, refused by the runtime, of a
/// shape that its head does not read, or too slow for this host.
pub fn load(brought: &Brought) -> Result<Detector, LoadError> {
    let ModelRef { path, sha256 } = &brought.model;
    let bytes = read(path, MAX_MODEL)?;
    let pin = |why| LoadError::Pin { path: path.display().to_string(), why };
    let model = Model::pinned(&bytes, sha256).map_err(pin)?;
    let detector = Detector::with_head(model, brought.head.clone())?;
    match quickest(&detector)? {
        got if got > MOST_CPU_US => Err(LoadError::Slow { got }),
        _ => Ok(detector),
    }
}

/// CPU time of the quickest of some frames, microseconds.
fn quickest(detector: &Detector) -> Result<u64, DetectorError> {
    let mut least = u64::MAX;
    for _ in 0..TRIED {
        let from = link::clock::thread_cpu_us();
        detector.detect(&[0; 3 * WIDTH * HEIGHT], 1000)?;
        least = least.min(link::clock::thread_cpu_us().saturating_sub(from));
    }
    Ok(least)
}

/// Uses a pinned ONNX Runtime library in this process, before any model is loaded.
///
/// # Errors
/// Unreadable, too large, not the pinned bytes, not loadable, or too late.
pub fn adopt(library: &ModelRef) -> Result<(), LoadError> {
    let got = hex_digest(&read(&library.path, MAX_LIBRARY)?);
    if !got.eq_ignore_ascii_case(&library.sha256) {
        let why = ModelError::Changed { pinned: library.sha256.clone(), got };
        return Err(LoadError::Pin { path: library.path.display().to_string(), why });
    }
    Ok(runtime::adopt(&library.path)?)
}

/// The file at `path` under its present hash, for callers without a pin.
///
/// # Errors
///
/// Unreadable or too large.
pub fn pin(path: &Path) -> Result<ModelRef, LoadError> {
    Ok(ModelRef { path: path.to_owned(), sha256: hex_digest(&read(path, MAX_MODEL)?) })
}

/// At most `max` bytes; a larger file is refused by its length, without being read.
fn read(path: &Path, max: usize) -> Result<Vec<u8>, LoadError> {
    let failed = |why| LoadError::Read { path: path.display().to_string(), why };
    let mut bytes = Vec::new();
    let file = link::files::open(path).map_err(failed)?;
    let length = file.metadata().map_err(failed)?.len() as usize;
    if length <= max {
        // It may grow meanwhile.
        file.take(max as u64 + 1).read_to_end(&mut bytes).map_err(failed)?;
    }
    match length.max(bytes.len()) {
        got if got > max => {
            Err(LoadError::Pin { path: path.display().to_string(), why: ModelError::TooLarge { max, got } })
        }
        _ => Ok(bytes),
    }
}
