//! The real stacks between two ends in memory: guard and DTLS library in paused time ([`Pair`]), TLS without a socket
//! ([`tls`]). No step waits for a clock, and the caller holds every datagram. A channel of shared memory
//! ([`overheard`]) is the exception: its readers are threads.
//!
//! Manipulating the datagrams, and judging the result, is left to the caller.

pub mod listener;
pub mod overheard;
pub mod rogue;
pub mod tls;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::runtime::Runtime;
use tokio::sync::mpsc;
use wire::core::Side;
use wire::id::PeerId;

use self::rogue::{Manner, Rogue};
use crate::certificates::list::Revocations;
use crate::dtls::path::{Outlet, Path};
use crate::dtls::{DtlsError, Secure, client, server};
use crate::guard::observe::{GuardCounters, GuardStats, Observation, ObservationLog};
use crate::guard::{GuardMode, GuardSettings};
use crate::pki::{Credential, ListRefused, PkiError};

/// Datagrams that a network holds in one direction.
const ROOM: usize = 4096;

/// Virtual time after which a datagram has no further effect.
pub const QUIET: Duration = Duration::from_millis(20);

/// Replaces a datagram from a side: returns the datagrams passed on to the other.
pub type Tap = Box<dyn FnMut(Side, Vec<u8>) -> Vec<Vec<u8>> + Send>;

/// A path with two ends; its holder may put datagrams in at either.
pub struct Network {
    /// The dialling end's path.
    pub client: Arc<Path>,
    /// The listening end's path.
    pub server: Arc<Path>,
    /// Puts a datagram in at the dialling end.
    pub to_client: mpsc::Sender<Vec<u8>>,
    /// Puts a datagram in at the listening end.
    pub to_server: mpsc::Sender<Vec<u8>>,
}

/// A network that applies `tap` to datagrams. Must be called inside a tokio runtime.
pub fn network(mut tap: Tap) -> Network {
    let (to_client, client_in) = mpsc::channel(ROOM);
    let (to_server, server_in) = mpsc::channel(ROOM);
    let (client_out, mut from_client) = mpsc::channel::<Vec<u8>>(ROOM);
    let (server_out, mut from_server) = mpsc::channel::<Vec<u8>>(ROOM);
    let (clientward, serverward) = (to_client.clone(), to_server.clone());
    tokio::spawn(async move {
        loop {
            let (side, datagram) = tokio::select! {
                Some(datagram) = from_client.recv() => (Side::Client, datagram),
                Some(datagram) = from_server.recv() => (Side::Server, datagram),
                else => return,
            };
            let way = if side == Side::Client { &serverward } else { &clientward };
            for passed in tap(side, datagram) {
                // As in UDP, a datagram without room is lost.
                if way.try_send(passed).is_err() {
                    tracing::trace!("a datagram in memory found no room");
                }
            }
        }
    });
    Network {
        client: Arc::new(Path::new(client_in, Outlet::Memory(client_out))),
        server: Arc::new(Path::new(server_in, Outlet::Memory(server_out))),
        to_client,
        to_server,
    }
}

/// A network that passes everything.
pub fn clear() -> Tap {
    Box::new(|_, datagram| vec![datagram])
}

/// Configuration of one end.
#[derive(Clone, Debug)]
pub struct Party {
    /// Its certificate, and the authority that it checks others against.
    pub credential: Credential,
    /// Its revocation list, where it is newer than the one in the credential.
    pub list: Option<Vec<u8>>,
    /// Mode of its guard.
    pub guard: GuardMode,
    /// Its rule violations; `None` for an honest end.
    pub manner: Option<Manner>,
}

impl Party {
    /// An honest end.
    pub fn honest(credential: Credential) -> Self {
        Self { credential, list: None, guard: GuardMode::Required, manner: None }
    }

    fn revocations(&self) -> Result<Revocations, PkiError> {
        let held = Revocations::from_credential(&self.credential)?;
        if let Some(list) = &self.list {
            held.replace(list.clone())?;
        }
        Ok(held)
    }
}

/// Datagrams that ends sent, each with its end.
type Sent = Arc<Mutex<Vec<(Side, Vec<u8>)>>>;

