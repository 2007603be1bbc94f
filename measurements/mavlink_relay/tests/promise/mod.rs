//! Promise of the frame parser for any bytes, shared with libFuzzer (`fuzz/fuzz_targets/mavlink.rs`); see `docs/developer/fuzzing.md`.

use mavlink_relay::frame::{Frame, FrameRefused, LONGEST};
use mavlink_relay::message;

/// An accepted frame is its bytes when written again, and a frame with a sound checksum is accepted again in MAVLink 1; a refusal has
/// a place within the bytes. Panics where this does not hold; true if the bytes are accepted.
pub(crate) fn mavlink(bytes: &[u8]) -> bool {
    match Frame::read(bytes) {
        Ok((frame, length)) => {
            assert!(length <= LONGEST && frame.write() == bytes[..length], "another frame");
            let older = message::downgraded(&frame).write();
            let (repeated, all) = Frame::read(&older).expect("a frame in MAVLink 1");
            assert!(all == older.len() && repeated.is_sound(message::seed(frame.message)) || frame.message > 0xff);
            true
        }
        Err(FrameRefused::Short { expected, got }) => {
            assert!(got == bytes.len() && expected > got && expected <= LONGEST);
            false
        }
        Err(refused) => {
            assert!(refused.to_string().starts_with("byte "));
            false
        }
    }
}
