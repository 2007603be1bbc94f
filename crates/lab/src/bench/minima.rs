//! `lab search --shrink N`: for each weakness, the minimal cases to which the first findings of N seeds of drawing
//! shrink.
//!
//! Shrinking keeps the cause, so that minimal cases are counted cause by cause. The fewest actions are those of the
//! shortest sequences that `search --exhaust` tries and that have the cause.

use std::collections::BTreeMap;

use super::worth::Bench;
use crate::report::{MinimaObject, MinimaRow, minima_table};
use evidence::SCHEMA_VERSION;
use parallel::progress::{Progress, Talk};
use runner::failure::{Exit, Failure};
use runner::out;
use runner::search_config::{MOST_WORDS, stopped_or_unfit, unfit};
use scenario::Weakness;
use search::{AttackSequence, Cause, Found, Moments, SearchConfig, Shrunk, Strategy, ends_in};

pub(super) fn run(bench: &Bench<'_>, grounds: &[(Weakness, SearchConfig)], seeds: u64) -> Result<Exit, Failure> {
    let progress = Progress::new("findings shrunk", grounds.len() * seeds as usize, bench.context.talk);
    let mut rows = Vec::new();
    for ground in grounds {
        rows.extend(minima(bench, ground, seeds, &progress)?);
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
fn minima(
    bench: &Bench<'_>,
    (weakness, ground): &(Weakness, SearchConfig),
    seeds: u64,
    progress: &Progress,
) -> Result<Vec<MinimaRow>, Failure> {
    let nominal = ground.try_word(&AttackSequence::default()).map_err(unfit)?;
    let moments = Moments::of(&nominal, &ground.alphabet, &ground.setup.bounds);
    let all: Vec<u64> = (1..=seeds).collect();
    let shrunk = parallel::map(bench.threads, &all, |seed| {
        let hunted = bench.search((weakness, ground), Strategy::Guided, *seed)?;
        let shrink = |(cause, found): (Cause, Found)| {
            let shrunk = ground.shrink(&found.tried.word, &ends_in(&weakness.find), &cause, &moments);
            shrunk.map(|shrunk| (cause, shrunk)).map_err(unfit)
        };
        let shrunk = hunted.found.into_iter().next().map(shrink).transpose()?;
        progress.step();
        Ok::<_, Failure>(shrunk)
    })?;
    let mut by_cause: BTreeMap<Cause, Vec<Shrunk>> = BTreeMap::new();
    for (cause, shrunk) in shrunk.into_iter().flatten() {
        by_cause.entry(cause).or_default().push(shrunk);
    }
    let row = |(cause, shrunk): (Cause, Vec<Shrunk>)| {
        let longest = shrunk.iter().map(|shrunk| shrunk.word.letters().len()).max().unwrap_or_default();
        let fewest = fewest(bench, weakness, ground, &moments, &cause, longest)?;
        Ok(MinimaRow::new(weakness, ground, &cause, &shrunk, fewest))
    };
    by_cause.into_iter().map(row).collect()
}

/// The fewest actions, below `below`, of a sequence with this cause.
fn fewest(
    bench: &Bench<'_>,
    weakness: &Weakness,
    ground: &SearchConfig,
    moments: &Moments,
    cause: &Cause,
    below: usize,
) -> Result<Option<usize>, Failure> {
    let untold = Progress::new("", 0, Talk::Quiet);
    for k in 0..below {
        let too_many = || Failure::new(Exit::Usage, format!("more than {MOST_WORDS} words of {k} letters"));
        let words = ground.words(k, moments, MOST_WORDS).ok_or_else(too_many)?;
        let stop = &bench.context.stop;
        let tried = ground.try_all(&words, &ends_in(&weakness.find), bench.threads, &untold, stop);
        if tried.map_err(|why| stopped_or_unfit(bench.context, why))?.found.contains_key(cause) {
            return Ok(Some(k));
        }
    }
    Ok(None)
}
