//! MAVLink framing, versions 1 and 2: <https://mavlink.io/en/guide/serialization.html>.
//!
//! A frame that was read is equal to its bytes when written again. Checksums and signatures are kept as they came; `signature` and
//! [`Frame::seal`] make new ones. The meaning of a payload is left to others.

/// First byte of a MAVLink 1 frame.
pub const STX_V1: u8 = 0xfe;
/// First byte of a MAVLink 2 frame.
pub const STX_V2: u8 = 0xfd;
/// Bit of the incompatibility flags that says that a signature follows the checksum.
pub const SIGNED: u8 = 0x01;
/// Longest frame: header, payload, checksum and signature, bytes.
pub const LONGEST: usize = HEADER_V2 + 255 + CHECKSUM + SIGNATURE_LENGTH;
/// Length of the header of a MAVLink 1 frame with its first byte, bytes.
pub const HEADER_V1: usize = 6;
/// Length of the header of a MAVLink 2 frame with its first byte, bytes.
pub const HEADER_V2: usize = 10;
/// Length of the checksum, bytes.
pub const CHECKSUM: usize = 2;
/// Length of the block behind the checksum of a signed frame, bytes: link id, timestamp, hash.
pub const SIGNATURE_LENGTH: usize = 13;
/// Greatest timestamp: 48 bits.
pub const TIMESTAMP: u64 = (1 << 48) - 1;

/// Protocol version of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// MAVLink 1.
    V1,
    /// MAVLink 2, with its two bytes of flags.
    V2 {
        /// Flags without which a receiver must not read the frame.
        incompatible: u8,
        /// Flags that a receiver may ignore.
        compatible: u8,
    },
}

/// One frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Protocol version.
    pub version: Version,
    /// Sequence number of the sender.
    pub sequence: u8,
    /// System id.
    pub system: u8,
    /// Component id.
    pub component: u8,
    /// Message id: 8 bits in version 1, 24 in version 2.
    pub message: u32,
    /// Payload, at most 255 bytes.
    pub payload: Vec<u8>,
    /// Checksum as it came.
    pub checksum: u16,
    /// Signature as it came.
    pub signature: Option<Signature>,
}

/// The block behind the checksum of a signed frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signature {
    /// Link id.
    pub link: u8,
    /// Time since 1 January 2015 in units of 10 µs, 48 bits.
    pub timestamp: u64,
    /// First 48 bits of the hash.
    pub hash: [u8; 6],
}

impl Signature {
    /// Signature of exactly [`SIGNATURE_LENGTH`] bytes.
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let (&link, rest) = bytes.split_first()?;
        let (stamp, hash) = rest.split_at_checked(6)?;
        let &[a, b, c, d, e, f] = stamp else { return None };
        Some(Self { link, timestamp: u64::from_le_bytes([a, b, c, d, e, f, 0, 0]), hash: hash.try_into().ok()? })
    }

    /// Its bytes.
    pub fn write(&self) -> [u8; SIGNATURE_LENGTH] {
        let mut bytes = [0; SIGNATURE_LENGTH];
        bytes[..7].copy_from_slice(&self.stamp());
        bytes[7..].copy_from_slice(&self.hash);
        bytes
    }

    /// Link id and timestamp, which are signed.
    pub fn stamp(&self) -> [u8; 7] {
        let [a, b, c, d, e, f, ..] = (self.timestamp & TIMESTAMP).to_le_bytes();
        [self.link, a, b, c, d, e, f]
    }
}

/// Reason for which bytes are no frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameRefused {
    /// No byte at all.
    #[error("byte 0: expected a frame, got no byte")]
    Empty,
    /// The first byte belongs to no version.
    #[error("byte 0: expected {STX_V1:#04x} or {STX_V2:#04x}, got {0:#04x}")]
    Marker(u8),
    /// A flag of unknown effect on the framing.
    #[error("byte 2: expected no incompatibility flag but {SIGNED:#04x}, got {0:#04x}")]
    Flags(u8),
    /// The frame is longer than the bytes.
    #[error("byte {got}: expected a frame of {expected} bytes, got {got}")]
    Short {
        /// Length by the header, or of the header.
        expected: usize,
        /// Bytes that are there.
        got: usize,
    },
}

