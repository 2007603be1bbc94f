//! Messages over shared memory: header, body, keyed tag.
//!
//! Any process of the same user can write shared memory, so a tag says who made a message: one for each reader of the
//! channel ([`Topic::readers`]), under a key that only its producer and that reader have.
//! Reading goes through the same trust stages as a record from a network (`crate::trust`).

use crate::core::Topic;
use crate::id::{Boot, NodeId, Sequence};
use crate::time::Instant;

/// Bytes before the body: topic, producer, boot, sequence, stamp.
pub const HEADER_LEN: usize = 1 + 1 + 4 + 8 + 8;
/// Bytes of one tag, behind the body: BLAKE3 in keyed mode, truncated to 128 bits.
pub const TAG_LEN: usize = 16;

/// The key of one channel, shared by its one producer and one reader.
#[derive(Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct ChannelKey(pub [u8; 32]);

impl core::fmt::Debug for ChannelKey {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("ChannelKey(…)")
    }
}

/// Header that stands before the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Channel of the message.
    pub topic: Topic,
    /// Number of the producer in the table of identities, not yet believed.
    pub producer: u8,
    /// Boot of the producer.
    pub boot: Boot,
    /// Sequence of the message on this channel, from 1.
    pub sequence: Sequence,
    /// Time at which it was made, on this host's clock.
    pub stamp: Instant,
}

/// The sending end of one channel.
#[derive(Clone, Debug)]
pub struct Sender {
    topic: Topic,
    producer: NodeId,
    boot: Boot,
    sequence: Sequence,
    keys: Vec<ChannelKey>,
}

impl Sender {
    /// `producer`'s end of the channel; all its readers share `key`.
    pub fn new(topic: Topic, producer: NodeId, boot: Boot, key: ChannelKey) -> Self {
        Self::to_readers(topic, producer, boot, vec![key; topic.readers()])
    }

    /// `producer`'s end of the channel, with each reader's key.
    pub fn to_readers(topic: Topic, producer: NodeId, boot: Boot, keys: Vec<ChannelKey>) -> Self {
        Self { topic, producer, boot, sequence: Sequence(0), keys }
    }

    /// Header, `body` and tags, ready to publish.
    pub fn seal(&mut self, now: Instant, body: &[u8]) -> Vec<u8> {
        self.sequence = self.sequence.next();
        let mut bytes = Vec::with_capacity(HEADER_LEN + body.len() + self.keys.len() * TAG_LEN);
        bytes.push(self.topic as u8);
        bytes.push(self.producer.index() as u8);
        bytes.extend_from_slice(&self.boot.0.to_le_bytes());
        bytes.extend_from_slice(&self.sequence.0.to_le_bytes());
        bytes.extend_from_slice(&now.0.to_le_bytes());
        bytes.extend_from_slice(body);
        let signed = bytes.len();
        for key in &self.keys {
            let tag = tag(key, &bytes[..signed]);
            bytes.extend_from_slice(&tag);
        }
        bytes
    }

    /// The boot that its messages are of.
    pub fn boot(&self) -> Boot {
        self.boot
    }

    /// Number of messages sealed.
    pub fn sent(&self) -> u64 {
        self.sequence.0
    }
}

/// Bytes between header and tags, untrusted and not judged. The trust boundary does not read them here.
pub fn body(bytes: &[u8]) -> Option<&[u8]> {
    split(bytes).map(|parts| parts.body)
}

/// The tag over header and body.
pub(crate) fn tag(key: &ChannelKey, bytes: &[u8]) -> [u8; TAG_LEN] {
    let mut tag = [0; TAG_LEN];
    tag.copy_from_slice(&blake3::keyed_hash(&key.0, bytes).as_bytes()[..TAG_LEN]);
    tag
}

/// True if `tags` has the tag that is expected. Each comparison takes the same time, however much of a tag is right: a tag must
/// not be found byte by byte by timing.
pub(crate) fn has_tag(tags: &[u8], expected: &[u8; TAG_LEN]) -> bool {
    let whole = |tag: &[u8]| {
        let mut bytes = [0; blake3::OUT_LEN];
        bytes[..TAG_LEN].copy_from_slice(tag);
        blake3::Hash::from_bytes(bytes)
    };
    let expected = whole(expected);
    // No short circuit: every reader's tag is compared.
    tags.chunks_exact(TAG_LEN).fold(false, |found, tag| found | (whole(tag) == expected))
}

/// Claimed producer of a message: for finding the gate that is to judge it.
pub fn claimed_producer(bytes: &[u8]) -> Option<usize> {
    split(bytes).map(|parts| usize::from(parts.header.producer))
}

