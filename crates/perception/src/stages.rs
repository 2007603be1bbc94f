//! The stages that make candidates of a rendered frame. Each works on its own plane; a missing plane is a missing
//! product, and so is that of a failed stage.

use std::sync::Arc;

use wire::platform::Sensors;
use wire::sensor::{Candidates, Frames, ProductMode};

use crate::detector::{Detector, DetectorError};
use crate::lidar::Scanner;
use crate::{depth, thermal};

/// The stages with their models. A clone shares the models.
#[derive(Clone, Debug)]
pub struct Stages {
    sensors: Sensors,
    detector: Arc<Detector>,
    thermal: Arc<Detector>,
    scanner: Scanner,
}

impl Stages {
    /// For these sensors: a detector that sees the colour image, and one that sees the bands of the thermal.
    pub fn new(sensors: &Sensors, detector: Arc<Detector>, thermal: Arc<Detector>) -> Self {
        Stages { sensors: *sensors, detector, thermal, scanner: Scanner::new(&sensors.lidar) }
    }

    /// The networks that ship for these sensors.
    ///
    /// # Errors
    /// One of them was edited, or the runtime refused it.
    pub fn shipped(sensors: &Sensors) -> Result<Self, DetectorError> {
        let (detector, thermal) = (Detector::built_in(&sensors.camera)?, Detector::thermal(&sensors.camera)?);
        Ok(Stages::new(sensors, Arc::new(detector), Arc::new(thermal)))
    }

    /// The sensors.
    pub fn sensors(&self) -> &Sensors {
        &self.sensors
    }

    /// The detector that sees the colour image.
    pub fn detector(&self) -> &Detector {
        &self.detector
    }

    /// The detector that sees the bands of the thermal image.
    pub fn thermal(&self) -> &Detector {
        &self.thermal
    }

    /// The candidates of one frame; detections of at least `least` permille. Depth samples refer to detections, so
    /// without colour there are none.
    pub fn candidates(&self, frames: &Frames<'_>, least: u16) -> Candidates {
        let (width, height) = (frames.width, frames.height);
        let sized = width == self.sensors.camera.width && height == self.sensors.camera.height;
        let rgb = frames.rgb.filter(|_| sized).and_then(|plane| self.detector.detect(plane, least).ok());
        let depth = match (frames.depth.filter(|_| sized), &rgb) {
            (Some(plane), Some(found)) => depth::samples(plane, width, height, found),
            (Some(_) | None, Some(_) | None) => None,
        };
        let thermal =
            frames.thermal.filter(|_| sized).and_then(|plane| thermal::blobs(&self.thermal, plane, width, height));
        let lidar = frames.lidar.and_then(|plane| self.scanner.clusters(plane));
        Candidates { frame: frames.frame, stamp: frames.stamp, mode: ProductMode::Live, rgb, depth, thermal, lidar }
    }
}
