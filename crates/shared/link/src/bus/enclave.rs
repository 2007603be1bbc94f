//! Rights on the inner buses of a run: which service may publish and subscribe on which channel, and when.
//!
//! One document for all services of a run, similar to SROS 2's enclaves and DDS Security's permissions: a right that it does not
//! list is denied, and the run's authority signs it. Each service gets the document, and opens no channel without a right; a
//! message before or after the time of the rights is neither sent nor received. A compromised service can ignore its copy: then the
//! channel keys restrict it, of which it has only its own ([`super::cipher`], `wire::bus`).

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use wire::core::Topic;
use wire::id::NodeId;
use wire::refusal::Refusal;
use wire::sign::{Key, Keyring, Purpose, Signed};

/// The longest document, bytes: a run of ten services on three hosts has 4 KiB.
pub const MAX_DOCUMENT: usize = 64 * 1024;
/// The longest signature with its frame, bytes.
const MAX_SIGNATURE: usize = 256;

/// Rights of one run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Enclaves {
    /// Start of the rights, microseconds of the machine's monotonic clock.
    pub from_us: u64,
    /// End of the rights.
    pub until_us: u64,
    /// Rights by service.
    pub services: BTreeMap<String, Rights>,
}

/// Rights of one service, as channels `scope/topic`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rights {
    /// Channels that it writes.
    #[serde(default)]
    pub publishes: Vec<String>,
    /// Channels that it reads.
    #[serde(default)]
    pub subscribes: Vec<String>,
}

/// The document with its signature, as a service gets it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignedEnclaves {
    /// The document, JSON.
    pub document: String,
    /// The authority's signature over its SHA-256.
    pub signature: Vec<u8>,
    /// The authority's public key.
    pub authority: [u8; 32],
}

/// A channel that is not opened, or a document that gives no right.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Denied {
    /// The document is too long, or its authority is no key.
    #[error("enclaves: at most {MAX_DOCUMENT} bytes signed by a key expected, got {0} bytes")]
    Form(usize),
    /// The signature is not the authority's over this document.
    #[error("enclaves: the authority's signature expected: {0}")]
    Signature(Refusal),
    /// Not the document's schema.
    #[error("enclaves: {0}")]
    Schema(String),
    /// The service has no such right.
    #[error("enclaves: {node} has no right to {verb} {channel}")]
    NoRight {
        /// Service.
        node: NodeId,
        /// `publish` or `subscribe`.
        verb: &'static str,
        /// Channel.
        channel: String,
    },
}

impl Enclaves {
    /// The document with the signature of `authority`.
    ///
    /// # Errors
    /// When it is longer than [`MAX_DOCUMENT`].
    pub fn sign(&self, authority: &Key) -> Result<SignedEnclaves, Denied> {
        let document = serde_json::to_string_pretty(self).map_err(|error| Denied::Schema(error.to_string()))?;
        if document.len() > MAX_DOCUMENT {
            return Err(Denied::Form(document.len()));
        }
        let signature = authority.sign(Purpose::Enclaves, &Sha256::digest(&document));
        Ok(SignedEnclaves { document, signature, authority: authority.public() })
    }
}

/// Rights of one service, from a document that the authority signed. Only [`SignedEnclaves::granted`] constructs it.
#[derive(Clone, Debug)]
pub struct Granted {
    node: NodeId,
    rights: Rights,
    /// The time of the rights, microseconds of the machine's monotonic clock.
    pub(crate) time: (u64, u64),
}

impl SignedEnclaves {
    /// The rights of `node`; none that the document does not list.
    ///
    /// # Errors
    /// Too long, not signed by the authority, or not of the schema.
    pub fn granted(&self, node: NodeId) -> Result<Granted, Denied> {
        let form = Denied::Form(self.document.len());
        let mut keys = Keyring::default();
        if self.document.len() > MAX_DOCUMENT || !keys.insert(NodeId::AUTHORITY, &self.authority) {
            return Err(form);
        }
        let signed = Signed::parse(&self.signature, MAX_SIGNATURE).map_err(Denied::Signature)?;
        keys.verify(NodeId::AUTHORITY, Purpose::Enclaves, &signed).map_err(Denied::Signature)?;
        if signed.payload != Sha256::digest(&self.document).as_slice() {
            return Err(Denied::Signature(Refusal::Signature { signer: NodeId::AUTHORITY }));
        }
        // Parsed after its signature is verified: a forged document reaches no parser.
        let enclaves: Enclaves =
            serde_json::from_str(&self.document).map_err(|error| Denied::Schema(error.to_string()))?;
        let rights = enclaves.services.get(node.name()).cloned().unwrap_or_default();
        Ok(Granted { node, rights, time: (enclaves.from_us, enclaves.until_us) })
    }
}