/// Parts of a message, not yet judged.
#[derive(Debug)]
pub(crate) struct Parts<'b> {
    pub(crate) header: Header,
    /// Bytes that the tags cover: header and body.
    pub(crate) signed: &'b [u8],
    pub(crate) body: &'b [u8],
    /// Tags, one for each reader of the channel.
    pub(crate) tags: &'b [u8],
}

/// Splits a message into its parts; `None` when it is too short or of no known topic.
pub(crate) fn split(bytes: &[u8]) -> Option<Parts<'_>> {
    let header = bytes.first_chunk::<HEADER_LEN>()?;
    let topic = Topic::ALL.get(usize::from(header[0])).copied()?;
    let (signed, tags) = bytes.split_at_checked(bytes.len().checked_sub(topic.readers() * TAG_LEN)?)?;
    let body = signed.get(HEADER_LEN..)?;
    let boot = u32::from_le_bytes(header[2..6].try_into().ok()?);
    let sequence = u64::from_le_bytes(header[6..14].try_into().ok()?);
    let stamp = u64::from_le_bytes(header[14..22].try_into().ok()?);
    let header =
        Header { topic, producer: header[1], boot: Boot(boot), sequence: Sequence(sequence), stamp: Instant(stamp) };
    Some(Parts { header, signed, body, tags })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec;
    use crate::policy::Policy;
    use crate::refusal::Refusal;
    use crate::sensor::{Navigation, ProductMode};
    use crate::time::Span;
    use crate::track::Tracks;
    use crate::trust::BusGate;

    const NOW: Instant = Instant(5_000_000);

    fn tracks(mode: ProductMode) -> Vec<u8> {
        let (frame, stamp) = (crate::id::FrameId(1), NOW);
        let (tracks, crops) = Default::default();
        codec::encode(&Tracks { frame, stamp, mode, products: [None; 4], tracks, crops, nearby: None })
    }

    #[test]
    fn channel_reader_cannot_write_to_another_reader() {
        let [first, second] = [1, 2].map(|k| ChannelKey([k; 32]));
        let body = codec::encode(&Navigation { stamp: NOW, fix: None, odometry: None, spatial: None });
        let gate = |key: &ChannelKey| BusGate::new(Topic::Navigation, NodeId::SIM, key.clone(), Span::ms(300));
        let admits =
            |gate: &mut BusGate, bytes: &[u8]| gate.admit::<Navigation>(&Policy::default(), NOW, bytes).map(|_| ());
        let both = vec![first.clone(), second.clone()];
        let genuine = Sender::to_readers(Topic::Navigation, NodeId::SIM, Boot(1), both).seal(NOW, &body);
        assert_eq!(admits(&mut gate(&first), &genuine), Ok(()));
        assert_eq!(admits(&mut gate(&second), &genuine), Ok(()));
        let forged = Sender::new(Topic::Navigation, NodeId::SIM, Boot(2), first.clone()).seal(NOW, &body);
        assert_eq!(admits(&mut gate(&first), &forged), Ok(()), "to itself it can say anything");
        assert_eq!(admits(&mut gate(&second), &forged), Err(Refusal::Tag { expected: NodeId::SIM }));
    }

    /// So does any product that is not live.
    #[test]
    fn replayed_product_leaves_the_window_unchanged() {
        let key = ChannelKey([1; 32]);
        let mut gate = BusGate::new(Topic::Tracks, NodeId::PERCEPTION, key.clone(), Span::ms(300));
        let mut admit = |bytes: &[u8]| gate.admit::<Tracks>(&Policy::default(), NOW, bytes).map(|_| ());
        let mut genuine = Sender::new(Topic::Tracks, NodeId::PERCEPTION, Boot(1), key.clone());
        let mut other = Sender::new(Topic::Tracks, NodeId::PERCEPTION, Boot(2), key);
        assert_eq!(admit(&genuine.seal(NOW, &tracks(ProductMode::Live))), Ok(()));
        let refused = admit(&other.seal(NOW, &tracks(ProductMode::Synthetic)));
        assert_eq!(refused, Err(Refusal::Product { got: ProductMode::Synthetic }));
        assert_eq!(admit(&genuine.seal(NOW, &tracks(ProductMode::Live))), Ok(()), "its boot is still the newest");
    }

    #[test]
    fn short_or_topicless_bytes_do_not_parse() {
        let whole = Sender::new(Topic::Navigation, NodeId::SIM, Boot(1), ChannelKey([1; 32])).seal(NOW, &[7]);
        assert_eq!(body(&whole), Some(&[7][..]));
        for length in 0..whole.len() - 1 {
            assert_eq!(body(&whole[..length]), None, "{length}");
        }
        assert_eq!(body(&[99; 80]), None);
    }
}
