//! Each attack changes what it says and no more.

#![expect(clippy::unwrap_used, reason = "a test may end here")]

use mavlink_relay::attack::{Attack, Captured};
use mavlink_relay::expected::rows;
use mavlink_relay::frame::{Frame, HEADER_V2, Version};
use mavlink_relay::message::{COMMAND_LONG, COMMAND_LONG_LENGTH, SETUP_SIGNING, UNKNOWN, seed};
use mavlink_relay::signature::{self, Key, TICKS, is_signed_by};
use rand_chacha::ChaCha8Rng;
use rand_core::SeedableRng;

const KEY: Key = [7; 32];
const HOUR: u64 = 3600 * TICKS;

/// The true sender's message number `n`, signed if there is a key.
fn sent(n: u8, key: Option<&Key>) -> Frame {
    let version = Version::V2 { incompatible: 0, compatible: 0 };
    let (system, component, checksum, signature) = (1, 1, 0, None);
    let payload = vec![n; 30];
    let mut frame =
        Frame { version, sequence: n, system, component, message: COMMAND_LONG, payload, checksum, signature };
    frame.seal(seed(COMMAND_LONG));
    if let Some(key) = key {
        signature::sign(&mut frame, key, seed(COMMAND_LONG), 0, 10 * HOUR + u64::from(n));
    }
    frame
}

/// The attacker's bytes, and the message that is on its way.
fn attacked(attack: Attack, key: Option<&Key>, round: u32) -> (Vec<u8>, Frame) {
    let [older, newest, coming] = [1, 2, 3].map(|n| sent(n, key));
    let captured = Captured { coming: &coming, newest: &newest, older: &older, round };
    let datagram = attack.datagram(captured, key, &mut ChaCha8Rng::seed_from_u64(u64::from(round)));
    (datagram, coming)
}

fn read(bytes: &[u8]) -> Frame {
    let (frame, length) = Frame::read(bytes).unwrap();
    assert_eq!(length, bytes.len());
    frame
}

fn signed(attack: Attack, round: u32) -> Frame {
    read(&attacked(attack, Some(&KEY), round).0)
}

/// Bits in which two byte strings of one length differ.
fn bits(a: &[u8], b: &[u8]) -> u32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a ^ b).count_ones()).sum()
}

#[test]
fn each_attack_has_one_expected_row() {
    let names: Vec<Attack> = rows().unwrap().into_iter().map(|row| row.name).collect();
    let mut sorted = names.clone();
    sorted.sort();
    sorted.dedup();
    assert_eq!((sorted.len(), names.len()), (20, 20));
    assert_eq!(Attack::FutureInsiderBeside.name(), "future-insider-beside");
}

#[test]
fn attacks_without_the_key_carry_no_new_signature() {
    for attack in [
        Attack::UnsignedCommand,
        Attack::UnknownMessage,
        Attack::Downgrade,
        Attack::RelabelledLink,
        Attack::KeyChangeUnsigned,
        Attack::PayloadFlip,
        Attack::PayloadRewrite,
        Attack::SignatureFlip,
        Attack::FutureForged,
    ] {
        for round in 0..300 {
            assert!(!is_signed_by(&signed(attack, round), &KEY), "{attack:?}");
        }
    }
}

#[test]
fn attacks_of_key_holders_are_signed_well() {
    for attack in [
        Attack::NewLinkOld,
        Attack::NewLinkRecent,
        Attack::KeyChangeSigned,
        Attack::Spoof,
        Attack::FutureInsider,
        Attack::FutureInsiderBeside,
    ] {
        for round in 0..300 {
            let frame = signed(attack, round);
            assert!(is_signed_by(&frame, &KEY) && frame.is_sound(seed(frame.message)), "{attack:?}");
            let foreign = read(&attacked(attack, None, round).0);
            assert!(!is_signed_by(&foreign, &KEY), "{attack:?} on an unsigned link");
        }
    }
}

