//! A rogue end that verifies no peer and offers parameters that ours never would, over a path in memory only: the
//! adversary's side of a handshake. It takes no socket.

use std::sync::Arc;
use std::time::Duration;

use dtls::cipher_suite::CipherSuiteId;
use dtls::config::{ClientAuthType, Config, ExtendedMasterSecretType};
use dtls::conn::DTLSConn;
use wire::id::PeerId;

use crate::dtls::path::Path;
use crate::dtls::{DtlsError, HANDSHAKE_LIMIT, config};
use crate::pki::{Credential, dns_name};

/// Deviations of a rogue end; unmentioned behaviour is ours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Manner {
    /// Its certificate, whatever that is.
    #[default]
    Certificate,
    /// No certificate.
    NoCertificate,
    /// Another suite than ours, weaker: AES-128-CCM with a tag of eight bytes.
    ShortTag,
    /// Another suite than ours, older: AES-256-CBC with HMAC-SHA-1.
    Cbc,
    /// A pre-shared key in place of certificates.
    PreSharedKey,
    /// No extended master secret.
    NoMasterSecret,
}

/// Its association, where the other end let it have one.
pub struct Rogue(DTLSConn);

impl Rogue {
    /// Sends a record.
    ///
    /// # Errors
    /// When there is no association any more.
    pub async fn send(&self, record: &[u8]) -> Result<(), DtlsError> {
        self.0.write(record, Some(Duration::from_secs(1))).await?;
        Ok(())
    }
}

/// Dials `expected`, or listens where that is `None`.
pub(super) async fn open(
    path: Arc<Path>,
    credential: &Credential,
    manner: Manner,
    expected: Option<PeerId>,
) -> Result<Rogue, DtlsError> {
    let mut config = config(credential)?;
    config.insecure_skip_verify = true;
    config.client_auth = ClientAuthType::RequestClientCert;
    config.server_name = expected.map(dns_name).unwrap_or_default();
    bend(&mut config, manner);
    let opened = tokio::time::timeout(HANDSHAKE_LIMIT, DTLSConn::new(path, config, expected.is_some(), None)).await;
    Ok(Rogue(opened.map_err(|_| DtlsError::TooSlow)??))
}

fn bend(config: &mut Config, manner: Manner) {
    match manner {
        Manner::Certificate => {}
        Manner::NoCertificate => config.certificates.clear(),
        Manner::ShortTag => config.cipher_suites = vec![CipherSuiteId::Tls_Ecdhe_Ecdsa_With_Aes_128_Ccm_8],
        Manner::Cbc => config.cipher_suites = vec![CipherSuiteId::Tls_Ecdhe_Ecdsa_With_Aes_256_Cbc_Sha],
        Manner::PreSharedKey => {
            config.certificates.clear();
            config.cipher_suites = vec![CipherSuiteId::Tls_Psk_With_Aes_128_Gcm_Sha256];
            config.psk = Some(Arc::new(|_| Box::pin(async { Ok(vec![7; 16]) })));
            config.psk_identity_hint = Some(b"unit-a".to_vec());
        }
        Manner::NoMasterSecret => config.extended_master_secret = ExtendedMasterSecretType::Disable,
    }
}
