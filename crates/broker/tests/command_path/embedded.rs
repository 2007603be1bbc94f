//! The broker of this workspace: the obligations of every broker, and its own beyond them, each refusal under its name.

use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};
use std::time::Duration;

use broker::audit::audited;
use broker::gate::{Denial, Event};
use broker::server::{MAX_CONNECTIONS_OF_PEER, Server, ServerLimits};
use link::clock::HostClock;
use link::loopback::LoopbackAddr;
use link::pki::Role;
use link::spec::{BrokerListen, Control, ORPHANED, ServiceSpec};
use rumqttc::{ConnectReturnCode, LastWill, QoS};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use wire::core::Subject;
use wire::id::{Boot, NodeId, PeerId, UnitId};
use wire::policy::Requirement;

use crate::client::{Client, RunPki, open_session_bytes, raw_tls};
use crate::suite::{Broker, command_path};

command_path!(Server);

impl Broker for Server {
    const REFUSES_SUBSCRIPTIONS: bool = true;

    async fn start(pki: &RunPki) -> Option<Self> {
        Some(serve(pki, ServerLimits::default()).await)
    }

    fn address(&self) -> LoopbackAddr {
        Server::address(self)
    }

    async fn revoke(&mut self, list_der: Vec<u8>) {
        self.revocations().replace(list_der).expect("a newer list");
    }

    async fn named(&mut self, refusal: &str) {
        assert_eq!(denial(self).await.name(), refusal);
    }

    async fn beyond_rights(&mut self, peer: PeerId) {
        let refused = denial(self).await;
        assert!(matches!(&refused, Denial::Access { peer: of, .. } if *of == peer), "{refused:?}");
    }

    async fn ended(&mut self, peer: PeerId) {
        while self.event().await != Some(Event::Closed { peer }) {}
    }
}

#[tokio::test]
async fn revoked_certificate_ends_its_session_at_once() {
    let (pki, mut server) = start(ServerLimits::default()).await;
    let credential = pki.issue("unit-a", Role::Dials);
    let unit = Client::open(server.address(), "unit-a", pki.tls_with(&credential), None).await.expect("admitted");
    unit.publish("hs/ack/unit-a", b"before").await.expect("granted");
    server.revocations().replace(pki.revoke(&credential)).expect("a newer list");
    let refused = denial(&mut server).await;
    assert!(matches!(refused, Denial::Dismissed { peer: PeerId::UNIT_A, .. }), "{refused:?}");
    assert_eq!(refused.name(), "revoked");
    unit.publish("hs/ack/unit-a", b"after").await.expect_err("its session is over");
}

#[tokio::test]
async fn foreign_client_id_is_refused_by_name() {
    let (pki, mut server) = start(ServerLimits::default()).await;
    for id in ["unit-a", "gateway", "nobody"] {
        let refused =
            Client::open(server.address(), id, pki.tls(PeerId::UNIT_B), None).await.expect_err("not its name");
        assert_eq!(refused, Some(ConnectReturnCode::ClientIdentifierNotValid));
        let expected = Denial::ClientId { expected: PeerId::UNIT_B, got: id.to_owned() };
        assert_eq!(denial(&mut server).await, expected);
    }
}

#[tokio::test]
async fn will_and_older_protocol_are_refused_by_name() {
    let (pki, mut server) = start(ServerLimits::default()).await;
    let will = LastWill::new("hs/ack/unit-b", b"gone".to_vec(), QoS::AtLeastOnce, false, None);
    let refused =
        Client::open(server.address(), "unit-b", pki.tls(PeerId::UNIT_B), Some(will)).await.expect_err("no wills");
    assert_eq!(refused, Some(ConnectReturnCode::NotAuthorized));
    let got = "hs/ack/unit-b".to_owned();
    assert_eq!(denial(&mut server).await, Denial::Will { peer: PeerId::UNIT_B, got });

    let mut old = raw_tls(server.address(), pki.tls(PeerId::UNIT_B)).await;
    old.write_all(&open_session_bytes(4, "unit-b")).await.expect("sent");
    assert_eq!(denial(&mut server).await, Denial::ProtocolLevel { peer: PeerId::UNIT_B, got: 4 });
}

