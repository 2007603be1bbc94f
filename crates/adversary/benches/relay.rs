//! Cost of an idle adversary in the path: round trips through the relays' own process, beside `socat` in the same place
//! and an empty path. Blocks of the three alternate, so that all see the same machine.
//!
//! Run with `cargo bench --bench relay`. If `socat` is not installed, its lines report it.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use adversary::AdversaryConfig;
use adversary::plan::{DatagramRelayConfig, StreamRelayConfig};
use adversary::process::ProcessConfig;
use config::setup::Setup;
use link::clock::HostClock;
use link::loopback::LoopbackAddr;
use link::spec::{RelayLeg, RelaySpec, ServiceSpec};
use wire::bounds::Bounds;
use wire::id::{Boot, NodeId, WorldId};
use wire::policy::Policy;
use wire::sign::Secret;

const BLOCKS: usize = 20;
const TRIPS: usize = 200;
/// About the size of a sealed report.
const BYTES: usize = 300;
/// Longest time that a helper has to come up.
const PATIENCE: Duration = Duration::from_secs(10);

fn main() {
    let datagrams = UdpSocket::bind("127.0.0.1:0").expect("a loopback port");
    let streams = TcpListener::bind("127.0.0.1:0").expect("a loopback port");
    let (udp, tcp) = (datagrams.local_addr().expect("bound"), streams.local_addr().expect("bound"));
    thread::spawn(move || echo_datagrams(&datagrams));
    thread::spawn(move || streams.incoming().flatten().for_each(|stream| drop(thread::spawn(|| echo_stream(stream)))));

    let relays = [Relay::start("relay_datagram", udp), Relay::start("relay_stream", tcp)];
    let socats = [Socat::start("UDP4", udp), Socat::start("TCP4", tcp)];
    println!(
        "round trips of {BYTES} bytes over loopback, {BLOCKS} blocks of {TRIPS}, microseconds: median, 95th percentile"
    );
    let way = |address: Option<SocketAddr>| address.map(datagram);
    compare("datagrams", [way(Some(udp)), way(socats[0].at), way(Some(relays[0].at))]);
    let way = |address: Option<SocketAddr>| address.map(stream);
    compare("byte stream", [way(Some(tcp)), way(socats[1].at), way(Some(relays[1].at))]);
}

#[expect(clippy::disallowed_methods, reason = "a bench is there to read the clock")]
fn now() -> Instant {
    Instant::now()
}

/// Sends some bytes and waits until they are back.
type Trip = Box<dyn FnMut()>;

fn compare(label: &str, mut ways: [Option<Trip>; 3]) {
    let mut times: [Vec<f64>; 3] = Default::default();
    for _ in 0..BLOCKS {
        for (way, times) in ways.iter_mut().zip(&mut times) {
            let Some(trip) = way else { continue };
            for _ in 0..TRIPS {
                let start = now();
                trip();
                times.push(start.elapsed().as_secs_f64() * 1e6);
            }
        }
    }
    let [direct, socat, relay] = times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        let quantile = |share: f64| times.get((times.len() as f64 * share) as usize).copied();
        (quantile(0.5), quantile(0.95))
    });
    for (name, (median, p95)) in [("direct", direct), ("socat", socat), ("relay", relay)] {
        match median.zip(p95) {
            Some((median, p95)) => println!("{label}, {name}: {median:.1}, {p95:.1}"),
            None => println!("{label}, {name}: not installed"),
        }
    }
    if let (Some(direct), Some(socat), Some(relay)) = (direct.0, socat.0, relay.0) {
        let ratio = (relay - direct) / (socat - direct);
        println!(
            "{label}: the relay adds {:.1} us where socat adds {:.1}: {ratio:.2} of it",
            relay - direct,
            socat - direct
        );
    }
}

/// A sound first message of a handshake, by which a relay knows its client.
fn hello() -> Vec<u8> {
    let mut body = vec![254, 253];
    body.extend([7; 32]);
    body.extend([0, 0, 0, 2, 0xc0, 0x2b, 1, 0, 0, 4, 0, 0x17, 0, 0]);
    let length = body.len() as u8;
    let mut hello =
        vec![22, 254, 253, 0, 0, 0, 0, 0, 0, 0, 0, 0, 12 + length, 1, 0, 0, length, 0, 0, 0, 0, 0, 0, 0, length];
    hello.extend(body);
    hello
}

fn datagram(address: SocketAddr) -> Trip {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a loopback port");
    socket.connect(address).expect("loopback");
    socket.set_read_timeout(Some(PATIENCE)).expect("a limit");
    let (hello, sent, mut back) = (hello(), [7; BYTES], [0; BYTES]);
    socket.send(&hello).expect("sent");
    assert_eq!(socket.recv(&mut back).expect("back in time"), hello.len());
    Box::new(move || {
        socket.send(&sent).expect("sent");
        assert_eq!(socket.recv(&mut back).expect("back in time"), BYTES);
    })
}

