//! Runs many trials: twin trials on all cores, live trials in the number that the user names at a time.
//!
//! The order of the results is the order of the plan, independent of threads; each trial's CPU time is measured here.

use std::path::{Path, PathBuf};

use evidence::FateName;
use evidence::trial::{Outcome, Outcomes, Trial};
use nix::sys::resource::{UsageWho, getrusage};
use nix::sys::time::TimeVal;
use parallel::progress::{Progress, Stop, Talk};
use recording::RunFolder;
use recording::anchors::read_anchors;
use results::mode::Mode;
use results::report::{AcceptedRate, RunObject, Summary};
use scenario::{Scenario, Setup};

use super::ended::Ended;
use super::engine;
use super::failure::{Exit, Failure};
use super::out;
use super::plan::{self, Planned};
use super::retry::retried;
use super::trial_store::Shelf;
use super::unfinished::Unfinished;
use crate::error::EngineError;

/// Live trials at a time, at most: each is about a dozen processes.
pub const MAX_JOBS: usize = 32;

/// Stalls of earlier attempts that a trial names, at most.
const MOST_SPOILT: usize = 100;

/// One trial to run.
struct Job<'a> {
    planned: &'a Planned,
    seed: u64,
    keep: bool,
}

/// One trial of a batch that keeps its trials.
struct Place<'a> {
    /// Number in the order of the batch.
    number: u64,
    job: Job<'a>,
    shelf: &'a Shelf,
}

/// A batch of trials, `n` of each variation.
pub struct Batch<'a> {
    /// Name in the progress display.
    pub label: &'a str,
    /// Mode of its trials.
    pub mode: Mode,
    /// The variations.
    pub planned: &'a [Planned],
    /// Trials of each variation.
    pub n: u64,
    /// Base seed; trial i has seed + i.
    pub seed: u64,
    /// Live trials at a time; each has its own folders, names, keys and janitor.
    pub jobs: usize,
    /// Folder of recordings: of each live trial, and of the first twin trial of each variation.
    pub out: Option<&'a Path>,
}

