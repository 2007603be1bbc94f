//! How likely a run is to come to what almost never happens: multilevel splitting over the twin.
//!
//! Terms: a *level* is how far a run is on its way to the event, a number that rises towards it; a *stage* tries to get from
//! one level to the next, from snapshots taken where the one before first got there; a *repetition* is all stages once, and
//! independent of every other. `event` is what can be asked for and how far a twin is from it, `estimate` the splitting over
//! anything that can be copied, `stats::mean` what repetitions together say. Whether the event is bad is nobody's business here.
//!
//! Branches are what this rests on: `twin::Twin::branch`.

mod estimate;
mod event;

pub use estimate::{MAX_LEVELS, Plan, Process, Repetition, Stage, split};
pub use event::Event;

use parallel::progress::{Progress, Stop};
use scenario::{Scenario, Setup};
use twin::Twin;
use twin::queue::Micros;
use twin::trial::start;

/// With what probability a run of this comes to that.
#[derive(Clone, Debug)]
pub struct Question {
    /// The scenario.
    pub scenario: Scenario,
    /// With what it runs.
    pub setup: Setup,
    /// The event.
    pub event: Event,
}

impl Question {
    /// Estimates it. The result does not depend on `threads`, but for the CPU time.
    ///
    /// # Errors
    /// Why the scenario cannot be run, or that the user wants it to stop.
    pub fn ask(
        &self,
        plan: &Plan,
        threads: usize,
        progress: &Progress,
        stop: &Stop,
    ) -> Result<Vec<Repetition>, String> {
        let begin = |seed| {
            let (cast, twin) = start(&self.scenario, &self.setup, seed, false).map_err(|e| e.to_string())?;
            Ok(Flight { asked: self, twin, end: cast.duration, since: 0 })
        };
        let tried = || {
            progress.step();
            if stop.asked() { Err("stopped".to_owned()) } else { Ok(()) }
        };
        split(plan, threads, begin, tried)
    }
}

/// A twin on its way.
struct Flight<'a> {
    asked: &'a Question,
    twin: Twin,
    end: Micros,
    /// When it began or was branched off.
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
