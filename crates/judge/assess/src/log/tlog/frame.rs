//! One record of a MAVLink telemetry log: eight bytes of time, most byte first, and a frame of version 1 or 2.
//!
//! A frame of a listed message is held against its checksum. Of any other message the checksum covers a byte that is not known here, so its frame
//! counts only where another record, or the end of the file, follows it. Signatures are skipped: the key is not in the log.

use std::ops::Range;

use super::messages;

/// Length of the time before a frame, bytes.
const TIME: usize = 8;
/// The years 2000 to 2100, microseconds since 1970: the times that are believed.
const TIMES: Range<u64> = 946_684_800_000_000..4_102_444_800_000_000;
/// First bytes of a frame of version 1 and of version 2.
const MAGIC: [u8; 2] = [0xfe, 0xfd];
/// Lengths of the headers of both versions, of a checksum and of a signature, bytes.
const HEADERS: [usize; 2] = [6, 10];
const CHECKSUM: usize = 2;
const SIGNATURE: usize = 13;
/// Bit of the incompatibility flags: a signature follows the checksum.
const SIGNED: u8 = 1;

/// A record.
#[derive(Debug)]
pub(super) struct Record<'a> {
    /// Time at which the ground station took the frame, microseconds since 1970.
    pub(super) us: u64,
    /// Number of its message.
    pub(super) id: u32,
    /// System and component that sent it.
    pub(super) sender: (u8, u8),
    pub(super) payload: &'a [u8],
    pub(super) is_signed: bool,
    /// Place of the next record.
    pub(super) next: usize,
}

/// No record can be read at a place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum RecordError {
    #[error("a record has {} bytes or more, {left} are left", TIME + HEADERS[0] + CHECKSUM)]
    Header { left: usize },
    #[error("a record's time is {got} us since 1970, expected one from 2000 to 2100")]
    Time { got: u64 },
    #[error("a frame begins with {got:#04x}, expected 0xfe or 0xfd")]
    Magic { got: u8 },
    #[error("a frame of {length} bytes, {left} are left")]
    Short { length: usize, left: usize },
    #[error("a frame with the incompatibility flags {got:#04x}, of which {SIGNED:#04x} is known")]
    Flags { got: u8 },
    #[error("the checksum of a `{name}` is {stated:04x}, that of its bytes {got:04x}")]
    Checksum { name: &'static str, stated: u16, got: u16 },
    #[error("behind a frame of the message {id} stands no record")]
    NoneBehind { id: u32 },
}

/// The checksum of MAVLink: CRC-16/MCRF4XX.
pub(super) struct Checksum(u16);

impl Default for Checksum {
    fn default() -> Self {
        Self(0xffff)
    }
}

/// The remainder of each byte, so that a damaged file of many false frames costs little time a byte.
const REMAINDERS: [u16; 256] = {
    /// The polynomial, its lowest power at the highest bit.
    const POLYNOMIAL: u16 = 0x8408;
    let mut all = [0_u16; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut rest = byte as u16;
        let mut bit = 0;
        while bit < 8 {
            rest = if rest & 1 == 1 { (rest >> 1) ^ POLYNOMIAL } else { rest >> 1 };
            bit += 1;
        }
        all[byte] = rest;
        byte += 1;
    }
    all
};

impl Checksum {
    pub(super) fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            let [low, _] = self.0.to_le_bytes();
            self.0 = self.0 >> 8 ^ REMAINDERS[usize::from(low ^ byte)];
        }
    }

    pub(super) fn get(&self) -> u16 {
        self.0
    }
}

/// True if a time and the first byte of a frame stand here.
pub(super) fn begins(bytes: &[u8]) -> bool {
    time(bytes).is_some_and(|us| TIMES.contains(&us)) && bytes.get(TIME).is_some_and(|first| MAGIC.contains(first))
}

fn time(bytes: &[u8]) -> Option<u64> {
    bytes.first_chunk().map(|time| u64::from_be_bytes(*time))
}

/// The record at `at`.
///
/// # Errors
/// Reason for which no record can be read there.
pub(super) fn read_record(bytes: &[u8], at: usize) -> Result<Record<'_>, RecordError> {
    let rest = bytes.get(at..).unwrap_or_default();
    let short = RecordError::Header { left: rest.len() };
    let (Some(us), Some(frame)) = (time(rest), rest.get(TIME..)) else { return Err(short) };
    if !TIMES.contains(&us) {
        return Err(RecordError::Time { got: us });
    }
    let (magic, length) = match frame {
        [magic, length, ..] if MAGIC.contains(magic) => (*magic, usize::from(*length)),
        [magic, _, ..] => return Err(RecordError::Magic { got: *magic }),
        _ => return Err(short),
    };
    let flags = if magic == MAGIC[1] { frame.get(2).copied().unwrap_or_default() } else { 0 };
    if flags & !SIGNED != 0 {
        return Err(RecordError::Flags { got: flags });
    }
    let is_signed = flags & SIGNED != 0;
    let header = HEADERS[usize::from(magic == MAGIC[1])];
    let unsigned = header + length + CHECKSUM;
    let whole = unsigned + if is_signed { SIGNATURE } else { 0 };
    let frame = frame.get(..whole).ok_or(RecordError::Short { length: whole, left: rest.len() - TIME })?;
    let (id, sender) = match frame {
        [0xfd, _, _, _, _, system, component, low, middle, high, ..] => {
            (u32::from_le_bytes([*low, *middle, *high, 0]), (*system, *component))
        }
        [_, _, _, system, component, id, ..] => (u32::from(*id), (*system, *component)),
        _ => return Err(short),
    };
    let record =
        Record { us, id, sender, payload: &frame[header..header + length], is_signed, next: at + TIME + whole };
    check(bytes, &record, &frame[1..header + length], &frame[header + length..unsigned]).map(|()| record)
}

/// Holds a record against its checksum, or against its successor.
fn check(bytes: &[u8], record: &Record<'_>, covered: &[u8], stated: &[u8]) -> Result<(), RecordError> {
    let Some((_, message)) = messages::find(record.id) else {
        let rest = bytes.get(record.next..).unwrap_or_default();
        // Fewer bytes than a time and a first byte are the rest of a cut record.
        let follows = rest.len() <= TIME || begins(rest);
        return if follows { Ok(()) } else { Err(RecordError::NoneBehind { id: record.id }) };
    };
    let mut sum = Checksum::default();
    sum.add(covered);
    sum.add(&[message.extra]);
    let stated = stated.first_chunk().map_or(0, |bytes| u16::from_le_bytes(*bytes));
    match sum.get() == stated {
        true => Ok(()),
        false => Err(RecordError::Checksum { name: message.name, stated, got: sum.get() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check value of CRC-16/MCRF4XX, as catalogues of checksums list it.
    #[test]
    fn checksum_has_its_check_value() {
        let mut sum = Checksum::default();
        sum.add(b"123456789");
        assert_eq!(sum.get(), 0x6f91);
    }
}
