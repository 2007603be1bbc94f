//! The process around the core: reads its specification and its models, makes the [`Perception`], and lets `link`
//! drive it.
//!
//! A detector from a file is [`load`]ed here alone, by the running process: read, held to its pin, inspected, tried.

pub mod detector;

use std::fs::File;
use std::io::Read;
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use config::setup::Setup;
use link::spec::ServiceSpec;
use serde::{Deserialize, Serialize};

use crate::brought::Brought;
use crate::detector::{Detector, DetectorError};
use crate::model::{MAX_MODEL, Model, ModelError, ModelRef, hex_digest};
use crate::runtime::{self, RuntimeError};
use crate::sight::Sight;
use crate::{Perception, PerceptionConfig, letterbox};

/// The largest ONNX Runtime library, bytes.
const MAX_LIBRARY: usize = 256 << 20;
/// The most CPU time that a detector may take for a frame, microseconds: half of the time between two frames. The rest
/// is for the other stages of perception, and for other processes on the host.
pub const MOST_CPU_US: u64 = 50_000;
/// Images on which a detector is tried, a black one and others. The fastest counts: delays in the others are not the
/// model's.
const TRIED: u64 = 8;

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
        /// Path of the file.
        path: String,
        /// Reason of the failure.
        why: std::io::Error,
    },
    /// The file is not the pinned one.
    #[error("{path}: {why}")]
    Pin {
        /// Path of the file.
        path: String,
        /// Reason of the refusal.
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

/// Runs the service until its launcher ends it. It can start no detector of others.
pub fn main() -> ExitCode {
    main_with(|_, _| Err("this program starts no detectors".into()))
}

/// Runs the service until its launcher ends it; `start` starts the process of a detector that the configuration names,
/// with its own runtime where one is named.
pub fn main_with(start: impl FnOnce(&Brought, Option<&ModelRef>) -> Result<Arc<dyn Sight>, String>) -> ExitCode {
    match make(start) {
        Ok((spec, core)) => link::drive::run(spec, Box::new(core)),
        Err(why) => link::drive::refuse("perception", &why.to_string()),
    }
}

fn make(
    start: impl FnOnce(&Brought, Option<&ModelRef>) -> Result<Arc<dyn Sight>, String>,
) -> Result<(ServiceSpec, Perception), Box<dyn std::error::Error>> {
    let spec = ServiceSpec::from_stdin()?;
    let ProcessConfig { setup, mut config } = spec.config()?;
    let setup = Setup { boot: spec.boot, ..setup };
    // A detector of others has a process and its own confinement.
    if let Some(brought) = config.detector.as_mut().filter(|_| config.rendered) {
        brought.loaded = Some(start(brought, config.runtime.as_ref())?);
    }
    let spec = link::confined::confine(spec, "perception")?;
    if let Some(library) = config.runtime.as_ref().filter(|_| config.rendered) {
        adopt(library)?;
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
    for number in 0..TRIED {
        let image = drawn(number);
        let from = link::clock::thread_cpu_us();
        detector.detect(&image, 1000)?;
        least = least.min(link::clock::thread_cpu_us().saturating_sub(from));
    }
    Ok(least)
}

/// An image to try a model on: the first is black, each other one drawn from its number.
fn drawn(number: u64) -> Vec<u8> {
    let mut state = number;
    // SplitMix64 (Steele, Lea and Flood, 2014).
    let next = |_| {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ (mixed >> 31)) as u8
    };
    let bytes = 3 * letterbox::WIDTH * letterbox::HEIGHT;
    if number == 0 { vec![0; bytes] } else { (0..bytes).map(next).collect() }
}

/// Uses a pinned ONNX Runtime library in this process, before any model is loaded.
///
/// # Errors
/// Unreadable, too large, not the pinned bytes, not loadable, or too late.
pub fn adopt(library: &ModelRef) -> Result<(), LoadError> {
    let file = held(library)?;
    Ok(runtime::adopt(&loadable(&file, &library.path))?)
}

/// The library, open, after its content was held to its pin.
fn held(library: &ModelRef) -> Result<File, LoadError> {
    let file = opened(&library.path)?;
    let got = hex_digest(&content(&file, &library.path, MAX_LIBRARY)?);
    if !got.eq_ignore_ascii_case(&library.sha256) {
        let why = ModelError::Changed { pinned: library.sha256.clone(), got };
        return Err(LoadError::Pin { path: library.path.display().to_string(), why });
    }
    Ok(file)
}

/// Path by which the loader gets the open file itself: another file may have taken its place at `path` since.
fn loadable(file: &File, path: &Path) -> PathBuf {
    let open = PathBuf::from(format!("/proc/self/fd/{}", file.as_raw_fd()));
    // A process with a root of its own has no /proc; there `path` is a mount of this one file, which no other replaces.
    if open.exists() { open } else { path.to_owned() }
}

/// The file at `path` under its present hash, for callers without a pin.
///
/// # Errors
///
/// Unreadable or too large.
pub fn pin(path: &Path) -> Result<ModelRef, LoadError> {
    Ok(ModelRef { path: path.to_owned(), sha256: hex_digest(&read(path, MAX_MODEL)?) })
}

fn opened(path: &Path) -> Result<File, LoadError> {
    link::files::open(path).map_err(|why| LoadError::Read { path: path.display().to_string(), why })
}

fn read(path: &Path, max: usize) -> Result<Vec<u8>, LoadError> {
    content(&opened(path)?, path, max)
}

/// At most `max` bytes of the file that was opened at `path`; a larger one is refused by its length, without being read.
fn content(file: &File, path: &Path, max: usize) -> Result<Vec<u8>, LoadError> {
    let failed = |why| LoadError::Read { path: path.display().to_string(), why };
    let mut bytes = Vec::new();
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

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    /// The loader gets the bytes that were hashed, though another file has taken their place at the path.
    #[test]
    fn a_library_swapped_after_its_hash_is_not_loaded() {
        let folder = std::env::temp_dir().join(format!("holdsafe-library-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let [path, other] = ["lib.so", "other.so"].map(|name| folder.join(name));
        fs::write(&path, "pinned").unwrap();
        let library = ModelRef { path: path.clone(), sha256: hex_digest(b"pinned") };
        let file = held(&library).unwrap();
        fs::write(&other, "another").unwrap();
        fs::rename(&other, &path).unwrap();
        assert_eq!(fs::read(loadable(&file, &path)).unwrap(), b"pinned");
        assert!(matches!(held(&library), Err(LoadError::Pin { .. })));
        fs::remove_dir_all(&folder).unwrap();
    }
}
