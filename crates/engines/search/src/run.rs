//! The search run: rounds of sequences, each drawn before any of it is tried, so that findings do not depend on
//! threads.

use std::collections::BTreeMap;

use evidence::trial::Outcomes;
use oracle::{AT_LIMIT, Limit};
use parallel::progress::{Progress, Stop};
use scenario::AttackSpace;
use serde::{Deserialize, Serialize};

use super::coverage::Coverage;
use super::draw::{Drawer, Strategy};
use super::error::SearchError;
use super::moments::Moments;
use super::propose::{Lore, Proposer, Source};
use super::sequence::AttackSequence;
use super::tried::{Cause, Counted, SearchConfig, Test, Tried};

/// Sequences drawn, and tried, at a time.
pub const ROUND: u64 = 16;

/// Parameters of a search run, and its length.
#[derive(Clone, Copy, Debug)]
pub struct RunConfig {
    /// Strategy for drawing sequences.
    pub strategy: Strategy,
    /// Seed of the drawing; the trials have their own.
    pub seed: u64,
    /// Most trials.
    pub budget: u64,
    /// True to end with the first finding.
    pub first: bool,
}

/// A finding as it was found.
#[derive(Clone, Debug)]
pub struct FoundSequence {
    /// Its sequence.
    pub sequence: AttackSequence,
    /// Index of the trial, from 1.
    pub trial: u64,
    /// CPU time of the search until then, seconds.
    pub cpu_seconds: f64,
}

/// Result of a search run.
#[derive(Clone, Debug, Default)]
pub struct RunResult {
    /// Trials made.
    pub trials: u64,
    /// CPU time of all of them, seconds; with that of the run without a sequence where the strategy reads its moments.
    pub cpu_seconds: f64,
    /// Count of each class.
    pub outcomes: Outcomes,
    /// Points and steps of coverage seen.
    pub covered: Coverage,
    /// Nearest approach by arrived sequences to each limit with a way to it, in millionths, and the first that did.
    pub nearest: BTreeMap<Limit, (u32, AttackSequence)>,
    /// First finding of each cause.
    pub found: BTreeMap<Cause, FoundSequence>,
}

/// A search run as a row of a report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SearchRow {
    /// Source of its sequences.
    pub strategy: Source,
    /// Trials made.
    pub trials: u64,
    /// CPU time of all of them, seconds.
    pub cpu_seconds: f64,
    /// Count of each class.
    #[serde(serialize_with = "evidence::trial::by_name")]
    pub outcomes: Outcomes,
    /// Points and steps of coverage seen.
    pub covered: usize,
    /// Nearest approach to each limit with a graded way to it.
    pub nearest: Vec<NearestRow>,
}

/// The nearest that any sequence came to a limit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NearestRow {
    /// The limit.
    pub limit: Limit,
    /// Approach in thousandths of the way to the limit that the platform's bounds state; the oracle allows for a little
    /// more.
    pub thousandths: u32,
    /// The sequence.
    #[serde(rename = "word")]
    pub sequence: String,
}

impl SearchConfig {
    /// Searches for findings among the sequences of `own_proposer`, or without one among those of the strategy of
    /// `run`.
    ///
    /// # Errors
    /// A sequence that does not fit the scenario, the user's request to stop, or an `own_proposer` that cannot
    /// continue.
    pub fn search(
        &self,
        run: RunConfig,
        own_proposer: Option<&mut dyn Proposer>,
        test: Test<'_>,
        threads: usize,
        progress: &Progress,
        stop: &Stop,
    ) -> Result<RunResult, SearchError> {
        let (mut drawer, mut result) = self.begin(run)?;
        let proposer: &mut dyn Proposer = match own_proposer {
            Some(own) => own,
            None => &mut drawer,
        };
        while result.trials < run.budget {
            let round = proposer.propose(ROUND.min(run.budget - result.trials) as usize)?;
            // A search run that ends with the first finding tries as little as possible behind it.
            let at_once = if run.first { threads.max(1) } else { round.len() };
            for sequences in round.chunks(at_once) {
                for one in self.round(sequences, threads, progress, stop)? {
                    let counted = Counted::new(&one, test);
                    let new = result.take(&one.sequence, &counted);
                    proposer.take(Lore { tried: &one, counted: &counted, new });
                    if run.first && !result.found.is_empty() {
                        return Ok(result);
                    }
                }
            }
        }
        Ok(result)
    }
}

