//! Quality of a detector and the stages beside it in one cell.

use std::ops::Range;

use perception::corroborate::CorroborationLimits;
use perception::detector::DetectorError;
use perception::stages::Stages;
use serde::Serialize;

use crate::calibration::{self, Bin};
use crate::cells::{Cell, Split};
use crate::example::{Example, ExampleError};
use crate::precision::{self, Outcome};
use crate::sightings::Sightings;
use crate::warmth::Claims;

/// Detections below this score no longer affect average precision, permille.
pub const LEAST: u16 = 1;

/// Reason for the lack of a measurement.
#[derive(Debug, thiserror::Error)]
pub enum QualityError {
    /// There is no frame.
    #[error(transparent)]
    Example(#[from] ExampleError),
    /// The detector failed on one.
    #[error(transparent)]
    Detector(#[from] DetectorError),
}

/// One cell of one split.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Quality {
    /// Cell.
    pub cell: String,
    /// Split.
    pub split: &'static str,
    /// True if models may learn from the cell.
    pub learnt: bool,
    /// Frames.
    pub frames: u32,
    /// Objects that show enough of themselves.
    pub objects: u32,
    /// Mean average precision at an intersection over union of 0.5.
    pub mean_average_precision: f64,
    /// 95 % by the bootstrap over frames.
    pub interval: [f64; 2],
    /// Precision by class: vehicle, person, decoy, obstacle.
    pub average_precision: [Option<f64>; 4],
    /// Expected calibration error of scores at or above the threshold in force.
    pub calibration_error: f64,
    /// The bins behind it.
    pub bins: Vec<Bin>,
    /// Balanced accuracy of the thermal veto.
    pub thermal_balanced_accuracy: Option<f64>,
    /// The claims behind it.
    pub claims: Claims,
    /// Corroborated sightings of single frames.
    pub sightings: Sightings,
}

/// Measures `stages` on frames `numbers` of a cell's split; calibration and sightings at `limits`.
///
/// # Errors
/// A frame cannot be made, or a detector fails on one.
pub fn measure(
    stages: &Stages,
    cell: &Cell,
    split: Split,
    numbers: Range<u64>,
    limits: &CorroborationLimits,
) -> Result<Quality, QualityError> {
    let (mut outcomes, mut claims, mut sightings) = (Vec::new(), Claims::default(), Sightings::default());
    for number in numbers {
        let example = Example::new(stages.sensors(), cell, split, number)?;
        let found = stages.detections(&example.frames(), LEAST).transpose()?.unwrap_or_default();
        outcomes.push(precision::judge(&example.frame.labels, &found));
        claims.add(stages.thermal(), &example, |_| true);
        sightings.add(stages, limits, &example);
    }
    let all: Vec<&Outcome> = outcomes.iter().collect();
    let bins = calibration::bins(&outcomes, limits.score);
    Ok(Quality {
        cell: cell.name.clone(),
        split: split.name(),
        learnt: cell.learnt,
        frames: outcomes.len() as u32,
        objects: outcomes.iter().flat_map(|o| o.objects).sum(),
        mean_average_precision: precision::mean(&all),
        interval: precision::interval(&outcomes),
        average_precision: precision::by_class(&all),
        calibration_error: calibration::error(&bins),
        bins,
        thermal_balanced_accuracy: claims.balanced_accuracy(),
        claims,
        sightings,
    })
}
