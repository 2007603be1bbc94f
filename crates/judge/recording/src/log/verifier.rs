//! Verification of a log: that services, guards and launcher wrote it, under any keeper.
//!
//! Five things are set against each other. Each service's *chain*: an entry holds the hash of the one before. Each
//! service's *signatures* over its chain, once a second and as its last entry, of which its public key has to verify
//! the newest. The recorder's *seals* over everything in the order in which it came. The *heads* of the chains as they
//! are held outside the recorder, by the operator of the services: a recorder that keeps whole chains short, leaves out
//! a service or makes up an earlier life of one agrees with itself and not with these. And each host's *clock*: the
//! time under which an entry is kept, which every latency is judged by, has to fit the time that is in it, but for the
//! process's stops by the launcher itself. Of a life that was ended on purpose there is no head; it is covered as far
//! as its signatures reach. Public keys, heads and clocks are [`TrustAnchors`]; secrets are in no file.
//!
//! The notes of guards and the launcher do not go by way of the recorder and are under no seal of its; their chains, signatures
//! and heads are judged like everybody's. Where among the entries of others a seal stands is not sealed, nor where a witness's
//! entry does. The bytes of a run's files are left to [`crate::anchors`].

use std::collections::BTreeMap;

use evidence::Flaw;
use evidence::anchors::{HeadAnchor, Life, TrustAnchors};
use evidence::log::{Logged, by_recorder, hex};
use ground_truth::{Any, Entry};
use sha2::{Digest, Sha256};
use wire::audit::{ChainError, Chains, Head, SIGN_PERIOD};
use wire::event::Event;
use wire::id::NodeId;
use wire::sign::{Keyring, Purpose, SharedVerifier, Signed};
use wire::time::Instant;

use super::clock::{ClockFit, clock_fit, lateness, milliseconds};

/// Most flaws that are told of one recording; only the first matters.
const MAX_FLAWS: usize = 16;

/// Result of verifying a log.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Verification {
    /// Events in it.
    pub events: usize,
    /// True if the recorder's closing seal covers everything.
    pub sealed: bool,
    /// Head of the recorder's own chain, hexadecimal.
    pub head: String,
    /// Flaws, in order of place.
    pub flaws: Vec<Flaw>,
    /// The longest lateness, microseconds, where only lateness does not hold: a host that stalled explains that.
    pub late: Option<u64>,
}

/// A service's signature over its chain.
struct Signature {
    at: usize,
    entry: Entry,
    signature: [u8; 64],
}

/// The chain of one life, as far as it was taken.
#[derive(Default)]
struct Chain {
    last: Option<Head>,
    signatures: Vec<Signature>,
    /// True if the last entry is a signature.
    ends_signed: bool,
    /// Time at which it was signed last, on its own clock.
    signed: Option<Instant>,
    /// True if a signature has to come next.
    owes: bool,
    /// Place at which one was owed first and another entry came.
    unsigned: Option<usize>,
}

impl Chain {
    fn take(&mut self, at: usize, entry: &Entry, hash: [u8; 32]) {
        let signature =
            if let Any::Service(Event::Signed { signature }) = entry.event { Some(signature) } else { None };
        self.ends_signed = signature.is_some();
        self.last = Some(Head { node: entry.node, boot: entry.boot, counter: entry.counter, hash });
        if let Some(signature) = signature {
            self.signatures.push(Signature { at, entry: *entry, signature });
            (self.signed, self.owes) = (Some(entry.at), false);
            return;
        }
        if self.owes {
            self.unsigned.get_or_insert(at);
        }
        self.owes = self.signed.is_none_or(|signed| entry.at.since(signed) >= SIGN_PERIOD);
    }
}

