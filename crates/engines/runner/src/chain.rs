//! The digest at the end of each line of a file of results: SHA-256 over the digest of the line before and the line itself.
//!
//! A line that is changed, removed, added or exchanged by hand no longer fits its digest or that of its neighbour. There is no key: a
//! person who computes all digests again makes another file, with another last digest. Reading and writing of files is left to `lines`.

use evidence::log::hex;
use sha2::{Digest, Sha256};

/// Between the object of a line and its digest.
const SEAM: &str = ",\"chain\":\"";
/// Digits of a digest.
const DIGITS: usize = 64;
/// Length behind the fields of the object.
const TAIL: usize = SEAM.len() + DIGITS + "\"}".len();

/// Reason for which a line does not follow the one before it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ChainError {
    /// No digest at its end.
    #[error("no digest at its end: an older program's, or changed by hand")]
    NoDigest,
    /// A digest of other content.
    #[error("changed by hand, or the lines before it: digest {expected} expected, got {got}")]
    Digest {
        /// Digest of the lines up to this one.
        expected: String,
        /// Digest in the line.
        got: String,
    },
}

/// The digest of the last line; zeros where there is none.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Chain([u8; 32]);

impl Chain {
    /// The line of an object with its digest, without an end, and the chain up to it; none of a text that is no object with a field.
    pub(crate) fn seal(&self, object: &str) -> Option<(String, Chain)> {
        let fields = object.strip_suffix('}').filter(|fields| fields.starts_with("{\""))?;
        let next = self.extended(object.as_bytes());
        Some((format!("{fields}{SEAM}{}\"}}", hex(&next.0)), next))
    }

    /// The object of a line without its end, and the chain up to it.
    ///
    /// # Errors
    /// The line is not the one that was written behind the last one.
    pub(crate) fn open(&self, line: &[u8]) -> Result<(Vec<u8>, Chain), ChainError> {
        let (object, digest) = split(line).ok_or(ChainError::NoDigest)?;
        let next = self.extended(&object);
        let (expected, got) = (hex(&next.0), String::from_utf8_lossy(digest).into_owned());
        if expected == got { Ok((object, next)) } else { Err(ChainError::Digest { expected, got }) }
    }

    fn extended(&self, object: &[u8]) -> Chain {
        Chain(Sha256::new().chain_update(self.0).chain_update(object).finalize().into())
    }
}

/// The object of a line, and the digits behind it.
pub(crate) fn split(line: &[u8]) -> Option<(Vec<u8>, &[u8])> {
    let (fields, tail) = line.split_at(line.len().checked_sub(TAIL)?);
    let digits = tail.strip_prefix(SEAM.as_bytes())?.strip_suffix(b"\"}")?;
    Some(([fields, b"}"].concat(), digits))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changed_removed_and_exchanged_lines_are_noticed() {
        let mut chain = Chain::default();
        let lines = ["{\"a\":1}", "{\"a\":2}", "{\"b\":\"}\"}"].map(|object| {
            let (line, next) = chain.seal(object).unwrap();
            chain = next;
            assert!(serde_json::from_str::<serde_json::Value>(&line).unwrap()["chain"].is_string(), "{line}");
            line
        });
        let read = |lines: &[&str]| {
            lines.iter().try_fold(Chain::default(), |chain, line| chain.open(line.as_bytes()).map(|(_, next)| next))
        };
        let [first, second, third] = lines.each_ref().map(String::as_str);
        assert_eq!(read(&[first, second, third]), Ok(chain));
        assert!(read(&[first, second]).is_ok(), "an interruption cuts the end as well");
        let changed = second.replace("\"a\":2", "\"a\":3");
        for lines in [[first, &changed, third].as_slice(), &[first, third], &[second, first], &[first, first, second]] {
            assert!(read(lines).unwrap_err().to_string().contains("changed by hand"), "{lines:?}");
        }
        assert_eq!(read(&["{\"a\":1}"]), Err(ChainError::NoDigest));
    }

    #[test]
    fn only_objects_are_sealed() {
        for text in ["1", "[]", "{}", "\"}\""] {
            assert_eq!(Chain::default().seal(text), None, "{text}");
        }
    }
}
