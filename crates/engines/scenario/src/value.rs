//! The small value types of a scenario file: numbers that carry their range, lists that carry their bound, names that
//! carry their alphabet, and [`Located`], which remembers where in the file a value stood.
//!
//! A value out of range is refused while it is read, so the error points at the value itself. Holding values against each other
//! is the business of `scenario::check`.

use core::fmt;
use core::ops::{Deref, DerefMut, Range};
use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use wire::plain;
use wire::time::Span;

/// A finite number between `MIN`/1000 and `MAX`/1000, both included. Whole numbers may be written without a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub struct Real<const MIN: i64, const MAX: i64>(f64);

/// Seconds from the start of the trial, to an hour.
pub type Seconds = Real<0, 3_600_000>;
/// An edge length, in metres.
pub type Extent = Real<100, 20_000>;
/// An angle, in radians.
pub type Radians = Real<-7_000, 7_000>;
/// A probability or a share of a whole.
pub type Share = Real<0, 1_000>;
/// Milliseconds, to a minute.
pub type Millis = Whole<0, 60_000>;
/// Number of times.
pub type Count = Whole<1, 10_000>;

impl Share {
    /// The share in thousandths.
    pub fn permille(self) -> u16 {
        (self.get() * 1000.0) as u16
    }
}

impl<const MIN: i64, const MAX: i64> Real<MIN, MAX> {
    /// The value, or `None` when it is not finite or out of range.
    pub fn new(value: f64) -> Option<Self> {
        (value.is_finite() && value >= MIN as f64 / 1000.0 && value <= MAX as f64 / 1000.0).then_some(Self(value))
    }

    /// The number of the range that is nearest to `value`; the lowest for NaN.
    pub(super) fn nearest(value: f64) -> Self {
        let (low, high) = (MIN as f64 / 1000.0, MAX as f64 / 1000.0);
        Self(if value.is_nan() { low } else { value.clamp(low, high) })
    }

    /// A number of the program's own.
    pub(super) fn constant(value: f64) -> Self {
        Self::new(value).expect("invariant: a constant within its range")
    }

    /// The number.
    pub fn get(self) -> f64 {
        self.0
    }

    /// The number as seconds, in whole microseconds; a negative number is no time.
    pub fn span(self) -> Span {
        Span((self.0 * 1e6).round().max(0.0) as u64)
    }

    fn read<E: serde::de::Error>(value: f64) -> Result<Self, E> {
        if !value.is_finite() {
            return Err(E::custom(format_args!("{value} is not a finite number")));
        }
        Self::new(value).ok_or_else(|| {
            // Digits beyond the first hundred do not help.
            let got = if value.abs() < 1e15 { value.to_string() } else { format!("{value:e}") };
            E::custom(format_args!(
                "{got} is out of range, expected {} to {}",
                MIN as f64 / 1000.0,
                MAX as f64 / 1000.0
            ))
        })
    }
}

impl<'de, const MIN: i64, const MAX: i64> Deserialize<'de> for Real<MIN, MAX> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader<const MIN: i64, const MAX: i64>;
        impl<const MIN: i64, const MAX: i64> Visitor<'_> for Reader<MIN, MAX> {
            type Value = Real<MIN, MAX>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a number from {} to {}", MIN as f64 / 1000.0, MAX as f64 / 1000.0)
            }
            fn visit_f64<E: serde::de::Error>(self, v: f64) -> Result<Self::Value, E> {
                Real::read(v)
            }
            fn visit_i64<E: serde::de::Error>(self, v: i64) -> Result<Self::Value, E> {
                Real::read(v as f64)
            }
            fn visit_u64<E: serde::de::Error>(self, v: u64) -> Result<Self::Value, E> {
                Real::read(v as f64)
            }
        }
        deserializer.deserialize_any(Reader)
    }
}

impl<const MIN: i64, const MAX: i64> Serialize for Real<MIN, MAX> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_f64(self.0)
    }
}

impl<const MIN: i64, const MAX: i64> JsonSchema for Real<MIN, MAX> {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        format!("Real_{MIN}_{MAX}").into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "number", "minimum": MIN as f64 / 1000.0, "maximum": MAX as f64 / 1000.0 })
    }
}

