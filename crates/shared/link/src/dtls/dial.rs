//! Dialler of one session, which it opens again when it ends.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use tokio::net::UdpSocket;
use tokio::sync::mpsc;
use tokio::task::JoinHandle;
use wire::id::PeerId;

use super::path::{INLET, Outlet, Path};
use super::session::{SessionCounters, SessionEvent, Settings, serve};
use super::{DATAGRAM, DtlsError, client};
use crate::loopback::LoopbackAddr;
use crate::pki::Credential;
use crate::sockets;

/// First and longest pause between attempts; each failed attempt doubles it.
pub const PAUSES: (Duration, Duration) = (Duration::from_millis(50), Duration::from_millis(800));

/// A session that stays open until this is dropped.
pub struct Dialler {
    task: JoinHandle<()>,
    current_socket: CurrentSocket,
    counters: Arc<SessionCounters>,
}

/// Address of the current attempt's socket.
type CurrentSocket = Arc<Mutex<Option<LoopbackAddr>>>;

impl Dialler {
    /// Datagrams that the kernel has dropped at the sockets of this dialler.
    pub fn kernel_drops(&self) -> u64 {
        let current = *self.current_socket.lock().unwrap_or_else(PoisonError::into_inner);
        current.and_then(sockets::kernel_drops).unwrap_or(0) + self.counters.read().kernel_dropped
    }

    /// Ends the session silently: after the return, no datagram is sent or counted.
    pub async fn stop(&mut self) {
        self.task.abort();
        if let Err(error) = (&mut self.task).await {
            tracing::trace!(%error, "dialler stopped");
        }
        // The end of the socket has added its drops to the counters.
        *self.current_socket.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
}

impl Drop for Dialler {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// Keeps a session to `expected` at `remote` open. Every attempt has a new socket, so that an old association at
/// the far end never blocks a new one; the previous socket is read for one attempt more, so that datagrams under way to
/// it are counted.
pub fn dial(
    remote: LoopbackAddr,
    credential: Credential,
    expected: PeerId,
    settings: Settings,
    events: mpsc::Sender<SessionEvent>,
) -> Dialler {
    let (current_socket, counters) = (CurrentSocket::default(), settings.counters.clone());
    let current = current_socket.clone();
    let task = tokio::spawn(async move {
        let mut pause = PAUSES.0;
        let mut sockets = VecDeque::new();
        while !events.is_closed() {
            let outcome = match Socket::open(remote, &settings, &current) {
                Ok((socket, path)) => {
                    sockets.push_back(socket);
                    attempt(path, &credential, expected, &settings, &events).await
                }
                Err(error) => Err(error),
            };
            match outcome {
                Ok(()) => pause = PAUSES.0,
                Err(error) => {
                    SessionCounters::add(&settings.counters.failed);
                    tracing::debug!(%error, %remote, "session not opened");
                    pause = (pause * 2).min(PAUSES.1);
                }
            }
            while sockets.len() > 1 {
                sockets.pop_front();
            }
            tokio::time::sleep(pause).await;
        }
    });
    Dialler { task, current_socket, counters }
}

/// One attempt's socket and its reader.
struct Socket {
    local: LoopbackAddr,
    reader: JoinHandle<()>,
    counters: Arc<SessionCounters>,
}

impl Socket {
    fn open(
        remote: LoopbackAddr,
        settings: &Settings,
        current: &CurrentSocket,
    ) -> Result<(Self, Arc<Path>), DtlsError> {
        let socket = Arc::new(sockets::udp(settings.own)?);
        let local = LoopbackAddr::try_from(socket.local_addr()?)?;
        *current.lock().unwrap_or_else(PoisonError::into_inner) = Some(local);
        let counters = settings.counters.clone();
        let (inlet, datagrams) = mpsc::channel(INLET);
        let reader = tokio::spawn(feed(socket.clone(), remote, inlet, counters.clone()));
        let path = Path::new(datagrams, Outlet::Socket(socket, remote)).dialling(counters.clone());
        Ok((Self { local, reader, counters }, Arc::new(path)))
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        SessionCounters::add_n(&self.counters.kernel_dropped, sockets::kernel_drops(self.local).unwrap_or(0));
        self.reader.abort();
    }
}

async fn attempt(
    path: Arc<Path>,
    credential: &Credential,
    expected: PeerId,
    settings: &Settings,
    events: &mpsc::Sender<SessionEvent>,
) -> Result<(), DtlsError> {
    let session = settings.next_session();
    let guard = settings.guard(session.0);
    let secure =
        client(path, credential, expected, settings.revocations.clone(), guard).await.inspect_err(|error| {
            if let (Some(fault), Some(log)) = (error.fault(), &settings.log) {
                log.refused(session.0, fault, &settings.counters.guard);
            }
        })?;
    serve(secure, session, settings, events).await;
    Ok(())
}

/// Moves datagrams from `remote` to the association; counts datagrams after its end, and datagrams of other senders.
async fn feed(
    socket: Arc<UdpSocket>,
    remote: LoopbackAddr,
    inlet: mpsc::Sender<Vec<u8>>,
    counters: Arc<SessionCounters>,
) {
    let mut buf = vec![0; DATAGRAM];
    loop {
        match socket.recv_from(&mut buf).await {
            Ok((n, from)) if from == remote.socket() => match inlet.try_send(buf[..n].to_vec()) {
                Ok(()) => {}
                Err(mpsc::error::TrySendError::Full(_)) => SessionCounters::add(&counters.overflowed),
                Err(mpsc::error::TrySendError::Closed(_)) => SessionCounters::add(&counters.abandoned),
            },
            Ok(_) => SessionCounters::add(&counters.outsiders),
            // The pause keeps a persistent error from a busy loop.
            Err(error) => {
                tracing::trace!(%error, "datagram not received");
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
        }
    }
}
