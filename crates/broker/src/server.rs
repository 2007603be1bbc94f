//! The live broker: TLS front and bounds of this crate around the packet handling and routing of `mqtt5`.
//!
//! The broker listens on a loopback port that the system chooses. Each connection is counted, handshaken under a time
//! limit, tied to the identity in its certificate, and given its own [`crate::gate`]. All state is in memory and dies
//! with the session; no message is retained, there are no `$SYS` topics, and every queue has a bound.
//!
//! Not used on purpose: the server of `mqtt5` itself, which trusts the client id, accepts TLS 1.2 and handshakes
//! inside its accept loop. The meaning of a publication is left to the services; the log and the end of the process to
//! [`crate::process`].

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::Duration;

use link::certificates::list::Revocations;
use link::certificates::{CertificateVerifier, Fault, Presenter, Refused};
use link::loopback::{AddressRefused, LoopbackAddr};
use link::pki::{Credential, PkiError, remaining_life};
use link::stream::{StreamLog, watched};
use mqtt5::broker::client_handler::ClientHandler;
use mqtt5::broker::config::BrokerConfig;
use mqtt5::broker::resource_monitor::{ResourceLimits, ResourceMonitor};
use mqtt5::broker::router::MessageRouter;
use mqtt5::broker::storage::client_queue::QueueLimits;
use mqtt5::broker::storage::{DynamicStorage, MemoryBackend};
use mqtt5::broker::sys_topics::BrokerStats;
use mqtt5::broker::tls_acceptor::TlsStreamWrapper;
use mqtt5::broker::transport::BrokerTransport;
use rustls::pki_types::CertificateDer;
use thiserror::Error;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, broadcast, mpsc};
use tokio::task::{JoinHandle, JoinSet};
use tokio_rustls::TlsAcceptor;
use wire::id::{ByPeer, PeerId};
use wire::policy::Requirement;

use crate::gate::{Denial, Event, Events, Gate, OpenSessions};
use crate::tls;

/// The largest MQTT packet, in bytes; above the largest payload that `link::mqtt` sends.
pub const MAX_PACKET: usize = 16 * 1024;
/// The most messages that wait for one slow subscriber.
pub const MAX_QUEUED: usize = 64;
/// The most bytes that wait for one slow subscriber.
pub const MAX_QUEUED_BYTES: usize = 256 * 1024;
/// The most unacknowledged publications in each direction of a session.
pub const MAX_IN_FLIGHT: u16 = 16;
/// The most messages that one identity may publish in a second.
pub const MAX_MESSAGES_PER_SECOND: u32 = 4_000;
/// The most payload bytes that one identity may publish in a second.
pub const MAX_BYTES_PER_SECOND: u64 = 2 * 1024 * 1024;
/// The most filters in one session.
pub const MAX_SUBSCRIPTIONS: usize = 8;
/// The most connections with one certificate: the session and one that takes it over.
pub const MAX_CONNECTIONS_OF_PEER: usize = 2;
/// The most events that wait to be read.
pub const MAX_EVENTS: usize = 1024;

const SWEEP: Duration = Duration::from_secs(1);
const DRAIN_LIMIT: Duration = Duration::from_secs(1);
const ACCEPT_PAUSE: Duration = Duration::from_millis(10);

/// The bounds that a test may want to move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ServerLimits {
    /// The most connections at once, half-open ones included.
    pub connections: usize,
    /// Longest time that a TLS handshake may take.
    pub handshake: Duration,
    /// State of the table of rights: the policy's `Check::Rights`.
    pub rights: Requirement,
}

impl Default for ServerLimits {
    fn default() -> Self {
        Self { connections: 32, handshake: Duration::from_secs(3), rights: Requirement::Required }
    }
}