/// Two ends, the traffic between them, and the observations of each guard.
pub struct Pair {
    runtime: Runtime,
    network: Network,
    ends: [End; 2],
    seen: [Seen; 2],
    sent: Sent,
    carrying: Arc<Mutex<bool>>,
}

/// Counters and observations of an end's guard.
struct Seen {
    counters: Arc<GuardCounters>,
    log: mpsc::Receiver<Observation>,
    revocations: Option<Revocations>,
}

/// Result of an end's handshake.
enum End {
    Stands(Secure),
    Broken(DtlsError),
    Rogue(Result<Rogue, DtlsError>),
}

impl Pair {
    /// Two ends after their handshake through `tap`, the dialling one first; the dialler expects `expected`. After the
    /// handshake no datagram is carried: an end's output waits for [`Pair::take`].
    ///
    /// # Errors
    ///
    /// When no runtime can be made, or an honest end's credential is unusable.
    pub fn open(parties: [&Party; 2], expected: PeerId, mut tap: Tap) -> Result<Self, DtlsError> {
        crate::crypto::init();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build()?;
        let (sent, carrying) = (Sent::default(), Arc::new(Mutex::new(true)));
        let (recorded, carries) = (sent.clone(), carrying.clone());
        let all = move |side: Side, datagram: Vec<u8>| {
            lock(&recorded).push((side, datagram.clone()));
            if *lock(&carries) { tap(side, datagram) } else { Vec::new() }
        };
        let network = {
            let _inside = runtime.enter();
            network(Box::new(all))
        };
        let (dialling, of_dialling) = guard(parties[0])?;
        let (listening, of_listening) = guard(parties[1])?;
        let ends = runtime.block_on(async {
            let (to_server, to_client) = (network.client.clone(), network.server.clone());
            let dialled = end(parties[0], to_server, Some(expected), of_dialling.revocations.clone(), dialling);
            let accepted = end(parties[1], to_client, None, of_listening.revocations.clone(), listening);
            let (dialled, accepted) = tokio::join!(dialled, accepted);
            // The last flight of one end may still be under way.
            tokio::time::sleep(QUIET).await;
            [dialled, accepted]
        });
        *lock(&carrying) = false;
        Ok(Self { runtime, network, ends, seen: [of_dialling, of_listening], sent, carrying })
    }

    /// The peer as an end sees it, or the refusal. `None` for a rogue end that was not refused.
    ///
    /// # Errors
    ///
    /// Reason for which the end has no association.
    pub fn peer(&self, side: Side) -> Result<Option<PeerId>, &DtlsError> {
        match &self.ends[side as usize] {
            End::Stands(secure) => Ok(Some(secure.peer())),
            End::Rogue(Ok(_)) => Ok(None),
            End::Broken(error) | End::Rogue(Err(error)) => Err(error),
        }
    }

    /// Verifies the certificate of the other end again, at `side`.
    ///
    /// # Errors
    ///
    /// The refusal.
    pub fn verify_peer(&self, side: Side) -> Result<PeerId, crate::certificates::Refused> {
        match &self.ends[side as usize] {
            End::Stands(secure) => secure.verify_peer(),
            End::Broken(_) | End::Rogue(_) => Err(crate::certificates::Refused {
                fault: crate::certificates::Fault::Handshake,
                got: "no association".to_owned(),
            }),
        }
    }

    /// Gives an end a newer revocation list.
    ///
    /// # Errors
    /// When it refuses the list.
    pub fn revoke(&self, side: Side, list: Vec<u8>) -> Result<(), ListRefused> {
        match &self.seen[side as usize].revocations {
            Some(held) => held.replace(list),
            None => Ok(()),
        }
    }

    /// The master secret of each end that has an association.
    ///
    /// # Errors
    /// When the library does not give it.
    pub fn secrets(&self) -> Result<Vec<Vec<u8>>, DtlsError> {
        let standing = self.ends.iter().filter_map(|end| match end {
            End::Stands(secure) => Some(secure),
            End::Broken(_) | End::Rogue(_) => None,
        });
        standing.map(|secure| self.runtime.block_on(secure.master_secret())).collect()
    }

