//! One association against a network without keys.

use std::sync::{Arc, Mutex};
use std::time::{Duration, SystemTime};

use dtls::cipher_suite::CipherSuiteId;
use dtls::config::{Config, ExtendedMasterSecretType};
use dtls::conn::DTLSConn;
use link::dtls::{DtlsError, MAX_RECORD, REPLAY_WINDOW, server};
use link::guard::GuardMode;
use link::guard::observe::{ObservationLog, Verdict};
use link::guard::record::APPLICATION_DATA;
use link::pki::{Authority, Role, dns_name};
use wire::core::Side;
use wire::id::PeerId;

use super::network::{all, clear, credentials, established, guard, handshake, list, network, next};

/// A plaintext fatal alert, `handshake_failure`, as anybody can write it.
const FORGED_ALERT: [u8; 15] = [21, 254, 253, 0, 0, 0, 0, 0, 0, 0, 99, 0, 2, 2, 40];
/// A plaintext close notification.
const FORGED_CLOSE: [u8; 15] = [21, 254, 253, 0, 0, 0, 0, 0, 0, 0, 98, 0, 2, 1, 0];
/// Plaintext application data.
const FORGED_DATA: [u8; 15] = [23, 254, 253, 0, 0, 0, 0, 0, 0, 0, 97, 0, 2, 1, 0];
/// A record of a type that does not exist.
const FORGED_TYPE: [u8; 15] = [99, 254, 253, 0, 0, 0, 0, 0, 0, 0, 96, 0, 2, 1, 0];
/// A change cipher spec that is not one.
const FORGED_CHANGE: [u8; 15] = [20, 254, 253, 0, 0, 0, 0, 0, 0, 0, 95, 0, 2, 7, 7];

#[tokio::test(start_paused = true)]
async fn both_ends_learn_who_the_other_is() {
    let (_network, client, server) = established(clear(), GuardMode::Required).await;
    assert_eq!((client.peer(), server.peer()), (PeerId::GATEWAY, PeerId::UNIT_A));
    client.send(b"up").await.unwrap();
    server.send(b"down").await.unwrap();
    assert_eq!(next(&server).await.unwrap(), b"up");
    assert_eq!(next(&client).await.unwrap(), b"down");
}

/// A record has a size limit, too.
#[tokio::test(start_paused = true)]
async fn authenticated_close_ends_both_ends() {
    let (_network, client, server) = established(clear(), GuardMode::Required).await;
    client.send(&[7; MAX_RECORD]).await.unwrap();
    assert!(client.send(&[7; MAX_RECORD + 1]).await.is_err());
    assert_eq!(next(&server).await.unwrap().len(), MAX_RECORD);
    client.close().await;
    assert!(server.recv().await.is_err());
}

#[tokio::test(start_paused = true)]
async fn certificate_of_another_run_is_refused() {
    let (unit, gateway) = credentials();
    let (rogue_unit, rogue_gateway) = credentials();
    for (unit, gateway) in [(&unit, &rogue_gateway), (&rogue_unit, &gateway)] {
        let network = network(clear());
        let (client, server) = handshake(&network, unit, gateway, GuardMode::Required).await;
        assert!(client.is_err() && server.is_err());
    }
}

#[tokio::test(start_paused = true)]
#[expect(clippy::disallowed_methods, reason = "certificates are dated by the wall clock")]
async fn wrong_name_role_or_time_is_refused() {
    let authority = Authority::new().unwrap();
    let unit = authority.issue(PeerId::UNIT_A, Role::Dials).unwrap();
    let gateway = authority.issue(PeerId::GATEWAY, Role::Listens).unwrap();
    let hour = Duration::from_secs(3600);
    let now = SystemTime::now();
    let valid_between = |peer, role, from, to| authority.issue_between(peer, role, from, to).unwrap();
    let cases = [
        ("another name", &unit, &authority.issue(PeerId::UNIT_C, Role::Listens).unwrap()),
        ("a server that may only dial", &unit, &authority.issue(PeerId::GATEWAY, Role::Dials).unwrap()),
        ("a client that may only listen", &authority.issue(PeerId::UNIT_A, Role::Listens).unwrap(), &gateway),
        ("an expired client", &valid_between(PeerId::UNIT_A, Role::Dials, now - 2 * hour, now - hour), &gateway),
        ("a client from the future", &valid_between(PeerId::UNIT_A, Role::Dials, now + hour, now + 2 * hour), &gateway),
        ("an expired server", &unit, &valid_between(PeerId::GATEWAY, Role::Listens, now - 2 * hour, now - hour)),
    ];
    for (case, unit, gateway) in cases {
        let network = network(clear());
        let (client, server) = handshake(&network, unit, gateway, GuardMode::Required).await;
        assert!(client.is_err(), "{case}: the client took it");
        assert!(server.is_err() || case == "another name", "{case}: the server took it");
    }
}

