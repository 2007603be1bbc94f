//! Keys of contributors: Ed25519, the secret half in PKCS #8 as PEM (RFC 8410), as `openssl genpkey -algorithm ed25519` writes it.
//!
//! Reading and writing the file, and its mode, are left to the caller.

use std::fmt;

use ed25519_dalek::{Signature, Signer, SigningKey, VerifyingKey};
use evidence::log::hex;

/// The longest key file, bytes.
pub const MAX_KEY_BYTES: u64 = 4096;

/// First and last line of the file. In parts, since a search for committed keys looks for the whole.
const BEGIN: &str = concat!("-----BEGIN", " PRIVATE KEY-----");
const END: &str = concat!("-----END", " PRIVATE KEY-----");
/// PKCS #8 of an Ed25519 key up to its 32 secret bytes.
const PREFIX: [u8; 16] =
    [0x30, 0x2e, 0x02, 0x01, 0x00, 0x30, 0x05, 0x06, 0x03, 0x2b, 0x65, 0x70, 0x04, 0x22, 0x04, 0x20];
const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// A text that is no key.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum KeyError {
    /// No Ed25519 private key.
    #[error("an Ed25519 private key in PKCS #8 as PEM expected; `holdsafe guest board key FILE` writes one")]
    Private,
    /// No Ed25519 public key.
    #[error(
        "an Ed25519 public key of 64 hexadecimal digits expected; `holdsafe guest board verify BOARD` prints those of a board"
    )]
    Public,
}

/// Both halves of a contributor's key. The secret one is never printed.
pub struct ContributorKey(SigningKey);

impl ContributorKey {
    /// Key of 32 secret bytes.
    pub fn from_bytes(secret: &[u8; 32]) -> Self {
        Self(SigningKey::from_bytes(secret))
    }

    /// The key in a file's text.
    ///
    /// # Errors
    /// The text is no Ed25519 private key in PKCS #8 as PEM.
    pub fn from_pem(text: &str) -> Result<Self, KeyError> {
        let body = text.trim().strip_prefix(BEGIN).and_then(|rest| rest.strip_suffix(END)).ok_or(KeyError::Private)?;
        let bytes = decoded(body.trim()).ok_or(KeyError::Private)?;
        let secret = bytes.strip_prefix(&PREFIX[..]).ok_or(KeyError::Private)?;
        Ok(Self::from_bytes(secret.try_into().map_err(|_| KeyError::Private)?))
    }

    /// Text of the key's file.
    pub fn to_pem(&self) -> String {
        let bytes = [&PREFIX[..], &self.0.to_bytes()].concat();
        format!("{BEGIN}\n{}\n{END}\n", encoded(&bytes))
    }

    /// The public half, hexadecimal.
    pub fn public(&self) -> String {
        hex(self.0.verifying_key().as_bytes())
    }

    pub(crate) fn sign(&self, message: &[u8]) -> String {
        hex(&self.0.sign(message).to_bytes())
    }
}

impl fmt::Debug for ContributorKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("ContributorKey(…)")
    }
}

/// The public key of a word, in lower case.
///
/// # Errors
/// It is no Ed25519 public key of 64 hexadecimal digits.
pub fn public_key(text: &str) -> Result<String, KeyError> {
    let text = text.to_ascii_lowercase();
    verifying(&text).map(|_| text).ok_or(KeyError::Public)
}

/// The key of 64 hexadecimal digits; none for no point on the curve, and for one of small order, under which one signature fits any message.
fn verifying(text: &str) -> Option<VerifyingKey> {
    let key = VerifyingKey::from_bytes(&bytes(text)?).ok()?;
    (!key.is_weak()).then_some(key)
}

/// True if the key is one.
pub(crate) fn is_public(key: &str) -> bool {
    verifying(key).is_some()
}

/// True if the signature over `message` is the key's; strict, so that no second signature fits.
pub(crate) fn verifies(key: &str, message: &[u8], signature: &str) -> bool {
    let parts = verifying(key).zip(bytes::<64>(signature));
    parts.is_some_and(|(key, signature)| key.verify_strict(message, &Signature::from_bytes(&signature)).is_ok())
}

/// Bytes of `2 N` hexadecimal digits in lower case.
fn bytes<const N: usize>(text: &str) -> Option<[u8; N]> {
    let digit = |byte: u8| match byte {
        b'0'..=b'9' => Some(byte - b'0'),
        b'a'..=b'f' => Some(byte - b'a' + 10),
        _ => None,
    };
    let pairs = text.as_bytes().chunks(2).map(|pair| match pair {
        [high, low] => Some(digit(*high)? << 4 | digit(*low)?),
        _ => None,
    });
    pairs.collect::<Option<Vec<u8>>>()?.try_into().ok()
}

/// Base64 of bytes whose number is a multiple of three.
fn encoded(bytes: &[u8]) -> String {
    let group = |three: &[u8]| {
        let bits = three.iter().fold(0_usize, |bits, byte| bits << 8 | usize::from(*byte));
        [18, 12, 6, 0].map(|shift| char::from(ALPHABET[bits >> shift & 63]))
    };
    bytes.chunks(3).flat_map(group).collect()
}

/// The 48 bytes of 64 characters of base64; any other length is no key.
fn decoded(text: &str) -> Option<Vec<u8>> {
    let value = |c: u8| ALPHABET.iter().position(|known| *known == c);
    let values = text.bytes().map(value).collect::<Option<Vec<usize>>>().filter(|values| values.len() == 64)?;
    let group = |four: &[usize]| {
        let bits = four.iter().fold(0, |bits, value| bits << 6 | value);
        [16, 8, 0].map(|shift| (bits >> shift & 255) as u8)
    };
    Some(values.chunks(4).flat_map(group).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of RFC 8410, section 10.3.
    const EXAMPLE: &str = "MC4CAQAwBQYDK2VwBCIEINTuctv5E1hK1bbY8fdp+K06/nwoy/HU++CXqI9EdVhC";
    const PUBLIC: &str = "19bf44096984cdfe8541bac167dc3b96c85086aa30b6b6cb0c5c38ad703166e1";

    #[test]
    fn key_file_is_that_of_rfc_8410() {
        let text = format!("{BEGIN}\n{EXAMPLE}\n{END}\n");
        let key = ContributorKey::from_pem(&text).unwrap();
        assert_eq!((key.public().as_str(), key.to_pem()), (PUBLIC, text));
        assert_eq!(format!("{key:?}"), "ContributorKey(…)");
    }

    #[test]
    fn other_texts_are_no_key() {
        let whole = format!("{BEGIN}\n{EXAMPLE}\n{END}\n");
        let texts = [
            String::new(),
            whole.replace("MC4C", "MC4D"),
            whole.replace(EXAMPLE, &EXAMPLE[..60]),
            whole.replace("MC4C", "MC4*"),
            whole.replace(EXAMPLE, &EXAMPLE.repeat(9)),
            EXAMPLE.to_owned(),
        ];
        for text in texts {
            assert_eq!(ContributorKey::from_pem(&text).err(), Some(KeyError::Private), "{text}");
        }
        let [weak, no_point] = ["01", "02"].map(|first| first.to_owned() + &"00".repeat(31));
        for text in ["", "19bf", &PUBLIC[1..], &weak, &no_point] {
            assert_eq!(public_key(text), Err(KeyError::Public), "{text}");
        }
        assert_eq!(public_key(&PUBLIC.to_uppercase()).as_deref(), Ok(PUBLIC));
    }
}