impl Batch<'_> {
    /// Every trial, by variation and then by seed. The first failure ends the batch.
    ///
    /// # Errors
    /// When a folder of a trial that is to be kept is in use, before anything runs.
    pub fn run(&self, talk: Talk, stop: &Stop) -> Result<Vec<Trial>, Failure> {
        let progress = Progress::new(self.label, self.planned.len() * self.n as usize, talk);
        let trials = self.run_within(&progress, stop);
        progress.finish();
        trials
    }

    /// Runs the batch as a part of longer work with this progress.
    ///
    /// # Errors
    /// As [`Batch::run`].
    pub fn run_within(&self, progress: &Progress, stop: &Stop) -> Result<Vec<Trial>, Failure> {
        self.check_free()?;
        let jobs: Vec<Job<'_>> = self.planned.iter().flat_map(|planned| self.jobs(planned)).collect();
        on_threads(self.threads(), &jobs, stop, |job| {
            let trial = self.run_one(job, stop)?;
            count(progress, &trial);
            Ok(trial)
        })
    }

    /// Runs the batch on `threads`, and puts each finished trial on its variation's shelf. A trial that is there already does not run
    /// again.
    pub fn run_kept(
        &self,
        shelves: &[Shelf],
        threads: usize,
        progress: &Progress,
        stop: &Stop,
    ) -> Result<Vec<Trial>, Failure> {
        self.run_kept_each(shelves, threads, |_, trial| count(progress, trial), stop)
    }

    /// Runs the batch as [`Batch::run_kept`] does; `done` gets each trial that has run, with its number in this batch.
    pub fn run_kept_each(
        &self,
        shelves: &[Shelf],
        threads: usize,
        done: impl Fn(u64, &Trial) + Sync,
        stop: &Stop,
    ) -> Result<Vec<Trial>, Failure> {
        let found: Vec<Option<&Trial>> = self.shelved(shelves).map(|place| self.finished(&place)).collect();
        let missing = self.shelved(shelves).zip(&found).filter(|(_, found)| found.is_none()).map(|(place, _)| place);
        let mut ran = self.run_missing(&missing.collect::<Vec<_>>(), threads, done, stop)?.into_iter();
        // New results come in the order of the plan, so they fill the gaps in turn.
        let trials = found.into_iter().map(|found| match found {
            Some(trial) => Ok(trial.clone()),
            None => ran.next().ok_or_else(|| Failure::internal("fewer trials than planned")),
        });
        trials.collect()
    }

    /// Runs and keeps the trials that are not kept yet and whose number in this batch `holds`; gives the new trials, in the order of the
    /// plan.
    pub fn keep(
        &self,
        shelves: &[Shelf],
        holds: impl Fn(u64) -> bool,
        threads: usize,
        progress: &Progress,
        stop: &Stop,
    ) -> Result<Vec<Trial>, Failure> {
        let held = self.shelved(shelves).filter(|place| holds(place.number) && self.finished(place).is_none());
        self.run_missing(&held.collect::<Vec<_>>(), threads, |_, trial| count(progress, trial), stop)
    }

    /// Number of the trials that are not finished.
    pub fn missing(&self, shelves: &[Shelf]) -> usize {
        self.shelved(shelves).filter(|place| self.finished(place).is_none()).count()
    }

    /// Number of the finished live trials whose recording is missing or another trial's. Their results count, without details to look up.
    pub fn unrecorded(&self, shelves: &[Shelf]) -> usize {
        let is_unrecorded =
            |place: &Place<'_>| self.finished(place).is_some_and(|trial| !self.is_recorded(place, trial));
        self.shelved(shelves).filter(is_unrecorded).count()
    }

    fn run_missing(
        &self,
        missing: &[Place<'_>],
        threads: usize,
        done: impl Fn(u64, &Trial) + Sync,
        stop: &Stop,
    ) -> Result<Vec<Trial>, Failure> {
        on_threads(threads, missing, stop, |place| {
            let trial = self.run_and_keep(place, stop)?;
            done(place.number, &trial);
            Ok(trial)
        })
    }

    /// The finished trial of a place. A simulated trial without its recording is not finished: it runs again, with the same result.
    /// A live trial would have another result, so it counts without its recording.
    fn finished<'a>(&self, place: &Place<'a>) -> Option<&'a Trial> {
        let trial = place.shelf.get(place.job.seed)?;
        (self.mode == Mode::Live || self.is_recorded(place, trial)).then_some(trial)
    }

    /// True if the recording of a trial is in its folder, or none is to be kept.
    fn is_recorded(&self, place: &Place<'_>, trial: &Trial) -> bool {
        let Some(folder) = self.folder(&place.job) else { return true };
        read_anchors(&RunFolder::new(folder)).is_ok_and(|(_, digest)| trial.held.as_ref() == Some(&digest))
    }

    /// Every trial, each with the shelf of its variation.
    fn shelved<'a>(&'a self, shelves: &'a [Shelf]) -> impl Iterator<Item = Place<'a>> {
        let each = self.planned.iter().zip(shelves);
        let all = each.flat_map(|(planned, shelf)| self.jobs(planned).map(move |job| (job, shelf)));
        all.zip(0..).map(|((job, shelf), number)| Place { number, job, shelf })
    }

    /// Trials at a time, unless the user asks for another number.
    pub fn threads(&self) -> usize {
        if self.mode == Mode::Live { self.jobs } else { parallel::cores() }
    }

    fn jobs<'a>(&self, planned: &'a Planned) -> impl Iterator<Item = Job<'a>> + use<'a> {
        let (seed, live) = (self.seed, self.mode == Mode::Live);
        (0..self.n).map(move |i| Job { planned, seed: seed.wrapping_add(i), keep: live || i == 0 })
    }

    /// Checks that no kept trial would overwrite another.
    ///
    /// # Errors
    ///
    /// When one would.
    pub fn check_free(&self) -> Result<(), Failure> {
        let mut jobs = self.planned.iter().flat_map(|planned| self.jobs(planned));
        jobs.try_for_each(|job| self.folder(&job).map_or(Ok(()), |folder| out::check_unused(&folder)))
    }

    /// Folder of the recording that was kept of a trial of this batch.
    pub fn recording(&self, trial: &Trial) -> Option<PathBuf> {
        trial.held.as_ref()?;
        let planned = self.planned.iter().find(|planned| planned.variation.cell == trial.cell)?;
        self.folder(&Job { planned, seed: trial.seed, keep: true })
    }

    /// Folder of a trial's recording, if it is kept. The stacks leave none.
    fn folder(&self, job: &Job<'_>) -> Option<PathBuf> {
        let variation = &job.planned.variation;
        let mut folder = self
            .out
            .filter(|_| job.keep && self.mode != Mode::Stack)?
            .join(self.mode.name())
            .join(variation.scenario.name.as_str());
        if let Some(cell) = &variation.cell {
            folder.push(cell.replace('/', "."));
        }
        folder.push(job.seed.to_string());
        Some(folder)
    }

    fn run_one(&self, job: &Job<'_>, stop: &Stop) -> Result<Trial, Failure> {
        let folder = self.folder(job);
        if let Some(folder) = &folder {
            out::check_unused(folder)?;
            std::fs::create_dir_all(folder)?;
        }
        self.run_in(job, folder, stop)
    }

    /// Runs a trial and puts it on its shelf. Its recording is moved to its place first, so that a trial on the shelf has one.
    fn run_and_keep(&self, Place { job, shelf, .. }: &Place<'_>, stop: &Stop) -> Result<Trial, Failure> {
        let unfinished = self.folder(job).map(Unfinished::begin).transpose()?;
        let mut trial = self.run_in(job, unfinished.as_ref().map(|recording| recording.folder().to_owned()), stop)?;
        trial.host_spoilt_ms.splice(0..0, shelf.spoilt_ms(job.seed).iter().copied());
        trial.host_spoilt_ms.truncate(MOST_SPOILT);
        match (unfinished, trial.host_stall_ms) {
            (Some(recording), None) => recording.finish()?,
            (Some(recording), Some(_)) => recording.put_aside()?,
            (None, _) => {}
        }
        shelf.put(&trial)?;
        Ok(trial)
    }

    /// Runs a trial; its recording goes to `run_dir`.
    fn run_in(&self, job: &Job<'_>, run_dir: Option<PathBuf>, stop: &Stop) -> Result<Trial, Failure> {
        let recorded = run_dir.or_else(|| job.planned.setup.run_dir.clone());
        let setup = Setup { run_dir: recorded, ..job.planned.setup.clone() };
        let mut trial = trial(self.mode, job.planned, &setup, job.seed, stop)?;
        // The CPU time of ended children is known for all together only, so a live trial has an equal share of the time
        // used while it ran.
        if self.mode == Mode::Live {
            trial.cpu_seconds /= self.jobs.max(1) as f64;
        }
        Ok(trial)
    }
}