fn stream(address: SocketAddr) -> Trip {
    let mut stream = TcpStream::connect(address).expect("accepted");
    stream.set_nodelay(true).expect("no delay");
    stream.set_read_timeout(Some(PATIENCE)).expect("a limit");
    let (sent, mut back) = ([7; BYTES], [0; BYTES]);
    Box::new(move || {
        stream.write_all(&sent).expect("sent");
        stream.read_exact(&mut back).expect("back in time");
    })
}

fn echo_datagrams(socket: &UdpSocket) {
    let mut bytes = [0; 2_048];
    while let Ok((length, from)) = socket.recv_from(&mut bytes) {
        let _gone = socket.send_to(&bytes[..length], from);
    }
}

fn echo_stream(mut stream: TcpStream) {
    let mut bytes = [0; 2_048];
    stream.set_nodelay(true).expect("no delay");
    while let Ok(length @ 1..) = stream.read(&mut bytes) {
        if stream.write_all(&bytes[..length]).is_err() {
            return;
        }
    }
}

/// The adversary's process with an empty plan.
struct Relay {
    child: Child,
    at: SocketAddr,
    _folder: tempfile::TempDir,
}

impl Relay {
    fn start(path: &str, upstream: SocketAddr) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let leg =
            RelayLeg { at: LoopbackAddr::ANY_PORT, upstream: LoopbackAddr::try_from(upstream).expect("loopback") };
        let (relay, node, config) = if path == "relay_datagram" {
            let config = AdversaryConfig::DatagramRelay(DatagramRelayConfig::default());
            (RelaySpec { datagram: Some(leg), stream: None }, NodeId::RELAY_TELEMETRY, config)
        } else {
            let config = AdversaryConfig::StreamRelay(StreamRelayConfig::default());
            (RelaySpec { datagram: None, stream: Some(leg) }, NodeId::RELAY_COMMAND, config)
        };
        let setup = Setup {
            node,
            boot: Boot(1),
            world: WorldId(0),
            seed: 1,
            policy: Policy::default(),
            bounds: Bounds::GROUND,
            secret: Secret([1; 32]),
            public_keys: Vec::new(),
            channels: Vec::new(),
            ablation: None,
            verifier: None,
        };
        let clock = HostClock { zero_us: 0, drift_ppm: 0 };
        let mut spec = ServiceSpec::new(node, Boot(1), 1, clock, folder.path().to_owned());
        spec.relay = Some(relay);
        spec.config = serde_json::to_value(ProcessConfig { setup, config }).expect("JSON");
        let mut child = Command::new(env!("CARGO_BIN_EXE_holdsafe-adversary"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program starts");
        spec.write(child.stdin.as_mut().expect("piped")).expect("the child reads");
        let mut ready = String::new();
        BufReader::new(child.stdout.take().expect("piped")).read_line(&mut ready).expect("a line");
        let ready: serde_json::Value = serde_json::from_str(ready.trim_start_matches("ready ")).expect("JSON");
        let at = serde_json::from_value::<LoopbackAddr>(ready[path].clone()).expect("an address").socket();
        Self { child, at, _folder: folder }
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        let _ended = self.child.kill().and_then(|()| self.child.wait());
    }
}

struct Socat {
    child: Option<Child>,
    at: Option<SocketAddr>,
}

impl Socat {
    fn start(protocol: &str, upstream: SocketAddr) -> Self {
        // A port that was free a moment ago; if somebody has it by now, socat ends and its lines report it.
        let address = TcpListener::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("a loopback port");
        let child = Command::new("socat")
            .arg(format!("{protocol}-LISTEN:{},bind=127.0.0.1,reuseaddr", address.port()))
            .arg(format!("{protocol}:{upstream}{}", if protocol == "TCP4" { ",nodelay" } else { "" }))
            .stderr(Stdio::null())
            .spawn();
        let Ok(child) = child else { return Self { child: None, at: None } };
        let listens = || {
            let table = std::fs::read_to_string(format!("/proc/net/{}", protocol[..3].to_lowercase()));
            table.is_ok_and(|table| table.contains(&format!(":{:04X}", address.port())))
        };
        let start = now();
        while !listens() && start.elapsed() < PATIENCE {
            thread::yield_now();
        }
        Self { child: Some(child), at: Some(address) }
    }
}

impl Drop for Socat {
    fn drop(&mut self) {
        if let Some(child) = &mut self.child {
            let _ended = child.kill().and_then(|()| child.wait());
        }
    }
}
