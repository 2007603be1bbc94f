//! The only address type that a socket of this workspace takes.
//!
//! A [`LoopbackAddr`] is a literal in `127.0.0.0/8` or `[::1]` with a port. Names are never resolved, and spellings
//! that some resolvers read as loopback (octal, hexadecimal, shortened, decimal, mapped) are refused. There is no
//! switch that lifts this. A bound socket's own and peer address are checked with the same type again.

use std::fmt;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A socket address on this machine's loopback interface.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LoopbackAddr(SocketAddr);

/// Reason for which an address was refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AddressRefused {
    /// Not an `address:port` literal at all: a name, an octal or shortened spelling, a missing port.
    #[error("`{0}` is not a literal address with a port")]
    NotLiteral(String),
    /// A literal, but not in `127.0.0.0/8` and not `[::1]`.
    #[error("{0} is not a loopback address")]
    NotLoopback(SocketAddr),
    /// A loopback address with an IPv6 scope or flow label, which no loopback socket has.
    #[error("{0} carries a scope or a flow label")]
    Scoped(SocketAddr),
}

impl LoopbackAddr {
    /// `127.0.0.1` with a port of the kernel's choice.
    pub const ANY_PORT: LoopbackAddr = LoopbackAddr(SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 0));

    /// `127.0.0.1` with this port.
    pub fn on_port(port: u16) -> Self {
        Self(SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port))
    }

    /// The address of the run with this `number` alone, with a port that the kernel chooses. Never in
    /// `127.0.0.0/16`, where the host's other programs are, and never on a wire between hosts.
    pub fn of_run(number: u32) -> Self {
        let [_, high, middle, low] = number.to_be_bytes();
        // The second byte is 1 to 253: the host's programs use 127.0, the wires between hosts 127.254.
        Self(SocketAddr::new(IpAddr::V4(Ipv4Addr::new(127, 1 + high % 253, middle, low)), 0))
    }

    /// The address of the host of this number on a wire between hosts ([`sandbox::wire`]), with a port of the kernel's choice.
    pub fn on_wire(number: u8) -> Self {
        Self(SocketAddr::new(IpAddr::V4(sandbox::wire::address(number)), 0))
    }

    /// True if `other`, with any port, belongs to the same run: at the same address, or on the same wire.
    pub fn is_host_of(self, other: SocketAddr) -> bool {
        let on_wire = |address: SocketAddr| sandbox::wire::is_on_wire(address.ip());
        self.0.ip() == other.ip() || on_wire(self.0) && on_wire(other)
    }

    /// For a socket call.
    pub fn socket(self) -> SocketAddr {
        self.0
    }

    /// The port; 0 asks the kernel for one.
    pub fn port(self) -> u16 {
        self.0.port()
    }
}

/// Checks that the loopback interface is up and a socket can be bound at `address`.
///
/// # Errors
///
/// The reason.
pub fn probe(address: LoopbackAddr) -> Result<(), String> {
    // Bit 0 of the interface's flags says that it is up.
    let flags = std::fs::read_to_string("/sys/class/net/lo/flags").ok();
    let value = flags.as_deref().and_then(|f| u32::from_str_radix(f.trim().trim_start_matches("0x"), 16).ok());
    if value.is_none_or(|flags| flags & 1 == 0) {
        return Err("down or unknown".to_owned());
    }
    std::net::UdpSocket::bind(address.socket()).map(|_| ()).map_err(|error| format!("{address}: {error}"))
}

impl TryFrom<SocketAddr> for LoopbackAddr {
    type Error = AddressRefused;

    fn try_from(addr: SocketAddr) -> Result<Self, AddressRefused> {
        match addr {
            SocketAddr::V4(v4) if v4.ip().is_loopback() => Ok(Self(addr)),
            SocketAddr::V6(v6) if v6.ip().is_loopback() => {
                if v6.scope_id() == 0 && v6.flowinfo() == 0 {
                    Ok(Self(addr))
                } else {
                    Err(AddressRefused::Scoped(addr))
                }
            }
            SocketAddr::V4(_) | SocketAddr::V6(_) => Err(AddressRefused::NotLoopback(addr)),
        }
    }
}

impl FromStr for LoopbackAddr {
    type Err = AddressRefused;

