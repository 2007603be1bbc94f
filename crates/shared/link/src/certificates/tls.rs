//! The pinned TLS 1.3 configuration of both ends of the command plane, with [`CertificateVerifier`] as their only verifier of certificates.

use std::sync::Arc;

use rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use rustls::pki_types::{CertificateDer, ServerName, UnixTime};
use rustls::server::NoServerSessionStorage;
use rustls::server::danger::{ClientCertVerified, ClientCertVerifier};
use rustls::version::TLS13;
use rustls::{ClientConfig, DigitallySignedStruct, DistinguishedName, Error, ServerConfig, SignatureScheme};
use wire::id::PeerId;

use super::list::Revocations;
use super::{CertificateVerifier, Presenter};
use crate::pki::{Credential, PkiError};

/// The client side: TLS 1.3, our certificate, and a listener that proves to be `expected`.
///
/// # Errors
/// When the credential is unusable.
pub fn client(credential: &Credential, expected: PeerId, revocations: &Revocations) -> Result<ClientConfig, PkiError> {
    let verifier =
        Arc::new(Verifier { checks: CertificateVerifier::new(credential, revocations)?, expected: Some(expected) });
    Ok(ClientConfig::builder_with_provider(crate::crypto::provider())
        .with_protocol_versions(&[&TLS13])?
        .dangerous()
        .with_custom_certificate_verifier(verifier)
        .with_client_auth_cert(credential.chain(), credential.key())?)
}

/// The server side: TLS 1.3, no resumption, a certificate of every client.
///
/// # Errors
/// When the credential is unusable.
pub fn server(credential: &Credential, revocations: &Revocations) -> Result<ServerConfig, PkiError> {
    let verifier = Arc::new(Verifier { checks: CertificateVerifier::new(credential, revocations)?, expected: None });
    let mut config = ServerConfig::builder_with_provider(crate::crypto::provider())
        .with_protocol_versions(&[&TLS13])?
        .with_client_cert_verifier(verifier)
        .with_single_cert(credential.chain(), credential.key())?;
    // A resumed session would skip the check of the client's certificate, and with it the revocation list.
    config.session_storage = Arc::new(NoServerSessionStorage {});
    config.send_tls13_tickets = 0;
    Ok(config)
}

/// [`CertificateVerifier`] in the interface of the TLS library.
#[derive(Debug)]
struct Verifier {
    checks: CertificateVerifier,
    /// The dialled peer; `None` at a listener.
    expected: Option<PeerId>,
}

fn tls13(
    message: &[u8],
    cert: &CertificateDer<'_>,
    dss: &DigitallySignedStruct,
) -> Result<HandshakeSignatureValid, Error> {
    let provider = crate::crypto::provider();
    rustls::crypto::verify_tls13_signature(message, cert, dss, &provider.signature_verification_algorithms)
}

fn schemes() -> Vec<SignatureScheme> {
    crate::crypto::provider().signature_verification_algorithms.supported_schemes()
}

fn tls12() -> Error {
    Error::General("TLS 1.2 is not spoken here".to_owned())
}

impl ClientCertVerifier for Verifier {
    fn root_hint_subjects(&self) -> &[DistinguishedName] {
        &[]
    }

    fn verify_client_cert(
        &self,
        leaf: &CertificateDer<'_>,
        more: &[CertificateDer<'_>],
        now: UnixTime,
    ) -> Result<ClientCertVerified, Error> {
        self.checks.verify(leaf, more, Presenter::Dialler, now).map(|_| ClientCertVerified::assertion())
    }

    fn verify_tls12_signature(
        &self,
        _: &[u8],
        _: &CertificateDer<'_>,
        _: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        Err(tls12())
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        cert: &CertificateDer<'_>,
        dss: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        tls13(message, cert, dss)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        schemes()
    }
}

impl ServerCertVerifier for Verifier {
    fn verify_server_cert(
        &self,
        leaf: &CertificateDer<'_>,
        more: &[CertificateDer<'_>],
        _: &ServerName<'_>,
        _: &[u8],
        now: UnixTime,
    ) -> Result<ServerCertVerified, Error> {
        let expected = self.expected.ok_or_else(|| Error::General("no peer was dialled".to_owned()))?;
        self.checks.verify(leaf, more, Presenter::Listener(expected), now).map(|_| ServerCertVerified::assertion())
    }

    fn verify_tls12_signature(
        &self,
        _: &[u8],
        _: &CertificateDer<'_>,
        _: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        Err(tls12())
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        cert: &CertificateDer<'_>,
        dss: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        tls13(message, cert, dss)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        schemes()
    }
}
