//! The sockets of a relay: arrivals on both sides become inputs of the core, and its outputs are sent on both sides.
//!
//! The core decides which datagrams pass, when and how often; this file has no policy and sees only ciphertext. A
//! datagram relay carries the path of one client: a process of the same run that has begun a session through it.
//! When the client begins a session from another port, as it does after each loss, the relay opens a new socket towards the
//! server, so that the server sees a new path too. Datagrams of any other sender are counted and dropped. Both ends are
//! loopback addresses of the specification. A process of the same user can still use the run's own address and
//! begin a session.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use serde::Serialize;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::net::{TcpListener, TcpStream, UdpSocket};
use tokio::sync::{Semaphore, mpsc, watch};
use wire::core::{Input, Side};
use wire::id::SessionId;

use crate::guard::hello;
use crate::loopback::LoopbackAddr;
use crate::sockets;
use crate::spec::RelayLeg;

/// Streams that may be relayed at once.
pub const STREAMS: usize = 64;

/// Pieces that may wait to be written to one side of a stream; beyond, the stream is cut.
const PIECES: usize = 256;

/// The largest piece of a stream, in bytes.
const PIECE: usize = 8 * 1024;

/// Room for one datagram.
const DATAGRAM: usize = 8 * 1024;

/// Counters of a relay's sockets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RelayStats {
    /// Datagrams received from the client and from the server.
    pub received: [u64; 2],
    /// Datagrams emitted towards the client and towards the server.
    pub emitted: [u64; 2],
    /// Datagrams emitted towards the server from another address of the relay.
    pub strange: u64,
    /// Datagrams at the client side from outside of the run: dropped, and in no other count.
    pub outsiders: u64,
    /// Datagrams at the client side from a socket of the run that is not the client's, or no longer: dropped too.
    pub stale: u64,
    /// Datagrams towards the client and towards the server, from any address, that could not be emitted (no client
    /// yet, or the socket refused).
    pub unsent: [u64; 2],
    /// Streams opened.
    pub streams: u64,
    /// Streams turned away or cut because a bound was reached.
    pub cut: u64,
}

#[derive(Debug, Default)]
struct Counters {
    received: [AtomicU64; 2],
    emitted: [AtomicU64; 2],
    strange: AtomicU64,
    outsiders: AtomicU64,
    stale: AtomicU64,
    unsent: [AtomicU64; 2],
    streams: AtomicU64,
    cut: AtomicU64,
}

fn add(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}

fn index(side: Side) -> usize {
    match side {
        Side::Client => 0,
        Side::Server => 1,
    }
}

/// The datagram half of a relay.
pub struct DatagramRelay {
    local: LoopbackAddr,
    front: Arc<UdpSocket>,
    path: Arc<Mutex<Option<Leg>>>,
    unknown_peer: UdpSocket,
    counters: Arc<Counters>,
}

/// The present client and its socket towards the server.
struct Leg {
    client: LoopbackAddr,
    back: Arc<UdpSocket>,
    reader: tokio::task::JoinHandle<()>,
}

impl Drop for Leg {
    fn drop(&mut self) {
        self.reader.abort();
    }
}

impl DatagramRelay {
    /// Opens the client side for clients of the run at `run_addr`. Must be called inside a tokio runtime.
    ///
    /// # Errors
    /// When the socket cannot be bound.
    pub fn open(leg: RelayLeg, run_addr: LoopbackAddr, to: mpsc::Sender<Input>) -> std::io::Result<Self> {
        let front = Arc::new(sockets::udp(leg.at)?);
        let local = LoopbackAddr::try_from(front.local_addr()?).map_err(std::io::Error::other)?;
        let unknown_peer = sockets::udp_to(run_addr, leg.upstream)?;
        let path = Arc::new(Mutex::new(None));
        let counters = Arc::new(Counters::default());
        let ends = Ends { front: front.clone(), upstream: leg.upstream, run_addr };
        tokio::spawn(front_loop(ends, path.clone(), to, counters.clone()));
        Ok(Self { local, front, path, unknown_peer, counters })
    }

    /// Address for clients.
    pub fn local(&self) -> LoopbackAddr {
        self.local
    }

    /// Emits a datagram towards `side`, or counts the failure.
    pub fn emit(&self, side: Side, bytes: &[u8]) {
        let path = self.path.lock().unwrap_or_else(PoisonError::into_inner);
        let sent = match (&*path, side) {
            (Some(leg), Side::Client) => sockets::emit(&self.front, Some(leg.client), bytes),
            (Some(leg), Side::Server) => sockets::emit(&leg.back, None, bytes),
            (None, Side::Client | Side::Server) => false,
        };
        let counters = if sent { &self.counters.emitted } else { &self.counters.unsent };
        add(&counters[index(side)]);
    }

