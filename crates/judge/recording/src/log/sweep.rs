//! Detection rate of manipulations of a recording: every byte of its file changed, every entry taken out, put in again or
//! exchanged with the next, the file cut at every byte.
//!
//! One sweep is over the file of one run that is whole, every byte of it. Findings of chains, signatures and heads are told apart from
//! those of the digest of the whole file alone: of those, changes that leave every entry as it was, changes that move the time under which one is
//! kept by less than a host's clock allows for, and changes of an entry. Writing whole stories anew is `adversary::insider`'s business.

use evidence::anchors::{Life, TrustAnchors};
use evidence::log::{Logged, by_recorder};
use ground_truth::{Any, Entry};
use link::mcap_frames::{MAX_MEMORY, frames_of_bytes};
use sha2::{Digest, Sha256};
use wire::event::Event;
use wire::id::NodeId;
use wire::sign::SharedVerifier;

use super::Verification;
use super::verifier::LogVerifier;

/// A whole recording, and its trust anchors.
pub struct Sweep<'a> {
    file: &'a [u8],
    log: Vec<Logged>,
    anchors: &'a TrustAnchors,
    /// SHA-256 of the file.
    digest: [u8; 32],
    verifier: SharedVerifier,
}

/// Result of one change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Came {
    /// It changed bytes of which no entry is made: an index, a checksum that is not needed, the name of the library. Only the digest of the
    /// file is another; or two neighbours are swapped that have no order between them.
    Harmless,
    /// It moved the time under which an entry is kept, by less than can be told, microseconds. Only the digest of the file is another.
    Retimed(u64),
    /// It changed an entry, and only the digest of the file is another.
    Unchained,
    /// It was found by chains, signatures, heads or clocks: whether at the entry or at the next of its chain.
    Found {
        /// True if the first flaw is told there.
        located: bool,
    },
    /// No check found it.
    Missed,
}

impl<'a> Sweep<'a> {
    /// Of a file's bytes; `verifier` may remember its earlier answers.
    ///
    /// # Errors
    /// When it is not whole to begin with.
    pub fn new(file: &'a [u8], anchors: &'a TrustAnchors, verifier: SharedVerifier) -> Result<Self, String> {
        let digest = Sha256::digest(file).into();
        let mut sweep = Sweep { file, log: Vec::new(), anchors, digest, verifier };
        sweep.log = read(file)?;
        match sweep.judged(&sweep.log).flaws.first() {
            Some(flaw) => Err(format!("untouched it has a flaw: {flaw}")),
            None => Ok(sweep),
        }
    }

    /// Its entries.
    pub fn entries(&self) -> usize {
        self.log.len()
    }

    /// The byte at `at` of the file is another: `with` exclusive-or.
    pub fn byte(&self, at: usize, with: u8) -> Came {
        let mut bytes = self.file.to_vec();
        if let Some(byte) = bytes.get_mut(at) {
            *byte ^= with;
        }
        let Ok(log) = read(&bytes) else { return Came::Found { located: false } };
        let digest: [u8; 32] = Sha256::digest(&bytes).into();
        if log == self.log {
            return if digest == self.digest { Came::Missed } else { Came::Harmless };
        }
        let verification = self.judged(&log);
        let differ: Vec<usize> =
            (0..log.len().max(self.log.len())).filter(|i| log.get(*i) != self.log.get(*i)).collect();
        if verification.flaws.is_empty() {
            let retimed = self.retimed(&log, &differ).map_or(Came::Unchained, Came::Retimed);
            return if digest == self.digest { Came::Missed } else { retimed };
        }
        Came::Found { located: differ.len() == 1 && self.told_near(&verification, differ[0]) }
    }

    /// Entry `i` is gone.
    pub fn deleted(&self, i: usize) -> Came {
        let mut log = self.log.clone();
        log.remove(i);
        self.found(&log, i)
    }

    /// Entry `i` is there once more, before entry `to`.
    pub fn inserted(&self, i: usize, to: usize) -> Came {
        let mut log = self.log.clone();
        log.insert(to, self.log[i].clone());
        self.found(&log, to)
    }

    /// Entries `i` and `i + 1` stand the other way round. Where one of the two is a seal, or a guard's or the launcher's, that is not
    /// said to be found: where among the entries of others these stand is not sealed.
    pub fn swapped(&self, i: usize) -> Came {
        let mut log = self.log.clone();
        log.swap(i, i + 1);
        let came = self.found(&log, i);
        let unsealed = log[i..=i + 1].iter().any(|l| l.node == NodeId::RECORDER || !by_recorder(l.node));
        if came == Came::Missed && unsealed { Came::Harmless } else { came }
    }

    /// Number of entries read of the file's first `length` bytes; none where these are not the first of the whole.
    pub fn cut(&self, length: usize) -> Option<usize> {
        let log = read(self.file.get(..length)?).ok()?;
        self.log.starts_with(&log).then_some(log.len())
    }

    /// True if it is noticed that the file ends there.
    pub fn cut_is_found(&self, length: usize) -> bool {
        let log = read(self.file.get(..length).unwrap_or(self.file)).unwrap_or_default();
        log.len() == self.log.len() || !self.judged(&log).flaws.is_empty()
    }

    fn found(&self, log: &[Logged], place: usize) -> Came {
        let verification = self.judged(log);
        match verification.flaws.is_empty() {
            true => Came::Missed,
            false => Came::Found { located: self.told_near(&verification, place) },
        }
    }

    fn judged(&self, log: &[Logged]) -> Verification {
        LogVerifier::new(self.anchors).with_shared_verifier(self.verifier.clone()).verify(log)
    }

    /// By how much the only difference, a time, was moved.
    fn retimed(&self, log: &[Logged], differ: &[usize]) -> Option<u64> {
        let moved = |i: &usize| {
            let (was, is) = (self.log.get(*i)?, log.get(*i)?);
            (was.node == is.node && was.bytes == is.bytes).then_some(was.at.abs_diff(is.at))
        };
        differ.iter().map(moved).collect::<Option<Vec<u64>>>()?.into_iter().max()
    }

    /// True if the first flaw is told at the entry at `place`, or at the next of that life's chain, or behind the last where there is
    /// none. Places count from 0, flaws from 1.
    fn told_near(&self, verification: &Verification, place: usize) -> bool {
        let life = |logged: &Logged| Entry::decode(&logged.bytes).ok().map(|entry| Life::from_entry(&entry));
        let Some(of) = self.log.get(place).and_then(life) else { return false };
        let next = (place + 1..self.log.len()).find(|i| life(&self.log[*i]) == Some(of));
        let at = verification.flaws.first().map_or(0, |flaw| flaw.at);
        at == place + 1 || next.map_or(at >= verification.events, |next| at.abs_diff(next + 1) <= 1)
    }
}

/// True if an entry is a seal of the recorder's.
pub fn is_seal(logged: &Logged) -> bool {
    Entry::decode(&logged.bytes).is_ok_and(|entry| matches!(entry.event, Any::Service(Event::Sealed { .. })))
}

fn read(file: &[u8]) -> Result<Vec<Logged>, String> {
    let mut room = MAX_MEMORY;
    let frames = frames_of_bytes(file, &mut room)?;
    Ok(frames.into_iter().map(|f| Logged { at: f.trace_us, node: f.node, bytes: f.bytes }).collect())
}
