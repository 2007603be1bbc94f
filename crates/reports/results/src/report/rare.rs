//! Estimate of a rare event, as an object and as a table; and the cost of plain Monte Carlo for it.

use evidence::SCHEMA_VERSION;
use scenario::Settings;
use search::rare::{Event, Plan, Question, Repetition, StageResult};
use serde::{Deserialize, Serialize};
use stats::Share;
use stats::mean::Mean;

use crate::report::new_table;

/// The normal deviate of a two-sided 95 % interval.
const Z: f64 = 1.959_964;

/// An estimate as the user requested it.
#[derive(Clone, Debug)]
pub struct RareQuestion<'a> {
    /// The question.
    pub question: &'a Question,
    /// Settings of its scenario.
    pub set: Settings,
    /// The levels as they were given.
    pub levels: &'a [f64],
}

/// The object of `rare --json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RareObject {
    /// Version of this object.
    pub schema_version: u32,
    /// The scenario.
    pub scenario: String,
    /// Its settings.
    pub set: Settings,
    /// Under which policy.
    pub policy: String,
    /// Watermark of every artefact of an ablation.
    pub watermark: Option<String>,
    /// The event.
    pub event: Event,
    /// Levels, as they were given.
    pub levels: Vec<f64>,
    /// Seed of all of it.
    pub seed: u64,
    /// Trials of each stage of each repetition.
    pub trials: u64,
    /// Independent repetitions.
    pub repetitions: u64,
    /// The stages, all repetitions together.
    pub stages: Vec<StageRow>,
    /// The estimate of each repetition.
    pub estimates: Vec<f64>,
    /// Their mean: the probability that a run comes to the event.
    pub estimate: f64,
    /// Two-sided 95 % interval; exact (Clopper-Pearson) where there is one stage, else by `stats::mean`. `None` if no
    /// repetition reached the event.
    pub interval_95: Option<[f64; 2]>,
    /// Length of a trial, simulated seconds.
    pub duration_s: f64,
    /// Simulated time, seconds.
    pub sim_seconds: f64,
    /// CPU time of it, seconds.
    pub cpu_seconds: f64,
    /// Interval by plain Monte Carlo; absent where this was plain, or there is no interval.
    pub plain: Option<Plain>,
}

/// One stage in all repetitions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageRow {
    /// Target level; `None` where that is the event without a number.
    pub to: Option<f64>,
    /// Trials.
    pub tried: u64,
    /// Number of trials that reached the level.
    pub reached: u64,
    /// Simulated time, seconds.
    pub sim_seconds: f64,
}

/// Cost of plain Monte Carlo for an interval of the same relative width.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plain {
    /// Trials.
    pub trials: f64,
    /// Simulated seconds.
    pub sim_seconds: f64,
    /// CPU seconds, at the same CPU time a simulated second.
    pub cpu_seconds: f64,
}

impl RareObject {
    /// The result of `plan`.
    pub fn new(requested: RareQuestion<'_>, plan: &Plan, repetitions: &[Repetition]) -> Self {
        let Question { scenario, setup, event } = requested.question;
        let rows: Vec<(Option<f64>, StageResult)> = (0..plan.levels.len())
            .map(|i| {
                (requested.levels.get(i).copied(), together(repetitions.iter().filter_map(|one| one.stages.get(i))))
            })
            .collect();
        let all = together(rows.iter().map(|(_, stage)| stage));
        let estimates: Vec<f64> = repetitions.iter().map(Repetition::estimate).collect();
        let mean = Mean::from_values(&estimates);
        // Trials of a single stage are independent; those of later stages share their start states.
        let exact = Some(Share::new(all.reached, all.tried)).filter(|_| rows.len() == 1);
        let interval_95 = exact.map_or(mean.interval_95, |share| Some([share.lower_95, share.upper_95]));
        let (sim_seconds, cpu_seconds) = (all.spent as f64 / 1e6, all.cpu_us as f64 / 1e6);
        let duration_s = scenario.duration_s.get();
        let width = mean.interval_95.filter(|_| exact.is_none()).map(|[_, upper]| libm::log(upper / mean.mean));
        let plain = width.filter(|width| *width > 0.0).map(|width| {
            // The relative standard error of n plain trials is sqrt((1 - p) / (p n)); Z of these are the width of ln p.
            let trials = Z * Z * (1.0 - mean.mean) / (mean.mean * width * width);
            let seconds = trials * duration_s;
            Plain { trials, sim_seconds: seconds, cpu_seconds: seconds * cpu_seconds / sim_seconds }
        });
        Self {
            schema_version: SCHEMA_VERSION,
            scenario: scenario.name.as_str().to_owned(),
            set: requested.set,
            policy: setup.policy_name.clone(),
            watermark: setup.watermark(),
            event: *event,
            levels: requested.levels.to_vec(),
            seed: plan.seed,
            trials: plan.trials,
            repetitions: plan.repetitions,
            stages: rows.into_iter().map(|(to, stage)| StageRow::new(to, stage)).collect(),
            estimates,
            estimate: mean.mean,
            interval_95,
            duration_s,
            sim_seconds,
            cpu_seconds,
            plain,
        }
    }

