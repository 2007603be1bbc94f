//! `lab replay`: replay of the cores of runs in the twin, over all variations, and the speed at which the boundary and
//! the state machine take their records then.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use evidence::SCHEMA_VERSION;
use link::clock::{thread_cpu_us, trace_us};
use link::load::resident_kib;
use parallel::progress::Progress;
use results::report::Spread;
use runner::failure::{Exit, Failure};
use runner::plan::{PlanOptions, Planned};
use runner::{Context, engine, out, plan};
use serde::Serialize;
use wire::id::NodeId;

/// The scenario without an attack on the platform.
const NULL_ATTACK: &str = "nominal";
/// Largest number of differences printed in full.
const MAX_TOLD: usize = 50;
/// Rounds of replaying the null attack to measure speed.
const ROUNDS: usize = 9;
/// Replays of it by each thread within a round.
const FEEDINGS: usize = 32;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Runs.
    #[arg(long, value_name = "N", default_value_t = 1_000, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    runs: u64,
}

#[derive(Serialize)]
struct Different {
    scenario: String,
    seed: u64,
    core: String,
    difference: String,
}

#[derive(Serialize)]
struct Measured {
    schema_version: u32,
    seed: u64,
    runs: u64,
    identical: u64,
    /// Cores replayed, and their inputs and outputs, all runs together.
    cores: u64,
    inputs: u64,
    /// Speed at which gateway and unit alone take the inputs of the null attack, every signature verified.
    speed: Speed,
    /// Inference by perception with its networks, rendered; a third of its inputs are sets of frames.
    inference: Inference,
    differences: Vec<Different>,
}

#[derive(Default, Serialize)]
struct Inference {
    inputs: u64,
    outputs: u64,
    identical: bool,
    inputs_per_cpu_second: f64,
}

#[derive(Default, Serialize)]
struct Speed {
    /// Runs replayed side by side: one on each core of the host.
    threads: usize,
    /// Inputs a second, all threads together.
    inputs_per_second: Spread,
    /// Inputs a second of CPU.
    inputs_per_cpu_second: Spread,
    /// Inputs replayed for this.
    inputs: u64,
    /// Resident memory of this process after the first round and after the last.
    resident_kib: [u64; 2],
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let cases = plan::plan_shipped(context)?;
    let progress = Progress::new("runs", args.runs as usize, context.talk);
    let empty = Measured {
        schema_version: SCHEMA_VERSION,
        seed: context.seed,
        runs: args.runs,
        identical: 0,
        cores: 0,
        inputs: 0,
        speed: Speed::default(),
        inference: Inference::default(),
        differences: Vec::new(),
    };
    let measured = Mutex::new(empty);
    parallel::each(parallel::cores(), args.runs as usize, |i| {
        if context.stop.is_requested() {
            return Err(Failure::from(runner::error::EngineError::Stopped));
        }
        let (case, seed) = (&cases[i % cases.len()], context.seed.wrapping_add(i as u64));
        let replayed = engine::replay_in_own_cores(&engine::run_journalled(case, seed)?)?;
        let mut m = measured.lock().unwrap_or_else(PoisonError::into_inner);
        m.cores += replayed.len() as u64;
        m.inputs += replayed.iter().map(|r| r.inputs).sum::<u64>();
        m.identical += u64::from(replayed.iter().all(|r| r.parted.is_none()));
        let name = case.variation.scenario.name.as_str();
        for told in replayed.iter().map(engine::ReplayRow::from) {
            let Some(difference) = told.difference else { continue };
            m.differences.push(Different { scenario: name.to_owned(), seed, core: told.core, difference });
        }
        progress.step();
        Ok(())
    })?;
    progress.finish();
    let mut measured = measured.into_inner().unwrap_or_else(PoisonError::into_inner);
    measured.differences.sort_by(|a, b| (a.seed, &a.core).cmp(&(b.seed, &b.core)));
    measured.differences.truncate(MAX_TOLD);
    measured.speed = speed(context, &cases)?;
    measured.inference = inference(context)?;
    if context.json {
        out::print_json("bench-replay", &measured)?;
    } else {
        show(&measured);
    }
    Ok(if measured.identical == measured.runs && measured.inference.identical { Exit::Fine } else { Exit::Unexpected })
}

