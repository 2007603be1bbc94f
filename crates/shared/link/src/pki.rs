//! Certificates of one run: an authority that lives in the launcher's memory, and its certificates.
//!
//! Leaves are P-256, valid for at most a day, and name their holder by exactly one URI, `urn:holdsafe:<name>`. A
//! [`Credential`] goes to its service over the inherited pipe and never to a disk. Permissions of a name are left to the
//! cores.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use rcgen::{
    BasicConstraints, CertificateParams, CertificateRevocationListParams, DistinguishedName, DnType,
    ExtendedKeyUsagePurpose, IsCa, Issuer, KeyIdMethod, KeyPair, KeyUsagePurpose, PKCS_ECDSA_P256_SHA256,
    RevocationReason, RevokedCertParams, SanType, SerialNumber,
};
use rustls::RootCertStore;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, PrivatePkcs8KeyDer};
use serde::{Deserialize, Serialize};
use wire::id::PeerId;
use x509_parser::prelude::{FromDer, GeneralName, X509Certificate};

use crate::clock::wall;

/// The longest validity of a certificate or list of the authority.
pub const MAX_LIFE: Duration = Duration::from_secs(24 * 3600);

/// Backdating of a certificate's start, so that a host with a slightly late wall clock accepts it.
const BACKDATE: Duration = Duration::from_secs(300);

/// A certificate could not be made, used or read.
#[derive(Debug, thiserror::Error)]
pub enum PkiError {
    /// The certificate library refused.
    #[error("certificate: {0}")]
    Issue(#[from] rcgen::Error),
    /// The TLS library refused the certificate or key.
    #[error("tls: {0}")]
    Tls(#[from] rustls::Error),
    /// The private key is not a P-256 key in PKCS #8.
    #[error("private key is not P-256 in PKCS #8")]
    Key,
    /// The leaf is not a certificate.
    #[error("peer certificate does not parse")]
    Unreadable,
    /// The leaf has not exactly one URI name.
    #[error("peer certificate has {0} URI names instead of one")]
    UriNames(usize),
    /// The revocation list beside the certificate is not its authority's.
    #[error(transparent)]
    List(#[from] ListRefused),
    /// The URI is not a name of the table.
    #[error("peer certificate names `{0}`, which is unknown here")]
    UnknownName(String),
}

/// The longest revocation list that is read, in bytes.
pub const MAX_LIST: usize = 16 * 1024;

/// Reason for which a revocation list was refused; the previous one stays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ListRefused {
    /// Longer than [`MAX_LIST`].
    #[error("a revocation list of at most {MAX_LIST} bytes expected, got {0}")]
    Length(usize),
    /// Not a list with a number, in the encoding that certificates are verified with.
    #[error("a numbered revocation list in DER expected, got something else")]
    Unreadable,
    /// Not signed by the authority of this end's certificate.
    #[error("a revocation list of this run's authority expected, got another's")]
    Foreign,
    /// Not newer than the present one.
    #[error("a revocation list after number {held} expected, got {got}")]
    Old {
        /// Number of the present list.
        held: u64,
        /// Number of the received list.
        got: u64,
    },
}

/// Which end of a handshake a certificate may serve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Opens sessions.
    Dials,
    /// Accepts sessions.
    Listens,
    /// Both: the gateway accepts DTLS sessions and dials the broker.
    Both,
}

/// Keys and certificates with which one holder proves its name and checks others.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Credential {
    /// The leaf certificate, DER.
    #[serde(with = "hex")]
    pub cert_der: Vec<u8>,
    /// Its private key, PKCS #8 DER.
    #[serde(with = "hex")]
    pub key_pkcs8_der: Vec<u8>,
    /// The authority of the run, DER.
    #[serde(with = "hex")]
    pub root_der: Vec<u8>,
    /// The authority's revocation list when this was issued, DER; a newer one may follow.
    #[serde(with = "hex")]
    pub list_der: Vec<u8>,
}

impl std::fmt::Debug for Credential {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Credential").field("cert_len", &self.cert_der.len()).finish_non_exhaustive()
    }
}

impl Credential {
    /// The authority as a trust store.
    pub fn roots(&self) -> Result<RootCertStore, PkiError> {
        let mut store = RootCertStore::empty();
        store.add(CertificateDer::from(self.root_der.clone()))?;
        Ok(store)
    }

