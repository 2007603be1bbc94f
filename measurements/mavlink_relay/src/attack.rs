//! The attacks: each turns captured messages of the true sender into one message of the attacker.
//!
//! The attacker sees every message of the sender before the receiver does. A *holder of the key* is a third system with the key of
//! a signed link, which every end of a link has to share. The classes that the rules require are in `expected`.

use rand_chacha::ChaCha8Rng;
use rand_core::RngCore;
use serde::{Deserialize, Serialize};

use crate::frame::{Frame, HEADER_V2, SIGNATURE_LENGTH, SIGNED, Signature, Version};
use crate::message::{arm, downgraded, key_change, seed, unknown};
use crate::signature::{self, Key, TICKS};

/// System id of the holder of the key in `future-insider-beside`; its link id in `spoof`.
const INSIDER: u8 = 99;
/// The key that an attacker announces or signs with where no key of the link is held.
const FOREIGN: Key = [0x5a; 32];
/// An hour in timestamp units.
const HOUR: u64 = 3600 * TICKS;

/// Kind of link under attack.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Link {
    /// No end has a key.
    Unsigned,
    /// Both ends have the key, the sender signs, the receiver accepts signed messages only.
    Signed,
}

impl Link {
    /// Both.
    pub const ALL: [Link; 2] = [Link::Unsigned, Link::Signed];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Link::Unsigned => "unsigned",
            Link::Signed => "signed",
        }
    }
}

/// An attack; `expected.toml` describes each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "expected.toml has a line for each")]
pub enum Attack {
    UnsignedCommand,
    UnknownMessage,
    Downgrade,
    ReplayNewest,
    ReplayOlder,
    RebootReplayRecent,
    RebootReplayOld,
    RelabelledLink,
    NewLinkOld,
    NewLinkRecent,
    KeyChangeUnsigned,
    KeyChangeSigned,
    PayloadFlip,
    PayloadRewrite,
    SignatureFlip,
    Truncation,
    Spoof,
    FutureForged,
    FutureInsider,
    FutureInsiderBeside,
}

/// Captured messages of the true sender.
#[derive(Clone, Copy, Debug)]
pub struct Captured<'a> {
    /// On its way: the receiver does not have it yet.
    pub coming: &'a Frame,
    /// The newest that the receiver has.
    pub newest: &'a Frame,
    /// The one before it.
    pub older: &'a Frame,
    /// Number of the round, from 0.
    pub round: u32,
}

impl Attack {
    /// Name in tables, which is the one in `expected.toml`.
    pub fn name(self) -> String {
        let words = format!("{self:?}");
        let dashed = words.char_indices().flat_map(|(i, c)| {
            let dash = (i > 0 && c.is_ascii_uppercase()).then_some('-');
            dash.into_iter().chain([c.to_ascii_lowercase()])
        });
        dashed.collect()
    }

    /// Seconds between the capture and the present for an attack that meets a receiver after its restart; `None` for all others.
    pub fn restarts_after_s(self) -> Option<u32> {
        let behind = [(Attack::RebootReplayRecent, 0), (Attack::RebootReplayOld, 3600)];
        behind.into_iter().find(|(attack, _)| *attack == self).map(|(_, seconds)| seconds)
    }

