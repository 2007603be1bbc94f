//! A print on an object, as a scenario writes it: one line of hexadecimal digits for each row of fields, and one for its heat.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::hex::Hex;
use super::value::Whole;
use wire::sensor::Class;

/// Fields in a row, as many as the sim prints.
const COLUMNS: usize = ground_truth::print::COLUMNS;

/// A print on the four sides of an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Print {
    /// The class that the object is to be taken for.
    pub aims_at: Class,
    /// Shifts beyond this are cut to it, of 255; 0 prints no shift.
    #[serde(default = "whole")]
    pub strength: Whole<0, 127>,
    /// Rows from the top: red, green and blue of each field from the object's end to its front, two digits each; `80` leaves the coat as
    /// it is, `ff` is the brightest shift and `00` the darkest.
    pub rows: [Hex<{ 3 * COLUMNS }>; ground_truth::print::ROWS],
    /// Heat of its fields; without it the object is as warm as it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heat: Option<Heat>,
}

/// Heat of the fields of a print. A part that bears no field is as cold as the ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Heat {
    /// Heat above the ground beyond this is cut to it, kelvin.
    #[serde(default = "any")]
    pub strength_k: Whole<0, 63>,
    /// Rows from the top: how many quarters of a kelvin each field is warmer than the ground, from the object's end to its front, two
    /// digits each.
    pub rows: [Hex<COLUMNS>; ground_truth::print::ROWS],
}

fn any() -> Whole<0, 63> {
    Whole::new(63).expect("invariant: a constant within its range")
}

fn whole() -> Whole<0, 127> {
    Whole::new(127).expect("invariant: a constant within its range")
}

impl Print {
    /// As the sim takes it, each field cut to the strength.
    pub fn cut(&self) -> Option<ground_truth::print::Print> {
        let most = self.strength.get() as i8;
        let cut = |field: [i8; 3]| field.map(|shift| shift.clamp(-most, most));
        let print = ground_truth::print::Print::new(self.rows.iter().flat_map(Hex::shifts).map(cut).collect())?;
        let Some(heat) = &self.heat else { return Some(print) };
        let most = (heat.strength_k.get() as f32 * ground_truth::print::STEPS_PER_K) as u8;
        print.heated(heat.rows.iter().flat_map(Hex::bytes).map(|steps| *steps.min(&most)).collect())
    }
}
