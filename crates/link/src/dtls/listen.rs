//! Accepts sessions on one socket: a loop that never waits for any peer.
//!
//! The library's own listener runs a handshake inside its accept loop, so one silent ClientHello shuts everybody out.
//! Here each peer address has a bounded queue and a task; handshakes under way and sessions are bounded, and what is
//! beyond the bounds is shed and counted. A peer's state is made before its cookie is checked, so a stream of
//! ClientHellos from many ports can keep *new* sessions out while it lasts; established ones are not touched.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use tokio::net::UdpSocket;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tokio::task::JoinHandle;

use super::path::{INLET, Outlet, Path};
use super::session::{SessionCounters, SessionEvent, Settings, serve};
use super::{DATAGRAM, DtlsError, server};
use crate::guard::hello;
use crate::guard::observe::Verdict;
use crate::loopback::LoopbackAddr;
use crate::pki::Credential;
use crate::sockets;
use crate::vet::Fault;

/// Handshakes that may be under way at once.
pub const HALF_OPEN: usize = 64;

/// Peer addresses that may have state at once.
pub const PEERS: usize = 256;

/// A socket that accepts sessions until this is dropped. Sessions already open go on.
pub struct Listener {
    local: LoopbackAddr,
    task: JoinHandle<()>,
}

impl Listener {
    /// Where it listens.
    pub fn local(&self) -> LoopbackAddr {
        self.local
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// Listens at `at`. Must be called inside a tokio runtime.
///
/// # Errors
/// When the socket cannot be bound to the loopback interface.
pub fn listen(
    at: LoopbackAddr,
    credential: Credential,
    settings: Settings,
    events: mpsc::Sender<SessionEvent>,
) -> Result<Listener, DtlsError> {
    let socket = Arc::new(sockets::udp(at)?);
    let local = LoopbackAddr::try_from(socket.local_addr()?)?;
    let accept = Accept {
        socket,
        credential: Arc::new(credential),
        settings,
        events,
        half_open: Arc::new(Semaphore::new(HALF_OPEN)),
        peers: BTreeMap::new(),
    };
    Ok(Listener { local, task: tokio::spawn(accept.run()) })
}

struct Accept {
    socket: Arc<UdpSocket>,
    credential: Arc<Credential>,
    settings: Settings,
    events: mpsc::Sender<SessionEvent>,
    half_open: Arc<Semaphore>,
    peers: BTreeMap<SocketAddr, mpsc::Sender<Vec<u8>>>,
}

impl Accept {
    async fn run(mut self) {
        let mut buf = vec![0; DATAGRAM];
        loop {
            match self.socket.recv_from(&mut buf).await {
                Ok((n, from)) => self.datagram(from, &buf[..n]),
                Err(error) => {
                    tracing::trace!(%error, "datagram not received");
                    tokio::time::sleep(Duration::from_millis(1)).await;
                }
            }
        }
    }

    fn datagram(&mut self, from: SocketAddr, bytes: &[u8]) {
        let counters = &self.settings.counters;
        if let Some(inlet) = self.peers.get(&from) {
            match inlet.try_send(bytes.to_vec()) {
                Ok(()) => return,
                Err(mpsc::error::TrySendError::Full(_)) => return SessionCounters::add(&counters.overflowed),
                Err(mpsc::error::TrySendError::Closed(_)) => {
                    self.peers.remove(&from);
                }
            }
        }
        let verdict = hello::at_the_door(bytes);
        let opener = LoopbackAddr::try_from(from).ok().filter(|_| verdict == Verdict::Passed);
        let Some(peer) = opener else {
            note(&self.settings, bytes, verdict, None);
            return SessionCounters::add(&self.settings.counters.strangers);
        };
        match self.room() {
            Some(permit) => self.admit(peer, bytes, permit),
            None => {
                note(&self.settings, bytes, Verdict::Shed, None);
                SessionCounters::add(&self.settings.counters.shed);
            }
        }
    }

    /// Room for one more handshake; forgets peers that have gone when there seems to be none.
    fn room(&mut self) -> Option<OwnedSemaphorePermit> {
        if self.peers.len() >= PEERS {
            self.peers.retain(|_, inlet| !inlet.is_closed());
        }
        if self.peers.len() >= PEERS {
            return None;
        }
        self.half_open.clone().try_acquire_owned().ok()
    }

    fn admit(&mut self, peer: LoopbackAddr, hello: &[u8], permit: OwnedSemaphorePermit) {
        let (inlet, datagrams) = mpsc::channel(INLET);
        if inlet.try_send(hello.to_vec()).is_err() {
            return;
        }
        self.peers.insert(peer.socket(), inlet);
        let path = Path::new(datagrams, Outlet::Socket(self.socket.clone(), peer));
        let path = Arc::new(path.counted(self.settings.counters.clone(), false));
        let (credential, settings, events) = (self.credential.clone(), self.settings.clone(), self.events.clone());
        let hello = hello.to_vec();
        tokio::spawn(async move {
            let session = settings.next_session();
            let opened = server(path, &credential, settings.revocations.clone(), settings.guard(session.0)).await;
            drop(permit);
            match opened {
                Ok(secure) => serve(secure, session, &settings, &events).await,
                Err(error) => {
                    SessionCounters::add(&settings.counters.failed);
                    note(&settings, &hello, Verdict::Unfinished, error.fault());
                    tracing::debug!(%error, %peer, "session not accepted");
                }
            }
        });
    }
}

/// Reports what became of a datagram that belongs to no association.
fn note(settings: &Settings, bytes: &[u8], verdict: Verdict, fault: Option<Fault>) {
    if let Some(log) = &settings.log {
        log.unknown_peer(bytes, verdict, fault, &settings.counters.guard);
    }
}
