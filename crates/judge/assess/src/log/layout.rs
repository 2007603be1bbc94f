//! Layout of ULog messages: where a field is in a message, and how a number is read there.
//!
//! A format names its fields in order, and formats nest. Nothing is expanded: sizes are worked out once a format, and a path is
//! followed field by field, so that formats within formats cost no memory.

use std::collections::BTreeMap;

use super::path::{Path, Step};

/// Most formats of one log; PX4 writes about 200.
const MAX_FORMATS: usize = 1024;
/// Most fields of one format; the largest of PX4 has about 150.
const MAX_FIELDS: usize = 1024;
/// Deepest nesting of formats; PX4 uses two levels.
const MAX_DEPTH: usize = 8;
/// Longest message: a record's size has 16 bits.
const MAX_SIZE: usize = u16::MAX as usize;

/// The formats of a log by name.
#[derive(Default)]
pub(super) struct Formats {
    by_name: BTreeMap<String, Vec<Field>>,
}

struct Field {
    kind: Kind,
    count: usize,
    array: bool,
    name: String,
}

enum Kind {
    Number(Number),
    Format(String),
}

/// A number's type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

/// A number's place in a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    at: usize,
    number: Number,
}

/// Text that is no valid format, or a path that leads to no number.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum LayoutError {
    #[error("a format is no text")]
    NoText,
    #[error("a format without a name")]
    NoName,
    #[error("more than {MAX_FORMATS} formats")]
    ManyFormats,
    #[error("a format of more than {MAX_FIELDS} fields")]
    ManyFields,
    #[error("the unknown format `{format}`")]
    UnknownFormat { format: String },
    #[error("formats nested deeper than {MAX_DEPTH}")]
    Deep,
    #[error("a message of `{format}` is longer than {MAX_SIZE} bytes")]
    Long { format: String },
    #[error("`{field}` of `{format}` has no parts")]
    NoParts { field: String, format: String },
    #[error("`{field}` of `{format}` has parts; name one")]
    Parts { field: String, format: String },
    #[error("an empty path")]
    EmptyPath,
    /// `remedy` names a similar field, in words.
    #[error("no field `{field}` in `{format}`{remedy}")]
    NoField { field: String, format: String, remedy: String },
    #[error("`{field}` has {count} elements; name one, as in `{field}[0]`")]
    Array { field: String, count: usize },
    #[error("`{field}` is no array")]
    NoArray { field: String },
    #[error("a field `{text}`, expected `type name`")]
    Field { text: String },
}

impl Number {
    /// Number type by its name in ULog (`uint8_t`) or in ROS 2 (`uint8`).
    pub(super) fn named(name: &str) -> Option<Self> {
        Some(match name.strip_suffix("_t").unwrap_or(name) {
            "int8" => Number::I8,
            "uint8" | "bool" | "char" | "byte" => Number::U8,
            "int16" => Number::I16,
            "uint16" => Number::U16,
            "int32" => Number::I32,
            "uint32" => Number::U32,
            "int64" => Number::I64,
            "uint64" => Number::U64,
            "float" | "float32" => Number::F32,
            "double" | "float64" => Number::F64,
            _ => return None,
        })
    }

    /// Its length, bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Number::I8 | Number::U8 => 1,
            Number::I16 | Number::U16 => 2,
            Number::I32 | Number::U32 | Number::F32 => 4,
            Number::I64 | Number::U64 | Number::F64 => 8,
        }
    }

    /// The number that begins these bytes, least byte first; of 64-bit ones the nearest `f64`.
    pub(super) fn read(self, bytes: &[u8]) -> Option<f64> {
        Some(match self {
            Number::I8 => f64::from(i8::from_le_bytes(*bytes.first_chunk()?)),
            Number::U8 => f64::from(*bytes.first()?),
            Number::I16 => f64::from(i16::from_le_bytes(*bytes.first_chunk()?)),
            Number::U16 => f64::from(u16::from_le_bytes(*bytes.first_chunk()?)),
            Number::I32 => f64::from(i32::from_le_bytes(*bytes.first_chunk()?)),
            Number::U32 => f64::from(u32::from_le_bytes(*bytes.first_chunk()?)),
            Number::I64 => i64::from_le_bytes(*bytes.first_chunk()?) as f64,
            Number::U64 => u64::from_le_bytes(*bytes.first_chunk()?) as f64,
            Number::F32 => f64::from(f32::from_le_bytes(*bytes.first_chunk()?)),
            Number::F64 => f64::from_le_bytes(*bytes.first_chunk()?),
        })
    }
}

