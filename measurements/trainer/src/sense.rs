//! The networks: one that looks at colour, one at warmth, and one at colour, warmth and depth together.

use std::path::{Path, PathBuf};

/// Input of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sense {
    /// The colour image; every class.
    Colour,
    /// The bands of the thermal image; warm objects.
    Thermal,
    /// Colour, the bands of warmth, and nearness; every class.
    Fused,
}

impl Sense {
    /// Sense by its name on the command line.
    pub(crate) fn named(name: &str) -> Option<Sense> {
        [Sense::Colour, Sense::Thermal, Sense::Fused].into_iter().find(|sense| sense.name() == name)
    }

    /// Its name on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Sense::Colour => "colour",
            Sense::Thermal => "thermal",
            Sense::Fused => "fused",
        }
    }

    /// Planes of its input.
    pub(crate) fn inputs(self) -> usize {
        match self {
            Sense::Colour | Sense::Thermal => 3,
            Sense::Fused => perception::fused::PLANES,
        }
    }

    /// The model's file; its weights stand beside it.
    pub(crate) fn model(self, directory: &Path) -> PathBuf {
        directory.join(match self {
            Sense::Colour => "detector.onnx",
            Sense::Thermal => "thermal.onnx",
            Sense::Fused => "fused.onnx",
        })
    }

    /// The record of its training.
    pub(crate) fn training(self, directory: &Path) -> PathBuf {
        directory.join(match self {
            Sense::Colour => "training.toml",
            Sense::Thermal => "thermal-training.toml",
            Sense::Fused => "fused-training.toml",
        })
    }

    /// Channels of each convolution of its network. Warmth has less to say than colour.
    pub(crate) fn channels(self) -> [usize; 6] {
        match self {
            Sense::Colour => [16, 24, 32, 48, 48, 48],
            Sense::Thermal => [8, 12, 16, 24, 24, 24],
            Sense::Fused => [24, 24, 32, 48, 48, 48],
        }
    }
}
