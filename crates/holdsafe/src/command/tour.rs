//! `holdsafe tour`, also without a verb: the paper's finding, its negative control and some losses in a few minutes, three of them live too.
//!
//! A row's classes are those that its scenario expects, as in `evaluate`; a live run that the host spoilt is named, is not judged, and leaves
//! the exit code alone. `row` holds a row against them, `words` makes
//! sentences of the trials' records, `live` runs the live ones.

mod live;
mod row;
mod words;

use std::path::{Path, PathBuf};

use evidence::SCHEMA_VERSION;
use evidence::trial::Trial;
use explain::{Explanation, explain};
use guest::Conduct;
use parallel::progress::Progress;
use results::mode::Mode;
use results::report::{RunObject, RunsObject};
use runner::batch::Batch;
use runner::failure::{Exit, Failure};
use runner::guest_options::{self, LoadedGuest};
use runner::plan::{PlanOptions, Planned};
use runner::{Context, batch, engine, out, plan, probe};
use scenario::Scenario;

use super::{doctor, report};
use row::{Row, TourObject};

/// Twin trials of each row and of each cell.
const TRIALS: u64 = 20;
/// The scenario that is printed as a matrix of its cells.
const FINDING: &str = "teammate";
/// Scenarios in the twin in their order, with the conduct of a guest where one drives. In `hold_block` the operator's HOLD is kept back.
const SHOWN: [(&str, Option<Conduct>); 7] = [
    (FINDING, None),
    ("nominal", None),
    ("thermal_loss", None),
    ("rgb_loss", None),
    ("hold_block", None),
    ("localisation_drift", Some(Conduct::Bare)),
    ("localisation_drift", Some(Conduct::Guarded)),
];
/// Cost of a trial of two minutes with the process of a guest, in trials of nine seconds.
const GUEST_COST: u64 = 20;
/// Cost of a live run on two cores, in the same.
const LIVE_COST: u64 = 2_000;
/// Lines of a row's text, at most.
const LINES: usize = 3;
/// Reason for which a bare guest's row is not judged.
const BARE: &str = "no class is expected of a bare guest";

#[derive(Debug, Default, clap::Args)]
pub(super) struct Args {
    /// Simulated runs only.
    #[arg(long)]
    twin: bool,
    /// Keep recordings, results and the report here [default: runs/tour-N].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// One scenario in the twin.
struct Stage {
    scenario: Scenario,
    planned: Vec<Planned>,
    conduct: Option<Conduct>,
}

impl Stage {
    /// Cost of one of its trials.
    fn cost(&self) -> u64 {
        if self.conduct.is_some() { GUEST_COST } else { 1 }
    }
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    // Every file is read before anything runs.
    let stages = planned_stages(context)?;
    let live = if args.twin { Vec::new() } else { live::planned(context)? };
    let dir = out::directory(&context.runs_folder()?, args.out.as_deref(), "tour")?;
    let planned = stages.iter().flat_map(|stage| &stage.planned).chain(live.iter().map(|(_, one)| one));
    let planned: Vec<Planned> = planned.cloned().collect();
    out::write_manifest(&dir, &out::Manifest::new(context, &planned)?)?;
    let twin: u64 = stages.iter().map(|stage| stage.planned.len() as u64 * TRIALS * stage.cost()).sum();
    let progress = Progress::new("tour", (twin + live.len() as u64 * LIVE_COST) as usize, context.talk);
    let mut tour = Tour { context, dir: &dir, progress, exit: Exit::Fine, rows: Vec::new(), runs: Vec::new() };
    let ended = tour.run_all(&stages, &live);
    tour.progress.finish();
    let interrupted = match ended {
        Ok(()) => false,
        Err(failure) if failure.exit() == Exit::Interrupted => true,
        Err(failure) => return Err(failure),
    };
    tour.finish(live.len(), interrupted)
}

fn planned_stages(context: &Context) -> Result<Vec<Stage>, Failure> {
    let mut stages = Vec::new();
    for (name, conduct) in SHOWN {
        let wanted = PlanOptions { guest: conduct.map(follower_driven).transpose()?, ..PlanOptions::default() };
        let (scenario, planned) = plan::plan(context, &plan::file_of(context, name)?, &wanted)?;
        stages.push(Stage { scenario, planned, conduct });
    }
    probe::probe(stages.iter_mut().flat_map(|stage| &mut stage.planned), context.seed)?;
    Ok(stages)
}

fn follower_driven(conduct: Conduct) -> Result<LoadedGuest, Failure> {
    let file = Path::new(guest_options::FOLLOWER);
    Ok(LoadedGuest { guest: guest_options::guest(file, conduct)?, options: guest_options::options(file, conduct) })
}

/// State of the tour.
struct Tour<'a> {
    context: &'a Context,
    dir: &'a Path,
    progress: Progress,
    exit: Exit,
    rows: Vec<Row>,
    /// Trials of the judged rows and of the bare guest, as the report reads them.
    runs: Vec<RunObject>,
}