impl Place {
    /// The number at this place of a message.
    pub(super) fn read(self, message: &[u8]) -> Option<f64> {
        self.number.read(message.get(self.at..)?)
    }
}

impl Formats {
    /// Takes the body of a format record: `name:type field;type[n] field;`.
    pub(super) fn add(&mut self, body: &[u8]) -> Result<(), LayoutError> {
        let text = std::str::from_utf8(body).map_err(|_| LayoutError::NoText)?;
        let (name, fields) = text.split_once(':').ok_or(LayoutError::NoName)?;
        if self.by_name.len() == MAX_FORMATS {
            return Err(LayoutError::ManyFormats);
        }
        let fields = fields.split(';').filter(|field| !field.is_empty()).map(field).take(MAX_FIELDS + 1);
        let fields: Vec<Field> = fields.collect::<Result<_, _>>()?;
        if fields.len() > MAX_FIELDS {
            return Err(LayoutError::ManyFields);
        }
        self.by_name.insert(name.to_owned(), fields);
        Ok(())
    }

    /// Length of a message of this format, bytes, without the padding that the logger leaves out at its end.
    pub(super) fn size(&self, name: &str) -> Result<usize, LayoutError> {
        let known = &mut BTreeMap::new();
        let whole = self.format_size(name, known, 0)?;
        let last = self.by_name.get(name).and_then(|fields| fields.last());
        match last.filter(|last| last.name.starts_with("_padding")) {
            Some(padding) => Ok(whole - self.field_size(padding, known, 0)?),
            None => Ok(whole),
        }
    }

    fn format_size<'a>(
        &'a self,
        name: &'a str,
        known: &mut BTreeMap<&'a str, usize>,
        depth: usize,
    ) -> Result<usize, LayoutError> {
        if let Some(size) = known.get(name) {
            return Ok(*size);
        }
        let fields = self.fields_of(name)?;
        if depth == MAX_DEPTH {
            return Err(LayoutError::Deep);
        }
        let mut size = 0;
        for field in fields {
            size += self.field_size(field, known, depth)?;
            if size > MAX_SIZE {
                return Err(LayoutError::Long { format: name.to_owned() });
            }
        }
        known.insert(name, size);
        Ok(size)
    }

    fn field_size<'a>(
        &'a self,
        field: &'a Field,
        known: &mut BTreeMap<&'a str, usize>,
        depth: usize,
    ) -> Result<usize, LayoutError> {
        let one = match &field.kind {
            Kind::Number(number) => number.size(),
            Kind::Format(name) => self.format_size(name, known, depth + 1)?,
        };
        // Neither factor exceeds 16 bits.
        Ok(one * field.count)
    }

    /// The place of a number in messages of `format`.
    pub(super) fn place(&self, format: &str, path: &Path) -> Result<Place, LayoutError> {
        let (known, mut format, mut at) = (&mut BTreeMap::new(), format, 0);
        for (depth, step) in path.steps().iter().enumerate() {
            let (field, before) = self.find(format, &step.name, known, depth)?;
            let index = index_of(field, step)?;
            let whole = self.field_size(field, known, depth)?;
            at += before + index * (whole / field.count.max(1));
            let last = depth + 1 == path.steps().len();
            match (&field.kind, last) {
                (Kind::Number(number), true) => return Ok(Place { at, number: *number }),
                (Kind::Format(name), false) => format = name,
                (Kind::Number(_), false) => {
                    return Err(LayoutError::NoParts { field: step.name.clone(), format: format.to_owned() });
                }
                (Kind::Format(_), true) => {
                    return Err(LayoutError::Parts { field: step.name.clone(), format: format.to_owned() });
                }
            }
        }
        Err(LayoutError::EmptyPath)
    }

    fn fields_of(&self, format: &str) -> Result<&Vec<Field>, LayoutError> {
        self.by_name.get(format).ok_or_else(|| LayoutError::UnknownFormat { format: format.to_owned() })
    }

    fn find<'a>(
        &'a self,
        format: &'a str,
        name: &str,
        known: &mut BTreeMap<&'a str, usize>,
        depth: usize,
    ) -> Result<(&'a Field, usize), LayoutError> {
        let fields = self.fields_of(format)?;
        let mut before = 0;
        for field in fields {
            if field.name == name {
                return Ok((field, before));
            }
            before += self.field_size(field, known, depth)?;
        }
        let near = scenario::closest(name, fields.iter().map(|field| field.name.as_str()));
        let remedy = near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
        Err(LayoutError::NoField { field: name.to_owned(), format: format.to_owned(), remedy })
    }
}

