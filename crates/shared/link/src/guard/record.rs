//! The framing of DTLS 1.2 records (RFC 6347 §4.1), without keys.

/// Length of a record header, in bytes.
pub const HEADER: usize = 13;
/// Content type: change cipher spec.
pub const CHANGE_CIPHER_SPEC: u8 = 20;
/// Content type: alert.
pub const ALERT: u8 = 21;
/// Content type: handshake.
pub const HANDSHAKE: u8 = 22;
/// Content type: application data.
pub const APPLICATION_DATA: u8 = 23;

/// One record as a datagram has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawRecord<'a> {
    /// Content type, in the clear in every epoch.
    pub content: u8,
    /// 0 is plaintext.
    pub epoch: u16,
    /// 48-bit sequence number within the epoch.
    pub sequence: u64,
    /// Header and body.
    pub bytes: &'a [u8],
}

impl<'a> RawRecord<'a> {
    /// Bytes behind the header.
    pub fn body(&self) -> &'a [u8] {
        self.bytes.get(HEADER..).unwrap_or(&[])
    }

    /// A record for bytes without framing, for observations.
    pub fn unframed(bytes: &'a [u8]) -> Self {
        Self { content: 0, epoch: 0, sequence: 0, bytes }
    }
}

/// A piece of a datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split<'a> {
    /// A whole record.
    Record(RawRecord<'a>),
    /// The rest after a framing error; always the last piece.
    Remainder(&'a [u8]),
}

/// Splits a datagram into its records.
pub fn split(datagram: &[u8]) -> impl Iterator<Item = Split<'_>> {
    let mut rest = datagram;
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        match first(rest) {
            Some(raw) => {
                rest = &rest[raw.bytes.len()..];
                Some(Split::Record(raw))
            }
            None => Some(Split::Remainder(std::mem::take(&mut rest))),
        }
    })
}

fn first(bytes: &[u8]) -> Option<RawRecord<'_>> {
    let header = bytes.get(..HEADER)?;
    let length = usize::from(u16::from_be_bytes([header[11], header[12]]));
    let sequence = header[5..11].iter().fold(0u64, |acc, byte| acc << 8 | u64::from(*byte));
    Some(RawRecord {
        content: header[0],
        epoch: u16::from_be_bytes([header[3], header[4]]),
        sequence,
        bytes: bytes.get(..HEADER + length)?,
    })
}
