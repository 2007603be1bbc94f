//! Time spent by a twin, by stage. It is told when another stage begins; the clock is its owner's
//! choice, and without a watcher there is none. The cores know no such clock.

use super::part::Part;

/// Stage that a twin can be busy with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Casting and assembling a trial.
    Setup,
    /// World, plant, sensors and ground truth.
    Sim,
    /// Detection or its stand-in, corroboration, tracks.
    Perception,
    /// The state machine, navigation, reports.
    Autonomy,
    /// The trust boundary.
    Gateway,
    /// Display model and operator.
    Console,
    /// Following and sealing the chains.
    Recorder,
    /// Relays and insiders.
    Adversary,
    /// The broker's rules and the modelled stream of commands.
    Broker,
    /// The modelled secure layer and the guards with their journals.
    Links,
    /// Waiting for a guest's answers.
    Guest,
    /// The event queue, timers, clocks, delays, the log.
    Engine,
    /// Reading the log, judging it, its hashes.
    Judging,
}

impl Stage {
    /// Every stage, in the order of a table.
    pub const ALL: [Stage; 13] = [
        Stage::Setup,
        Stage::Sim,
        Stage::Perception,
        Stage::Autonomy,
        Stage::Gateway,
        Stage::Console,
        Stage::Recorder,
        Stage::Adversary,
        Stage::Broker,
        Stage::Links,
        Stage::Guest,
        Stage::Engine,
        Stage::Judging,
    ];

    /// The stage that a core's work belongs to.
    pub fn of(part: &Part) -> Stage {
        match part {
            Part::Sim(_) => Stage::Sim,
            Part::Perception { .. } => Stage::Perception,
            Part::Autonomy(_) => Stage::Autonomy,
            Part::Gateway(_) => Stage::Gateway,
            Part::Console(_) => Stage::Console,
            Part::Recorder(_) => Stage::Recorder,
            Part::Adversary(_) => Stage::Adversary,
            Part::Following(along) => Stage::of(along.like()),
        }
    }

    /// Its name in tables and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Setup => "setup",
            Stage::Sim => "sim",
            Stage::Perception => "perception",
            Stage::Autonomy => "autonomy",
            Stage::Gateway => "gateway",
            Stage::Console => "console",
            Stage::Recorder => "recorder",
            Stage::Adversary => "adversary",
            Stage::Broker => "broker",
            Stage::Links => "links",
            Stage::Guest => "guest",
            Stage::Engine => "engine",
            Stage::Judging => "judging",
        }
    }
}

/// Adds up time by stage.
#[derive(Clone, Debug)]
pub struct Stopwatch {
    clock: fn() -> u64,
    since: u64,
    stage: Stage,
    spent: [u64; Stage::ALL.len()],
    laps: u64,
}

impl Stopwatch {
    /// Starts in `stage`, on a clock of the caller's in nanoseconds.
    pub fn start(clock: fn() -> u64, stage: Stage) -> Self {
        Self { clock, since: clock(), stage, spent: [0; Stage::ALL.len()], laps: 0 }
    }

    /// From now on the time is `stage`'s.
    pub fn enter(&mut self, stage: Stage) {
        if stage != self.stage {
            let now = (self.clock)();
            self.spent[self.stage as usize] += now.saturating_sub(self.since);
            (self.since, self.stage) = (now, stage);
            self.laps += 1;
        }
    }

    /// Nanoseconds of `stage` up to the last change.
    pub fn spent(&self, stage: Stage) -> u64 {
        self.spent[stage as usize]
    }

    /// Number of stage changes: of reads of the clock.
    pub fn laps(&self) -> u64 {
        self.laps
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    thread_local!(static NOW: Cell<u64> = const { Cell::new(0) });

    fn clock() -> u64 {
        NOW.with(|now| now.replace(now.get() + 10))
    }

    /// Every stage has its place.
    #[test]
    fn time_belongs_to_the_last_entered_stage() {
        let mut watch = Stopwatch::start(clock, Stage::Setup);
        watch.enter(Stage::Sim);
        watch.enter(Stage::Sim);
        watch.enter(Stage::Engine);
        watch.enter(Stage::Sim);
        watch.enter(Stage::Engine);
        let spent = [Stage::Setup, Stage::Sim, Stage::Engine].map(|s| watch.spent(s));
        assert_eq!((spent, watch.laps()), ([10, 20, 10], 4));
        assert!(Stage::ALL.iter().enumerate().all(|(i, stage)| *stage as usize == i));
    }
}