#[test]
fn replays_are_the_bytes_that_were_captured() {
    for key in [None, Some(&KEY)] {
        for attack in [Attack::ReplayNewest, Attack::RebootReplayRecent, Attack::RebootReplayOld] {
            assert_eq!(attacked(attack, key, 0).0, sent(2, key).write());
        }
        assert_eq!(attacked(Attack::ReplayOlder, key, 0).0, sent(1, key).write());
    }
}

#[test]
fn downgrade_is_the_same_command_in_version_one() {
    let frame = signed(Attack::Downgrade, 0);
    assert_eq!((frame.version, frame.signature, frame.payload.len()), (Version::V1, None, COMMAND_LONG_LENGTH));
    assert!(frame.payload.starts_with(&sent(2, None).payload) && frame.is_sound(seed(COMMAND_LONG)));
}

#[test]
fn tampering_flips_one_bit_and_no_other() {
    for round in 0..300 {
        let (flip, coming) = attacked(Attack::PayloadFlip, Some(&KEY), round);
        assert_eq!(bits(&flip, &coming.write()), 1);
        let (rewrite, _) = attacked(Attack::PayloadRewrite, Some(&KEY), round);
        let frame = read(&rewrite);
        assert_eq!(bits(&frame.payload, &coming.payload), 1);
        assert!(frame.is_sound(seed(COMMAND_LONG)) && frame.signature == coming.signature);
        let (flip, _) = attacked(Attack::SignatureFlip, Some(&KEY), round);
        let end = flip.len() - 6;
        assert_eq!((bits(&flip, &coming.write()), &flip[..end]), (1, &coming.write()[..end]));
    }
}

#[test]
fn truncation_cuts_two_to_twelve_bytes() {
    let mut cuts = std::collections::BTreeSet::new();
    for round in 0..300 {
        let (cut, coming) = attacked(Attack::Truncation, Some(&KEY), round);
        let whole = coming.write();
        assert!(whole.starts_with(&cut) && cut.len() >= HEADER_V2 && Frame::read(&cut).is_err());
        cuts.insert(whole.len() - cut.len());
    }
    assert_eq!(cuts, (2..=12).collect());
}

#[test]
fn link_ids_are_other_than_the_senders() {
    for attack in [Attack::RelabelledLink, Attack::NewLinkOld, Attack::NewLinkRecent] {
        let links: std::collections::BTreeSet<u8> =
            (0..300).map(|round| signed(attack, round).signature.unwrap().link).collect();
        assert!(links.len() == 255 && !links.contains(&0), "{attack:?}");
    }
}

#[test]
fn timestamps_are_moved_as_far_as_stated() {
    let coming = sent(3, Some(&KEY)).signature.unwrap().timestamp;
    let stamp = |attack| signed(attack, 0).signature.unwrap().timestamp;
    assert_eq!(stamp(Attack::NewLinkOld), coming - 120 * TICKS);
    assert_eq!(stamp(Attack::NewLinkRecent), coming - 30 * TICKS);
    for attack in [Attack::FutureForged, Attack::FutureInsider, Attack::FutureInsiderBeside] {
        assert_eq!(stamp(attack), coming + HOUR);
    }
}

#[test]
fn messages_have_the_ids_that_are_stated() {
    for (attack, id) in [
        (Attack::KeyChangeUnsigned, SETUP_SIGNING),
        (Attack::KeyChangeSigned, SETUP_SIGNING),
        (Attack::UnknownMessage, UNKNOWN),
        (Attack::UnsignedCommand, COMMAND_LONG),
    ] {
        assert_eq!(signed(attack, 0).message, id, "{attack:?}");
    }
    let (own_frame, frame) = (signed(Attack::FutureInsider, 0), signed(Attack::FutureInsiderBeside, 0));
    assert_eq!((own_frame.system, signed(Attack::Spoof, 0).system), (1, 1));
    assert_ne!(frame.system, own_frame.system);
}
