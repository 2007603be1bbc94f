//! `--detector FILE --labels FILE`: a custom detector in place of the shipped one. It is tried before any trial runs with it, and runs in a
//! separate process.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use live::child::Services;
use live::detector::Remote;
use perception::brought::Brought;
use perception::detector::Detector;
use perception::process;
use perception::stages::Stages;
use scenario::load_labels;

use super::failure::{Exit, Failure};
use super::quoted;
use config::platform::Sensors;

/// The options that name a custom detector.
#[derive(Clone, Debug, clap::Args)]
pub struct DetectorOptions {
    /// An ONNX detector in place of the shipped one (docs/researcher/detector.md); sensors are then rendered.
    #[arg(long, value_name = "FILE", requires = "labels")]
    detector: Option<PathBuf>,
    /// Decoding of that detector's output, and the meaning of its classes.
    #[arg(long, value_name = "FILE", requires = "detector")]
    labels: Option<PathBuf>,
}

/// A detector with the options that brought it.
#[derive(Clone, Debug)]
pub struct LoadedDetector {
    /// The detector.
    pub brought: Brought,
    /// Command line options that reproduce it.
    pub options: String,
}

impl DetectorOptions {
    /// The named detector, loaded and tried in a separate process.
    pub fn load(&self) -> Result<Option<LoadedDetector>, Failure> {
        let (Some(file), Some(labels)) = (&self.detector, &self.labels) else { return Ok(None) };
        let refused = |error: &dyn std::fmt::Display| {
            Failure::new(Exit::Usage, format!("--detector {}: {error}", file.display()))
        };
        let shell = |path: &Path| quoted(&path.to_string_lossy());
        let options = format!(" --detector {} --labels {}", shell(file), shell(labels));
        let labels = load_labels(labels)?;
        let mut model = process::pin(file).map_err(|e| refused(&e))?;
        if let Some(sha256) = labels.sha256 {
            model.sha256 = sha256;
        }
        let mut brought = Brought::new(model, labels.head);
        let program = std::env::current_exe()?;
        brought.loaded = Some(Arc::new(Remote::start(Services::Own(program), &brought).map_err(|e| refused(&e))?));
        Ok(Some(LoadedDetector { brought, options }))
    }

    /// The files that are named.
    pub fn files(&self) -> [Option<&Path>; 2] {
        [self.detector.as_deref(), self.labels.as_deref()]
    }

    /// The stages of a frame with that detector, or else with the shipped one.
    pub fn stages(&self) -> Result<Stages, Failure> {
        let Some(brought) = self.load()?.and_then(|loaded| loaded.brought.loaded) else {
            return Stages::shipped(&Sensors::GROUND).map_err(Failure::internal);
        };
        let thermal = Arc::new(Detector::thermal(&Sensors::GROUND.camera).map_err(Failure::internal)?);
        Ok(Stages::new(&Sensors::GROUND, brought, thermal))
    }
}
