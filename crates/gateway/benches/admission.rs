//! Cost and allocations of the trust boundary per record: with the origin's signature, without it, and beside them the
//! same record through bare DTLS in memory; and the cost of an unknown peer's datagram at the cookie exchange. CPU time
//! of this thread; rounds alternate.
//!
//! Run with `cargo bench --bench admission` (or with `--profile dev`: dependencies are optimised there too).

#![expect(unsafe_code, reason = "counting allocations takes a global allocator, here and nowhere else")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::collections::BTreeMap;
use std::hint::black_box;
use std::sync::atomic::{AtomicU64, Ordering};

use gateway::admit::Boundary;
use gateway::session::Session;
use link::clock::thread_cpu_us;
use link::guard::cookie::{Answer, CALM, CookieExchange};
use link::loopback::LoopbackAddr;
use link::memory::{Pair, Party, clear};
use link::pki::{Authority, Role};
use wire::bounds::Bounds;
use wire::codec;
use wire::core::Side;
use wire::id::{Boot, NodeId, Nonce, PeerId, RecordId, Sequence, SessionId, UnitId};
use wire::policy::{Check, Policy, Requirement};
use wire::report::Report;
use wire::sensor::Pose;
use wire::session::{SESSION_VERSION, SessionBody, SessionMessage};
use wire::sign::{Key, Keyring, Purpose};
use wire::time::{Echo, Instant, PeerStamp};

const ROUNDS: usize = 9;
const RECORDS: u64 = 5_000;
/// Offset of the unit's clock from the gateway's.
const OFFSET: u64 = 77_000_000;

/// The system's allocator, counted.
struct Counting;

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

#[global_allocator]
static ALLOCATOR: Counting = Counting;

// SAFETY: everything is the system allocator's; counting touches nothing of it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promise about the layout is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise about block and layout is passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// Costs of one round: microseconds a record and all allocations, without and with the signature; microseconds through
/// DTLS.
struct Round {
    unsigned: (f64, u64),
    signed: (f64, u64),
    bare: f64,
}

