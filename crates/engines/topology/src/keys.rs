//! The keys of one run, all derived from one secret: seeded in the twin, from the operating system live.
//!
//! Each member is handed its own and no other.

use config::setup::Channel;
use wire::bus::ChannelKey;
use wire::core::Topic;
use wire::id::NodeId;
use wire::sign::Key;
use wire::sign::Secret;
use wire::trust::Revocation;

use super::Host;

/// The secret of a run; it never leaves the launcher.
#[derive(Clone)]
pub struct RunSecret([u8; 32]);

impl RunSecret {
    /// The twin's: from the seed, so that a run repeats bit by bit.
    pub fn seeded(seed: u64) -> Self {
        Self(blake3::derive_key("holdsafe twin run secret v1", &seed.to_le_bytes()))
    }

    /// Secret of a live run, from 32 random bytes.
    pub fn random(bytes: [u8; 32]) -> Self {
        Self(bytes)
    }

    /// A node's signing secret.
    pub fn signing_secret(&self, node: NodeId) -> Secret {
        Secret(self.derive("holdsafe signing secret v1", node.name().as_bytes()))
    }

    /// Secret of a witness that is no service: a node's ingress observer, or the launcher for notes of its own actions.
    pub(super) fn witness(&self, node: NodeId) -> Secret {
        Secret(self.derive("holdsafe witness secret v1", node.name().as_bytes()))
    }

    /// A revocation of each identity that can be revoked. Here the authority's key is used, and only here.
    pub fn revocations(&self) -> Vec<(NodeId, Vec<u8>)> {
        let authority = self.authority();
        let strikable = [NodeId::OPERATOR, NodeId::OPERATOR_2, NodeId::UNIT_B, NodeId::UNIT_C];
        strikable.map(|of| (of, Revocation { of }.sign(&authority))).to_vec()
    }

    /// Public keys of all signers.
    pub fn public_keys(&self) -> Vec<(NodeId, [u8; 32])> {
        let signers = [
            NodeId::UNIT_A,
            NodeId::UNIT_B,
            NodeId::UNIT_C,
            NodeId::OPERATOR,
            NodeId::OPERATOR_2,
            NodeId::AUTHORITY,
            NodeId::GATEWAY,
            NodeId::CONSOLE,
            NodeId::RECORDER,
        ];
        signers.map(|node| (node, Key::from_bytes(&self.signing_secret(node).0).public())).to_vec()
    }

    /// The keys of these channels on `host` that `node` gets: of each that it writes, every reader's; of each that it reads,
    /// its own.
    pub fn channels(&self, host: Host, node: NodeId, topics: &[(Topic, NodeId)]) -> Vec<Channel> {
        let channel = |(topic, producer): (Topic, NodeId), reader: usize| {
            let bytes = [host as u8, topic as u8, producer.index() as u8, reader as u8];
            Channel { topic, producer, key: ChannelKey(self.derive("holdsafe channel key v3", &bytes)) }
        };
        let of = |(topic, producer): (Topic, NodeId)| {
            let readers =
                // With one key for all readers, a reader could write to the others in the producer's name.
                if producer == node { 0..topic.readers() } else { reader(topic, node)..reader(topic, node) + 1 };
            readers.map(move |reader| channel((topic, producer), reader))
        };
        topics.iter().copied().flat_map(of).collect()
    }

    /// Key that encrypts the messages of a channel; its publisher and its readers hold it.
    pub fn cipher(&self, host: Host, scope: &str, topic: Topic) -> Secret {
        let bytes = [&[host as u8, topic as u8], scope.as_bytes()].concat();
        Secret(self.derive("holdsafe channel cipher v1", &bytes))
    }

    /// The authority's signing key, for what is signed before a run's first service starts.
    pub fn authority(&self) -> Key {
        Key::from_bytes(&self.signing_secret(NodeId::AUTHORITY).0)
    }

    fn derive(&self, context: &str, bytes: &[u8]) -> [u8; 32] {
        let mut material = blake3::Hasher::new_derive_key(context);
        material.update(&self.0).update(bytes);
        *material.finalize().as_bytes()
    }
}

/// Index of a node among a topic's readers. Only navigation has two: perception, and the unit itself.
fn reader(topic: Topic, node: NodeId) -> usize {
    usize::from(topic.readers() > 1 && node.unit().is_some())
}

/// Node of the signing key that a node holds: an insider signs as the node that it replaces.
pub(super) fn signer(node: NodeId) -> NodeId {
    match node {
        NodeId::INSIDER_B => NodeId::UNIT_B,
        NodeId::INSIDER_BROKER => NodeId::BROKER,
        NodeId::INSIDER_GATEWAY => NodeId::GATEWAY,
        node => node,
    }
}