#[tokio::test(start_paused = true)]
async fn a_client_without_a_certificate_is_refused() {
    let (unit, gateway) = credentials();
    let network = network(clear());
    let config = Config {
        cipher_suites: vec![CipherSuiteId::Tls_Ecdhe_Ecdsa_With_Aes_128_Gcm_Sha256],
        extended_master_secret: ExtendedMasterSecretType::Require,
        roots_cas: unit.roots().unwrap(),
        server_name: dns_name(PeerId::GATEWAY),
        ..Config::default()
    };
    let bare = tokio::time::timeout(Duration::from_secs(10), DTLSConn::new(network.client.clone(), config, true, None));
    let (bare, server) =
        tokio::join!(bare, server(network.server.clone(), &gateway, list(&gateway), guard(GuardMode::Required)));
    assert!(server.is_err());
    assert!(!matches!(bare, Ok(Ok(_))));
}

#[tokio::test(start_paused = true)]
async fn forged_plaintext_does_not_end_a_guarded_association() {
    for forged in [FORGED_ALERT, FORGED_CLOSE, FORGED_DATA, FORGED_TYPE, FORGED_CHANGE] {
        let (network, client, server) = established(clear(), GuardMode::Required).await;
        network.to_server.send(forged.to_vec()).await.unwrap();
        network.to_client.send(forged.to_vec()).await.unwrap();
        client.send(b"still here").await.unwrap();
        server.send(b"here too").await.unwrap();
        assert_eq!(next(&server).await.unwrap(), b"still here", "type {}", forged[0]);
        assert_eq!(next(&client).await.unwrap(), b"here too", "type {}", forged[0]);
    }
}

#[tokio::test(start_paused = true)]
async fn one_forged_plaintext_alert_ends_an_unguarded_association() {
    let (network, client, server) = established(clear(), GuardMode::Waived).await;
    network.to_server.send(FORGED_ALERT.to_vec()).await.unwrap();
    assert!(server.recv().await.is_err());
    assert!(client.recv().await.is_err());
}

#[tokio::test(start_paused = true)]
async fn forged_alert_does_not_stop_the_handshake() {
    let network = network(Box::new(|_, datagram| vec![FORGED_ALERT.to_vec(), datagram, FORGED_CLOSE.to_vec()]));
    let (unit, gateway) = credentials();
    let (client, server) = handshake(&network, &unit, &gateway, GuardMode::Required).await;
    assert!(client.is_ok() && server.is_ok());
}

#[tokio::test(start_paused = true)]
async fn the_guard_observes_each_record_with_its_verdict() {
    let (unit, gateway) = credentials();
    let network = network(clear());
    let (log, mut observations) = ObservationLog::new(64);
    let mut settings = guard(GuardMode::Required);
    settings.log = Some(log);
    let counters = settings.counters.clone();
    let (client, server) = tokio::join!(
        link::dtls::client(network.client.clone(), &unit, PeerId::GATEWAY, list(&unit), guard(GuardMode::Required)),
        server(network.server.clone(), &gateway, list(&gateway), settings),
    );
    let (client, server) = (client.unwrap(), server.unwrap());
    network.to_server.send(FORGED_ALERT.to_vec()).await.unwrap();
    client.send(b"record").await.unwrap();
    assert_eq!(next(&server).await.unwrap(), b"record");
    let mut seen = Vec::new();
    while let Ok(observation) = observations.try_recv() {
        seen.push(observation);
    }
    let forged = seen.iter().find(|o| o.verdict == Verdict::PlaintextAfterCompletion).unwrap();
    assert_eq!((forged.epoch, forged.sequence, forged.length), (0, 99, 15));
    assert_eq!(forged.digest, link::guard::observe::digest(&FORGED_ALERT));
    assert!(seen.iter().any(|o| o.content == APPLICATION_DATA && o.epoch == 1 && o.verdict == Verdict::Passed));
    let stats = counters.read();
    assert_eq!((stats.application, stats.refused(), stats.unlogged), (1, 1, 0));
    assert_eq!(stats.records, seen.len() as u64);
}

#[tokio::test(start_paused = true)]
async fn replayed_records_are_not_delivered() {
    let seen = Arc::new(Mutex::new(Vec::new()));
    let log = seen.clone();
    let tap = move |side: Side, datagram: Vec<u8>| {
        if side == Side::Client {
            log.lock().unwrap().push(datagram.clone());
        }
        vec![datagram.clone(), datagram]
    };
    let (network, client, server) = established(Box::new(tap), GuardMode::Required).await;
    for n in 0..100u8 {
        client.send(&[n]).await.unwrap();
        assert_eq!(next(&server).await.unwrap(), [n]);
    }
    let replay = seen.lock().unwrap().clone();
    for datagram in replay {
        network.to_server.send(datagram).await.unwrap();
    }
    client.send(b"after").await.unwrap();
    assert_eq!(all(&server).await, [b"after".to_vec()]);
}

