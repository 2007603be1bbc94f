//! `holdsafe guest compare GUEST.TOML…`: each guest bare and inside the guards over the same scenarios and seeds.
//!
//! Running trials is `runner`'s, folding them `results::report`'s. Finished trials are kept, so that a comparison resumes.

use std::path::{Path, PathBuf};

use evidence::trial::Trial;
use guest::Conduct;
use parallel::progress::Progress;
use results::mode::Mode;
use results::report::{Comparison, ComparisonRow, comparison_table};
use runner::batch::Batch;
use runner::closing::Closing;
use runner::failure::{Exit, Failure};
use runner::guest_options::{self, LoadedGuest};
use runner::plan::{PlanOptions, Planned};
use runner::trial_store::{Shelf, TrialStore};
use runner::{Context, batch, out, plan, probe};
use scenario::Interface;

/// The scenario without an attack: what the guards cost in quiet hours is read from its trials.
const QUIET: &str = "nominal";
/// The platform of the shared scenarios.
const SHARED: &str = "ground";

#[derive(Debug, clap::Args)]
pub(in crate::command) struct Args {
    /// Guest files.
    #[arg(required = true, value_name = "GUEST.TOML")]
    guests: Vec<PathBuf>,
    /// Only these scenarios, by name or by file [default: every shipped one that runs in the twin].
    #[arg(long, value_delimiter = ',', value_name = "SCENARIO")]
    scenarios: Vec<String>,
    /// A platform in place of the scenarios' own, by name or by file.
    #[arg(long, value_name = "PLATFORM")]
    platform: Option<String>,
    /// Trials of each scenario, or of each of its cells, for each guest bare and guarded.
    #[arg(long, value_name = "N", default_value_t = 59, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    trials: u64,
    /// Run live: processes, sockets, real clocks.
    #[arg(long)]
    live: bool,
    /// Live trials at a time.
    #[arg(long, value_name = "J", default_value_t = 1, value_parser = batch::jobs)]
    jobs: usize,
    /// Keep finished trials and the result here, and resume from there [default: runs/guests].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// One guest in one conduct with its variations.
struct Part {
    guest: String,
    file: PathBuf,
    conduct: Conduct,
    planned: Vec<Planned>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let mode = if args.live { Mode::Live } else { Mode::Twin };
    let mut parts = parts(context, args)?;
    if !args.live {
        parts.iter_mut().try_for_each(|part| probe::probe(&mut part.planned, context.seed))?;
    }
    let default = context.runs_folder()?.join("guests");
    let dir = out::directory(&default, Some(args.out.as_deref().unwrap_or(&default)), "guests")?;
    let kept = TrialStore::open(&dir)?;
    let all: Vec<Planned> = parts.iter().flat_map(|part| part.planned.clone()).collect();
    out::write_manifest(&dir, &out::Manifest::new(context, &all)?)?;
    let shelves = |part: &Part| part.planned.iter().map(|p| kept.shelf(mode, p)).collect::<Result<Vec<_>, _>>();
    let shelves: Vec<Vec<Shelf>> = parts.iter().map(shelves).collect::<Result<_, _>>()?;
    let missing = shelves.iter().flatten().map(|shelf| shelf.missing(context.seed, args.trials)).sum();
    let progress = Progress::new("guests", missing, context.talk);
    let mut rows = Vec::new();
    for (part, shelves) in parts.iter().zip(&shelves) {
        let (planned, label) = (part.planned.as_slice(), part.guest.as_str());
        let batch = Batch { label, mode, planned, n: args.trials, seed: context.seed, jobs: args.jobs, out: None };
        let trials = batch.run_kept(shelves, batch.threads(), &progress, &context.stop)?;
        // Trials come by variation and then by seed.
        for (planned, trials) in planned.iter().zip(trials.chunks(args.trials as usize)) {
            rows.push(row(part, planned, trials));
        }
    }
    progress.finish();
    let comparison = Comparison::new(context.seed, mode, args.trials, rows);
    out::write_result(&dir, "guests.json", "guests", &comparison)?;
    if context.json {
        out::print_json("guests", &comparison)?;
    } else {
        out::show(comparison_table(&comparison));
    }
    close(context, args, &dir, &parts, &comparison);
    Ok(Exit::Fine)
}

/// Summary, the first attack that harmed a guest, to be run with a recording, and the page of the comparison.
fn close(context: &Context, args: &Args, dir: &Path, parts: &[Part], comparison: &Comparison) {
    let of = |conduct: Conduct| {
        let totals = comparison.totals.iter().filter(|total| total.conduct == conduct.name());
        let (harmed, all) = totals.fold((0, 0), |(harmed, all), one| (harmed + one.harmed, all + one.variations));
        format!("{} harmed in {harmed} of {all}", conduct.name())
    };
    let harmful = comparison.rows.iter().find(|row| row.harmful.hits > 0).or(comparison.rows.first());
    let part = harmful.and_then(|row| Some((row, parts.iter().find(|part| part.guest == row.guest)?)));
    let Some((row, part)) = part else { return };
    let file = part.file.to_string_lossy();
    let folder = context.free_folder(&row.scenario);
    let mut run = vec!["run", &row.scenario, "--trials", "1", "--autonomy", &file, "--out", &folder];
    run.extend((row.conduct == Conduct::Bare.name()).then_some("--bare"));
    run.extend(args.live.then_some("--live"));
    run.extend(row.cell.iter().flat_map(|cell| ["--cell", cell]));
    run.extend(args.platform.iter().flat_map(|platform| ["--platform", platform]));
    let closing = Closing::new(context).part(of(Conduct::Bare)).part(of(Conduct::Guarded));
    closing.print([context.command(run), context.report_of(dir)]);
}

fn row(part: &Part, planned: &Planned, trials: &[Trial]) -> ComparisonRow {
    let scenario = &planned.variation.scenario;
    let quiet = scenario.name.as_str() == QUIET;
    let marks = (part.conduct.name().to_owned(), planned.setup.watermark());
    ComparisonRow::new(&part.guest, marks, (scenario.name.as_str(), planned.variation.cell.clone()), quiet, trials)
}

fn parts(context: &Context, args: &Args) -> Result<Vec<Part>, Failure> {
    let files = if args.scenarios.is_empty() {
        scenario::shipped(&context.root()?)?
    } else {
        args.scenarios.iter().map(|name| plan::file_of(context, name)).collect::<Result<_, _>>()?
    };
    let mut scenarios = files.iter().map(|file| Ok(context.scenario(file)?)).collect::<Result<Vec<_>, Failure>>()?;
    // Attacks on what is recorded and on the display are about parts that a guest has no share in.
    let named = !args.scenarios.is_empty();
    let shared = |interface: Interface| !matches!(interface, Interface::ConsoleFeed | Interface::Host);
    scenarios.retain(|scenario| !scenario.is_of_stacks() && (named || shared(scenario.interface)));
    let platform = args.platform.as_ref().map(|name| plan::platform_of(context, name)).transpose()?;
    if let Some(chosen) = platform.as_ref().filter(|_| !named) {
        // Scenarios of a third platform ask for what this one does not have.
        let chosen = chosen.file.file_stem();
        let is_own = |name: &str| name == SHARED || chosen.is_some_and(|stem| stem == name);
        scenarios.retain(|scenario| is_own(scenario.platform.as_str()));
    }
    let mut parts: Vec<Part> = Vec::new();
    for file in &args.guests {
        for conduct in [Conduct::Bare, Conduct::Guarded] {
            let guest = guest_options::guest(file, conduct)?;
            let (name, options) = (guest.program.name.clone(), guest_options::options(file, conduct));
            if parts.iter().any(|part| part.guest == name && part.conduct == conduct) {
                let reason = format!("two guests have the name {name}; give one another name in its file");
                return Err(Failure::new(Exit::Usage, reason));
            }
            let (guest, platform) = (Some(LoadedGuest { guest, options }), platform.clone());
            let wanted =
                PlanOptions { rendered: args.live, where_trained: true, platform, guest, ..PlanOptions::default() };
            let mut planned = Vec::new();
            for scenario in &scenarios {
                planned.extend(plan::of_scenario(context, scenario, &wanted)?);
            }
            parts.push(Part { guest: name, file: file.clone(), conduct, planned });
        }
    }
    Ok(parts)
}
