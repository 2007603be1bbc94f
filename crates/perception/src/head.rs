//! Meaning of a detector's output.

use serde::{Deserialize, Serialize};
use wire::codec::List;
use wire::sensor::Detection;

use crate::grid::{self, CHANNELS, COLUMNS, ROWS};
use crate::letterbox::Letterbox;
use crate::yolo::Yolo;

/// The grid's shape.
const GRID: [i64; 4] = [1, CHANNELS as i64, ROWS as i64, COLUMNS as i64];

/// Decoding of an output.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Head {
    /// The shipped detector's grid ([`crate::grid`]), over an image of the camera's size.
    Grid,
    /// A head as YOLO exporters write them ([`crate::yolo`]).
    Yolo(Yolo),
}

impl Head {
    /// The shape of output that it reads, in words.
    pub(crate) fn wanted(&self) -> String {
        match self {
            Head::Grid => format!("{GRID:?}"),
            Head::Yolo(yolo) => yolo.wanted(),
        }
    }

    /// True if it reads the output of a model for images in this letterbox.
    pub(crate) fn sees(&self, letterbox: &Letterbox) -> bool {
        match self {
            Head::Grid => letterbox.is_plain(),
            Head::Yolo(_) => true,
        }
    }

    /// True if it reads an output of this shape.
    pub(crate) fn reads(&self, shape: &[i64]) -> bool {
        match self {
            Head::Grid => shape == GRID,
            Head::Yolo(yolo) => yolo.boxes(shape).is_some(),
        }
    }

    /// Detections of at least `least` permille, best first; none in an output of a shape that it does not read.
    pub(crate) fn decode(&self, raw: &[f32], shape: &[i64], letterbox: &Letterbox, least: u16) -> List<Detection, 32> {
        match self {
            Head::Grid => grid::decode(raw, least),
            Head::Yolo(yolo) => yolo.decode(raw, yolo.boxes(shape).unwrap_or(0), letterbox, least),
        }
    }
}
