//! Two ends over the network in memory, with a test in the middle.

use std::sync::Arc;
use std::time::Duration;

use link::certificates::list::Revocations;
use link::dtls::path::{Outlet, Path};
use link::dtls::{DtlsError, Secure, client, server};
use link::guard::observe::GuardCounters;
use link::guard::{GuardMode, GuardSettings};
pub(crate) use link::memory::{Network, Tap, clear, network};
use link::pki::{Authority, Credential, Role};
use tokio::sync::mpsc;
use wire::id::PeerId;

/// Unit A's and the gateway's credentials from one authority.
pub(crate) fn credentials() -> (Credential, Credential) {
    let authority = Authority::new().unwrap();
    let unit = authority.issue(PeerId::UNIT_A, Role::Dials).unwrap();
    (unit, authority.issue(PeerId::GATEWAY, Role::Listens).unwrap())
}

/// The revocation list beside a credential.
pub(crate) fn list(credential: &Credential) -> Revocations {
    Revocations::from_credential(credential).unwrap()
}

pub(crate) fn guard(mode: GuardMode) -> GuardSettings {
    GuardSettings { mode, association: 1, counters: Arc::new(GuardCounters::default()), log: None }
}

/// Both ends' outcomes of one handshake in which the client expects the gateway.
pub(crate) async fn handshake(
    network: &Network,
    unit: &Credential,
    gateway: &Credential,
    mode: GuardMode,
) -> (Result<Secure, DtlsError>, Result<Secure, DtlsError>) {
    tokio::join!(
        client(network.client.clone(), unit, PeerId::GATEWAY, list(unit), guard(mode)),
        server(network.server.clone(), gateway, list(gateway), guard(mode)),
    )
}

/// An established association, with the network it runs on.
pub(crate) async fn established(tap: Tap, mode: GuardMode) -> (Network, Secure, Secure) {
    let network = network(tap);
    let (unit, gateway) = credentials();
    let (client, server) = handshake(&network, &unit, &gateway, mode).await;
    (network, client.unwrap(), server.unwrap())
}

/// The next record, or `None` after a (virtual) second of silence.
pub(crate) async fn next(end: &Secure) -> Option<Vec<u8>> {
    tokio::time::timeout(Duration::from_secs(1), end.recv()).await.ok().map(Result::unwrap)
}

/// All records until a (virtual) second of silence.
pub(crate) async fn all(end: &Secure) -> Vec<Vec<u8>> {
    let mut records = Vec::new();
    while let Some(record) = next(end).await {
        records.push(record);
    }
    records
}

/// The first datagram of a genuine handshake.
pub(crate) async fn genuine_hello() -> Vec<u8> {
    let (unit, _) = credentials();
    let (_to_client, client_in) = mpsc::channel(1);
    let (client_out, mut from_client) = mpsc::channel(8);
    let path = Arc::new(Path::new(client_in, Outlet::Memory(client_out)));
    let dialling = tokio::spawn(async move {
        client(path, &unit, PeerId::GATEWAY, list(&unit), guard(GuardMode::Required)).await.map(|_| ())
    });
    let hello = from_client.recv().await.unwrap();
    dialling.abort();
    hello
}
