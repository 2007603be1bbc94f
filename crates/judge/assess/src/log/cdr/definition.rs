//! A message's definition in the `ros2msg` form, line by line.
//!
//! The definition is the message's own, followed by the definitions of its parts behind lines of `=` and `MSG: package/Type`. A line that is none
//! of the known kinds is an error with its number: a definition that is understood in part would read numbers at false places. Comments may
//! be in any encoding.

use std::collections::BTreeMap;

use super::{Field, Kind, Many};
use crate::log::layout::Number;

/// Most types of a definition, and most fields of one.
const MAX_TYPES: usize = 256;
const MAX_FIELDS: usize = 1024;
/// Most characters of a line that an error shows.
const SHOWN: usize = 60;

/// Error of a line of a definition.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line} of its definition, `{}`: {fault}", shown.escape_debug())]
pub(in crate::log) struct DefinitionError {
    line: usize,
    /// Its first characters.
    shown: String,
    fault: LineFault,
}

/// Fault of a line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
enum LineFault {
    #[error("`MSG: package/Type` expected behind a line of `=`")]
    NoType,
    #[error("`MSG: package/Type` expected")]
    TypeName,
    #[error("`{name}` is defined twice")]
    TypeTwice { name: String },
    #[error("a definition of more than {MAX_TYPES} types")]
    ManyTypes,
    #[error("`{name}` has two fields of this name")]
    FieldTwice { name: String },
    #[error("a type of more than {MAX_FIELDS} fields")]
    ManyFields,
    #[error("neither a field (`type name`) nor a constant (`type NAME=value`)")]
    Neither,
    #[error("`{}` is no type", text.escape_debug())]
    Kind { text: String },
}

/// The types of a definition by name.
pub(super) type Types = BTreeMap<String, Vec<Field>>;

/// A definition that is being read.
struct Reading {
    types: Types,
    current: String,
    /// The line before was a separator.
    separated: bool,
}

/// Reads the definition of `root`.
pub(super) fn parse(root: &str, text: &[u8]) -> Result<Types, DefinitionError> {
    let text = String::from_utf8_lossy(text);
    let types = BTreeMap::from([(root.to_owned(), Vec::new())]);
    let mut reading = Reading { types, current: root.to_owned(), separated: false };
    for (i, line) in text.lines().enumerate() {
        let bare = line.split('#').next().unwrap_or_default().trim();
        if let Err(fault) = reading.line(bare) {
            return Err(DefinitionError { line: i + 1, shown: bare.chars().take(SHOWN).collect(), fault });
        }
    }
    Ok(reading.types)
}

/// `package/msg/Type` as `package/Type`.
pub(super) fn short(name: &str) -> String {
    name.replacen("/msg/", "/", 1)
}

impl Reading {
    fn line(&mut self, line: &str) -> Result<(), LineFault> {
        if line.is_empty() {
            return Ok(());
        }
        if line.len() >= 3 && line.bytes().all(|byte| byte == b'=') {
            self.separated = true;
            return Ok(());
        }
        match (line.strip_prefix("MSG:"), self.separated) {
            (Some(name), _) => self.begin(name.trim()),
            (None, true) => Err(LineFault::NoType),
            (None, false) => self.field(line),
        }
    }

    fn begin(&mut self, name: &str) -> Result<(), LineFault> {
        let parts: Vec<&str> = name.split('/').collect();
        if !(2..=3).contains(&parts.len()) || !parts.iter().all(|part| is_name(part)) {
            return Err(LineFault::TypeName);
        }
        (self.current, self.separated) = (short(name), false);
        if self.types.insert(self.current.clone(), Vec::new()).is_some_and(|before| !before.is_empty()) {
            return Err(LineFault::TypeTwice { name: self.current.clone() });
        }
        match self.types.len() > MAX_TYPES {
            true => Err(LineFault::ManyTypes),
            false => Ok(()),
        }
    }

    fn field(&mut self, line: &str) -> Result<(), LineFault> {
        let package = self.current.split('/').next().unwrap_or_default();
        let Some(field) = field(line, package)? else { return Ok(()) };
        let fields = self.types.entry(self.current.clone()).or_default();
        if fields.iter().any(|other| other.name == field.name) {
            return Err(LineFault::FieldTwice { name: self.current.clone() });
        }
        fields.push(field);
        match fields.len() > MAX_FIELDS {
            true => Err(LineFault::ManyFields),
            false => Ok(()),
        }
    }
}

