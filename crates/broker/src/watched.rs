//! The live broker between two real clients, with a passive observer on the paths of both who reads every byte.
//!
//! Broker and clients are as in a live run, over loopback at ports that the system chooses: the MQTT library takes only
//! a socket. No step waits for time to pass: each publication is delivered before the next is made. Conclusions that
//! the observer may draw are left to the caller (`stacks`).

use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use ground_truth::{Sight, StreamPlace};
use link::certificates::list::Revocations;
use link::loopback::LoopbackAddr;
use link::mqtt::Mqtt;
use link::pki::{Credential, PkiError};
use link::relay::StreamRelay;
use link::spec::RelayLeg;
use link::stream::StreamLog;
use link::witness::StreamSight;
use rustls::{ClientConfig, KeyLog};
use tokio::sync::mpsc;
use wire::core::{Input, Side, Subject};
use wire::event::wire_hash;
use wire::id::{PeerId, UnitId};

use crate::server::{Server, ServerLimits, StartError};

/// Longest wall time of a whole exchange; one that takes longer is given up.
const LIMIT: Duration = Duration::from_secs(20);
/// Pieces and publications that may wait.
const ROOM: usize = 256;
/// Sights of the ends' ingress that are kept.
const SIGHTS: usize = 4096;

/// Reason for which an exchange did not come about.
#[derive(Debug, thiserror::Error)]
pub enum WatchError {
    /// The broker did not start.
    #[error(transparent)]
    Start(#[from] StartError),
    /// A credential is unusable.
    #[error(transparent)]
    Pki(#[from] PkiError),
    /// No socket or runtime.
    #[error("sockets: {0}")]
    Io(#[from] std::io::Error),
    /// A client was not admitted, or a publication did not come out.
    #[error("the exchange over the broker came to no end")]
    Unfinished,
}

/// Certificates of the participants, and the unit among them.
pub struct Papers {
    /// Certificate and key of the broker.
    pub broker: Credential,
    /// Certificate and key of the gateway.
    pub gateway: Credential,
    /// Certificate and key of the unit.
    pub unit: Credential,
    /// The unit that takes part.
    pub who: UnitId,
}

/// Bytes in one direction of a connection, as the observer saw them.
#[derive(Clone, Debug)]
pub struct Seen {
    /// Client of the connection.
    pub client: PeerId,
    /// End of the connection that sent the bytes.
    pub from: Side,
    /// Every byte, in order.
    pub bytes: Vec<u8>,
    /// True if the ingress of the other end was given these bytes, all of them and no others.
    pub arrived: bool,
}

/// Result of an exchange.
#[derive(Debug)]
pub struct Watched {
    /// Bytes that the observer saw, each direction of each connection.
    pub seen: Vec<Seen>,
    /// Messages that came out at the far ends, in the order in which they were published.
    pub delivered: Vec<Vec<u8>>,
    /// The secrets of both sessions.
    pub secrets: Vec<Vec<u8>>,
}

/// Publishes `publications` one after the other, orders as the gateway and acknowledgements as the unit.
///
/// # Errors
/// When something of it does not start, or a publication does not come out.
pub fn watch(papers: &Papers, publications: &[(Subject, Vec<u8>)]) -> Result<Watched, WatchError> {
    link::crypto::init();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        let exchanged = tokio::time::timeout(LIMIT, exchange(papers, publications));
        exchanged.await.map_err(|_| WatchError::Unfinished)?
    })
}

async fn exchange(papers: &Papers, publications: &[(Subject, Vec<u8>)]) -> Result<Watched, WatchError> {
    let (log, sights) = StreamLog::to_listener(SIGHTS);
    let mut server =
        Server::start(LoopbackAddr::ANY_PORT, &papers.broker, ServerLimits::default(), log.clone()).await?;
    let secrets = Secrets::default();
    let unit = PeerId::from_name(papers.who.name()).ok_or(WatchError::Unfinished)?;
    let start = |peer, credential, subject| Client::start(peer, credential, subject, &server, &log, &secrets);
    let mut gateway = start(PeerId::GATEWAY, &papers.gateway, Subject::Ack(papers.who))?;
    let mut unit = start(unit, &papers.unit, Subject::Command(papers.who))?;
    while gateway.session.stats().subscribed.min(unit.session.stats().subscribed) == 0 {
        tokio::task::yield_now().await;
    }
    let mut delivered = Vec::new();
    for (subject, bytes) in publications {
        let (from, to) = match subject {
            Subject::Command(_) => (&gateway, &mut unit.heard),
            Subject::Ack(_) => (&unit, &mut gateway.heard),
        };
        from.session.publish(*subject, bytes.clone());
        let Some(Input::Published { bytes, .. }) = to.recv().await else { return Err(WatchError::Unfinished) };
        delivered.push(bytes);
    }
    let seen = settled([&gateway, &unit], &sights).await;
    drop((gateway, unit));
    server.stop().await;
    let secrets = lock(&secrets.0).clone();
    Ok(Watched { seen, delivered, secrets })
}

/// A client behind a watcher.
struct Client {
    who: PeerId,
    session: Mqtt,
    heard: mpsc::Receiver<Input>,
    seen: Bytes,
}

/// Bytes from the dialling and from the listening end.
type Bytes = Arc<Mutex<[Vec<u8>; 2]>>;

impl Client {
    fn start(
        who: PeerId,
        credential: &Credential,
        subject: Subject,
        server: &Server,
        log: &StreamLog,
        secrets: &Secrets,
    ) -> Result<Self, WatchError> {
        let revocations = Revocations::from_credential(credential).map_err(PkiError::from)?;
        let mut tls: ClientConfig = link::certificates::tls::client(credential, PeerId::BROKER, &revocations)?;
        tls.key_log = Arc::new(secrets.clone());
        let seen = Bytes::default();
        let address = watcher(server.address(), seen.clone())?;
        let (to, heard) = mpsc::channel(ROOM);
        let session = Mqtt::with_tls(tls, address, (who, PeerId::BROKER), vec![subject], log.clone(), to);
        Ok(Self { who, session, heard, seen })
    }
}

/// Opens a way to `upstream` on which every byte is kept as it passes; gives where it begins.
fn watcher(upstream: LoopbackAddr, seen: Bytes) -> Result<LoopbackAddr, WatchError> {
    let (to, mut passing) = mpsc::channel(ROOM);
    let relay = StreamRelay::open(RelayLeg { at: LoopbackAddr::ANY_PORT, upstream }, to)?;
    let address = relay.local();
    tokio::spawn(async move {
        while let Some(input) = passing.recv().await {
            if let Input::Stream { connection, side, bytes } = input {
                lock(&seen)[side as usize].extend_from_slice(&bytes);
                relay.emit(connection, side.opposite(), bytes);
            }
        }
    });
    Ok(address)
}

/// Waits until everything that was seen has arrived, and sets one against the other.
async fn settled(clients: [&Client; 2], sights: &Receiver<StreamSight>) -> Vec<Seen> {
    let mut told = Vec::new();
    loop {
        told.extend(sights.try_iter().filter(|sight| sight.sight == Sight::Arrived));
        let arrived: usize = told.iter().map(|sight| sight.length as usize).sum();
        let passed: usize = clients.iter().map(|client| lock(&client.seen).iter().map(Vec::len).sum::<usize>()).sum();
        if arrived == passed {
            break;
        }
        tokio::task::yield_now().await;
    }
    let mut all = Vec::new();
    for client in clients {
        for from in [Side::Client, Side::Server] {
            let bytes = lock(&client.seen)[from as usize].clone();
            all.push(Seen { client: client.who, from, arrived: arrived(&bytes, &told), bytes });
        }
    }
    all
}

/// True if these bytes are those that an ingress was given of the direction that begins as they do.
fn arrived(bytes: &[u8], sights: &[StreamSight]) -> bool {
    let mut next = 0;
    for sight in sights {
        let end = next + sight.length as usize;
        let mut place = StreamPlace::default();
        place.pass(bytes.get(..end).unwrap_or_default());
        let of_this = sight.offset == next as u64 && sight.stream == place.name();
        if of_this && bytes.get(next..end).is_some_and(|piece| wire_hash(piece) == sight.hash) {
            next = end;
        }
    }
    next == bytes.len() && next > 0
}

/// The secrets that a client's library tells.
#[derive(Clone, Debug, Default)]
struct Secrets(Arc<Mutex<Vec<Vec<u8>>>>);

impl KeyLog for Secrets {
    fn log(&self, _: &str, _: &[u8], secret: &[u8]) {
        lock(&self.0).push(secret.to_vec());
    }
}

fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use link::pki::{Authority, Role};

