//! A datagram path between the network and the DTLS library.
//!
//! RFC 6347 §4.1.2.7 requires that invalid records are discarded; the library instead ends the association on one forged plaintext
//! record, never repeats its last flight, and indexes past the end of a crafted ClientHello. The guard
//!
//! - lets only handshake and well-formed change-cipher records of epoch 0 through before completion,
//! - drops every record of epoch 0 after completion,
//! - drops records of later epochs that cannot have been sealed: the library computes with their length before it looks
//!   at their tag, and takes a change of cipher there without any,
//! - repeats the last datagram sent before completion when the peer's records show that it was lost,
//! - checks every length of a ClientHello ([`hello`]),
//! - counts all of it, and reports observations for receipts ([`observe`]).
//!
//! It holds no key. The authenticity of a record is left to the library, its freshness to the gateway.

pub mod cookie;
pub mod hello;
pub mod observe;
pub mod record;

use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use async_trait::async_trait;
use serde::{Deserialize, Serialize};
use webrtc_util::conn::Conn;

use self::observe::{GuardCounters, Observation, ObservationLog, Verdict, digest};
use self::record::{APPLICATION_DATA, CHANGE_CIPHER_SPEC, HANDSHAKE, RawRecord, Split};

/// Repetitions of the last flight in one association.
pub const RESENDS: u32 = 64;

/// Bound of the records of the next epoch that wait in the library before completion (its own queue has no bound).
const EARLY_RECORDS: u32 = 64;

/// Overhead of sealing on a record's body, in bytes: the explicit nonce and the tag of AES-GCM (RFC 5288 §3).
pub const SEAL: usize = 8 + 16;

/// Treatment of unauthenticated records. Lengths are checked and flights repeated in both modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GuardMode {
    /// Drop unprotected records.
    Required,
    /// Pass them to the library, as without a guard (an ablation).
    Waived,
}

/// Settings of a guard.
#[derive(Clone, Debug)]
pub struct GuardSettings {
    /// Treatment of unauthenticated records.
    pub mode: GuardMode,
    /// Number of the association, for the observations.
    pub association: u32,
    /// Counters, shared by the guards of one socket.
    pub counters: Arc<GuardCounters>,
    /// Log of observations, if any.
    pub log: Option<ObservationLog>,
}

/// The guard of one association.
pub struct GuardConn {
    inner: Arc<dyn Conn + Send + Sync>,
    settings: GuardSettings,
    complete: AtomicBool,
    early: AtomicU32,
    resends: AtomicU32,
    last_flight: Mutex<Vec<u8>>,
}

/// Verdict of a guard in `mode` on one record, before or after its association is complete. The bound on early records
/// is kept by the guard itself. The twin's link model decides with this very function.
pub fn judge(raw: &RawRecord<'_>, mode: GuardMode, complete: bool) -> Verdict {
    if raw.epoch > 0 {
        let sealed = raw.body().len() >= SEAL && raw.content != CHANGE_CIPHER_SPEC;
        return if sealed { Verdict::Passed } else { Verdict::Unsealed };
    }
    if raw.content == HANDSHAKE && !hello::lengths_hold(raw.body()) {
        return Verdict::BadHello;
    }
    let waived = mode == GuardMode::Waived;
    if complete && !waived {
        return Verdict::PlaintextAfterCompletion;
    }
    let expected = match raw.content {
        HANDSHAKE => true,
        CHANGE_CIPHER_SPEC => raw.body() == [1],
        _ => false,
    };
    if expected || waived { Verdict::Passed } else { Verdict::PlaintextBeforeCompletion }
}

/// Outcome of a datagram.
struct Admitted {
    /// The records that passed, one after the other.
    passed: Vec<u8>,
    missed_last_flight: bool,
}

impl GuardConn {
    /// A guard before `inner`.
    pub fn new(inner: Arc<dyn Conn + Send + Sync>, settings: GuardSettings) -> Self {
        Self {
            inner,
            settings,
            complete: AtomicBool::new(false),
            early: AtomicU32::new(0),
            resends: AtomicU32::new(0),
            last_flight: Mutex::new(Vec::new()),
        }
    }

    /// Notes that the handshake is complete: from here on every record of epoch 0 is refused.
    pub fn complete(&self) {
        self.complete.store(true, Ordering::SeqCst);
    }

