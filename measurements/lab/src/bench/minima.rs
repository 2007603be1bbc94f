//! `lab search --shrink N`: for each weakness, the minimal cases to which the first findings of N seeds of drawing
//! shrink.
//!
//! Shrinking keeps the cause, so that minimal cases are counted cause by cause. The fewest actions are as in the
//! shortest sequences that `search --exhaust` tries and that are findings of the weakness with the cause.

use std::collections::BTreeMap;

use super::worth::{Bench, Sought};
use crate::report::{MinimaObject, MinimaRow, minima_table};
use evidence::SCHEMA_VERSION;
use parallel::progress::{Progress, Talk};
use runner::failure::{Exit, Failure};
use runner::out;
use runner::search_config::{MOST_SEQUENCES, stopped_or_unfit, unfit};
use scenario::Weakness;
use search::{AttackSequence, Cause, FoundSequence, Moments, ROUND, Shrunk, Source, Strategy};

pub(super) fn run(bench: &Bench<'_>, weaknesses: &[Weakness], seeds: u64) -> Result<Exit, Failure> {
    let progress = Progress::new("findings shrunk", weaknesses.len() * seeds as usize, bench.context.talk);
    let mut rows = Vec::new();
    for weakness in weaknesses {
        rows.extend(minima(bench, &Sought::load(bench.context, weakness.clone())?, seeds, &progress)?);
    }
    progress.finish();
    let (seed, budget) = (bench.context.seed, bench.budget);
    let object = MinimaObject { schema_version: SCHEMA_VERSION, seed, seeds, budget, rows };
    if bench.context.json {
        out::print_json("minima", &object)?;
    } else {
        out::say(format_args!("{}", minima_table(&object)));
    }
    Ok(Exit::Fine)
}

/// One row for each cause.
fn minima(bench: &Bench<'_>, sought: &Sought, seeds: u64, progress: &Progress) -> Result<Vec<MinimaRow>, Failure> {
    let config = &sought.config;
    let nominal = config.try_sequence(&AttackSequence::default()).map_err(unfit)?;
    let moments = Moments::from_run(&nominal, &config.space, &config.setup.bounds);
    let all: Vec<u64> = (1..=seeds).collect();
    let shrunk = parallel::map(bench.threads, &all, |seed| {
        let result = bench.search(sought, &Source::Strategy(Strategy::Guided), *seed)?;
        let shrink = |(cause, found): (Cause, FoundSequence)| {
            let shrunk = config.shrink(&found.sequence, &sought.test(), &cause, &moments);
            shrunk.map(|shrunk| (cause, shrunk)).map_err(unfit)
        };
        let shrunk = result.found.into_iter().next().map(shrink).transpose()?;
        progress.step();
        Ok::<_, Failure>(shrunk)
    })?;
    let mut by_cause: BTreeMap<Cause, Vec<Shrunk>> = BTreeMap::new();
    for (cause, shrunk) in shrunk.into_iter().flatten() {
        by_cause.entry(cause).or_default().push(shrunk);
    }
    let row = |(cause, shrunk): (Cause, Vec<Shrunk>)| {
        let longest = shrunk.iter().map(|shrunk| shrunk.sequence.actions().len()).max().unwrap_or_default();
        let fewest = fewest(bench, sought, &moments, &cause, longest)?;
        Ok(MinimaRow::new(&sought.weakness, config, &cause, &shrunk, fewest))
    };
    by_cause.into_iter().map(row).collect()
}

/// The fewest actions, below `below`, of a sequence with this cause.
fn fewest(
    bench: &Bench<'_>,
    sought: &Sought,
    moments: &Moments,
    cause: &Cause,
    below: usize,
) -> Result<Option<usize>, Failure> {
    let untold = Progress::new("", 0, Talk::Quiet);
    for k in 0..below {
        let too_many = || Failure::new(Exit::Usage, format!("more than {MOST_SEQUENCES} sequences of {k} actions"));
        let sequences = sought.config.sequences(k, moments, MOST_SEQUENCES).ok_or_else(too_many)?;
        let stop = &bench.context.stop;
        for round in sequences.chunks(ROUND as usize) {
            let counted = sought.config.try_each(round, &sought.test(), bench.threads, &untold, stop);
            let counted = counted.map_err(|reason| stopped_or_unfit(bench.context, reason))?;
            if counted.iter().any(|one| one.cause.as_ref() == Some(cause)) {
                return Ok(Some(k));
            }
        }
    }
    Ok(None)
}
