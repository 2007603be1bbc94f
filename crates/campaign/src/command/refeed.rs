//! `holdsafe bench replay`: runs in the twin whose cores are fed again, over all variations, and how fast the boundary and the state
//! machine take their records then.

use std::sync::{Mutex, PoisonError};

use serde::Serialize;
use wire::id::NodeId;

use super::failure::{Exit, Failure};
use super::plan::{self, Planned};
use super::{Context, batch, engine, out, replay};
use crate::parallel;
use crate::progress::Progress;
use crate::report::{Mode, SCHEMA_VERSION, Spread};

/// Differences that are told in full.
const MAX_TOLD: usize = 50;
/// Times that the null attack is fed again for the speed.
const ROUNDS: usize = 9;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
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
    /// Cores fed, and how much, all runs together.
    cores: u64,
    inputs: u64,
    /// Inputs a CPU second of gateway and unit alone, null attack, every signature verified.
    inputs_per_cpu_second: Spread,
    differences: Vec<Different>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let cases = plan::every(context)?;
    let progress = Progress::new("runs", args.runs as usize, context.talk);
    let empty = Measured {
        schema_version: SCHEMA_VERSION,
        seed: context.seed,
        runs: args.runs,
        identical: 0,
        cores: 0,
        inputs: 0,
        inputs_per_cpu_second: Spread::default(),
        differences: Vec::new(),
    };
    let measured = Mutex::new(empty);
    parallel::each(parallel::cores(), args.runs as usize, |i| {
        if context.stop.asked() {
            return Err(Failure::from(engine::EngineError::Stopped));
        }
        let (case, seed) = (&cases[i % cases.len()], context.seed.wrapping_add(i as u64));
        let refed = engine::again(&engine::eaten(case, seed)?)?;
        let mut m = measured.lock().unwrap_or_else(PoisonError::into_inner);
        m.cores += refed.len() as u64;
        m.inputs += refed.iter().map(|r| r.inputs).sum::<u64>();
        m.identical += u64::from(refed.iter().all(|r| r.parted.is_none()));
        let name = case.variation.scenario.name.as_str();
        for told in refed.iter().map(replay::told) {
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
    measured.inputs_per_cpu_second = speed(context, &cases)?;
    if context.json {
        out::print_json("bench-replay", &measured)?;
    } else {
        show(&measured);
    }
    Ok(if measured.identical == measured.runs { Exit::Fine } else { Exit::Unexpected })
}

/// Inputs a CPU second of the two cores with a boundary.
fn speed(context: &Context, cases: &[Planned]) -> Result<Spread, Failure> {
    let nominal = cases.iter().find(|c| c.variation.scenario.name.as_str() == "nominal");
    let nominal = nominal.ok_or_else(|| Failure::internal("no null attack"))?;
    let fed = engine::eaten(nominal, context.seed)?.only(|node| node == NodeId::GATEWAY || node == NodeId::UNIT_A);
    let round = |_| {
        let before = batch::cpu_seconds(Mode::Twin);
        let refed = engine::again(&fed)?;
        let took = batch::cpu_seconds(Mode::Twin) - before;
        Ok(refed.iter().map(|r| r.inputs).sum::<u64>() as f64 / took)
    };
    (0..ROUNDS).map(round).collect::<Result<Vec<f64>, Failure>>().map(Spread::of)
}

fn show(m: &Measured) {
    let Measured { runs, identical, cores, inputs, .. } = m;
    out::say(format_args!("{identical} of {runs} runs identical: {cores} cores, {inputs} inputs, every output byte"));
    let Spread { min, median, max, .. } = m.inputs_per_cpu_second;
    out::say(format_args!(
        "gateway and unit, null attack, every signature verified: {min:.0} / {median:.0} / {max:.0} inputs a CPU s"
    ));
    for d in &m.differences {
        out::say(format_args!("{} --seed {}: {}: {}", d.scenario, d.seed, d.core, d.difference));
    }
}