/// Shows a finished trial: a step, and its class.
pub fn count(progress: &Progress, trial: &Trial) {
    progress.step();
    progress.count(trial.outcome as usize, trial.outcome.name());
}

/// Runs one trial of a variation with `setup`. Its CPU time includes attempts that the host spoilt.
pub fn trial(mode: Mode, planned: &Planned, setup: &Setup, seed: u64, stop: &Stop) -> Result<Trial, Failure> {
    let variation = &planned.variation;
    let before = cpu_seconds(mode);
    let mut trial = retried(setup, seed, || {
        let done = if planned.sabotage {
            engine::run_sabotaged(&variation.scenario, setup, seed)
        } else {
            engine::trial(mode, &variation.scenario, setup, seed, stop)
        };
        done.map_err(|e| Failure::from(e).reproduced_by(reproduce(mode, planned, seed)))
    })?;
    trial.cpu_seconds = cpu_seconds(mode) - before;
    trial.cell = variation.cell.clone();
    Ok(trial)
}

/// Value of `--jobs` outside its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a number from 1 to {MAX_JOBS} is expected")]
pub struct JobsError;

/// Parses `--jobs`.
pub fn jobs(text: &str) -> Result<usize, JobsError> {
    match text.parse() {
        Ok(jobs @ 1..=MAX_JOBS) => Ok(jobs),
        Ok(_) | Err(_) => Err(JobsError),
    }
}

/// The line that runs one trial again.
pub fn reproduce(mode: Mode, planned: &Planned, seed: u64) -> String {
    if let Some(command) = &planned.command {
        return format!("{command} --seed {seed}");
    }
    let name = planned.variation.scenario.name.as_str();
    let live = if mode == Mode::Live { " --live" } else { "" };
    format!("holdsafe run {name} --trials 1 --seed {seed}{live}{}", planned.options)
}