    /// Emits a datagram towards the server from an address that no session knows. Replies to it are not read.
    pub fn emit_from_unknown_peer(&self, bytes: &[u8]) {
        let sent = sockets::emit(&self.unknown_peer, None, bytes);
        add(if sent { &self.counters.strange } else { &self.counters.unsent[index(Side::Server)] });
    }

    /// The counters so far.
    pub fn stats(&self) -> RelayStats {
        read(&self.counters)
    }
}

fn read(counters: &Counters) -> RelayStats {
    let get = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
    RelayStats {
        received: [get(&counters.received[0]), get(&counters.received[1])],
        emitted: [get(&counters.emitted[0]), get(&counters.emitted[1])],
        strange: get(&counters.strange),
        outsiders: get(&counters.outsiders),
        stale: get(&counters.stale),
        unsent: [get(&counters.unsent[0]), get(&counters.unsent[1])],
        streams: get(&counters.streams),
        cut: get(&counters.cut),
    }
}

/// The client side, the server's address, and the address of the run's own sockets.
struct Ends {
    front: Arc<UdpSocket>,
    upstream: LoopbackAddr,
    run_addr: LoopbackAddr,
}

async fn front_loop(ends: Ends, path: Arc<Mutex<Option<Leg>>>, to: mpsc::Sender<Input>, counters: Arc<Counters>) {
    let mut buf = vec![0; DATAGRAM];
    while !to.is_closed() {
        let Ok((n, from)) = ends.front.recv_from(&mut buf).await else { continue };
        let known = path.lock().unwrap_or_else(PoisonError::into_inner).as_ref().map(|leg| leg.client);
        if known.is_none_or(|client| client.socket() != from) {
            let (true, Ok(client)) = (ends.run_addr.is_host_of(from), LoopbackAddr::try_from(from)) else {
                add(&counters.outsiders);
                continue;
            };
            // Only a sound hello makes its sender the client: a stray datagram could otherwise take the downlink away.
            if !hello::opens_association(&buf[..n]) {
                add(&counters.stale);
                continue;
            }
            match sockets::udp_to(ends.run_addr, ends.upstream).map(Arc::new) {
                Ok(back) => {
                    let reader = tokio::spawn(back_loop(back.clone(), to.clone(), counters.clone()));
                    *path.lock().unwrap_or_else(PoisonError::into_inner) = Some(Leg { client, back, reader });
                }
                Err(error) => {
                    tracing::warn!(%error, "relay has no way to its server");
                    continue;
                }
            }
        }
        add(&counters.received[index(Side::Client)]);
        if to.send(Input::Datagram { side: Side::Client, bytes: buf[..n].to_vec() }).await.is_err() {
            return;
        }
    }
}

async fn back_loop(back: Arc<UdpSocket>, to: mpsc::Sender<Input>, counters: Arc<Counters>) {
    let mut buf = vec![0; DATAGRAM];
    while !to.is_closed() {
        match back.recv(&mut buf).await {
            Ok(n) => {
                add(&counters.received[index(Side::Server)]);
                if to.send(Input::Datagram { side: Side::Server, bytes: buf[..n].to_vec() }).await.is_err() {
                    return;
                }
            }
            // An absent server: the kernel reports its refusal of an earlier datagram on this call.
            Err(_) => tokio::time::sleep(std::time::Duration::from_millis(1)).await,
        }
    }
}

/// The byte-stream half of a relay.
pub struct StreamRelay {
    local: LoopbackAddr,
    streams: Arc<Mutex<BTreeMap<SessionId, Stream>>>,
    counters: Arc<Counters>,
}

/// The two writing ends of a relayed stream and its cut.
struct Stream {
    towards: [mpsc::Sender<Vec<u8>>; 2],
    cut: watch::Sender<bool>,
}

impl StreamRelay {
    /// Opens the client side. Must be called inside a tokio runtime.
    ///
    /// # Errors
    /// When the socket cannot be bound.
    pub fn open(leg: RelayLeg, to: mpsc::Sender<Input>) -> std::io::Result<Self> {
        let listener = std::net::TcpListener::bind(leg.at.socket())?;
        listener.set_nonblocking(true)?;
        let listener = TcpListener::from_std(listener)?;
        let local = LoopbackAddr::try_from(listener.local_addr()?).map_err(std::io::Error::other)?;
        let this = Self { local, streams: Arc::default(), counters: Arc::new(Counters::default()) };
        tokio::spawn(accept_loop(listener, leg.upstream, this.streams.clone(), to, this.counters.clone()));
        Ok(this)
    }

