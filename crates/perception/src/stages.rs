//! The stages that make candidates of a rendered frame. Each works on its own plane; a missing plane is a missing
//! product, and so is that of a failed stage.

use std::sync::Arc;

use config::platform::Sensors;
use wire::codec::List;
use wire::sensor::{Candidates, Detection, Frames, ProductMode};

use crate::detector::{Detector, DetectorError};
use crate::fused::Disputed;
use crate::lidar::Scanner;
use crate::sight::Sight;
use crate::{depth, fused, thermal};

/// The stages with their models. A clone shares the models.
#[derive(Clone, Debug)]
pub struct Stages {
    sensors: Sensors,
    detector: Arc<dyn Sight>,
    thermal: Arc<Detector>,
    /// Proposes in place of the colour detector, which can then dispute.
    fused: Option<Arc<Detector>>,
    scanner: Scanner,
}

impl Stages {
    /// Stages for these sensors, with a detector for the colour image and one for the bands of the thermal image.
    pub fn new(sensors: &Sensors, detector: Arc<dyn Sight>, thermal: Arc<Detector>) -> Self {
        Stages { sensors: *sensors, detector, thermal, fused: None, scanner: Scanner::new(&sensors.lidar) }
    }

    /// The stages with a network over all cameras, which proposes in place of the colour detector.
    #[must_use]
    pub fn proposing(self, fused: Arc<Detector>) -> Self {
        Stages { fused: Some(fused), ..self }
    }

    /// The stages without such a network: the colour detector proposes.
    #[must_use]
    pub fn by_colour(self) -> Self {
        Stages { fused: None, ..self }
    }

    /// The networks that ship for these sensors.
    ///
    /// # Errors
    /// One of them was edited, or the runtime refused it.
    pub fn shipped(sensors: &Sensors) -> Result<Self, DetectorError> {
        let (detector, thermal) = (Detector::built_in(&sensors.camera)?, Detector::thermal(&sensors.camera)?);
        let stages = Stages::new(sensors, Arc::new(detector), Arc::new(thermal));
        let fused = Detector::fused(&sensors.camera)?;
        Ok(match fused {
            Some(fused) => stages.proposing(Arc::new(fused)),
            None => stages,
        })
    }

    /// Numbers and mounting of the sensors.
    pub fn sensors(&self) -> &Sensors {
        &self.sensors
    }

    /// The detector that sees the colour image.
    pub fn detector(&self) -> &dyn Sight {
        self.detector.as_ref()
    }

    /// The detector that sees the bands of the thermal image.
    pub fn thermal(&self) -> &Detector {
        &self.thermal
    }

    /// Detections of at least `least` permille, best first: the fused network's, or the colour detector's where there
    /// is none. `None` without a colour image: that is the loss of a modality.
    pub fn detections(&self, frames: &Frames<'_>, least: u16) -> Option<Result<List<Detection, 32>, DetectorError>> {
        let plane = frames.rgb?;
        Some(match &self.fused {
            Some(network) => network.detect(&fused::image(frames)?, least),
            None => self.detector.detect(plane, least),
        })
    }

    /// All claims of detection, and the disputed ones among them.
    fn claims(&self, frames: &Frames<'_>, least: u16) -> Option<(List<Detection, 32>, Disputed)> {
        let found = self.detections(frames, least)?.ok()?;
        if self.fused.is_none() {
            return Some((found, Disputed::default()));
        }
        let seen = self.detector.detect(frames.rgb?, fused::SAY.min(least)).ok()?;
        Some(fused::claims(&found, &seen, least))
    }

    /// The candidates of one frame; detections of at least `least` permille. Depth samples refer to detections, so
    /// without colour there are none.
    pub fn candidates(&self, frames: &Frames<'_>, least: u16) -> StageClaims {
        let (width, height) = (frames.width, frames.height);
        let sized = width == self.sensors.camera.width && height == self.sensors.camera.height;
        let claims = Some(frames).filter(|_| sized).and_then(|frames| self.claims(frames, least));
        let (rgb, disputed) = claims.map_or_else(Default::default, |(found, disputed)| (Some(found), disputed));
        let depth = match (frames.depth.filter(|_| sized), &rgb) {
            (Some(plane), Some(found)) => depth::samples(plane, width, height, found),
            (Some(_) | None, Some(_) | None) => None,
        };
        let thermal =
            frames.thermal.filter(|_| sized).and_then(|plane| thermal::blobs(&self.thermal, plane, width, height));
        let lidar = frames.lidar.and_then(|plane| self.scanner.clusters(plane));
        let (frame, stamp, mode) = (frames.frame, frames.stamp, ProductMode::Live);
        StageClaims { candidates: Candidates { frame, stamp, mode, rgb, depth, thermal, lidar, grain: None }, disputed }
    }
}

/// Candidates of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct StageClaims {
    /// The candidates, as they go over a bus.
    pub candidates: Candidates,
    /// Detections on which the colour detector and the fused network disagree.
    pub disputed: Disputed,
}