#[tokio::test]
async fn shared_subscription_is_refused_to_readable_topics_too() {
    let (pki, server) = start(ServerLimits::default()).await;
    let unit = pki.connect(server.address(), PeerId::UNIT_B).await;
    unit.subscribe("$share/g/hs/cmd/unit-b").await.expect_err("no shared subscriptions");
}

#[tokio::test]
async fn connections_are_capped_and_a_slot_comes_back() {
    let limits = ServerLimits { connections: 2, handshake: Duration::from_secs(600), ..ServerLimits::default() };
    let (pki, mut server) = start(limits).await;
    let silent = TcpStream::connect(server.address().socket()).await.expect("accepted");
    let gateway = pki.connect(server.address(), PeerId::GATEWAY).await;

    let mut third = TcpStream::connect(server.address().socket()).await.expect("the kernel accepts");
    assert_eq!(denial(&mut server).await, Denial::Connections { expected: 2 });
    assert!(matches!(third.read(&mut [0; 8]).await, Ok(0) | Err(_)), "closed without a byte");

    drop(silent);
    assert_eq!(denial(&mut server).await.name(), "handshake");
    let unit = pki.connect(server.address(), PeerId::UNIT_A).await;
    unit.publish("hs/ack/unit-a", b"in").await.expect("the slot came back");
    gateway.publish("hs/cmd/unit-a", b"in").await.expect("the first session stands");
}

/// A connection that never becomes a session keeps its place for a bounded time.
#[tokio::test]
async fn silent_handshake_loses_its_slot() {
    let limits = ServerLimits { connections: 1, handshake: Duration::from_millis(100), ..ServerLimits::default() };
    let (pki, mut server) = start(limits).await;
    let _silent = TcpStream::connect(server.address().socket()).await.expect("accepted");
    assert_eq!(denial(&mut server).await, Denial::HandshakeTimeout);
    let _unit = pki.connect(server.address(), PeerId::UNIT_A).await;
}

/// The broker's library waits ten seconds for CONNECT.
#[tokio::test]
#[ignore = "long: waits ten seconds for a CONNECT that does not come"]
async fn certificate_without_connect_loses_its_slot() {
    let limits = ServerLimits { connections: 1, ..ServerLimits::default() };
    let (pki, server) = start(limits).await;
    let mut half_open = raw_tls(server.address(), pki.tls(PeerId::UNIT_A)).await;
    let closed = tokio::time::timeout(Duration::from_secs(15), half_open.read(&mut [0; 8])).await;
    assert!(matches!(closed.expect("closed in time"), Ok(0) | Err(_)), "closed without an answer");
    let _unit = pki.connect(server.address(), PeerId::UNIT_B).await;
}

#[tokio::test]
async fn one_certificate_holds_few_connections() {
    let (pki, mut server) = start(ServerLimits::default()).await;
    let _session = pki.connect(server.address(), PeerId::UNIT_A).await;
    let _half_open = raw_tls(server.address(), pki.tls(PeerId::UNIT_A)).await;
    let _refused = raw_tls(server.address(), pki.tls(PeerId::UNIT_A)).await;
    let expected = MAX_CONNECTIONS_OF_PEER;
    assert_eq!(denial(&mut server).await, Denial::ConnectionsOfPeer { peer: PeerId::UNIT_A, expected });
}

