//! A listener with its cookie exchange, in memory and paused time: honest peers, and unknown ones by the thousand.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use tokio::runtime::Runtime;
use tokio::sync::mpsc;
use tokio::time::Instant;
use wire::id::{PeerId, SessionId};

use super::{ROOM, lock};
use crate::certificates::list::Revocations;
use crate::dtls::listen::{Listener, Port, accept};
use crate::dtls::path::{INLET, Outlet, Path};
use crate::dtls::session::{SessionCounters, SessionEvent, SessionHandle, SessionStats, Settings};
use crate::dtls::{DtlsError, Secure, client};
use crate::guard::observe::{Observation, ObservationLog};
use crate::guard::{GuardMode, hello};
use crate::loopback::LoopbackAddr;
use crate::pki::{Credential, PkiError};

/// Observations, and answers to unknown peers, that may wait to be read.
const BACKLOG: usize = 1 << 16;

/// Time limit of an honest record: the platform's freshness bound.
const FRESH: Duration = Duration::from_millis(300);

/// Time between two honest records of the standing guest.
const EVERY: Duration = Duration::from_millis(100);

/// The ports of honest peers; unknown peers have higher ports.
const GUESTS: [u16; 2] = [1, 2];

/// The first port of an unknown peer.
const UNKNOWN_PEERS: u16 = 1000;

/// Behaviour of unknown peers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crowd {
    /// They stay silent, whatever the answer.
    Silent,
    /// They answer the cookie request, begin again, and then stay silent.
    Proving,
}

/// Result.
#[derive(Debug)]
pub struct Stormed {
    /// The listener's counters.
    pub stats: SessionStats,
    /// Its observations of every record and unknown peer.
    pub seen: Vec<Observation>,
    /// Unknown peers' datagrams as they were put in, the proofs among them.
    pub put: Vec<Vec<u8>>,
    /// Honest records sent during the storm, and the number delivered in time.
    pub honest: (u64, u64),
    /// Time in which an honest newcomer opened a session during the storm; `None` if it did not.
    pub newcomer: Option<Duration>,
}

/// Answers on their way to unknown peers.
type Strays = Arc<Mutex<Vec<(LoopbackAddr, Vec<u8>)>>>;

struct InMemoryListener {
    inlet: mpsc::Sender<(LoopbackAddr, Vec<u8>)>,
    homes: BTreeMap<LoopbackAddr, mpsc::Receiver<Vec<u8>>>,
    events: mpsc::Receiver<SessionEvent>,
    strays: Strays,
    _listener: Listener,
}

/// Sends `datagrams` to the listener of `gateway`, each from another port and `every` after the one before, while
/// `standing` has a session and `newcomer` opens one.
///
/// # Errors
/// When a credential is unusable, no runtime can be made, or `standing` gets no session before the storm.
pub fn storm(
    gateway: &Credential,
    [standing, newcomer]: [(&Credential, PeerId); 2],
    datagrams: &[Vec<u8>],
    every: Duration,
    crowd: Crowd,
) -> Result<Stormed, DtlsError> {
    crate::crypto::init();
    let runtime: Runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build()?;
    let (log, mut observations) = ObservationLog::new(BACKLOG);
    let held = Revocations::from_credential(gateway).map_err(PkiError::from)?;
    let settings = Settings { log: Some(log), ..Settings::new(GuardMode::Required, Duration::from_secs(60), held) };
    let counters = settings.counters.clone();
    runtime.block_on(async {
        let mut listening = open(gateway, settings)?;
        let first = listening.guest(0, standing.0, standing.1).await?;
        let up = listening.opened().await.ok_or(DtlsError::TooSlow)?;
        let raging =
            tokio::spawn(rage(listening.inlet.clone(), listening.strays.clone(), datagrams.to_vec(), every, crowd));
        let length = every.saturating_mul(datagrams.len() as u32);
        let begun = Instant::now();
        let (mut sent, mut out, mut took, mut guests) = (0, 0, None, Vec::new());
        let mut newcomer_dialled = false;
        while begun.elapsed() < length || !newcomer_dialled {
            sent += 2;
            out += listening.exchange(&first, &up).await;
            if begun.elapsed() >= length / 2 && !newcomer_dialled {
                newcomer_dialled = true;
                let dialled = Instant::now();
                if let Ok(guest) = listening.guest(1, newcomer.0, newcomer.1).await {
                    took = Some(dialled.elapsed());
                    guests.push(guest);
                }
            }
            tokio::time::sleep(EVERY).await;
        }
        let put = raging.await.unwrap_or_default();
        let seen = std::iter::from_fn(|| observations.try_recv().ok()).collect();
        Ok(Stormed { stats: counters.read(), seen, put, honest: (sent, out), newcomer: took })
    })
}