    /// Address for clients.
    pub fn local(&self) -> LoopbackAddr {
        self.local
    }

    /// Writes a piece towards `side`; an empty piece ends that direction. A side that cannot keep up is cut.
    pub fn emit(&self, connection: SessionId, side: Side, bytes: Vec<u8>) {
        let streams = self.streams.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(stream) = streams.get(&connection) else { return };
        if let Err(mpsc::error::TrySendError::Full(_)) = stream.towards[index(side)].try_send(bytes) {
            add(&self.counters.cut);
            stream.cut.send_replace(true);
        }
    }

    /// Cuts a stream in both directions at once.
    pub fn reset(&self, connection: SessionId) {
        let streams = self.streams.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(stream) = streams.get(&connection) {
            stream.cut.send_replace(true);
        }
    }

    /// The counters so far.
    pub fn stats(&self) -> RelayStats {
        read(&self.counters)
    }
}

type Streams = Arc<Mutex<BTreeMap<SessionId, Stream>>>;

async fn accept_loop(
    listener: TcpListener,
    upstream: LoopbackAddr,
    streams: Streams,
    to: mpsc::Sender<Input>,
    counters: Arc<Counters>,
) {
    let slots = Arc::new(Semaphore::new(STREAMS));
    let numbers = AtomicU32::new(0);
    while !to.is_closed() {
        let Ok((client, from)) = listener.accept().await else { continue };
        let slot = slots.clone().try_acquire_owned();
        let (Ok(_), Ok(slot)) = (LoopbackAddr::try_from(from), slot) else {
            add(&counters.cut);
            continue;
        };
        let connection = SessionId(numbers.fetch_add(1, Ordering::Relaxed).wrapping_add(1));
        add(&counters.streams);
        let (streams, to) = (streams.clone(), to.clone());
        tokio::spawn(async move {
            if let Err(error) = carry(client, upstream, connection, &streams, &to).await {
                tracing::debug!(%error, ?connection, "relayed stream ended");
            }
            streams.lock().unwrap_or_else(PoisonError::into_inner).remove(&connection);
            drop(slot);
        });
    }
}

async fn carry(
    client: TcpStream,
    upstream: LoopbackAddr,
    connection: SessionId,
    streams: &Streams,
    to: &mpsc::Sender<Input>,
) -> std::io::Result<()> {
    let server = TcpStream::connect(upstream.socket()).await?;
    LoopbackAddr::try_from(server.peer_addr()?).map_err(std::io::Error::other)?;
    client.set_nodelay(true)?;
    server.set_nodelay(true)?;
    let ((from_client, to_client), (from_server, to_server)) = (client.into_split(), server.into_split());
    let (client_tx, client_rx) = mpsc::channel(PIECES);
    let (server_tx, server_rx) = mpsc::channel(PIECES);
    let (cut, mut cutting) = watch::channel(false);
    let stream = Stream { towards: [client_tx, server_tx], cut };
    streams.lock().unwrap_or_else(PoisonError::into_inner).insert(connection, stream);
    let all = async {
        tokio::join!(
            pump_in(from_client, connection, Side::Client, to),
            pump_in(from_server, connection, Side::Server, to),
            pump_out(to_client, client_rx),
            pump_out(to_server, server_rx),
        )
    };
    tokio::select! {
        _ = all => Ok(()),
        _ = cutting.wait_for(|cut| *cut) => Ok(()),
    }
}

/// Reads one side until it ends; an empty piece reports the end to the core.
async fn pump_in(mut from: OwnedReadHalf, connection: SessionId, side: Side, to: &mpsc::Sender<Input>) {
    let mut buf = vec![0; PIECE];
    loop {
        let n = from.read(&mut buf).await.unwrap_or(0);
        let bytes = buf[..n].to_vec();
        if to.send(Input::Stream { connection, side, bytes }).await.is_err() || n == 0 {
            return;
        }
    }
}

/// Writes one side until an empty piece or an error.
async fn pump_out(mut to: OwnedWriteHalf, mut pieces: mpsc::Receiver<Vec<u8>>) {
    while let Some(piece) = pieces.recv().await {
        let is_over = if piece.is_empty() { to.shutdown().await.is_ok() } else { to.write_all(&piece).await.is_err() };
        if is_over {
            return;
        }
    }
}
