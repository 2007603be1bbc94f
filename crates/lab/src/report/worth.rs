//! Detection benchmark of the search: time until each strategy found each weakness, as an object and as a table.

use evidence::trial::Outcome;
use results::report::new_table;
use scenario::Weakness;
use search::Strategy;
use serde::Serialize;
use stats::LEVEL;
use stats::waiting::{Known, Median, Ratio, Wait};

/// A weakness is hard where the median of uniform drawing is at least so many trials.
const HARD: f64 = 1_000.0;

/// The object of `lab search --json`.
#[derive(Clone, Debug, Serialize)]
pub struct WorthObject {
    /// Version of this object.
    pub schema_version: u32,
    /// Seed of each trial.
    pub seed: u64,
    /// Seeds of drawing, from 1.
    pub draws: u64,
    /// Most trials of each.
    pub budget: u64,
    /// Search runs at a time.
    pub threads: usize,
    /// Load of the machine before and after, over a minute.
    pub load_average: [Option<f64>; 2],
    /// One row each.
    pub weaknesses: Vec<WeaknessRow>,
}

/// One weakness.
#[derive(Clone, Debug, Serialize)]
pub struct WeaknessRow {
    /// Its name.
    pub name: String,
    /// Mission during the attack.
    pub scenario: String,
    /// Attack space.
    pub alphabet: String,
    /// The check that was waived, or the bound with its wrong value.
    pub wrong: String,
    /// Classes that counted as findings.
    pub find: Vec<Outcome>,
    /// Each strategy's search runs.
    #[serde(rename = "hunts")]
    pub strategies: [StrategyRow; Strategy::ALL.len()],
    /// Trials of guided over uniform drawing.
    pub ratio_trials: Ratio,
    /// The same of CPU time.
    pub ratio_cpu: Ratio,
}

/// The search runs of one strategy.
#[derive(Clone, Debug, Serialize)]
pub struct StrategyRow {
    /// Strategy of drawing.
    pub strategy: Strategy,
    /// Number of seeds.
    pub n: usize,
    /// Number of these that found it.
    pub found: usize,
    /// Trials until then.
    pub trials: Option<Median>,
    /// CPU seconds until then.
    pub cpu_seconds: Option<Median>,
    /// CPU seconds of each seed.
    pub each_cpu_seconds: Vec<Wait>,
    /// Trials of each seed.
    pub each_trials: Vec<Wait>,
}

impl StrategyRow {
    /// Of search runs that took so many trials and CPU seconds.
    pub fn new(strategy: Strategy, each_trials: Vec<Wait>, each_cpu_seconds: Vec<Wait>) -> Self {
        Self {
            strategy,
            n: each_trials.len(),
            found: each_trials.iter().filter(|wait| wait.came).count(),
            trials: Median::of(&each_trials, LEVEL),
            cpu_seconds: Median::of(&each_cpu_seconds, LEVEL),
            each_trials,
            each_cpu_seconds,
        }
    }
}

impl WeaknessRow {
    /// Of these search runs, by strategy in the order of [`Strategy::ALL`].
    pub fn new(weakness: &Weakness, strategies: [StrategyRow; Strategy::ALL.len()]) -> Self {
        let [uniform, _, guided] = &strategies;
        Self {
            name: weakness.name.as_str().to_owned(),
            scenario: weakness.scenario.as_str().to_owned(),
            alphabet: weakness.space.as_str().to_owned(),
            wrong: weakness.wrong(),
            find: weakness.find.to_vec(),
            ratio_trials: Ratio::of(&guided.each_trials, &uniform.each_trials),
            ratio_cpu: Ratio::of(&guided.each_cpu_seconds, &uniform.each_cpu_seconds),
            strategies,
        }
    }

    fn is_hard(&self) -> bool {
        let [uniform, _, _] = &self.strategies;
        uniform.trials.is_some_and(|median| median.median.waited >= HARD)
    }
}

/// The table for a terminal.
pub fn worth_table(object: &WorthObject) -> String {
    let mut table = new_table(&["weakness", "uniform", "transitions", "guided", "trials", "CPU", "CPU, 95 %"]);
    for row in &object.weaknesses {
        let [uniform, transitions, guided] = row.strategies.each_ref().map(told);
        let [from, to] = row.ratio_cpu.interval_95.map(|end| end.map_or_else(|| "?".to_owned(), number));
        let (trials, cpu) = (known(row.ratio_trials.ratio), known(row.ratio_cpu.ratio));
        table.add_row([row.name.clone(), uniform, transitions, guided, trials, cpu, format!("{from} to {to}")]);
    }
    let load = object.load_average.map(|load| load.map_or_else(|| "?".to_owned(), |load| format!("{load:.1}")));
    format!(
        "{table}\nfound by k of {} seeds; median of trials and of CPU seconds until the first finding, `>` where most seeds \
         ended without; budget {} trials.\ntrials, CPU: guided over uniform, ratio of the medians; its interval from exact \
         ones of both (order statistics at 97.5 %).\n{}{} search runs at a time, load {} before and {} after.",
        object.draws,
        object.budget,
        summary(object),
        object.threads,
        load[0],
        load[1],
    )
}

fn told(row: &StrategyRow) -> String {
    let median = |median: Option<Median>| {
        let wait = median.map(|of| of.median);
        wait.map_or_else(
            || "-".to_owned(),
            |wait| format!("{}{}", if wait.came { "" } else { "> " }, number(wait.waited)),
        )
    };
    format!("{} of {}: {}, {} s", row.found, row.n, median(row.trials), median(row.cpu_seconds))
}

/// Number of hard and of easy weaknesses, and of those at which a search met its aim.
fn summary(object: &WorthObject) -> String {
    let line = |hard: bool, what: &str, aim: f64, told: &str| {
        let rows = || object.weaknesses.iter().filter(move |row| row.is_hard() == hard);
        let reached = rows().filter(|row| no_more(row.ratio_cpu.ratio, aim)).count();
        format!("{what}: {}; CPU at most {told} of uniform in {reached}.\n", rows().count())
    };
    let hard = line(true, "uniform needs 1,000 trials or more", 1.0 / 50.0, "1/50");
    hard + &line(false, "uniform needs fewer", 1.5, "1.5 times that")
}

fn no_more(ratio: Known, than: f64) -> bool {
    match ratio {
        Known::Is(ratio) | Known::AtMost(ratio) => ratio <= than,
        Known::AtLeast(_) | Known::Unknown => false,
    }
}

fn known(ratio: Known) -> String {
    match ratio {
        Known::Is(ratio) => number(ratio),
        Known::AtMost(ratio) => format!("< {}", number(ratio)),
        Known::AtLeast(ratio) => format!("> {}", number(ratio)),
        Known::Unknown => "?".to_owned(),
    }
}

/// Two significant places.
fn number(value: f64) -> String {
    match value {
        10.0.. => format!("{value:.0}"),
        1.0.. => format!("{value:.1}"),
        0.1.. => format!("{value:.2}"),
        _ => format!("{value:.3}"),
    }
}
