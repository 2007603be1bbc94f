//! A hostile recorder at the log of a run in the twin.

use adversary::insider::{InsiderRecorder, RecordedEntry};
use evidence::log::{Logged, by_recorder};

/// Lets `hands` at the entries that went by way of the recorder.
pub(super) fn tamper(hands: &InsiderRecorder, log: &mut Vec<Logged>) {
    let (recorded, noted): (Vec<Logged>, Vec<Logged>) = log.drain(..).partition(|l| by_recorder(l.node));
    let mut records: Vec<RecordedEntry> =
        recorded.into_iter().map(|Logged { at, node, bytes }| RecordedEntry { at, node, bytes }).collect();
    hands.lay_on(&mut records);
    log.extend(records.into_iter().map(|RecordedEntry { at, node, bytes }| Logged { at, node, bytes }));
    log.extend(noted);
}
