//! Listener for sessions on one socket: a loop that never waits for any peer.
//!
//! The library's own listener runs a handshake inside its accept loop, so one silent ClientHello blocks all others. Here
//! each peer address has a bounded queue and a task; handshakes under way and sessions are bounded. An unknown peer first
//! passes the cookie exchange ([`crate::guard::cookie`]), which keeps no state; among admitted peers the oldest unfinished
//! handshake makes room for the newest, so that silent peers block nobody. Losses are counted.
//!
//! A datagram from outside of the run is judged like any other, by the same cookie exchange and guards. Only its counts
//! are separate: it is counted once, as an outsider's, so that the counts of the run's own datagrams balance.

use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::net::UdpSocket;
use tokio::sync::mpsc;
use tokio::task::{AbortHandle, JoinHandle};
use tokio::time::Instant;

use super::path::{INLET, Outlet, Path};
use super::session::{SessionCounters, SessionEvent, Settings, serve};
use super::{DATAGRAM, DtlsError, server};
use crate::certificates::Fault;
use crate::guard::cookie::{Answer, CookieExchange};
use crate::guard::observe::Verdict;
use crate::loopback::LoopbackAddr;
use crate::pki::Credential;
use crate::sockets;

/// Handshakes that may be under way at once.
pub const HALF_OPEN: usize = 64;

/// Peer addresses that may have state at once.
pub const PEERS: usize = 256;

/// A socket that accepts sessions until this is dropped. Open sessions continue.
pub struct Listener {
    local: LoopbackAddr,
    task: JoinHandle<()>,
}

