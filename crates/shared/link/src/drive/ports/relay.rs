//! The relay part: the sockets of one path, of datagrams or of streams.

use crate::drive::{DriveError, Opened, Senders};
use crate::relay::{DatagramRelay, StreamRelay};
use crate::spec::ServiceSpec;

/// The path that the process relays.
pub(super) enum Relay {
    Absent,
    Datagrams(DatagramRelay),
    Streams(StreamRelay),
}

impl Relay {
    pub(super) fn open(spec: &ServiceSpec, senders: &Senders) -> Result<Self, DriveError> {
        let to = senders.relayed.clone();
        match spec.relay.as_ref().map(|path| (path.datagram, path.stream)) {
            None | Some((None, None)) => Ok(Relay::Absent),
            Some((Some(leg), None)) => {
                DatagramRelay::open(leg, spec.own, to).map(Relay::Datagrams).opened("datagram relay")
            }
            Some((None, Some(leg))) => StreamRelay::open(leg, to).map(Relay::Streams).opened("stream relay"),
            Some((Some(_), Some(_))) => Err("two paths in one process").opened("relay"),
        }
    }

    pub(super) fn datagrams(&self) -> Option<&DatagramRelay> {
        match self {
            Relay::Datagrams(relay) => Some(relay),
            Relay::Streams(_) | Relay::Absent => None,
        }
    }

    pub(super) fn streams(&self) -> Option<&StreamRelay> {
        match self {
            Relay::Streams(relay) => Some(relay),
            Relay::Datagrams(_) | Relay::Absent => None,
        }
    }
}
