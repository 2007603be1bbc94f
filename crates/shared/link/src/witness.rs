//! Log of the delivery witness of a process's secure sessions and streams: the target's half of a receipt.
//!
//! It is a separate hash chain, signed with the guard's key as a service's chain is with the service's, in a separate file, so that no
//! recorder handles it. The process reports its head in its closing account. The meaning of entries is left to the oracle, their
//! verification to `recording::log`.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Result, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ground_truth::{Note, Sight};
use minicbor::Encode;
use serde_json::Value;
use wire::audit::{Journal, MAX_ENTRY};
use wire::core::Output;
use wire::event::{Account, Event, Interface};
use wire::id::NodeId;
use wire::sign::Key;
use wire::time::Instant;

use crate::clock::trace_us;
use crate::dtls::session::SessionStats;
use crate::files;
use crate::guard::observe::Observation;
use crate::instrument;
use crate::spec::ServiceSpec;

/// Room for entries, in bytes.
const LOG_BYTES: u64 = 128 << 20;
/// Largest size of an entry and the signature behind it, bytes.
const MOST: u64 = 2 * (4 + MAX_ENTRY as u64);
/// The longest log that is read, bytes: more than one takes.
const MAX_READ: u64 = 160 << 20;
/// The shortest entry, bytes: the hash of the one before it is in it.
const MIN_ENTRY: usize = 32;

/// One observation of a stream's witness.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamSight {
    /// Raw monotonic microseconds, for traces only.
    pub trace_us: u64,
    /// The observation.
    pub sight: Sight,
    /// Name of the direction.
    pub stream: u64,
    /// Bytes of the direction before these.
    pub offset: u64,
    /// Bytes.
    pub length: u32,
    /// Their short hash.
    pub hash: u64,
}

/// The log of one guard, shared by all observers in the process.
#[derive(Clone, Debug)]
pub struct WitnessLog(Arc<Mutex<Log>>);

#[derive(Debug)]
struct Log {
    journal: Journal,
    /// Interface of the refused peers.
    interface: Interface,
    /// True if this process dials the gateway, with no relay in between.
    direct: bool,
    /// The file; none after the close or a failed write.
    out: Option<BufWriter<File>>,
    room: u64,
    last: Vec<u8>,
}

impl WitnessLog {
    /// The log of the specification, if it has one.
    ///
    /// # Errors
    /// When its file has content already or cannot be created.
    pub fn create(spec: &ServiceSpec) -> Result<Option<Self>> {
        let Some(witness) = &spec.witness else { return Ok(None) };
        let file = files::begin(&spec.guard_log())?;
        let key = Key::from_bytes(&witness.secret.0);
        let log = Log {
            journal: Journal::new(witness.node, spec.boot, Some(key)),
            interface: if spec.node == NodeId::GATEWAY { Interface::Uplink } else { Interface::Downlink },
            direct: witness.direct,
            out: Some(BufWriter::with_capacity(1 << 16, file)),
            room: LOG_BYTES,
            last: Vec::new(),
        };
        Ok(Some(Self(Arc::new(Mutex::new(log)))))
    }

    /// Notes a guard's observation of a record, a handshake or a session.
    pub(crate) fn observed(&self, seen: &Observation) {
        let mut log = self.log();
        let interface = log.interface;
        seen.events(interface).into_iter().flatten().for_each(|event| log.note(seen.trace_us, event));
    }

    /// Notes a stream's observation, and hands it to the operating system at once: there are few, and they survive a killed process.
    pub(crate) fn sighted(&self, seen: &StreamSight) {
        let StreamSight { trace_us, sight, stream, offset, length, hash } = *seen;
        let mut log = self.log();
        log.note(trace_us, Note::StreamSaw { sight, stream, offset, length, hash });
        log.flush_or_end();
    }

    /// Hands buffered entries to the operating system.
    ///
    /// # Errors
    ///
    /// When they cannot be written.
    pub fn flush(&self) -> Result<()> {
        self.log().out.as_mut().map_or(Ok(()), Write::flush)
    }

    /// Writes the closing account of the sessions, signs the chain and returns its head; later observations are dropped.
    pub fn close(&self, sessions: Option<(SessionStats, u64)>) -> Value {
        let mut log = self.log();
        let now = trace_us();
        // The closing account has room beyond the bound: its length is bounded by itself.
        log.room = u64::MAX;
        let accounts = sessions.map(|(stats, kernel_drops)| accounts(&stats, kernel_drops, log.direct));
        for (account, n) in accounts.into_iter().flatten() {
            log.note(now, Event::Count { account, n });
        }
        let mut out = VecDeque::new();
        log.journal.sign(Instant(now), &mut out);
        log.put(out);
        log.flush_or_end();
        log.out = None;
        instrument::head(&log.last)
    }

    fn log(&self) -> MutexGuard<'_, Log> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Log {
    fn note(&mut self, time: u64, event: impl Encode<()>) {
        if self.out.is_none() {
            return;
        }
        if self.room < MOST {
            tracing::warn!("the guard's log is full");
            self.room = 0;
            return;
        }
        let mut out = VecDeque::new();
        self.journal.write(Instant(time), event, &mut out);
        self.put(out);
    }

    fn put(&mut self, entries: VecDeque<Output>) {
        for entry in entries {
            let Output::Audit { bytes } = entry else { continue };
            let written = self.out.as_mut().map_or(Ok(()), |out| piece(out, &bytes));
            self.room = self.room.saturating_sub(4 + bytes.len() as u64);
            self.last = bytes;
            self.end_on(written);
        }
    }

    fn flush_or_end(&mut self) {
        let flushed = self.out.as_mut().map_or(Ok(()), Write::flush);
        self.end_on(flushed);
    }

