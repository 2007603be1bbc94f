//! The accept loop on real sockets.

use std::net::UdpSocket;
use std::time::Duration;

use link::certificates::Fault;
use link::dtls::dial::dial;
use link::dtls::listen::{Listener, listen};
use link::dtls::session::{SessionCounters, SessionEvent, SessionHandle, Settings};
use link::guard::GuardMode;
use link::guard::observe::ObservationLog;
use link::loopback::LoopbackAddr;
use link::pki::{Authority, Credential, Role};
use link::relay::DatagramRelay;
use link::spec::RelayLeg;
use tokio::sync::mpsc;
use wire::core::Input;
use wire::id::PeerId;

use super::network::{credentials, genuine_hello, list};

struct Gateway {
    listener: Listener,
    events: mpsc::Receiver<SessionEvent>,
    counters: std::sync::Arc<SessionCounters>,
    unit: Credential,
}

fn settings(credential: &Credential) -> Settings {
    Settings::new(GuardMode::Required, Duration::from_secs(60), list(credential))
}

fn gateway() -> Gateway {
    let (unit, credential) = credentials();
    let (tx, events) = mpsc::channel(64);
    let settings = settings(&credential);
    let counters = settings.counters.clone();
    let listener = listen(LoopbackAddr::ANY_PORT, credential, settings, tx).unwrap();
    Gateway { listener, events, counters, unit }
}

async fn opened(events: &mut mpsc::Receiver<SessionEvent>) -> SessionHandle {
    loop {
        if let SessionEvent::Opened(handle) = events.recv().await.unwrap() {
            return handle;
        }
    }
}

/// The next record; the handle of a session that opens meanwhile is dropped, which ends that session.
async fn record(events: &mut mpsc::Receiver<SessionEvent>) -> Vec<u8> {
    loop {
        if let SessionEvent::Record(_, bytes) = events.recv().await.unwrap() {
            return bytes;
        }
    }
}

#[tokio::test]
async fn a_silent_client_hello_keeps_nobody_out() {
    let hello = genuine_hello().await;
    let mut gateway = gateway();
    let silent = UdpSocket::bind("127.0.0.1:0").unwrap();
    silent.send_to(&hello, gateway.listener.local().socket()).unwrap();
    let (tx, mut unit) = mpsc::channel(64);
    let _dialler = dial(gateway.listener.local(), gateway.unit.clone(), PeerId::GATEWAY, settings(&gateway.unit), tx);
    let up = opened(&mut unit).await;
    let down = opened(&mut gateway.events).await;
    assert_eq!((up.peer, down.peer), (PeerId::GATEWAY, PeerId::UNIT_A));
    assert!(up.send(b"up".to_vec()) && down.send(b"down".to_vec()));
    assert_eq!(record(&mut gateway.events).await, b"up");
    assert_eq!(record(&mut unit).await, b"down");
}

#[tokio::test]
async fn malformed_datagrams_leave_the_listener_serving() {
    let hello = genuine_hello().await;
    let mut gateway = gateway();
    let hostile = UdpSocket::bind("127.0.0.1:0").unwrap();
    for at in 0..hello.len() {
        let mut changed = hello.clone();
        changed[at] ^= 0xff;
        hostile.send_to(&changed, gateway.listener.local().socket()).unwrap();
        hostile.send_to(&hello[..at], gateway.listener.local().socket()).unwrap();
    }
    let (tx, mut unit) = mpsc::channel(64);
    let _dialler = dial(gateway.listener.local(), gateway.unit.clone(), PeerId::GATEWAY, settings(&gateway.unit), tx);
    let up = opened(&mut unit).await;
    let _down = opened(&mut gateway.events).await;
    assert!(up.send(b"up".to_vec()));
    assert_eq!(record(&mut gateway.events).await, b"up");
    assert!(gateway.counters.read().unknown_peers > 0);
}