/// Replay speed of the two cores with a boundary.
fn speed(context: &Context, cases: &[Planned]) -> Result<Speed, Failure> {
    let nominal = cases.iter().find(|c| c.variation.scenario.name.as_str() == NULL_ATTACK);
    let nominal = nominal.ok_or_else(|| Failure::internal("no null attack"))?;
    let fed =
        engine::run_journalled(nominal, context.seed)?.only(|node| node == NodeId::GATEWAY || node == NodeId::UNIT_A);
    let threads = parallel::cores();
    let (mut speed, mut by_clock, mut by_cpu) = (Speed { threads, ..Speed::default() }, Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        let (inputs, cpu_us) = (AtomicU64::new(0), AtomicU64::new(0));
        let before = trace_us();
        parallel::each(threads, threads * FEEDINGS, |_| {
            if context.stop.is_requested() {
                return Err(Failure::from(runner::error::EngineError::Stopped));
            }
            let before = thread_cpu_us();
            let replayed = engine::replay_in_own_cores(&fed)?;
            cpu_us.fetch_add(thread_cpu_us() - before, Ordering::Relaxed);
            inputs.fetch_add(replayed.iter().map(|r| r.inputs).sum::<u64>(), Ordering::Relaxed);
            Ok(())
        })?;
        let (took, inputs) = (trace_us() - before, inputs.into_inner());
        by_clock.push(inputs as f64 / took as f64 * 1e6);
        by_cpu.push(inputs as f64 / cpu_us.into_inner() as f64 * 1e6);
        speed.inputs += inputs;
        speed.resident_kib[1] = resident_kib();
        if by_clock.len() == 1 {
            speed.resident_kib[0] = speed.resident_kib[1];
        }
    }
    (speed.inputs_per_second, speed.inputs_per_cpu_second) =
        (Spread::from_values(by_clock), Spread::from_values(by_cpu));
    Ok(speed)
}

/// Perception of the null attack, rendered, replayed.
fn inference(context: &Context) -> Result<Inference, Failure> {
    let wanted = PlanOptions { rendered: true, ..PlanOptions::default() };
    let (_, planned) = plan::plan(context, &plan::file_of(context, NULL_ATTACK)?, &wanted)?;
    let nominal = planned.first().ok_or_else(|| Failure::internal("no null attack"))?;
    let fed = engine::run_journalled(nominal, context.seed)?.only(|node| node == NodeId::PERCEPTION);
    let before = thread_cpu_us();
    let replayed = engine::replay_in_own_cores(&fed)?;
    let took = thread_cpu_us() - before;
    let inputs = replayed.iter().map(|r| r.inputs).sum();
    let outputs = replayed.iter().map(|r| r.outputs).sum();
    let identical = inputs > 0 && replayed.iter().all(|r| r.parted.is_none());
    Ok(Inference { inputs, outputs, identical, inputs_per_cpu_second: inputs as f64 / took as f64 * 1e6 })
}

fn show(m: &Measured) {
    let Measured { runs, identical, cores, inputs, .. } = m;
    out::say(format_args!("{identical} of {runs} runs identical: {cores} cores, {inputs} inputs, every output byte"));
    let Speed { threads, inputs, resident_kib: [first, last], .. } = m.speed;
    out::say(format_args!(
        "gateway and unit, null attack, every signature verified, {inputs} inputs on {threads} threads:"
    ));
    let told = |per: &str, Spread { min, median, max, .. }: Spread| {
        out::say(format_args!("  {min:.0} / {median:.0} / {max:.0} inputs a {per} (min / median / max)"));
    };
    told("second", m.speed.inputs_per_second);
    told("second of CPU", m.speed.inputs_per_cpu_second);
    out::say(format_args!("  resident memory: {first} KiB after the first round, {last} KiB after the last"));
    let Inference { inputs, outputs, identical, inputs_per_cpu_second } = m.inference;
    let verdict = if identical { "identical" } else { "NOT identical" };
    out::say(format_args!(
        "perception with its networks, null attack, rendered: {inputs_per_cpu_second:.0} inputs a second of CPU \
         ({inputs} inputs, {outputs} outputs, {verdict})"
    ));
    for d in &m.differences {
        out::say(format_args!("{} --seed {}: {}: {}", d.scenario, d.seed, d.core, d.difference));
    }
}
