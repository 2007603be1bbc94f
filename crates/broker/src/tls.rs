//! The TLS front: what a client must prove before a byte of MQTT is read, and who it then is.
//!
//! TLS 1.3 only, both sides with a certificate of the run's own authority, no resumption. What the identity may do is
//! [`crate::acl`].

use std::sync::Arc;

use link::crypto;
use link::pki::{self, Credential, PkiError};
use rustls::ServerConfig;
use rustls::pki_types::CertificateDer;
use rustls::server::{NoServerSessionStorage, VerifierBuilderError, WebPkiClientVerifier};
use rustls::version::TLS13;
use thiserror::Error;
use tokio_rustls::TlsAcceptor;
use wire::id::PeerId;

use crate::gate::Denial;

/// Why a credential does not make a TLS server.
#[derive(Debug, Error)]
pub enum CredentialError {
    /// The authority's certificate does not read.
    #[error("authority: {0}")]
    Authority(#[from] PkiError),
    /// No client could be verified with it.
    #[error("client verifier: {0}")]
    Verifier(#[from] VerifierBuilderError),
    /// The certificate and its key do not fit, or not TLS 1.3.
    #[error("own certificate: {0}")]
    Own(#[from] rustls::Error),
}

/// An acceptor that serves with `credential` and requires a client certificate of the same authority.
pub(crate) fn acceptor(credential: &Credential) -> Result<TlsAcceptor, CredentialError> {
    let roots = Arc::new(credential.roots()?);
    let verifier = WebPkiClientVerifier::builder_with_provider(roots, crypto::provider()).build()?;
    let mut config = ServerConfig::builder_with_provider(crypto::provider())
        .with_protocol_versions(&[&TLS13])?
        .with_client_cert_verifier(verifier)
        .with_single_cert(credential.chain(), credential.key())?;
    config.session_storage = Arc::new(NoServerSessionStorage {});
    config.send_tls13_tickets = 0;
    Ok(TlsAcceptor::from(Arc::new(config)))
}

/// The one identity that a verified chain names.
pub(crate) fn principal(chain: Option<&[CertificateDer<'_>]>) -> Result<PeerId, Denial> {
    let leaf = chain.and_then(<[_]>::first).ok_or_else(|| Denial::Principal { got: "no certificate".to_owned() })?;
    pki::peer_of(leaf).map_err(|error| Denial::Principal { got: error.to_string() })
}