impl Granted {
    /// Checks the right to write a channel.
    ///
    /// # Errors
    /// When there is no such right.
    pub fn may_publish(&self, scope: &str, topic: Topic) -> Result<(), Denied> {
        self.check_right("publish", &self.rights.publishes, scope, topic)
    }

    /// Checks the right to read a channel.
    ///
    /// # Errors
    /// When there is no such right.
    pub fn may_subscribe(&self, scope: &str, topic: Topic) -> Result<(), Denied> {
        self.check_right("subscribe", &self.rights.subscribes, scope, topic)
    }

    fn check_right(&self, verb: &'static str, rights: &[String], scope: &str, topic: Topic) -> Result<(), Denied> {
        let channel = channel(scope, topic);
        if rights.contains(&channel) { Ok(()) } else { Err(Denied::NoRight { node: self.node, verb, channel }) }
    }
}

/// A channel's name in the document.
pub fn channel(scope: &str, topic: Topic) -> String {
    format!("{scope}/{}", topic.name())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document() -> Enclaves {
        let rights = Rights { publishes: vec!["unit-a/tracks".into()], subscribes: vec!["unit-a/frames".into()] };
        Enclaves { from_us: 1, until_us: 9, services: BTreeMap::from([("perception".into(), rights)]) }
    }

    fn signed() -> SignedEnclaves {
        document().sign(&Key::from_bytes(&[7; 32])).unwrap()
    }

    #[test]
    fn unlisted_right_is_denied() {
        let granted = signed().granted(NodeId::PERCEPTION).unwrap();
        assert_eq!(granted.may_publish("unit-a", Topic::Tracks), Ok(()));
        assert_eq!(granted.may_subscribe("unit-a", Topic::Frames), Ok(()));
        for (scope, topic) in [("unit-a", Topic::Frames), ("unit-b", Topic::Tracks), ("unit-a", Topic::Drive)] {
            assert!(matches!(granted.may_publish(scope, topic), Err(Denied::NoRight { verb: "publish", .. })));
        }
        assert!(granted.may_subscribe("unit-a", Topic::Tracks).is_err(), "to write is not to read");
        let other = signed().granted(NodeId::SIM).unwrap();
        assert!(other.may_subscribe("unit-a", Topic::Frames).is_err(), "another service has none");
    }

    #[test]
    fn altered_or_foreign_document_gives_no_right() {
        let altered = |alter: &dyn Fn(&mut SignedEnclaves)| {
            let mut signed = signed();
            alter(&mut signed);
            signed.granted(NodeId::PERCEPTION).map(|_| ()).unwrap_err()
        };
        let longer =
            altered(&|signed| signed.document = signed.document.replace("\"until_us\": 9", "\"until_us\": 99"));
        assert!(matches!(longer, Denied::Signature(_)), "{longer}");
        let other = altered(&|signed| signed.authority = Key::from_bytes(&[8; 32]).public());
        assert!(matches!(other, Denied::Signature(_)), "{other}");
        for n in 0..signed().signature.len() {
            altered(&|signed| signed.signature[n] ^= 1);
        }
        assert!(matches!(altered(&|signed| signed.document = " ".repeat(MAX_DOCUMENT + 1)), Denied::Form(_)));
        let schema =
            SignedEnclaves { document: "{\"from_us\":1,\"until_us\":2,\"services\":{},\"more\":1}".into(), ..signed() };
        let key = Key::from_bytes(&[7; 32]);
        let signature = key.sign(Purpose::Enclaves, &Sha256::digest(&schema.document));
        assert!(matches!(SignedEnclaves { signature, ..schema }.granted(NodeId::SIM), Err(Denied::Schema(_))));
    }
}
