//! Deterministic CBOR (RFC 8949 §4.2.1), bounded and canonical both ways.
//!
//! Decoding borrows from the input and allocates only the value's own fixed-capacity lists. The decoded value
//! is encoded again against the input bytes, without a buffer: anything but the one canonical encoding is
//! refused. Numbers are integers in field units, so a NaN or an infinity cannot be written at all.

use arrayvec::ArrayVec;
use minicbor::encode::Write;
use minicbor::{Decode, Decoder, Encode, Encoder};

use crate::plain;

/// Reason that bytes are not a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Malformed {
    /// Longer than the channel carries.
    #[error("{got} bytes, at most {max} allowed")]
    TooLong {
        /// Limit in bytes.
        max: usize,
        /// Length in bytes.
        got: usize,
    },
    /// Not the message type that belongs here, or a value out of its range.
    #[error("not this message type, or a value out of range, at byte {at}")]
    Schema {
        /// Offset in bytes.
        at: usize,
    },
    /// A valid encoding, but not the canonical one (longer integer, trailing bytes, unknown field).
    #[error("not the canonical encoding at byte {at}")]
    NonCanonical {
        /// Offset in bytes.
        at: usize,
    },
}

/// The canonical encoding.
pub fn encode<T: Encode<()>>(value: &T) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(256);
    minicbor::encode(value, &mut bytes).expect("writing to a Vec cannot fail");
    bytes
}

/// Decodes a message of at most `max` bytes, refusing all but its canonical encoding.
pub fn decode<'b, T: Decode<'b, ()> + Encode<()>>(bytes: &'b [u8], max: usize) -> Result<T, Malformed> {
    if bytes.len() > max {
        return Err(Malformed::TooLong { max, got: bytes.len() });
    }
    let mut decoder = Decoder::new(bytes);
    let value: T = decoder.decode().map_err(|_| Malformed::Schema { at: decoder.position() })?;
    let mut same = Same { expected: bytes, at: 0 };
    let written = Encoder::new(&mut same).encode(&value).map(|_| ());
    match written {
        Ok(()) if same.at == bytes.len() => Ok(value),
        Ok(()) | Err(_) => Err(Malformed::NonCanonical { at: same.at }),
    }
}

/// A sink that accepts only the bytes it expects.
struct Same<'a> {
    expected: &'a [u8],
    at: usize,
}

impl Write for Same<'_> {
    type Error = Malformed;

    fn write_all(&mut self, buf: &[u8]) -> Result<(), Malformed> {
        let end = self.at + buf.len();
        if self.expected.get(self.at..end) == Some(buf) {
            self.at = end;
            Ok(())
        } else {
            Err(Malformed::NonCanonical { at: self.at })
        }
    }
}

/// A list of at most `N` items; a longer one is refused before its items are read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct List<T, const N: usize>(pub ArrayVec<T, N>);

impl<T, const N: usize> Default for List<T, N> {
    fn default() -> Self {
        List(ArrayVec::new())
    }
}

impl<T, const N: usize> List<T, N> {
    /// Appends unless full; says whether there was room.
    pub fn push(&mut self, item: T) -> bool {
        self.0.try_push(item).is_ok()
    }
}

impl<T, const N: usize> core::ops::Deref for List<T, N> {
    type Target = [T];
    fn deref(&self) -> &[T] {
        &self.0
    }
}

impl<T, const N: usize> core::ops::DerefMut for List<T, N> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.0
    }
}

impl<T, const N: usize> FromIterator<T> for List<T, N> {
    /// Takes the first `N` items.
    fn from_iter<I: IntoIterator<Item = T>>(items: I) -> Self {
        List(items.into_iter().take(N).collect())
    }
}

impl<C, T: Encode<C>, const N: usize> Encode<C> for List<T, N> {
    fn encode<W: Write>(&self, e: &mut Encoder<W>, ctx: &mut C) -> Result<(), minicbor::encode::Error<W::Error>> {
        e.array(self.0.len() as u64)?;
        self.0.iter().try_for_each(|item| item.encode(e, ctx))
    }
}

impl<'b, C, T: Decode<'b, C>, const N: usize> Decode<'b, C> for List<T, N> {
    fn decode(d: &mut Decoder<'b>, ctx: &mut C) -> Result<Self, minicbor::decode::Error> {
        let len = d.array()?.ok_or_else(|| minicbor::decode::Error::message("indefinite length"))?;
        // Before an item is read: the length is the sender's word.
        if len > N as u64 {
            return Err(minicbor::decode::Error::message("list longer than its bound"));
        }
        let mut items = ArrayVec::new();
        for _ in 0..len {
            items.push(T::decode(d, ctx)?);
        }
        Ok(List(items))
    }
}

/// Text of at most `N` bytes, of plain characters alone ([`plain`]): safe to print and to log.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Text<const N: usize>(arrayvec::ArrayString<N>);

impl<const N: usize> Text<N> {
    /// The text, cut at `N` bytes on a character boundary, other characters than plain ones replaced by spaces.
    pub fn new(text: &str) -> Self {
        let mut string = arrayvec::ArrayString::new();
        for c in text.chars().map(plain::shown) {
            if string.try_push(c).is_err() {
                break;
            }
        }
        Text(string)
    }

    /// The text as a string slice.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl<const N: usize> core::fmt::Debug for Text<N> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{:?}", self.as_str())
    }
}

impl<const N: usize> serde::Serialize for Text<N> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

impl<C, const N: usize> Encode<C> for Text<N> {
    fn encode<W: Write>(&self, e: &mut Encoder<W>, _: &mut C) -> Result<(), minicbor::encode::Error<W::Error>> {
        e.str(&self.0)?.ok()
    }
}

impl<'b, C, const N: usize> Decode<'b, C> for Text<N> {
    fn decode(d: &mut Decoder<'b>, _: &mut C) -> Result<Self, minicbor::decode::Error> {
        let text = d.str()?;
        if text.len() > N || !text.chars().all(plain::is_plain) {
            return Err(minicbor::decode::Error::message("text too long or with control characters"));
        }
        Ok(Text::new(text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn longer_form_of_integer_is_refused() {
        assert_eq!(decode::<u64>(&[0x05], 8), Ok(5));
        assert_eq!(decode::<u64>(&[0x18, 0x05], 8), Err(Malformed::NonCanonical { at: 0 }));
    }

    #[test]
    fn trailing_bytes_are_refused() {
        assert!(matches!(decode::<u64>(&[0x05, 0x00], 8), Err(Malformed::NonCanonical { at: 1 })));
    }

    #[test]
    fn overlong_list_is_refused_before_its_items() {
        let bytes = [0x9b, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff];
        assert!(matches!(decode::<List<u8, 4>>(&bytes, 64), Err(Malformed::Schema { .. })));
    }

    #[test]
    fn control_characters_do_not_survive() {
        assert_eq!(Text::<8>::new("a\u{1b}[2J").as_str(), "a [2J");
        assert!(decode::<Text<8>>(&[0x62, b'a', 0x1b], 8).is_err());
    }
}
