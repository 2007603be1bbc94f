//! A datagram path in the interface of the DTLS library: a bounded inlet of whole datagrams and an outlet.
//!
//! A listener feeds many paths from one socket; a dialler feeds one; a test connects two in memory. Like UDP, a path
//! that cannot take a datagram loses it.

use std::net::SocketAddr;
use std::sync::Arc;

use async_trait::async_trait;
use tokio::net::UdpSocket;
use tokio::sync::{Mutex, mpsc};
use webrtc_util::conn::Conn;

use super::cookie_retry::CookieRetry;
use super::session::SessionCounters;
use crate::loopback::LoopbackAddr;
use crate::sockets;

/// Datagrams that may wait for one association.
pub const INLET: usize = 256;

/// Destination of a path's datagrams.
pub enum Outlet {
    /// Through a socket to one address.
    Socket(Arc<UdpSocket>, LoopbackAddr),
    /// To another path, or to a test that plays the network.
    Memory(mpsc::Sender<Vec<u8>>),
    /// To a network in memory, with the address of the sender or of the receiver.
    Port(mpsc::Sender<(LoopbackAddr, Vec<u8>)>, LoopbackAddr),
}

impl Outlet {
    /// Sends a datagram at once or not at all.
    pub(super) fn emit(&self, bytes: &[u8]) {
        let sent = match self {
            Outlet::Socket(socket, to) => sockets::emit(socket, Some(*to), bytes),
            Outlet::Memory(out) => out.try_send(bytes.to_vec()).is_ok(),
            Outlet::Port(out, address) => out.try_send((*address, bytes.to_vec())).is_ok(),
        };
        if !sent {
            tracing::trace!("datagram not sent");
        }
    }
}

/// One association's view of the network.
pub struct Path {
    inlet: Mutex<mpsc::Receiver<Vec<u8>>>,
    outlet: Outlet,
    counters: Option<Counted>,
}

/// Counters of a path, and the dialler's state.
struct Counted {
    counters: Arc<SessionCounters>,
    retry: Option<CookieRetry>,
}

impl Path {
    /// A path that reads from `inlet` and writes to `outlet`.
    pub fn new(inlet: mpsc::Receiver<Vec<u8>>, outlet: Outlet) -> Self {
        Self { inlet: Mutex::new(inlet), outlet, counters: None }
    }

    /// This path with counters: it counts its unread datagrams when it ends.
    #[must_use]
    pub fn counted(mut self, counters: Arc<SessionCounters>) -> Self {
        self.counters = Some(Counted { counters, retry: None });
        self
    }

    /// This path for a dialler: it also counts sent datagrams, and answers cookie requests.
    #[must_use]
    pub fn dialling(mut self, counters: Arc<SessionCounters>) -> Self {
        self.counters = Some(Counted { counters, retry: Some(CookieRetry::default()) });
        self
    }

    /// Notes a datagram that leaves a dialler.
    fn sent(&self, datagram: &[u8]) {
        if let Some(Counted { counters, retry: Some(retry) }) = &self.counters {
            retry.note_sent(datagram);
            SessionCounters::add(&counters.dialled);
        }
    }

    /// Answers a cookie request; false for any other datagram.
    fn answers_cookie_request(&self, datagram: &[u8]) -> bool {
        let Some(Counted { counters, retry: Some(retry) }) = &self.counters else { return false };
        let Some(answer) = retry.answer(datagram) else { return false };
        SessionCounters::add(&counters.cookie_requests);
        for datagram in answer {
            self.outlet.emit(&datagram);
            SessionCounters::add(&counters.dialled);
        }
        true
    }
}

impl Drop for Path {
    fn drop(&mut self) {
        if let Some(counted) = &self.counters {
            let inlet = self.inlet.get_mut();
            // Closed before it is emptied: a later sender sees that and counts the datagram, so that none is missing.
            inlet.close();
            while inlet.try_recv().is_ok() {
                SessionCounters::add(&counted.counters.abandoned);
            }
        }
    }
}

#[async_trait]
impl Conn for Path {
    async fn connect(&self, _addr: SocketAddr) -> webrtc_util::Result<()> {
        Ok(())
    }

    async fn recv(&self, buf: &mut [u8]) -> webrtc_util::Result<usize> {
        loop {
            let received = self.inlet.lock().await.recv().await;
            // The library retries on error without pausing; an ended path is silent instead.
            let Some(datagram) = received else { return std::future::pending().await };
            if self.answers_cookie_request(&datagram) {
                continue;
            }
            let n = datagram.len().min(buf.len());
            buf[..n].copy_from_slice(&datagram[..n]);
            return Ok(n);
        }
    }

    async fn recv_from(&self, buf: &mut [u8]) -> webrtc_util::Result<(usize, SocketAddr)> {
        let n = self.recv(buf).await?;
        let from = self.remote_addr().ok_or(webrtc_util::Error::ErrNotFound)?;
        Ok((n, from))
    }

    async fn send(&self, buf: &[u8]) -> webrtc_util::Result<usize> {
        match &self.outlet {
            Outlet::Socket(socket, to) => match socket.send_to(buf, to.socket()).await {
                Ok(n) => {
                    self.sent(buf);
                    Ok(n)
                }
                // An unreachable peer is silence, not an error: the library would end the association.
                Err(error) => {
                    tracing::trace!(%error, "datagram not sent");
                    Ok(buf.len())
                }
            },
            Outlet::Memory(_) | Outlet::Port(..) => {
                self.outlet.emit(buf);
                self.sent(buf);
                Ok(buf.len())
            }
        }
    }

    async fn send_to(&self, buf: &[u8], _target: SocketAddr) -> webrtc_util::Result<usize> {
        self.send(buf).await
    }

    fn local_addr(&self) -> webrtc_util::Result<SocketAddr> {
        match &self.outlet {
            Outlet::Socket(socket, _) => socket.local_addr().map_err(Into::into),
            Outlet::Memory(_) | Outlet::Port(..) => Ok(LoopbackAddr::ANY_PORT.socket()),
        }
    }

    fn remote_addr(&self) -> Option<SocketAddr> {
        match &self.outlet {
            Outlet::Socket(_, to) | Outlet::Port(_, to) => Some(to.socket()),
            Outlet::Memory(_) => Some(LoopbackAddr::ANY_PORT.socket()),
        }
    }

    async fn close(&self) -> webrtc_util::Result<()> {
        Ok(())
    }

    fn as_any(&self) -> &(dyn std::any::Any + Send + Sync) {
        self
    }
}
