//! Opens one session and opens it again when it ends.

use std::sync::Arc;
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

/// First and longest pause between attempts; each that fails doubles it.
pub const PAUSES: (Duration, Duration) = (Duration::from_millis(50), Duration::from_millis(800));

/// A session that is kept up until this is dropped.
pub struct Dialler {
    task: JoinHandle<()>,
}

impl Drop for Dialler {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// Keeps a session to `expected` at `remote` up. Every attempt has a socket of its own, so that an old association at
/// the far end never stands in the way of a new one.
pub fn dial(
    remote: LoopbackAddr,
    credential: Credential,
    expected: PeerId,
    settings: Settings,
    events: mpsc::Sender<SessionEvent>,
) -> Dialler {
    let task = tokio::spawn(async move {
        let mut pause = PAUSES.0;
        while !events.is_closed() {
            match attempt(remote, &credential, expected, &settings, &events).await {
                Ok(()) => pause = PAUSES.0,
                Err(error) => {
                    SessionCounters::add(&settings.counters.failed);
                    tracing::debug!(%error, %remote, "session not opened");
                    pause = (pause * 2).min(PAUSES.1);
                }
            }
            tokio::time::sleep(pause).await;
        }
    });
    Dialler { task }
}

async fn attempt(
    remote: LoopbackAddr,
    credential: &Credential,
    expected: PeerId,
    settings: &Settings,
    events: &mpsc::Sender<SessionEvent>,
) -> Result<(), DtlsError> {
    let socket = Arc::new(sockets::udp(LoopbackAddr::ANY_PORT)?);
    let (inlet, datagrams) = mpsc::channel(INLET);
    let reader = tokio::spawn(feed(socket.clone(), remote, inlet, settings.counters.clone()));
    let session = settings.next_session();
    let path = Arc::new(Path::new(datagrams, Outlet::Socket(socket, remote)));
    let opened = client(path, credential, expected, settings.guard(session.0)).await;
    let outcome = match opened {
        Ok(secure) => {
            serve(secure, session, settings, events).await;
            Ok(())
        }
        Err(error) => Err(error),
    };
    reader.abort();
    outcome
}

/// Moves datagrams from `remote`, and from nobody else, to the association.
async fn feed(
    socket: Arc<UdpSocket>,
    remote: LoopbackAddr,
    inlet: mpsc::Sender<Vec<u8>>,
    counters: Arc<SessionCounters>,
) {
    let mut buf = vec![0; DATAGRAM];
    loop {
        match socket.recv_from(&mut buf).await {
            Ok((n, from)) if from == remote.socket() => {
                if inlet.try_send(buf[..n].to_vec()).is_err() {
                    SessionCounters::add(&counters.overflowed);
                }
            }
            Ok(_) => SessionCounters::add(&counters.strangers),
            Err(error) => {
                tracing::trace!(%error, "datagram not received");
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
        }
        if inlet.is_closed() {
            return;
        }
    }
}
