//! Names of the steps of an attack, as scenario, plan, cue and log share them.
//!
//! A name only identifies a step; its start and its effect are left to the plan.

use core::fmt;

use arrayvec::ArrayString;
use minicbor::decode::Error;
use minicbor::encode::Write;
use minicbor::{Decode, Decoder, Encode, Encoder};
use wire::codec::Text;
use wire::core::MAX_CUE;

/// Longest name of a step, bytes.
pub const MAX_STEP_NAME: usize = MAX_CUE;

/// The name of a step: 1 to 24 of `a-z`, `0-9`, `-` and `_`.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StepName(ArrayString<MAX_STEP_NAME>);

impl StepName {
    /// The name, or `None` for a text that is empty, too long or of other characters than `a-z`, `0-9`, `-` and `_`.
    pub fn new(text: &str) -> Option<Self> {
        let fits = !text.is_empty() && text.bytes().all(|b| matches!(b, b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_'));
        ArrayString::from(text).ok().filter(|_| fits).map(Self)
    }

    /// The name as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The name in the input that calls the step ([`wire::core::Input::Cue`]).
    pub fn cue(self) -> Text<MAX_CUE> {
        Text::new(&self.0)
    }
}

impl fmt::Display for StepName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl fmt::Debug for StepName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.as_str())
    }
}

impl<C> Encode<C> for StepName {
    fn encode<W: Write>(&self, e: &mut Encoder<W>, _: &mut C) -> Result<(), minicbor::encode::Error<W::Error>> {
        e.str(&self.0)?.ok()
    }
}

impl<'b, C> Decode<'b, C> for StepName {
    fn decode(d: &mut Decoder<'b>, _: &mut C) -> Result<Self, Error> {
        StepName::new(d.str()?).ok_or_else(|| Error::message("not the name of a step"))
    }
}

impl serde::Serialize for StepName {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.0)
    }
}

impl<'de> serde::Deserialize<'de> for StepName {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = <std::borrow::Cow<'de, str>>::deserialize(deserializer)?;
        StepName::new(&text).ok_or_else(|| serde::de::Error::custom("not the name of a step"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn name_is_short_with_closed_alphabet() {
        assert_eq!(StepName::new("cut-2").unwrap().to_string(), "cut-2");
        for text in ["", "Cut", "a b", "a\n", "abcdefghijklmnopqrstuvwxyz"] {
            assert_eq!(StepName::new(text), None, "{text:?}");
        }
    }

    #[test]
    fn what_is_no_name_does_not_decode() {
        let name = StepName::new("storm").unwrap();
        assert_eq!(wire::codec::decode::<StepName>(&wire::codec::encode(&name), 32), Ok(name));
        assert!(wire::codec::decode::<StepName>(&[0x61, b'A'], 8).is_err());
    }
}
