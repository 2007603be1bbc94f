//! Sockets on the loopback interface, and the kernel's count of drops on them.

use std::io;
use std::net::SocketAddr;
use std::os::fd::AsRawFd;

use nix::errno::Errno;
use nix::sys::socket::{MsgFlags, SockaddrStorage, send, sendto, setsockopt, sockopt};
use tokio::net::UdpSocket;

use crate::loopback::LoopbackAddr;

/// Requested receive buffer, in bytes (the kernel may give less).
const RECEIVE_BUFFER: usize = 1 << 20;

/// A UDP socket bound at `address`; its bound address is checked again. Must be called inside a tokio runtime.
pub fn udp(address: LoopbackAddr) -> io::Result<UdpSocket> {
    UdpSocket::from_std(bound(address)?)
}

/// A UDP socket at `local`, with a port that the kernel chooses, connected to `peer`. Must be called inside a tokio runtime.
pub fn udp_to(local: LoopbackAddr, peer: LoopbackAddr) -> io::Result<UdpSocket> {
    let socket = bound(local)?;
    socket.connect(peer.socket())?;
    LoopbackAddr::try_from(socket.peer_addr()?).map_err(io::Error::other)?;
    UdpSocket::from_std(socket)
}

fn bound(address: LoopbackAddr) -> io::Result<std::net::UdpSocket> {
    let socket = std::net::UdpSocket::bind(address.socket())?;
    socket.set_nonblocking(true)?;
    LoopbackAddr::try_from(socket.local_addr()?).map_err(io::Error::other)?;
    setsockopt(&socket, sockopt::RcvBuf, &RECEIVE_BUFFER)?;
    Ok(socket)
}

/// Sends a datagram at once, to `to` or to the socket's one peer, or not at all. True when the kernel accepted it.
///
/// The runtime would first wait to see that the socket is writable, and so lose the first datagram of a new socket.
pub fn emit(socket: &UdpSocket, to: Option<LoopbackAddr>, bytes: &[u8]) -> bool {
    let attempt = || match to {
        Some(to) => sendto(socket.as_raw_fd(), bytes, &SockaddrStorage::from(to.socket()), MsgFlags::MSG_DONTWAIT),
        None => send(socket.as_raw_fd(), bytes, MsgFlags::MSG_DONTWAIT),
    };
    match attempt() {
        // The error of an earlier datagram to an absent peer; this datagram was not sent yet.
        Err(Errno::ECONNREFUSED) => attempt().is_ok(),
        outcome => outcome.is_ok(),
    }
}

/// Datagrams that the kernel has dropped on the UDP socket bound at `local`, by `/proc/net/udp`; `None` when the socket is not listed
/// there.
pub fn kernel_drops(local: LoopbackAddr) -> Option<u64> {
    let (table, address) = match local.socket() {
        SocketAddr::V4(v4) => {
            ("/proc/net/udp", format!("{:08X}:{:04X}", u32::from_ne_bytes(v4.ip().octets()), v4.port()))
        }
        SocketAddr::V6(v6) => {
            let words = v6.ip().octets();
            let words: String = words
                .chunks_exact(4)
                .map(|w| format!("{:08X}", u32::from_ne_bytes([w[0], w[1], w[2], w[3]])))
                .collect();
            ("/proc/net/udp6", format!("{words}:{:04X}", v6.port()))
        }
    };
    drops_in(&std::fs::read_to_string(table).ok()?, &address)
}

fn drops_in(table: &str, address: &str) -> Option<u64> {
    let rows = table.lines().filter(|row| row.split_whitespace().nth(1) == Some(address));
    let drops: Vec<u64> = rows.filter_map(|row| row.split_whitespace().last()?.parse().ok()).collect();
    if drops.is_empty() { None } else { Some(drops.iter().sum()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drops_column_is_read_from_the_right_row() {
        let table = "  sl  local_address rem_address st tx rx tr tm retr uid timeout inode ref pointer drops\n \
             10: 0100007F:1F90 00000000:0000 07 0:0 0:0 0 0 0 0 2 5 0 17\n \
             11: 0100007F:1F91 00000000:0000 07 0:0 0:0 0 0 0 0 2 6 0 3\n";
        assert_eq!(drops_in(table, "0100007F:1F90"), Some(17));
        assert_eq!(drops_in(table, "0100007F:0001"), None);
    }

    #[tokio::test]
    async fn own_socket_is_found_in_the_kernel_table() {
        let socket = udp(LoopbackAddr::ANY_PORT).unwrap();
        let local = LoopbackAddr::try_from(socket.local_addr().unwrap()).unwrap();
        assert_eq!(kernel_drops(local), Some(0));
    }
}