/// The injections of an INVALID trial without proof of arrival.
fn unproven(trial: &Trial) -> impl Iterator<Item = String> + '_ {
    let open =
        trial.injections.iter().filter(|row| trial.outcome == Outcome::Invalid && row.fate == FateName::NotProven);
    open.map(|row| format!("not proven: {}, from {} ms at the earliest", row.what, row.from_ms))
}

/// Reasons for a trial's class in brackets, after a space; empty where it has none.
pub fn reasons(trial: &Trial) -> String {
    let reasons: Vec<String> = trial.findings.iter().cloned().chain(unproven(trial)).collect();
    if reasons.is_empty() { String::new() } else { format!(" ({})", reasons.join("; ")) }
}

/// True if the oracle believed the receipt of an actor that only claimed to act.
fn is_believed(sabotage: bool, receipt: bool) -> bool {
    sabotage && receipt
}

/// The variations, each with the classes that it accepts below a rate.
fn rates<'p>(planned: &'p [Planned], trials: &[Trial]) -> Vec<(&'p Planned, Vec<AcceptedRate>)> {
    planned.iter().map(|planned| (planned, accepted(planned, trials))).collect()
}

/// The trials that were not expected, each with its variation.
pub fn odd<'t, 'p>(planned: &'p [Planned], trials: &'t [Trial]) -> Vec<(&'t Trial, &'p Planned)> {
    let rates = rates(planned, trials);
    let variation_of = |trial: &Trial| rates.iter().find(|(p, _)| p.variation.cell == trial.cell);
    let unexpected = |trial: &Trial, planned: &Planned, rates: &[AcceptedRate]| {
        let unexpected = trial.outcome.is_unexpected(&planned.variation.scenario.expected);
        (unexpected && !AcceptedRate::covers(rates, trial.outcome)) || is_believed(planned.sabotage, trial.receipt)
    };
    let each = trials.iter().filter_map(|trial| Some((trial, variation_of(trial)?)));
    each.filter(|(trial, (planned, rates))| unexpected(trial, planned, rates))
        .map(|(trial, (planned, _))| (trial, *planned))
        .collect()
}

/// How the trials of each variation ended.
pub fn ended(planned: &[Planned], trials: &[Trial]) -> Vec<Ended> {
    let odd = odd(planned, trials);
    let of = |planned: &Planned| {
        let cell = &planned.variation.cell;
        let mut outcomes = Outcomes::new();
        let own_trials = trials.iter().filter(|trial| trial.cell == *cell);
        own_trials.for_each(|trial| *outcomes.entry(trial.outcome).or_default() += 1);
        let unexpected = odd.iter().filter(|(trial, _)| trial.cell == *cell).count() as u64;
        let is_stated = !planned.variation.scenario.expected.is_empty() || unexpected > 0;
        Ended { outcomes, unexpected: is_stated.then_some(unexpected) }
    };
    planned.iter().map(of).collect()
}

/// Prints every unexpected trial on stderr, with the line that reproduces it, and gives the exit code.
pub fn judge(mode: Mode, planned: &[Planned], trials: &[Trial]) -> Exit {
    const MAX_PRINTED: usize = 10;
    let (rates, odd) = (rates(planned, trials), odd(planned, trials));
    rates.iter().flat_map(|(_, rates)| rates).filter_map(AcceptedRate::line).for_each(out::note);
    for (trial, planned) in odd.iter().take(MAX_PRINTED) {
        let reasons = reasons(trial);
        let stated: Vec<&str> = planned.variation.scenario.expected.iter().map(|o| o.name()).collect();
        // A waived check, or a guest without guards: nothing is stated, and harm is told all the same.
        let expected = if stated.is_empty() {
            "no class is stated".to_owned()
        } else {
            format!("expected {}", stated.join(" or "))
        };
        out::note(format_args!("{}{reasons}, {expected}", trial.outcome.name()));
        out::note(format_args!("reproduce: {}", reproduce(mode, planned, trial.seed)));
    }
    if odd.len() > MAX_PRINTED {
        out::note(format_args!("and {} more", odd.len() - MAX_PRINTED));
    }
    if trials.is_empty() {
        Exit::NoEvidence
    } else if odd
        .iter()
        .any(|(trial, planned)| trial.outcome != Outcome::Invalid || is_believed(planned.sabotage, trial.receipt))
    {
        Exit::Unexpected
    } else if odd.is_empty() {
        Exit::Fine
    } else {
        Exit::NoEvidence
    }
}

