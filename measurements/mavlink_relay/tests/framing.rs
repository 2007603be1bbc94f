//! Framing and signatures: what is read is written again, and hostile bytes are refused by name. `promise` is also tried on the seeds of
//! `fuzz/corpus/mavlink`, and on damaged ones; coverage-guided inputs are left to `fuzz/`.

mod promise;

use std::fs;
use std::path::Path;

use mavlink_relay::frame::{Frame, LONGEST, SIGNED, Version};
use mavlink_relay::message::{COMMAND_LONG, seed};
use mavlink_relay::signature::{self, Key, is_signed_by};
use proptest::prelude::*;

const KEY: Key = [7; 32];

/// The seeds of the fuzzer's target.
fn seeds() -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus/mavlink");
    let mut files: Vec<_> = fs::read_dir(folder).expect("seeds").map(|entry| entry.expect("a seed").path()).collect();
    files.sort();
    files.iter().map(|file| fs::read(file).expect("a seed")).collect()
}

fn frame(version: Version, message: u32, payload: Vec<u8>) -> Frame {
    let (sequence, system, component) = (3, 1, 1);
    let mut frame = Frame { version, sequence, system, component, message, payload, checksum: 0, signature: None };
    frame.seal(seed(message));
    frame
}

fn second(payload: Vec<u8>) -> Frame {
    frame(Version::V2 { incompatible: 0, compatible: 0 }, COMMAND_LONG, payload)
}

proptest! {
    #[test]
    fn frame_read_is_the_frame_written(
        v1: bool, message in 0u32..1 << 24, payload in prop::collection::vec(any::<u8>(), 0..=255), signed: bool, stamp: u64,
    ) {
        let version = if v1 { Version::V1 } else { Version::V2 { incompatible: 0, compatible: 9 } };
        let mut frame = frame(version, if v1 { message & 0xff } else { message }, payload);
        if signed {
            let seed = seed(frame.message);
            signature::sign(&mut frame, &KEY, seed, 5, stamp);
        }
        let mut bytes = frame.write();
        let length = bytes.len();
        prop_assert!(length <= LONGEST);
        bytes.extend([0xfd, 1, 2]);
        prop_assert_eq!(Frame::read(&bytes), Ok((frame, length)));
    }

    #[test]
    fn hostile_bytes_are_refused_or_kept(mut bytes in prop::collection::vec(any::<u8>(), 0..400), first in 0usize..3) {
        if let (Some(byte), Some(marker)) = (bytes.first_mut(), [0xfd, 0xfe].get(first)) {
            *byte = *marker;
        }
        promise::mavlink(&bytes);
    }

    #[test]
    fn damaged_seeds_are_refused_or_kept(
        index: prop::sample::Index, other: prop::sample::Index, ends in any::<[prop::sample::Index; 3]>(),
        noise in prop::collection::vec(any::<u8>(), 0..9),
    ) {
        let seeds = seeds();
        let (mut bytes, other) = (index.get(&seeds).clone(), other.get(&seeds));
        let [start, end, from] = ends;
        let start = start.index(bytes.len() + 1);
        let end = start + end.index(bytes.len() - start + 1);
        bytes.splice(start..end, noise);
        promise::mavlink(&bytes);
        bytes.splice(start.., other[from.index(other.len() + 1)..].iter().copied());
        promise::mavlink(&bytes);
    }

    #[test]
    fn every_flipped_bit_breaks_the_signature(bit in 0usize..(10 + 33 + 2 + 13) * 8) {
        let mut frame = second(vec![1; 33]);
        signature::sign(&mut frame, &KEY, seed(COMMAND_LONG), 0, 77);
        prop_assert!(is_signed_by(&frame, &KEY));
        let mut bytes = frame.write();
        bytes[bit / 8] ^= 1 << (bit % 8);
        let valid = Frame::read(&bytes).is_ok_and(|(frame, _)| is_signed_by(&frame, &KEY));
        prop_assert!(!valid);
    }
}

#[test]
fn seeds_include_accepted_and_refused_frames() {
    assert!(!promise::mavlink(&[]));
    let taken: Vec<bool> = seeds().iter().map(|bytes| promise::mavlink(bytes)).collect();
    assert!(taken.contains(&true) && taken.contains(&false), "{taken:?}");
}

#[test]
fn refusals_name_place_expected_and_got() {
    let say = |bytes: &[u8]| Frame::read(bytes).unwrap_err().to_string();
    assert_eq!(say(&[]), "byte 0: expected a frame, got no byte");
    assert_eq!(say(&[0x55]), "byte 0: expected 0xfe or 0xfd, got 0x55");
    assert_eq!(say(&[0xfd, 0, 2, 0, 0, 0, 0, 0, 0, 0]), "byte 2: expected no incompatibility flag but 0x01, got 0x02");
    assert_eq!(say(&[0xfe, 4, 0, 0, 0, 0]), "byte 6: expected a frame of 12 bytes, got 6");
    assert_eq!(say(&[0xfd, 0, SIGNED, 0, 0, 0, 0, 0, 0, 0]), "byte 10: expected a frame of 25 bytes, got 10");
}

/// The `mavlink` crate computes the same signature from its own frame type.
#[test]
fn signature_is_that_of_the_library() {
    let mut frame = second(vec![9; 30]);
    signature::sign(&mut frame, &KEY, seed(COMMAND_LONG), 3, 0x0605_0403_0201);
    let mut raw = mavlink::MAVLinkV2MessageRaw::new();
    let bytes = frame.write();
    raw.as_mut_slice()[..bytes.len()].copy_from_slice(&bytes);
    let mut hash = [0; 6];
    raw.calculate_signature(&KEY, &mut hash);
    assert_eq!(frame.signature.unwrap().hash, hash);
}
