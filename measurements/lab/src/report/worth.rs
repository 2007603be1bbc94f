//! Detection benchmark of the search: time until each strategy found each weakness, as an object and as a table.

use std::fmt::Write;

use crate::waiting::{Known, Median, Ratio, Wait};
use evidence::trial::Outcome;
use results::report::new_table;
use scenario::Weakness;
use search::{Source, Strategy};
use serde::Serialize;
use stats::LEVEL;

/// A weakness is hard where the median of uniform drawing is at least a given number of trials.
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
    /// The checks that were waived, and the bounds with their wrong values.
    pub wrong: String,
    /// Classes that counted as findings.
    pub find: Vec<Outcome>,
    /// Each strategy's search runs.
    #[serde(rename = "hunts")]
    pub strategies: Vec<StrategyRow>,
}

/// The search runs of one strategy.
#[derive(Clone, Debug, Serialize)]
pub struct StrategyRow {
    /// Source of the sequences.
    pub strategy: Source,
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
    /// The finding of each seed, where there is one: its cause and its sequence.
    pub each_finding: Vec<Option<String>>,
    /// Its trials over the trials of uniform drawing.
    pub ratio_trials: Ratio,
    /// Ratio of CPU time.
    pub ratio_cpu: Ratio,
}

impl StrategyRow {
    /// Row of search runs that took a given number of trials and CPU seconds.
    pub fn new(
        strategy: Source,
        each_trials: Vec<Wait>,
        each_cpu_seconds: Vec<Wait>,
        each_finding: Vec<Option<String>>,
    ) -> Self {
        Self {
            strategy,
            n: each_trials.len(),
            found: each_trials.iter().filter(|wait| wait.came).count(),
            trials: Median::from_waits(&each_trials, LEVEL),
            cpu_seconds: Median::from_waits(&each_cpu_seconds, LEVEL),
            each_trials,
            each_cpu_seconds,
            each_finding,
            ratio_trials: Ratio::from_waits(&[], &[]),
            ratio_cpu: Ratio::from_waits(&[], &[]),
        }
    }

    /// With the ratios to the search runs `uniform`.
    fn with_ratios(self, uniform: &StrategyRow) -> Self {
        Self {
            ratio_trials: Ratio::from_waits(&self.each_trials, &uniform.each_trials),
            ratio_cpu: Ratio::from_waits(&self.each_cpu_seconds, &uniform.each_cpu_seconds),
            ..self
        }
    }
}

impl WeaknessRow {
    /// Row of these search runs; their ratios are filled in where one of them is of uniform drawing.
    pub fn new(weakness: &Weakness, strategies: Vec<StrategyRow>) -> Self {
        let uniform = strategies.iter().find(|row| row.strategy.is_uniform()).cloned();
        let over =
            |row: StrategyRow| uniform.as_ref().map_or_else(|| row.clone(), |uniform| row.clone().with_ratios(uniform));
        Self {
            name: weakness.name.as_str().to_owned(),
            scenario: weakness.scenario.as_str().to_owned(),
            alphabet: weakness.space.as_str().to_owned(),
            wrong: weakness.wrong(),
            find: weakness.find.to_vec(),
            strategies: strategies.into_iter().map(over).collect(),
        }
    }

    fn row_of(&self, strategy: &Source) -> Option<&StrategyRow> {
        self.strategies.iter().find(|row| row.strategy == *strategy)
    }

    /// True if uniform drawing needs [`HARD`] trials or more; none where it was not run, or not for so long.
    fn is_hard(&self) -> Option<bool> {
        let median = self.row_of(&Source::Strategy(Strategy::Uniform))?.trials?.median;
        (median.came || median.waited >= HARD).then_some(median.waited >= HARD)
    }
}

/// The table for a terminal.
pub fn worth_table(object: &WorthObject) -> String {
    let mut table =
        new_table(&["weakness", "strategy", "found", "trials", "CPU s", "trials/uniform", "CPU/uniform", "95 %"]);
    for row in &object.weaknesses {
        for of in &row.strategies {
            let [from, to] = of.ratio_cpu.interval_95.map(|end| end.map_or_else(|| "?".to_owned(), number));
            let over = |text: String| if of.strategy.is_uniform() { "-".to_owned() } else { text };
            table.add_row([
                row.name.clone(),
                of.strategy.to_string(),
                format!("{} of {}", of.found, of.n),
                describe_median(of.trials),
                describe_median(of.cpu_seconds),
                over(known(of.ratio_trials.ratio)),
                over(known(of.ratio_cpu.ratio)),
                over(format!("{from} to {to}")),
            ]);
        }
    }
    let load = object.load_average.map(|load| load.map_or_else(|| "?".to_owned(), |load| format!("{load:.1}")));
    format!(
        "{table}\nfound by k of {} seeds; median of trials and of CPU seconds until the first finding, `>` where most seeds \
         ended without; budget {} trials.\n95 %: of the ratio of CPU, from exact intervals of both medians (order \
         statistics at 97.5 %).\n{}{} search runs at a time, load {} before and {} after.",
        object.draws,
        object.budget,
        summary(object),
        object.threads,
        load[0],
        load[1],
    )
}

fn describe_median(median: Option<Median>) -> String {
    median.map_or_else(
        || "-".to_owned(),
        |of| format!("{}{}", if of.median.came { "" } else { "> " }, number(of.median.waited)),
    )
}

/// Number of hard and of easy weaknesses; and, by strategy, the seeds with a finding of a hard one and those at which the aim was
/// met.
fn summary(object: &WorthObject) -> String {
    let rows = |hard: bool| object.weaknesses.iter().filter(move |row| row.is_hard() == Some(hard));
    let (hard, easy) = (rows(true).count(), rows(false).count());
    let mut text = format!(
        "uniform needs 1,000 trials or more: {hard} (hard); fewer: {easy} (easy); not known: {}.\n",
        object.weaknesses.len() - hard - easy
    );
    // Every weakness has the same sources.
    let first = object.weaknesses.first().into_iter().flat_map(|row| &row.strategies).map(|row| &row.strategy);
    for strategy in first.filter(|source| !source.is_uniform()) {
        let of = |hard: bool| rows(hard).filter_map(move |row| row.row_of(strategy));
        let reached = |hard: bool, aim: f64| of(hard).filter(|row| no_more(row.ratio_cpu.ratio, aim)).count();
        let (found, n) = of(true).fold((0, 0), |(found, n), row| (found + row.found, n + row.n));
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{}: of the hard ones, {found} of {n} seeds with a finding, CPU at most 1/20 of uniform's in {}, 1/100 in {}; of the \
             easy ones, CPU at most 1.5 times uniform's in {}.",
            strategy,
            reached(true, 1.0 / 20.0),
            reached(true, 1.0 / 100.0),
            reached(false, 1.5),
        );
    }
    text
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