fn open(gateway: &Credential, settings: Settings) -> Result<InMemoryListener, DtlsError> {
    let (inlet, to_hall) = mpsc::channel(ROOM);
    let (from_hall, mut answers) = mpsc::channel::<(LoopbackAddr, Vec<u8>)>(ROOM);
    let (to_events, events) = mpsc::channel(ROOM);
    let port = Port::Memory(to_hall, from_hall);
    let listener = accept(LoopbackAddr::ANY_PORT, port, gateway.clone(), settings, to_events)?;
    let (mut outlets, mut homes) = (BTreeMap::new(), BTreeMap::new());
    for port in GUESTS {
        let (outlet, home) = mpsc::channel(INLET);
        outlets.insert(LoopbackAddr::on_port(port), outlet);
        homes.insert(LoopbackAddr::on_port(port), home);
    }
    let strays = Strays::default();
    let collected = strays.clone();
    tokio::spawn(async move {
        while let Some((to, bytes)) = answers.recv().await {
            if let Some(outlet) = outlets.get(&to) {
                // As in UDP, a datagram without room is lost.
                if outlet.try_send(bytes).is_err() {
                    tracing::trace!("an answer in memory found no room");
                }
            } else if lock(&collected).len() < BACKLOG {
                lock(&collected).push((to, bytes));
            }
        }
    });
    Ok(InMemoryListener { inlet, homes, events, strays, _listener: listener })
}

impl InMemoryListener {
    /// An honest dialler at one of the guests' ports.
    async fn guest(&mut self, n: usize, credential: &Credential, gateway: PeerId) -> Result<Secure, DtlsError> {
        let address = LoopbackAddr::on_port(GUESTS[n]);
        let home = self.homes.remove(&address).ok_or(DtlsError::TooSlow)?;
        let held = Revocations::from_credential(credential).map_err(PkiError::from)?;
        let outlet = Outlet::Port(self.inlet.clone(), address);
        let path = Path::new(home, outlet).dialling(Arc::new(SessionCounters::default()));
        let settings = Settings::new(GuardMode::Required, Duration::from_secs(60), held.clone());
        client(Arc::new(path), credential, gateway, held, settings.guard(1)).await
    }

    async fn opened(&mut self) -> Option<SessionHandle> {
        while let Some(event) = self.events.recv().await {
            if let SessionEvent::Opened(handle) = event {
                return Some(handle);
            }
        }
        None
    }

    /// Sends one record each way; returns the number delivered in time.
    async fn exchange(&mut self, guest: &Secure, handle: &SessionHandle) -> u64 {
        let mut out = 0;
        if guest.send(b"up").await.is_ok()
            && let Ok(true) = tokio::time::timeout(FRESH, self.record(handle.session)).await
        {
            out += 1;
        }
        if handle.send(b"down".to_vec())
            && let Ok(Ok(_)) = tokio::time::timeout(FRESH, guest.recv()).await
        {
            out += 1;
        }
        out
    }

    async fn record(&mut self, expected: SessionId) -> bool {
        while let Some(event) = self.events.recv().await {
            if let SessionEvent::Record(session, _) = event
                && session == expected
            {
                return true;
            }
        }
        false
    }
}

/// The unknown peers; returns the datagrams they sent.
async fn rage(
    inlet: mpsc::Sender<(LoopbackAddr, Vec<u8>)>,
    strays: Strays,
    datagrams: Vec<Vec<u8>>,
    every: Duration,
    crowd: Crowd,
) -> Vec<Vec<u8>> {
    let mut put = Vec::new();
    let mut say = |from: LoopbackAddr, bytes: Vec<u8>| {
        if inlet.try_send((from, bytes.clone())).is_ok() {
            put.push(bytes);
        }
    };
    for (n, datagram) in datagrams.iter().enumerate() {
        say(LoopbackAddr::on_port(UNKNOWN_PEERS.saturating_add(n as u16)), datagram.clone());
        tokio::time::sleep(every).await;
        for (from, answer) in std::mem::take(&mut *lock(&strays)) {
            let first = datagrams.get(usize::from(from.port().saturating_sub(UNKNOWN_PEERS)));
            if let (Crowd::Proving, Some(first), Some(cookie)) = (crowd, first, hello::requested_cookie(&answer))
                && let Some(proof) = hello::with_cookie(first, cookie)
            {
                say(from, proof);
                say(from, first.clone());
            }
        }
    }
    put
}

/// The first datagram of an honest handshake of `credential`'s holder.
///
/// # Errors
/// When the credential is unusable or no runtime can be made.
pub fn genuine_hello(credential: &Credential, gateway: PeerId) -> Result<Vec<u8>, DtlsError> {
    crate::crypto::init();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build()?;
    runtime.block_on(async {
        let (_into, home) = mpsc::channel(1);
        let (out, mut left) = mpsc::channel(8);
        let held = Revocations::from_credential(credential).map_err(PkiError::from)?;
        let path = Path::new(home, Outlet::Memory(out));
        let settings = Settings::new(GuardMode::Required, Duration::from_secs(60), held.clone());
        let dialling = client(Arc::new(path), credential, gateway, held, settings.guard(1));
        tokio::select! {
            outcome = dialling => Err(outcome.err().unwrap_or(DtlsError::TooSlow)),
            Some(hello) = left.recv() => Ok(hello),
        }
    })
}
