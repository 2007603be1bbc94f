//! Probability of a rare event in a run: multilevel splitting over the twin.
//!
//! Terms: a *level* is the progress of a run to the event, a number that rises towards it; a *stage* tries to get from one level
//! to the next, from snapshots taken where the one before first got there; a *repetition* is all stages once, and independent of
//! every other. `event` is the list of events and a twin's distance from each, `estimate` the splitting over any process that
//! can be copied, `stats::mean` the joint result of repetitions. Judging the event is not this crate's business.
//!
//! The method rests on branches: `twin::Twin::branch`.

mod estimate;
mod event;

pub use estimate::{MAX_LEVELS, Plan, Process, Repetition, StageResult, split};
pub use event::{Event, LevelsError};

use crate::error::SearchError;
use parallel::progress::{Progress, Stop};
use scenario::{Scenario, Setup};
use twin::Twin;
use twin::queue::Micros;
use twin::trial::start;

/// The question: the probability that a run of this scenario reaches that event.
#[derive(Clone, Debug)]
pub struct Question {
    /// The scenario.
    pub scenario: Scenario,
    /// Its setup.
    pub setup: Setup,
    /// The event.
    pub event: Event,
}

impl Question {
    /// One repetition of an estimate. The result does not depend on `threads`, but for the CPU time.
    ///
    /// # Errors
    /// Why the scenario cannot be run, or that the user wants it to stop.
    pub fn repeat(
        &self,
        plan: &Plan,
        repetition: u64,
        threads: usize,
        progress: &Progress,
        stop: &Stop,
    ) -> Result<Repetition, SearchError> {
        let begin = |seed| {
            let (topology, twin) = start(&self.scenario, &self.setup, seed, false)?;
            Ok(Flight { asked: self, twin, end: topology.duration, since: 0 })
        };
        let tried = || {
            progress.step();
            if stop.is_requested() { Err(SearchError::Stopped) } else { Ok(()) }
        };
        split(plan, repetition, threads, begin, tried)
    }
}

/// A twin on its way.
struct Flight<'a> {
    asked: &'a Question,
    twin: Twin,
    end: Micros,
    /// Its start, or the time it was branched off.
    since: Micros,
}

impl Process for Flight<'_> {
    fn reach(&mut self, level: f64) -> bool {
        let event = self.asked.event;
        self.twin.run_until_reached(self.end, |twin| event.level(twin) >= level)
    }

    fn branch(&self, seed: u64) -> Self {
        let twin = self.twin.branch(seed, &self.asked.scenario.varies);
        Self { since: twin.now(), twin, ..*self }
    }

    fn spent(&self) -> u64 {
        self.twin.now() - self.since
    }
}
