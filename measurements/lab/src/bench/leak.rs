//! `lab leak`: accuracy with which lengths and times on the links tell the unit's mode, against chance.
//!
//! It measures trials in the twin and prints; no test asserts its numbers. Operator and faults begin later than in the
//! scenarios, so that IDLE has its own seconds beside those in which connections are set up, and by a time that
//! differs from run to run, so that a window does not begin with an order because the script does.

use crate::leak::measure::{Leak, measure};
use crate::leak::{Run, Sees};
use evidence::SCHEMA_VERSION;
use parallel::progress::Progress;
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use results::report::started;
use runner::failure::{Exit, Failure};
use runner::plan::PlanOptions;
use runner::{Context, out, plan};
use serde::Serialize;

/// A mission, and missions that end in DEGRADED and in HOLD_SAFE. The links are not attacked in any: the observer sees
/// the platform's traffic, and not the attack.
const SCENARIOS: [&str; 5] = ["nominal", "thermal_loss", "track_starvation", "localisation_jump", "localisation_loss"];
/// Delay of operator and faults: so much, and up to a second more that the seed draws.
const LATER_S: f64 = 4.0;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Trials of each scenario; half of all seeds are learned from, the other half guessed.
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u64).range(2..=2_000))]
    trials: u64,
}

#[derive(Serialize)]
struct Measured {
    schema_version: u32,
    seed: u64,
    scenarios: [&'static str; SCENARIOS.len()],
    trials: u64,
    leaks: Vec<Leak>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let progress = Progress::new("trials", SCENARIOS.len() * args.trials as usize, context.talk);
    let mut runs: Vec<Run> = Vec::new();
    for name in SCENARIOS {
        let (_, planned) = plan::plan(context, &plan::file_of(context, name)?, &PlanOptions::default())?;
        let Some(one) = planned.first() else {
            return Err(Failure::new(Exit::NoEvidence, "nothing to run"));
        };
        for _ in 0..args.trials {
            if context.stop.is_requested() {
                return Err(runner::error::EngineError::Stopped.into());
            }
            // Its own seed for each run: the same seed in two scenarios begins in the same way.
            let seed = context.seed + runs.len() as u64;
            let scenario = one.variation.scenario.later(later_s(seed));
            runs.push(crate::measured::twin_seconds(&scenario, &one.setup, seed)?);
            progress.step();
        }
    }
    progress.finish();
    let leaks: Vec<Leak> = Sees::ALL.into_iter().filter_map(|sees| measure(&runs, sees, context.seed)).collect();
    let measured = Measured {
        schema_version: SCHEMA_VERSION,
        seed: context.seed,
        scenarios: SCENARIOS,
        trials: args.trials,
        leaks,
    };
    if context.json {
        out::print_json("bench-leak", &measured)?;
    } else {
        measured.leaks.iter().for_each(|leak| out::say(format_args!("{}\n", shown(leak))));
    }
    Ok(Exit::Fine)
}

/// Delay of a run with this seed.
fn later_s(seed: u64) -> f64 {
    LATER_S + f64::from(ChaCha8Rng::seed_from_u64(seed).next_u32() % 1_000) / 1_000.0
}

fn shown(leak: &Leak) -> String {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let mut table = started();
    let modes = leak.rows.iter().map(|row| format!("as {}", row.mode.name()));
    table.set_header(["was".to_owned()].into_iter().chain(modes).chain(["by run, 95 %".to_owned()]));
    for row in &leak.rows {
        let guessed = |as_mode: &str| row.guessed.get(as_mode).copied().unwrap_or_default().to_string();
        let counts = leak.rows.iter().map(|other| guessed(other.mode.name()));
        let share = row.by_run;
        let by_run =
            format!("{} of {}: {} to {}", share.hits, share.n, percent(share.lower_95), percent(share.upper_95));
        table.add_row([row.mode.name().to_owned()].into_iter().chain(counts).chain([by_run]));
    }
    let [balanced, lower, upper] = leak.balanced_by_run;
    let (by_run, paired) = (leak.by_run, leak.over_majority);
    format!(
        "{}: learned from {} runs ({} s), guessed {} ({} s)\n\
         right: {} of seconds; always {}: {}\n\
         one second a run: {} of {} right, 95 % {} to {}; over always {}: {:+.3}, 95 % {:+.3} to {:+.3}, p {:.1e}\n\
         balanced: {} of seconds; by run {}, 95 % {} to {}; chance {}\n{table}",
        leak.sees.name(),
        leak.runs[0],
        leak.seconds[0],
        leak.runs[1],
        leak.seconds[1],
        percent(leak.accuracy),
        leak.commonest.name(),
        percent(leak.majority),
        by_run.hits,
        by_run.n,
        percent(by_run.lower_95),
        percent(by_run.upper_95),
        leak.commonest.name(),
        paired.difference,
        paired.interval_95[0],
        paired.interval_95[1],
        paired.p,
        percent(leak.balanced),
        percent(balanced),
        percent(lower),
        percent(upper),
        percent(leak.chance),
    )
}