    /// True if any trial came to the event.
    pub fn seen(&self) -> bool {
        self.estimate > 0.0
    }
}

impl StageRow {
    fn new(to: Option<f64>, stage: StageResult) -> Self {
        Self { to, tried: stage.tried, reached: stage.reached, sim_seconds: stage.spent as f64 / 1e6 }
    }
}

fn together<'a>(stages: impl Iterator<Item = &'a StageResult>) -> StageResult {
    stages.fold(StageResult::default(), |sum, stage| StageResult {
        tried: sum.tried + stage.tried,
        reached: sum.reached + stage.reached,
        spent: sum.spent + stage.spent,
        cpu_us: sum.cpu_us + stage.cpu_us,
    })
}

/// The table for a terminal.
pub fn rare_table(object: &RareObject) -> String {
    let mut table = new_table(&["to", "tried", "got there", "share", "simulated s"]);
    for stage in &object.stages {
        let share = if stage.tried > 0 { stage.reached as f64 / stage.tried as f64 } else { 0.0 };
        table.add_row([
            stage.to.map_or_else(|| "the event".to_owned(), |to| to.to_string()),
            stage.tried.to_string(),
            stage.reached.to_string(),
            format!("{share:.4}"),
            format!("{:.0}", stage.sim_seconds),
        ]);
    }
    let set: String = object.set.iter().map(|(path, value)| format!(", {path} = {value}")).collect();
    let watermark = object.watermark.as_ref().map(|mark| format!("{mark}\n")).unwrap_or_default();
    format!(
        "{watermark}{}{set}, policy {}, seed {}: {} repetitions of {} trials a stage; levels are the {}\n{table}\n{}{}",
        object.scenario,
        object.policy,
        object.seed,
        object.repetitions,
        object.trials,
        object.event.counts(),
        result_line(object),
        work(object),
    )
}

fn result_line(object: &RareObject) -> String {
    match object.interval_95 {
        Some([from, to]) if object.seen() => format!(
            "A run of {} s comes to it with probability {:.3e} (95 %: {from:.3e} to {to:.3e}).\n",
            object.duration_s, object.estimate
        ),
        Some([_, to]) => format!("No run of {} came to it: below {to:.3e} (97.5 %).\n", object.stages[0].tried),
        None if object.seen() => format!(
            "All repetitions came to {:.3e}: they show no spread, so there is no interval; give more trials.\n",
            object.estimate
        ),
        None => "No repetition came to it, which bounds nothing: give more trials, or levels that are closer where \
                 hardly any got there.\n"
            .to_owned(),
    }
}

fn work(object: &RareObject) -> String {
    let plain = object.plain.map_or_else(String::new, |plain| {
        format!(
            " Plain Monte Carlo would take about {:.0} trials for an interval as wide: {:.0} simulated s, {:.0} CPU-s, {:.0} times \
             as much.",
            plain.trials,
            plain.sim_seconds,
            plain.cpu_seconds,
            plain.sim_seconds / object.sim_seconds
        )
    });
    format!("{:.0} simulated s in {:.0} CPU-s.{plain}\n", object.sim_seconds, object.cpu_seconds)
}
