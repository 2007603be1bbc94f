//! `holdsafe matrix`: every row of the threat catalogue, its scenarios run and judged, on one page.
//!
//! A scenario runs in its own engine, the twin or the stacks in memory, and with `--live N` also live; their n are
//! never added. Finished trials are kept (`kept`), so a matrix resumes after an interruption.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use evidence::trial::Trial;
use parallel::progress::Progress;
use results::catalogue::{Catalogue, ThreatRow};
use results::mode::Mode;
use results::report::{Matrix, MatrixRow, MatrixRun, matrix_table};
use runner::batch::Batch;
use runner::closing::Closing;
use runner::ended::Ended;
use runner::failure::{Exit, Failure};
use runner::guest_options::GuestOptions;
use runner::parts::Parts;
use runner::plan::{PlanOptions, Planned};
use runner::retry::Retries;
use runner::trial_store::{Shelf, TrialStore};
use runner::{Context, batch, out, plan, probe};
use scenario::Scenario;

use super::emit::{Shares, tell_kept};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Only these rows, such as A01,A11.
    #[arg(long, value_delimiter = ',', value_name = "ROW")]
    rows: Vec<String>,
    /// Trials of each scenario, or of each of its cells, in the twin or on the stacks.
    #[arg(long, value_name = "N", default_value_t = 299, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    trials: u64,
    /// Live trials beside them.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=10_000))]
    live: u64,
    /// Live trials at a time.
    #[arg(long, value_name = "J", default_value_t = 1, value_parser = batch::jobs)]
    jobs: usize,
    #[command(flatten)]
    retries: Retries,
    #[command(flatten)]
    engage: GuestOptions,
    #[command(flatten)]
    parts: Parts,
    /// Keep finished trials and the result here, and resume from there [default: runs/matrix].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// One scenario in one mode, ready to run.
struct Part {
    scenario: Scenario,
    mode: Mode,
    n: u64,
    planned: Vec<Planned>,
}

impl Args {
    /// Work of the matrix, divided for partitions.
    pub(super) fn shares(&self, context: &Context) -> Result<Shares, Failure> {
        let set = self.parts.partition.is_some() || !self.parts.from.is_empty() || self.out.is_some();
        let (_, parts) = planned(context, self)?;
        Ok(Shares {
            pieces: parts.iter().map(Part::trials).sum(),
            of: "trials",
            threads: self.parts.threads,
            set,
            rounds: false,
        })
    }
}

impl Part {
    fn trials(&self) -> u64 {
        self.planned.len() as u64 * self.n
    }

    fn batch(&self, seed: u64) -> Batch<'_> {
        let Part { scenario, mode, n, planned } = self;
        Batch { label: scenario.name.as_str(), mode: *mode, planned, n: *n, seed, jobs: 1, out: None }
    }

    /// Trials at a time.
    fn threads(&self, args: &Args) -> usize {
        if self.mode == Mode::Live { args.jobs } else { args.parts.threads() }
    }
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let context = &context.with_fresh_seed();
    let (rows, parts) = planned(context, args)?;
    let default = context.runs_folder()?.join("matrix");
    let dir = out::directory(&default, Some(args.out.as_deref().unwrap_or(&default)), "matrix")?;
    let shelf = TrialStore::open(&dir)?.with_parts(&args.parts.from)?;
    manifest(context, &dir, &parts)?;

    let shelves = |part: &Part| part.planned.iter().map(|p| shelf.shelf(part.mode, p)).collect::<Result<Vec<_>, _>>();
    let shelves: Vec<Vec<Shelf>> = parts.iter().map(shelves).collect::<Result<_, _>>()?;
    if args.parts.partition.is_some() {
        keep(context, args, &parts, &shelves)?;
        tell_kept(context, &dir)?;
        return Ok(Exit::Fine);
    }
    let (mut exit, odd, runs) = all(context, args, &parts, &shelves)?;
    let rows = rows.iter().map(|row| MatrixRow::new(row, row_runs(row, &parts, &runs))).collect();
    let matrix = Matrix::new(context.seed, shelf.build(), rows);
    out::write_result(&dir, "matrix.json", "matrix", &matrix)?;
    if context.json {
        out::print_json("matrix", &matrix)?;
    } else {
        out::show(matrix_table(&matrix));
    }
    let ended: Vec<Ended> = runs.values().map(Ended::from).collect();
    let layers = dir.join("navigator");
    let other = odd.map_or_else(
        || context.command(["report", &dir.to_string_lossy(), "--navigator", &layers.to_string_lossy()]),
        |line| context.own_command(&line),
    );
    Closing::new(context).ended("runs", &ended).print([context.report_of(&dir), other]);
    if runs.values().all(|run| run.summary.n == 0) {
        exit = batch::graver(exit, Exit::NoEvidence);
    }
    Ok(exit)
}

