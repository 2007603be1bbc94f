//! The live broker against real MQTT clients over loopback: who gets in, what each identity may do, what arrives.
//!
//! Nothing here waits for time to pass. That something did *not* arrive is shown by order: a marker that was sent
//! after it, on the same path, arrives first.

mod client;

use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};
use std::time::Duration;

use broker::gate::{Denial, Event};
use broker::server::{Limits, MAX_CONNECTIONS_OF_PEER, Server};
use client::{Client, RunPki, open_session_bytes, raw_tls};
use link::clock::HostClock;
use link::loopback::LoopbackAddr;
use link::pki::Role;
use link::spec::{BrokerListen, Control, ORPHANED, ServiceSpec};
use rumqttc::{ConnectReturnCode, LastWill, QoS};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use wire::core::Subject;
use wire::id::{Boot, NodeId, PeerId, UnitId};

#[tokio::test]
async fn a_command_reaches_its_unit_and_the_ack_comes_back() {
    let (pki, mut server) = start(Limits::default()).await;
    let mut gateway = pki.connect(server.address(), PeerId::GATEWAY).await;
    let mut unit = pki.connect(server.address(), PeerId::UNIT_A).await;
    gateway.subscribe("hs/ack/+").await.expect("granted");
    unit.subscribe("hs/cmd/unit-a").await.expect("granted");

    gateway.publish("hs/cmd/unit-a", b"hold").await.expect("granted");
    assert_eq!(unit.received().await, ("hs/cmd/unit-a".to_owned(), b"hold".to_vec()));
    unit.publish("hs/ack/unit-a", b"held").await.expect("granted");
    assert_eq!(gateway.received().await, ("hs/ack/unit-a".to_owned(), b"held".to_vec()));
    server.stop().await;
}

#[tokio::test]
async fn a_client_without_a_certificate_or_with_a_foreign_one_never_speaks_mqtt() {
    let (pki, mut server) = start(Limits::default()).await;
    let foreign = RunPki::new();
    let no_good = [
        (pki.tls_without_certificate(), "missing"),
        (foreign.tls_trusting(PeerId::GATEWAY, &pki), "foreign"),
        (pki.tls_with(&pki.issue("gateway", Role::Listens)), "wrong_role"),
    ];
    for (config, name) in no_good {
        Client::open(server.address(), "gateway", config, None).await.expect_err("refused in the handshake");
        assert_eq!(denial(&mut server).await.name(), name);
    }
    Client::open(server.address(), "gateway", pki.tls_1_2(PeerId::GATEWAY), None)
        .await
        .expect_err("TLS 1.2 is refused");
    assert_eq!(denial(&mut server).await.name(), "version");
}

#[tokio::test]
async fn a_session_ends_as_soon_as_its_certificate_is_revoked_and_does_not_come_back() {
    let (pki, mut server) = start(Limits::default()).await;
    let credential = pki.issue("unit-a", Role::Dials);
    let unit = Client::open(server.address(), "unit-a", pki.tls_with(&credential), None).await.expect("admitted");
    unit.publish("hs/ack/unit-a", b"before").await.expect("granted");
    server.revocations().replace(pki.revoke(&credential)).expect("a newer list");
    let told = denial(&mut server).await;
    assert!(matches!(told, Denial::Dismissed { peer: PeerId::UNIT_A, .. }), "{told:?}");
    assert_eq!(told.name(), "revoked");
    unit.publish("hs/ack/unit-a", b"after").await.expect_err("its session is over");
    let again = Client::open(server.address(), "unit-a", pki.tls_with(&credential), None);
    again.await.expect_err("refused in the handshake");
    assert_eq!(denial(&mut server).await.name(), "revoked");
    let other = pki.connect(server.address(), PeerId::UNIT_B).await;
    other.publish("hs/ack/unit-b", b"of another").await.expect("only one was revoked");
}

