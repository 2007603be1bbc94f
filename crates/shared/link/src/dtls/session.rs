//! The life of one established association, from `Opened` to `Closed`.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::Duration;

use serde::Serialize;
use tokio::sync::mpsc;
use wire::id::{PeerId, SessionId};

use super::{MAX_RECORD, Secure};
use crate::certificates::list::Revocations;
use crate::certificates::{Fault, Refused};
use crate::guard::observe::{GuardCounters, GuardStats, ObservationLog};
use crate::guard::{GuardMode, GuardSettings};
use crate::loopback::LoopbackAddr;

/// Records that may wait to be sent into one session.
pub const OUTBOUND: usize = 256;

/// Settings of a dialler or listener.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Mode of the guards: drop unauthenticated records, or pass them.
    pub guard: GuardMode,
    /// A session without a record for this long is ended (liveness itself is judged by the cores).
    pub idle: Duration,
    /// Log of the guards' observations, if any.
    pub log: Option<ObservationLog>,
    /// Number of the last session, shared by all sessions of the process, so that their handles are unique.
    pub sessions: Arc<AtomicU32>,
    /// Counters, shared by all sessions of one socket.
    pub counters: Arc<SessionCounters>,
    /// Address of this run's datagram sockets, with port 0: a datagram from another address is an outsider's.
    pub own: LoopbackAddr,
    /// The revocation list; a change ends the sessions of revoked peers.
    pub revocations: Revocations,
}

impl Settings {
    /// Settings with new counters, for a run at `127.0.0.1`.
    pub fn new(guard: GuardMode, idle: Duration, revocations: Revocations) -> Self {
        Self {
            guard,
            idle,
            revocations,
            log: None,
            own: LoopbackAddr::ANY_PORT,
            sessions: Arc::new(AtomicU32::new(0)),
            counters: Arc::new(SessionCounters::default()),
        }
    }

    pub(crate) fn guard(&self, association: u32) -> GuardSettings {
        GuardSettings { mode: self.guard, association, counters: self.counters.guard.clone(), log: self.log.clone() }
    }

    pub(super) fn next_session(&self) -> SessionId {
        SessionId(self.sessions.fetch_add(1, Ordering::Relaxed).wrapping_add(1))
    }
}

/// Events of sessions, in order per session.
#[derive(Debug)]
pub enum SessionEvent {
    /// A session is open.
    Opened(SessionHandle),
    /// One application record.
    Record(SessionId, Vec<u8>),
    /// The session has ended.
    Closed(SessionId),
}

/// The sending end of a session. Dropping it ends the session.
#[derive(Debug)]
pub struct SessionHandle {
    /// Local handle.
    pub session: SessionId,
    /// The authenticated peer.
    pub peer: PeerId,
    outbound: mpsc::Sender<Vec<u8>>,
    counters: Arc<SessionCounters>,
}

impl SessionHandle {
    /// Queues one record; false when it is too long, the queue is full or the session has ended (counted).
    pub fn send(&self, record: Vec<u8>) -> bool {
        let queued = record.len() <= MAX_RECORD && self.outbound.try_send(record).is_ok();
        if !queued {
            self.counters.unsent.fetch_add(1, Ordering::Relaxed);
        }
        queued
    }
}

/// Counters shared by the sessions of one socket.
#[derive(Debug, Default)]
pub struct SessionCounters {
    /// Counters of the guards.
    pub guard: Arc<GuardCounters>,
    pub(super) opened: AtomicU64,
    pub(super) failed: AtomicU64,
    pub(super) dismissed: AtomicU64,
    pub(super) shed: AtomicU64,
    pub(super) unproven: AtomicU64,
    pub(super) proved: AtomicU64,
    pub(super) displaced: AtomicU64,
    pub(super) cookie_requests: AtomicU64,
    most_shaking: AtomicU64,
    most_peers: AtomicU64,
    pub(super) unknown_peers: AtomicU64,
    pub(super) outsiders: AtomicU64,
    pub(super) overflowed: AtomicU64,
    pub(super) abandoned: AtomicU64,
    pub(super) dialled: AtomicU64,
    pub(super) kernel_dropped: AtomicU64,
    pub(super) delivered: AtomicU64,
    pub(super) sent: AtomicU64,
    pub(super) unsent: AtomicU64,
}