    /// The datagrams that an end sent since the last call, in order.
    pub fn take(&mut self, from: Side) -> Vec<Vec<u8>> {
        let mut sent = lock(&self.sent);
        let (from_end, others) = std::mem::take(&mut *sent).into_iter().partition(|(side, _)| *side == from);
        *sent = others;
        let from_end: Vec<(Side, Vec<u8>)> = from_end;
        from_end.into_iter().map(|(_, datagram)| datagram).collect()
    }

    /// The datagram in which `from` sends a record; `None` when it refuses the record.
    pub fn send(&mut self, from: Side, record: &[u8]) -> Option<Vec<u8>> {
        self.take(from);
        let end = &self.ends[from as usize];
        self.runtime.block_on(async {
            match end {
                End::Stands(secure) => secure.send(record).await.ok()?,
                End::Rogue(Ok(rogue)) => rogue.send(record).await.ok()?,
                End::Broken(_) | End::Rogue(Err(_)) => return None,
            }
            tokio::time::sleep(QUIET).await;
            Some(())
        })?;
        self.take(from).into_iter().next()
    }

    /// Delivers a datagram to an end; returns the records that the end accepts.
    pub fn put(&mut self, to: Side, datagram: &[u8]) -> Vec<Vec<u8>> {
        let way = if to == Side::Client { &self.network.to_client } else { &self.network.to_server };
        let end = &self.ends[to as usize];
        self.runtime.block_on(async {
            let had_room = way.try_send(datagram.to_vec()).is_ok();
            let mut records = Vec::new();
            if let (true, End::Stands(secure)) = (had_room, end) {
                while let Ok(Ok(record)) = tokio::time::timeout(QUIET, secure.recv()).await {
                    records.push(record);
                }
            } else {
                tokio::time::sleep(QUIET).await;
            }
            records
        })
    }

    /// Sends a record `n` times, one after the other, and carries each across; returns the number received.
    pub fn stream(&mut self, from: Side, record: &[u8], n: usize) -> usize {
        *lock(&self.carrying) = true;
        let out = match &self.ends {
            [End::Stands(a), End::Stands(b)] => {
                let (near, far) = if from == Side::Client { (a, b) } else { (b, a) };
                self.runtime.block_on(async {
                    let mut out = 0;
                    for _ in 0..n {
                        let sent = near.send(record).await.is_ok();
                        out += usize::from(sent && matches!(tokio::time::timeout(QUIET, far.recv()).await, Ok(Ok(_))));
                    }
                    out
                })
            }
            _ => 0,
        };
        *lock(&self.carrying) = false;
        self.take(from);
        out
    }

    /// Advances the paused time.
    pub fn wait(&mut self, time: Duration) {
        self.runtime.block_on(async { tokio::time::sleep(time).await });
    }

    /// Counters of an end's guard.
    pub fn guard(&self, side: Side) -> GuardStats {
        self.seen[side as usize].counters.read()
    }

    /// New observations of an end's guard since the last call.
    pub fn observed(&mut self, side: Side) -> Vec<Observation> {
        let log = &mut self.seen[side as usize].log;
        std::iter::from_fn(|| log.try_recv().ok()).collect()
    }
}

impl Drop for Pair {
    fn drop(&mut self) {
        *lock(&self.carrying) = false;
    }
}

fn guard(party: &Party) -> Result<(GuardSettings, Seen), DtlsError> {
    let counters = Arc::new(GuardCounters::default());
    let (log, observations) = ObservationLog::new(ROOM);
    let settings = GuardSettings { mode: party.guard, association: 1, counters: counters.clone(), log: Some(log) };
    let revocations = match party.manner {
        None => Some(party.revocations()?),
        Some(_) => None,
    };
    Ok((settings, Seen { counters, log: observations, revocations }))
}

async fn end(
    party: &Party,
    path: Arc<Path>,
    expected: Option<PeerId>,
    revocations: Option<Revocations>,
    guard: GuardSettings,
) -> End {
    let Some(held) = revocations else {
        let manner = party.manner.unwrap_or_default();
        return End::Rogue(rogue::open(path, &party.credential, manner, expected).await);
    };
    let opened = match expected {
        Some(expected) => client(path, &party.credential, expected, held, guard).await,
        None => server(path, &party.credential, held, guard).await,
    };
    opened.map_or_else(End::Broken, End::Stands)
}

fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}
