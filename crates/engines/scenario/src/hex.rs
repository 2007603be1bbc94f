//! A row of numbers as one line of hexadecimal digits, two each: a print, its heat or a shift of an image, field by field.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// Characters of a refused row that its message quotes.
const BEGINS: usize = 16;

/// `N` bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct Hex<const N: usize>([u8; N]);

impl<const N: usize> Hex<N> {
    fn new(text: &str) -> Option<Self> {
        let digits: Vec<u8> = text.chars().map(|c| c.to_digit(16).map(|digit| digit as u8)).collect::<Option<_>>()?;
        let (pairs, rest) = digits.as_chunks::<2>();
        let bytes: Vec<u8> = pairs.iter().map(|[high, low]| high << 4 | low).collect();
        Some(Hex(bytes.try_into().ok().filter(|_| rest.is_empty())?))
    }

    pub(super) fn bytes(&self) -> &[u8; N] {
        &self.0
    }

    /// The bytes as shifts of red, green and blue, three a field: `80` is no shift, `ff` the brightest and `00` the
    /// darkest.
    pub(super) fn shifts(&self) -> impl Iterator<Item = [i8; 3]> {
        self.0.as_chunks::<3>().0.iter().map(|field| field.map(|byte| byte.wrapping_sub(128) as i8))
    }
}

impl<'de, const N: usize> Deserialize<'de> for Hex<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = Cow::<str>::deserialize(deserializer)?;
        let wrong = || {
            let (digits, begins): (_, String) = (2 * N, text.chars().take(BEGINS).collect());
            de::Error::custom(format!("such a row is {digits} hexadecimal digits, not {} as {begins:?}…", text.len()))
        };
        Hex::new(&text).ok_or_else(wrong)
    }
}

impl<const N: usize> Serialize for Hex<N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.0.iter().map(|byte| format!("{byte:02x}")).collect::<String>())
    }
}

impl<const N: usize> JsonSchema for Hex<N> {
    fn schema_name() -> Cow<'static, str> {
        format!("Hex{N}").into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "pattern": format!("^[0-9a-fA-F]{{{}}}$", 2 * N) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Any other text is refused.
    #[test]
    fn row_is_read_back_as_written() {
        let text = "80ff00".repeat(4);
        let row = Hex::<12>::new(&text).unwrap();
        assert_eq!(row.shifts().collect::<Vec<_>>(), [[0, 127, -128]; 4]);
        assert_eq!(
            (row.bytes()[1], serde_json::to_value(&row).unwrap()),
            (255, serde_json::Value::String(text.clone()))
        );
        for wrong in
            [&text[1..], &text[6..], "", &text.replace('f', "g"), &format!("{text}80"), &text.replace("80", "é0")]
        {
            assert_eq!(Hex::<12>::new(wrong), None, "{wrong}");
        }
    }
}
