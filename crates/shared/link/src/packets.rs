//! Telemetry packets for a ground system on this host: over TCP, on loopback, to every client that connects.
//!
//! No byte is read from a client, so none can give an order. There is no secret: every user of the host can connect and reads the values that the
//! console displays. A slow client is disconnected, possibly within a packet, and may connect again; no packet waits for it here. The
//! content of packets is left to the caller.

use std::io::{self, ErrorKind, Write};
use std::net::{TcpListener, TcpStream};

use crate::loopback::LoopbackAddr;

/// Clients at a time; more are turned away.
pub const MAX_CLIENTS: usize = 8;

/// A server, until this is dropped.
#[derive(Debug)]
pub struct Offered {
    listener: TcpListener,
    address: LoopbackAddr,
    clients: Vec<TcpStream>,
}

impl Offered {
    /// Offers future packets on a port of loopback; 0 lets the kernel choose.
    ///
    /// # Errors
    ///
    /// When the port is taken.
    pub fn open(port: u16) -> io::Result<Self> {
        let listener = TcpListener::bind(LoopbackAddr::on_port(port).socket())?;
        listener.set_nonblocking(true)?;
        let address = LoopbackAddr::on_port(listener.local_addr()?.port());
        Ok(Self { listener, address, clients: Vec::new() })
    }

    /// Address for a client.
    pub fn address(&self) -> LoopbackAddr {
        self.address
    }

    /// Sends whole packets to the connected clients; returns their number.
    ///
    /// # Errors
    ///
    /// When no client can be accepted any more.
    pub fn send(&mut self, packets: &[u8]) -> io::Result<usize> {
        self.accept_waiting()?;
        // A partial write would leave the client in the middle of a packet, and the rest has no place to wait.
        self.clients.retain_mut(|client| matches!(client.write(packets), Ok(written) if written == packets.len()));
        Ok(self.clients.len())
    }

    fn accept_waiting(&mut self) -> io::Result<()> {
        loop {
            match self.listener.accept() {
                Ok((client, _)) if self.clients.len() < MAX_CLIENTS => {
                    client.set_nonblocking(true)?;
                    self.clients.push(client);
                }
                Ok(_) => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(error) if error.kind() == ErrorKind::ConnectionAborted => {}
                Err(error) => return Err(error),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    #[test]
    fn client_reads_packets_from_its_connection_on() {
        let mut offered = Offered::open(0).unwrap();
        assert_eq!(offered.send(b"before").unwrap(), 0);
        let mut client = TcpStream::connect(offered.address().socket()).unwrap();
        assert_eq!(offered.send(b"packet").unwrap(), 1);
        let mut read = [0; 6];
        client.read_exact(&mut read).unwrap();
        assert_eq!(&read, b"packet");
    }

    #[test]
    fn client_that_does_not_read_is_cut_off_and_the_others_go_on() {
        let mut offered = Offered::open(0).unwrap();
        let _slow = TcpStream::connect(offered.address().socket()).unwrap();
        let packets = vec![7; 1 << 20];
        let mut left = offered.send(&packets).unwrap();
        // A socket's buffers hold a few mebibytes.
        for _ in 0..64 {
            left = offered.send(&packets).unwrap();
        }
        assert_eq!(left, 0);
        let _next = TcpStream::connect(offered.address().socket()).unwrap();
        assert_eq!(offered.send(b"packet").unwrap(), 1);
    }

    #[test]
    fn ninth_client_is_turned_away() {
        let mut offered = Offered::open(0).unwrap();
        let _clients: Vec<TcpStream> =
            (0..=MAX_CLIENTS).map(|_| TcpStream::connect(offered.address().socket()).unwrap()).collect();
        assert_eq!(offered.send(b"packet").unwrap(), MAX_CLIENTS);
    }
}
