//! Rights of one connection, for a peer that the handshake has authenticated.
//!
//! There is one gate for each connection and it holds the peer, so no decision rests on a client's word about itself:
//! a client id or a user name is only compared, never believed. Rights come from [`crate::acl`]; the handshake is
//! `tls`, and counting connections is [`crate::server`].

use std::future::ready;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};

use link::certificates::Refused;
use mqtt5::broker::auth::{AuthProvider, AuthResult};
use mqtt5::packet::connect::ConnectPacket;
use mqtt5::protocol::v5::reason_codes::ReasonCode;
use thiserror::Error;
use tokio::sync::mpsc;
use wire::id::{ByPeer, PeerId};
use wire::policy::Requirement;

use crate::acl::{self, Refusal};

/// The one protocol level that is spoken, as in CONNECT.
pub const PROTOCOL_LEVEL: u8 = 5;

/// The most refusals of one connection that are reported one by one; those beyond are counted as lost events.
pub const MAX_DENIALS_TOLD: u32 = 256;

/// Event of the live broker, for its log and for tests.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// `peer` holds a session.
    Admitted {
        /// Peer that the handshake authenticated.
        peer: PeerId,
    },
    /// `peer` was admitted while a session of the same identity stood: that one is over.
    TakenOver {
        /// Peer that the handshake authenticated, both times.
        peer: PeerId,
    },
    /// A session of `peer` has ended.
    Closed {
        /// Peer that the handshake authenticated.
        peer: PeerId,
    },
    /// Something was refused.
    Denied(Denial),
}

/// Reason that the live broker refused a connection or a packet.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Denial {
    /// The broker has as many connections as are allowed.
    #[error("expected at most {expected} connections, got one more")]
    Connections {
        /// Most connections of the broker.
        expected: usize,
    },
    /// The identity has as many connections as are allowed: its session, and a second one that takes the session over.
    #[error("expected at most {expected} connections of {peer}, got one more")]
    ConnectionsOfPeer {
        /// Peer of the certificate.
        peer: PeerId,
        /// Most connections of one identity.
        expected: usize,
    },
    /// The TLS handshake was refused: no certificate, a foreign one, a wrong version; the fault has its own name.
    #[error("expected {}, got: {}", .0.fault.expected(), .0.got)]
    Handshake(Refused),
    /// The certificate of an open session has been revoked or has ended.
    #[error("expected {} of {peer} all along, got: {}", refused.fault.expected(), refused.got)]
    Dismissed {
        /// Peer that the handshake authenticated.
        peer: PeerId,
        /// Reason of the present refusal.
        refused: Refused,
    },
    /// The TLS handshake did not finish in time.
    #[error("expected a complete handshake in time, got a silent or slow peer")]
    HandshakeTimeout,
    /// The certificate does not name one identity of the closed set.
    #[error("expected a certificate with one urn:holdsafe name, got {got}")]
    Principal {
        /// Name that it gives instead.
        got: String,
    },
    /// A protocol level other than MQTT 5.
    #[error("expected MQTT protocol level {PROTOCOL_LEVEL} of {peer}, got {got}")]
    ProtocolLevel {
        /// Peer that the handshake authenticated.
        peer: PeerId,
        /// The level in CONNECT.
        got: u8,
    },
    /// The client calls itself something other than its certificate does.
    #[error("expected client id {expected}, got `{got}`")]
    ClientId {
        /// Peer that the handshake authenticated.
        expected: PeerId,
        /// The client id in CONNECT.
        got: String,
    },
    /// The client has a will, which would be published in the peer's name after its session has ended.
    #[error("expected no will of {peer}, got one for `{got}`")]
    Will {
        /// Peer that the handshake authenticated.
        peer: PeerId,
        /// The topic of the will.
        got: String,
    },
    /// The table of rights does not grant the topic or filter to `peer`.
    #[error("{refusal} (session of {peer})")]
    Access {
        /// Peer that the handshake authenticated.
        peer: PeerId,
        /// Refusal of the table.
        refusal: Refusal,
    },
}

impl Denial {
    /// The name of the refusal, as in logs and documents.
    pub fn name(&self) -> &'static str {
        match self {
            Denial::Connections { .. } => "connections",
            Denial::ConnectionsOfPeer { .. } => "connections_of_peer",
            Denial::Handshake(refused) | Denial::Dismissed { refused, .. } => refused.fault.name(),
            Denial::HandshakeTimeout => "handshake_timeout",
            Denial::Principal { .. } => "principal",
            Denial::ProtocolLevel { .. } => "protocol_level",
            Denial::ClientId { .. } => "client_id",
            Denial::Will { .. } => "will",
            Denial::Access { refusal, .. } => refusal.name(),
        }
    }

    /// The MQTT reason code that a refused CONNECT is answered with.
    fn reason(&self) -> ReasonCode {
        match self {
            Denial::ProtocolLevel { .. } => ReasonCode::UnsupportedProtocolVersion,
            Denial::ClientId { .. } => ReasonCode::ClientIdentifierNotValid,
            Denial::Connections { .. }
            | Denial::ConnectionsOfPeer { .. }
            | Denial::Handshake(_)
            | Denial::Dismissed { .. }
            | Denial::HandshakeTimeout
            | Denial::Principal { .. }
            | Denial::Will { .. }
            | Denial::Access { .. } => ReasonCode::NotAuthorized,
        }
    }
}

