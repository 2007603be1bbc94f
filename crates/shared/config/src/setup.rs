//! Setup of every core: its identity, its own keys, the policy and the bounds.
//!
//! Live, the launcher hands this over an inherited descriptor; in the twin it is passed by value. Each service gets
//! only its own secret and the keys of its own channels.

use wire::bounds::Bounds;
use wire::bus::{ChannelKey, Sender};
use wire::core::Topic;
use wire::id::{Boot, NodeId, WorldId};
use wire::policy::Policy;
use wire::roster::RosterError;
use wire::sign::{Key, Keyring, Secret, SharedVerifier};
use wire::time::Span;
use wire::trust::BusGate;

/// A channel that a core sends or receives on; a producer has one for each of its readers.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Channel {
    /// Topic of the messages.
    pub topic: Topic,
    /// The only node that may write the channel.
    pub producer: NodeId,
    /// Key shared by the producer and this reader.
    pub key: ChannelKey,
}

/// The making of a core.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Setup {
    /// Identity of the core.
    pub node: NodeId,
    /// Number of starts of the core.
    pub boot: Boot,
    /// The world it runs in; zero live.
    pub world: WorldId,
    /// Seed of everything that the core draws.
    pub seed: u64,
    /// Policy in force.
    pub policy: Policy,
    /// Bounds in force.
    pub bounds: Bounds,
    /// Secret of the core's Ed25519 key.
    pub secret: Secret,
    /// The identities of the run, each once, with its public key.
    pub public_keys: Vec<(NodeId, [u8; 32])>,
    /// Channels of the core.
    pub channels: Vec<Channel>,
    /// The scenario loader's consent to a policy with waivers; without it such a policy admits no authority.
    pub ablation: Option<Ablation>,
    /// Verifier of signatures for all cores of one process. Only the twin has one, and it cannot be sent: a live
    /// service verifies everything itself.
    #[serde(skip)]
    pub verifier: Option<SharedVerifier>,
}

/// The scenario loader's token: this run is an ablation, named so in every artefact.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Ablation {
    /// Scenario that asked for it.
    pub scenario: String,
}

/// A core asked for a channel that its setup does not list, or not for each of the channel's readers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no key for channel `{}` in this setup", .0.name())]
pub struct NoChannel(pub Topic);

impl Setup {
    /// The core's own signing key.
    pub fn key(&self) -> Key {
        self.key_of(&self.secret)
    }

    /// The signing key for which the core signs.
    pub fn key_of(&self, secret: &Secret) -> Key {
        let key = Key::from_bytes(&secret.0);
        match &self.verifier {
            Some(verifier) => key.told_to(verifier.clone()),
            None => key,
        }
    }

    /// The identities of this run with their public keys.
    pub fn keyring(&self) -> Result<Keyring, RosterError> {
        self.verifier.clone().map_or_else(Keyring::default, Keyring::asking).of_run(&self.public_keys)
    }

    /// The sending end of `topic`, as its producer.
    pub fn sender(&self, topic: Topic) -> Result<Sender, NoChannel> {
        let keys = self.channels.iter().filter(|c| c.topic == topic).map(|c| c.key.clone());
        let keys: Vec<ChannelKey> = keys.collect();
        // A missing tag would make one reader deaf in silence: each reader checks for its own.
        if keys.len() != topic.readers() {
            return Err(NoChannel(topic));
        }
        Ok(Sender::to_readers(topic, self.node, self.boot, keys))
    }

    /// The gate in front of `topic`; a message may be at most `freshness` old.
    pub fn gate(&self, topic: Topic, freshness: Span) -> Result<BusGate, NoChannel> {
        let channel = self.channel(topic)?;
        Ok(BusGate::new(topic, channel.producer, channel.key.clone(), freshness))
    }

    /// The gates in front of `topic`, one for each station that may write there; a message may be at most `freshness`
    /// old.
    pub fn gates(&self, topic: Topic, freshness: Span) -> Result<Vec<BusGate>, NoChannel> {
        let of_topic = self.channels.iter().filter(|c| c.topic == topic);
        let gates: Vec<BusGate> = of_topic.map(|c| BusGate::new(topic, c.producer, c.key.clone(), freshness)).collect();
        if gates.is_empty() { Err(NoChannel(topic)) } else { Ok(gates) }
    }

    /// True if authority may be minted under this policy: full, or an admitted ablation.
    pub fn admits_authority(&self) -> bool {
        // A policy with waivers needs the loader's consent besides: a run that its artefacts do not name an ablation
        // must not act.
        self.policy.is_full() || self.ablation.is_some()
    }

    fn channel(&self, topic: Topic) -> Result<&Channel, NoChannel> {
        self.channels.iter().find(|c| c.topic == topic).ok_or(NoChannel(topic))
    }
}
