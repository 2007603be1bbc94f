//! Whether a recording is what the services wrote, whoever kept it.
//!
//! Four things are set against each other. Each service's *chain*: an entry holds the hash of the one before. Each service's
//! *signature* over its head, once a second and as its last entry, which its public key has to verify. The recorder's *seals*
//! over everything in the order in which it came. And the *heads* of the chains as they are held outside the recorder, by
//! whoever ran the services: a recorder that keeps whole chains short, or leaves out a service, agrees with itself and not
//! with these. Public keys and heads are [`Held`]; secrets are in no file.
//!
//! What guards and the launcher note does not go by way of the recorder and is not judged here. Where among the entries of
//! others a seal stands is not sealed.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use wire::audit::{ChainError, Chains, Entry, Head};
use wire::event::Event;
use wire::id::NodeId;
use wire::sign::{Keyring, Purpose, Signed};

use crate::evidence::hex;

/// Most flaws that are told of one recording; the first is what matters.
const MAX_FLAWS: usize = 16;

/// What is held outside the recorder.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Held {
    /// The public key of each service that writes, hexadecimal.
    pub keys: BTreeMap<NodeId, String>,
    /// How far each one's chain went, by its own account.
    pub heads: Vec<HeldHead>,
    /// Who was killed on purpose and owes no last signature.
    pub killed: Vec<NodeId>,
}

/// A head that is held outside the recorder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeldHead {
    /// Whose chain.
    pub node: NodeId,
    /// Its last entry, counted from 1.
    pub counter: u64,
    /// SHA-256 of that entry, hexadecimal.
    pub hash: String,
}

impl From<Head> for HeldHead {
    fn from(head: Head) -> Self {
        HeldHead { node: head.node, counter: head.counter, hash: hex(&head.hash) }
    }
}

/// Something that does not hold, and where.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Flaw {
    /// The event of the recording, counted from 1; behind the last one for what is missing.
    pub at: usize,
    /// What.
    pub what: String,
}

impl core::fmt::Display for Flaw {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "event {}: {}", self.at, self.what)
    }
}

/// What became of a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Custody {
    /// Events in it.
    pub events: usize,
    /// Whether the recorder's closing seal covers everything.
    pub sealed: bool,
    /// Head of the recorder's own chain, hexadecimal.
    pub head: String,
    /// What does not hold, in order of place.
    pub flaws: Vec<Flaw>,
}

/// A service's signature over its head.
struct Signature {
    at: usize,
    head: [u8; 32],
    signature: [u8; 64],
}

/// Follows a recording, entry by entry, in the order in which it was kept.
pub struct Custodian<'a> {
    held: &'a Held,
    chains: Chains,
    events: usize,
    /// The recorder's head after each sealed entry, from none on.
    running: Vec<[u8; 32]>,
    seals: Vec<(usize, u64, [u8; 32])>,
    signatures: BTreeMap<NodeId, Vec<Signature>>,
    /// Whether a service's last entry is its signature.
    signed_last: BTreeMap<NodeId, bool>,
    flaws: Vec<Flaw>,
}

impl<'a> Custodian<'a> {
    /// One who has nothing yet.
    pub fn new(held: &'a Held) -> Self {
        Self {
            held,
            chains: Chains::default(),
            events: 0,
            running: vec![[0; 32]],
            seals: Vec::new(),
            signatures: BTreeMap::new(),
            signed_last: BTreeMap::new(),
            flaws: Vec::new(),
        }
    }

    /// Takes the next entry.
    ///
    /// # Errors
    /// When it does not continue its chain; that is noted too.
    pub fn take(&mut self, bytes: &[u8]) -> Result<Entry, ChainError> {
        self.events += 1;
        let entry = self.chains.follow(bytes).inspect_err(|error| {
            let at = self.events;
            self.flaws.push(Flaw { at, what: error.to_string() });
        })?;
        let hash = self.chains.heads().iter().find(|head| head.node == entry.node).map_or([0; 32], |head| head.hash);
        if entry.node != NodeId::RECORDER {
            let before = self.running.last().copied().unwrap_or_default();
            self.running.push(Sha256::new().chain_update(before).chain_update(hash).finalize().into());
        }
        let signed = matches!(entry.event, Event::Signed { .. });
        match entry.event {
            Event::Sealed { entries, head } if entry.node == NodeId::RECORDER => {
                self.seals.push((self.events, entries, head));
            }
            Event::Signed { signature } => {
                let signature = Signature { at: self.events, head: entry.previous, signature };
                self.signatures.entry(entry.node).or_default().push(signature);
            }
            _ => {}
        }
        self.signed_last.insert(entry.node, signed);
        Ok(entry)
    }