/// Destination of events: a bounded queue that never makes the broker wait. Events beyond its room are counted.
#[derive(Clone)]
pub(crate) struct Events {
    queue: mpsc::Sender<Event>,
    lost: Arc<AtomicU64>,
}

impl Events {
    /// A queue of `length` events.
    pub(crate) fn queue(length: usize) -> (Self, mpsc::Receiver<Event>) {
        let (queue, events) = mpsc::channel(length);
        (Self { queue, lost: Arc::new(AtomicU64::new(0)) }, events)
    }

    /// Notes an event.
    pub(crate) fn note(&self, event: Event) {
        if self.queue.try_send(event).is_err() {
            self.lose();
        }
    }

    /// Counts an event that is not reported.
    pub(crate) fn lose(&self) {
        self.lost.fetch_add(1, Ordering::Relaxed);
    }

    /// Number of events that were not reported; readable after the queue has ended.
    pub(crate) fn lost(&self) -> Arc<AtomicU64> {
        Arc::clone(&self.lost)
    }
}

/// Number of connections of each identity that have been admitted and stand.
pub(crate) type OpenSessions = Arc<ByPeer<AtomicU32>>;

/// The gate of one connection.
pub(crate) struct Gate {
    peer: PeerId,
    rights: Requirement,
    events: Events,
    open: OpenSessions,
    admitted: AtomicBool,
    denials: AtomicU32,
}

impl Gate {
    /// The gate of a connection that the handshake has tied to `peer`.
    pub(crate) fn new(peer: PeerId, rights: Requirement, events: Events, open: OpenSessions) -> Self {
        Self { peer, rights, events, open, admitted: AtomicBool::new(false), denials: AtomicU32::new(0) }
    }

    /// Admits the session; one of the same identity that stood before is taken over.
    fn admit(&self) {
        let first = !self.admitted.swap(true, Ordering::Relaxed);
        if first && self.open[self.peer].fetch_add(1, Ordering::Relaxed) > 0 {
            self.events.note(Event::TakenOver { peer: self.peer });
        }
        self.events.note(Event::Admitted { peer: self.peer });
    }

    /// Peer of the session, once admitted.
    pub(crate) fn admitted(&self) -> Option<PeerId> {
        self.admitted.load(Ordering::Relaxed).then_some(self.peer)
    }

    fn check_connect(&self, connect: &ConnectPacket) -> Result<(), Denial> {
        let peer = self.peer;
        if connect.protocol_version != PROTOCOL_LEVEL {
            return Err(Denial::ProtocolLevel { peer, got: connect.protocol_version });
        }
        // A session belongs to a client id: under another's id a peer would end that session and take its place.
        if connect.client_id != peer.to_string() {
            return Err(Denial::ClientId { expected: peer, got: shown(&connect.client_id) });
        }
        match &connect.will {
            Some(will) => Err(Denial::Will { peer, got: shown(&will.topic) }),
            None => Ok(()),
        }
    }

    fn granted<T>(&self, requested: Result<T, Refusal>) -> bool {
        let result = acl::apply_policy(self.rights, requested.map(drop));
        result.map_err(|refusal| self.deny(Denial::Access { peer: self.peer, refusal })).is_ok()
    }

    fn deny(&self, denial: Denial) {
        if self.denials.fetch_add(1, Ordering::Relaxed) < MAX_DENIALS_TOLD {
            self.events.note(Event::Denied(denial));
        } else {
            self.events.lose();
        }
    }
}

impl Drop for Gate {
    fn drop(&mut self) {
        if self.admitted().is_some() {
            self.open[self.peer].fetch_sub(1, Ordering::Relaxed);
        }
    }
}

type Answer<'a, T> = Pin<Box<dyn Future<Output = T> + Send + 'a>>;

impl AuthProvider for Gate {
    fn authenticate<'a>(
        &'a self,
        connect: &'a ConnectPacket,
        _: SocketAddr,
    ) -> Answer<'a, mqtt5::error::Result<AuthResult>> {
        let result = match self.check_connect(connect) {
            Ok(()) => {
                self.admit();
                AuthResult::success_with_user(self.peer.to_string())
            }
            Err(denial) => {
                let reason = denial.reason();
                self.deny(denial);
                AuthResult::fail(reason)
            }
        };
        Box::pin(ready(Ok(result)))
    }

    fn authorize_publish<'a>(&'a self, _: &str, _: Option<&'a str>, topic: &'a str) -> Answer<'a, bool> {
        Box::pin(ready(self.granted(acl::permit_topic(self.peer, topic))))
    }

    fn authorize_subscribe<'a>(&'a self, _: &str, _: Option<&'a str>, topic_filter: &'a str) -> Answer<'a, bool> {
        Box::pin(ready(self.granted(acl::permit_filter(self.peer, topic_filter))))
    }
}

/// The first characters of a text that a client chose, for a log line of bounded length.
fn shown(text: &str) -> String {
    text.chars().take(acl::MAX_TOPIC_LEN).collect()
}
