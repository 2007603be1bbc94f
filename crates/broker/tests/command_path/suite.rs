//! Obligations of every broker on the command plane, from any author. The form of a refusal is the broker's own
//! business; that no message passes which the table of rights does not grant is not.

use std::time::Duration;

use broker::acl::{Verb, grant};
use link::loopback::LoopbackAddr;
use link::pki::Role;
use tokio::net::TcpStream;
use tokio::sync::mpsc;
use wire::core::{Input, Subject};
use wire::id::{PeerId, UnitId};

use crate::client::{Client, RunPki};

/// Time that one publication has to come through before it is made again.
const AGAIN: Duration = Duration::from_millis(50);

/// A running broker with the certificates and rights of a run.
pub(crate) trait Broker: Sized {
    /// True if it refuses a subscription to a topic that its holder may not read. One that does not has to deliver no
    /// message of it.
    const REFUSES_SUBSCRIPTIONS: bool;

    /// Starts a broker; without one on this host, reports that on standard error.
    async fn start(pki: &RunPki) -> Option<Self>;

    /// Address at which it listens.
    fn address(&self) -> LoopbackAddr;

    /// Gives it this revocation list.
    async fn revoke(&mut self, list_der: Vec<u8>);

    /// Checks that the broker's log has its last refusal under this name, as far as the log names refusals.
    async fn named(&mut self, refusal: &str);

    /// Checks that the broker's log has its last refusal as beyond the rights of `peer`, as far as the log reports
    /// that.
    async fn beyond_rights(&mut self, peer: PeerId);

    /// Waits until it has ended a session of `peer`.
    async fn ended(&mut self, peer: PeerId);
}

/// The tests of the suite over one broker.
macro_rules! command_path {
    ($broker:ty: $($promise:ident)*) => {
        $(#[tokio::test]
        async fn $promise() {
            let pki = $crate::client::RunPki::new();
            if let Some(broker) = <$broker as $crate::suite::Broker>::start(&pki).await {
                $crate::suite::$promise(pki, broker).await;
            }
        })*
    };
    ($broker:ty) => {
        $crate::suite::command_path! { $broker:
            a_command_reaches_its_unit_and_the_ack_comes_back
            a_client_without_a_certificate_or_with_a_foreign_one_never_speaks_mqtt
            a_revoked_certificate_does_not_come_back
            a_certificate_cannot_take_another_client_id_nor_end_its_session
            a_forbidden_publication_is_refused_and_delivered_to_nobody
            a_forbidden_subscription_hears_nothing
            a_silent_peer_holds_up_nobody
            one_certificate_holds_one_session
            a_service_learns_that_its_session_is_lost_when_it_is_taken_and_takes_it_back
            the_model_and_the_broker_agree_on_who_receives
        }
    };
}
pub(crate) use command_path;

pub(crate) async fn a_command_reaches_its_unit_and_the_ack_comes_back(pki: RunPki, server: impl Broker) {
    let mut gateway = pki.connect(server.address(), PeerId::GATEWAY).await;
    let mut unit = pki.connect(server.address(), PeerId::UNIT_A).await;
    gateway.subscribe("hs/ack/+").await.expect("granted");
    unit.subscribe("hs/cmd/unit-a").await.expect("granted");

    gateway.publish("hs/cmd/unit-a", b"hold").await.expect("granted");
    assert_eq!(unit.received().await, ("hs/cmd/unit-a".to_owned(), b"hold".to_vec()));
    unit.publish("hs/ack/unit-a", b"held").await.expect("granted");
    assert_eq!(gateway.received().await, ("hs/ack/unit-a".to_owned(), b"held".to_vec()));
}

