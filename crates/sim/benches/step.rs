//! Simulated seconds per second of CPU: the whole sim without rendering, against bare rapier stepping of the same
//! world with the same vehicle on the same course. Rounds alternate, so that both see the same machine.
//!
//! Run with `cargo bench -p sim` (or with `--profile dev`: dependencies are optimised there too).

use nix::sys::resource::{UsageWho, getrusage};
use nix::sys::time::TimeValLike;
use sim::plant::{Plant, SetPoint};
use sim::world::{STEP, World};
use sim::{ChannelKeys, Sim, SimConfig};
use std::sync::Arc;
use wire::bus::{ChannelKey, Sender};
use wire::codec::encode;
use wire::core::{Core, Input, Topic};
use wire::drive::Drive;
use wire::id::{Boot, NodeId};
use wire::sign::Key;
use wire::time::{Instant, Span};

const ROUNDS: usize = 7;
const SECONDS: u64 = 120;

fn main() {
    let config = SimConfig::new(1, false);
    let mut rounds: Vec<(f64, f64)> = (0..ROUNDS).map(|_| (bare(&config), whole(&config))).collect();
    rounds.sort_by(|a, b| a.1.total_cmp(&b.1));
    let bare = median(rounds.iter().map(|r| r.0));
    let whole = median(rounds.iter().map(|r| r.1));
    let per_cpu = |cpu: f64| SECONDS as f64 / cpu;
    println!("bare rapier: {:.0} simulated s per CPU s ({:.1} us a step)", per_cpu(bare), bare * 1e4 / SECONDS as f64);
    println!("sim, unrendered: {:.0} simulated s per CPU s", per_cpu(whole));
    println!("ratio: {:.2}", whole / bare);
    let rendered = SimConfig { rendered: true, ..config };
    let sim = Sim::new(&rendered, keys(), None, Instant(0)).expect("the default scene is sound");
    println!("sim, rendered: {:.1} simulated s per CPU s", 10.0 / drive(sim, 10));
}

/// World and vehicle alone: the cost of physics without sensors.
fn bare(config: &SimConfig) -> f64 {
    let mut world = World::new(Arc::new(config.scene.clone()));
    let mut plant =
        Plant::from_body(&mut world, &config.scene.start, &config.body, &config.fidelity, config.seed).expect("a body");
    let before = cpu();
    for k in 1..=SECONDS * 100 {
        let now = Instant(k * STEP.0);
        if k % 5 == 0 {
            plant.accept(now, SetPoint::course((2.0, 0.1), now + Span::ms(300)));
        }
        plant.step(now, &mut world);
    }
    cpu() - before
}

fn whole(config: &SimConfig) -> f64 {
    let key = Some(Key::from_bytes(&[7; 32]));
    drive(Sim::new(config, keys(), key, Instant(0)).expect("the default scene is sound"), SECONDS)
}

fn drive(mut sim: Sim, seconds: u64) -> f64 {
    let mut sender = Sender::new(Topic::Drive, NodeId::UNIT_A, Boot(1), ChannelKey([3; 32]));
    let before = cpu();
    for k in 1..=seconds * 20 {
        let now = Instant(k * 50_000);
        while let Some(time) = sim.deadline().filter(|time| *time <= now) {
            sim.handle(time, &Input::Timeout);
            while sim.output().is_some() {}
        }
        let set_point = wire::drive::SetPoint::Course { speed_mm_s: 2000, curvature_um: 100_000 };
        let drive = Drive { stamp: now, set_point, lease: Span::ms(300) };
        let bytes = sender.seal(now, &encode(&drive));
        sim.handle(now, &Input::Bus { topic: Topic::Drive, bytes });
    }
    cpu() - before
}

fn keys() -> ChannelKeys {
    let [frames, candidates, navigation, drive, act] = [0, 1, 2, 3, 4].map(|k| ChannelKey([k; 32]));
    ChannelKeys { frames, candidates, navigation: [navigation.clone(), navigation], drive, act }
}

/// CPU seconds of this process, in user and kernel mode.
fn cpu() -> f64 {
    let usage = getrusage(UsageWho::RUSAGE_SELF).expect("a process can read its own usage");
    (usage.user_time().num_microseconds() + usage.system_time().num_microseconds()) as f64 / 1e6
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
