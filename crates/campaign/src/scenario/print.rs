//! What is printed on an object, as a scenario writes it: one line of hexadecimal digits for each row of fields, and one for its heat.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use super::scene::Class;
use super::value::Whole;

/// Fields in a row, as many as the sim prints.
const COLUMNS: usize = sim::print::COLUMNS;

/// A print on the four sides of an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Print {
    /// What the object is to be taken for.
    pub aims_at: Class,
    /// Shifts beyond this are cut to it, of 255; at 0 nothing is printed.
    #[serde(default = "whole")]
    pub strength: Whole<0, 127>,
    /// Rows from the top.
    pub rows: [Row; sim::print::ROWS],
    /// How warm its fields are; without it the object is as warm as it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heat: Option<Heat>,
}

/// How warm the fields of a print are. What bears no field is as cold as the ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Heat {
    /// What is warmer than this above the ground is cut to it, kelvin.
    #[serde(default = "any")]
    pub strength_k: Whole<0, 63>,
    /// Rows from the top.
    pub rows: [Warm; sim::print::ROWS],
}

fn any() -> Whole<0, 63> {
    Whole::new(63).expect("invariant: a constant within its range")
}

fn whole() -> Whole<0, 127> {
    Whole::new(127).expect("invariant: a constant within its range")
}

impl Print {
    /// As the sim takes it, each field cut to the strength.
    pub fn cut(&self) -> Option<sim::print::Print> {
        let most = self.strength.get() as i8;
        let cut = |field: [i8; 3]| field.map(|shift| shift.clamp(-most, most));
        let print = sim::print::Print::new(self.rows.iter().flat_map(|row| row.0).map(cut).collect())?;
        let Some(heat) = &self.heat else { return Some(print) };
        let most = (heat.strength_k.get() as f32 * sim::print::STEPS_PER_K) as u8;
        print.heated(heat.rows.iter().flat_map(|row| row.0).map(|steps| steps.min(most)).collect())
    }
}

/// One row: red, green and blue of each field from the object's end to its front, two digits each; `80` leaves the coat as
/// it is, `ff` is the brightest shift and `00` the darkest.
#[derive(Clone, Debug, PartialEq)]
pub struct Row([[i8; 3]; COLUMNS]);

impl Row {
    fn new(text: &str) -> Option<Self> {
        let bytes = bytes(text)?;
        let (fields, rest) = bytes.as_chunks::<3>();
        let fields: &[[u8; 3]; COLUMNS] = fields.try_into().ok().filter(|_| rest.is_empty())?;
        Some(Row(fields.map(|field| field.map(|byte| (i16::from(byte) - 128) as i8))))
    }
}

/// One row: how many quarters of a kelvin each field is warmer than the ground, from the object's end to its front, two
/// hexadecimal digits each.
#[derive(Clone, Debug, PartialEq)]
pub struct Warm([u8; COLUMNS]);

impl Warm {
    fn new(text: &str) -> Option<Self> {
        Some(Warm(bytes(text)?.try_into().ok()?))
    }
}

/// Pairs of hexadecimal digits.
fn bytes(text: &str) -> Option<Vec<u8>> {
    let digits: Vec<u8> = text.chars().map(|c| c.to_digit(16).map(|digit| digit as u8)).collect::<Option<_>>()?;
    let (pairs, rest) = digits.as_chunks::<2>();
    rest.is_empty().then(|| pairs.iter().map(|[high, low]| high << 4 | low).collect())
}

impl<'de> Deserialize<'de> for Row {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = std::borrow::Cow::<str>::deserialize(deserializer)?;
        Row::new(&text).ok_or_else(|| {
            de::Error::custom(format!("a row of a print is {} hexadecimal digits, six for each field", 6 * COLUMNS))
        })
    }
}

impl Serialize for Row {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let bytes = self.0.iter().flatten().map(|shift| format!("{:02x}", i16::from(*shift) + 128));
        serializer.serialize_str(&bytes.collect::<String>())
    }
}

impl<'de> Deserialize<'de> for Warm {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = std::borrow::Cow::<str>::deserialize(deserializer)?;
        Warm::new(&text).ok_or_else(|| {
            de::Error::custom(format!("a row of heat is {} hexadecimal digits, two for each field", 2 * COLUMNS))
        })
    }
}

impl Serialize for Warm {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.0.iter().map(|steps| format!("{steps:02x}")).collect::<String>())
    }
}

impl JsonSchema for Warm {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "PrintHeatRow".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "pattern": format!("^[0-9a-fA-F]{{{}}}$", 2 * COLUMNS) })
    }
}

impl JsonSchema for Row {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "PrintRow".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "pattern": format!("^[0-9a-fA-F]{{{}}}$", 6 * COLUMNS) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_read_back_as_it_was_written_and_anything_else_is_refused() {
        let text = "80ff00".repeat(COLUMNS);
        let row = Row::new(&text).unwrap();
        assert_eq!(row.0[3], [0, 127, -128]);
        assert_eq!(serde_json::to_value(&row).unwrap(), serde_json::Value::String(text.clone()));
        for wrong in
            [&text[1..], &text[6..], "", &text.replace('f', "g"), &format!("{text}80"), &text.replace("80", "é0")]
        {
            assert_eq!(Row::new(wrong), None, "{wrong}");
        }
        let text = "0078ff10".repeat(COLUMNS / 4);
        let row = Warm::new(&text).unwrap();
        assert_eq!((row.0[1], serde_json::to_value(&row).unwrap()), (120, serde_json::Value::String(text.clone())));
        for wrong in [&text[1..], &text[2..], "", &text.replace('f', "g"), &format!("{text}80")] {
            assert_eq!(Warm::new(wrong), None, "{wrong}");
        }
    }
}