#[tokio::test]
async fn a_certificate_cannot_take_another_client_id_nor_end_its_session() {
    let (pki, mut server) = start(Limits::default()).await;
    let gateway = pki.connect(server.address(), PeerId::GATEWAY).await;
    let mut victim = pki.connect(server.address(), PeerId::UNIT_A).await;
    victim.subscribe("hs/cmd/unit-a").await.expect("granted");
    for (id, expected) in [("unit-a", "unit-a"), ("gateway", "gateway"), ("nobody", "nobody")] {
        let refused =
            Client::open(server.address(), id, pki.tls(PeerId::UNIT_B), None).await.expect_err("not its name");
        assert_eq!(refused, Some(ConnectReturnCode::ClientIdentifierNotValid));
        let denial = denial(&mut server).await;
        assert_eq!(denial, Denial::ClientId { expected: PeerId::UNIT_B, got: expected.to_owned() });
    }
    gateway.publish("hs/cmd/unit-a", b"still there").await.expect("granted");
    assert_eq!(victim.received().await.1, b"still there");
}

#[tokio::test]
async fn a_will_and_an_older_protocol_level_are_refused_by_name() {
    let (pki, mut server) = start(Limits::default()).await;
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
async fn a_forbidden_publication_is_refused_and_delivered_to_nobody() {
    let (pki, mut server) = start(Limits::default()).await;
    let mut gateway = pki.connect(server.address(), PeerId::GATEWAY).await;
    let mut victim = pki.connect(server.address(), PeerId::UNIT_A).await;
    let insider = pki.connect(server.address(), PeerId::UNIT_B).await;
    gateway.subscribe("hs/ack/+").await.expect("granted");
    victim.subscribe("hs/cmd/unit-a").await.expect("granted");

    for topic in ["hs/cmd/unit-a", "hs/ack/unit-a", "hs/cmd/unit-b", "hs/cmd/sim", "other"] {
        insider.publish(topic, b"forged").await.expect_err(topic);
        assert!(matches!(denial(&mut server).await, Denial::Access { peer: PeerId::UNIT_B, .. }));
    }
    insider.publish_unacknowledged("hs/cmd/unit-a", b"forged").await;
    assert_eq!(denial(&mut server).await.name(), "not_granted");

    insider.publish("hs/ack/unit-b", b"marker").await.expect("its own ack, on the same session");
    gateway.publish("hs/cmd/unit-a", b"marker").await.expect("granted");
    assert_eq!(victim.received().await.1, b"marker", "nothing forged came before");
    assert_eq!(gateway.received().await.1, b"marker", "nothing forged came before");
}

#[tokio::test]
async fn a_forbidden_subscription_is_refused_and_hears_nothing() {
    let (pki, mut server) = start(Limits::default()).await;
    let gateway = pki.connect(server.address(), PeerId::GATEWAY).await;
    let mut insider = pki.connect(server.address(), PeerId::UNIT_B).await;
    let filters =
        ["#", "hs/#", "hs/cmd/+", "hs/cmd/#", "hs/+/unit-b", "hs/cmd/unit-a", "hs/ack/+", "hs/ack/unit-b", "$SYS/#"];
    for filter in filters {
        insider.subscribe(filter).await.expect_err(filter);
        assert!(matches!(denial(&mut server).await, Denial::Access { peer: PeerId::UNIT_B, .. }), "{filter}");
    }
    insider.subscribe("$share/g/hs/cmd/unit-b").await.expect_err("no shared subscriptions");
    insider.subscribe("hs/cmd/unit-b").await.expect("granted");
    gateway.publish("hs/cmd/unit-a", b"not for b").await.expect("granted");
    gateway.publish("hs/cmd/unit-b", b"marker").await.expect("granted");
    assert_eq!(insider.received().await.1, b"marker");
}

#[tokio::test]
async fn a_silent_peer_holds_up_nobody_and_connections_are_capped() {
    let limits = Limits { connections: 2, handshake: Duration::from_secs(600) };
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

#[tokio::test]
async fn one_certificate_holds_one_session_and_few_connections() {
    let (pki, mut server) = start(Limits::default()).await;
    let first = pki.connect(server.address(), PeerId::UNIT_A).await;
    let second = pki.connect(server.address(), PeerId::UNIT_A).await;
    while server.event().await != Some(Event::Closed { peer: PeerId::UNIT_A }) {}
    first.publish("hs/ack/unit-a", b"from the old one").await.expect_err("taken over");
    second.publish("hs/ack/unit-a", b"from the new one").await.expect("granted");

    let _half_open = raw_tls(server.address(), pki.tls(PeerId::UNIT_A)).await;
    let _refused = raw_tls(server.address(), pki.tls(PeerId::UNIT_A)).await;
    let expected = MAX_CONNECTIONS_OF_PEER;
    assert_eq!(denial(&mut server).await, Denial::ConnectionsOfPeer { peer: PeerId::UNIT_A, expected });
}

#[tokio::test]
async fn the_model_and_the_live_broker_agree_on_who_receives() {
    let (pki, mut server) = start(Limits::default()).await;
    let mut model = broker::Broker::new();
    let mut clients = Vec::new();
    for (peer, filter) in
        [(PeerId::GATEWAY, "hs/ack/+"), (PeerId::UNIT_A, "hs/cmd/unit-a"), (PeerId::UNIT_B, "hs/cmd/unit-b")]
    {
        model.subscribe(peer, filter).expect("granted");
        let client = pki.connect(server.address(), peer).await;
        client.subscribe(filter).await.expect("granted");
        clients.push((peer, client, Vec::new()));
    }

    for publisher in 0..clients.len() {
        for subject in [UnitId::A, UnitId::B].into_iter().flat_map(|unit| [Subject::Command(unit), Subject::Ack(unit)])
        {
            let (peer, client, _) = &clients[publisher];
            let (peer, text) = (*peer, format!("{peer} to {}", subject.topic()));
            let live = client.publish(&subject.topic(), text.as_bytes()).await;
            let modelled = model.publish(peer, subject);
            assert_eq!(live.is_ok(), modelled.is_ok(), "{text}");
            for (receiver, _, expected) in &mut clients {
                if modelled.as_ref().is_ok_and(|receivers| receivers.contains(receiver)) {
                    expected.push((subject.topic(), text.clone().into_bytes()));
                }
            }
        }
    }
    for (peer, client, expected) in &mut clients {
        for publication in expected {
            assert_eq!(client.received().await, *publication, "{peer}");
        }
        assert!(client.inbox_is_empty(), "{peer} received more than the model says");
    }
    server.stop().await;
}

#[tokio::test]
async fn the_process_says_where_it_listens_and_ends_when_told_or_when_its_launcher_is_gone() {
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
        let at: LoopbackAddr = serde_json::from_value(ready["mqtt"].clone()).expect("a loopback address");

        let unit = pki.connect(at, PeerId::UNIT_A).await;
        unit.publish("hs/ack/unit-a", b"here").await.expect("granted");
        stdin.write_all(goodbye.as_bytes()).expect("the child reads");
        // After `finish` the pipe stays open, as the launcher keeps it; the other child loses it.
        let _held = (status == 0).then_some(stdin);
        assert_eq!(child.wait().expect("it ends").code(), Some(status));
    }
}

async fn start(limits: Limits) -> (RunPki, Server) {
    let pki = RunPki::new();
    let server = Server::start(LoopbackAddr::ANY_PORT, &pki.broker(), limits, link::stream::StreamLog::none())
        .await
        .expect("a loopback port is to be had");
    (pki, server)
}

/// The next refusal, past comings and goings.
async fn denial(server: &mut Server) -> Denial {
    loop {
        match server.event().await.expect("the broker runs") {
            Event::Denied(denial) => return denial,
            Event::Admitted { .. } | Event::Closed { .. } => {}
        }
    }
}
