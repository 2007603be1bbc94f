//! `lab agreement`: agreement of live runs with the twin, over attack sequences that were drawn before any of them was
//! run live.
//!
//! Each sequence is a file (`drawn`), run once in the twin, rendered as a live run is, and once live, under the same
//! seed. Finished runs are kept (`kept`), so a bench resumes after an interruption. It measures and prints; no test
//! asserts its numbers.

use std::path::PathBuf;

use super::drawn::{self, Case, Lot};
use crate::report::{AgreementObject, SequenceRow, agreement_table};
use evidence::trial::{Outcome, Trial};
use parallel::progress::{Progress, Talk};
use results::mode::Mode;
use runner::batch::Batch;
use runner::failure::{Exit, Failure};
use runner::plan::Planned;
use runner::trial_store::TrialStore;
use runner::{Context, batch, out};
use search::Stratum;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Sequences of each of the three kinds.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    each: u64,
    /// Seed of the drawing; --seed is that of every trial.
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    draws: u64,
    /// Live runs at a time.
    #[arg(long, value_name = "J", default_value_t = 1, value_parser = batch::jobs)]
    jobs: usize,
    /// Keep sequences, finished runs and the result here, and resume from there [default: runs/agreement].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let default = context.runs_folder()?.join("agreement");
    let dir = out::directory(&default, Some(args.out.as_deref().unwrap_or(&default)), "agreement")?;
    let kept = TrialStore::open(&dir)?;
    let lot = Lot { draws: args.draws, each: args.each };
    let cases = drawn::all(context, &kept, lot, &dir)?;
    let planned = cases.iter().map(|case| case.planned(context, &dir)).collect::<Result<Vec<_>, _>>()?;
    out::write_json(&dir, "manifest.json", &out::Manifest::new(context, &planned)?)?;
    let twin = trials(context, &kept, &planned, Mode::Twin, parallel::cores())?;
    let live = trials(context, &kept, &planned, Mode::Live, args.jobs)?;

    let runs = cases.iter().zip(&planned).zip(twin.iter().zip(&live));
    let sequences = runs.map(|((case, planned), trials)| row(context, case, planned, trials)).collect();
    let object = AgreementObject::new(context.seed, args.draws, kept.build().to_owned(), sequences);
    out::write_result(&dir, "result.json", "bench-agreement", &object)?;
    if context.json {
        out::print_json("bench-agreement", &object)?;
    } else {
        out::say(format_args!("{}", agreement_table(&object)));
    }
    Ok(exit(&object.sequences))
}

/// One trial of each in this mode; finished ones do not run again.
fn trials(
    context: &Context,
    kept: &TrialStore,
    planned: &[Planned],
    mode: Mode,
    jobs: usize,
) -> Result<Vec<Trial>, Failure> {
    let one = |planned: &Planned, progress: &Progress| {
        let batch = Batch {
            label: "",
            mode,
            planned: std::slice::from_ref(planned),
            n: 1,
            seed: context.seed,
            jobs,
            out: None,
        };
        // Its own file is open only as long as its trial runs.
        batch.run_kept(&[kept.shelf(mode, planned)?], 1, progress, &context.stop)
    };
    let mut missing = Vec::new();
    for planned in planned {
        if kept.shelf(mode, planned)?.missing(context.seed, 1) > 0 {
            missing.push(planned);
        }
    }
    let progress = Progress::new(&format!("sequences ({})", mode.name()), missing.len(), context.talk);
    parallel::map(jobs, &missing, |planned| one(planned, &progress))?;
    progress.finish();
    let untold = Progress::new("", 0, Talk::Quiet);
    let all = planned.iter().map(|planned| one(planned, &untold)).collect::<Result<Vec<_>, _>>()?;
    Ok(all.into_iter().flatten().collect())
}

fn row(context: &Context, case: &Case, planned: &Planned, (twin, live): (&Trial, &Trial)) -> SequenceRow {
    SequenceRow {
        name: case.name(),
        stratum: case.stratum,
        of: case.of.clone(),
        sequence: case.sequence.clone(),
        twin: twin.outcome,
        live: live.outcome,
        findings: live.findings.clone(),
        reproduce: batch::reproduce(Mode::Live, planned, context.seed),
    }
}

/// At an edge either may be the first to break; elsewhere a break that the twin misses was not expected.
fn exit(sequences: &[SequenceRow]) -> Exit {
    if sequences.iter().any(|sequence| sequence.is_missed() && sequence.stratum != Stratum::Edge) {
        Exit::Unexpected
    } else if sequences.iter().all(|sequence| sequence.live == Outcome::Invalid) {
        Exit::NoEvidence
    } else {
        Exit::Fine
    }
}
