//! Cost of protection on the inner bus, by level: no protection, tags (integrity), tags and encryption (confidentiality). Measured are the
//! time from the call that publishes a message to the judged message at its reader, on real shared memory, and the CPU time of the whole
//! process per message.
//!
//! Levels alternate in every round. Message sizes: a set-point, tracks, a set of rendered frames. Run with
//! `cargo bench -p link --bench bus`.

use link::bus::sweep::sweep;
use link::bus::{Domain, Protection};
use link::clock::trace_us;
use nix::time::{ClockId, clock_gettime};
use tokio::sync::mpsc;
use wire::bus::{ChannelKey, Sender};
use wire::core::{Input, Topic};
use wire::id::{Boot, NodeId};
use wire::sign::Secret;
use wire::time::Instant;

const ROUNDS: usize = 5;
const MESSAGES: usize = 400;
/// A topic with its producer and the bytes of a message's body.
const SIZES: [(Topic, NodeId, usize); 3] = [
    (Topic::Drive, NodeId::UNIT_A, 40),
    (Topic::Tracks, NodeId::PERCEPTION, 700),
    (Topic::Frames, NodeId::SIM, 180_000),
];
const LEVELS: [(&str, bool, bool); 3] =
    [("none", false, false), ("integrity", true, false), ("confidential", true, true)];

fn main() {
    let mut times = vec![vec![Vec::new(); LEVELS.len()]; SIZES.len()];
    let mut cpu = vec![vec![0; LEVELS.len()]; SIZES.len()];
    for round in 0..ROUNDS {
        for (size, (topic, producer, bytes)) in SIZES.into_iter().enumerate() {
            for (level, (_, tagged, hidden)) in LEVELS.into_iter().enumerate() {
                let prefix = format!("hs_b{}x{round}x{size}x{level}_", std::process::id());
                let root = std::env::temp_dir().join(&prefix);
                let domain = Domain::new(&root, &prefix).expect("a domain");
                let protection = Protection { cipher: hidden.then_some(Secret([7; 32])), time: None };
                let domain = domain.protected(protection);
                let before = process_cpu_us();
                times[size][level].extend(exchange(&domain, topic, producer, bytes, tagged));
                cpu[size][level] += process_cpu_us() - before;
                sweep(&prefix, &root).expect("it is removed");
            }
        }
    }
    println!("{:8} {:>8} {:13} {:>8} {:>8} {:>14}", "topic", "bytes", "level", "p50 us", "p99 us", "CPU us/message");
    for (size, (topic, _, bytes)) in SIZES.into_iter().enumerate() {
        for (level, (name, ..)) in LEVELS.into_iter().enumerate() {
            let sorted = &mut times[size][level];
            sorted.sort_unstable();
            let quantile = |share: f64| sorted[((sorted.len() - 1) as f64 * share) as usize];
            let each = cpu[size][level] as f64 / (ROUNDS * MESSAGES) as f64;
            println!("{:8} {bytes:>8} {name:13} {:>8} {:>8} {each:>14.1}", topic.name(), quantile(0.5), quantile(0.99));
        }
    }
}

/// CPU time of this process, microseconds.
fn process_cpu_us() -> u64 {
    let now = clock_gettime(ClockId::CLOCK_PROCESS_CPUTIME_ID).expect("Linux has this clock");
    now.tv_sec() as u64 * 1_000_000 + now.tv_nsec() as u64 / 1_000
}

/// Times from publishing to the judged message, microseconds, one message after the other.
fn exchange(domain: &Domain, topic: Topic, producer: NodeId, bytes: usize, tagged: bool) -> Vec<u64> {
    let key = ChannelKey([3; 32]);
    let (tx, mut inbox) = mpsc::channel(8);
    let publisher = domain.publisher("bench", topic).expect("a publisher");
    let _reader = domain.subscribe("bench", topic, tx).expect("a reader");
    let mut sender = Sender::new(topic, producer, Boot(1), key.clone());
    // A reader that makes the same message again has done the work of checking its tag.
    let mut reader = Sender::new(topic, producer, Boot(1), key);
    let body = vec![1; bytes];
    let exchange_one = |_| {
        let start = trace_us();
        let message = if tagged { sender.seal(Instant(start), &body) } else { body.clone() };
        publisher.publish(&message).expect("it is published");
        let Some(Input::Bus { bytes, .. }) = inbox.blocking_recv() else { panic!("the reader ended") };
        assert!(bytes == if tagged { reader.seal(Instant(start), &body) } else { body.clone() }, "the message");
        trace_us() - start
    };
    (0..MESSAGES).map(exchange_one).collect()
}
