//! The insider who controls the recorder: its manipulations of a recording before anyone reads it.
//!
//! It holds everything that was recorded, and the recorder's own signing key. It may change bytes and hope, or write
//! every chain again so that it holds together, with seals and signatures of the recorder's to go with it. It cannot
//! sign for another service, and it cannot reach copies held elsewhere. Detection is not looked at here.

#![expect(
    clippy::wildcard_enum_match_arm,
    reason = "a recorder changes its own seals and signatures and passes on the rest"
)]

use std::collections::BTreeMap;

use ground_truth::{Any, Entry};
use sha2::{Digest, Sha256};
use wire::codec;
use wire::event::Event;
use wire::id::{Boot, NodeId};
use wire::sign::{Key, Purpose};
use wire::time::Span;

use crate::plan::Tampering;
use crate::schedule::{stream, uniform_below};

/// Shift of an entry's time, microseconds.
const RETIMED_US: u64 = 300_000;
/// Longest life that is made up, entries.
const FEIGNED: usize = 20;

/// A recorded entry as the recorder has it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordedEntry {
    /// Arrival, microseconds of the run.
    pub at: u64,
    /// Node that handed it over.
    pub node: NodeId,
    /// Bytes of the entry.
    pub bytes: Vec<u8>,
}

/// An insider with the recorder's key.
#[derive(Debug)]
pub struct InsiderRecorder {
    key: Key,
    does: Tampering,
    seed: u64,
}

impl InsiderRecorder {
    /// An insider who makes one change at a place that the seed draws, with the recorder's own key.
    pub fn new(key: Key, does: Tampering, seed: u64) -> Self {
        Self { key, does, seed }
    }

    /// Makes the change. Gives the place, counted from 1, of the first entry concerned; none where there is no such
    /// place.
    pub fn lay_on(&self, records: &mut Vec<RecordedEntry>) -> Option<usize> {
        let mut rng = stream(self.seed, 0);
        let mut draw = |n: usize| uniform_below(&mut rng, n as u64) as usize;
        let rest: Vec<usize> = (0..records.len()).filter(|i| records[*i].node != NodeId::RECORDER).collect();
        if rest.len() < 3 {
            return None;
        }
        match self.does {
            Tampering::Edit => {
                let i = draw(records.len());
                let byte = draw(records[i].bytes.len());
                records[i].bytes[byte] ^= 1 << draw(8);
                Some(i + 1)
            }
            Tampering::Swap => {
                let i = draw(rest.len() - 1);
                records.swap(rest[i], rest[i + 1]);
                Some(rest[i] + 1)
            }
            Tampering::Delete => {
                let i = draw(records.len());
                records.remove(i);
                Some(i + 1)
            }
            Tampering::Truncate => {
                let length = draw(records.len() - 1) + 1;
                records.truncate(length);
                Some(length + 1)
            }
            Tampering::Omit => {
                let i = rest[draw(rest.len())];
                records.remove(i);
                self.chain_anew(records);
                Some(i + 1)
            }
            Tampering::Rechain => {
                let i = rest[draw(rest.len())];
                let mut entry = Entry::decode(&records[i].bytes).ok()?;
                entry.at += Span::ms(1);
                records[i].bytes = codec::encode(&entry);
                self.chain_anew(records);
                Some(i + 1)
            }
            Tampering::CutAtSeal => self.cut(records, draw),
            Tampering::Feign => {
                let node = records[rest[draw(rest.len())]].node;
                let first = records.iter().position(|one| one.node == node)?;
                let i = draw(first + 1);
                let earlier = feigned(records, node, records[i].at);
                records.splice(i..i, earlier);
                self.chain_anew(records);
                Some(i + 1)
            }
            Tampering::Retime => {
                let i = rest[draw(rest.len())];
                let entry_time = records[i].at;
                records[i].at = entry_time.checked_sub(RETIMED_US).unwrap_or(entry_time + RETIMED_US);
                Some(i + 1)
            }
        }
    }

