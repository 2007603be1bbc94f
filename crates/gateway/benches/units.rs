//! Cost of 1, 4, 16 and 64 units at one gateway, and of as many at four gateways with a quarter each: CPU time and
//! memory of the gateways' cores, in memory, in virtual time. Rounds go through all rows, so that each sees the same
//! machine.
//!
//! Each unit reports ten times a second under its own key, and hears the next three units at its gateway. A second's
//! records are made before they are delivered; only the cores are timed: admission with signatures, leases, fan-out,
//! feed and audit log. Memory is the heap that the gateways give back when they are dropped. Gateways do not know each
//! other, so a unit hears no unit at another one. Sessions are plain bytes here: `lab load` measures DTLS.
//!
//! Run with `cargo bench --bench units` (or with `--profile dev`: dependencies are optimised there too).

#![expect(unsafe_code, reason = "counting allocations takes a global allocator, here and nowhere else")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicI64, Ordering};

use config::setup::{Channel, Setup};
use gateway::fanout::Interest;
use gateway::{Gateway, GatewayConfig};
use link::clock::thread_cpu_us;
use wire::bounds::Bounds;
use wire::bus::ChannelKey;
use wire::codec;
use wire::core::{Core, Input, Output, Topic};
use wire::event::{Account, Interface};
use wire::id::{Boot, NodeId, Nonce, RecordId, Sequence, SessionId, UnitId, WorldId};
use wire::policy::Policy;
use wire::report::Report;
use wire::sensor::Pose;
use wire::session::{MAX_SESSION_MESSAGE, MAX_TEAMMATES, SESSION_VERSION, SessionBody, SessionMessage};
use wire::sign::Secret;
use wire::sign::{Key, Purpose};
use wire::time::{Echo, Instant, PeerStamp};

const ROUNDS: usize = 9;
/// Warm-up before the measurement, seconds: sessions and windows are then established.
const WARM: u64 = 3;
const SECONDS: u64 = 10;
/// Reports a second of one unit.
const REPORTS: u64 = 10;
const SECOND: u64 = 1_000_000;
/// Units and gateways of each row; the first is the measure of the others.
const ROWS: [(usize, usize); 8] = [(1, 1), (4, 1), (16, 1), (64, 1), (1, 4), (4, 4), (16, 4), (64, 4)];

/// The system's allocator, with the bytes that are in use.
struct Counting;

static IN_USE: AtomicI64 = AtomicI64::new(0);

#[global_allocator]
static ALLOCATOR: Counting = Counting;

// SAFETY: everything is the system allocator's; counting touches nothing of it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        IN_USE.fetch_add(layout.size() as i64, Ordering::Relaxed);
        // SAFETY: the caller's promise about the layout is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        IN_USE.fetch_sub(layout.size() as i64, Ordering::Relaxed);
        // SAFETY: the caller's promise about block and layout is passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// Cost of one row in one round.
struct Cost {
    /// CPU microseconds of a simulated second, of all gateways.
    us: f64,
    /// KiB of heap, of all gateways.
    kib: f64,
    /// Teammates' records sent in a simulated second.
    told: f64,
}

fn main() {
    let mut rounds: Vec<Vec<Cost>> = Vec::new();
    for _ in 0..ROUNDS {
        rounds.push(ROWS.iter().map(|(units, gateways)| measure(*units, *gateways)).collect());
    }
    println!(
        "{ROUNDS} rounds of {SECONDS} simulated s, {REPORTS} reports/s a unit; least / median / most of the rounds"
    );
    println!("linear: that many times the one unit at one gateway of the same round");
    println!(
        "units gateways | CPU us/s a unit      | CPU, times linear  | KiB a unit, median; times linear | told/s a unit"
    );
    for (at, (units, gateways)) in ROWS.iter().enumerate() {
        let each = |value_of: fn(&Cost) -> f64| rounds.iter().map(move |round| value_of(&round[at]) / *units as f64);
        let ratio =
            |value_of: fn(&Cost) -> f64| rounds.iter().map(move |r| value_of(&r[at]) / *units as f64 / value_of(&r[0]));
        let [least, median, most] = spread(each(|cost| cost.us));
        let [low, middle, high] = spread(ratio(|cost| cost.us));
        let ([_, kib, _], [_, of_linear, _]) = (spread(each(|cost| cost.kib)), spread(ratio(|cost| cost.kib)));
        let [_, informed, _] = spread(each(|cost| cost.told));
        println!(
            "{units:>5} {gateways:>8} | {least:>6.0} {median:>6.0} {most:>6.0} | {low:>5.2} {middle:>5.2} {high:>5.2} | \
             {kib:>8.1} {of_linear:>5.2} | {informed:>5.1}"
        );
    }
}