    /// The attacker's datagram. `key` is the link's, and is used by holders of the key alone; on an unsigned link they sign with
    /// their own key.
    pub fn datagram(self, captured: Captured<'_>, key: Option<&Key>, rng: &mut ChaCha8Rng) -> Vec<u8> {
        let key = key.unwrap_or(&FOREIGN);
        let (now, own_link) = (stamp(captured.coming), link(captured.coming));
        let command = || arm(captured.newest, captured.round as f32);
        let frame = match self {
            Attack::UnsignedCommand => command(),
            Attack::UnknownMessage => unknown(captured.newest, rng.next_u64().to_le_bytes()),
            Attack::Downgrade => downgraded(captured.newest),
            Attack::ReplayNewest | Attack::RebootReplayRecent | Attack::RebootReplayOld => captured.newest.clone(),
            Attack::ReplayOlder => captured.older.clone(),
            Attack::KeyChangeUnsigned => key_change(captured.newest, &FOREIGN, now),
            Attack::PayloadFlip | Attack::PayloadRewrite => flipped_payload(self, captured.coming, rng),
            Attack::Truncation => return truncated(captured.coming, rng),
            // On an unsigned link any system's word is as good: nothing is signed there.
            Attack::Spoof if is_signed(captured.coming) => signed(command(), key, INSIDER, now),
            Attack::Spoof => command(),
            Attack::SignatureFlip | Attack::FutureForged => damaged(self, captured.coming, key, rng),
            Attack::RelabelledLink => relabelled(captured, key),
            Attack::NewLinkOld => {
                signed(command(), key, other_link(own_link, captured.round), now.saturating_sub(120 * TICKS))
            }
            Attack::NewLinkRecent => {
                signed(command(), key, other_link(own_link, captured.round), now.saturating_sub(30 * TICKS))
            }
            Attack::KeyChangeSigned => signed(key_change(captured.newest, &FOREIGN, now), key, INSIDER, now),
            Attack::FutureInsider => signed(command(), key, own_link, now + HOUR),
            Attack::FutureInsiderBeside => signed(Frame { system: INSIDER, ..command() }, key, INSIDER, now + HOUR),
        };
        frame.write()
    }
}

/// Timestamp of a captured message; an hour after the epoch where it has none.
fn stamp(frame: &Frame) -> u64 {
    frame.signature.map_or(HOUR, |signature| signature.timestamp)
}

/// Link id of a captured message.
fn link(frame: &Frame) -> u8 {
    frame.signature.map_or(0, |signature| signature.link)
}

/// A link id other than `own`, another in each of 255 rounds.
fn other_link(own_link: u8, round: u32) -> u8 {
    own_link.wrapping_add((round % 255) as u8 + 1)
}

fn signed(mut frame: Frame, key: &Key, link: u8, timestamp: u64) -> Frame {
    let seed = seed(frame.message);
    signature::sign(&mut frame, key, seed, link, timestamp);
    frame
}

fn flipped_payload(attack: Attack, of: &Frame, rng: &mut ChaCha8Rng) -> Frame {
    let mut frame = of.clone();
    let bits = frame.payload.len() * 8;
    if bits > 0 {
        let bit = rng.next_u32() as usize % bits;
        frame.payload[bit / 8] ^= 1 << (bit % 8);
    }
    if attack == Attack::PayloadRewrite {
        frame.seal(seed(frame.message));
    }
    frame
}

/// Between 2 and 12 bytes fewer: of a signed frame, a part of the signature.
fn truncated(frame: &Frame, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = frame.write();
    let cut = 2 + rng.next_u32() as usize % (SIGNATURE_LENGTH - 2);
    bytes.truncate(bytes.len().saturating_sub(cut).max(HEADER_V2));
    bytes
}

fn is_signed(frame: &Frame) -> bool {
    matches!(frame.version, Version::V2 { incompatible, .. } if incompatible & SIGNED != 0)
}

/// Attacks without the key on the block behind the checksum. A message of an unsigned link is signed under a foreign key first.
fn damaged(attack: Attack, of: &Frame, key: &Key, rng: &mut ChaCha8Rng) -> Frame {
    let mut frame = if is_signed(of) { of.clone() } else { signed(of.clone(), key, link(of), stamp(of)) };
    let Some(block) = &mut frame.signature else { return frame };
    if attack == Attack::SignatureFlip {
        let bit = rng.next_u32() as usize % (block.hash.len() * 8);
        block.hash[bit / 8] ^= 1 << (bit % 8);
    } else {
        let mut hash = [0; 6];
        rng.fill_bytes(&mut hash);
        *block = Signature { link: block.link, timestamp: block.timestamp + HOUR, hash };
    }
    frame
}

/// The signed message, link id aside.
fn relabelled(captured: Captured<'_>, key: &Key) -> Frame {
    let newest = captured.newest;
    let mut frame =
        if is_signed(newest) { newest.clone() } else { signed(newest.clone(), key, link(newest), stamp(newest)) };
    if let Some(block) = &mut frame.signature {
        block.link = other_link(block.link, captured.round);
    }
    frame
}
