//! Print on an object's sides over its coat.
//!
//! A print is a grid of fields, each a shift of red, green and blue, and optionally of temperature against the ground. All four sides
//! of an object bear the same one, from its end to its front and from its top down; roof and belly bear none. Its maker and purpose
//! are unknown here.

use serde::{Deserialize, Serialize};
use wire::id::ObjectId;

/// Rows of fields, from the top.
pub const ROWS: usize = 8;
/// Fields in a row.
pub const COLUMNS: usize = 16;
/// Steps of a heated field's temperature in a kelvin.
pub const STEPS_PER_K: f32 = 4.0;

/// A print.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Print {
    /// Row-major shifts of red, green and blue.
    fields: Vec<[i8; 3]>,
    /// Row-major steps of temperature above the ground; empty where the object is as warm as it is.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    heat: Vec<u8>,
}

impl Print {
    /// Fields, row-major; `None` unless there are [`ROWS`] × [`COLUMNS`].
    pub fn new(fields: Vec<[i8; 3]>) -> Option<Self> {
        (fields.len() == ROWS * COLUMNS).then_some(Print { fields, heat: Vec::new() })
    }

    /// The print with heated fields, row-major: `heat` is the temperature of each above the ground in steps of 1 /
    /// [`STEPS_PER_K`] kelvin. The rest of the object is as cold as the ground. `None` unless the lengths match.
    #[must_use]
    pub fn heated(self, heat: Vec<u8>) -> Option<Self> {
        (heat.len() == ROWS * COLUMNS).then_some(Print { heat, ..self })
    }

    /// Row-major shifts of red, green and blue.
    pub fn fields(&self) -> &[[i8; 3]] {
        &self.fields
    }

    /// Row-major steps of temperature above the ground; empty if unheated.
    pub fn heat(&self) -> &[u8] {
        &self.heat
    }

    /// Temperature of a field, or of the unprinted rest, above the ground, kelvin; `None` where the print is not heated.
    pub fn warmth(&self, field: Option<usize>) -> Option<f32> {
        let steps = field.and_then(|field| self.heat.get(field)).copied().unwrap_or(0);
        (!self.heat.is_empty()).then(|| f32::from(steps) / STEPS_PER_K)
    }

    /// Shift of a field. A field beyond the last, which an unchecked scene may name, has none.
    pub fn shift(&self, field: usize) -> [f32; 3] {
        self.fields.get(field).map_or([0.0; 3], |shift| shift.map(f32::from))
    }
}

/// The field that a point of an object shows; places along its length, width and height are in about −1..1.
pub fn field([along, across, up]: [f32; 3]) -> Option<usize> {
    let (long, broad) = (along.abs(), across.abs());
    if up.abs() > long.max(broad) {
        return None;
    }
    let place = if long > broad { across } else { along };
    let steps = |share: f32, most: usize| ((0.5 + 0.5 * share).clamp(0.0, 0.999) * most as f32) as usize;
    Some(steps(-up, ROWS) * COLUMNS + steps(place, COLUMNS))
}

/// A pixel's part of an object's print.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Skin {
    /// The object.
    pub object: ObjectId,
    /// Index of the field of its print.
    pub field: u16,
    /// The coat under it.
    pub paint: [u8; 3],
    /// Share of a shift of the field that reaches the camera.
    pub light: f32,
    /// Share of the field's warmth above the ground that reaches the thermal camera.
    pub heat: f32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn print_runs_along_sides_and_spares_the_roof() {
        assert_eq!(field([-0.99, 1.0, 0.99]), Some(0));
        assert_eq!(field([0.97, 1.0, 0.97]), Some(COLUMNS - 1));
        assert_eq!(field([-0.97, -1.0, -0.97]), Some((ROWS - 1) * COLUMNS));
        assert_eq!(field([1.0, -0.97, 0.0]), Some(ROWS / 2 * COLUMNS));
        assert_eq!(field([0.1, 0.2, 1.0]), None);
    }
}