/// Follows a log, entry by entry, in the order in which it was kept.
pub struct LogVerifier<'a> {
    anchors: &'a TrustAnchors,
    keys: Keyring,
    chains: Chains,
    events: usize,
    /// The recorder's head after each sealed entry, from none on.
    running: Vec<[u8; 32]>,
    seals: Vec<(usize, u64, [u8; 32])>,
    lives: BTreeMap<Life, Chain>,
    flaws: Vec<Flaw>,
    /// Lateness of each flaw of lateness, microseconds.
    late: Vec<u64>,
}

impl<'a> LogVerifier<'a> {
    /// A verifier without entries yet.
    pub fn new(anchors: &'a TrustAnchors) -> Self {
        Self {
            anchors,
            keys: Keyring::default(),
            chains: Chains::default(),
            events: 0,
            running: vec![[0; 32]],
            seals: Vec::new(),
            lives: BTreeMap::new(),
            flaws: Vec::new(),
            late: Vec::new(),
        }
    }

    /// The same verifier, without verifying signatures that are known to be good: in the twin, of the process's own cores.
    #[must_use]
    pub fn with_shared_verifier(self, verifier: SharedVerifier) -> Self {
        Self { keys: Keyring::asking(verifier), ..self }
    }

    /// Takes the next entry, kept as handed over by `node` at `at`.
    ///
    /// # Errors
    /// When it does not continue its chain; that is noted too.
    pub fn take(&mut self, at: u64, node: NodeId, bytes: &[u8]) -> Result<Entry, ChainError> {
        self.events += 1;
        let here = self.events;
        let (entry, hash) = self.chains.follow(bytes).inspect_err(|error| match error {
            ChainError::Malformed(why) => {
                self.flaw(here, format!("unreadable entry, kept as handed over by {node}: {why}"))
            }
            ChainError::Broken { .. } | ChainError::Full { .. } => self.flaw(here, error.to_string()),
        })?;
        if entry.node != node {
            self.flaw(here, format!("{} wrote what is kept as handed over by {node}", entry.node));
        }
        self.times(here, at, &entry);
        if entry.node != NodeId::RECORDER && by_recorder(entry.node) {
            let before = self.running.last().copied().unwrap_or_default();
            self.running.push(Sha256::new().chain_update(before).chain_update(hash).finalize().into());
        } else if let Any::Service(Event::Sealed { entries, head }) = entry.event
            && entry.node == NodeId::RECORDER
        {
            self.seals.push((here, entries, head));
        }
        self.lives.entry(Life::from_entry(&entry)).or_default().take(here, &entry, hash);
        Ok(entry)
    }

    /// Takes every entry of `log`, in the order in which it was kept, and judges them. An empty log of a recorder that is not
    /// known to be dead holds no closing seal.
    pub fn verify(mut self, log: &[Logged]) -> Verification {
        for Logged { at, node, bytes } in log {
            // An entry that does not continue its chain is among the flaws.
            let _noted = self.take(*at, *node, bytes);
        }
        self.close()
    }

    /// Judges the entries taken.
    pub fn close(mut self) -> Verification {
        self.seals();
        self.signatures();
        self.heads();
        let all = self.running.len() - 1;
        let covered = self.seals.last().is_some_and(|(_, entries, _)| usize::try_from(*entries) == Ok(all));
        let recorder = self.lives.iter().rev().find(|(life, _)| life.node == NodeId::RECORDER).map(|(_, chain)| chain);
        let head = recorder.and_then(|chain| chain.last).map(|head| hex(&head.hash)).unwrap_or_default();
        let sealed = covered && recorder.is_some_and(|chain| chain.ends_signed);
        if !sealed
            && !self.may_lack_the_end(NodeId::RECORDER)
            && !self.anchors.killed.iter().any(|l| l.node == NodeId::RECORDER)
        {
            self.flaw(self.events + 1, "TRUNCATED: no closing seal over everything before");
        }
        let late = self.late.iter().max().copied().filter(|_| self.late.len() == self.flaws.len());
        self.flaws.sort();
        self.flaws.truncate(MAX_FLAWS);
        Verification { events: self.events, sealed, head, flaws: self.flaws, late }
    }

