//! The revocation list that an end holds: at first the one beside its certificate, then any newer one of the same
//! authority. How a list gets here is left to the process.

use std::sync::Arc;

use ring::signature::{ECDSA_P256_SHA256_ASN1, UnparsedPublicKey};
use rustls::RootCertStore;
use rustls::client::WebPkiServerVerifier;
use rustls::pki_types::CertificateRevocationListDer;
use tokio::sync::watch;
use x509_parser::prelude::{CertificateRevocationList, FromDer, X509Certificate};

use crate::pki::{Credential, ListRefused, MAX_LIST};

/// A revocation list that may be replaced by a newer one; clones share it.
#[derive(Clone, Debug)]
pub struct Revocations {
    root_der: Vec<u8>,
    roots: Arc<RootCertStore>,
    held: watch::Sender<Held>,
}

#[derive(Clone, Debug, Default)]
struct Held {
    der: Vec<u8>,
    number: u64,
}

impl Revocations {
    /// The list in a credential, beside its certificate.
    ///
    /// # Errors
    /// When it is not one of that certificate's authority.
    pub fn from_credential(credential: &Credential) -> Result<Self, ListRefused> {
        let roots = Arc::new(credential.roots().map_err(|_| ListRefused::Foreign)?);
        let this = Self { root_der: credential.root_der.clone(), roots, held: watch::Sender::new(Held::default()) };
        this.replace(credential.list_der.clone())?;
        Ok(this)
    }

    /// Takes a newer list of the same authority.
    ///
    /// # Errors
    /// When it is none; the list that is held stays.
    pub fn replace(&self, der: Vec<u8>) -> Result<(), ListRefused> {
        if der.len() > MAX_LIST {
            return Err(ListRefused::Length(der.len()));
        }
        let number = number(&der, &self.root_der)?;
        // Parsed as in every handshake. The parser above is laxer: a list that only that one accepts would be held, and no
        // certificate could be verified any more.
        let reads = WebPkiServerVerifier::builder_with_provider(self.roots.clone(), crate::crypto::provider())
            .with_crls([CertificateRevocationListDer::from(der.clone())]);
        reads.build().map_err(|_| ListRefused::Unreadable)?;
        let mut old = None;
        self.held.send_if_modified(|held| {
            old = (number <= held.number).then_some(held.number);
            if old.is_none() {
                *held = Held { der, number };
            }
            old.is_none()
        });
        old.map_or(Ok(()), |held| Err(ListRefused::Old { held, got: number }))
    }

    /// A watch of every change from now on.
    pub fn watch(&self) -> Watch {
        Watch(self.held.subscribe())
    }

    pub(super) fn der(&self) -> CertificateRevocationListDer<'static> {
        CertificateRevocationListDer::from(self.held.borrow().der.clone())
    }
}

/// Waits for changes of a list.
#[derive(Clone, Debug)]
pub struct Watch(watch::Receiver<Held>);

impl Watch {
    /// Returns once the list has changed since this was made or last returned; never, if the list has no holder.
    pub async fn changed(&mut self) {
        if self.0.changed().await.is_err() {
            std::future::pending().await
        }
    }
}

/// The number of a list that the holder of `root_der` signed.
fn number(der: &[u8], root_der: &[u8]) -> Result<u64, ListRefused> {
    let (rest, list) = CertificateRevocationList::from_der(der).map_err(|_| ListRefused::Unreadable)?;
    let number = list.crl_number().and_then(|n| u64::try_from(n).ok()).ok_or(ListRefused::Unreadable)?;
    if !rest.is_empty() {
        return Err(ListRefused::Unreadable);
    }
    let (_, root) = X509Certificate::from_der(root_der).map_err(|_| ListRefused::Foreign)?;
    UnparsedPublicKey::new(&ECDSA_P256_SHA256_ASN1, &root.public_key().subject_public_key.data)
        .verify(list.tbs_cert_list.as_ref(), &list.signature_value.data)
        .map_err(|_| ListRefused::Foreign)?;
    Ok(number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pki::{Authority, Role};
    use wire::id::PeerId;

    #[test]
    fn only_a_newer_list_of_the_authority_counts() {
        let (authority, other) = (Authority::new().unwrap(), Authority::new().unwrap());
        let unit = authority.issue(PeerId::UNIT_A, Role::Dials).unwrap();
        let held = Revocations::from_credential(&unit).unwrap();
        let (second, third) = (authority.revoke(&[]).unwrap(), authority.revoke(&[&unit]).unwrap());
        assert_eq!(held.replace(third), Ok(()));
        assert_eq!(held.replace(second), Err(ListRefused::Old { held: 3, got: 2 }), "an old list brings nobody back");
        let mut foreign = Vec::new();
        for _ in 0..4 {
            foreign = other.revoke(&[]).unwrap();
        }
        assert_eq!(held.replace(foreign), Err(ListRefused::Foreign));
        assert_eq!(held.replace(vec![1; 9]), Err(ListRefused::Unreadable));
        assert_eq!(held.replace(vec![0; MAX_LIST + 1]), Err(ListRefused::Length(MAX_LIST + 1)));
    }

    #[test]
    fn list_with_any_bit_altered_is_refused() {
        let authority = Authority::new().unwrap();
        let held = Revocations::from_credential(&authority.issue(PeerId::UNIT_A, Role::Dials).unwrap()).unwrap();
        let list = authority.revoke(&[]).unwrap();
        for bit in 0..list.len() * 8 {
            let mut altered = list.clone();
            altered[bit / 8] ^= 1 << (bit % 8);
            let got = held.replace(altered);
            assert!(got.is_err(), "bit {} of byte {}", bit % 8, bit / 8);
            // The form bit of a tag, which the parser of the number ignores.
            assert!(bit != 5 || got == Err(ListRefused::Unreadable), "{got:?}");
        }
        assert_eq!(held.replace(list), Ok(()));
    }
}