impl Tour<'_> {
    fn run_all(&mut self, stages: &[Stage], live: &[(Scenario, Planned)]) -> Result<(), Failure> {
        let heading = match live.is_empty() {
            true => "Every run is simulated, in the twin.",
            false => {
                "Runs in the twin are simulated, live ones have real processes and links on loopback; they are never counted \
                 together."
            }
        };
        self.print(&words::lines(&format!("Seed {}. {heading}", self.context.seed), false, LINES));
        stages.iter().try_for_each(|stage| self.run_in_twin(stage))?;
        let lacking = if live.is_empty() { Vec::new() } else { doctor::lacking_for_live() };
        live.iter().try_for_each(|(scenario, one)| self.run_live(scenario, one, &lacking))
    }

    /// Runs a scenario in the twin and prints its row.
    fn run_in_twin(&mut self, stage: &Stage) -> Result<(), Failure> {
        let Stage { scenario, planned, conduct } = stage;
        let (label, seed) = (scenario.name.as_str(), self.context.seed);
        // Both conducts of a guest have the same scenario and seed.
        let out = conduct.map_or_else(|| self.dir.to_owned(), |conduct| self.dir.join(conduct.name()));
        let batch = Batch { label, mode: Mode::Twin, planned, n: TRIALS, seed, jobs: 1, out: Some(&out) };
        let trials = batch.run_within(&self.progress.part(label, stage.cost()), &self.context.stop)?;
        let bare = *conduct == Some(Conduct::Bare);
        let not_judged = || bare.then(|| BARE.to_owned());
        // Trials come by variation and then by seed.
        for (one, own) in planned.iter().zip(trials.chunks(TRIALS as usize)) {
            let own_trials: Vec<&Trial> = own.iter().collect();
            // The matrix gives causes by policy, not by cell.
            let explained = if planned.len() == 1 { last_loss(one, &own_trials, seed)? } else { None };
            self.add_row(Row::new(
                (one, Mode::Twin, seed),
                &own_trials,
                not_judged(),
                words::response(&own_trials, explained.as_ref()),
            ));
        }
        if planned.len() > 1 {
            self.print_matrix(stage, &trials);
        } else if let Some(row) = self.rows.last() {
            self.print_row(row);
        }
        let suffix = conduct.map(|conduct| format!(".{}", conduct.name())).unwrap_or_default();
        self.write_trials(&format!("{label}{suffix}"), (scenario, Mode::Twin, planned), trials, bare)
    }

    /// Runs one scenario live and prints its row; `lacking` keeps it from running.
    fn run_live(&mut self, scenario: &Scenario, one: &Planned, lacking: &[String]) -> Result<(), Failure> {
        let (label, seed) = (format!("{}, live", scenario.name.as_str()), self.context.seed);
        let progress = self.progress.part(&label, LIVE_COST);
        let ended = match lacking.first() {
            None => live::trial(self.context, one, self.dir),
            Some(_) => Err(Failure::new(Exit::Environment, lacking.join("; "))),
        };
        progress.step();
        let (trial, not_judged) = match ended {
            Ok(trial) => {
                let stalled = trial.host_stall_ms.map(words::host_stalled);
                (Some(trial), stalled)
            }
            Err(failure) if failure.exit() == Exit::Environment => {
                // A requirement that this host lacks excuses a run; one that failed without such a lack is no pass.
                if lacking.is_empty() {
                    self.exit = batch::graver(self.exit, Exit::Environment);
                }
                (None, Some(failure.to_string()))
            }
            Err(failure) => return Err(failure),
        };
        let own_trials: Vec<&Trial> = trial.iter().collect();
        let judged = not_judged.is_none();
        self.add_row(Row::new((one, Mode::Live, seed), &own_trials, not_judged, words::response(&own_trials, None)));
        if let Some(row) = self.rows.last() {
            self.print_row(row);
        }
        // A run that the host spoilt is no result; its recording stays, and the report names it INVALID.
        match trial.filter(|_| judged) {
            Some(trial) => {
                let name = format!("{}.live", scenario.name.as_str());
                self.write_trials(&name, (scenario, Mode::Live, std::slice::from_ref(one)), vec![trial], false)
            }
            None => Ok(()),
        }
    }

    /// Adds a row; a failed expectation is named on stderr.
    fn add_row(&mut self, row: Row) {
        self.exit = batch::graver(self.exit, row.exit());
        if let Some(complaint) = row.complaint() {
            out::note(complaint);
        }
        self.rows.push(row);
    }

    fn print_row(&self, row: &Row) {
        let mut lines = words::marked_lines(row.mark(), &row.heading(), LINES - 1);
        let response = if row.n == 0 || (row.mode == Mode::Live && row.not_judged.is_some()) {
            String::new()
        } else {
            format!(" {}.", row.response)
        };
        let room = LINES + 1 - lines.len();
        lines.extend(words::lines(&format!("{}.{response}", row.attacked), true, room));
        self.print(&lines);
    }

    /// The matrix of a scenario's cells, and a sentence for each policy.
    fn print_matrix(&self, stage: &Stage, trials: &[Trial]) {
        let rows = &self.rows[self.rows.len().saturating_sub(stage.planned.len())..];
        let mark = if rows.iter().all(|row| row.as_expected == Some(true)) { "ok" } else { "FAIL" };
        let name = stage.scenario.name.as_str();
        let heading = format!("{name}, twin, {} cells, n = {TRIALS} each:", rows.len());
        let mut lines = words::marked_lines(mark, &heading, 1);
        let cells: Vec<_> = rows.iter().filter_map(|row| Some((row.cell.as_deref()?, &row.outcomes))).collect();
        lines.extend(words::matrix(&cells));
        let mut policies: Vec<&str> = Vec::new();
        for one in &stage.planned {
            let policy = one.setup.policy_name.as_str();
            if !policies.contains(&policy) {
                policies.push(policy);
            }
        }
        let under_policy = |policy: &str| {
            let each = stage.planned.iter().zip(trials.chunks(TRIALS as usize));
            let own_trials =
                each.filter(|(one, _)| one.setup.policy_name.as_str() == policy).flat_map(|(_, own_trials)| own_trials);
            words::policy_sentence(policy, &own_trials.collect::<Vec<_>>())
        };
        let sentences: Vec<String> = policies.into_iter().map(under_policy).collect();
        let text = format!("{}. {}.", stage.scenario.title.as_str(), sentences.join(". "));
        lines.extend(words::lines(&text, true, LINES + 1));
        self.print(&lines);
    }

    fn write_trials(
        &mut self,
        name: &str,
        (scenario, mode, planned): (&Scenario, Mode, &[Planned]),
        trials: Vec<Trial>,
        bare: bool,
    ) -> Result<(), Failure> {
        out::write_trials(self.dir, &format!("{name}.jsonl"), &trials)?;
        let mut run = batch::fold(scenario, mode, self.context.seed, planned, trials);
        if bare {
            run.expected.clear();
        }
        self.runs.push(run);
        Ok(())
    }

    fn print(&self, lines: &[String]) {
        if !self.context.json {
            lines.iter().for_each(out::show);
        }
    }

    /// Writes results and report, and prints how it ended.
    fn finish(mut self, live: usize, interrupted: bool) -> Result<Exit, Failure> {
        let seed = self.context.seed;
        // Each run has its own mode; the page never adds runs of one to runs of the other.
        let runs =
            RunsObject { schema_version: SCHEMA_VERSION, mode: Mode::Twin, seed, runs: std::mem::take(&mut self.runs) };
        out::write_result(self.dir, "result.json", "runs", &runs)?;
        let rows = std::mem::take(&mut self.rows);
        let mut object = TourObject::new(seed, rows, live, interrupted, self.dir.display().to_string());
        if !interrupted {
            let page = report::page::write_of_folder(self.context, self.dir, "A tour of holdsafe")?;
            object = object.with_report(shown_path(&page).display().to_string());
        }
        out::write_result(self.dir, "tour.json", "tour", &object)?;
        if self.context.json {
            out::print_json("tour", &object)?;
        }
        self.print(&object.closing());
        self.print(&[vec!["Next:".to_owned()], words::next_lines()].concat());
        Ok(if interrupted { Exit::Interrupted } else { self.exit })
    }
}

/// The last change of mode that a loss forced in the first trial, explained from its services' logs.
fn last_loss(planned: &Planned, trials: &[&Trial], seed: u64) -> Result<Option<Explanation>, Failure> {
    if trials.first().is_none_or(|trial| trial.transitions.is_empty()) {
        return Ok(None);
    }
    let (evidence, _) = engine::twin_verdict(&planned.variation.scenario, &planned.setup, seed)?;
    Ok(explain(&evidence.entries, &evidence.bounds).into_iter().rfind(Explanation::restricts))
}

/// A path from the working directory, where it lies below.
fn shown_path(path: &Path) -> PathBuf {
    let current = std::env::current_dir().ok();
    current.and_then(|current| path.strip_prefix(current).ok()).unwrap_or(path).to_owned()
}
