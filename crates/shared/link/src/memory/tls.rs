//! A TLS handshake between two ends in memory, without a clock: bytes are exchanged until neither end has more to send.

use std::io::{Cursor, Read};
use std::sync::Arc;

use rustls::pki_types::ServerName;
use rustls::version::{TLS12, TLS13};
use rustls::{ClientConfig, ClientConnection, Connection, ServerConfig, ServerConnection};
use wire::core::Side;
use wire::id::PeerId;

use crate::certificates::list::Revocations;
use crate::certificates::{Fault, Refused, tls};
use crate::pki::{Credential, PkiError, dns_name, peer_of};

/// Rounds after which two ends that still have bytes to send are cut off.
const ROUNDS: usize = 64;

/// Behaviour of an end of the command plane.
#[derive(Clone, Debug)]
pub enum Manner {
    /// The behaviour of ours.
    Honest,
    /// A listener presents any certificate and checks none; a dialler behaves as ours.
    Certificate,
    /// No certificate.
    NoCertificate,
    /// TLS 1.2.
    Tls12,
}

/// One end.
#[derive(Clone, Debug)]
pub struct Party {
    /// Its certificate, and the authority that it checks others against.
    pub credential: Credential,
    /// Its revocation list, where it is newer than the one in the credential.
    pub list: Option<Vec<u8>>,
    /// Its behaviour.
    pub manner: Manner,
}

/// Result.
#[derive(Debug)]
pub struct Shaken {
    /// The peer as each end sees it, the dialling end first, or the refusal. `None` for an end that checks no certificate.
    pub ends: [Result<Option<PeerId>, Refused>; 2],
    /// Pieces sent by each end, the dialling end's first.
    pub sent: [Vec<Vec<u8>>; 2],
    /// Pieces that arrived at each end.
    pub received: [Vec<Vec<u8>>; 2],
    /// Data that the dialling end's application sent and the listening end's received.
    pub delivered: Vec<u8>,
}

/// Replaces a piece of a stream on its way from a side.
pub type Tap<'a> = &'a mut dyn FnMut(Side, Vec<u8>) -> Vec<u8>;

/// Performs a handshake; when it is complete at the dialling end, that end sends `greeting`.
///
/// # Errors
/// When an end's own credential is unusable.
pub fn shake(parties: [&Party; 2], expected: PeerId, greeting: &[u8], tap: Tap<'_>) -> Result<Shaken, PkiError> {
    let name = ServerName::try_from(dns_name(expected)).map_err(|_| PkiError::UnknownName(dns_name(expected)))?;
    let dialling = ClientConnection::new(Arc::new(client(parties[0], expected)?), name)?;
    let listening = ServerConnection::new(Arc::new(server(parties[1])?))?;
    let mut ends = [End::new(Connection::Client(dialling)), End::new(Connection::Server(listening))];
    let (mut sent, mut received) = <([Vec<Vec<u8>>; 2], [Vec<Vec<u8>>; 2])>::default();
    let mut greeted = false;
    for _ in 0..ROUNDS {
        let mut quiet = true;
        for (from, side) in [Side::Client, Side::Server].into_iter().enumerate() {
            let piece = ends[from].output();
            if piece.is_empty() {
                continue;
            }
            quiet = false;
            sent[from].push(piece.clone());
            let piece = tap(side, piece);
            if !piece.is_empty() {
                ends[1 - from].receive(&piece);
                received[1 - from].push(piece);
            }
        }
        if !greeted && ends[0].done() {
            greeted = true;
            ends[0].send(greeting);
        } else if quiet {
            break;
        }
    }
    let delivered = ends[1].take();
    let [dialled, accepted] = ends;
    Ok(Shaken { ends: [dialled.peer(true), accepted.peer(checks_certificate(parties[1]))], sent, received, delivered })
}

/// One end's library, and its final error.
struct End {
    tls: Connection,
    ended: Option<rustls::Error>,
}

impl End {
    fn new(tls: Connection) -> Self {
        Self { tls, ended: None }
    }

    fn output(&mut self) -> Vec<u8> {
        let mut piece = Vec::new();
        while self.tls.wants_write() && self.tls.write_tls(&mut piece).is_ok_and(|n| n > 0) {}
        piece
    }

    fn receive(&mut self, piece: &[u8]) {
        let mut rest = Cursor::new(piece);
        while self.ended.is_none() && (rest.position() as usize) < piece.len() {
            if !self.tls.read_tls(&mut rest).is_ok_and(|n| n > 0) {
                return;
            }
            if let Err(error) = self.tls.process_new_packets() {
                self.ended = Some(error);
            }
        }
    }

    fn done(&self) -> bool {
        self.ended.is_none() && !self.tls.is_handshaking()
    }

    fn send(&mut self, data: &[u8]) {
        // The library's buffer is memory; after the handshake it accepts data.
        if std::io::Write::write_all(&mut self.tls.writer(), data).is_err() {
            tracing::trace!("a greeting was not taken");
        }
    }

    fn take(&mut self) -> Vec<u8> {
        let mut data = Vec::new();
        // At the end of the available data the library returns `WouldBlock`, which is no failure here.
        if let Err(error) = self.tls.reader().read_to_end(&mut data) {
            tracing::trace!(%error, "no more to read");
        }
        data
    }

    fn peer(self, checks: bool) -> Result<Option<PeerId>, Refused> {
        let leaf = self.tls.peer_certificates().and_then(<[_]>::first).map(|leaf| leaf.to_vec());
        if let Some(error) = &self.ended {
            return Err(Refused { fault: Fault::from_tls(error), got: error.to_string() });
        }
        if self.tls.is_handshaking() {
            return Err(Refused { fault: Fault::Handshake, got: "one that broke off".to_owned() });
        }
        if !checks {
            return Ok(None);
        }
        let leaf = leaf.ok_or_else(|| Refused { fault: Fault::Missing, got: "none".to_owned() })?;
        peer_of(&leaf).map(Some).map_err(|error| Refused { fault: Fault::NoName, got: error.to_string() })
    }
}

fn checks_certificate(party: &Party) -> bool {
    matches!(party.manner, Manner::Honest)
}

fn revocations(party: &Party) -> Result<Revocations, PkiError> {
    let held = Revocations::from_credential(&party.credential)?;
    if let Some(list) = &party.list {
        held.replace(list.clone())?;
    }
    Ok(held)
}

fn client(party: &Party, expected: PeerId) -> Result<ClientConfig, PkiError> {
    let builder = |version| {
        let builder = ClientConfig::builder_with_provider(crate::crypto::provider());
        let builder = builder.with_protocol_versions(&[version])?;
        Ok::<_, PkiError>(builder.with_root_certificates(party.credential.roots()?))
    };
    let credential = &party.credential;
    match party.manner {
        Manner::Honest | Manner::Certificate => tls::client(credential, expected, &revocations(party)?),
        Manner::NoCertificate => Ok(builder(&TLS13)?.with_no_client_auth()),
        Manner::Tls12 => Ok(builder(&TLS12)?.with_client_auth_cert(credential.chain(), credential.key())?),
    }
}

fn server(party: &Party) -> Result<ServerConfig, PkiError> {
    let version = match party.manner {
        Manner::Honest => return tls::server(&party.credential, &revocations(party)?),
        Manner::Certificate | Manner::NoCertificate => &TLS13,
        Manner::Tls12 => &TLS12,
    };
    let builder = ServerConfig::builder_with_provider(crate::crypto::provider()).with_protocol_versions(&[version])?;
    let credential = &party.credential;
    Ok(builder.with_no_client_auth().with_single_cert(credential.chain(), credential.key())?)
}