pub(crate) async fn a_client_without_a_certificate_or_with_a_foreign_one_never_speaks_mqtt(
    pki: RunPki,
    mut server: impl Broker,
) {
    let foreign = RunPki::new();
    let no_good = [
        (pki.tls_without_certificate(), "missing"),
        (foreign.tls_trusting(PeerId::GATEWAY, &pki), "foreign"),
        (pki.tls_with(&pki.issue("gateway", Role::Listens)), "wrong_role"),
        (pki.tls_1_2(PeerId::GATEWAY), "version"),
    ];
    for (config, name) in no_good {
        let code = Client::open(server.address(), "gateway", config, None).await.expect_err(name);
        assert_eq!(code, None, "{name}: refused in the handshake, before MQTT");
        server.named(name).await;
    }
}

pub(crate) async fn a_revoked_certificate_does_not_come_back(pki: RunPki, mut server: impl Broker) {
    let credential = pki.issue("unit-a", Role::Dials);
    let unit = Client::open(server.address(), "unit-a", pki.tls_with(&credential), None).await.expect("admitted");
    unit.publish("hs/ack/unit-a", b"before").await.expect("granted");
    drop(unit);
    server.revoke(pki.revoke(&credential)).await;
    let repeated = Client::open(server.address(), "unit-a", pki.tls_with(&credential), None).await;
    assert_eq!(repeated.expect_err("revoked"), None, "refused in the handshake, before MQTT");
    server.named("revoked").await;
    let other = pki.connect(server.address(), PeerId::UNIT_B).await;
    other.publish("hs/ack/unit-b", b"of another").await.expect("only one was revoked");
}

/// A broker may refuse a client id that is not the certificate's, or may use the certificate whatever it is called.
pub(crate) async fn a_certificate_cannot_take_another_client_id_nor_end_its_session(
    pki: RunPki,
    mut server: impl Broker,
) {
    let gateway = pki.connect(server.address(), PeerId::GATEWAY).await;
    let mut victim = pki.connect(server.address(), PeerId::UNIT_A).await;
    victim.subscribe("hs/cmd/unit-a").await.expect("granted");
    for id in ["unit-a", "gateway", "nobody"] {
        let Ok(pretender) = Client::open(server.address(), id, pki.tls(PeerId::UNIT_B), None).await else {
            server.named("client_id").await;
            continue;
        };
        pretender.publish("hs/ack/unit-a", b"forged").await.expect_err("the rights are the certificate's");
        pretender.publish("hs/cmd/unit-a", b"forged").await.expect_err("the rights are the certificate's");
        pretender.publish("hs/ack/unit-b", b"own").await.expect("the rights are the certificate's");
    }
    gateway.publish("hs/cmd/unit-a", b"still there").await.expect("granted");
    assert_eq!(victim.received().await.1, b"still there");
}

pub(crate) async fn a_forbidden_publication_is_refused_and_delivered_to_nobody(pki: RunPki, mut server: impl Broker) {
    let mut gateway = pki.connect(server.address(), PeerId::GATEWAY).await;
    let mut victim = pki.connect(server.address(), PeerId::UNIT_A).await;
    let insider = pki.connect(server.address(), PeerId::UNIT_B).await;
    gateway.subscribe("hs/ack/+").await.expect("granted");
    victim.subscribe("hs/cmd/unit-a").await.expect("granted");

    for topic in ["hs/cmd/unit-a", "hs/ack/unit-a", "hs/cmd/unit-b", "hs/cmd/sim", "other"] {
        insider.publish(topic, b"forged").await.expect_err(topic);
        server.beyond_rights(PeerId::UNIT_B).await;
    }
    insider.publish_unacknowledged("hs/cmd/unit-a", b"forged").await;
    server.named("not_granted").await;

    insider.publish("hs/ack/unit-b", b"marker").await.expect("its own ack, on the same session");
    gateway.publish("hs/cmd/unit-a", b"marker").await.expect("granted");
    assert_eq!(victim.received().await.1, b"marker", "nothing forged came before");
    assert_eq!(gateway.received().await.1, b"marker", "nothing forged came before");
}

