//! A socket for datagrams in lock-step: one is sent, and the next only after the answer.
//!
//! It is for measurements between ends of other authors, each behind its port. The meaning of a datagram is left to them.

use std::io::{self, ErrorKind};
use std::net::UdpSocket;
use std::time::Duration;

use crate::loopback::LoopbackAddr;

/// Longest datagram over UDP, bytes.
const DATAGRAM: usize = 65_535;

/// The socket.
#[derive(Debug)]
pub struct Lockstep {
    socket: UdpSocket,
    local: LoopbackAddr,
}

impl Lockstep {
    /// Opens a socket on a port that the kernel chooses.
    ///
    /// # Errors
    /// When it cannot be bound.
    pub fn open() -> io::Result<Self> {
        let socket = UdpSocket::bind(LoopbackAddr::ANY_PORT.socket())?;
        let local = LoopbackAddr::try_from(socket.local_addr()?).map_err(io::Error::other)?;
        Ok(Self { socket, local })
    }

    /// Its address.
    pub fn local(&self) -> LoopbackAddr {
        self.local
    }

    /// Sends a datagram.
    ///
    /// # Errors
    /// When the kernel does not accept all of it.
    pub fn send(&self, to: LoopbackAddr, datagram: &[u8]) -> io::Result<()> {
        match self.socket.send_to(datagram, to.socket())? {
            sent if sent == datagram.len() => Ok(()),
            sent => Err(io::Error::other(format!("{sent} of {} bytes were sent", datagram.len()))),
        }
    }

    /// The next datagram; `None` if none arrives before the `timeout`.
    ///
    /// # Errors
    /// When the socket fails, or the sender is not on the loopback interface.
    pub fn receive(&self, timeout: Duration) -> io::Result<Option<Vec<u8>>> {
        self.socket.set_read_timeout(Some(timeout))?;
        let mut bytes = vec![0; DATAGRAM];
        match self.socket.recv_from(&mut bytes) {
            Ok((length, from)) => {
                LoopbackAddr::try_from(from).map_err(io::Error::other)?;
                bytes.truncate(length);
                Ok(Some(bytes))
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => Ok(None),
            Err(error) => Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn datagram_arrives_whole_or_not_at_all() {
        let (one, other) = (Lockstep::open().unwrap(), Lockstep::open().unwrap());
        assert_eq!(other.receive(Duration::from_millis(1)).unwrap(), None);
        for datagram in [vec![], vec![7; 9_000]] {
            one.send(other.local(), &datagram).unwrap();
            assert_eq!(other.receive(Duration::from_secs(60)).unwrap(), Some(datagram));
        }
    }
}