/// A reading of [`SessionCounters`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SessionStats {
    /// The guards' counters.
    pub guard: GuardStats,
    /// Handshakes completed.
    pub opened: u64,
    /// Handshakes that failed or took too long.
    pub failed: u64,
    /// Sessions ended because a certificate had ended or was revoked.
    pub dismissed: u64,
    /// Sound ClientHellos turned away because too many handshakes or sessions were open.
    pub shed: u64,
    /// Sound ClientHellos answered with a cookie request.
    pub unproven: u64,
    /// ClientHellos that returned the cookie.
    pub proved: u64,
    /// Handshakes ended to make room for newer ones.
    pub displaced: u64,
    /// Cookie requests that a dialler received.
    #[serde(rename = "asked")]
    pub cookie_requests: u64,
    /// Handshakes under way at once, at most.
    pub most_shaking: u64,
    /// Peer addresses with state at once, at most.
    pub most_peers: u64,
    /// Datagrams from unknown peers that open no association.
    #[serde(rename = "strangers")]
    pub unknown_peers: u64,
    /// Datagrams that no process of the run sent, with any outcome; in no other count.
    pub outsiders: u64,
    /// Datagrams for which an association had no room.
    pub overflowed: u64,
    /// Datagrams for an association that was over.
    pub abandoned: u64,
    /// Datagrams sent by the dialling side.
    pub dialled: u64,
    /// Datagrams that the kernel dropped at sockets of earlier dials.
    pub kernel_dropped: u64,
    /// Application records delivered.
    pub delivered: u64,
    /// Application records sent.
    pub sent: u64,
    /// Application records not sent: too long, no room, session ended.
    pub unsent: u64,
}

impl SessionCounters {
    /// The counters so far.
    pub fn read(&self) -> SessionStats {
        let get = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        SessionStats {
            guard: self.guard.read(),
            opened: get(&self.opened),
            failed: get(&self.failed),
            dismissed: get(&self.dismissed),
            shed: get(&self.shed),
            unproven: get(&self.unproven),
            proved: get(&self.proved),
            displaced: get(&self.displaced),
            cookie_requests: get(&self.cookie_requests),
            most_shaking: get(&self.most_shaking),
            most_peers: get(&self.most_peers),
            unknown_peers: get(&self.unknown_peers),
            outsiders: get(&self.outsiders),
            overflowed: get(&self.overflowed),
            abandoned: get(&self.abandoned),
            dialled: get(&self.dialled),
            kernel_dropped: get(&self.kernel_dropped),
            delivered: get(&self.delivered),
            sent: get(&self.sent),
            unsent: get(&self.unsent),
        }
    }

    /// Notes the number of handshakes under way and the number of addresses with state.
    pub(super) fn peak(&self, shaking: usize, peers: usize) {
        self.most_shaking.fetch_max(shaking as u64, Ordering::Relaxed);
        self.most_peers.fetch_max(peers as u64, Ordering::Relaxed);
    }

    pub(super) fn add(counter: &AtomicU64) {
        Self::add_n(counter, 1);
    }

    pub(super) fn add_n(counter: &AtomicU64, n: u64) {
        counter.fetch_add(n, Ordering::Relaxed);
    }
}

/// Serves one association until it ends. Returns early only when `events` has no receiver any more.
pub(super) async fn serve(
    secure: Secure,
    session: SessionId,
    settings: &Settings,
    events: &mpsc::Sender<SessionEvent>,
) {
    let (outbound, mut to_send) = mpsc::channel(OUTBOUND);
    let counters = &settings.counters;
    SessionCounters::add(&counters.opened);
    if let Some(log) = &settings.log {
        log.complete(session.0, secure.peer(), &counters.guard);
    }
    let handle = SessionHandle { session, peer: secure.peer(), outbound, counters: counters.clone() };
    if events.send(SessionEvent::Opened(handle)).await.is_err() {
        secure.close().await;
        return;
    }
    let expiry = tokio::time::Instant::now() + secure.life();
    let mut last_record = tokio::time::Instant::now();
    let mut list = settings.revocations.watch();
    loop {
        tokio::select! {
            () = list.changed() => if let Err(refused) = secure.verify_peer() {
                dismissed(settings, session, &refused);
                break;
            },
            received = secure.recv() => match received {
                Ok(record) => {
                    last_record = tokio::time::Instant::now();
                    SessionCounters::add(&counters.delivered);
                    if events.send(SessionEvent::Record(session, record)).await.is_err() { break }
                }
                Err(error) => {
                    tracing::debug!(%error, peer = %secure.peer(), "association ended");
                    break;
                }
            },
            record = to_send.recv() => match record {
                Some(record) => match secure.send(&record).await {
                    Ok(()) => SessionCounters::add(&counters.sent),
                    Err(_) => { SessionCounters::add(&counters.unsent); break }
                },
                None => break,
            },
            () = tokio::time::sleep_until(last_record + settings.idle) => break,
            // The handshake checks the validity once; a session may outlive its certificate.
            () = tokio::time::sleep_until(expiry) => {
                let got = format!("a certificate that has ended, of {} or ours", secure.peer());
                dismissed(settings, session, &Refused { fault: Fault::Expired, got });
                break;
            }
        }
    }
    secure.close().await;
    if events.send(SessionEvent::Closed(session)).await.is_err() {
        tracing::trace!("nobody waits for the end of {session:?}");
    }
}

/// Reports the end of an open session because of its certificate.
fn dismissed(settings: &Settings, session: SessionId, refused: &Refused) {
    SessionCounters::add(&settings.counters.dismissed);
    tracing::info!(%refused, ?session, "session ended");
    if let Some(log) = &settings.log {
        log.refused(session.0, refused.fault, &settings.counters.guard);
    }
}