#[tokio::test(start_paused = true)]
async fn withheld_records_are_delivered_when_released_late() {
    let held = Arc::new(Mutex::new((false, Vec::new())));
    let state = held.clone();
    let tap = move |side: Side, datagram: Vec<u8>| {
        let mut state = state.lock().unwrap();
        if side == Side::Client && state.0 {
            state.1.push(datagram);
            return Vec::new();
        }
        vec![datagram]
    };
    let (network, client, server) = established(Box::new(tap), GuardMode::Required).await;
    held.lock().unwrap().0 = true;
    for n in 0..100u8 {
        client.send(&[n]).await.unwrap();
    }
    assert_eq!(next(&server).await, None);
    held.lock().unwrap().0 = false;
    client.send(b"newer").await.unwrap();
    assert_eq!(next(&server).await.unwrap(), b"newer");
    tokio::time::advance(Duration::from_secs(60)).await;
    let released = std::mem::take(&mut held.lock().unwrap().1);
    for datagram in released {
        network.to_server.send(datagram).await.unwrap();
    }
    let late = all(&server).await;
    assert_eq!(late.len(), REPLAY_WINDOW - 1, "DTLS is anti-replay, not anti-delay");
    assert_eq!(late.last().unwrap(), &[99]);
}

#[tokio::test(start_paused = true)]
async fn tampered_records_are_discarded_without_ending_it() {
    let mut flip = 0usize;
    let tap = move |side: Side, mut datagram: Vec<u8>| {
        if side == Side::Client && datagram[0] == APPLICATION_DATA {
            flip += 1;
            if flip.is_multiple_of(2) {
                let index = 13 + flip % (datagram.len() - 13);
                datagram[index] ^= 1 << (flip % 8);
            }
        }
        vec![datagram]
    };
    let (_network, client, server) = established(Box::new(tap), GuardMode::Required).await;
    for n in 0..200u8 {
        client.send(&[n]).await.unwrap();
    }
    let expected: Vec<Vec<u8>> = (0..200).step_by(2).map(|n| vec![n]).collect();
    assert_eq!(all(&server).await, expected);
}

#[tokio::test(start_paused = true)]
async fn handshakes_complete_at_twenty_percent_loss() {
    let (unit, gateway) = credentials();
    for seed in 1..=20u64 {
        let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let tap = move |_, datagram: Vec<u8>| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            if (state >> 33) % 5 == 0 { Vec::new() } else { vec![datagram] }
        };
        let network = network(Box::new(tap));
        let (client, server) = handshake(&network, &unit, &gateway, GuardMode::Required).await;
        assert!(client.is_ok() && server.is_ok(), "seed {seed}: {:?} {:?}", client.err(), server.err());
    }
}

#[tokio::test(start_paused = true)]
async fn a_lost_last_flight_is_repeated() {
    let mut server_datagrams = 0;
    let tap = move |side: Side, datagram: Vec<u8>| {
        // The last flight starts with a change cipher spec.
        if side == Side::Server && datagram[0] == 20 {
            server_datagrams += 1;
            if server_datagrams == 1 {
                return Vec::new();
            }
        }
        vec![datagram]
    };
    let network = network(Box::new(tap));
    let (unit, gateway) = credentials();
    let counters = guard(GuardMode::Required);
    let read = counters.counters.clone();
    let served = tokio::spawn({
        let path = network.server.clone();
        async move {
            let server = server(path, &gateway, list(&gateway), counters).await.unwrap();
            server.recv().await.unwrap()
        }
    });
    let client =
        link::dtls::client(network.client.clone(), &unit, PeerId::GATEWAY, list(&unit), guard(GuardMode::Required))
            .await;
    client.unwrap().send(b"made it").await.unwrap();
    assert_eq!(served.await.unwrap(), b"made it");
    assert!(read.read().resent >= 1);
}

#[tokio::test(start_paused = true)]
async fn silent_peer_costs_at_most_the_limit() {
    let network = network(Box::new(|_, _| Vec::new()));
    let (unit, gateway) = credentials();
    let (client, server) = handshake(&network, &unit, &gateway, GuardMode::Required).await;
    assert!(matches!(client, Err(DtlsError::TooSlow)));
    assert!(matches!(server, Err(DtlsError::TooSlow)));
}
