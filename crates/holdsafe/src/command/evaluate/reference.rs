//! The reference evaluation: every part 59 times in the twin, or on the real stacks in memory where it has no platform, and then
//! once live. Finished trials are kept, so that it resumes after any interruption. Its result is printed by `print_result`.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use evidence::trial::Trial;
use link::clock;
use parallel::progress::{Progress, Talk};
use results::mode::Mode;
use results::report::{Reference, ReferenceRow, scenario_line};
use runner::batch::Batch;
use runner::failure::{Exit, Failure};
use runner::plan::{self, Planned};
use runner::trial_store::{Shelf, TrialStore};
use runner::{Context, lines, out};

use super::Args;
use super::load::measure_jobs;
use super::parts::{Part, QUICK_TRIALS, TRIALS, plan_parts};
use super::remaining::{Remaining, expect_seconds};
use super::tell::{Judged, RESULT, finish};

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    // A smoke check is the same on every host and in every version.
    let context = &if args.quick { context.clone() } else { context.with_fresh_seed() };
    // Every file is read before anything runs.
    let parts = plan_parts(context, args)?;
    let dir = make_directory(context, args)?;
    let _lock = lines::lock(&dir, &context.stop)?;
    let all: Vec<Planned> =
        parts.iter().flat_map(|part| if args.apart { part.live.clone() } else { part.simulated.clone() }).collect();
    out::write_manifest(&dir, &out::Manifest::new(context, &all)?)?;

    if args.quick && has_whole_result(&dir) {
        let message = format!("{} has the result of a whole evaluation; name another --out for --quick", dir.display());
        return Err(Failure::new(Exit::Usage, message));
    }
    let (cores, kept) = (parallel::cores(), TrialStore::open(&dir)?);
    let live_jobs = measure_jobs(context, &parts, &kept, cores)?;
    let evaluation = Evaluation {
        context,
        dir: &dir,
        kept,
        n: if args.quick { QUICK_TRIALS } else { TRIALS },
        cores,
        live_jobs,
        remaining: Mutex::default(),
        progress: Progress::line(context.talk),
    };
    evaluation.count(&parts)?;
    evaluation.announce();
    let judged = evaluation.run_all(&parts).map_err(|failure| evaluation.explain_stop(failure))?;
    evaluation.progress.finish();
    finish(context, args, &dir, &judged)
}

/// The folder that was named, or that of this kind of evaluation.
fn make_directory(context: &Context, args: &Args) -> Result<PathBuf, Failure> {
    let runs = context.runs_folder()?;
    let domain = args.domain.as_deref().map(|name| plan::stem(Path::new(name)));
    let rendered = args.rendered.then(|| "rendered".to_owned());
    let more = [domain, rendered, args.apart.then(|| "apart".to_owned()), args.quick.then(|| "quick".to_owned())];
    let name: Vec<String> = ["reference".to_owned()].into_iter().chain(more.into_iter().flatten()).collect();
    let default = runs.join(name.join("-"));
    out::directory(&runs, Some(args.out.as_deref().unwrap_or(&default)), "reference")
}

/// True if the folder has a result with more simulated trials than a smoke check.
fn has_whole_result(dir: &Path) -> bool {
    let file = std::fs::read(dir.join(RESULT)).ok();
    let read = file.and_then(|bytes| serde_json::from_slice::<Reference>(&bytes).ok());
    read.is_some_and(|reference| reference.rows.iter().any(|row| row.summary.n as u64 > QUICK_TRIALS))
}

struct Evaluation<'a> {
    context: &'a Context,
    dir: &'a Path,
    kept: TrialStore,
    /// Simulated trials of each variation.
    n: u64,
    cores: usize,
    live_jobs: usize,
    remaining: Mutex<Remaining>,
    progress: Progress,
}

