//! Messages over shared memory: header, body, keyed tag.
//!
//! Any process of the same user can write shared memory, so a tag under a per-channel key says who made a message.
//! Reading goes through the same trust stages as a record from a network (`crate::trust`).

use crate::core::Topic;
use crate::id::{Boot, NodeId, Sequence};
use crate::time::Instant;

/// Bytes before the body: topic, producer, boot, sequence, stamp.
pub const HEADER_LEN: usize = 1 + 1 + 4 + 8 + 8;
/// Bytes after the body: BLAKE3 in keyed mode, truncated to 128 bits.
pub const TAG_LEN: usize = 16;

/// The key of one channel, shared by its one producer and its consumers.
#[derive(Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct ChannelKey(pub [u8; 32]);

impl core::fmt::Debug for ChannelKey {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("ChannelKey(…)")
    }
}

/// What stands before the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Channel.
    pub topic: Topic,
    /// Index of the producer in the closed set of identities, not yet believed.
    pub producer: u8,
    /// Its boot.
    pub boot: Boot,
    /// Its sequence on this channel, from 1.
    pub sequence: Sequence,
    /// When it was made, on this host's clock.
    pub stamp: Instant,
}

/// The sending end of one channel.
#[derive(Clone, Debug)]
pub struct Sender {
    topic: Topic,
    producer: NodeId,
    boot: Boot,
    sequence: Sequence,
    key: ChannelKey,
}

impl Sender {
    /// `producer`'s end of the channel.
    pub fn new(topic: Topic, producer: NodeId, boot: Boot, key: ChannelKey) -> Self {
        Self { topic, producer, boot, sequence: Sequence(0), key }
    }

    /// Header, `body` and tag, ready to publish.
    pub fn seal(&mut self, now: Instant, body: &[u8]) -> Vec<u8> {
        self.sequence = self.sequence.next();
        let mut bytes = Vec::with_capacity(HEADER_LEN + body.len() + TAG_LEN);
        bytes.push(self.topic as u8);
        bytes.push(self.producer.index() as u8);
        bytes.extend_from_slice(&self.boot.0.to_le_bytes());
        bytes.extend_from_slice(&self.sequence.0.to_le_bytes());
        bytes.extend_from_slice(&now.0.to_le_bytes());
        bytes.extend_from_slice(body);
        let tag = tag(&self.key, &bytes);
        bytes.extend_from_slice(&tag);
        bytes
    }

    /// How many messages have been sealed.
    pub fn sent(&self) -> u64 {
        self.sequence.0
    }
}

/// The tag over header and body.
pub(crate) fn tag(key: &ChannelKey, bytes: &[u8]) -> [u8; TAG_LEN] {
    let mut tag = [0; TAG_LEN];
    tag.copy_from_slice(&blake3::keyed_hash(&key.0, bytes).as_bytes()[..TAG_LEN]);
    tag
}

/// Who a message says made it: for finding the gate that is to judge it.
pub fn claimed_producer(bytes: &[u8]) -> Option<usize> {
    split(bytes).map(|(header, ..)| usize::from(header.producer))
}

/// Splits a message into header, body and tag; `None` when it is too short or of no known topic.
pub(crate) fn split(bytes: &[u8]) -> Option<(Header, &[u8], &[u8; TAG_LEN])> {
    let (signed, tag) = bytes.split_last_chunk::<TAG_LEN>()?;
    let (header, body) = signed.split_first_chunk::<HEADER_LEN>()?;
    let topic = Topic::ALL.get(usize::from(header[0])).copied()?;
    let boot = u32::from_le_bytes(header[2..6].try_into().ok()?);
    let sequence = u64::from_le_bytes(header[6..14].try_into().ok()?);
    let stamp = u64::from_le_bytes(header[14..22].try_into().ok()?);
    let header =
        Header { topic, producer: header[1], boot: Boot(boot), sequence: Sequence(sequence), stamp: Instant(stamp) };
    Some((header, body, tag))
}
