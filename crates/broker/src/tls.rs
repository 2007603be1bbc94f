//! The TLS front: the authentication of a client before a byte of MQTT is read, and the client's identity.
//!
//! TLS 1.3 only, both sides with a certificate of the run's own authority, no resumption; `link::certificates` enforces
//! it. Rights of the identity are in [`crate::acl`].

use std::sync::Arc;

use link::certificates::list::Revocations;
use link::certificates::tls;
use link::pki::{self, Credential, PkiError};
use rustls::pki_types::CertificateDer;
use tokio_rustls::TlsAcceptor;
use wire::id::PeerId;

use crate::gate::Denial;

/// An acceptor that serves with `credential` and requires a client certificate of the same authority that is not on the
/// newest of `revocations`.
pub(crate) fn acceptor(credential: &Credential, revocations: &Revocations) -> Result<TlsAcceptor, PkiError> {
    Ok(TlsAcceptor::from(Arc::new(tls::server(credential, revocations)?)))
}

/// The one identity that a verified chain names.
pub(crate) fn principal(chain: Option<&[CertificateDer<'_>]>) -> Result<PeerId, Denial> {
    let leaf = chain.and_then(<[_]>::first).ok_or_else(|| Denial::Principal { got: "no certificate".to_owned() })?;
    pki::peer_of(leaf).map_err(|error| Denial::Principal { got: error.to_string() })
}