/// A whole number from `MIN` to `MAX`, both included.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Whole<const MIN: i64, const MAX: i64>(i64);

impl<const MIN: i64, const MAX: i64> Whole<MIN, MAX> {
    /// The value, or `None` when out of range.
    pub fn new(value: i64) -> Option<Self> {
        (MIN..=MAX).contains(&value).then_some(Self(value))
    }

    /// A number of the program's own.
    pub(super) fn constant(value: i64) -> Self {
        Self::new(value).expect("invariant: a constant within its range")
    }

    /// The number.
    pub fn get(self) -> i64 {
        self.0
    }

    /// The number without its sign bit; every range used for counts and milliseconds starts at zero or above.
    pub fn unsigned(self) -> u64 {
        self.0.max(0) as u64
    }

    /// The number as milliseconds.
    pub fn span(self) -> Span {
        Span::ms(self.unsigned())
    }
}

impl<'de, const MIN: i64, const MAX: i64> Deserialize<'de> for Whole<MIN, MAX> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader<const MIN: i64, const MAX: i64>;
        impl<const MIN: i64, const MAX: i64> Visitor<'_> for Reader<MIN, MAX> {
            type Value = Whole<MIN, MAX>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a whole number from {MIN} to {MAX}")
            }
            fn visit_i64<E: serde::de::Error>(self, v: i64) -> Result<Self::Value, E> {
                Whole::new(v).ok_or_else(|| E::custom(format_args!("{v} is out of range, expected {MIN} to {MAX}")))
            }
            fn visit_u64<E: serde::de::Error>(self, v: u64) -> Result<Self::Value, E> {
                self.visit_i64(i64::try_from(v).unwrap_or(i64::MAX))
            }
        }
        deserializer.deserialize_i64(Reader)
    }
}

impl<const MIN: i64, const MAX: i64> Serialize for Whole<MIN, MAX> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_i64(self.0)
    }
}

impl<const MIN: i64, const MAX: i64> JsonSchema for Whole<MIN, MAX> {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        format!("Whole_{MIN}_{MAX}").into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "integer", "minimum": MIN, "maximum": MAX })
    }
}

/// At most `MAX` values in the order of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct List<T, const MAX: usize>(Vec<T>);

impl<T, const MAX: usize> Default for List<T, MAX> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T, const MAX: usize> List<T, MAX> {
    /// The first `MAX` of `values`.
    pub fn from_first(values: impl IntoIterator<Item = T>) -> Self {
        Self(values.into_iter().take(MAX).collect())
    }
}

impl<T, const MAX: usize> Deref for List<T, MAX> {
    type Target = [T];
    fn deref(&self) -> &[T] {
        &self.0
    }
}

impl<'a, T, const MAX: usize> IntoIterator for &'a List<T, MAX> {
    type Item = &'a T;
    type IntoIter = core::slice::Iter<'a, T>;
    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}

impl<'de, T: Deserialize<'de>, const MAX: usize> Deserialize<'de> for List<T, MAX> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader<T, const MAX: usize>(core::marker::PhantomData<T>);
        impl<'de, T: Deserialize<'de>, const MAX: usize> Visitor<'de> for Reader<T, MAX> {
            type Value = List<T, MAX>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a list of at most {MAX}")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
                let mut items = Vec::new();
                while let Some(item) = seq.next_element()? {
                    if items.len() == MAX {
                        return Err(A::Error::custom(format_args!("more than {MAX} entries")));
                    }
                    items.push(item);
                }
                Ok(List(items))
            }
        }
        deserializer.deserialize_seq(Reader(core::marker::PhantomData))
    }
}

impl<T: Serialize, const MAX: usize> Serialize for List<T, MAX> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(&self.0)
    }
}

impl<T: JsonSchema, const MAX: usize> JsonSchema for List<T, MAX> {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        format!("List_{}_{MAX}", T::schema_name()).into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "array", "maxItems": MAX, "items": generator.subschema_for::<T>() })
    }
}

