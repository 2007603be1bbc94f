//! Datagrams from outside of a run, at its relay, its gateway and its unit, on real sockets.

use std::net::{SocketAddr, UdpSocket};
use std::time::Duration;

use link::dtls::dial::dial;
use link::dtls::listen::listen;
use link::dtls::session::{SessionEvent, Settings};
use link::guard::GuardMode;
use link::guard::observe::ObservationLog;
use link::loopback::LoopbackAddr;
use link::pki::Credential;
use link::relay::DatagramRelay;
use link::spec::RelayLeg;
use tokio::sync::mpsc;
use wire::core::{Input, Side};
use wire::id::PeerId;

use super::network::{credentials, genuine_hello, list};

/// Address of the sockets of the run under test.
fn run_addr() -> LoopbackAddr {
    LoopbackAddr::of_run(std::process::id())
}

/// A socket of the run.
fn run_socket() -> UdpSocket {
    UdpSocket::bind(run_addr().socket()).unwrap()
}

/// A socket of another program on the same host.
fn outsider() -> UdpSocket {
    UdpSocket::bind("127.0.0.1:0").unwrap()
}

fn settings(credential: &Credential) -> Settings {
    Settings { own: run_addr(), ..Settings::new(GuardMode::Required, Duration::from_secs(60), list(credential)) }
}

struct Relayed {
    relay: DatagramRelay,
    inputs: mpsc::Receiver<Input>,
    front: SocketAddr,
    _server: UdpSocket,
}

fn relay() -> Relayed {
    let server = run_socket();
    let upstream = LoopbackAddr::try_from(server.local_addr().unwrap()).unwrap();
    let (to_core, inputs) = mpsc::channel(64);
    let relay = DatagramRelay::open(RelayLeg { at: LoopbackAddr::ANY_PORT, upstream }, run_addr(), to_core).unwrap();
    let front = relay.local().socket();
    Relayed { relay, inputs, front, _server: server }
}

async fn datagram(inputs: &mut mpsc::Receiver<Input>) -> Vec<u8> {
    let Some(Input::Datagram { bytes, .. }) = inputs.recv().await else { panic!("no datagram") };
    bytes
}

/// Checks that the relay's downlink reaches it.
fn gets_the_downlink(client: &UdpSocket, relay: &DatagramRelay) {
    relay.emit(Side::Client, b"answer");
    let mut buf = [0; 16];
    let n = client.recv(&mut buf).unwrap();
    assert_eq!(&buf[..n], b"answer");
}

#[tokio::test]
async fn stray_datagram_does_not_take_the_downlink() {
    let hello = genuine_hello().await;
    let mut relayed = relay();
    let (client, outsider, other_socket) = (run_socket(), outsider(), run_socket());
    client.send_to(&hello, relayed.front).unwrap();
    assert_eq!(datagram(&mut relayed.inputs).await, hello);
    // Neither noise nor a sound hello from elsewhere, nor noise from another socket of the run.
    outsider.send_to(b"stray", relayed.front).unwrap();
    outsider.send_to(&hello, relayed.front).unwrap();
    other_socket.send_to(b"stray", relayed.front).unwrap();
    client.send_to(b"again", relayed.front).unwrap();
    assert_eq!(datagram(&mut relayed.inputs).await, b"again");
    gets_the_downlink(&client, &relayed.relay);
    let stats = relayed.relay.stats();
    assert_eq!((stats.outsiders, stats.stale, stats.received, stats.emitted), (2, 1, [2, 0], [1, 0]));
}

/// Even one that comes before the client's own.
#[tokio::test]
async fn stray_datagram_does_not_become_the_client() {
    let hello = genuine_hello().await;
    let mut relayed = relay();
    outsider().send_to(&hello, relayed.front).unwrap();
    let client = run_socket();
    client.send_to(&hello, relayed.front).unwrap();
    datagram(&mut relayed.inputs).await;
    gets_the_downlink(&client, &relayed.relay);
    assert_eq!((relayed.relay.stats().outsiders, relayed.relay.stats().received), (1, [1, 0]));
}

#[tokio::test]
async fn client_from_another_port_is_let_in_again() {
    let hello = genuine_hello().await;
    let mut relayed = relay();
    let (before, after) = (run_socket(), run_socket());
    before.send_to(&hello, relayed.front).unwrap();
    after.send_to(&hello, relayed.front).unwrap();
    // What the socket before still sends is not the client's any more.
    before.send_to(b"late", relayed.front).unwrap();
    after.send_to(b"more", relayed.front).unwrap();
    for expected in [&hello[..], &hello[..], b"more"] {
        assert_eq!(datagram(&mut relayed.inputs).await, expected);
    }
    gets_the_downlink(&after, &relayed.relay);
    assert_eq!((relayed.relay.stats().outsiders, relayed.relay.stats().stale), (0, 1));
}

#[tokio::test]
async fn outsider_datagrams_enter_no_account_of_the_run() {
    let hello = genuine_hello().await;
    let (unit, gateway) = credentials();
    let (log, mut seen) = ObservationLog::new(1024);
    let at_gateway = Settings { log: Some(log), ..settings(&gateway) };
    let (of_gateway, at_unit) = (at_gateway.counters.clone(), settings(&unit));
    let of_unit = at_unit.counters.clone();
    let (tx, mut events) = mpsc::channel(64);
    let listener = listen(LoopbackAddr::ANY_PORT, gateway, at_gateway, tx).unwrap();
    let outsider = outsider();
    for stray in [&b"stray"[..], &hello[..60], &hello] {
        outsider.send_to(stray, listener.local().socket()).unwrap();
    }
    // One of the run itself, as a relay's adversary sends it, stays in the accounts.
    run_socket().send_to(b"ours", listener.local().socket()).unwrap();
    let front = run_socket();
    let (tx, _at_unit) = mpsc::channel(64);
    let remote = LoopbackAddr::try_from(front.local_addr().unwrap()).unwrap();
    let _dialler = dial(remote, unit.clone(), PeerId::GATEWAY, at_unit, tx);
    front.set_nonblocking(true).unwrap();
    let front = tokio::net::UdpSocket::from_std(front).unwrap();
    let (mut up, mut down) = ([0; 4096], [0; 4096]);
    let back = tokio::net::UdpSocket::bind(run_addr().socket()).await.unwrap();
    back.connect(listener.local().socket()).await.unwrap();
    let (mut dialled, mut client) = (0_u64, None);
    // The way between the two. With each of the unit's datagrams an outsider's comes to it.
    loop {
        tokio::select! {
            Ok((n, from)) = front.recv_from(&mut up) => {
                (dialled, client) = (dialled + 1, Some(from));
                outsider.send_to(b"stray", from).unwrap();
                back.send(&up[..n]).await.unwrap();
            }
            Ok(n) = back.recv(&mut down) => {
                front.send_to(&down[..n], client.unwrap()).await.unwrap();
            }
            Some(event) = events.recv() => if let SessionEvent::Opened(_) = event { break },
        }
    }
    let (gateway, unit) = (of_gateway.read(), of_unit.read());
    assert_eq!((gateway.outsiders, gateway.unknown_peers), (3, 1));
    assert!(gateway.guard.datagrams <= dialled, "{gateway:?}");
    assert_eq!(unit.unknown_peers, 0);
    assert!(unit.outsiders > 0 && unit.outsiders <= dialled, "{unit:?}");
    let observed = std::iter::from_fn(|| seen.try_recv().ok());
    assert!(observed.filter(|seen| seen.digest == link::guard::observe::digest(&hello)).count() == 0);
}
