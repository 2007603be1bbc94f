//! Certificate verification: the peer that a certificate proves, or the fault; the one check of both links and both
//! their ends.
//!
//! DTLS and TLS call it at every handshake, and again for a standing session when the revocation list changes. Each
//! refusal is one [`Fault`] with the expected and the received value. Permissions of the proven name are left to the
//! cores.

pub mod list;
pub mod tls;

use std::fmt;
use std::sync::Arc;

use minicbor::{Decode, Encode};
use rustls::client::WebPkiServerVerifier;
use rustls::client::danger::ServerCertVerifier;
use rustls::pki_types::{CertificateDer, ServerName, UnixTime};
use rustls::server::WebPkiClientVerifier;
use rustls::server::danger::ClientCertVerifier;
use rustls::{CertificateError, RootCertStore};
use serde::Serialize;
use wire::id::PeerId;
use wire::refusal::Reason;
use x509_parser::prelude::{FromDer, X509Certificate};

use self::list::Revocations;
use crate::pki::{Credential, PkiError, dns_name, peer_of};

/// Reason for which a handshake was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Encode, Decode, Serialize)]
#[cbor(index_only)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// No certificate.
    #[n(0)]
    Missing,
    /// Self-signed.
    #[n(1)]
    SelfSigned,
    /// Issued by another authority.
    #[n(2)]
    Foreign,
    /// No longer valid.
    #[n(3)]
    Expired,
    /// Not valid yet.
    #[n(4)]
    NotYetValid,
    /// On the revocation list.
    #[n(5)]
    Revoked,
    /// Not for this end of a handshake.
    #[n(6)]
    WrongRole,
    /// Issued to another identity than the dialled one.
    #[n(7)]
    WrongName,
    /// Issued to no identity, to several, or to one outside the table.
    #[n(8)]
    NoName,
    /// Not a certificate that can be read.
    #[n(9)]
    Broken,
    /// No valid revocation list.
    #[n(10)]
    NoList,
    /// Another version of the protocol.
    #[n(11)]
    Version,
    /// No cipher suite that this end allows.
    #[n(12)]
    Suite,
    /// Without the extended master secret.
    #[n(13)]
    MasterSecret,
    /// The handshake broke off, or its messages are inconsistent.
    #[n(14)]
    Handshake,
}

impl Fault {
    /// Every fault.
    pub const ALL: [Fault; 15] = [
        Fault::Missing,
        Fault::SelfSigned,
        Fault::Foreign,
        Fault::Expired,
        Fault::NotYetValid,
        Fault::Revoked,
        Fault::WrongRole,
        Fault::WrongName,
        Fault::NoName,
        Fault::Broken,
        Fault::NoList,
        Fault::Version,
        Fault::Suite,
        Fault::MasterSecret,
        Fault::Handshake,
    ];

    /// Its name in logs and documents.
    pub fn name(self) -> &'static str {
        match self {
            Fault::Missing => "missing",
            Fault::SelfSigned => "self_signed",
            Fault::Foreign => "foreign",
            Fault::Expired => "expired",
            Fault::NotYetValid => "not_yet_valid",
            Fault::Revoked => "revoked",
            Fault::WrongRole => "wrong_role",
            Fault::WrongName => "wrong_name",
            Fault::NoName => "no_name",
            Fault::Broken => "broken",
            Fault::NoList => "no_list",
            Fault::Version => "version",
            Fault::Suite => "suite",
            Fault::MasterSecret => "master_secret",
            Fault::Handshake => "handshake",
        }
    }

    /// The expected value, in words.
    pub fn expected(self) -> &'static str {
        match self {
            Fault::Missing => "a certificate",
            Fault::SelfSigned | Fault::Foreign => "one of this run's authority",
            Fault::Expired | Fault::NotYetValid => "one that is valid now",
            Fault::Revoked => "one that is not on the list",
            Fault::WrongRole => "one for this end of a handshake",
            Fault::WrongName => "one of who was dialled",
            Fault::NoName => "one with one urn:holdsafe name",
            Fault::Broken => "a readable certificate",
            Fault::NoList => "a valid revocation list",
            Fault::Version => "DTLS 1.2, TLS 1.3",
            Fault::Suite => "the one suite",
            Fault::MasterSecret => "extended master secret",
            Fault::Handshake => "a whole handshake",
        }
    }

    /// The reason that it is counted under.
    pub fn reason(self) -> Reason {
        match self {
            Fault::Version | Fault::Suite | Fault::MasterSecret | Fault::Handshake => Reason::Handshake,
            Fault::Missing
            | Fault::SelfSigned
            | Fault::Foreign
            | Fault::Expired
            | Fault::NotYetValid
            | Fault::Revoked
            | Fault::WrongRole
            | Fault::WrongName
            | Fault::NoName
            | Fault::Broken
            | Fault::NoList => Reason::Certificate,
        }
    }

    /// The fault behind a TLS library's error.
    #[expect(clippy::wildcard_enum_match_arm, reason = "the library may say more some day; it is a broken handshake")]
    pub fn from_tls(error: &rustls::Error) -> Self {
        use rustls::Error as E;
        use rustls::{AlertDescription as Alert, PeerIncompatible as P};
        match error {
            E::InvalidCertificate(wrong) => Self::from_certificate_error(wrong),
            E::NoCertificatesPresented | E::AlertReceived(Alert::CertificateRequired) => Fault::Missing,
            E::PeerIncompatible(
                P::Tls12NotOffered
                | P::Tls12NotOfferedOrEnabled
                | P::Tls13RequiredForQuic
                | P::SupportedVersionsExtensionRequired
                | P::ServerDoesNotSupportTls12Or13
                | P::ServerTlsVersionIsDisabledByOurConfig,
            )
            | E::AlertReceived(Alert::ProtocolVersion) => Fault::Version,
            E::PeerIncompatible(P::NoCipherSuitesInCommon) => Fault::Suite,
            _ => Fault::Handshake,
        }
    }

    #[expect(clippy::wildcard_enum_match_arm, reason = "the library may say more some day; it is a broken certificate")]
    fn from_certificate_error(wrong: &CertificateError) -> Self {
        use CertificateError as C;
        match wrong {
            C::Expired | C::ExpiredContext { .. } => Fault::Expired,
            C::NotValidYet | C::NotValidYetContext { .. } => Fault::NotYetValid,
            C::Revoked => Fault::Revoked,
            // Another authority may have the name of this run's; then its signature does not verify.
            C::UnknownIssuer | C::BadSignature => Fault::Foreign,
            C::InvalidPurpose | C::InvalidPurposeContext { .. } => Fault::WrongRole,
            C::NotValidForName | C::NotValidForNameContext { .. } => Fault::WrongName,
            C::UnknownRevocationStatus | C::ExpiredRevocationList | C::ExpiredRevocationListContext { .. } => {
                Fault::NoList
            }
            C::Other(other) => other.0.downcast_ref().map_or(Fault::Broken, |refused: &Refused| refused.fault),
            _ => Fault::Broken,
        }
    }
}

