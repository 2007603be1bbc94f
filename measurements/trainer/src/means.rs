//! Means of a shift of colour: a print on the decoys, or a pattern added to every image.

use dataset::example::{Example, ExampleError};
use ground_truth::{perturbation, print};

use crate::views::View;

/// One or the other.
#[derive(Clone, Copy)]
pub(crate) enum Means {
    /// On each side of a decoy.
    Print,
    /// Over the whole image, in any scene.
    Perturbation,
}

impl Means {
    /// Rows of fields, and fields in a row; each has a shift of red, green and blue.
    pub(crate) fn fields(self) -> [usize; 2] {
        match self {
            Means::Print => [print::ROWS, print::COLUMNS],
            Means::Perturbation => [perturbation::ROWS, perturbation::COLUMNS],
        }
    }

    /// Shifts of all fields.
    pub(crate) fn shifts(self) -> usize {
        3 * self.fields().iter().product::<usize>()
    }

    /// Strengths: the largest shift, of 255. Fixed before the first of its kind was made.
    pub(crate) fn strengths(self) -> [u8; 6] {
        match self {
            Means::Print => [0, 8, 16, 32, 64, 96],
            Means::Perturbation => [0, 2, 4, 8, 16, 32],
        }
    }

    /// The design strength, likewise.
    pub(crate) fn design(self) -> u8 {
        match self {
            Means::Print => 32,
            Means::Perturbation => 8,
        }
    }

    /// Name of its files.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Means::Print => "print",
            Means::Perturbation => "perturbation",
        }
    }

    /// The colour image of a view in 0..1 as it should come out.
    pub(crate) fn planes(self, view: &View, shifts: &[f32]) -> Vec<f32> {
        match self {
            Means::Print => view.planes(shifts),
            Means::Perturbation => view.planes_perturbed(shifts),
        }
    }

    /// Gradient at the shifts from that at the image, added to `sum`.
    pub(crate) fn back(self, view: &View, gradient: &[f32], sum: &mut [f32]) {
        match self {
            Means::Print => view.back(gradient, sum),
            Means::Perturbation => View::back_perturbed(gradient, sum),
        }
    }

    /// The frame as the stages are given it, the decoys as warm as that.
    pub(crate) fn frame(self, view: &View, shifts: &[f32], kelvin: f32) -> Result<Example, ExampleError> {
        match self {
            Means::Print => view.printed(shifts, kelvin),
            Means::Perturbation => view.perturbed(shifts, kelvin),
        }
    }

    /// Text above its table.
    pub(crate) fn title(self) -> String {
        let [rows, columns] = self.fields();
        match self {
            Means::Print => {
                format!(
                    "One print of {rows} × {columns} fields on each side of a decoy of a vehicle's size, rendered with it in the scene"
                )
            }
            Means::Perturbation => {
                format!(
                    "One pattern of {rows} × {columns} fields that is added to every image, with a decoy of a vehicle's size in it"
                )
            }
        }
    }
}