/// Without the table, the model and the live broker still let the same things pass.
#[tokio::test]
async fn waived_rights_pass_ungranted_topics_only() {
    let limits = ServerLimits { rights: Requirement::Waived, ..ServerLimits::default() };
    let (pki, server) = start(limits).await;
    let mut model = broker::Broker::with_rights(Requirement::Waived);
    let unit = pki.connect(server.address(), PeerId::UNIT_B).await;
    for (filter, passes) in [("hs/cmd/unit-a", true), ("hs/cmd/+", true), ("hs/other", false), ("#", false)] {
        assert_eq!(model.subscribe(PeerId::UNIT_B, filter).is_ok(), passes, "the model: {filter}");
        assert_eq!(unit.subscribe(filter).await.is_ok(), passes, "the live broker: {filter}");
    }
    let subject = Subject::Command(UnitId::A);
    assert!(model.publish(PeerId::UNIT_B, subject).is_ok_and(|receivers| receivers.contains(&PeerId::UNIT_B)));
    unit.publish("hs/cmd/unit-a", b"by whom").await.expect("passes");
}

/// A holder of a second copy of a certificate can take its session over, and cannot do so unseen.
#[tokio::test]
async fn second_certificate_holder_takes_over_in_sight() {
    let (pki, mut server) = start(ServerLimits::default()).await;
    let peer = PeerId::UNIT_A;
    let _first = pki.connect(server.address(), peer).await;
    assert_eq!(server.event().await, Some(Event::Admitted { peer }), "nothing was taken from anyone");
    let _impostor = pki.connect(server.address(), peer).await;
    let taken = server.event().await.expect("the broker runs");
    assert_eq!(taken, Event::TakenOver { peer });
    assert_eq!(audited(&taken), wire::event::Event::TakenOver { peer }, "and the audit log says so");
    let _another = pki.connect(server.address(), PeerId::UNIT_B).await;
    while server.event().await != Some(Event::Admitted { peer: PeerId::UNIT_B }) {}
}

/// The process also ends on request.
#[tokio::test]
async fn process_gives_its_address_and_ends_with_launcher() {
    for (goodbye, status) in [(Control::Finish.line(), 0), (String::new(), ORPHANED)] {
        let pki = RunPki::new();
        let directory = tempfile::tempdir().expect("a directory");
        let clock = HostClock { zero_us: 0, drift_ppm: 0 };
        let mut spec = ServiceSpec::new(NodeId::BROKER, Boot(1), 1, clock, directory.path().to_owned());
        spec.broker = Some(BrokerListen { at: LoopbackAddr::ANY_PORT, credential: pki.broker() });
        let mut child = Command::new(env!("CARGO_BIN_EXE_holdsafe-broker"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the binary starts");
        let mut stdin = child.stdin.take().expect("piped");
        spec.write(&mut stdin).expect("the child reads");
        let mut ready = String::new();
        BufReader::new(child.stdout.take().expect("piped")).read_line(&mut ready).expect("a line");
        let ready: serde_json::Value =
            serde_json::from_str(ready.strip_prefix("ready ").expect("ready")).expect("JSON");
        let address: LoopbackAddr = serde_json::from_value(ready["mqtt"].clone()).expect("a loopback address");

        let unit = pki.connect(address, PeerId::UNIT_A).await;
        unit.publish("hs/ack/unit-a", b"here").await.expect("granted");
        stdin.write_all(goodbye.as_bytes()).expect("the child reads");
        // After `finish` the pipe stays open, as the launcher keeps it; the other child loses it.
        let _held = (status == 0).then_some(stdin);
        assert_eq!(child.wait().expect("it ends").code(), Some(status));
    }
}

async fn start(limits: ServerLimits) -> (RunPki, Server) {
    let pki = RunPki::new();
    let server = serve(&pki, limits).await;
    (pki, server)
}

async fn serve(pki: &RunPki, limits: ServerLimits) -> Server {
    Server::start(LoopbackAddr::ANY_PORT, &pki.broker(), limits, link::stream::StreamLog::none())
        .await
        .expect("a loopback port is to be had")
}

/// The next refusal; connections and ends are skipped.
async fn denial(server: &mut Server) -> Denial {
    loop {
        match server.event().await.expect("the broker runs") {
            Event::Denied(denial) => return denial,
            Event::Admitted { .. } | Event::TakenOver { .. } | Event::Closed { .. } => {}
        }
    }
}