/// Least, median and most.
fn spread(values: impl Iterator<Item = f64>) -> [f64; 3] {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    [values[0], values[values.len() / 2], values[values.len() - 1]]
}

/// Cost of `units`, spread evenly over `gateways` as far as there are units.
fn measure(units: usize, gateways: usize) -> Cost {
    let all: Vec<UnitId> = UnitId::all().take(units).collect();
    let share = units.div_ceil(gateways);
    let mut cells: Vec<Cell> = all.chunks(share).map(Cell::with_units).collect();
    for second in 0..WARM {
        for cell in &mut cells {
            cell.second(second);
        }
    }
    let sent = |cells: &[Cell]| cells.iter().map(|cell| cell.told).sum::<u64>();
    let (mut us, before) = (0, sent(&cells));
    for second in WARM..WARM + SECONDS {
        us += cells.iter_mut().map(|cell| cell.second(second)).sum::<u64>();
    }
    let told = (sent(&cells) - before) as f64 / SECONDS as f64;
    let accepted: u64 = cells.iter().map(|c| c.gateway.accounts().total(Account::Accepted(Interface::Uplink))).sum();
    assert_eq!(accepted, (WARM - 1 + SECONDS) * REPORTS * units as u64, "every record after the first second");
    let full = IN_USE.load(Ordering::Relaxed);
    let rest: Vec<Vec<Unit>> = cells.into_iter().map(|cell| cell.units).collect();
    let kib = (full - IN_USE.load(Ordering::Relaxed)) as f64 / 1024.0;
    drop(rest);
    Cost { us: us as f64 / SECONDS as f64, kib, told }
}

/// A gateway with its units.
struct Cell {
    gateway: Gateway,
    units: Vec<Unit>,
    /// Teammates' records sent to the units.
    told: u64,
}

impl Cell {
    fn with_units(ids: &[UnitId]) -> Self {
        let hears = |n: usize| {
            let rest = (1..ids.len()).take(MAX_TEAMMATES);
            rest.map(|step| ids[(n + step) % ids.len()]).collect::<Vec<_>>()
        };
        let interests = ids.iter().enumerate().map(|(n, unit)| Interest { unit: *unit, hears: hears(n) }).collect();
        let config = GatewayConfig {
            units: ids.to_vec(),
            interests,
            operators: vec![NodeId::OPERATOR],
            mandates: Vec::new(),
            contacts: Vec::new(),
        };
        let gateway = Gateway::new(setup(ids), config, Instant(0)).expect("a gateway");
        let units = ids.iter().enumerate().map(|(n, id)| Unit::new(n, *id)).collect();
        Self { gateway, units, told: 0 }
    }

    /// Runs one second: the units make its records, the gateway takes them in the order of time. Gives the gateway's
    /// CPU microseconds.
    fn second(&mut self, second: u64) -> u64 {
        let mut inputs: Vec<(Instant, Input)> = self.units.iter_mut().flat_map(|unit| unit.second(second)).collect();
        inputs.sort_by_key(|(time, _)| *time);
        let mut outputs = Vec::new();
        let before = thread_cpu_us();
        for (at, input) in &inputs {
            while let Some(due) = self.gateway.deadline().filter(|due| due <= at) {
                self.gateway.handle(due, &Input::Timeout);
                drain(&mut self.gateway, due, &mut outputs);
            }
            self.gateway.handle(*at, input);
            drain(&mut self.gateway, *at, &mut outputs);
        }
        let us = thread_cpu_us() - before;
        for (at, session, bytes) in outputs {
            self.told += u64::from(self.units[session.0 as usize].take(at, &bytes));
        }
        us
    }
}