impl Listener {
    /// Listening address.
    pub fn local(&self) -> LoopbackAddr {
        self.local
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// Source of a listener's datagrams.
pub enum Port {
    /// A socket.
    Socket(Arc<UdpSocket>),
    /// A network in memory: datagrams with the address of their sender, or of their receiver.
    Memory(mpsc::Receiver<(LoopbackAddr, Vec<u8>)>, mpsc::Sender<(LoopbackAddr, Vec<u8>)>),
}

/// Listens at `address`. Must be called inside a tokio runtime.
///
/// # Errors
/// When the socket cannot be bound to the loopback interface.
pub fn listen(
    address: LoopbackAddr,
    credential: Credential,
    settings: Settings,
    events: mpsc::Sender<SessionEvent>,
) -> Result<Listener, DtlsError> {
    let socket = Arc::new(sockets::udp(address)?);
    let local = LoopbackAddr::try_from(socket.local_addr()?)?;
    accept(local, Port::Socket(socket), credential, settings, events)
}

/// Listens on a network in memory. Must be called inside a tokio runtime.
///
/// # Errors
/// When the host has no randomness.
pub fn accept(
    local: LoopbackAddr,
    port: Port,
    credential: Credential,
    settings: Settings,
    events: mpsc::Sender<SessionEvent>,
) -> Result<Listener, DtlsError> {
    let exchange =
        CookieExchange::new().ok_or_else(|| std::io::Error::other("no randomness for the exchange's key"))?;
    let outside = Settings { log: None, counters: Arc::default(), ..settings.clone() };
    let accept = Accept {
        exchange,
        credential: Arc::new(credential),
        settings,
        outside,
        events,
        shaking: VecDeque::new(),
        peers: BTreeMap::new(),
    };
    Ok(Listener { local, task: tokio::spawn(accept.run(port)) })
}

struct Accept {
    exchange: CookieExchange,
    credential: Arc<Credential>,
    settings: Settings,
    /// Settings for peers outside of the run: separate counters, and no log.
    outside: Settings,
    events: mpsc::Sender<SessionEvent>,
    /// Handshakes that were begun, the oldest first; ended ones are removed before the next is admitted.
    shaking: VecDeque<Shaking>,
    peers: BTreeMap<SocketAddr, mpsc::Sender<Vec<u8>>>,
}

/// A handshake that was begun.
struct Shaking {
    peer: LoopbackAddr,
    hello: Vec<u8>,
    over: Arc<AtomicBool>,
    task: AbortHandle,
    settings: Settings,
}

impl Accept {
    async fn run(mut self, port: Port) {
        match port {
            Port::Socket(socket) => {
                let mut buf = vec![0; DATAGRAM];
                let out = |peer| Outlet::Socket(socket.clone(), peer);
                loop {
                    match socket.recv_from(&mut buf).await {
                        Ok((n, from)) => self.datagram(from, &buf[..n], &out),
                        Err(error) => {
                            tracing::trace!(%error, "datagram not received");
                            tokio::time::sleep(Duration::from_millis(1)).await;
                        }
                    }
                }
            }
            Port::Memory(mut inlet, outlet) => {
                let out = |peer| Outlet::Port(outlet.clone(), peer);
                while let Some((from, bytes)) = inlet.recv().await {
                    self.datagram(from.socket(), &bytes, &out);
                }
            }
        }
    }

    fn datagram(&mut self, from: SocketAddr, bytes: &[u8], out: &impl Fn(LoopbackAddr) -> Outlet) {
        let inside = self.settings.own.is_host_of(from);
        if !inside {
            SessionCounters::add(&self.settings.counters.outsiders);
        }
        let settings = if inside { &self.settings } else { &self.outside };
        let counters = &settings.counters;
        // A peer with state needs no cookie: the exchange only guards the creation of state.
        if let Some(inlet) = self.peers.get(&from) {
            match inlet.try_send(bytes.to_vec()) {
                Ok(()) => return,
                Err(mpsc::error::TrySendError::Full(_)) => return SessionCounters::add(&counters.overflowed),
                // Its association is over, so this datagram may open the next: it is judged as an unknown peer's.
                Err(mpsc::error::TrySendError::Closed(_)) => {
                    self.peers.remove(&from);
                }
            }
        }
        let Ok(peer) = LoopbackAddr::try_from(from) else {
            note(settings, bytes, Verdict::UnknownPeer, None);
            return SessionCounters::add(&counters.unknown_peers);
        };
        self.shaking.retain(|shaking| !shaking.over.load(Ordering::Relaxed));
        match self.exchange.judge(from, bytes, self.shaking.len(), Instant::now()) {
            Answer::Admit => {
                let settings = settings.clone();
                self.admit(peer, bytes, out(peer), settings);
            }
            Answer::Challenge(challenge) => {
                note(settings, bytes, Verdict::Unproven, None);
                SessionCounters::add(&counters.unproven);
                out(peer).emit(&challenge);
            }
            Answer::Prove => {
                note(settings, bytes, Verdict::Passed, None);
                SessionCounters::add(&counters.proved);
            }
            Answer::Refuse(verdict) => {
                note(settings, bytes, verdict, None);
                SessionCounters::add(&counters.unknown_peers);
            }
        }
    }

    /// Makes room for one more handshake: displaces the oldest, when too many are open. False when there are too many
    /// sessions.
    fn make_room(&mut self) -> bool {
        // The first to set `over` decides: the task of a completed handshake has set it, so no session is displaced.
        if self.shaking.len() >= HALF_OPEN
            && let Some(oldest) = self.shaking.pop_front()
            && !oldest.over.swap(true, Ordering::AcqRel)
        {
            oldest.task.abort();
            self.peers.remove(&oldest.peer.socket());
            note(&oldest.settings, &oldest.hello, Verdict::Unfinished, None);
            SessionCounters::add(&oldest.settings.counters.displaced);
        }
        // The entry of an ended session stays until its peer sends again or room is needed.
        if self.peers.len() >= PEERS {
            self.peers.retain(|_, inlet| !inlet.is_closed());
        }
        self.peers.len() < PEERS
    }

    fn admit(&mut self, peer: LoopbackAddr, hello: &[u8], out: Outlet, settings: Settings) {
        let (inlet, datagrams) = mpsc::channel(INLET);
        if !self.make_room() || inlet.try_send(hello.to_vec()).is_err() {
            note(&settings, hello, Verdict::Shed, None);
            return SessionCounters::add(&settings.counters.shed);
        }
        self.peers.insert(peer.socket(), inlet);
        let path = Arc::new(Path::new(datagrams, out).counted(settings.counters.clone()));
        let (credential, events, serving) = (self.credential.clone(), self.events.clone(), settings.clone());
        let over = Arc::new(AtomicBool::new(false));
        let (done, opener) = (over.clone(), hello.to_vec());
        let task = tokio::spawn(async move {
            let session = serving.next_session();
            let guard = serving.guard(session.0);
            let opened = server(path, &credential, serving.revocations.clone(), guard).await;
            // Displaced in the meantime: `make_room` has counted it.
            if done.swap(true, Ordering::AcqRel) {
                return;
            }
            match opened {
                Ok(secure) => serve(secure, session, &serving, &events).await,
                Err(error) => {
                    SessionCounters::add(&serving.counters.failed);
                    note(&serving, &opener, Verdict::Unfinished, error.fault());
                    tracing::debug!(%error, %peer, "session not accepted");
                }
            }
        });
        self.shaking.push_back(Shaking { peer, hello: hello.to_vec(), over, task: task.abort_handle(), settings });
        self.settings.counters.peak(self.shaking.len(), self.peers.len());
    }
}

/// Reports the outcome of a datagram that belongs to no association, and the fault, where its sender was refused.
fn note(settings: &Settings, bytes: &[u8], verdict: Verdict, fault: Option<Fault>) {
    if let Some(log) = &settings.log {
        log.unknown_peer(bytes, verdict, fault, &settings.counters.guard);
    }
}