/// A lower-case name: `a-z`, `0-9`, `-` and `_`, 1 to 48 characters, starting with a letter. Never a path.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(transparent)]
pub struct Name(String);

impl Name {
    /// The name, or the rule that the text breaks.
    pub fn new(text: &str) -> Result<Self, &'static str> {
        let fits = text.len() <= 48
            && text.starts_with(|c: char| c.is_ascii_lowercase())
            && text.chars().all(|c| matches!(c, 'a'..='z' | '0'..='9' | '-' | '_'));
        if fits {
            Ok(Self(text.to_owned()))
        } else {
            Err("a name is 1 to 48 of a-z, 0-9, - and _, starting with a letter")
        }
    }

    /// A name of the program's own.
    pub(super) fn constant(text: &'static str) -> Self {
        Self::new(text).expect("invariant: a constant name fits its alphabet")
    }

    /// The name as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Name of a variation: parts of `a-z`, `0-9`, `-`, `_` and `.` joined by `/`, 1 to 96 characters. No part starts with a point.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(transparent)]
pub struct Label(String);

impl Label {
    /// The label as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    fn new(text: &str) -> Result<Self, &'static str> {
        let part = |part: &str| {
            let fits = |c: char| matches!(c, 'a'..='z' | '0'..='9' | '-' | '_' | '.');
            !part.is_empty() && !part.starts_with('.') && part.chars().all(fits)
        };
        if text.len() <= 96 && text.split('/').all(part) {
            Ok(Self(text.to_owned()))
        } else {
            Err("a cell's name is 1 to 96 of a-z, 0-9, -, _ and ., in parts joined by /")
        }
    }
}

/// Words for people: at most `MAX` bytes, no control characters but line breaks.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct Text<const MAX: usize>(String);

impl<const MAX: usize> Text<MAX> {
    /// The words.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The text, as much of it as there is room for.
    pub(super) fn cut(text: &str) -> Self {
        let kept = text.chars().filter(|c| plain::is_plain(*c) || *c == '\n').scan(0, |bytes, c| {
            *bytes += c.len_utf8();
            (*bytes <= MAX).then_some(c)
        });
        Self(kept.collect())
    }

    fn new(text: &str) -> Result<Self, String> {
        if text.len() > MAX {
            Err(format!("text of {} bytes, at most {MAX} are taken", text.len()))
        } else if text.chars().any(|c| !plain::is_plain(c) && c != '\n') {
            Err("text holds a control character, or one that hides or reorders others".to_owned())
        } else {
            Ok(Self(text.to_owned()))
        }
    }
}

/// A path below the directory of the scenario: relative, no `..`, no absolute part.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct RelativePath(String);

impl RelativePath {
    /// The path as written.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    fn new(text: &str) -> Result<Self, &'static str> {
        let plain = |part: &str| !part.is_empty() && part != "." && part != "..";
        if text.len() <= 200 && text.split('/').all(plain) && !text.contains(['\\', '\0', ':']) {
            Ok(Self(text.to_owned()))
        } else {
            Err("path leaves the scenario directory; write it relative to the scenario, without `..`")
        }
    }
}

/// A row of the threat catalogue: `A01` to `A50`, `N0` to `N2`, `K1` to `K3`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(transparent)]
pub struct ThreatId(String);

impl ThreatId {
    /// The id as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    fn new(text: &str) -> Result<Self, &'static str> {
        let number =
            |digits: &str| digits.bytes().all(|b| b.is_ascii_digit()).then(|| digits.parse::<u8>().ok()).flatten();
        let known = match (text.get(..1), text.get(1..)) {
            (Some("A"), Some(rest)) => rest.len() == 2 && number(rest).is_some_and(|n| (1..=50).contains(&n)),
            (Some("N"), Some(rest)) => rest.len() == 1 && number(rest).is_some_and(|n| n <= 2),
            (Some("K"), Some(rest)) => rest.len() == 1 && number(rest).is_some_and(|n| (1..=3).contains(&n)),
            (Some(_) | None, _) => false,
        };
        if known {
            Ok(Self(text.to_owned()))
        } else {
            Err("no such row in the threat catalogue (A01-A50, N0-N2, K1-K3)")
        }
    }
}

