//! Mutually authenticated DTLS 1.2 over a guarded datagram path.
//!
//! One suite (ECDHE-ECDSA, AES-128-GCM), extended master secret required, certificates on both sides, no pre-shared
//! keys, no resumption. The name in the peer's certificate becomes a [`PeerId`] here and nowhere else. DTLS is
//! anti-replay and not anti-delay: freshness is the gateway's business.
//!
//! [`dial`] opens and re-opens one session, [`listen`] accepts many; both report through [`SessionEvent`].

mod cookie_retry;
pub mod dial;
pub mod listen;
pub mod path;
pub mod session;

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use dtls::cipher_suite::CipherSuiteId;
use dtls::config::{ClientAuthType, Config, ExtendedMasterSecretType};
use dtls::conn::DTLSConn;
use dtls::crypto::{Certificate, CryptoPrivateKey, CryptoPrivateKeyKind};
use ring::rand::SystemRandom;
use ring::signature::{ECDSA_P256_SHA256_ASN1_SIGNING, EcdsaKeyPair};
use rustls::pki_types::CertificateDer;
use webrtc_util::conn::Conn;
use wire::id::PeerId;

use crate::certificates::list::Revocations;
use crate::certificates::{CertificateVerifier, Fault, Presenter, Refused};
use crate::guard::{GuardConn, GuardSettings};
use crate::loopback::AddressRefused;
use crate::pki::{Credential, PkiError, dns_name, remaining_life};

pub use self::session::{SessionEvent, SessionHandle};

/// The largest application record, in bytes: the library does not fragment, and a record is one datagram.
pub const MAX_RECORD: usize = 1152;

/// Width of the library's replay window, in records.
pub const REPLAY_WINDOW: usize = 64;

/// Time limit of a handshake.
pub const HANDSHAKE_LIMIT: Duration = Duration::from_secs(3);

/// Time without a record after which the dialling end ends a session and opens another.
pub const DIAL_IDLE: Duration = Duration::from_secs(2);

/// Time without a record after which the listening end ends a session.
pub const LISTEN_IDLE: Duration = Duration::from_secs(30);

/// Time between repeats of a handshake flight.
pub const FLIGHT_INTERVAL: Duration = Duration::from_millis(250);

/// Room for one datagram; the library's own buffer has this size.
pub(crate) const DATAGRAM: usize = 8192;

