//! The one cryptographic provider of the process.
//!
//! The DTLS crate builds its certificate verifiers with rustls' implicit provider, so every binary and every test calls
//! [`init`] first.

use std::sync::{Arc, Once};

use rustls::crypto::CryptoProvider;

/// Installs ring as the provider of this process. Further calls have no effect.
pub fn init() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // An error means that some provider is installed already, which a library test harness may have done.
        let _already_installed = rustls::crypto::ring::default_provider().install_default();
    });
}

/// The provider itself, for configurations that take one.
pub fn provider() -> Arc<CryptoProvider> {
    Arc::new(rustls::crypto::ring::default_provider())
}
