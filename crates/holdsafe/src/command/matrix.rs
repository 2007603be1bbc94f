//! `holdsafe matrix`: every row of the threat catalogue, its scenarios run and judged, on one page.
//!
//! A scenario runs in its own engine, the twin or the stacks in memory, and with `--live N` also live; their n are
//! never added. Finished trials are kept (`kept`), so a matrix resumes after an interruption.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use evidence::trial::Trial;
use parallel::progress::Progress;
use results::catalogue::{Catalogue, Row};
use results::mode::Mode;
use results::report::{Matrix, MatrixRow, MatrixRun, matrix_table};
use runner::batch::Batch;
use runner::engage::Engage;
use runner::failure::{Exit, Failure};
use runner::kept::{Kept, Shelf};
use runner::plan::{Planned, Wanted};
use runner::retry::Retries;
use runner::{Context, batch, out, plan, probe};
use scenario::Scenario;

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
    engage: Engage,
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

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let (catalogue, scenarios) = context.catalogue()?;
    let wanted = wanted(&catalogue, args)?;
    let named = |s: &Scenario| wanted.iter().any(|row| s.threats.iter().any(|id| id.as_str() == row.id.as_str()));
    let mut parts = parts(context, args, scenarios.into_iter().filter(named).collect())?;
    probe::probe(parts.iter_mut().flat_map(|part| &mut part.planned), context.seed)?;
    if parts.is_empty() {
        return Err(Failure::new(Exit::NoEvidence, "none of these rows has a scenario"));
    }
    let default = context.root()?.join("runs").join("matrix");
    let dir = out::directory(&default, Some(args.out.as_deref().unwrap_or(&default)), "matrix")?;
    let kept = Kept::below(&dir)?;
    manifest(context, &dir, &parts)?;

    let (mut exit, runs) = all(context, args, &kept, &parts)?;
    let rows = wanted.iter().map(|row| MatrixRow::new(row, of(row, &parts, &runs))).collect();
    let matrix = Matrix::new(context.seed, kept.build(), rows);
    out::write_result(&dir, "matrix.json", "matrix", &matrix)?;
    if context.json {
        out::print_json("matrix", &matrix)?;
    } else {
        out::say(format_args!("{}", matrix_table(&matrix)));
    }
    if runs.values().all(|run| run.summary.n == 0) {
        exit = batch::graver(exit, Exit::NoEvidence);
    }
    Ok(exit)
}

fn wanted<'a>(catalogue: &'a Catalogue, args: &Args) -> Result<Vec<&'a Row>, Failure> {
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
        let wanted = Wanted { guest: guest.clone(), ..Wanted::default() };
        let planned = plan::of_scenario(context, &scenario, &wanted)?;
        let mode = if scenario.is_of_stacks() { Mode::Stack } else { Mode::Twin };
        parts.push(Part { scenario: scenario.clone(), mode, n: args.trials, planned });
        if args.live > 0 && mode == Mode::Twin {
            let rendered = Wanted { rendered: true, guest: guest.clone(), ..Wanted::default() };
            let mut planned = plan::of_scenario(context, &scenario, &rendered)?;
            planned.iter_mut().for_each(|of| of.setup.retries = args.retries.retries);
            parts.push(Part { scenario, mode: Mode::Live, n: args.live, planned });
        }
    }
    Ok(parts)
}

fn manifest(context: &Context, dir: &Path, parts: &[Part]) -> Result<(), Failure> {
    let all: Vec<Planned> = parts.iter().flat_map(|part| part.planned.clone()).collect();
    out::write_json(dir, "manifest.json", &out::Manifest::of(context, &all)?)
}

/// Place of a variation: the index of its part, and its index in that part.
type Place = (usize, usize);

fn all(
    context: &Context,
    args: &Args,
    kept: &Kept,
    parts: &[Part],
) -> Result<(Exit, BTreeMap<Place, MatrixRun>), Failure> {
    let shelves = |part: &Part| part.planned.iter().map(|p| kept.shelf(part.mode, p)).collect::<Result<Vec<_>, _>>();
    let shelves: Vec<Vec<Shelf>> = parts.iter().map(shelves).collect::<Result<_, _>>()?;
    let missing = |(part, shelves): (&Part, &Vec<Shelf>)| {
        shelves.iter().map(|shelf| shelf.missing(context.seed, part.n)).sum::<usize>()
    };
    let progress = Progress::new("matrix", parts.iter().zip(&shelves).map(missing).sum(), context.talk);
    let (mut exit, mut runs) = (Exit::Fine, BTreeMap::new());
    for (p, (part, shelves)) in parts.iter().zip(&shelves).enumerate() {
        let (label, planned) = (part.scenario.name.as_str(), part.planned.as_slice());
        let batch =
            Batch { label, mode: part.mode, planned, n: part.n, seed: context.seed, jobs: args.jobs, out: None };
        let trials = batch.run_kept(shelves, &progress, &context.stop)?;
        exit = batch::graver(exit, batch::judge(part.mode, planned, &trials));
        for (v, planned) in planned.iter().enumerate() {
            let own: Vec<&Trial> = trials.iter().filter(|t| t.cell == planned.variation.cell).collect();
            let (variation, setup) = (&planned.variation, &planned.setup);
            runs.insert((p, v), MatrixRun::new(variation, setup.watermark(), part.mode, &own));
        }
    }
    progress.finish();
    Ok((exit, runs))
}

/// The runs of a row.
fn of(row: &Row, parts: &[Part], runs: &BTreeMap<Place, MatrixRun>) -> Vec<MatrixRun> {
    let names = |part: &Part| part.scenario.threats.iter().any(|id| id.as_str() == row.id.as_str());
    runs.iter().filter(|((p, _), _)| names(&parts[*p])).map(|(_, run)| run.clone()).collect()
}