impl SearchConfig {
    /// Every sequence of a run by a strategy that does not learn, and the result before the first; `None` for one that learns, whose
    /// sequences depend on results.
    ///
    /// # Errors
    /// A scenario that cannot be run.
    pub fn listed(&self, run: RunConfig) -> Result<Option<(Vec<AttackSequence>, RunResult)>, SearchError> {
        if run.strategy.learns() {
            return Ok(None);
        }
        let (mut drawer, result) = self.begin(run)?;
        Ok(Some(((0..run.budget).map(|_| drawer.sequence()).collect(), result)))
    }

    fn begin(&self, run: RunConfig) -> Result<(Drawer<'_>, RunResult), SearchError> {
        let nominal = self.try_sequence(&AttackSequence::default())?;
        let moments = Moments::from_run(&nominal, &self.space, &self.setup.bounds);
        let approaches = &nominal.approaches;
        let drawer = Drawer::new(&self.space, &self.setup.bounds, run.strategy, run.seed, moments, approaches);
        // Charged only to strategies that read the run without a sequence: uniform drawing needs none.
        let cpu_seconds = if run.strategy.reads_moments() { nominal.trial.cpu_seconds } else { 0.0 };
        Ok((drawer, RunResult { covered: nominal.coverage, cpu_seconds, ..RunResult::default() }))
    }

    /// Tries every one of `sequences`, at most a few [`ROUND`]s, since all their coverage is in memory.
    ///
    /// # Errors
    /// As [`SearchConfig::search`].
    pub fn try_each(
        &self,
        sequences: &[AttackSequence],
        test: Test<'_>,
        threads: usize,
        progress: &Progress,
        stop: &Stop,
    ) -> Result<Vec<Counted>, SearchError> {
        let tried = self.round(sequences, threads, progress, stop)?;
        Ok(tried.iter().map(|one| Counted::new(one, test)).collect())
    }

    fn round(
        &self,
        sequences: &[AttackSequence],
        threads: usize,
        progress: &Progress,
        stop: &Stop,
    ) -> Result<Vec<Tried>, SearchError> {
        parallel::map(threads, sequences, |sequence| {
            if stop.is_requested() {
                return Err(SearchError::Stopped);
            }
            let tried = self.try_sequence(sequence);
            tried.iter().for_each(|tried| progress.count(tried.trial.outcome as usize, tried.trial.outcome.name()));
            progress.step();
            tried
        })
    }
}

impl RunResult {
    /// Counts a trial; says whether it showed something new.
    pub fn take(&mut self, sequence: &AttackSequence, counted: &Counted) -> bool {
        self.trials += 1;
        self.cpu_seconds += counted.cpu_seconds;
        *self.outcomes.entry(counted.outcome).or_default() += 1;
        let before = self.covered.len();
        self.covered.extend(&counted.covered);
        let new = self.covered.len() > before;
        for (limit, way) in &counted.approaches {
            if self.nearest.get(limit).is_none_or(|(before, _)| way > before) {
                self.nearest.insert(*limit, (*way, sequence.clone()));
            }
        }
        if let Some(cause) = &counted.cause {
            let (trial, cpu_seconds) = (self.trials, self.cpu_seconds);
            self.found.entry(cause.clone()).or_insert_with(|| FoundSequence {
                sequence: sequence.clone(),
                trial,
                cpu_seconds,
            });
        }
        new
    }

    /// As a row of a report.
    pub fn row(&self, space: &AttackSpace, strategy: Source) -> SearchRow {
        let nearest = self.nearest.iter().map(|(limit, (millionths, sequence))| NearestRow {
            limit: *limit,
            thousandths: *millionths / (AT_LIMIT / 1_000),
            sequence: sequence.describe(space),
        });
        SearchRow {
            strategy,
            trials: self.trials,
            cpu_seconds: self.cpu_seconds,
            outcomes: self.outcomes.clone(),
            covered: self.covered.len(),
            nearest: nearest.collect(),
        }
    }
}
