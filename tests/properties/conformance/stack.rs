//! The real guard and DTLS library, between two ends in memory, in paused time: nothing here waits for a clock.

use std::sync::Arc;
use std::time::Duration;

use link::dtls::path::{Outlet, Path};
use link::dtls::{Secure, client, server};
use link::guard::observe::GuardCounters;
use link::guard::{GuardMode, GuardSettings};
use link::pki::{Authority, Credential, Role};
use tokio::runtime::Runtime;
use tokio::sync::mpsc;
use wire::core::Side;
use wire::id::PeerId;
use wire::policy::Requirement;

use super::Association;

/// Virtual time after which nothing more comes of a datagram.
const QUIET: Duration = Duration::from_millis(20);

pub(super) struct Stack {
    runtime: Runtime,
    credentials: [Credential; 2],
    mode: GuardMode,
    ends: [End; 2],
}

struct End {
    secure: Secure,
    into: mpsc::Sender<Vec<u8>>,
    out: mpsc::Receiver<Vec<u8>>,
    counters: Arc<GuardCounters>,
}

impl Association for Stack {
    fn open(guard: Requirement) -> Self {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().start_paused(true).build();
        let runtime = runtime.expect("a runtime");
        let authority = Authority::new().expect("an authority");
        let unit = authority.issue(PeerId::UNIT_A, Role::Dials).expect("a credential");
        let gateway = authority.issue(PeerId::GATEWAY, Role::Listens).expect("a credential");
        let mode = match guard {
            Requirement::Required => GuardMode::Required,
            Requirement::Waived => GuardMode::Waived,
        };
        let credentials = [unit, gateway];
        let ends = runtime.block_on(handshake(&credentials, mode));
        Self { runtime, credentials, mode, ends }
    }

    fn reopen(&mut self) {
        self.ends = self.runtime.block_on(handshake(&self.credentials, self.mode));
    }

    fn send(&mut self, from: Side, record: &[u8]) -> Option<Vec<u8>> {
        let end = &mut self.ends[from as usize];
        self.runtime.block_on(async {
            while end.out.try_recv().is_ok() {}
            end.secure.send(record).await.ok()?;
            tokio::time::timeout(QUIET, end.out.recv()).await.ok().flatten()
        })
    }

    fn put(&mut self, at: Side, datagram: &[u8]) -> Vec<Vec<u8>> {
        let end = &mut self.ends[at as usize];
        self.runtime.block_on(async {
            end.into.send(datagram.to_vec()).await.expect("the path is there");
            let mut records = Vec::new();
            while let Ok(Ok(record)) = tokio::time::timeout(QUIET, end.secure.recv()).await {
                records.push(record);
            }
            records
        })
    }

    fn guard(&self, at: Side) -> (u64, u64) {
        let stats = self.ends[at as usize].counters.read();
        (stats.records, stats.refused())
    }

    fn wait(&mut self) {
        self.runtime.block_on(tokio::time::advance(Duration::from_secs(60)));
    }
}

/// Two ends after their handshake, whose datagrams passed untouched.
async fn handshake(credentials: &[Credential; 2], mode: GuardMode) -> [End; 2] {
    let (into_client, client_in) = mpsc::channel(1024);
    let (into_server, server_in) = mpsc::channel(1024);
    let (client_out, mut from_client) = mpsc::channel::<Vec<u8>>(1024);
    let (server_out, mut from_server) = mpsc::channel::<Vec<u8>>(1024);
    let counters = [Arc::new(GuardCounters::default()), Arc::new(GuardCounters::default())];
    let guard = |n: usize| GuardSettings { mode, association: 1, counters: counters[n].clone(), log: None };
    let (dialling, listening) =
        (Path::new(client_in, Outlet::Memory(client_out)), Path::new(server_in, Outlet::Memory(server_out)));
    let shaking = async {
        tokio::join!(
            client(Arc::new(dialling), &credentials[0], PeerId::GATEWAY, guard(0)),
            server(Arc::new(listening), &credentials[1], guard(1)),
        )
    };
    let carrying = async {
        loop {
            tokio::select! {
                Some(datagram) = from_client.recv() => into_server.send(datagram).await.expect("room"),
                Some(datagram) = from_server.recv() => into_client.send(datagram).await.expect("room"),
            }
        }
    };
    let (dialled, accepted): (Result<Secure, _>, Result<Secure, _>) = tokio::select! {
        both = shaking => both,
        () = carrying => unreachable!("it carries for ever"),
    };
    let [of_client, of_server] = counters;
    [
        End { secure: dialled.expect("a handshake"), into: into_client, out: from_client, counters: of_client },
        End { secure: accepted.expect("a handshake"), into: into_server, out: from_server, counters: of_server },
    ]
}
