//! Mutually authenticated DTLS 1.2 over a guarded datagram path.
//!
//! One suite (ECDHE-ECDSA, AES-128-GCM), extended master secret required, certificates on both sides, no pre-shared
//! keys, no resumption. The name in the peer's certificate becomes a [`PeerId`] here and nowhere else. DTLS is
//! anti-replay and not anti-delay: freshness is the gateway's business.
//!
//! [`dial`] opens and re-opens one session, [`listen`] accepts many; both report through [`SessionEvent`].

pub mod dial;
pub mod listen;
pub mod path;
pub mod session;

use std::sync::Arc;
use std::time::Duration;

use dtls::cipher_suite::CipherSuiteId;
use dtls::config::{ClientAuthType, Config, ExtendedMasterSecretType};
use dtls::conn::DTLSConn;
use dtls::crypto::{Certificate, CryptoPrivateKey, CryptoPrivateKeyKind};
use ring::rand::SystemRandom;
use ring::signature::{ECDSA_P256_SHA256_ASN1_SIGNING, EcdsaKeyPair};
use webrtc_util::conn::Conn;
use wire::id::PeerId;

use crate::guard::{GuardConn, GuardSettings};
use crate::loopback::AddressRefused;
use crate::pki::{Credential, PkiError, dns_name, peer_of, remaining_life};

pub use self::session::{SessionEvent, SessionHandle};

/// The largest application record, in bytes: the library does not fragment, and a record is one datagram.
pub const MAX_RECORD: usize = 1152;

/// Width of the library's replay window, in records.
pub const REPLAY_WINDOW: usize = 64;

/// How long a handshake may take.
pub const HANDSHAKE_LIMIT: Duration = Duration::from_secs(3);

/// Time between repeats of a handshake flight.
const FLIGHT_INTERVAL: Duration = Duration::from_millis(250);

/// Room for one datagram; the library's own buffer has this size.
pub(crate) const DATAGRAM: usize = 8192;

/// A session could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum DtlsError {
    /// Certificate trouble on either side.
    #[error(transparent)]
    Pki(#[from] PkiError),
    /// The library ended the handshake.
    #[error("handshake: {0}")]
    Handshake(#[from] dtls::Error),
    /// [`HANDSHAKE_LIMIT`] passed.
    #[error("handshake took longer than its limit")]
    TooSlow,
    /// The peer is authentic, but not who was dialled.
    #[error("dialled {expected}, reached {got}")]
    WrongPeer {
        /// Who was dialled.
        expected: PeerId,
        /// Who answered.
        got: PeerId,
    },
    /// The peer presented no certificate.
    #[error("peer presented no certificate")]
    NoCertificate,
    /// The socket.
    #[error("socket: {0}")]
    Io(#[from] std::io::Error),
    /// A socket that is not on the loopback interface.
    #[error(transparent)]
    Address(#[from] AddressRefused),
}

/// An established association.
pub struct Secure {
    conn: DTLSConn,
    peer: PeerId,
    life: Duration,
}

impl Secure {
    /// Who the handshake authenticated.
    pub fn peer(&self) -> PeerId {
        self.peer
    }

    /// How long both certificates stay valid, counted from completion.
    pub fn life(&self) -> Duration {
        self.life
    }

    /// The next application record.
    ///
    /// # Errors
    /// When the association has ended; it does not come back.
    pub async fn recv(&self) -> Result<Vec<u8>, DtlsError> {
        let mut buf = vec![0; DATAGRAM];
        let n = self.conn.read(&mut buf, None).await?;
        buf.truncate(n);
        Ok(buf)
    }

    /// Sends one application record of at most [`MAX_RECORD`] bytes.
    ///
    /// # Errors
    /// When the association has ended or the record is too long.
    pub async fn send(&self, record: &[u8]) -> Result<(), DtlsError> {
        if record.len() > MAX_RECORD {
            return Err(DtlsError::Handshake(dtls::Error::ErrBufferTooSmall));
        }
        self.conn.write(record, Some(Duration::from_secs(1))).await?;
        Ok(())
    }

    /// Ends the association with an authenticated notice.
    pub async fn close(&self) {
        if let Err(error) = self.conn.close().await {
            tracing::trace!(%error, "closing an association");
        }
    }
}

/// Opens an association to `expected` over `path`.
///
/// # Errors
/// Anything but a complete handshake with exactly that peer.
pub async fn client(
    path: Arc<dyn Conn + Send + Sync>,
    credential: &Credential,
    expected: PeerId,
    guard: GuardSettings,
) -> Result<Secure, DtlsError> {
    let mut config = config(credential)?;
    config.server_name = dns_name(expected);
    let secure = handshake(path, config, credential, true, guard).await?;
    if secure.peer == expected {
        Ok(secure)
    } else {
        secure.close().await;
        Err(DtlsError::WrongPeer { expected, got: secure.peer })
    }
}

/// Accepts an association over `path` from whoever holds a certificate of this run.
///
/// # Errors
/// Anything but a complete handshake with a named peer.
pub async fn server(
    path: Arc<dyn Conn + Send + Sync>,
    credential: &Credential,
    guard: GuardSettings,
) -> Result<Secure, DtlsError> {
    handshake(path, config(credential)?, credential, false, guard).await
}

async fn handshake(
    path: Arc<dyn Conn + Send + Sync>,
    config: Config,
    own: &Credential,
    is_client: bool,
    guard: GuardSettings,
) -> Result<Secure, DtlsError> {
    crate::crypto::init();
    let guard = Arc::new(GuardConn::new(path, guard));
    let through: Arc<dyn Conn + Send + Sync> = guard.clone();
    let conn = tokio::time::timeout(HANDSHAKE_LIMIT, DTLSConn::new(through, config, is_client, None))
        .await
        .map_err(|_| DtlsError::TooSlow)??;
    guard.complete();
    let chain = conn.connection_state().await.peer_certificates;
    let leaf = chain.first().ok_or(DtlsError::NoCertificate)?;
    let life = remaining_life(leaf)?.min(remaining_life(&own.cert_der)?);
    Ok(Secure { peer: peer_of(leaf)?, life, conn })
}

/// The pinned configuration of both ends.
fn config(credential: &Credential) -> Result<Config, DtlsError> {
    let key =
        EcdsaKeyPair::from_pkcs8(&ECDSA_P256_SHA256_ASN1_SIGNING, &credential.key_pkcs8_der, &SystemRandom::new())
            .map_err(|_| PkiError::Key)?;
    Ok(Config {
        certificates: vec![Certificate {
            certificate: credential.chain(),
            private_key: CryptoPrivateKey {
                kind: CryptoPrivateKeyKind::Ecdsa256(key),
                serialized_der: credential.key_pkcs8_der.clone(),
            },
        }],
        cipher_suites: vec![CipherSuiteId::Tls_Ecdhe_Ecdsa_With_Aes_128_Gcm_Sha256],
        client_auth: ClientAuthType::RequireAndVerifyClientCert,
        extended_master_secret: ExtendedMasterSecretType::Require,
        flight_interval: FLIGHT_INTERVAL,
        roots_cas: credential.roots()?,
        client_cas: credential.roots()?,
        mtu: 1200,
        replay_protection_window: REPLAY_WINDOW,
        ..Config::default()
    })
}