    fn from_str(text: &str) -> Result<Self, AddressRefused> {
        let addr: SocketAddr =
            text.parse().map_err(|_| AddressRefused::NotLiteral(text.chars().take(64).collect::<String>()))?;
        Self::try_from(addr)
    }
}

impl fmt::Display for LoopbackAddr {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl fmt::Debug for LoopbackAddr {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl Serialize for LoopbackAddr {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for LoopbackAddr {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = <std::borrow::Cow<'de, str>>::deserialize(deserializer)?;
        text.parse().map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loopback_literals_are_taken() {
        for text in ["127.0.0.1:0", "127.0.0.1:65535", "127.255.255.254:1", "127.1.2.3:8883", "[::1]:0", "[::1]:9"] {
            assert!(text.parse::<LoopbackAddr>().is_ok(), "{text}");
        }
        assert!("[0:0:0:0:0:0:0:1]:9".parse::<LoopbackAddr>().is_ok());
    }

    #[test]
    fn run_address_differs_from_the_hosts_programs() {
        for number in [0, 1, 0x00ff_ffff, u32::MAX] {
            let address = LoopbackAddr::of_run(number);
            assert!(LoopbackAddr::try_from(address.socket()).is_ok(), "{address}");
            assert!(!address.is_host_of(LoopbackAddr::ANY_PORT.socket()), "{address}");
        }
        assert!(!LoopbackAddr::of_run(1).is_host_of(LoopbackAddr::of_run(2).socket()));
        let (one, other) = (LoopbackAddr::on_wire(1), LoopbackAddr::on_wire(5));
        assert!(one.is_host_of(other.socket()), "hosts on a wire are of one run");
        for number in [0, 0x00fd_ffff, 0x00fc_0001, u32::MAX] {
            assert!(!one.is_host_of(LoopbackAddr::of_run(number).socket()), "{number}");
        }
    }

    #[test]
    fn every_other_spelling_is_refused() {
        const REFUSED: &[&str] = &[
            "",
            " ",
            ":",
            ":80",
            "80",
            "localhost",
            "localhost:80",
            "LOCALHOST:80",
            "localhost.:80",
            "localhost.localdomain:80",
            "ip6-localhost:80",
            "127.0.0.1",
            "::1",
            "[::1]",
            "::1:80",
            "127.0.0.1:",
            "127.0.0.1:-1",
            "127.0.0.1:65536",
            "127.0.0.1:0x50",
            "127.0.0.1:80 ",
            " 127.0.0.1:80",
            "127.0.0.1 :80",
            "127.0.0.1:80/",
            "127.0.0.1:80#",
            "http://127.0.0.1:80",
            "user@127.0.0.1:80",
            "127.0.0.1%lo:80",
            "0.0.0.0:80",
            "[::]:80",
            "[::0]:80",
            "0:80",
            "1.2.3.4:80",
            "10.0.0.1:80",
            "172.16.0.1:80",
            "192.168.0.1:80",
            "169.254.169.254:80",
            "224.0.0.1:80",
            "255.255.255.255:80",
            "126.255.255.255:80",
            "128.0.0.1:80",
            "127.1:80",
            "127.0.1:80",
            "127:80",
            "2130706433:80",
            "0x7f000001:80",
            "0x7f.0.0.1:80",
            "0177.0.0.1:80",
            "017700000001:80",
            "127.0.0.01:80",
            "127.00.0.1:80",
            "127.0.0.1.:80",
            "127.0.0.256:80",
            "127.0.0.-1:80",
            "[::ffff:127.0.0.1]:80",
            "[::ffff:7f00:1]:80",
            "[::ffff:8.8.8.8]:80",
            "[::ffff:0:127.0.0.1]:80",
            "[::127.0.0.1]:80",
            "[64:ff9b::7f00:1]:80",
            "[2002:7f00:1::]:80",
            "[fe80::1]:80",
            "[fe80::1%1]:80",
            "[::1%1]:80",
            "[fc00::1]:80",
            "[2001:db8::1]:80",
            "[ff02::1]:80",
            "[::2]:80",
            "[::1]80",
            "[::1]:",
            "::1]:80",
            "[127.0.0.1]:80",
            "127。0。0。1:80",
            "١٢٧.0.0.1:80",
            "127.0.0.1:80\n",
            "127.0.0.1\0:80",
        ];
        for text in REFUSED {
            assert!(text.parse::<LoopbackAddr>().is_err(), "{text:?} was taken");
        }
    }
}