    /// Decides on each record of a datagram.
    fn admit(&self, datagram: &[u8]) -> Admitted {
        let complete = self.complete.load(Ordering::SeqCst);
        let mut admitted = Admitted { passed: Vec::with_capacity(datagram.len()), missed_last_flight: false };
        self.settings.counters.datagram();
        for piece in record::split(datagram) {
            match piece {
                Split::Record(raw) => {
                    let verdict = self.judge(&raw, complete);
                    // A handshake record after completion is the peer's repeated flight: it did not get our last one.
                    admitted.missed_last_flight |= complete && raw.epoch == 0 && raw.content == HANDSHAKE;
                    self.note(&raw, verdict);
                    if verdict == Verdict::Passed {
                        admitted.passed.extend_from_slice(raw.bytes);
                    }
                }
                Split::Remainder(bytes) => {
                    self.note(&RawRecord::unframed(bytes), Verdict::Unframed);
                }
            }
        }
        admitted
    }

    fn judge(&self, raw: &RawRecord<'_>, complete: bool) -> Verdict {
        let verdict = judge(raw, self.settings.mode, complete);
        let early = verdict == Verdict::Passed && raw.epoch > 0 && !complete;
        if early && self.early.fetch_add(1, Ordering::Relaxed) >= EARLY_RECORDS {
            return Verdict::TooEarly;
        }
        verdict
    }

    fn note(&self, raw: &RawRecord<'_>, verdict: Verdict) {
        self.settings.counters.record(verdict, raw.epoch > 0 && raw.content == APPLICATION_DATA);
        if let Some(log) = &self.settings.log {
            log.push(
                Observation {
                    trace_us: crate::clock::trace_us(),
                    association: self.settings.association,
                    content: raw.content,
                    epoch: raw.epoch,
                    sequence: raw.sequence,
                    length: u32::try_from(raw.bytes.len()).unwrap_or(u32::MAX),
                    digest: digest(raw.bytes),
                    verdict,
                    fault: None,
                    peer: None,
                },
                &self.settings.counters,
            );
        }
    }

    /// Repeats the last datagram sent before completion, a bounded number of times: a forged record can provoke it.
    async fn repeat_last_flight(&self) {
        if self.resends.fetch_add(1, Ordering::Relaxed) >= RESENDS {
            return;
        }
        let flight = self.last_flight.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if !flight.is_empty() && self.inner.send(&flight).await.is_ok() {
            self.settings.counters.resend();
        }
    }
}

#[async_trait]
impl Conn for GuardConn {
    async fn connect(&self, addr: SocketAddr) -> webrtc_util::Result<()> {
        self.inner.connect(addr).await
    }

    async fn recv(&self, buf: &mut [u8]) -> webrtc_util::Result<usize> {
        loop {
            let n = self.inner.recv(buf).await?;
            let admitted = self.admit(&buf[..n]);
            if admitted.missed_last_flight {
                self.repeat_last_flight().await;
            }
            if !admitted.passed.is_empty() {
                buf[..admitted.passed.len()].copy_from_slice(&admitted.passed);
                return Ok(admitted.passed.len());
            }
        }
    }

    async fn recv_from(&self, buf: &mut [u8]) -> webrtc_util::Result<(usize, SocketAddr)> {
        let n = self.recv(buf).await?;
        let from = self.inner.remote_addr().ok_or(webrtc_util::Error::ErrNotFound)?;
        Ok((n, from))
    }

    async fn send(&self, buf: &[u8]) -> webrtc_util::Result<usize> {
        if !self.complete.load(Ordering::SeqCst) {
            *self.last_flight.lock().unwrap_or_else(PoisonError::into_inner) = buf.to_vec();
        }
        self.inner.send(buf).await
    }

    async fn send_to(&self, buf: &[u8], target: SocketAddr) -> webrtc_util::Result<usize> {
        self.inner.send_to(buf, target).await
    }

    fn local_addr(&self) -> webrtc_util::Result<SocketAddr> {
        self.inner.local_addr()
    }

    fn remote_addr(&self) -> Option<SocketAddr> {
        self.inner.remote_addr()
    }

    async fn close(&self) -> webrtc_util::Result<()> {
        self.inner.close().await
    }

    fn as_any(&self) -> &(dyn std::any::Any + Send + Sync) {
        self
    }
}