/// Reason that the live broker did not start.
#[derive(Debug, Error)]
pub enum StartError {
    /// No loopback port.
    #[error("cannot listen on loopback: {0}")]
    Listen(#[from] io::Error),
    /// The bound socket says that it is somewhere else.
    #[error("bound off loopback: {0}")]
    Address(#[from] AddressRefused),
    /// The credential does not make a TLS server.
    #[error("cannot serve TLS with this credential: {0}")]
    Tls(#[from] PkiError),
}

/// A running broker. To drop it ends it as [`Server::stop`] does, without waiting.
pub struct Server {
    address: LoopbackAddr,
    events: mpsc::Receiver<Event>,
    lost: Arc<AtomicU64>,
    stop: broadcast::Sender<()>,
    task: Option<JoinHandle<()>>,
    revocations: Revocations,
}

impl Server {
    /// Listens at `at` (port 0 lets the system choose) and serves from then on; arrivals on its streams are reported to
    /// `log`.
    ///
    /// # Errors
    /// The port cannot be had, or the credential is no good.
    pub async fn start(
        at: LoopbackAddr,
        credential: &Credential,
        limits: ServerLimits,
        log: StreamLog,
    ) -> Result<Self, StartError> {
        let revocations = Revocations::from_credential(credential).map_err(PkiError::from)?;
        let trust = Trust {
            acceptor: tls::acceptor(credential, &revocations)?,
            verifier: CertificateVerifier::new(credential, &revocations)?,
            revocations: revocations.clone(),
        };
        let listener = TcpListener::bind(at.socket()).await?;
        let address = LoopbackAddr::try_from(listener.local_addr()?)?;
        let (noted, events) = Events::queue(MAX_EVENTS);
        let lost = noted.lost();
        let (stop, stopped) = broadcast::channel(1);
        let front = Arc::new(Front::new(trust, limits, noted, log, stop.clone()));
        let task = Some(tokio::spawn(accept(listener, front, stopped)));
        Ok(Self { address, events, lost, stop, task, revocations })
    }

    /// Address at which it listens.
    pub fn address(&self) -> LoopbackAddr {
        self.address
    }

    /// The revocation list that it asks; a newer one ends the sessions of those on it.
    pub fn revocations(&self) -> &Revocations {
        &self.revocations
    }

    /// The next event; `None` when the broker has ended and all have been read.
    pub async fn event(&mut self) -> Option<Event> {
        self.events.recv().await
    }

    /// Number of events not reported: there was no reader, or one connection made too many.
    pub fn lost_events(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Closes the port, says goodbye to every client and waits until all connections have ended. The events that are
    /// left can still be read.
    pub async fn stop(&mut self) {
        // Nobody hears it when the accept loop has ended already.
        let _ = self.stop.send(());
        if let Some(task) = self.task.take() {
            report(task.await);
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.stop.send(());
    }
}

/// Authority and revocations by which clients are authenticated.
struct Trust {
    acceptor: TlsAcceptor,
    verifier: CertificateVerifier,
    revocations: Revocations,
}

/// State shared by all connections.
struct Front {
    trust: Trust,
    limits: ServerLimits,
    events: Events,
    log: StreamLog,
    stop: broadcast::Sender<()>,
    connections: Arc<Semaphore>,
    of_peer: ByPeer<Arc<Semaphore>>,
    open: OpenSessions,
    config: Arc<BrokerConfig>,
    storage: Arc<DynamicStorage>,
    router: Arc<MessageRouter>,
    stats: Arc<BrokerStats>,
    monitor: Arc<ResourceMonitor>,
}

impl Front {
    fn new(trust: Trust, limits: ServerLimits, events: Events, log: StreamLog, stop: broadcast::Sender<()>) -> Self {
        let queue = QueueLimits { max_messages: MAX_QUEUED, max_bytes: MAX_QUEUED_BYTES };
        let storage = Arc::new(DynamicStorage::Memory(MemoryBackend::with_queue_limits(queue)));
        Self {
            trust,
            limits,
            events,
            log,
            stop,
            connections: Arc::new(Semaphore::new(limits.connections)),
            of_peer: ByPeer::new(|| Arc::new(Semaphore::new(MAX_CONNECTIONS_OF_PEER))),
            open: Arc::new(ByPeer::new(|| AtomicU32::new(0))),
            config: Arc::new(bounds(limits)),
            router: Arc::new(MessageRouter::with_storage(Arc::clone(&storage))),
            storage,
            stats: Arc::new(BrokerStats::new()),
            monitor: Arc::new(ResourceMonitor::new(rates(limits))),
        }
    }
}

/// The bounds on packets, queues and features.
fn bounds(limits: ServerLimits) -> BrokerConfig {
    BrokerConfig {
        bind_addresses: Vec::new(),
        max_clients: limits.connections,
        session_expiry_interval: Duration::ZERO,
        max_packet_size: MAX_PACKET,
        topic_alias_maximum: 0,
        retain_available: false,
        maximum_qos: 1,
        subscription_identifier_available: false,
        shared_subscription_available: false,
        max_subscriptions_per_client: MAX_SUBSCRIPTIONS,
        client_channel_capacity: MAX_QUEUED,
        max_outbound_inflight: MAX_IN_FLIGHT,
        server_receive_maximum: Some(MAX_IN_FLIGHT),
        sys_topics_enabled: false,
        ..BrokerConfig::default()
    }
}

/// The bounds on rates. The library asks only for the bounds on messages and bytes; connections are counted by
/// [`admit`].
fn rates(limits: ServerLimits) -> ResourceLimits {
    ResourceLimits {
        max_connections: limits.connections,
        max_connections_per_ip: limits.connections,
        max_message_rate_per_client: MAX_MESSAGES_PER_SECOND,
        max_bandwidth_per_client: MAX_BYTES_PER_SECOND,
        rate_limit_window: Duration::from_secs(1),
        ..ResourceLimits::default()
    }
}

async fn accept(listener: TcpListener, front: Arc<Front>, mut stop: broadcast::Receiver<()>) {
    let mut connections = JoinSet::new();
    let mut sweep = tokio::time::interval(SWEEP);
    loop {
        tokio::select! {
            _ = stop.recv() => break,
            _ = sweep.tick() => front.router.sweep_sessions().await,
            Some(ended) = connections.join_next(), if !connections.is_empty() => report(ended),
            accepted = listener.accept() => match accepted {
                Ok((stream, from)) => admit(&mut connections, &front, stream, from),
                Err(error) => {
                    tracing::warn!(%error, "no connection accepted");
                    tokio::time::sleep(ACCEPT_PAUSE).await;
                }
            },
        }
    }
    drop(listener);
    let drain = async {
        while let Some(ended) = connections.join_next().await {
            report(ended);
        }
    };
    if tokio::time::timeout(DRAIN_LIMIT, drain).await.is_err() {
        tracing::warn!(left = connections.len(), "connections did not end in time");
        connections.shutdown().await;
    }
}

/// Reports a task that did not end by returning: a defect.
fn report(ended: Result<(), tokio::task::JoinError>) {
    if let Err(error) = ended {
        tracing::error!(%error, "a task failed");
    }
}

/// Counts a connection and serves it in its own task: a silent peer delays no other.
fn admit(connections: &mut JoinSet<()>, front: &Arc<Front>, stream: TcpStream, from: SocketAddr) {
    let Ok(permit) = Arc::clone(&front.connections).try_acquire_owned() else {
        front.events.note(Event::Denied(Denial::Connections { expected: front.limits.connections }));
        return;
    };
    let stop = front.stop.subscribe();
    let front = Arc::clone(front);
    connections.spawn(async move {
        let served = serve(&front, stream, from, stop).await;
        drop(permit);
        match served {
            Ok(Some(peer)) => front.events.note(Event::Closed { peer }),
            Ok(None) => {}
            Err(denial) => front.events.note(Event::Denied(denial)),
        }
    });
}

/// Serves one connection to its end and gives the peer of its session, if it came to one.
async fn serve(
    front: &Front,
    stream: TcpStream,
    from: SocketAddr,
    mut stop: broadcast::Receiver<()>,
) -> Result<Option<PeerId>, Denial> {
    let failed = |error: io::Error| Denial::Handshake(refused(&error));
    stream.set_nodelay(true).map_err(failed)?;
    let (stream, witness) = watched(stream, front.log.clone()).map_err(failed)?;
    let handshake = tokio::time::timeout(front.limits.handshake, front.trust.acceptor.accept(stream));
    let stream = tokio::select! {
        _ = stop.recv() => return Ok(None),
        done = handshake => match done {
            Ok(Ok(stream)) => stream,
            Ok(Err(error)) => {
                witness.failed(&error);
                return Err(failed(error));
            }
            Err(_) => return Err(Denial::HandshakeTimeout),
        },
    };
    let peer = tls::principal(stream.get_ref().1.peer_certificates())?;
    // Only the certificate tells whose connection this is, so the bound of an identity comes after the handshake; until
    // then the bound on all connections and the time limit hold.
    let Ok(_slot) = Arc::clone(&front.of_peer[peer]).try_acquire_owned() else {
        return Err(Denial::ConnectionsOfPeer { peer, expected: MAX_CONNECTIONS_OF_PEER });
    };
    let chain: Vec<_> = stream.get_ref().1.peer_certificates().unwrap_or_default().to_vec();
    let gate = Arc::new(Gate::new(peer, front.limits.rights, front.events.clone(), Arc::clone(&front.open)));
    let (end, ended) = broadcast::channel(1);
    let session = ClientHandler::new(
        BrokerTransport::tls(TlsStreamWrapper::new(stream)),
        from,
        Arc::clone(&front.config),
        Arc::clone(&front.router),
        gate.clone(),
        Some(Arc::clone(&front.storage)),
        Arc::clone(&front.stats),
        Arc::clone(&front.monitor),
        ended,
    );
    let session = session.run();
    tokio::pin!(session);
    let dismissed = tokio::select! {
        outcome = &mut session => {
            if let Err(error) = outcome {
                tracing::debug!(%peer, %error, "session ended");
            }
            None
        }
        _ = stop.recv() => None,
        refused = front.trust.dismissal(&chain) => Some(refused),
    };
    // Nobody hears it when the session has ended already; else it says goodbye and unsubscribes.
    if end.send(()).is_ok() && tokio::time::timeout(DRAIN_LIMIT, session).await.is_err() {
        tracing::debug!(%peer, "a session did not end in time");
    }
    if let Some(refused) = dismissed {
        front.events.note(Event::Denied(Denial::Dismissed { peer, refused }));
    }
    Ok(gate.admitted())
}

impl Trust {
    /// Returns once a certificate that has passed passes no longer: it has ended, or is on a newer list.
    async fn dismissal(&self, chain: &[CertificateDer<'_>]) -> Refused {
        let life = chain.first().and_then(|leaf| remaining_life(leaf).ok()).unwrap_or_default();
        let lifetime = tokio::time::sleep(life);
        tokio::pin!(lifetime);
        let mut list = self.revocations.watch();
        loop {
            tokio::select! {
                () = &mut lifetime => return Refused { fault: Fault::Expired, got: "a certificate that has ended".to_owned() },
                () = list.changed() => {}
            }
            if let Err(refused) = self.verifier.check(chain, Presenter::Dialler) {
                return refused;
            }
        }
    }
}

/// Reason for which a handshake failed. An error that the TLS stack did not name counts as a broken handshake.
fn refused(error: &io::Error) -> Refused {
    let cause = error.get_ref().and_then(|inner| inner.downcast_ref::<rustls::Error>());
    Refused { fault: cause.map_or(Fault::Handshake, Fault::from_tls), got: error.to_string() }
}
