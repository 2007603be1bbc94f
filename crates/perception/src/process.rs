//! The process around the core: reads its specification and its models, makes the [`Perception`], and lets `link`
//! drive it.

use std::io::Read;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use link::spec::ServiceSpec;
use serde::{Deserialize, Serialize};
use wire::setup::Setup;

use crate::detector::{Detector, DetectorError};
use crate::model::{MAX_MODEL, Model, ModelError, ModelRef, hex_digest};
use crate::runtime::{self, RuntimeError};
use crate::{Perception, PerceptionConfig};

/// The largest ONNX Runtime library, bytes.
const MAX_LIBRARY: usize = 256 << 20;

/// What a launcher puts into [`ServiceSpec::config`] for perception.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProcessConfig {
    /// The making of the core. The boot is taken from the specification, because a restart raises it.
    pub setup: Setup,
    /// Perception's own configuration.
    pub config: PerceptionConfig,
}

/// Why a model or library named in a configuration is not used.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file could not be read.
    #[error("{path}: {why}")]
    Read {
        /// The file.
        path: String,
        /// Why.
        why: std::io::Error,
    },
    /// The file is not the pinned one.
    #[error("{path}: {why}")]
    Pin {
        /// The file.
        path: String,
        /// Why.
        why: ModelError,
    },
    /// The runtime was refused.
    #[error(transparent)]
    Runtime(#[from] RuntimeError),
    /// The detector was refused.
    #[error(transparent)]
    Detector(#[from] DetectorError),
}

/// Runs the service until its launcher ends it.
pub fn main() -> ExitCode {
    match make() {
        Ok((spec, core)) => link::drive::run(spec, Box::new(core)),
        Err(why) => {
            eprintln!("holdsafe-perception: {why}");
            ExitCode::from(2)
        }
    }
}

fn make() -> Result<(ServiceSpec, Perception), Box<dyn std::error::Error>> {
    let spec = ServiceSpec::from_stdin()?;
    let ProcessConfig { setup, config } = spec.config()?;
    let setup = Setup { boot: spec.boot, ..setup };
    if let Some(library) = config.runtime.as_ref().filter(|_| config.rendered) {
        adopt(library)?;
    }
    let core = match config.detector.as_ref().filter(|_| config.rendered) {
        Some(model) => {
            let detector = Arc::new(detector(model)?);
            Perception::with_detector(setup, config, detector, spec.started())?
        }
        None => Perception::new(setup, config, spec.started())?,
    };
    Ok((spec, core))
}

/// Reads a pinned detector from its file.
///
/// # Errors
/// Unreadable, too large, not the pinned bytes, or refused by the runtime.
pub fn detector(model: &ModelRef) -> Result<Detector, LoadError> {
    let bytes = read(&model.path, MAX_MODEL)?;
    let pin = |why| LoadError::Pin { path: model.path.display().to_string(), why };
    Ok(Detector::new(Model::pinned(&bytes, &model.sha256).map_err(pin)?)?)
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

/// At most `max` bytes and one, so that a larger file is seen to be too large without being read.
fn read(path: &Path, max: usize) -> Result<Vec<u8>, LoadError> {
    let failed = |why| LoadError::Read { path: path.display().to_string(), why };
    let mut bytes = Vec::new();
    let file = std::fs::File::open(path).map_err(failed)?;
    file.take(max as u64 + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() > max {
        let why = ModelError::TooLarge { max, got: bytes.len() };
        return Err(LoadError::Pin { path: path.display().to_string(), why });
    }
    Ok(bytes)
}