    /// True if the last entries of `node` may be missing from a recording that was cut short.
    fn may_lack_the_end(&self, node: NodeId) -> bool {
        self.anchors.cut_short && by_recorder(node)
    }

    fn flaw(&mut self, at: usize, what: impl Into<String>) {
        self.flaws.push(Flaw { at, what: what.into() });
    }

    /// Checks that the time in an entry fits the one under which it was handed over.
    fn times(&mut self, here: usize, at: u64, entry: &Entry) {
        let node = entry.node;
        let Some(clock) = self.anchors.clocks.get(&node) else {
            return self.flaw(here, format!("no clock is held for {node}"));
        };
        match clock_fit(clock, entry, at, self.anchors.start_us, &self.anchors.stops) {
            ClockFit::Fits => {}
            ClockFit::Late { by, stopped, allowed } => {
                self.late.push(by);
                self.flaw(here, lateness(node, by, stopped, allowed));
            }
            ClockFit::Early(by) => self.flaw(
                here,
                format!(
                    "{node} wrote this {} after the time under which it was handed over: no stall of the host explains \
                     that, one of the two times was changed",
                    milliseconds(by)
                ),
            ),
        }
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
        let mut found = Vec::new();
        for (node, key) in &self.anchors.keys {
            if !unhex(key).is_some_and(|key| self.keys.insert(*node, &key)) {
                found.push(Flaw { at: 0, what: format!("the key held for {node} is none") });
            }
        }
        let good = |node: NodeId, s: &Signature| {
            self.keys.verify(node, Purpose::Head, &Signed::detached(&s.entry.signed_as(), &s.signature)).is_ok()
        };
        let behind = self.events + 1;
        for (life, chain) in &self.lives {
            // Whose key nobody holds signs nothing; its head is all there is of it.
            if !self.anchors.keys.contains_key(&life.node) {
                continue;
            }
            let owes_none = self.anchors.killed.contains(life) || self.may_lack_the_end(life.node);
            if !chain.ends_signed && !owes_none {
                found.push(Flaw { at: behind, what: format!("the chain of {life} ends without its signature") });
            }
            if let Some(at) = chain.unsigned {
                found.push(Flaw { at, what: format!("{life} did not sign its chain when it was due") });
            }
            // The newest is over everything before it, earlier signatures too; these say where, once it is bad.
            let newest_is_bad = chain.signatures.last().is_some_and(|newest| !good(life.node, newest));
            if newest_is_bad && let Some(bad) = chain.signatures.iter().find(|s| !good(life.node, s)) {
                found.push(Flaw { at: bad.at, what: format!("{life} did not sign its chain here") });
            }
        }
        self.flaws.extend(found);
    }

    /// Every life has the head that is held of it, and every life has one, but for those that were ended on purpose. The
    /// recorder's own word is no witness against it; it has one life.
    fn heads(&mut self) {
        let behind = self.events + 1;
        let mut found = Vec::new();
        for anchor in self.anchors.heads.iter().filter(|anchor| !self.may_lack_the_end(anchor.node)) {
            let recorded = self.lives.get(&anchor.life()).and_then(|chain| chain.last).map(HeadAnchor::from);
            if recorded.as_ref() != Some(anchor) {
                let kept = recorded.map_or(0, |head| head.counter);
                let what = format!(
                    "{} wrote {} entries by its own account, {kept} are kept or their head differs",
                    anchor.life(),
                    anchor.counter
                );
                found.push(Flaw { at: behind, what });
            }
        }
        let mut recorders = 0;
        for life in self.lives.keys() {
            let known =
                self.anchors.killed.contains(life) || self.anchors.heads.iter().any(|head| head.life() == *life);
            recorders += usize::from(life.node == NodeId::RECORDER);
            if !known && (life.node != NodeId::RECORDER || recorders > 1) {
                found.push(Flaw { at: behind, what: format!("nobody knows of {life}") });
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