    /// The chain to present.
    pub fn chain(&self) -> Vec<CertificateDer<'static>> {
        vec![CertificateDer::from(self.cert_der.clone())]
    }

    /// The private key for rustls.
    pub fn key(&self) -> PrivateKeyDer<'static> {
        PrivateKeyDer::Pkcs8(PrivatePkcs8KeyDer::from(self.key_pkcs8_der.clone()))
    }
}

/// The certificate authority of one run; its key exists only as long as this.
pub struct Authority {
    issuer: Issuer<'static, KeyPair>,
    root_der: Vec<u8>,
    list_der: Vec<u8>,
    lists: AtomicU64,
    born: SystemTime,
}

impl Authority {
    /// A fresh authority.
    pub fn new() -> Result<Self, PkiError> {
        let born = wall();
        let mut params = CertificateParams::new(Vec::<String>::new())?;
        params.distinguished_name = common_name("holdsafe run authority");
        params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
        params.not_before = (born - BACKDATE).into();
        params.not_after = (born + MAX_LIFE).into();
        let key = KeyPair::generate_for(&PKCS_ECDSA_P256_SHA256)?;
        let root_der = params.self_signed(&key)?.der().to_vec();
        let issuer = Issuer::new(params, key);
        let mut this = Self { issuer, root_der, list_der: Vec::new(), lists: AtomicU64::new(0), born };
        this.list_der = this.revoke(&[])?;
        Ok(this)
    }

    /// The next revocation list: it names exactly `revoked`, and its number is above that of every list before it.
    pub fn revoke(&self, revoked: &[&Credential]) -> Result<Vec<u8>, PkiError> {
        let entry = |credential: &&Credential| {
            Ok(RevokedCertParams {
                serial_number: SerialNumber::from_slice(&serial(&credential.cert_der)?),
                revocation_time: wall().into(),
                reason_code: Some(RevocationReason::KeyCompromise),
                invalidity_date: None,
            })
        };
        let list = CertificateRevocationListParams {
            this_update: (self.born - BACKDATE).into(),
            next_update: (self.born + MAX_LIFE).into(),
            crl_number: SerialNumber::from(self.lists.fetch_add(1, Ordering::Relaxed) + 1),
            issuing_distribution_point: None,
            revoked_certs: revoked.iter().map(entry).collect::<Result<_, PkiError>>()?,
            key_identifier_method: KeyIdMethod::Sha256,
        };
        Ok(list.signed_by(&self.issuer)?.der().to_vec())
    }

    /// A credential for `holder`, valid as long as the authority.
    pub fn issue(&self, holder: PeerId, role: Role) -> Result<Credential, PkiError> {
        self.issue_between(holder, role, self.born - BACKDATE, self.born + MAX_LIFE)
    }

    /// A credential for `holder` with another validity (expired and not yet valid ones are scenarios).
    pub fn issue_between(
        &self,
        holder: PeerId,
        role: Role,
        not_before: SystemTime,
        not_after: SystemTime,
    ) -> Result<Credential, PkiError> {
        let mut params = leaf(&[holder], role)?;
        params.not_before = not_before.into();
        params.not_after = not_after.min(self.born + MAX_LIFE).into();
        self.sign(params)
    }

    /// A credential that names several holders, which is never issued to our services (a scenario).
    pub fn issue_names(&self, holders: &[PeerId], role: Role) -> Result<Credential, PkiError> {
        let mut params = leaf(holders, role)?;
        params.not_before = (self.born - BACKDATE).into();
        params.not_after = (self.born + MAX_LIFE).into();
        self.sign(params)
    }

    /// A self-signed credential that names `holder`, with this authority's root beside it (a scenario).
    pub fn self_signed(&self, holder: PeerId, role: Role) -> Result<Credential, PkiError> {
        let mut params = leaf(&[holder], role)?;
        params.not_before = (self.born - BACKDATE).into();
        params.not_after = (self.born + MAX_LIFE).into();
        params.use_authority_key_identifier_extension = false;
        let key = KeyPair::generate_for(&PKCS_ECDSA_P256_SHA256)?;
        let cert_der = params.self_signed(&key)?.der().to_vec();
        Ok(self.credential(cert_der, &key))
    }

    fn sign(&self, params: CertificateParams) -> Result<Credential, PkiError> {
        let key = KeyPair::generate_for(&PKCS_ECDSA_P256_SHA256)?;
        let cert_der = params.signed_by(&key, &self.issuer)?.der().to_vec();
        Ok(self.credential(cert_der, &key))
    }