    use super::*;

    #[test]
    fn published_messages_arrive_as_the_watcher_saw() {
        link::crypto::init();
        let authority = Authority::new().expect("an authority");
        let issue = |peer, role| authority.issue(peer, role).expect("a certificate");
        let papers = Papers {
            broker: issue(PeerId::BROKER, Role::Listens),
            gateway: issue(PeerId::GATEWAY, Role::Both),
            unit: issue(PeerId::UNIT_B, Role::Dials),
            who: UnitId::B,
        };
        let publications =
            [(Subject::Command(UnitId::B), b"hold".to_vec()), (Subject::Ack(UnitId::B), b"held".to_vec())];
        let watched = watch(&papers, &publications).expect("it runs");
        assert_eq!(watched.delivered, [b"hold".to_vec(), b"held".to_vec()]);
        assert_eq!(watched.seen.len(), 4);
        assert!(watched.seen.iter().all(|seen| seen.arrived && !seen.bytes.is_empty()));
        assert!(watched.secrets.len() >= 8, "four traffic secrets of each session: {}", watched.secrets.len());
    }

    #[test]
    fn missing_or_changed_bytes_are_no_receipt() {
        let sight = |offset: u64, piece: &[u8], bytes: &[u8]| {
            let mut place = StreamPlace::default();
            place.pass(bytes);
            let (stream, length, hash) = (place.name(), piece.len() as u32, wire_hash(piece));
            StreamSight { trace_us: 0, sight: Sight::Arrived, stream, offset, length, hash }
        };
        let whole = [sight(0, b"abc", b"abc"), sight(3, b"def", b"abcdef")];
        assert!(arrived(b"abcdef", &whole));
        assert!(!arrived(b"abcdef", &whole[..1]), "the rest did not arrive");
        assert!(!arrived(b"abcxef", &whole), "it arrived otherwise");
        assert!(!arrived(b"", &[]), "nothing passed");
    }
}
