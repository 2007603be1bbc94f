//! The cells: conditions under which frames are made, as `cells.toml` fixes them.

use std::sync::OnceLock;

use serde::Deserialize;

const TEXT: &str = include_str!("../cells.toml");

/// A range that is drawn from evenly.
pub type Range = [f32; 2];

/// Which seeds and which shapes, paints and grounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    /// Training data.
    Training,
    /// Data for choosing thresholds and calibration.
    Tuning,
    /// Reported data: other seeds of the same variant.
    HeldOut,
    /// Reported data: seeds of shapes, paints and grounds that are absent from training.
    Novel,
}

impl Split {
    /// Every split.
    pub const ALL: [Split; 4] = [Split::Training, Split::Tuning, Split::HeldOut, Split::Novel];

    /// Name in files and options.
    pub fn name(self) -> &'static str {
        match self {
            Split::Training => "training",
            Split::Tuning => "tuning",
            Split::HeldOut => "held-out",
            Split::Novel => "novel",
        }
    }
}

impl core::str::FromStr for Split {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let known = || Split::ALL.map(Split::name).join(", ");
        Split::ALL
            .into_iter()
            .find(|split| split.name() == name)
            .ok_or_else(|| format!("one of {} is expected", known()))
    }
}

/// Least and greatest length, width and height, metres.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sizes {
    /// Least.
    pub least: [f32; 3],
    /// Greatest.
    pub most: [f32; 3],
}

/// Content of a scene.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Variant {
    /// Vehicles and decoys.
    pub vehicle: Sizes,
    /// Persons.
    pub person: Sizes,
    /// Obstacles.
    pub obstacle: Sizes,
    /// Each channel of the paint.
    pub paint: Range,
    /// Relief.
    pub amplitude_m: Range,
    /// Relief.
    pub wavelength_m: Range,
}

/// One cell.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// Name.
    pub name: String,
    /// True if models may learn from it.
    pub learnt: bool,
    /// Share of a clear noon's light.
    pub light: Range,
    /// Visibility, metres; clear air without it.
    pub visibility_m: Option<Range>,
    /// Rain, mm/h.
    #[serde(default)]
    pub rain_mm_h: Range,
    /// Smear of the colour image, whole pixels.
    #[serde(default)]
    pub smear_px: [u16; 2],
    /// Temperature of ground and air.
    pub ground_kelvin: Range,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Variants {
    training: Variant,
    novel: Variant,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    variant: Variants,
    cell: Vec<Cell>,
}

/// Reason for which `cells.toml`, which is compiled in, is of no use.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cells.toml: {0}")]
pub struct CellsError(String);

fn file() -> Result<&'static File, CellsError> {
    static FILE: OnceLock<Result<File, CellsError>> = OnceLock::new();
    FILE.get_or_init(|| toml::from_str(TEXT).map_err(|e| CellsError(e.to_string()))).as_ref().map_err(Clone::clone)
}

/// Every cell, in the order of the file.
///
/// # Errors
/// The file was edited into something else.
pub fn all() -> Result<&'static [Cell], CellsError> {
    Ok(&file()?.cell)
}

/// The cell of this name.
///
/// # Errors
/// There is none; the message names those that there are.
pub fn named(name: &str) -> Result<&'static Cell, CellsError> {
    let cells = all()?;
    cells.iter().find(|c| c.name == name).ok_or_else(|| {
        let known: Vec<&str> = cells.iter().map(|c| c.name.as_str()).collect();
        CellsError(format!("no cell is called {name}; there are {}", known.join(", ")))
    })
}

/// The cells of these names; all where none is named.
///
/// # Errors
/// One is not there; the message names those that there are.
pub fn chosen(names: &[String]) -> Result<Vec<&'static Cell>, CellsError> {
    if names.is_empty() {
        return Ok(all()?.iter().collect());
    }
    names.iter().map(|name| named(name)).collect()
}

/// Content of the scenes of a split.
///
/// # Errors
///
/// The file was edited into something else.
pub fn variant(split: Split) -> Result<&'static Variant, CellsError> {
    let variants = &file()?.variant;
    Ok(match split {
        Split::Training | Split::Tuning | Split::HeldOut => &variants.training,
        Split::Novel => &variants.novel,
    })
}

/// The file itself, for a manifest.
pub fn text() -> &'static str {
    TEXT
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_held_out_is_learnt_from_nowhere() {
        let cells = all().unwrap();
        assert!(cells.iter().any(|c| c.learnt) && cells.iter().any(|c| !c.learnt));
        let (known, novel) = (variant(Split::Training).unwrap(), variant(Split::Novel).unwrap());
        assert!(novel.vehicle.least[2] >= known.vehicle.most[2], "taller than any that was learnt from");
        assert!(named("nowhere").unwrap_err().to_string().contains("clear, dusk"));
    }
}