/// A line of a definition; none for a constant.
fn field(line: &str, package: &str) -> Result<Option<Field>, LineFault> {
    let (kind, rest) = line.split_once(char::is_whitespace).ok_or(LineFault::Neither)?;
    let rest = rest.trim_start();
    let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len());
    let (name, rest_of_line) = (&rest[..end], rest[end..].trim());
    let (kind, many) = kind_of(kind, package)?;
    if !is_name(name) {
        return Err(LineFault::Neither);
    }
    let is_value = |value: &str| match (&kind, many) {
        (Kind::Number(_), Many::One) => {
            value.parse::<f64>().is_ok() || matches!(value.to_lowercase().as_str(), "true" | "false")
        }
        (Kind::Text, Many::One) => value.starts_with(['"', '\'']),
        (Kind::Number(_) | Kind::Text, Many::Array(_) | Many::Sequence) => {
            value.starts_with('[') && value.ends_with(']')
        }
        (Kind::Type(_), _) => false,
    };
    match rest_of_line.strip_prefix('=').map(str::trim) {
        // A text's value need not be quoted in a constant.
        Some(value) if is_value(value) || matches!(kind, Kind::Text) && !value.is_empty() => Ok(None),
        Some(_) => Err(LineFault::Neither),
        None if rest_of_line.is_empty() || is_value(rest_of_line) => {
            Ok(Some(Field { name: name.to_owned(), kind, many }))
        }
        None => Err(LineFault::Neither),
    }
}

fn kind_of(text: &str, package: &str) -> Result<(Kind, Many), LineFault> {
    let malformed = || LineFault::Kind { text: text.to_owned() };
    let bounded = |text: &str| text.strip_prefix("<=").is_some_and(|most| most.parse::<u32>().is_ok());
    let (kind, many) = match text.split_once('[') {
        Some((kind, size)) => {
            let size = size.strip_suffix(']').ok_or_else(malformed)?;
            let count = size.parse::<u32>().ok().map(|count| Many::Array(count as usize));
            let sequence = (size.is_empty() || bounded(size)).then_some(Many::Sequence);
            (kind, count.or(sequence).ok_or_else(malformed)?)
        }
        None => (text, Many::One),
    };
    let kind = match (Number::named(kind), kind.strip_prefix("string")) {
        (Some(number), _) => Kind::Number(number),
        (None, Some(rest)) if rest.is_empty() || bounded(rest) => Kind::Text,
        (None, _) if !kind.split('/').all(is_name) => return Err(malformed()),
        (None, _) if kind == "Header" => Kind::Type("std_msgs/Header".to_owned()),
        (None, _) if kind.contains('/') => Kind::Type(short(kind)),
        (None, _) => Kind::Type(format!("{package}/{kind}")),
    };
    Ok((kind, many))
}

fn is_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic()) && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse_error(text: &str) -> String {
        parse("a/A", text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn fields_constants_and_comments_are_told_apart() {
        let text = "# \u{b0}C\nuint8 KIND=3\nstring NAME = any # text\nfloat64 x 0.5 # metres\nstring<=10 s \"a b\"\nint32[<=4] n [1, 2]\n\
                    bool[] set\nOther o\nb/msg/C[3] c\n=====\nMSG: a/Other\nint8 LEAST=-128\n";
        let types = parse("a/A", text.as_bytes()).unwrap();
        let names = |name: &str| types[name].iter().map(|field| field.name.as_str()).collect::<Vec<_>>();
        assert_eq!(names("a/A"), ["x", "s", "n", "set", "o", "c"]);
        assert_eq!(names("a/Other"), [""; 0]);
    }

    #[test]
    fn a_line_of_no_known_kind_is_an_error() {
        let lines = [
            "float64 z================",
            "float64 z================MSG: geometry_msgs/Quaternion",
            "float64 yfloat64 z",
            "float64 x float64 y",
            "float64",
            "float64[a] x",
            "float64 1x",
            "string a string b",
            "Other o 3",
            "===\nfloat64 x",
            "float64 x\nfloat64 x",
            "float64 x\nMSG: a/A\nfloat64 y",
            "MSG: A",
            "float64\u{b0} x",
        ];
        for line in lines {
            assert!(parse_error(line).contains("of its definition, `"), "{line}: {}", parse_error(line));
        }
    }
}