    /// Ends the recording at a seal as if the run had ended there: every chain at its last signature, a closing seal
    /// behind.
    fn cut(&self, records: &mut Vec<RecordedEntry>, mut draw: impl FnMut(usize) -> usize) -> Option<usize> {
        let is_seal = |i: &usize| matches!(event(&records[*i]), Some(Any::Service(Event::Sealed { .. })));
        let seals: Vec<usize> = (0..records.len()).filter(is_seal).collect();
        // After the first seconds, so that everybody has signed; before the last seal, so that something is cut.
        let inner = seals.get(seals.len() / 4..seals.len().checked_sub(2)?)?;
        let index = *inner.get(draw(inner.len().max(1)))?;
        let end = records.get(index)?.clone();
        records.truncate(index + 1);
        let mut signed: BTreeMap<NodeId, usize> = BTreeMap::new();
        for (i, one) in records.iter().enumerate() {
            if matches!(event(one), Some(Any::Service(Event::Signed { .. }))) {
                signed.insert(one.node, i);
            }
        }
        let mut place = 0;
        records.retain(|one| {
            place += 1;
            one.node == NodeId::RECORDER || signed.get(&one.node).is_some_and(|last| place - 1 <= *last)
        });
        let last = Entry::decode(&end.bytes).ok()?;
        for event in [Event::Sealed { entries: u64::MAX, head: [0; 32] }, Event::Signed { signature: [0; 64] }] {
            let event = Any::Service(event);
            records.push(RecordedEntry { bytes: codec::encode(&Entry { event, ..last }), ..end.clone() });
        }
        self.chain_anew(records);
        Some(records.len() + 1)
    }

    /// Writes every chain again, so that each holds together: counters, hashes, the recorder's seals and its
    /// signatures.
    pub fn chain_anew(&self, records: &mut [RecordedEntry]) {
        let mut heads: BTreeMap<(NodeId, Boot), (u64, [u8; 32])> = BTreeMap::new();
        let mut running: Vec<[u8; 32]> = vec![[0; 32]];
        for one in records {
            let Ok(mut entry) = Entry::decode(&one.bytes) else { continue };
            let (counter, previous) = heads.get(&(entry.node, entry.boot)).copied().unwrap_or_default();
            (entry.counter, entry.previous) = (counter + 1, previous);
            if entry.node == NodeId::RECORDER {
                entry.event = self.reseal(&entry, &running);
            }
            one.bytes = codec::encode(&entry);
            let hash: [u8; 32] = Sha256::digest(&one.bytes).into();
            heads.insert((entry.node, entry.boot), (counter + 1, hash));
            if entry.node != NodeId::RECORDER {
                let before = running.last().copied().unwrap_or_default();
                running.push(Sha256::new().chain_update(before).chain_update(hash).finalize().into());
            }
        }
    }

    /// The recorder's own words over a recording that it has changed.
    fn reseal(&self, entry: &Entry, running: &[[u8; 32]]) -> Any {
        match entry.event {
            Any::Service(Event::Sealed { entries, .. }) => {
                let entries = usize::try_from(entries).unwrap_or(usize::MAX).min(running.len() - 1);
                Any::Service(Event::Sealed { entries: entries as u64, head: running[entries] })
            }
            Any::Service(Event::Signed { .. }) => {
                let signed = self.key.sign(Purpose::Head, &entry.signed_as());
                let signature = *signed.last_chunk().expect("a COSE_Sign1 ends with its 64-byte signature");
                Any::Service(Event::Signed { signature })
            }
            other => other,
        }
    }
}

/// An earlier life of `author`: its first entries, under the boot before, all at `at`. No signature: that it cannot
/// make.
fn feigned(records: &[RecordedEntry], author: NodeId, at: u64) -> Vec<RecordedEntry> {
    let entries = records.iter().filter(|one| one.node == author).filter_map(|one| Entry::decode(&one.bytes).ok());
    let entries = entries.filter(|entry| !matches!(entry.event, Any::Service(Event::Signed { .. }))).take(FEIGNED);
    let boot = |boot: Boot| Boot(boot.0.saturating_sub(1));
    let buffers = entries.map(|entry| codec::encode(&Entry { boot: boot(entry.boot), ..entry }));
    buffers.map(|bytes| RecordedEntry { at, node: author, bytes }).collect()
}

fn event(record: &RecordedEntry) -> Option<Any> {
    Entry::decode(&record.bytes).ok().map(|entry| entry.event)
}
