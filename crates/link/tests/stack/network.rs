//! Two datagram paths with a test in the middle.

use std::sync::Arc;
use std::time::Duration;

use link::dtls::path::{Outlet, Path};
use link::dtls::{DtlsError, Secure, client, server};
use link::guard::observe::GuardCounters;
use link::guard::{GuardMode, GuardSettings};
use link::pki::{Authority, Credential, Role};
use tokio::sync::mpsc;
use wire::core::Side;
use wire::id::PeerId;

/// Decides what becomes of a datagram from a side.
pub(crate) type Tap = Box<dyn FnMut(Side, Vec<u8>) -> Vec<Vec<u8>> + Send>;

/// A path with two ends; the test may put datagrams in at either.
pub(crate) struct Network {
    pub(crate) client: Arc<Path>,
    pub(crate) server: Arc<Path>,
    pub(crate) to_client: mpsc::Sender<Vec<u8>>,
    pub(crate) to_server: mpsc::Sender<Vec<u8>>,
}

/// A network that does with datagrams what `tap` says.
pub(crate) fn network(mut tap: Tap) -> Network {
    let (to_client, client_in) = mpsc::channel(1024);
    let (to_server, server_in) = mpsc::channel(1024);
    let (client_out, mut from_client) = mpsc::channel::<Vec<u8>>(1024);
    let (server_out, mut from_server) = mpsc::channel::<Vec<u8>>(1024);
    let (clientward, serverward) = (to_client.clone(), to_server.clone());
    tokio::spawn(async move {
        loop {
            let (side, datagram) = tokio::select! {
                Some(datagram) = from_client.recv() => (Side::Client, datagram),
                Some(datagram) = from_server.recv() => (Side::Server, datagram),
                else => return,
            };
            for passed in tap(side, datagram) {
                let way = if side == Side::Client { &serverward } else { &clientward };
                way.send(passed).await.unwrap();
            }
        }
    });
    Network {
        client: Arc::new(Path::new(client_in, Outlet::Memory(client_out))),
        server: Arc::new(Path::new(server_in, Outlet::Memory(server_out))),
        to_client,
        to_server,
    }
}

/// A network that passes everything.
pub(crate) fn clear() -> Tap {
    Box::new(|_, datagram| vec![datagram])
}

/// Unit A's and the gateway's credentials from one authority.
pub(crate) fn credentials() -> (Credential, Credential) {
    let authority = Authority::new().unwrap();
    let unit = authority.issue(PeerId::UNIT_A, Role::Dials).unwrap();
    (unit, authority.issue(PeerId::GATEWAY, Role::Listens).unwrap())
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
        client(network.client.clone(), unit, PeerId::GATEWAY, guard(mode)),
        server(network.server.clone(), gateway, guard(mode)),
    )
}

/// An established association, with the network it runs on.
pub(crate) async fn established(tap: Tap, mode: GuardMode) -> (Network, Secure, Secure) {
    let network = network(tap);
    let (unit, gateway) = credentials();
    let (client, server) = handshake(&network, &unit, &gateway, mode).await;
    (network, client.unwrap(), server.unwrap())
}

/// The next record, or `None` when nothing comes for a (virtual) second.
pub(crate) async fn next(end: &Secure) -> Option<Vec<u8>> {
    tokio::time::timeout(Duration::from_secs(1), end.recv()).await.ok().map(Result::unwrap)
}

/// Everything that comes until nothing comes for a (virtual) second.
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
    let dialling =
        tokio::spawn(async move { client(path, &unit, PeerId::GATEWAY, guard(GuardMode::Required)).await.map(|_| ()) });
    let hello = from_client.recv().await.unwrap();
    dialling.abort();
    hello
}