fn main() {
    let key = Key::from_bytes(&[7; 32]);
    let records: Vec<Vec<u8>> = (1..=RECORDS).map(|n| record(&key, n)).collect();
    let unsigned = Policy { boundary: BTreeMap::from([(Check::Signature, Requirement::Waived)]), ..Policy::default() };
    let mut dtls = pair();
    let mut rounds = Vec::new();
    for _ in 0..ROUNDS {
        let bare = timed(|| assert_eq!(dtls.stream(Side::Client, &records[0], 1_000), 1_000)).0 / 1_000.0;
        let (unsigned, signed) = (admitted(&unsigned, &key, &records), admitted(&Policy::default(), &key, &records));
        rounds.push(Round { unsigned, signed, bare });
    }
    let median = |value_of: fn(&Round) -> f64| {
        let mut values: Vec<f64> = rounds.iter().map(value_of).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let ns = |us: f64| us * 1e3;
    println!("a record of {} bytes, {RECORDS} of them, median of {ROUNDS} rounds", records[0].len());
    println!("admission without signature: {:.0} ns", ns(median(|r| r.unsigned.0)));
    println!("  allocations: {:.3} a record", median(|r| r.unsigned.1 as f64) / RECORDS as f64);
    println!("admission with signature: {:.0} ns", ns(median(|r| r.signed.0)));
    println!("  allocations: {:.3} a record", median(|r| r.signed.1 as f64) / RECORDS as f64);
    println!("bare DTLS in memory, sealed to opened, with the tasks between: {:.0} ns", ns(median(|r| r.bare)));
    unknown_peers();
}

/// Cost of an unknown peer's datagram at the cookie exchange, before the listener keeps any state of it.
fn unknown_peers() {
    let hello = client_hello();
    let broken = [&hello[..hello.len() - 1], &[9]].concat();
    let from = LoopbackAddr::on_port(9).socket();
    for (what, datagram, open) in [
        ("noise, refused", &b"noise"[..], 0),
        ("a hello whose lengths are broken, refused", &broken, 0),
        ("a sound hello at a busy exchange, challenged", &hello, CALM),
    ] {
        let mut exchange = CookieExchange::new().expect("randomness");
        let now = now();
        let mut rounds: Vec<(f64, u64)> = (0..ROUNDS)
            .map(|_| {
                timed(|| {
                    for _ in 0..RECORDS {
                        let answer = black_box(exchange.judge(from, black_box(datagram), open, now.into()));
                        assert_eq!(matches!(answer, Answer::Challenge(_)), open > 0);
                    }
                })
            })
            .collect();
        rounds.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (us, allocations) = rounds[ROUNDS / 2];
        let each = RECORDS as f64;
        println!(
            "a datagram of an unknown peer, {what}: {:.0} ns, {:.3} allocations",
            us * 1e3 / each,
            allocations as f64 / each
        );
    }
}

#[expect(clippy::disallowed_methods, reason = "a bench is there to read the clock")]
fn now() -> std::time::Instant {
    std::time::Instant::now()
}

/// The least ClientHello of DTLS 1.2: one suite, one compression, one extension without content.
fn client_hello() -> Vec<u8> {
    let (version, suite, extension) = ([254, 253], [0, 2, 0xc0, 0x2b], [0, 4, 0, 0x17, 0, 0]);
    let body = [&version[..], &[7; 32], &[0, 0], &suite, &[1, 0], &extension].concat();
    let length = body.len() as u8;
    let message = [&[1, 0, 0, length, 0, 0, 0, 0, 0, 0, 0, length], &body[..]].concat();
    let record = [22, 254, 253, 0, 0, 0, 0, 0, 0, 0, 0, 0, message.len() as u8];
    [&record[..], &message].concat()
}

/// Microseconds a record, and all allocations.
fn admitted(policy: &Policy, key: &Key, records: &[Vec<u8>]) -> (f64, u64) {
    let mut keys = Keyring::default();
    keys.insert(NodeId::UNIT_A, &key.public());
    let mut boundary = Boundary::new(policy.clone(), Bounds::GROUND, keys);
    let mut session = Session::new(SessionId(1), PeerId::UNIT_A, UnitId::A, Nonce(1), &Bounds::GROUND);
    session.renew(arrival_time(0), || Nonce(2));
    let (us, allocations) = timed(|| {
        for (n, bytes) in records.iter().enumerate() {
            let admitted = boundary.admit(&mut session, arrival_time(n as u64 + 1), bytes);
            assert!(black_box(admitted).is_ok(), "record {n}");
        }
    });
    (us / records.len() as f64, allocations)
}

/// CPU microseconds and allocations of `work`.
fn timed(work: impl FnOnce()) -> (f64, u64) {
    let (cpu, allocations) = (thread_cpu_us(), ALLOCATIONS.load(Ordering::Relaxed));
    work();
    ((thread_cpu_us() - cpu) as f64, ALLOCATIONS.load(Ordering::Relaxed) - allocations)
}

/// Time at which record `n` arrives, on the gateway's clock.
fn arrival_time(n: u64) -> Instant {
    Instant(1_000_000 + n)
}

/// The unit's nth record, with its nth report.
fn record(key: &Key, n: u64) -> Vec<u8> {
    let stamp = PeerStamp(arrival_time(n).0 + OFFSET);
    let report = Report {
        pose: Pose { x_mm: 1, y_mm: 2, yaw_mrad: 3 },
        command_nonce: Nonce(5),
        ..Report::bare(RecordId { node: NodeId::UNIT_A, boot: Boot(1), sequence: Sequence(n) }, stamp)
    };
    let signed = key.sign(Purpose::Report, &codec::encode(&report));
    codec::encode(&SessionMessage {
        version: SESSION_VERSION,
        session: Nonce(1),
        boot: Boot(1),
        sequence: Sequence(n),
        stamp,
        challenge: Nonce(9),
        echo: Some(Echo { nonce: Nonce(2), seen: PeerStamp(arrival_time(0).0 + OFFSET) }),
        body: SessionBody::Report(signed.as_slice().into()),
    })
}

fn pair() -> Pair {
    let authority = Authority::new().expect("an authority");
    let party = |peer, role| Party::honest(authority.issue(peer, role).expect("a credential"));
    let parties = [party(PeerId::UNIT_A, Role::Dials), party(PeerId::GATEWAY, Role::Listens)];
    Pair::open([&parties[0], &parties[1]], PeerId::GATEWAY, clear()).expect("a runtime")
}
