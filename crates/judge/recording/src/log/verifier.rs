//! Verification of a log: that services, guards and launcher wrote it, and no keeper changed it.
//!
//! Five parts have to agree. The *chain* of each service: an entry has the hash of the one before. The *signatures* of each
//! service over its chain, once a second and as its last entry; its public key has to verify the newest. The recorder's *seals*
//! over everything in the order of arrival. The *heads* of the chains, held outside the recorder by the operator of the
//! services: a recorder that cuts whole chains short, omits a service or invents an earlier life of one contradicts them. The
//! *clock* of each host: the handover time of an entry, by which every latency is judged, has to fit the time in the entry,
//! except for the process's stops by the launcher itself. A life that was ended on purpose has no head; it is covered as far
//! as its signatures reach. Public keys, heads and clocks are [`TrustAnchors`]; secrets are in no file.
//!
//! The recorder does not record the notes of guards and the launcher, and no seal covers them; their chains, signatures
//! and heads are judged like all others. The place of a seal among the entries of others is not sealed, nor is the place of a
//! witness's entry. The bytes of a run's files are left to [`crate::anchors`].

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

/// Flaws that are listed of one recording at most; the first one decides.
const MAX_FLAWS: usize = 16;

/// Result of verifying a log.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Verification {
    /// Number of events in it.
    pub events: usize,
    /// True if the recorder's closing seal covers everything.
    pub sealed: bool,
    /// Head of the recorder's own chain, hexadecimal.
    pub head: String,
    /// Flaws, in order of place.
    pub flaws: Vec<Flaw>,
    /// The longest lateness, microseconds, where every flaw is one of lateness: a host that stalled explains that.
    pub late: Option<u64>,
}

/// A service's signature over its chain.
struct Signature {
    /// Place of its entry in the log, counted from 1.
    place: usize,
    entry: Entry,
    signature: [u8; 64],
}

/// The chain of one life, as far as the verifier has read it.
#[derive(Default)]
struct Chain {
    last: Option<Head>,
    signatures: Vec<Signature>,
    /// True if the last entry is a signature.
    ends_signed: bool,
    /// Time of the last signature, by the service's clock.
    signed: Option<Instant>,
    /// True if the next entry has to be a signature.
    signature_due: bool,
    /// First place at which another entry came where a signature was due.
    unsigned: Option<usize>,
}

impl Chain {
    fn take(&mut self, place: usize, entry: &Entry, hash: [u8; 32]) {
        let signature =
            if let Any::Service(Event::Signed { signature }) = entry.event { Some(signature) } else { None };
        self.ends_signed = signature.is_some();
        self.last = Some(Head { node: entry.node, boot: entry.boot, counter: entry.counter, hash });
        if let Some(signature) = signature {
            self.signatures.push(Signature { place, entry: *entry, signature });
            (self.signed, self.signature_due) = (Some(entry.at), false);
            return;
        }
        if self.signature_due {
            self.unsigned.get_or_insert(place);
        }
        self.signature_due = self.signed.is_none_or(|signed| entry.at.since(signed) >= SIGN_PERIOD);
    }
}

