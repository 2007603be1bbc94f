//! The target of an attack: the stages that run, and the weights that an attacker has of them.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use burn::module::Module;
use burn::tensor::Device;
use config::platform::Sensors;
use perception::detector::Detector;
use perception::head::Head;
use perception::model::{Model, hex_digest};
use perception::stages::Stages;

use crate::net::Net;
use crate::sense::Sense;

/// A network by its file and its weights.
pub(crate) struct Victim {
    pub(crate) sha256: String,
    pub(crate) net: Net,
    pub(crate) detector: Arc<Detector>,
}

impl Victim {
    pub(crate) fn read(sense: Sense, directory: &Path) -> Result<Self, Box<dyn Error>> {
        let path = sense.model(directory);
        let net = Net::new(sense, &Device::default()).try_load_file(path.with_extension("bpk"))?;
        let bytes = std::fs::read(path)?;
        let sha256 = hex_digest(&bytes);
        let detector = Arc::new(Detector::with_planes(sense.inputs(), Model::pinned(&bytes, &sha256)?, Head::Grid)?);
        Ok(Victim { sha256, net, detector })
    }

    /// All stages, with this colour detector, this thermal network and perhaps a fused one.
    pub(crate) fn stages(&self, thermal: &Arc<Detector>, fused: Option<&Victim>) -> Stages {
        let stages = Stages::new(&Sensors::GROUND, self.detector.clone(), Arc::clone(thermal));
        match fused {
            Some(fused) => stages.proposing(Arc::clone(&fused.detector)),
            None => stages,
        }
    }
}