/// The rows, and their scenarios, ready to run.
fn planned(context: &Context, args: &Args) -> Result<(Vec<ThreatRow>, Vec<Part>), Failure> {
    let (catalogue, scenarios) = context.catalogue()?;
    let rows: Vec<ThreatRow> = wanted(&catalogue, args)?.into_iter().cloned().collect();
    let named = |s: &Scenario| rows.iter().any(|row| s.threats.iter().any(|id| id.as_str() == row.id.as_str()));
    let mut parts = parts(context, args, scenarios.into_iter().filter(named).collect())?;
    probe::probe(parts.iter_mut().flat_map(|part| &mut part.planned), context.seed)?;
    if parts.is_empty() {
        return Err(Failure::new(Exit::NoEvidence, "none of these rows has a scenario"));
    }
    Ok((rows, parts))
}

fn wanted<'a>(catalogue: &'a Catalogue, args: &Args) -> Result<Vec<&'a ThreatRow>, Failure> {
    if args.rows.is_empty() {
        return Ok(catalogue.row.iter().collect());
    }
    let row = |id: &String| {
        let none = || Failure::new(Exit::Usage, format!("no row `{id}`; docs/reference/threats.md lists them"));
        catalogue.row(id).ok_or_else(none)
    };
    args.rows.iter().map(row).collect()
}

fn parts(context: &Context, args: &Args, scenarios: Vec<Scenario>) -> Result<Vec<Part>, Failure> {
    let mut parts = Vec::new();
    let guest = args.engage.load()?;
    for scenario in scenarios {
        if guest.is_some() && scenario.is_of_stacks() {
            continue;
        }
        let wanted = PlanOptions { guest: guest.clone(), ..PlanOptions::default() };
        let planned = plan::of_scenario(context, &scenario, &wanted)?;
        let mode = if scenario.is_of_stacks() { Mode::Stack } else { Mode::Twin };
        parts.push(Part { scenario: scenario.clone(), mode, n: args.trials, planned });
        if args.live > 0 && mode == Mode::Twin {
            let rendered = PlanOptions { rendered: true, guest: guest.clone(), ..PlanOptions::default() };
            let mut planned = plan::of_scenario(context, &scenario, &rendered)?;
            planned.iter_mut().for_each(|one| one.setup.retries = args.retries.retries);
            parts.push(Part { scenario, mode: Mode::Live, n: args.live, planned });
        }
    }
    Ok(parts)
}

fn manifest(context: &Context, dir: &Path, parts: &[Part]) -> Result<(), Failure> {
    let all: Vec<Planned> = parts.iter().flat_map(|part| part.planned.clone()).collect();
    out::write_manifest(dir, &out::Manifest::new(context, &all)?)
}

/// Runs and keeps the trials of a partition, every N-th of all.
fn keep(context: &Context, args: &Args, parts: &[Part], shelves: &[Vec<Shelf>]) -> Result<(), Failure> {
    let all = 0..parts.iter().map(Part::trials).sum();
    let progress = Progress::new("partition", all.filter(|number| args.parts.holds(*number)).count(), context.talk);
    let mut first = 0;
    for (part, shelves) in parts.iter().zip(shelves) {
        let holds = |number| args.parts.holds(first + number);
        part.batch(context.seed).keep(shelves, holds, part.threads(args), &progress, &context.stop)?;
        first += part.trials();
    }
    progress.finish();
    Ok(())
}

/// Place of a variation: the index of its part, and its index in that part.
type Place = (usize, usize);

/// The exit code, the line that repeats the first trial that was not expected, and all runs.
type Outcomes = (Exit, Option<String>, BTreeMap<Place, MatrixRun>);

/// Runs what is missing.
fn all(context: &Context, args: &Args, parts: &[Part], shelves: &[Vec<Shelf>]) -> Result<Outcomes, Failure> {
    let missing = |(part, shelves): (&Part, &Vec<Shelf>)| {
        shelves.iter().map(|shelf| shelf.missing(context.seed, part.n)).sum::<usize>()
    };
    let progress = Progress::new("matrix", parts.iter().zip(shelves).map(missing).sum(), context.talk);
    let (mut exit, mut first_odd, mut runs) = (Exit::Fine, None, BTreeMap::new());
    for (p, (part, shelves)) in parts.iter().zip(shelves).enumerate() {
        let trials = part.batch(context.seed).run_kept(shelves, part.threads(args), &progress, &context.stop)?;
        exit = batch::graver(exit, batch::judge(part.mode, &part.planned, &trials));
        let odd = batch::odd(&part.planned, &trials);
        first_odd = first_odd.or(odd.first().map(|(trial, one)| batch::reproduce(part.mode, one, trial.seed)));
        for (v, planned) in part.planned.iter().enumerate() {
            let own_trials: Vec<&Trial> = trials.iter().filter(|t| t.cell == planned.variation.cell).collect();
            let (variation, setup) = (&planned.variation, &planned.setup);
            runs.insert((p, v), MatrixRun::new(variation, setup.watermark(), part.mode, &own_trials));
        }
    }
    progress.finish();
    Ok((exit, first_odd, runs))
}

/// The runs of a row.
fn row_runs(row: &ThreatRow, parts: &[Part], runs: &BTreeMap<Place, MatrixRun>) -> Vec<MatrixRun> {
    let names = |part: &Part| part.scenario.threats.iter().any(|id| id.as_str() == row.id.as_str());
    runs.iter().filter(|((p, _), _)| names(&parts[*p])).map(|(_, run)| run.clone()).collect()
}
