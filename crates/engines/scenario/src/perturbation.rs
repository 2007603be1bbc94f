//! Shifts added to colour images, as a scene writes them: one line of hexadecimal digits for each row of fields.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::hex::Hex;
use wire::sensor::Class;

/// Bytes in a row.
const ROW: usize = 3 * ground_truth::perturbation::COLUMNS;

/// One pattern, added to every image that a fault of kind `perturbation` changes, as strong as that says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Perturbation {
    /// The class that other things are to be taken for.
    pub aims_at: Class,
    /// Rows from the top: red, green and blue of each field from the left, two digits each; `80` leaves it as it is, `ff` is the brightest
    /// shift and `00` the darkest.
    pub rows: [Hex<ROW>; ground_truth::perturbation::ROWS],
}

impl Perturbation {
    /// As the sim takes it.
    pub fn pattern(&self) -> Option<ground_truth::perturbation::Perturbation> {
        ground_truth::perturbation::Perturbation::new(self.rows.iter().flat_map(Hex::shifts).collect())
    }
}