    /// Judges what was taken.
    pub fn close(mut self) -> Custody {
        self.seals();
        self.signatures();
        self.heads();
        let covered = self.seals.last().is_some_and(|(_, entries, _)| *entries as usize + 1 == self.running.len());
        let recorder = self.chains.heads().iter().find(|head| head.node == NodeId::RECORDER);
        let head = recorder.map(|head| hex(&head.hash)).unwrap_or_default();
        let sealed = covered && self.signed_last.get(&NodeId::RECORDER) == Some(&true);
        if !sealed && !self.held.killed.contains(&NodeId::RECORDER) {
            self.flaw(self.events + 1, "TRUNCATED: no closing seal over everything before");
        }
        self.flaws.sort();
        self.flaws.truncate(MAX_FLAWS);
        Custody { events: self.events, sealed, head, flaws: self.flaws }
    }

    fn flaw(&mut self, at: usize, what: impl Into<String>) {
        self.flaws.push(Flaw { at, what: what.into() });
    }

    fn seals(&mut self) {
        let running = &self.running;
        let broken = |(_, entries, head): &&(usize, u64, [u8; 32])| {
            usize::try_from(*entries).ok().and_then(|n| running.get(n)) != Some(head)
        };
        if let Some((at, entries, _)) = self.seals.iter().find(broken).copied() {
            self.flaw(at, format!("the seal over {entries} entries is not over the ones before it"));
        }
    }

    fn signatures(&mut self) {
        let mut keys = Keyring::default();
        let mut found = Vec::new();
        for (node, key) in &self.held.keys {
            if !unhex(key).is_some_and(|key| keys.insert(*node, &key)) {
                found.push(Flaw { at: 0, what: format!("the key held for {node} is none") });
            }
        }
        let good = |node: NodeId, s: &Signature| {
            keys.verify(node, Purpose::Head, &Signed::detached(&s.head, &s.signature)).is_ok()
        };
        let behind = self.events + 1;
        for (node, last) in &self.signed_last {
            let signatures = self.signatures.get(node).map(Vec::as_slice).unwrap_or_default();
            if !last && !self.held.killed.contains(node) {
                found.push(Flaw { at: behind, what: format!("the chain of {node} ends without its signature") });
            }
            // The last one is over everything before it; the others only tell where it began.
            if signatures.last().is_some_and(|last| !good(*node, last)) {
                let first = signatures.iter().find(|s| !good(*node, s)).map_or(behind, |s| s.at);
                found.push(Flaw { at: first, what: format!("{node} did not sign this head of its chain") });
            }
        }
        self.flaws.extend(found);
    }

    fn heads(&mut self) {
        let mut found = Vec::new();
        for held in &self.held.heads {
            let recorded = self.chains.heads().iter().find(|head| head.node == held.node);
            let recorded = recorded.map(|head| HeldHead::from(*head));
            if recorded.as_ref() != Some(held) {
                let kept = recorded.map_or(0, |head| head.counter);
                let what = format!(
                    "{} wrote {} entries by its own account, {kept} are kept or their head differs",
                    held.node, held.counter
                );
                found.push(Flaw { at: self.events + 1, what });
            }
        }
        self.flaws.extend(found);
    }
}

fn unhex(text: &str) -> Option<[u8; 32]> {
    let digits: Vec<u8> = text.chars().map(|c| c.to_digit(16).map(|d| d as u8)).collect::<Option<_>>()?;
    let bytes: Vec<u8> = digits.chunks_exact(2).map(|d| d[0] << 4 | d[1]).collect();
    (digits.len() == 64).then_some(bytes)?.try_into().ok()
}
