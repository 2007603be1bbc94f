//! A datagram path as the DTLS library wants it: a bounded inlet of whole datagrams and an outlet.
//!
//! A listener feeds many paths from one socket; a dialler feeds one; a test connects two in memory. Like UDP, a path
//! that cannot take a datagram loses it.

use std::net::SocketAddr;
use std::sync::Arc;

use async_trait::async_trait;
use tokio::net::UdpSocket;
use tokio::sync::{Mutex, mpsc};
use webrtc_util::conn::Conn;

use super::session::SessionCounters;
use crate::loopback::LoopbackAddr;

/// Datagrams that may wait for one association.
pub const INLET: usize = 256;

/// Where a path's datagrams go.
pub enum Outlet {
    /// Through a socket to one address.
    Socket(Arc<UdpSocket>, LoopbackAddr),
    /// To another path, or to a test that plays the network.
    Memory(mpsc::Sender<Vec<u8>>),
}

/// One association's view of the network.
pub struct Path {
    inlet: Mutex<mpsc::Receiver<Vec<u8>>>,
    outlet: Outlet,
    counters: Option<Counted>,
}

/// Where a path counts, and whether it is a dialler's.
struct Counted {
    counters: Arc<SessionCounters>,
    dials: bool,
}

impl Path {
    /// A path that reads from `inlet` and writes to `outlet`.
    pub fn new(inlet: mpsc::Receiver<Vec<u8>>, outlet: Outlet) -> Self {
        Self { inlet: Mutex::new(inlet), outlet, counters: None }
    }

    /// The same path, which counts what it leaves unread when it ends and, for a dialler, what it sends.
    #[must_use]
    pub fn counted(mut self, counters: Arc<SessionCounters>, dials: bool) -> Self {
        self.counters = Some(Counted { counters, dials });
        self
    }

    fn sent(&self) {
        if let Some(counted) = self.counters.as_ref().filter(|c| c.dials) {
            SessionCounters::add(&counted.counters.dialled);
        }
    }
}

impl Drop for Path {
    fn drop(&mut self) {
        if let Some(counted) = &self.counters {
            let inlet = self.inlet.get_mut();
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
        let received = self.inlet.lock().await.recv().await;
        match received {
            Some(datagram) => {
                let n = datagram.len().min(buf.len());
                buf[..n].copy_from_slice(&datagram[..n]);
                Ok(n)
            }
            // The library retries on error without pausing; an ended path is silent instead.
            None => std::future::pending().await,
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
                    self.sent();
                    Ok(n)
                }
                // An unreachable peer is silence, not an error: the library would end the association.
                Err(error) => {
                    tracing::trace!(%error, "datagram not sent");
                    Ok(buf.len())
                }
            },
            Outlet::Memory(out) => {
                if out.try_send(buf.to_vec()).is_err() {
                    tracing::trace!("datagram not sent: no room");
                }
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
            Outlet::Memory(_) => Ok(LoopbackAddr::ANY_PORT.socket()),
        }
    }

    fn remote_addr(&self) -> Option<SocketAddr> {
        match &self.outlet {
            Outlet::Socket(_, to) => Some(to.socket()),
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
