//! Live runs of the tour, one after another: each begins in a quieter moment of the host, and is repeated where the host spoils it.

use std::fs;
use std::path::Path;
use std::time::Duration;

use evidence::trial::Trial;
use live::calm;
use recording::RunFolder;
use results::mode::Mode;
use runner::failure::{Exit, Failure};
use runner::plan::{PlanOptions, Planned};
use runner::retry::retried;
use runner::{Context, batch, out, plan};
use scenario::{Scenario, Setup};

/// Scenarios of the tour that run live too, each with its cell; the last shows the paper's finding.
const SHOWN: [(&str, Option<&str>); 3] =
    [("nominal", None), ("thermal_loss", None), ("teammate", Some("verbatim/present/session-bound"))];
/// Repetitions of a run that a stall of the host alone makes INVALID.
const RETRIES: u32 = 2;
/// Time that one run waits for quieter moments at most, its repetitions included.
const PATIENCE: Duration = Duration::from_secs(10);

/// The live runs, planned.
pub(super) fn planned(context: &Context) -> Result<Vec<(Scenario, Planned)>, Failure> {
    let mut all = Vec::new();
    for (name, cell) in SHOWN {
        let cell = cell.map(str::to_owned);
        let wanted = PlanOptions { cell, rendered: true, where_trained: true, ..PlanOptions::default() };
        let (scenario, planned) = plan::plan(context, &plan::file_of(context, name)?, &wanted)?;
        all.extend(planned.into_iter().map(|one| (scenario.clone(), one)));
    }
    Ok(all)
}

/// Runs one of them, and keeps its recording below `dir`.
pub(super) fn trial(context: &Context, planned: &Planned, dir: &Path) -> Result<Trial, Failure> {
    let variation = &planned.variation;
    let mut folder = dir.join(Mode::Live.name()).join(variation.scenario.name.as_str());
    folder.extend(variation.cell.as_ref().map(|cell| cell.replace('/', ".")));
    folder.push(context.seed.to_string());
    out::check_unused(&folder)?;
    fs::create_dir_all(&folder)?;
    let setup = Setup { run_dir: Some(folder.clone()), retries: 0, ..planned.setup.clone() };
    let often = Setup { retries: RETRIES, ..setup.clone() };
    let mut patience = PATIENCE;
    let ended = retried(&often, context.seed, || {
        calm::await_quiet(&mut patience, &context.stop);
        batch::trial(Mode::Live, planned, &setup, context.seed, &context.stop)
    });
    // A run that could not begin leaves no recording that a report could read.
    if !RunFolder::new(&folder).recording().exists()
        && ended.as_ref().is_err_and(|failure| failure.exit() == Exit::Environment)
    {
        let _gone = fs::remove_dir_all(&folder);
    }
    ended
}
