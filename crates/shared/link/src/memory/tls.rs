//! A TLS handshake between two ends in memory, without a clock: bytes go to and fro until neither end has more to say.

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

/// Rounds after which two ends that still have something to say are cut off.
const ROUNDS: usize = 64;

/// Behaviour of an end of the command plane.
#[derive(Clone, Debug)]
pub enum Manner {
    /// As ours do.
    Honest,
    /// With its certificate, whatever that is, and checking nobody's (a listener); as ours do (a dialler).
    Certificate,
    /// Without a certificate.
    NoCertificate,
    /// In TLS 1.2.
    Tls12,
}

/// One end.
#[derive(Clone, Debug)]
pub struct Party {
    /// Its certificate, and the authority that it checks others against.
    pub credential: Credential,
    /// Its revocation list, when that is a newer one than the certificate came with.
    pub list: Option<Vec<u8>>,
    /// Its behaviour.
    pub manner: Manner,
}

/// Result.
#[derive(Debug)]
pub struct Shaken {
    /// The peer as each end sees it, the dialling end first, or the refusal. `None` of an end that does not ask.
    pub ends: [Result<Option<PeerId>, Refused>; 2],
    /// Pieces sent by each end, the dialling end's first.
    pub said: [Vec<Vec<u8>>; 2],
    /// Pieces that arrived at each end.
    pub heard: [Vec<Vec<u8>>; 2],
    /// Data that the dialling end's application sent and the listening end's received.
    pub delivered: Vec<u8>,
}

/// Replaces a piece of a stream on its way from a side.
pub type Tap<'a> = &'a mut dyn FnMut(Side, Vec<u8>) -> Vec<u8>;

/// Shakes hands; once the dialling end thinks that it is done it says `greeting`.
///
/// # Errors
/// When an end's own credential is unusable.
pub fn shake(parties: [&Party; 2], expected: PeerId, greeting: &[u8], tap: Tap<'_>) -> Result<Shaken, PkiError> {
    let name = ServerName::try_from(dns_name(expected)).map_err(|_| PkiError::UnknownName(dns_name(expected)))?;
    let dialling = ClientConnection::new(Arc::new(client(parties[0], expected)?), name)?;
    let listening = ServerConnection::new(Arc::new(server(parties[1])?))?;
    let mut ends = [End::new(Connection::Client(dialling)), End::new(Connection::Server(listening))];
    let (mut said, mut heard) = <([Vec<Vec<u8>>; 2], [Vec<Vec<u8>>; 2])>::default();
    let mut greeted = false;
    for _ in 0..ROUNDS {
        let mut quiet = true;
        for (from, side) in [Side::Client, Side::Server].into_iter().enumerate() {
            let piece = ends[from].speak();
            if piece.is_empty() {
                continue;
            }
            quiet = false;
            said[from].push(piece.clone());
            let piece = tap(side, piece);
            if !piece.is_empty() {
                ends[1 - from].hear(&piece);
                heard[1 - from].push(piece);
            }
        }
        if !greeted && ends[0].done() {
            greeted = true;
            ends[0].say(greeting);
        } else if quiet {
            break;
        }
    }
    let delivered = ends[1].take();
    let [dialled, accepted] = ends;
    Ok(Shaken { ends: [dialled.peer(true), accepted.peer(asks(parties[1]))], said, heard, delivered })
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

    fn speak(&mut self) -> Vec<u8> {
        let mut piece = Vec::new();
        while self.tls.wants_write() && self.tls.write_tls(&mut piece).is_ok_and(|n| n > 0) {}
        piece
    }

    fn hear(&mut self, piece: &[u8]) {
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

    fn say(&mut self, words: &[u8]) {
        // The library's buffer is memory; a handshake that is done takes it.
        if std::io::Write::write_all(&mut self.tls.writer(), words).is_err() {
            tracing::trace!("a greeting was not taken");
        }
    }

    fn take(&mut self) -> Vec<u8> {
        let mut words = Vec::new();
        // The end of what there is comes as an error that says to wait for more.
        if let Err(error) = self.tls.reader().read_to_end(&mut words) {
            tracing::trace!(%error, "no more to read");
        }
        words
    }

    fn peer(self, asks: bool) -> Result<Option<PeerId>, Refused> {
        let leaf = self.tls.peer_certificates().and_then(<[_]>::first).map(|leaf| leaf.to_vec());
        if let Some(error) = &self.ended {
            return Err(Refused { fault: Fault::of_tls(error), got: error.to_string() });
        }
        if self.tls.is_handshaking() {
            return Err(Refused { fault: Fault::Handshake, got: "one that broke off".to_owned() });
        }
        if !asks {
            return Ok(None);
        }
        let leaf = leaf.ok_or_else(|| Refused { fault: Fault::Missing, got: "none".to_owned() })?;
        peer_of(&leaf).map(Some).map_err(|error| Refused { fault: Fault::NoName, got: error.to_string() })
    }
}

fn asks(party: &Party) -> bool {
    matches!(party.manner, Manner::Honest)
}

fn revocations(party: &Party) -> Result<Revocations, PkiError> {
    let held = Revocations::of(&party.credential)?;
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
    let own = &party.credential;
    match party.manner {
        Manner::Honest | Manner::Certificate => tls::client(own, expected, &revocations(party)?),
        Manner::NoCertificate => Ok(builder(&TLS13)?.with_no_client_auth()),
        Manner::Tls12 => Ok(builder(&TLS12)?.with_client_auth_cert(own.chain(), own.key())?),
    }
}

fn server(party: &Party) -> Result<ServerConfig, PkiError> {
    let version = match party.manner {
        Manner::Honest => return tls::server(&party.credential, &revocations(party)?),
        Manner::Certificate | Manner::NoCertificate => &TLS13,
        Manner::Tls12 => &TLS12,
    };
    let builder = ServerConfig::builder_with_provider(crate::crypto::provider()).with_protocol_versions(&[version])?;
    let own = &party.credential;
    Ok(builder.with_no_client_auth().with_single_cert(own.chain(), own.key())?)
}