/// A technique of ATT&CK (`T0830`, `T1499.004`) or ATLAS (`AML.T0015`, `AML.T0043.001`).
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(transparent)]
pub struct TechniqueId(String);

impl TechniqueId {
    /// The id as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    fn new(text: &str) -> Result<Self, &'static str> {
        let bare = text.strip_prefix("AML.").unwrap_or(text);
        let digits = |s: &str, n: usize| s.len() == n && s.bytes().all(|b| b.is_ascii_digit());
        let fits = bare.strip_prefix('T').is_some_and(|rest| match rest.split_once('.') {
            Some((main, sub)) => digits(main, 4) && digits(sub, 3),
            None => digits(rest, 4),
        });
        if fits { Ok(Self(text.to_owned())) } else { Err("not a technique id (T0830, T1499.004, AML.T0015)") }
    }
}

macro_rules! from_text {
    ([$($params:tt)*] [$($args:tt)*] $name:ty, $schema:expr, $json:tt) => {
        impl<'de, $($params)*> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Reader<$($params)*>;
                impl<$($params)*> Visitor<'_> for Reader<$($args)*> {
                    type Value = $name;
                    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                        f.write_str("a string")
                    }
                    fn visit_str<E: serde::de::Error>(self, v: &str) -> Result<Self::Value, E> {
                        <$name>::new(v).map_err(E::custom)
                    }
                }
                deserializer.deserialize_str(Reader::<$($args)*>)
            }
        }

        impl<$($params)*> JsonSchema for $name {
            fn inline_schema() -> bool {
                true
            }
            fn schema_name() -> Cow<'static, str> {
                $schema.into()
            }
            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                json_schema!($json)
            }
        }
    };
}

from_text!([] [] Name, "Name", { "type": "string", "pattern": "^[a-z][a-z0-9_-]{0,47}$" });
from_text!([] [] Label, "Label", { "type": "string", "pattern": "^[a-z0-9_-][a-z0-9._-]*(/[a-z0-9_-][a-z0-9._-]*)*$", "maxLength": 96 });
from_text!([const MAX: usize] [MAX] Text<MAX>, format!("Text_{MAX}"), { "type": "string", "maxLength": MAX });
from_text!([] [] RelativePath, "RelativePath", { "type": "string", "maxLength": 200 });
from_text!([] [] ThreatId, "ThreatId", { "type": "string", "pattern": "^(A[0-4][0-9]|N[0-2]|K[1-3])$" });
from_text!([] [] TechniqueId, "TechniqueId", { "type": "string", "pattern": "^(AML[.])?T[0-9]{4}([.][0-9]{3})?$" });

/// A value and the bytes of the file it was in, so that a later check can still point at it.
#[derive(Clone, Debug)]
pub struct Located<T> {
    value: T,
    bytes: Range<usize>,
}

impl<T> Located<T> {
    /// A value that was in no file: a default.
    pub fn nowhere(value: T) -> Self {
        Self { value, bytes: 0..0 }
    }

    /// Place of the value, in bytes of its file.
    pub fn bytes(&self) -> Range<usize> {
        self.bytes.clone()
    }
}

impl<T> Deref for Located<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T> DerefMut for Located<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.value
    }
}

impl<T: Default> Default for Located<T> {
    fn default() -> Self {
        Self::nowhere(T::default())
    }
}

impl<T: PartialEq> PartialEq for Located<T> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Located<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let spanned = toml::Spanned::<T>::deserialize(deserializer)?;
        let bytes = spanned.span();
        Ok(Self { value: spanned.into_inner(), bytes })
    }
}

impl<T: Serialize> Serialize for Located<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.value.serialize(serializer)
    }
}

impl<T: JsonSchema> JsonSchema for Located<T> {
    fn inline_schema() -> bool {
        T::inline_schema()
    }
    fn schema_name() -> Cow<'static, str> {
        T::schema_name()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        T::json_schema(generator)
    }
}