impl Evaluation<'_> {
    fn remaining(&self) -> MutexGuard<'_, Remaining> {
        self.remaining.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn batch<'b>(&self, mode: Mode, planned: &'b [Planned], out: &'b Path) -> Batch<'b> {
        let n = if mode == Mode::Live { 1 } else { self.n };
        Batch { label: "evaluate", mode, planned, n, seed: self.context.seed, jobs: self.live_jobs, out: Some(out) }
    }

    fn open_shelves(&self, mode: Mode, planned: &[Planned]) -> Result<Vec<Shelf>, Failure> {
        planned.iter().map(|planned| self.kept.shelf(mode, planned)).collect()
    }

    fn expect_seconds(&self, mode: Mode, part: &Part) -> f64 {
        expect_seconds(mode, &part.scenario, self.cores, self.live_jobs)
    }

    /// Counts all trials and those that are missing.
    fn count(&self, parts: &[Part]) -> Result<(), Failure> {
        let mut unrecorded = 0;
        for part in parts {
            let recordings = part.recordings(self.dir);
            let live = (Mode::Live, &part.live, self.dir);
            for (mode, planned, out) in [(part.mode(), &part.simulated, recordings.as_path()), live] {
                let (batch, shelves) = (self.batch(mode, planned, out), self.open_shelves(mode, planned)?);
                let (all, each_s) = (planned.len() * batch.n as usize, self.expect_seconds(mode, part));
                self.remaining().share(mode).add(all, batch.missing(&shelves), each_s);
                unrecorded += batch.unrecorded(&shelves);
            }
        }
        if unrecorded > 0 {
            let path = self.dir.join("kept");
            link::note!(
                "the recordings of {unrecorded} finished live runs are gone, or are not those of their trials: the results stand, and no detail \
                 can be looked up in them; \
                 without {} all runs again",
                path.display()
            );
        }
        Ok(())
    }

    /// Says before anything runs how long it will take.
    fn announce(&self) {
        if self.context.talk != Talk::Normal || self.context.stop.is_requested() {
            return;
        }
        let (remaining, dir) = (self.remaining(), self.dir.display());
        if remaining.simulated.missing() + remaining.live.missing() == 0 {
            link::note!("evaluate: {}: all were there already, in {dir}", remaining.describe_all());
            return;
        }
        let left_over = match remaining.simulated.finished + remaining.live.finished {
            0 => String::new(),
            _ => format!(", of which {} are there already", remaining.describe_finished()),
        };
        let (time, cores) = (remaining.describe_time(), self.cores);
        link::note!("evaluate: {}{left_over}; {time} on {cores} cores", remaining.describe_all());
        link::note!("seeds from {} on; --seed names others", self.context.seed);
        link::note!("Ctrl-C is safe: what is finished is kept in {dir}, and the same command goes on from there");
    }

    /// Runs the missing trials, and judges all: simulated trials scenario by scenario, and then the live runs.
    fn run_all(&self, parts: &[Part]) -> Result<Vec<Judged>, Failure> {
        self.remaining().simulated.begin(clock::trace_us());
        let mut judged: Vec<Vec<Judged>> = parts.iter().map(|_| Vec::new()).collect();
        for scenario in group_by_scenario(parts) {
            let (mut line, mut has_run) = (Vec::new(), false);
            for (place, part) in scenario {
                has_run |= self.simulate(part, &mut judged[place])?;
                line.extend(judged[place].iter().map(|judged| judged.row.clone()));
            }
            if has_run {
                self.print_line(&line);
            }
        }
        let mut all: Vec<Judged> = judged.into_iter().flatten().collect();
        self.remaining().live.begin(clock::trace_us());
        all.extend(self.run_live(parts)?);
        Ok(all)
    }

    /// Adds the rows of a part's simulated trials; true if any of these had to run.
    fn simulate(&self, part: &Part, rows: &mut Vec<Judged>) -> Result<bool, Failure> {
        let (mode, out) = (part.mode(), part.recordings(self.dir));
        let (batch, shelves) = (self.batch(mode, &part.simulated, &out), self.open_shelves(mode, &part.simulated)?);
        let (has_run, each_s) = (batch.missing(&shelves) > 0, self.expect_seconds(mode, part));
        let count = |_, trial: &Trial| self.count_one(mode, each_s, trial);
        let trials = batch.run_kept_each(&shelves, batch.threads(), count, &self.context.stop)?;
        self.write_trials(part, mode, &trials)?;
        // Trials come by variation and then by seed.
        let each = part.simulated.iter().zip(trials.chunks(self.n as usize));
        rows.extend(each.map(|(planned, trials)| Judged::new(part, planned, mode, trials)));
        Ok(has_run)
    }

    /// Runs all live runs, several side by side.
    fn run_live(&self, parts: &[Part]) -> Result<Vec<Judged>, Failure> {
        let each = parts.iter().flat_map(|part| part.live.iter().map(move |planned| (part, planned)));
        let chosen: Vec<(&Part, &Planned)> = each.collect();
        let live: Vec<Planned> = chosen.iter().map(|(_, planned)| Planned::clone(planned)).collect();
        let (batch, shelves) = (self.batch(Mode::Live, &live, self.dir), self.open_shelves(Mode::Live, &live)?);
        let count = |number: u64, trial: &Trial| {
            let Some((part, planned)) = chosen.get(number as usize) else { return };
            self.count_one(Mode::Live, self.expect_seconds(Mode::Live, part), trial);
            let row = Judged::new(part, planned, Mode::Live, std::slice::from_ref(trial)).row;
            // The others have the line of their simulated trials.
            if part.simulated.is_empty() || !row.is_as_expected() {
                self.print_line(&[row]);
            }
        };
        let trials = batch.run_kept_each(&shelves, batch.threads(), count, &self.context.stop)?;
        let mut left = trials.as_slice();
        for part in parts.iter().filter(|part| !part.live.is_empty()) {
            let own_trials = left.split_off(..part.live.len()).unwrap_or_default();
            self.write_trials(part, Mode::Live, own_trials)?;
        }
        let each = chosen.iter().zip(trials.chunks(1));
        Ok(each.map(|((part, planned), trial)| Judged::new(part, planned, Mode::Live, trial)).collect())
    }

    fn write_trials(&self, part: &Part, mode: Mode, trials: &[Trial]) -> Result<(), Failure> {
        out::write_trials(self.dir, &format!("{}.{}.jsonl", part.label(), mode.name()), trials)
    }

    /// Counts a trial that has run, and shows the remaining time.
    fn count_one(&self, mode: Mode, expected_s: f64, trial: &Trial) {
        self.progress.count(trial.outcome as usize, trial.outcome.name());
        let mut remaining = self.remaining();
        remaining.share(mode).finish(expected_s, clock::trace_us());
        let show = || format!("evaluate: {}, {} left", remaining.describe_finished(), remaining.describe_time());
        self.progress.show(show);
    }

    /// Prints the line of a scenario's rows, all of one mode.
    fn print_line(&self, rows: &[ReferenceRow]) {
        let rows: Vec<&ReferenceRow> = rows.iter().collect();
        if let Some(first) = rows.first().filter(|_| !self.context.json) {
            out::show(scenario_line(&first.scenario, &rows));
        }
    }

    /// The message after Ctrl-C; another failure stays as it is.
    fn explain_stop(&self, failure: Failure) -> Failure {
        self.progress.finish();
        if failure.exit() != Exit::Interrupted {
            return failure;
        }
        let (finished, dir) = (self.remaining().describe_finished(), self.dir.display());
        let message = format!("stopped; {finished} are finished and kept in {dir}, and none of them runs again");
        let resume = format!("to go on, the same command again: {}", runner::own_line());
        Failure::new(Exit::Interrupted, format!("{message}\n{resume}"))
    }
}

/// The parts with simulated trials, each with its place among all, by scenario in the order of their first.
fn group_by_scenario(parts: &[Part]) -> Vec<Vec<(usize, &Part)>> {
    let mut groups: Vec<Vec<(usize, &Part)>> = Vec::new();
    for (place, part) in parts.iter().enumerate().filter(|(_, part)| !part.simulated.is_empty()) {
        let same = |group: &&mut Vec<(usize, &Part)>| group.iter().any(|(_, other)| other.name() == part.name());
        match groups.iter_mut().find(same) {
            Some(group) => group.push((place, part)),
            None => groups.push(vec![(place, part)]),
        }
    }
    groups
}