/// The classes that a variation accepts below a rate, each with its rate among the trials.
fn accepted(planned: &Planned, trials: &[Trial]) -> Vec<AcceptedRate> {
    let trials: Vec<&Trial> = trials.iter().filter(|trial| trial.cell == planned.variation.cell).collect();
    AcceptedRate::from_outcomes(&planned.variation.scenario, &Summary::from_trials(&trials).outcomes)
}

/// The graver of two exits of a command that goes on after the first.
pub fn graver(a: Exit, b: Exit) -> Exit {
    let rank = |exit: Exit| match exit {
        Exit::Fine => 0,
        Exit::NoEvidence => 1,
        Exit::Unexpected => 2,
        Exit::Environment => 3,
        Exit::Usage => 4,
        Exit::Internal => 5,
        Exit::Interrupted => 6,
    };
    if rank(b) > rank(a) { b } else { a }
}

/// Calls `one` for every number below `count`, on `threads`. The first failure ends it; the first in order of several is returned.
pub fn each(
    threads: usize,
    count: usize,
    stop: &Stop,
    one: impl Fn(usize) -> Result<(), Failure> + Sync,
) -> Result<(), Failure> {
    parallel::each(threads, count, |i| if stop.is_requested() { Err(EngineError::Stopped.into()) } else { one(i) })
}

fn on_threads<J: Sync>(
    threads: usize,
    jobs: &[J],
    stop: &Stop,
    one: impl Fn(&J) -> Result<Trial, Failure> + Sync,
) -> Result<Vec<Trial>, Failure> {
    parallel::map(threads, jobs, |job| {
        if stop.is_requested() {
            return Err(EngineError::Stopped.into());
        }
        one(job)
    })
}

/// CPU seconds so far: of this thread for the twin and the stacks, of us and our ended children for a live run.
pub fn cpu_seconds(mode: Mode) -> f64 {
    let seconds_of = |processes: UsageWho| {
        let seconds = |t: TimeVal| t.tv_sec() as f64 + t.tv_usec() as f64 * 1e-6;
        getrusage(processes).map_or(0.0, |u| seconds(u.user_time()) + seconds(u.system_time()))
    };
    match mode {
        Mode::Twin | Mode::Stack => link::clock::thread_cpu_us() as f64 * 1e-6,
        Mode::Live => seconds_of(UsageWho::RUSAGE_SELF) + seconds_of(UsageWho::RUSAGE_CHILDREN),
    }
}

/// Folds the trials of one scenario into its object.
pub fn fold(scenario: &Scenario, mode: Mode, seed: u64, planned: &[Planned], trials: Vec<Trial>) -> RunObject {
    let cells: Vec<_> = planned
        .iter()
        .filter_map(|p| Some((p.variation.cell.clone()?, p.variation.scenario.expected.to_vec())))
        .collect();
    let mut run = RunObject::new(scenario.name.as_str(), mode, seed, trials, &cells);
    run.watermark = planned.iter().find_map(|p| p.setup.watermark());
    run.detector = plan::detector(planned);
    if cells.is_empty() {
        run.expected = planned.iter().flat_map(|p| p.variation.scenario.expected.to_vec()).collect();
    }
    run
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requested_stop_begins_no_more_work() {
        let stop = Stop::default();
        stop.ask();
        assert_eq!(each(1, 1, &stop, |_| Ok(())).expect_err("stopped").exit(), Exit::Interrupted);
    }

    #[test]
    fn only_a_believed_sabotage_receipt_is_unexpected() {
        assert!(is_believed(true, true));
        assert!(!is_believed(true, false) && !is_believed(false, true));
    }

    #[test]
    fn an_unexpected_outcome_outweighs_missing_evidence() {
        assert_eq!(graver(Exit::NoEvidence, Exit::Unexpected), Exit::Unexpected);
        assert_eq!(graver(Exit::Interrupted, Exit::Fine), Exit::Interrupted);
    }
}
