//! Detection rate of manipulations of a recording: every byte of its file changed, every entry removed, repeated or
//! swapped with the next, the file cut at every byte.
//!
//! A sweep covers every byte of the file of one unchanged run. Findings by chains, signatures and heads count apart from findings by the
//! digest of the file alone. The latter are changes that leave every entry as it was, changes of an entry's handover time within the
//! bound of a host's clock, and changes of an entry. Forging whole chains is left to `adversary::insider`.

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

/// An unchanged recording, and its trust anchors.
pub struct Sweep<'a> {
    file: &'a [u8],
    log: Vec<Logged>,
    anchors: &'a TrustAnchors,
    /// SHA-256 of the file.
    digest: [u8; 32],
    verifier: SharedVerifier,
}

/// Detection of one change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Detection {
    /// It changed bytes of no entry: an index, a checksum that is not needed, the name of the library. Only the digest of the
    /// file shows it. Or it swapped two neighbours that have no order between them.
    Harmless,
    /// It moved the handover time of an entry within the bound, microseconds. Only the digest of the file shows it.
    Retimed(u64),
    /// It changed an entry, and only the digest of the file shows it.
    Unchained,
    /// Chains, signatures, heads or clocks show it.
    Found {
        /// True if the first flaw is at the entry or at the next of its chain.
        located: bool,
    },
    /// No check found it.
    Missed,
}

impl<'a> Sweep<'a> {
    /// A sweep over the bytes of a file; `verifier` may remember its earlier answers.
    ///
    /// # Errors
    /// When the file has a flaw before any change.
    pub fn new(file: &'a [u8], anchors: &'a TrustAnchors, verifier: SharedVerifier) -> Result<Self, String> {
        let digest = Sha256::digest(file).into();
        let mut sweep = Sweep { file, log: Vec::new(), anchors, digest, verifier };
        sweep.log = read(file)?;
        match sweep.judged(&sweep.log).flaws.first() {
            Some(flaw) => Err(format!("untouched it has a flaw: {flaw}")),
            None => Ok(sweep),
        }
    }

    /// Number of its entries.
    pub fn entries(&self) -> usize {
        self.log.len()
    }

    /// Detection of a changed byte: the one at `index` of the file, exclusive-or `mask`.
    pub fn changed_byte(&self, index: usize, mask: u8) -> Detection {
        let mut bytes = self.file.to_vec();
        if let Some(byte) = bytes.get_mut(index) {
            *byte ^= mask;
        }
        let Ok(log) = read(&bytes) else { return Detection::Found { located: false } };
        let digest: [u8; 32] = Sha256::digest(&bytes).into();
        if log == self.log {
            return if digest == self.digest { Detection::Missed } else { Detection::Harmless };
        }
        let verification = self.judged(&log);
        let differ: Vec<usize> =
            (0..log.len().max(self.log.len())).filter(|i| log.get(*i) != self.log.get(*i)).collect();
        if verification.flaws.is_empty() {
            let retimed = self.retimed(&log, &differ).map_or(Detection::Unchained, Detection::Retimed);
            return if digest == self.digest { Detection::Missed } else { retimed };
        }
        Detection::Found { located: differ.len() == 1 && self.is_first_flaw_near(&verification, differ[0]) }
    }

    /// Detection of the removal of entry `i`.
    pub fn deleted(&self, i: usize) -> Detection {
        let mut log = self.log.clone();
        log.remove(i);
        self.found(&log, i)
    }

    /// Detection of a copy of entry `i` before entry `to`.
    pub fn inserted(&self, i: usize, to: usize) -> Detection {
        let mut log = self.log.clone();
        log.insert(to, self.log[i].clone());
        self.found(&log, to)
    }

    /// Detection of a swap of entries `i` and `i + 1`. A swap with a seal, or with an entry of a guard or the launcher, is harmless: no
    /// seal covers the place of these among the entries of others.
    pub fn swapped(&self, i: usize) -> Detection {
        let mut log = self.log.clone();
        log.swap(i, i + 1);
        let detection = self.found(&log, i);
        let unsealed = log[i..=i + 1].iter().any(|l| l.node == NodeId::RECORDER || !by_recorder(l.node));
        if detection == Detection::Missed && unsealed { Detection::Harmless } else { detection }
    }

    /// Number of entries in the file's first `length` bytes; none where they are not the first entries of the whole file.
    pub fn cut(&self, length: usize) -> Option<usize> {
        let log = read(self.file.get(..length)?).ok()?;
        self.log.starts_with(&log).then_some(log.len())
    }

    /// True if a check finds the cut after `length` bytes, or no entry is lost by it.
    pub fn cut_is_found(&self, length: usize) -> bool {
        let log = read(self.file.get(..length).unwrap_or(self.file)).unwrap_or_default();
        log.len() == self.log.len() || !self.judged(&log).flaws.is_empty()
    }

    fn found(&self, log: &[Logged], place: usize) -> Detection {
        let verification = self.judged(log);
        match verification.flaws.is_empty() {
            true => Detection::Missed,
            false => Detection::Found { located: self.is_first_flaw_near(&verification, place) },
        }
    }

    fn judged(&self, log: &[Logged]) -> Verification {
        LogVerifier::new(self.anchors).with_shared_verifier(self.verifier.clone()).verify(log)
    }

    /// Difference of the handover times, where nothing else differs.
    fn retimed(&self, log: &[Logged], differ: &[usize]) -> Option<u64> {
        let moved = |i: &usize| {
            let (was, is) = (self.log.get(*i)?, log.get(*i)?);
            (was.node == is.node && was.bytes == is.bytes).then_some(was.at.abs_diff(is.at))
        };
        differ.iter().map(moved).collect::<Option<Vec<u64>>>()?.into_iter().max()
    }

    /// True if the first flaw is at the entry at `place`, or at the next of that life's chain, or behind the last where there is
    /// none. Places count from 0, flaws from 1.
    fn is_first_flaw_near(&self, verification: &Verification, place: usize) -> bool {
        let life = |logged: &Logged| Entry::decode(&logged.bytes).ok().map(|entry| Life::from_entry(&entry));
        let Some(changed) = self.log.get(place).and_then(life) else { return false };
        let next = (place + 1..self.log.len()).find(|i| life(&self.log[*i]) == Some(changed));
        let flaw = verification.flaws.first().map_or(0, |flaw| flaw.at);
        // One place off is near enough: an entry more or less moves the ones after it by one.
        flaw == place + 1 || next.map_or(flaw >= verification.events, |next| flaw.abs_diff(next + 1) <= 1)
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