/// Verifier of a log, which follows it entry by entry in recorded order.
pub struct LogVerifier<'a> {
    anchors: &'a TrustAnchors,
    keys: Keyring,
    chains: Chains,
    events: usize,
    /// Hash over the first n sealed entries, at index n: what a seal over n entries has to hold.
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

    /// This verifier, with signatures that `verifier` knows to be good taken as verified: in the twin, those by the process's cores.
    #[must_use]
    pub fn with_shared_verifier(self, verifier: SharedVerifier) -> Self {
        Self { keys: Keyring::asking(verifier), ..self }
    }

    /// Takes the next entry, recorded as handed over by `node` at `handed_over`.
    ///
    /// # Errors
    /// When it does not continue its chain; that is noted too.
    pub fn take(&mut self, handed_over: u64, node: NodeId, bytes: &[u8]) -> Result<Entry, ChainError> {
        self.events += 1;
        let place = self.events;
        let (entry, hash) = self.chains.follow(bytes).inspect_err(|error| match error {
            ChainError::Malformed(reason) => {
                self.add_flaw(place, format!("unreadable entry, kept as handed over by {node}: {reason}"))
            }
            ChainError::Broken { .. } | ChainError::Full { .. } => self.add_flaw(place, error.to_string()),
        })?;
        if entry.node != node {
            self.add_flaw(place, format!("{} wrote what is kept as handed over by {node}", entry.node));
        }
        self.check_time(place, handed_over, &entry);
        if entry.node != NodeId::RECORDER && by_recorder(entry.node) {
            let before = self.running.last().copied().unwrap_or_default();
            self.running.push(Sha256::new().chain_update(before).chain_update(hash).finalize().into());
        } else if let Any::Service(Event::Sealed { entries, head }) = entry.event
            && entry.node == NodeId::RECORDER
        {
            self.seals.push((place, entries, head));
        }
        self.lives.entry(Life::from_entry(&entry)).or_default().take(place, &entry, hash);
        Ok(entry)
    }

    /// Takes every entry of `log`, in recorded order, and judges them. An empty log has a flaw, the missing closing seal, unless the
    /// recorder is known to be dead.
    pub fn verify(mut self, log: &[Logged]) -> Verification {
        for logged in log {
            // An entry that does not continue its chain is among the flaws.
            let _noted = self.take(logged.at, logged.node, &logged.bytes);
        }
        self.close()
    }

    /// Judges the entries taken.
    pub fn close(mut self) -> Verification {
        self.check_seals();
        self.check_signatures();
        self.check_heads();
        let all = self.running.len() - 1;
        let covered = self.seals.last().is_some_and(|(_, entries, _)| usize::try_from(*entries) == Ok(all));
        let recorder = self.lives.iter().rev().find(|(life, _)| life.node == NodeId::RECORDER).map(|(_, chain)| chain);
        let head = recorder.and_then(|chain| chain.last).map(|head| hex(&head.hash)).unwrap_or_default();
        let sealed = covered && recorder.is_some_and(|chain| chain.ends_signed);
        if !sealed
            && !self.may_lack_the_end(NodeId::RECORDER)
            && !self.anchors.killed.iter().any(|l| l.node == NodeId::RECORDER)
        {
            self.add_flaw(self.events + 1, "TRUNCATED: no closing seal over everything before");
        }
        // Counted before the flaws are truncated: one flaw of another kind beyond the limit rules a stall of the host out.
        let late = self.late.iter().max().copied().filter(|_| self.late.len() == self.flaws.len());
        self.flaws.sort();
        self.flaws.truncate(MAX_FLAWS);
        Verification { events: self.events, sealed, head, flaws: self.flaws, late }
    }

    /// True if the last entries of `node` may be missing from a recording that was cut short.
    fn may_lack_the_end(&self, node: NodeId) -> bool {
        self.anchors.cut_short && by_recorder(node)
    }

    fn add_flaw(&mut self, place: usize, description: impl Into<String>) {
        self.flaws.push(Flaw { at: place, what: description.into() });
    }

    /// Checks that the time in an entry fits its handover.
    fn check_time(&mut self, place: usize, handed_over: u64, entry: &Entry) {
        let node = entry.node;
        let Some(clock) = self.anchors.clocks.get(&node) else {
            return self.add_flaw(place, format!("no clock is held for {node}"));
        };
        match clock_fit(clock, entry, handed_over, self.anchors.start_us, &self.anchors.stops) {
            ClockFit::Fits => {}
            ClockFit::Late { delay, stopped, allowed } => {
                self.late.push(delay);
                // A live run's start is on a clock of the host, which is past zero.
                let in_twin = self.anchors.start_us == 0;
                self.add_flaw(place, lateness(node, delay, stopped, allowed, in_twin));
            }
            ClockFit::Early(lead) => self.add_flaw(
                place,
                format!(
                    "{node} wrote this {} after the time under which it was handed over: no stall of the host explains \
                     that, one of the two times was changed",
                    milliseconds(lead)
                ),
            ),
        }
    }

    fn check_seals(&mut self) {
        let running = &self.running;
        let broken = |(_, entries, head): &&(usize, u64, [u8; 32])| {
            usize::try_from(*entries).ok().and_then(|n| running.get(n)) != Some(head)
        };
        if let Some((place, entries, _)) = self.seals.iter().find(broken).copied() {
            self.add_flaw(place, format!("the seal over {entries} entries is not over the ones before it"));
        }
    }

    fn check_signatures(&mut self) {
        let mut found = Vec::new();
        for (node, key) in &self.anchors.keys {
            if !unhex(key).is_some_and(|key| self.keys.insert(*node, &key)) {
                found.push(Flaw { at: 0, what: format!("the key held for {node} is none") });
            }
        }
        let good = |node: NodeId, s: &Signature| {
            self.keys.verify(node, Purpose::Head, &Signed::detached(&s.entry.signed_as(), &s.signature)).is_ok()
        };
        let log_end = self.events + 1;
        for (life, chain) in &self.lives {
            // Without a key no signature can be verified; `check_heads` judges such a life by its head alone.
            if !self.anchors.keys.contains_key(&life.node) {
                continue;
            }
            let may_end_unsigned = self.anchors.killed.contains(life) || self.may_lack_the_end(life.node);
            if !chain.ends_signed && !may_end_unsigned {
                found.push(Flaw { at: log_end, what: format!("the chain of {life} ends without its signature") });
            }
            if let Some(place) = chain.unsigned {
                found.push(Flaw { at: place, what: format!("{life} did not sign its chain when it was due") });
            }
            // The newest covers everything before it, earlier signatures too. Only if it is bad are these verified, to find the place.
            let newest_is_bad = chain.signatures.last().is_some_and(|newest| !good(life.node, newest));
            if newest_is_bad && let Some(bad) = chain.signatures.iter().find(|s| !good(life.node, s)) {
                found.push(Flaw { at: bad.place, what: format!("{life} did not sign its chain here") });
            }
        }
        self.flaws.extend(found);
    }

    /// Checks that every life ends with its anchored head, and that every life has an anchored head, except for lives that were ended on
    /// purpose. The recorder reports its own head, which proves nothing about it; so it needs none, and has one life only.
    fn check_heads(&mut self) {
        let log_end = self.events + 1;
        let mut found = Vec::new();
        for anchor in self.anchors.heads.iter().filter(|anchor| !self.may_lack_the_end(anchor.node)) {
            let recorded = self.lives.get(&anchor.life()).and_then(|chain| chain.last).map(HeadAnchor::from);
            if recorded.as_ref() != Some(anchor) {
                let recorded_entries = recorded.map_or(0, |head| head.counter);
                let description = format!(
                    "{} wrote {} entries by its own account, {recorded_entries} are kept or their head differs",
                    anchor.life(),
                    anchor.counter
                );
                found.push(Flaw { at: log_end, what: description });
            }
        }
        let mut recorders = 0;
        for life in self.lives.keys() {
            let known =
                self.anchors.killed.contains(life) || self.anchors.heads.iter().any(|head| head.life() == *life);
            recorders += usize::from(life.node == NodeId::RECORDER);
            if !known && (life.node != NodeId::RECORDER || recorders > 1) {
                found.push(Flaw { at: log_end, what: format!("nobody knows of {life}") });
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