pub(crate) async fn a_forbidden_subscription_hears_nothing<B: Broker>(pki: RunPki, mut server: B) {
    let gateway = pki.connect(server.address(), PeerId::GATEWAY).await;
    let mut insider = pki.connect(server.address(), PeerId::UNIT_B).await;
    let filters =
        ["#", "hs/#", "hs/cmd/+", "hs/cmd/#", "hs/+/unit-b", "hs/cmd/unit-a", "hs/ack/+", "hs/ack/unit-b", "$SYS/#"];
    for filter in filters {
        let got = insider.subscribe(filter).await;
        assert_eq!(got.is_err(), B::REFUSES_SUBSCRIPTIONS, "{filter}");
        server.beyond_rights(PeerId::UNIT_B).await;
    }
    insider.subscribe("hs/cmd/unit-b").await.expect("granted");
    let unit = pki.connect(server.address(), PeerId::UNIT_A).await;
    unit.publish("hs/ack/unit-a", b"not for b").await.expect("granted");
    gateway.publish("hs/cmd/unit-a", b"not for b").await.expect("granted");
    gateway.publish("hs/cmd/unit-b", b"marker").await.expect("granted");
    assert_eq!(insider.received().await, ("hs/cmd/unit-b".to_owned(), b"marker".to_vec()));
}

pub(crate) async fn a_silent_peer_holds_up_nobody(pki: RunPki, server: impl Broker) {
    let _silent = TcpStream::connect(server.address().socket()).await.expect("accepted");
    let gateway = pki.connect(server.address(), PeerId::GATEWAY).await;
    gateway.publish("hs/cmd/unit-a", b"in").await.expect("granted");
}

pub(crate) async fn one_certificate_holds_one_session(pki: RunPki, mut server: impl Broker) {
    let first = pki.connect(server.address(), PeerId::UNIT_A).await;
    let second = pki.connect(server.address(), PeerId::UNIT_A).await;
    server.ended(PeerId::UNIT_A).await;
    first.publish("hs/ack/unit-a", b"from the old one").await.expect_err("taken over");
    second.publish("hs/ack/unit-a", b"from the new one").await.expect("granted");
}

pub(crate) async fn a_service_learns_that_its_session_is_lost_when_it_is_taken_and_takes_it_back(
    pki: RunPki,
    server: impl Broker,
) {
    let (to, mut heard) = mpsc::channel(16);
    let subject = Subject::Command(UnitId::A);
    let _unit = pki.serve(server.address(), PeerId::UNIT_A, subject, to);
    let gateway = pki.connect(server.address(), PeerId::GATEWAY).await;
    reaches(&gateway, &mut heard, b"before").await;
    let thief = pki.connect(server.address(), PeerId::UNIT_A).await;
    let mut next = heard.recv().await.expect("it goes on");
    while matches!(next, Input::Published { .. }) {
        next = heard.recv().await.expect("it goes on");
    }
    assert_eq!(next, Input::SessionLost);
    drop(thief);
    reaches(&gateway, &mut heard, b"after").await;
}

/// Publishes until the unit has heard it: a message published while it has no subscription reaches no client.
async fn reaches(gateway: &Client, heard: &mut mpsc::Receiver<Input>, wanted: &[u8]) {
    loop {
        gateway.publish("hs/cmd/unit-a", wanted).await.expect("granted");
        let next = tokio::time::timeout(AGAIN, heard.recv()).await;
        if matches!(next, Ok(Some(Input::Published { bytes, .. })) if bytes == wanted) {
            return;
        }
    }
}

pub(crate) async fn the_model_and_the_broker_agree_on_who_receives(pki: RunPki, server: impl Broker) {
    let mut model = broker::Broker::new();
    let mut clients = Vec::new();
    for peer in [PeerId::GATEWAY, PeerId::UNIT_A, PeerId::UNIT_B] {
        let filter = grant(peer, Verb::Subscribe).expect("each may hear something").to_string();
        model.subscribe(peer, &filter).expect("granted");
        let client = pki.connect(server.address(), peer).await;
        client.subscribe(&filter).await.expect("granted");
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
}
