//! Counters and observations of a guard: the target's half of a receipt.

use std::sync::atomic::{AtomicU64, Ordering};

use ground_truth::{Any, GuardVerdict, Note};
use serde::Serialize;
use tokio::sync::mpsc;
use wire::codec::Text;
use wire::event::{Event, Interface};
use wire::id::PeerId;

use crate::certificates::Fault;

/// The guard's verdict on a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Handed to the DTLS library.
    Passed,
    /// No record framing.
    Unframed,
    /// A ClientHello with wrong lengths.
    BadHello,
    /// Epoch 0 after completion: unprotected.
    PlaintextAfterCompletion,
    /// Epoch 0 before completion, and neither handshake nor change cipher spec.
    PlaintextBeforeCompletion,
    /// More records of the next epoch than may wait for completion.
    TooEarly,
    /// Refused: from a peer that has no association and opens none.
    UnknownPeer,
    /// A sound ClientHello with a failed handshake; noted after the failure, beside its `Passed`.
    Unfinished,
    /// A sound ClientHello for which there was no room.
    Shed,
    /// A record of a protected epoch that cannot be sealed: shorter than nonce and tag, or a change of cipher.
    Unsealed,
    /// A sound ClientHello of a peer that has not proved that it receives: without a cookie, or with a wrong one.
    Unproven,
}

impl Verdict {
    /// The verdict as the log has it, live and in the twin.
    pub fn logged(self) -> GuardVerdict {
        match self {
            Verdict::Passed => GuardVerdict::Passed,
            Verdict::PlaintextAfterCompletion | Verdict::PlaintextBeforeCompletion => GuardVerdict::Plaintext,
            Verdict::Unframed | Verdict::BadHello | Verdict::TooEarly | Verdict::Unsealed => GuardVerdict::Malformed,
            Verdict::UnknownPeer => GuardVerdict::Stranger,
            Verdict::Unfinished => GuardVerdict::Unfinished,
            Verdict::Shed | Verdict::Unproven => GuardVerdict::Shed,
        }
    }
}

/// One record as the target saw it arrive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Observation {
    /// Raw monotonic microseconds, for traces only.
    pub trace_us: u64,
    /// Number of the association at this socket, from 1.
    pub association: u32,
    /// Record content type.
    pub content: u8,
    /// Record epoch.
    pub epoch: u16,
    /// Record sequence number.
    pub sequence: u64,
    /// Header and body, in bytes.
    pub length: u32,
    /// [`digest`] of header and body.
    pub digest: [u8; 8],
    /// Verdict on it.
    pub verdict: Verdict,
    /// Fault for which a handshake or a session failed, where its peer was refused.
    pub fault: Option<Fault>,
    /// Peer of the certificate, in the observation of a completed handshake, which has no record.
    pub peer: Option<PeerId>,
}

/// The short hash of a record, as the adversary's half of a receipt carries it. A datagram of one record has the
/// record's digest.
pub fn digest(record: &[u8]) -> [u8; 8] {
    wire::event::wire_hash(record).to_be_bytes()
}

/// The association of an observation that belongs to none.
pub const UNKNOWN_PEER: u32 = u32::MAX;

impl Observation {
    /// The guard's log events of it, where its peers are refused at `interface`.
    pub(crate) fn events(&self, interface: Interface) -> [Option<Any>; 2] {
        if let Some(peer) = self.peer {
            return [Some(Note::Associated { association: self.association, peer }.into()), None];
        }
        let saw = Note::GuardSaw {
            association: self.association,
            epoch: self.epoch,
            sequence: self.sequence,
            length: self.length.min(u32::from(u16::MAX)) as u16,
            hash: u64::from_be_bytes(self.digest),
            verdict: self.verdict.logged(),
        };
        let refused = self.fault.map(|fault| {
            let detail = Text::new(&format!("{}: expected {}", fault.name(), fault.expected()));
            Event::Refused { at: interface, peer: None, reason: fault.reason(), detail }.into()
        });
        [Some(saw.into()), refused]
    }

    /// An observation of an association without a record.
    fn without_record(association: u32, verdict: Verdict) -> Self {
        Self {
            trace_us: crate::clock::trace_us(),
            association,
            content: 0,
            epoch: 0,
            sequence: 0,
            length: 0,
            digest: digest(&[]),
            verdict,
            fault: None,
            peer: None,
        }
    }
}

/// A bounded queue for observations; excess ones are counted and lost, and no sender waits.
#[derive(Clone, Debug)]
pub struct ObservationLog(mpsc::Sender<Observation>);

impl ObservationLog {
    /// A log of at most `capacity` observations under way, and its reader.
    pub fn new(capacity: usize) -> (Self, mpsc::Receiver<Observation>) {
        let (tx, rx) = mpsc::channel(capacity);
        (Self(tx), rx)
    }