/// A session could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum DtlsError {
    /// A certificate is unusable, on either side.
    #[error(transparent)]
    Pki(#[from] PkiError),
    /// The library ended the handshake.
    #[error("handshake: {0}")]
    Handshake(#[from] dtls::Error),
    /// [`HANDSHAKE_LIMIT`] passed.
    #[error("handshake took longer than its limit")]
    TooSlow,
    /// The peer's certificate is refused.
    #[error(transparent)]
    Refused(#[from] Refused),
    /// The socket.
    #[error("socket: {0}")]
    Io(#[from] std::io::Error),
    /// A socket that is not on the loopback interface.
    #[error(transparent)]
    Address(#[from] AddressRefused),
}

impl DtlsError {
    /// Fault for which the peer was refused; `None` if it was slow or not reached.
    #[expect(clippy::wildcard_enum_match_arm, reason = "the library has a hundred errors; most are a broken handshake")]
    pub fn fault(&self) -> Option<Fault> {
        use dtls::Error as E;
        match self {
            DtlsError::Refused(refused) => Some(refused.fault),
            DtlsError::Handshake(error) => Some(match error {
                E::ErrUnsupportedProtocolVersion => Fault::Version,
                E::ErrCipherSuiteNoIntersection | E::ErrInvalidCipherSuite | E::ErrCipherSuiteUnset => Fault::Suite,
                E::ErrServerRequiredButNoClientEms | E::ErrClientRequiredButNoServerEms => Fault::MasterSecret,
                E::ErrClientCertificateRequired | E::ErrCertificateVerifyNoCertificate => Fault::Missing,
                _ => Fault::Handshake,
            }),
            DtlsError::Pki(_) | DtlsError::TooSlow | DtlsError::Io(_) | DtlsError::Address(_) => None,
        }
    }
}

/// An established association.
pub struct Secure {
    conn: DTLSConn,
    peer: PeerId,
    life: Duration,
    chain: Vec<Vec<u8>>,
    verifier: CertificateVerifier,
    presenter: Presenter,
}

impl Secure {
    /// The authenticated peer.
    pub fn peer(&self) -> PeerId {
        self.peer
    }

    /// Remaining validity of both certificates, counted from completion.
    pub fn life(&self) -> Duration {
        self.life
    }

    /// Checks the peer's certificate again, after a change of the revocation list.
    ///
    /// # Errors
    /// The refusal.
    pub fn verify_peer(&self) -> Result<PeerId, Refused> {
        check(&self.verifier, &self.chain, self.presenter)
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

    /// Secret from which both ends derive their keys, for a test that searches for leaks of it.
    pub(crate) async fn master_secret(&self) -> Result<Vec<u8>, DtlsError> {
        Ok(self.conn.connection_state().await.key_log_data()?.master_secret)
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
    revocations: Revocations,
    guard: GuardSettings,
) -> Result<Secure, DtlsError> {
    let mut config = config(credential)?;
    config.server_name = dns_name(expected);
    let trust = Trust { credential, revocations, presenter: Presenter::Listener(expected) };
    handshake(path, config, trust, guard).await
}

/// Accepts an association over `path` from any holder of a certificate of this run.
///
/// # Errors
///
/// Anything but a complete handshake with a named peer.
pub async fn server(
    path: Arc<dyn Conn + Send + Sync>,
    credential: &Credential,
    revocations: Revocations,
    guard: GuardSettings,
) -> Result<Secure, DtlsError> {
    let trust = Trust { credential, revocations, presenter: Presenter::Dialler };
    handshake(path, config(credential)?, trust, guard).await
}

/// An end's credential and revocation list for a handshake, and the peer that it expects.
struct Trust<'a> {
    credential: &'a Credential,
    revocations: Revocations,
    presenter: Presenter,
}

/// Performs a handshake with [`CertificateVerifier`] in place of the library's check, which can neither read a revocation list nor name
/// the fault of a certificate. The library calls it back; after the handshake this function checks that it did.
async fn handshake(
    path: Arc<dyn Conn + Send + Sync>,
    mut config: Config,
    trust: Trust<'_>,
    guard: GuardSettings,
) -> Result<Secure, DtlsError> {
    crate::crypto::init();
    let (verifier, presenter) = (CertificateVerifier::new(trust.credential, &trust.revocations)?, trust.presenter);
    let verdict: Arc<Mutex<Option<Result<PeerId, Refused>>>> = Arc::default();
    let (callback_verifier, callback_verdict) = (verifier.clone(), verdict.clone());
    config.insecure_skip_verify = true;
    config.client_auth = ClientAuthType::RequireAnyClientCert;
    config.verify_peer_certificate = Some(Arc::new(move |chain, _| {
        let found = check(&callback_verifier, chain, presenter);
        let answer = found.as_ref().map(|_| ()).map_err(|refused| dtls::Error::Other(refused.to_string()));
        *callback_verdict.lock().unwrap_or_else(PoisonError::into_inner) = Some(found);
        answer
    }));
    let guard = Arc::new(GuardConn::new(path, guard));
    let guarded: Arc<dyn Conn + Send + Sync> = guard.clone();
    let is_client = presenter != Presenter::Dialler;
    let opened = tokio::time::timeout(HANDSHAKE_LIMIT, DTLSConn::new(guarded, config, is_client, None)).await;
    let verdict = verdict.lock().unwrap_or_else(PoisonError::into_inner).take();
    // The verdict comes before the library's error, which has the refusal as text only and not its fault.
    if let Some(Err(refused)) = verdict {
        return Err(refused.into());
    }
    let conn = opened.map_err(|_| DtlsError::TooSlow)??;
    guard.complete();
    let missing = || Refused { fault: Fault::Missing, got: "none that was checked".to_owned() };
    // A handshake that completed without the callback had no certificate check at all.
    let peer = verdict.and_then(Result::ok).ok_or_else(missing)?;
    let chain = conn.connection_state().await.peer_certificates;
    let leaf = chain.first().ok_or_else(missing)?;
    let life = remaining_life(leaf)?.min(remaining_life(&trust.credential.cert_der)?);
    Ok(Secure { conn, peer, life, chain, verifier, presenter })
}

fn check(verifier: &CertificateVerifier, chain: &[Vec<u8>], presenter: Presenter) -> Result<PeerId, Refused> {
    let chain: Vec<CertificateDer<'_>> = chain.iter().map(|der| CertificateDer::from(der.as_slice())).collect();
    verifier.check(&chain, presenter)
}

/// The pinned configuration of both ends.
pub(crate) fn config(credential: &Credential) -> Result<Config, DtlsError> {
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
        extended_master_secret: ExtendedMasterSecretType::Require,
        flight_interval: FLIGHT_INTERVAL,
        mtu: 1200,
        replay_protection_window: REPLAY_WINDOW,
        ..Config::default()
    })
}