/// A session dropped at one end is closed at the other, and opened again.
#[tokio::test]
async fn dropped_session_closes_and_reopens_at_both_ends() {
    let mut gateway = gateway();
    let (tx, mut unit) = mpsc::channel(64);
    let _dialler = dial(gateway.listener.local(), gateway.unit.clone(), PeerId::GATEWAY, settings(&gateway.unit), tx);
    let first = opened(&mut unit).await.session;
    drop(opened(&mut gateway.events).await);
    let second = opened(&mut unit).await.session;
    assert_ne!(first, second);
    assert!(gateway.counters.read().opened >= 1);
}

/// It ends at expiry, and at revocation at once.
#[tokio::test]
async fn session_ends_with_its_certificates_validity() {
    #[expect(clippy::disallowed_methods, reason = "certificates are valid by the wall clock")]
    let now = std::time::SystemTime::now();
    let authority = Authority::new().unwrap();
    let hour = Duration::from_secs(3600);
    let short = authority.issue_between(PeerId::UNIT_A, Role::Dials, now - hour, now + Duration::from_secs(2)).unwrap();
    let long = authority.issue(PeerId::UNIT_B, Role::Dials).unwrap();
    let credential = authority.issue(PeerId::GATEWAY, Role::Listens).unwrap();
    let (log, mut seen) = ObservationLog::new(1024);
    let settings = Settings { log: Some(log.clone()), ..settings(&credential) };
    let (held, counters) = (settings.revocations.clone(), settings.counters.clone());
    let (tx, mut events) = mpsc::channel(64);
    let listener = listen(LoopbackAddr::ANY_PORT, credential, settings, tx).unwrap();
    for (unit, expected) in [(short, Fault::Expired), (long.clone(), Fault::Revoked)] {
        let (tx, _at_unit) = mpsc::channel(64);
        // Either end may notice first that a certificate has ended, and close.
        let at_unit = Settings { log: Some(log.clone()), ..self::settings(&unit) };
        let _dialler = dial(listener.local(), unit.clone(), PeerId::GATEWAY, at_unit, tx);
        let handle = opened(&mut events).await;
        if expected == Fault::Revoked {
            held.replace(authority.revoke(&[&long]).unwrap()).unwrap();
        }
        while !matches!(events.recv().await.unwrap(), SessionEvent::Closed(session) if session == handle.session) {}
        let faults: Vec<_> = std::iter::from_fn(|| seen.try_recv().ok()).filter_map(|seen| seen.fault).collect();
        assert!(faults.contains(&expected), "{faults:?}");
    }
    assert!(counters.read().dismissed >= 1);
}

#[tokio::test]
async fn foreign_alert_does_not_end_a_relayed_session() {
    let mut gateway = gateway();
    let (to_core, mut inputs) = mpsc::channel(64);
    let leg = RelayLeg { at: LoopbackAddr::ANY_PORT, upstream: gateway.listener.local() };
    let relay = std::sync::Arc::new(DatagramRelay::open(leg, LoopbackAddr::ANY_PORT, to_core).unwrap());
    let passing = relay.clone();
    tokio::spawn(async move {
        while let Some(Input::Datagram { side, bytes }) = inputs.recv().await {
            passing.emit(side.opposite(), &bytes);
        }
    });
    let (tx, mut unit) = mpsc::channel(64);
    let _dialler = dial(relay.local(), gateway.unit.clone(), PeerId::GATEWAY, settings(&gateway.unit), tx);
    let up = opened(&mut unit).await;
    let _down = opened(&mut gateway.events).await;
    relay.emit_from_unknown_peer(&[21, 254, 253, 0, 0, 0, 0, 0, 0, 0, 99, 0, 2, 2, 40]);
    relay.emit(wire::core::Side::Server, &[21, 254, 253, 0, 0, 0, 0, 0, 0, 0, 99, 0, 2, 2, 40]);
    assert!(up.send(b"through".to_vec()));
    assert_eq!(record(&mut gateway.events).await, b"through");
    let stats = gateway.counters.read();
    assert_eq!((stats.unknown_peers, stats.guard.plaintext_after), (1, 1));
    assert_eq!(relay.stats().strange, 1);
}
