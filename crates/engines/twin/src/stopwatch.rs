//! Time spent by a twin, by stage. It is reported when another stage begins; the clock is its owner's
//! choice, and without a watcher there is none. The cores know no such clock.

use super::part::Part;

/// Stage that a twin can be busy with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorkStage {
    /// Casting and assembling a trial.
    Setup,
    /// World, plant, sensors and ground truth.
    Sim,
    /// Detection (in a run without rendering, its substitute), corroboration, tracks.
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

impl WorkStage {
    /// Every stage, in the order of a table.
    pub const ALL: [WorkStage; 13] = [
        WorkStage::Setup,
        WorkStage::Sim,
        WorkStage::Perception,
        WorkStage::Autonomy,
        WorkStage::Gateway,
        WorkStage::Console,
        WorkStage::Recorder,
        WorkStage::Adversary,
        WorkStage::Broker,
        WorkStage::Links,
        WorkStage::Guest,
        WorkStage::Engine,
        WorkStage::Judging,
    ];

    /// The stage that a core's work belongs to.
    pub fn from_part(part: &Part) -> WorkStage {
        match part {
            Part::Sim(_) => WorkStage::Sim,
            Part::Perception { .. } => WorkStage::Perception,
            Part::Autonomy(_) => WorkStage::Autonomy,
            Part::Gateway(_) => WorkStage::Gateway,
            Part::Console(_) => WorkStage::Console,
            Part::Recorder(_) => WorkStage::Recorder,
            Part::Adversary(_) => WorkStage::Adversary,
            Part::Following(along) => WorkStage::from_part(along.like()),
        }
    }

    /// Name of the stage in tables and JSON.
    pub fn name(self) -> &'static str {
        match self {
            WorkStage::Setup => "setup",
            WorkStage::Sim => "sim",
            WorkStage::Perception => "perception",
            WorkStage::Autonomy => "autonomy",
            WorkStage::Gateway => "gateway",
            WorkStage::Console => "console",
            WorkStage::Recorder => "recorder",
            WorkStage::Adversary => "adversary",
            WorkStage::Broker => "broker",
            WorkStage::Links => "links",
            WorkStage::Guest => "guest",
            WorkStage::Engine => "engine",
            WorkStage::Judging => "judging",
        }
    }
}

/// Adds up time by stage.
#[derive(Clone, Debug)]
pub struct Stopwatch {
    clock: fn() -> u64,
    since: u64,
    stage: WorkStage,
    spent: [u64; WorkStage::ALL.len()],
    laps: u64,
}

impl Stopwatch {
    /// Starts in `stage`, on a clock of the caller's in nanoseconds.
    pub fn start(clock: fn() -> u64, stage: WorkStage) -> Self {
        Self { clock, since: clock(), stage, spent: [0; WorkStage::ALL.len()], laps: 0 }
    }

    /// Counts the time from now on for `stage`.
    pub fn enter(&mut self, stage: WorkStage) {
        if stage != self.stage {
            let now = (self.clock)();
            self.spent[self.stage as usize] += now.saturating_sub(self.since);
            (self.since, self.stage) = (now, stage);
            self.laps += 1;
        }
    }

    /// Nanoseconds spent in `stage` up to the last change of stage.
    pub fn spent(&self, stage: WorkStage) -> u64 {
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
        let mut watch = Stopwatch::start(clock, WorkStage::Setup);
        watch.enter(WorkStage::Sim);
        watch.enter(WorkStage::Sim);
        watch.enter(WorkStage::Engine);
        watch.enter(WorkStage::Sim);
        watch.enter(WorkStage::Engine);
        let spent = [WorkStage::Setup, WorkStage::Sim, WorkStage::Engine].map(|s| watch.spent(s));
        assert_eq!((spent, watch.laps()), ([10, 20, 10], 4));
        assert!(WorkStage::ALL.iter().enumerate().all(|(i, stage)| *stage as usize == i));
    }
}