/// True if a certificate names its own subject as its issuer.
fn signs_itself(leaf: &[u8]) -> bool {
    X509Certificate::from_der(leaf).is_ok_and(|(_, leaf)| leaf.subject() == leaf.issuer())
}

/// A refused handshake: the fault, and the received value.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct Refused {
    /// The fault.
    pub fault: Fault,
    /// The received value, as the library or this crate describes it.
    pub got: String,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: expected {}, got: {}", self.fault.name(), self.fault.expected(), self.got)
    }
}

impl Refused {
    fn missing() -> Self {
        Self { fault: Fault::Missing, got: "none".to_owned() }
    }

    fn from_tls(error: &rustls::Error) -> Self {
        Self { fault: Fault::from_tls(error), got: error.to_string() }
    }
}

/// Which end of a handshake the presenter of a certificate is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presenter {
    /// It dialled us.
    Dialler,
    /// We dialled it, and expect this name.
    Listener(PeerId),
}

/// The check of one end of one link.
#[derive(Clone, Debug)]
pub struct CertificateVerifier {
    roots: Arc<RootCertStore>,
    revocations: Revocations,
}

impl CertificateVerifier {
    /// A check against the authority of `credential` and the newest of `revocations`.
    ///
    /// # Errors
    /// When the authority's certificate does not read.
    pub fn new(credential: &Credential, revocations: &Revocations) -> Result<Self, PkiError> {
        Ok(Self { roots: Arc::new(credential.roots()?), revocations: revocations.clone() })
    }

    /// The peer that the presented chain (leaf first) proves.
    ///
    /// # Errors
    ///
    /// The one fault for which it is refused.
    pub fn check(&self, chain: &[CertificateDer<'_>], presenter: Presenter) -> Result<PeerId, Refused> {
        let (leaf, more) = chain.split_first().ok_or_else(Refused::missing)?;
        self.verify(leaf, more, presenter, UnixTime::now()).map_err(|error| Refused::from_tls(&error))
    }

    /// The peer, or the refusal as an error of the TLS library, which it reports to its peer; a refusal that the library does not know
    /// is inside.
    fn verify(
        &self,
        leaf: &CertificateDer<'_>,
        more: &[CertificateDer<'_>],
        presenter: Presenter,
        now: UnixTime,
    ) -> Result<PeerId, rustls::Error> {
        let wrapped =
            |refused| rustls::Error::InvalidCertificate(CertificateError::Other(rustls::OtherError(Arc::new(refused))));
        match self.chain(leaf, more, presenter, now) {
            Err(rustls::Error::InvalidCertificate(CertificateError::UnknownIssuer)) if signs_itself(leaf) => {
                Err(wrapped(Refused { fault: Fault::SelfSigned, got: "one of nobody but itself".to_owned() }))
            }
            Err(error) => Err(error),
            Ok(()) => peer_of(leaf).map_err(|e| wrapped(Refused { fault: Fault::NoName, got: e.to_string() })),
        }
    }

    fn chain(
        &self,
        leaf: &CertificateDer<'_>,
        more: &[CertificateDer<'_>],
        presenter: Presenter,
        now: UnixTime,
    ) -> Result<(), rustls::Error> {
        let general = |error: &dyn fmt::Display| rustls::Error::General(error.to_string());
        match presenter {
            Presenter::Dialler => {
                self.dialler_verifier().map_err(|e| general(&e))?.verify_client_cert(leaf, more, now).map(|_| ())
            }
            Presenter::Listener(expected) => {
                let name = ServerName::try_from(dns_name(expected)).map_err(|e| general(&e))?;
                let verifier = self.listener_verifier().map_err(|e| general(&e))?;
                verifier.verify_server_cert(leaf, more, &name, &[], now).map(|_| ())
            }
        }
    }

    fn dialler_verifier(&self) -> Result<Arc<dyn ClientCertVerifier>, rustls::server::VerifierBuilderError> {
        WebPkiClientVerifier::builder_with_provider(self.roots.clone(), crate::crypto::provider())
            .with_crls([self.revocations.der()])
            .enforce_revocation_expiration()
            .build()
    }

    fn listener_verifier(&self) -> Result<Arc<WebPkiServerVerifier>, rustls::server::VerifierBuilderError> {
        WebPkiServerVerifier::builder_with_provider(self.roots.clone(), crate::crypto::provider())
            .with_crls([self.revocations.der()])
            .enforce_revocation_expiration()
            .build()
    }
}