    fn credential(&self, cert_der: Vec<u8>, key: &KeyPair) -> Credential {
        let (root_der, list_der) = (self.root_der.clone(), self.list_der.clone());
        Credential { cert_der, key_pkcs8_der: key.serialize_der(), root_der, list_der }
    }
}

/// Fields of every leaf, except for its validity.
fn leaf(holders: &[PeerId], role: Role) -> Result<CertificateParams, PkiError> {
    let mut params = CertificateParams::new(holders.iter().map(|h| dns_name(*h)).collect::<Vec<_>>())?;
    for holder in holders {
        params.subject_alt_names.push(SanType::URI(holder.uri().try_into()?));
    }
    params.distinguished_name = common_name(&holders.first().map_or_else(|| "nobody".to_owned(), PeerId::to_string));
    params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
    params.extended_key_usages = match role {
        Role::Dials => vec![ExtendedKeyUsagePurpose::ClientAuth],
        Role::Listens => vec![ExtendedKeyUsagePurpose::ServerAuth],
        Role::Both => vec![ExtendedKeyUsagePurpose::ClientAuth, ExtendedKeyUsagePurpose::ServerAuth],
    };
    params.use_authority_key_identifier_extension = true;
    Ok(params)
}

/// The serial number of a certificate, in its encoding.
fn serial(cert_der: &[u8]) -> Result<Vec<u8>, PkiError> {
    let (_, cert) = X509Certificate::from_der(cert_der).map_err(|_| PkiError::Unreadable)?;
    Ok(cert.raw_serial().to_vec())
}

/// The host name in the certificate of `holder`, checked by its dialler. Reserved, so it resolves nowhere.
pub fn dns_name(holder: PeerId) -> String {
    format!("{holder}.holdsafe.invalid")
}

/// The peer that a verified leaf certificate names: exactly one URI, out of the closed set.
pub fn peer_of(leaf_der: &[u8]) -> Result<PeerId, PkiError> {
    let (rest, leaf) = X509Certificate::from_der(leaf_der).map_err(|_| PkiError::Unreadable)?;
    if !rest.is_empty() {
        return Err(PkiError::Unreadable);
    }
    let names = leaf.subject_alternative_name().map_err(|_| PkiError::Unreadable)?.ok_or(PkiError::UriNames(0))?;
    let uri = |name: &GeneralName<'_>| if let GeneralName::URI(uri) = name { Some((*uri).to_owned()) } else { None };
    let mut uris = names.value.general_names.iter().filter_map(uri);
    match (uris.next(), uris.count()) {
        (None, _) => Err(PkiError::UriNames(0)),
        (Some(uri), 0) => {
            PeerId::from_uri(&uri).ok_or_else(|| PkiError::UnknownName(uri.escape_default().take(64).collect()))
        }
        (Some(_), more) => Err(PkiError::UriNames(more + 1)),
    }
}

/// Remaining validity of a verified leaf certificate; zero when it has ended.
pub fn remaining_life(leaf_der: &[u8]) -> Result<Duration, PkiError> {
    let (_, leaf) = X509Certificate::from_der(leaf_der).map_err(|_| PkiError::Unreadable)?;
    let ends = u64::try_from(leaf.validity().not_after.timestamp()).unwrap_or(0);
    let ends = SystemTime::UNIX_EPOCH + Duration::from_secs(ends);
    Ok(ends.duration_since(wall()).unwrap_or(Duration::ZERO))
}

fn common_name(name: &str) -> DistinguishedName {
    let mut distinguished = DistinguishedName::new();
    distinguished.push(DnType::CommonName, name);
    distinguished
}

/// Bytes as lower-case hexadecimal in JSON.
mod hex {
    use std::borrow::Cow;

    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub(super) fn serialize<S: Serializer>(bytes: &[u8], serializer: S) -> Result<S::Ok, S::Error> {
        let text: String = bytes.iter().map(|b| format!("{b:02x}")).collect();
        serializer.serialize_str(&text)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<u8>, D::Error> {
        let text = <Cow<'de, str>>::deserialize(deserializer)?;
        if text.len() > 16 * 1024 || !text.len().is_multiple_of(2) || !text.is_ascii() {
            return Err(D::Error::custom("not hexadecimal bytes within bounds"));
        }
        (0..text.len())
            .step_by(2)
            .map(|i| u8::from_str_radix(&text[i..i + 2], 16).map_err(|_| D::Error::custom("not hexadecimal")))
            .collect()
    }
}