/// Collects the records to units, and drops feed and audit entries: their cost is paid when they are made.
fn drain(gateway: &mut Gateway, time: Instant, outputs: &mut Vec<(Instant, SessionId, Vec<u8>)>) {
    while let Some(output) = gateway.output() {
        if let Output::Record { session, bytes } = output {
            outputs.push((time, session, bytes));
        }
    }
}

/// A unit's end of a session.
struct Unit {
    id: UnitId,
    session: SessionId,
    key: Key,
    reports: u64,
    records: u64,
    theirs: Nonce,
    echo: Option<Echo>,
}

impl Unit {
    fn new(n: usize, id: UnitId) -> Self {
        let (theirs, key) = (Nonce::NONE, key_of(id.node()));
        Self { id, session: SessionId(n as u32), key, reports: 0, records: 0, theirs, echo: None }
    }

    /// The inputs of one second: the session opens with the first, reports come once the gateway has said Hello.
    fn second(&mut self, second: u64) -> Vec<(Instant, Input)> {
        // Units report at different moments of the period.
        let start = 1 + second * SECOND + u64::from(self.session.0) * 1_300;
        if second == 0 {
            return vec![(Instant(start), Input::Opened { session: self.session, peer: self.id.peer() })];
        }
        (0..REPORTS).map(|n| self.record(Instant(start + n * SECOND / REPORTS))).collect()
    }

    fn record(&mut self, time: Instant) -> (Instant, Input) {
        let stamp = self.clock(time);
        (self.records, self.reports) = (self.records + 1, self.reports + 1);
        let signed = self.key.sign(Purpose::Report, &codec::encode(&report(self.id.node(), self.reports, stamp)));
        let bytes = codec::encode(&SessionMessage {
            version: SESSION_VERSION,
            session: self.theirs,
            boot: Boot(1),
            sequence: Sequence(self.records),
            stamp,
            challenge: Nonce(1 + time.0 / SECOND),
            echo: self.echo,
            body: match self.records {
                1 => SessionBody::Hello(Nonce(7)),
                _ => SessionBody::Report(signed.as_slice().into()),
            },
        });
        (time, Input::Record { session: self.session, bytes })
    }

    /// Takes a record of the gateway; true if it is a teammate's.
    fn take(&mut self, time: Instant, bytes: &[u8]) -> bool {
        let outer: SessionMessage<'_> = codec::decode(bytes, MAX_SESSION_MESSAGE).expect("a session record");
        if self.echo.is_none_or(|echo| echo.nonce != outer.challenge) {
            self.echo = Some(Echo { nonce: outer.challenge, seen: self.clock(time) });
        }
        if let SessionBody::Hello(nonce) = outer.body {
            self.theirs = nonce;
        }
        matches!(outer.body, SessionBody::Teammate(_))
    }

    fn clock(&self, time: Instant) -> PeerStamp {
        PeerStamp(time.0 + 77_000_000 * (u64::from(self.session.0) + 1))
    }
}

fn key_of(node: NodeId) -> Key {
    Key::from_bytes(&[node.index() as u8 + 1; 32])
}

fn setup(units: &[UnitId]) -> Setup {
    let known = units.iter().map(|unit| unit.node()).chain([NodeId::OPERATOR, NodeId::AUTHORITY, NodeId::GATEWAY]);
    Setup {
        node: NodeId::GATEWAY,
        boot: Boot(1),
        world: WorldId(0),
        seed: 11,
        policy: Policy::default(),
        bounds: Bounds::GROUND,
        secret: Secret([9; 32]),
        public_keys: known.map(|node| (node, key_of(node).public())).collect(),
        channels: vec![
            Channel { topic: Topic::Feed, producer: NodeId::GATEWAY, key: ChannelKey([1; 32]) },
            Channel { topic: Topic::Intents, producer: NodeId::CONSOLE, key: ChannelKey([2; 32]) },
        ],
        ablation: None,
        verifier: None,
    }
}

fn report(origin: NodeId, n: u64, stamp: PeerStamp) -> Report {
    Report {
        pose: Pose { x_mm: 1, y_mm: 2, yaw_mrad: 3 },
        command_nonce: Nonce(5),
        ..Report::bare(RecordId { node: origin, boot: Boot(1), sequence: Sequence(n) }, stamp)
    }
}
