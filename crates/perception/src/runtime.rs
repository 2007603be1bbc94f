//! The ONNX runtime of this process: pure Rust (`ort-tract`) unless a library was adopted before the first model.
//!
//! `ort` has one backend a process, set once. So there is one [`environment`] here, and [`adopt`] comes too late once
//! it exists. That the library is the one that was meant, by hash, is checked by the process that reads it.

use std::path::Path;
use std::sync::OnceLock;

use ort::environment::Environment;

/// Reason for the lack of a runtime.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RuntimeError {
    /// The library could not be loaded.
    #[error("ONNX Runtime library refused: {0}")]
    Library(String),
    /// A backend is in use already; a process has one.
    #[error("an ONNX backend is in use already; name the library before the first model is loaded")]
    Late,
    /// The backend gave no environment.
    #[error("ONNX backend did not start: {0}")]
    Start(String),
}

static ENVIRONMENT: OnceLock<Result<Environment, RuntimeError>> = OnceLock::new();

/// The environment that sessions are made in; the first call decides for the pure-Rust backend.
///
/// # Errors
/// The backend did not start.
pub fn environment() -> Result<&'static Environment, RuntimeError> {
    let made = ENVIRONMENT
        .get_or_init(|| if ort::set_api(ort_tract::api()) { start(ort::init()) } else { Err(RuntimeError::Late) });
    made.as_ref().map_err(Clone::clone)
}

/// Uses the ONNX Runtime library at `path` in this process. The caller has checked its hash.
///
/// # Errors
/// It cannot be loaded, or a backend is in use already.
pub fn adopt(path: &Path) -> Result<(), RuntimeError> {
    let mut first = false;
    let made = ENVIRONMENT.get_or_init(|| {
        first = true;
        let builder = ort::init_from(path).map_err(|e| RuntimeError::Library(e.to_string()))?;
        start(builder)
    });
    match made {
        // A second call finds the environment of the first: another library would be ignored in silence, so the call
        // fails.
        Ok(_) if first => Ok(()),
        Ok(_) => Err(RuntimeError::Late),
        Err(error) => Err(error.clone()),
    }
}

/// Runtime of the models, in the backend's own words, for a run's manifest.
///
/// # Errors
///
/// The backend did not start.
pub fn describe() -> Result<&'static str, RuntimeError> {
    environment().map(|_| ort::info())
}

fn start(builder: ort::environment::EnvironmentBuilder) -> Result<Environment, RuntimeError> {
    builder.with_telemetry(false).build().map_err(|e| RuntimeError::Start(e.to_string()))
}