impl Frame {
    /// The frame at the beginning of `bytes`, and its length.
    ///
    /// # Errors
    /// The first deviation from the framing. The checksum is not checked here: its seed depends on the dialect.
    pub fn read(bytes: &[u8]) -> Result<(Frame, usize), FrameRefused> {
        match bytes.first() {
            None => Err(FrameRefused::Empty),
            Some(&STX_V1) => read_v1(bytes),
            Some(&STX_V2) => read_v2(bytes),
            Some(&other) => Err(FrameRefused::Marker(other)),
        }
    }

    /// The frame's bytes.
    pub fn write(&self) -> Vec<u8> {
        let mut bytes = self.unsigned_part();
        if let Some(signature) = &self.signature {
            bytes.extend(signature.write());
        }
        bytes
    }

    /// Header, payload and checksum: all of the frame but its signature.
    pub fn unsigned_part(&self) -> Vec<u8> {
        let mut bytes = self.header_and_payload();
        bytes.extend(self.checksum.to_le_bytes());
        bytes
    }

    /// Makes the checksum again, with the message's `seed` of its dialect.
    pub fn seal(&mut self, seed: u8) {
        self.checksum = self.sum(seed);
    }

    /// True if the checksum is the one of these bytes under `seed`.
    pub fn is_sound(&self, seed: u8) -> bool {
        self.checksum == self.sum(seed)
    }

    fn sum(&self, seed: u8) -> u16 {
        mavlink::calculate_crc(&self.header_and_payload()[1..], seed)
    }

    fn header_and_payload(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(LONGEST);
        let length = self.payload.len() as u8;
        let [low, middle, high, _] = self.message.to_le_bytes();
        let from = [self.sequence, self.system, self.component];
        match self.version {
            Version::V1 => {
                bytes.extend([STX_V1, length]);
                bytes.extend(from);
                bytes.push(low);
            }
            Version::V2 { incompatible, compatible } => {
                bytes.extend([STX_V2, length, incompatible, compatible]);
                bytes.extend(from);
                bytes.extend([low, middle, high]);
            }
        }
        bytes.extend(&self.payload);
        bytes
    }
}

fn read_v1(bytes: &[u8]) -> Result<(Frame, usize), FrameRefused> {
    let &[_, length, sequence, system, component, message, ..] = bytes else { return Err(short(bytes, HEADER_V1)) };
    let over = HEADER_V1 + usize::from(length);
    let end = over + CHECKSUM;
    let (Some(payload), Some(&[low, high])) = (bytes.get(HEADER_V1..over), bytes.get(over..end)) else {
        return Err(short(bytes, end));
    };
    let (payload, checksum) = (payload.to_vec(), u16::from_le_bytes([low, high]));
    let message = u32::from(message);
    let frame =
        Frame { version: Version::V1, sequence, system, component, message, payload, checksum, signature: None };
    Ok((frame, end))
}

fn read_v2(bytes: &[u8]) -> Result<(Frame, usize), FrameRefused> {
    let &[_, length, incompatible, compatible, sequence, system, component, low, middle, high, ..] = bytes else {
        return Err(short(bytes, HEADER_V2));
    };
    if incompatible & !SIGNED != 0 {
        return Err(FrameRefused::Flags(incompatible));
    }
    let over = HEADER_V2 + usize::from(length);
    let unsigned = over + CHECKSUM;
    let end = unsigned + if incompatible & SIGNED == 0 { 0 } else { SIGNATURE_LENGTH };
    let (Some(payload), Some(&[sum_low, sum_high]), Some(tail)) =
        (bytes.get(HEADER_V2..over), bytes.get(over..unsigned), bytes.get(unsigned..end))
    else {
        return Err(short(bytes, end));
    };
    let frame = Frame {
        version: Version::V2 { incompatible, compatible },
        sequence,
        system,
        component,
        message: u32::from_le_bytes([low, middle, high, 0]),
        payload: payload.to_vec(),
        checksum: u16::from_le_bytes([sum_low, sum_high]),
        signature: Signature::read(tail),
    };
    Ok((frame, end))
}

fn short(bytes: &[u8], expected: usize) -> FrameRefused {
    FrameRefused::Short { expected, got: bytes.len() }
}