    /// Reports that the peer of an association was refused, in its handshake or later.
    pub(crate) fn refused(&self, association: u32, fault: Fault, counters: &GuardCounters) {
        let observation =
            Observation { fault: Some(fault), ..Observation::without_record(association, Verdict::Unfinished) };
        self.push(observation, counters);
    }

    /// Reports that an association is complete, with its peer.
    pub(crate) fn complete(&self, association: u32, peer: PeerId, counters: &GuardCounters) {
        let observation = Observation { peer: Some(peer), ..Observation::without_record(association, Verdict::Passed) };
        self.push(observation, counters);
    }

    /// Reports the outcome of a datagram of a peer that has no association, and the fault, where it was refused.
    pub(crate) fn unknown_peer(&self, bytes: &[u8], verdict: Verdict, fault: Option<Fault>, counters: &GuardCounters) {
        let field = |from: usize, to: usize| {
            bytes.get(from..to).unwrap_or_default().iter().fold(0, |n, b| n << 8 | u64::from(*b))
        };
        let observation = Observation {
            trace_us: crate::clock::trace_us(),
            association: UNKNOWN_PEER,
            content: bytes.first().copied().unwrap_or_default(),
            epoch: field(3, 5) as u16,
            sequence: field(5, 11),
            length: bytes.len() as u32,
            digest: digest(bytes),
            verdict,
            fault,
            peer: None,
        };
        self.push(observation, counters);
    }

    pub(super) fn push(&self, observation: Observation, counters: &GuardCounters) {
        if self.0.try_send(observation).is_err() {
            add(&counters.unlogged);
        }
    }
}

/// Counters shared by the guards of one socket.
#[derive(Debug, Default)]
pub struct GuardCounters {
    datagrams: AtomicU64,
    records: AtomicU64,
    application: AtomicU64,
    unframed: AtomicU64,
    bad_hello: AtomicU64,
    plaintext_after: AtomicU64,
    plaintext_before: AtomicU64,
    too_early: AtomicU64,
    unsealed: AtomicU64,
    resent: AtomicU64,
    unlogged: AtomicU64,
}

/// A reading of [`GuardCounters`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct GuardStats {
    /// Datagrams that reached a guard.
    pub datagrams: u64,
    /// Records (and unframed remainders) in them.
    pub records: u64,
    /// Protected application records passed to the library; those it did not deliver it discarded.
    pub application: u64,
    /// Records refused for [`Verdict::Unframed`].
    pub unframed: u64,
    /// Records refused for [`Verdict::BadHello`].
    pub bad_hello: u64,
    /// Records refused for [`Verdict::PlaintextAfterCompletion`].
    pub plaintext_after: u64,
    /// Records refused for [`Verdict::PlaintextBeforeCompletion`].
    pub plaintext_before: u64,
    /// Records refused for [`Verdict::TooEarly`].
    pub too_early: u64,
    /// Records refused for [`Verdict::Unsealed`].
    pub unsealed: u64,
    /// Last flights repeated.
    pub resent: u64,
    /// Observations for which the log had no room.
    pub unlogged: u64,
}

impl GuardStats {
    /// Records refused, whatever the reason.
    pub fn refused(&self) -> u64 {
        self.unframed + self.bad_hello + self.plaintext_after + self.plaintext_before + self.too_early + self.unsealed
    }
}

impl GuardCounters {
    /// The counters so far.
    pub fn read(&self) -> GuardStats {
        let get = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        GuardStats {
            datagrams: get(&self.datagrams),
            records: get(&self.records),
            application: get(&self.application),
            unframed: get(&self.unframed),
            bad_hello: get(&self.bad_hello),
            plaintext_after: get(&self.plaintext_after),
            plaintext_before: get(&self.plaintext_before),
            too_early: get(&self.too_early),
            unsealed: get(&self.unsealed),
            resent: get(&self.resent),
            unlogged: get(&self.unlogged),
        }
    }

    pub(super) fn datagram(&self) {
        add(&self.datagrams);
    }

    pub(super) fn resend(&self) {
        add(&self.resent);
    }

    pub(super) fn record(&self, verdict: Verdict, protected_application: bool) {
        add(&self.records);
        match verdict {
            Verdict::Passed => {
                if protected_application {
                    add(&self.application);
                }
            }
            Verdict::Unframed => add(&self.unframed),
            Verdict::BadHello => add(&self.bad_hello),
            Verdict::PlaintextAfterCompletion => add(&self.plaintext_after),
            Verdict::PlaintextBeforeCompletion => add(&self.plaintext_before),
            Verdict::TooEarly => add(&self.too_early),
            Verdict::Unsealed => add(&self.unsealed),
            // Counted by the listener, which alone knows its peers.
            Verdict::UnknownPeer | Verdict::Unfinished | Verdict::Shed | Verdict::Unproven => {}
        }
    }
}

fn add(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}