    /// A log that could not be written ends: its head then names more entries than the file has.
    fn end_on(&mut self, outcome: Result<()>) {
        if let Err(error) = outcome {
            tracing::warn!(%error, "the guard's log ended");
            self.out = None;
        }
    }
}

/// Writes encoded entries as such a log.
///
/// # Errors
/// When there is a file at `path` already, or it cannot be written.
pub fn write_entries<'a>(path: &Path, entries: impl IntoIterator<Item = &'a [u8]>) -> Result<()> {
    let mut out = BufWriter::new(files::create(path)?);
    entries.into_iter().try_for_each(|entry| piece(&mut out, entry))?;
    out.flush()
}

/// An entry behind its length.
fn piece(out: &mut impl Write, bytes: &[u8]) -> Result<()> {
    out.write_all(&(bytes.len() as u32).to_be_bytes())?;
    out.write_all(bytes)
}

/// The encoded entries of such a log, up to the first that is cut or has an impossible length.
///
/// # Errors
/// When the file cannot be opened.
pub fn read_entries(path: &Path) -> Result<Vec<Vec<u8>>> {
    Ok(entries_of(BufReader::new(files::open(path)?.take(MAX_READ))))
}

/// The encoded entries of such a log's bytes, each behind its length; decoding is left to the reader.
pub fn entries_of(mut from: impl Read) -> Vec<Vec<u8>> {
    let mut found = Vec::new();
    let mut prefix = [0; 4];
    while from.read_exact(&mut prefix).is_ok() {
        let length = u32::from_be_bytes(prefix) as usize;
        let mut entry = vec![0; length.min(MAX_ENTRY)];
        if !(MIN_ENTRY..=MAX_ENTRY).contains(&length) || from.read_exact(&mut entry).is_err() {
            break;
        }
        found.push(entry);
    }
    found
}

/// The link's counters, as accounts. Application data that the secure layer consumed without delivering counts as
/// discarded; other records that the guard passed are the handshake's.
fn accounts(stats: &SessionStats, kernel_drops: u64, direct: bool) -> [(Account, u64); 10] {
    let SessionStats { guard, unknown_peers, shed, unproven, proved, .. } = *stats;
    let unguarded =
        stats.overflowed + stats.abandoned + unknown_peers + shed + unproven + proved + stats.cookie_requests;
    let unknown_peers = unknown_peers + shed + unproven;
    let handshake = (guard.records + proved).saturating_sub(guard.refused()).saturating_sub(guard.application);
    [
        (Account::Datagrams, guard.datagrams),
        (Account::Unguarded, unguarded),
        (Account::SentDirect, if direct { stats.dialled } else { 0 }),
        (Account::GuardIn, guard.records + unknown_peers + proved),
        (Account::GuardRefused, guard.refused() + unknown_peers),
        (Account::Delivered, stats.delivered),
        (Account::Discarded, guard.application.saturating_sub(stats.delivered)),
        (Account::Handshake, handshake),
        (Account::Outsiders, stats.outsiders),
        (Account::KernelDropped, kernel_drops),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::HostClock;
    use crate::spec::WitnessSpec;
    use ground_truth::{Any, Entry};
    use wire::audit::Chains;
    use wire::id::Boot;
    use wire::sign::Secret;

    fn spec(folder: &Path) -> ServiceSpec {
        let clock = HostClock { zero_us: 0, drift_ppm: 0 };
        let mut spec = ServiceSpec::new(NodeId::GATEWAY, Boot(2), 1, clock, folder.to_owned());
        let node = NodeId::GATEWAY.guard().unwrap();
        spec.witness = Some(WitnessSpec { node, secret: Secret([7; 32]), direct: false });
        spec
    }

    fn sight(trace_us: u64) -> StreamSight {
        StreamSight { trace_us, sight: Sight::Arrived, stream: 1, offset: 0, length: 3, hash: 4 }
    }

    /// Its process reports the head.
    #[test]
    fn guard_log_is_a_signed_chain() {
        let folder = tempfile::tempdir().unwrap();
        let spec = spec(folder.path());
        let log = WitnessLog::create(&spec).unwrap().unwrap();
        (0..5).for_each(|n| log.sighted(&sight(1_000_000 * n)));
        let head = log.close(Some((SessionStats { delivered: 3, ..SessionStats::default() }, 2)));
        log.sighted(&sight(9_000_000));
        let entries = read_entries(&folder.path().join("guard/gateway-2.cbor")).unwrap();
        let mut chains = Chains::default();
        let read: Vec<Entry> = entries.iter().map(|bytes| chains.follow(bytes).unwrap().0).collect();
        assert!(read.iter().all(|entry| (entry.node, entry.boot) == (NodeId::GATEWAY.guard().unwrap(), Boot(2))));
        assert!(matches!(read.last().unwrap().event, Any::Service(Event::Signed { .. })));
        let seen = read.iter().filter(|entry| matches!(entry.event, Any::Instrument(Note::StreamSaw { .. }))).count();
        let signed = read.iter().filter(|entry| matches!(entry.event, Any::Service(Event::Signed { .. }))).count();
        // Behind each sight, a second apart, and at the end; of the closing account too, where that comes a second later.
        assert!((6..=7).contains(&signed), "{signed}");
        assert_eq!((seen, read.len()), (5, 5 + signed + 10));
        assert!(read.iter().any(|e| e.event == Any::Service(Event::Count { account: Account::Delivered, n: 3 })));
        assert_eq!(head, instrument::head(entries.last().unwrap()));
        assert!(WitnessLog::create(&spec).is_err(), "over what is there");
    }
}