fn index_of(field: &Field, step: &Step) -> Result<usize, LayoutError> {
    match (field.array, step.index) {
        (true, Some(index)) if index < field.count => Ok(index),
        (false, None) => Ok(0),
        (true, _) => Err(LayoutError::Array { field: field.name.clone(), count: field.count }),
        (false, Some(_)) => Err(LayoutError::NoArray { field: field.name.clone() }),
    }
}

fn field(text: &str) -> Result<Field, LayoutError> {
    let malformed = || LayoutError::Field { text: text.chars().take(60).collect() };
    let (kind, name) = text.split_once(' ').ok_or_else(malformed)?;
    let (kind, count) = match kind.split_once('[') {
        Some((kind, count)) => {
            let count = count.strip_suffix(']').and_then(|count| count.parse::<u16>().ok()).ok_or_else(malformed)?;
            (kind, Some(usize::from(count)))
        }
        None => (kind, None),
    };
    let named = || Kind::Format(kind.to_owned());
    let kind = Number::named(kind).map_or_else(named, Kind::Number);
    Ok(Field { kind, count: count.unwrap_or(1), array: count.is_some(), name: name.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn formats(texts: &[&str]) -> Formats {
        let mut formats = Formats::default();
        texts.iter().for_each(|text| formats.add(text.as_bytes()).unwrap());
        formats
    }

    #[test]
    fn fields_are_found_through_nested_formats() {
        let formats = formats(&[
            "outer:uint64_t timestamp;inner[2] pair;float[3] q;uint8_t[7] _padding0;",
            "inner:int16_t a;double b;",
        ]);
        let place = |path: &str| formats.place("outer", &path.parse().unwrap());
        assert_eq!(formats.size("outer"), Ok(8 + 20 + 12));
        assert_eq!(place("pair[1].b"), Ok(Place { at: 8 + 10 + 2, number: Number::F64 }));
        assert_eq!(place("q[2]"), Ok(Place { at: 8 + 20 + 8, number: Number::F32 }));
        assert_eq!(place("q").unwrap_err().to_string(), "`q` has 3 elements; name one, as in `q[0]`");
        assert_eq!(
            place("timestam").unwrap_err().to_string(),
            "no field `timestam` in `outer`; did you mean `timestamp`?"
        );
    }

    /// Formats that would unfold to 1000^9 fields, and one within itself.
    #[test]
    fn nested_formats_cost_no_memory() {
        let mut texts: Vec<String> = (0..8).map(|i| format!("f{i}:f{}[1000] x;", i + 1)).collect();
        texts.push("f8:uint8_t[1000] x;".to_owned());
        let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
        assert!(formats(&texts).size("f0").is_err());
        assert_eq!(formats(&["f:f x;"]).size("f"), Err(LayoutError::Deep));
    }
}
