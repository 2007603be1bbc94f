//! Findings of a search, as an object and as a table. The oracle judged each finding; no code here judges.

use std::collections::BTreeMap;

use evidence::SCHEMA_VERSION;
use evidence::trial::{Outcome, Outcomes};
use search::{Margin, RunResult, SearchConfig, SearchRow, Source};
use serde::{Deserialize, Serialize};
use stats::{LEVEL, rate_upper};

use crate::report::new_table;

/// The object of `search --json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SearchObject {
    /// Version of this object.
    pub schema_version: u32,
    /// The scenario.
    pub scenario: String,
    /// Under which policy.
    pub policy: String,
    /// Watermark of every artefact of an ablation.
    pub watermark: Option<String>,
    /// The attack space.
    pub alphabet: String,
    /// Seed of each trial.
    pub seed: u64,
    /// Seed of the drawing.
    pub draws: u64,
    /// The longest words of an exhaustive search.
    pub exhausted: Option<u32>,
    /// The search in numbers.
    pub hunt: SearchRow,
    /// One finding of each cause.
    pub findings: Vec<FindingRow>,
}

/// One finding, shrunk.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FindingRow {
    /// Name; its file's too.
    pub name: String,
    /// Class.
    pub outcome: Outcome,
    /// The first property that was found broken.
    pub broken: String,
    /// The oracle's first finding about it.
    pub finding: Option<String>,
    /// The attack sequence in short.
    pub word: String,
    /// The sequence as it was found.
    pub found_as: String,
    /// Trial in which it was found, from 1.
    pub trial: u64,
    /// CPU time until it was found, seconds.
    pub cpu_seconds: f64,
    /// Trials of the shrinking.
    pub executions: u64,
    /// Its numbers, and the nearest that no longer do it.
    pub margins: Vec<Margin>,
    /// Waived checks of which each alone would have stopped it.
    pub stopped_by: Vec<String>,
    /// Confirmation by a live run, where requested.
    pub live: Option<Confirmed>,
    /// The line that shows it again.
    pub reproduce: String,
}

/// A finding run live, away from its edge.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Confirmed {
    /// The attack sequence; `None` where the region of the finding is too thin to be away from its edge.
    pub word: Option<String>,
    /// Runs with sound evidence.
    pub valid: u64,
    /// Runs that ended in a class that was looked for.
    pub found: u64,
    /// Count of each class.
    #[serde(serialize_with = "evidence::trial::by_name")]
    pub outcomes: Outcomes,
}

impl Confirmed {
    /// Counts a run.
    pub fn take(&mut self, outcome: Outcome, found: bool) {
        self.valid += u64::from(outcome != Outcome::Invalid);
        self.found += u64::from(found);
        *self.outcomes.entry(outcome).or_default() += 1;
    }

    fn describe(&self) -> String {
        match &self.word {
            None => "live: not run, the region is thinner than three times the jitter of a live run".to_owned(),
            Some(word) => format!("live: {} of {} ({}): {word}", self.found, self.valid, by_name(&self.outcomes)),
        }
    }
}

impl SearchObject {
    /// Object for a search under `ground`.
    pub fn new(
        ground: &SearchConfig,
        draws: u64,
        hunted: &RunResult,
        strategy: Source,
        exhausted: Option<u32>,
        findings: Vec<FindingRow>,
    ) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            scenario: ground.scenario.name.as_str().to_owned(),
            policy: ground.setup.policy_name.clone(),
            watermark: ground.setup.watermark(),
            alphabet: ground.space.name.as_str().to_owned(),
            seed: ground.seed,
            draws,
            exhausted,
            hunt: hunted.row(&ground.space, strategy),
            findings,
        }
    }
}

/// The table for a terminal.
pub fn search_table(object: &SearchObject) -> String {
    let hunt = &object.hunt;
    let manner = match object.exhausted {
        Some(k) => {
            format!("every sequence of up to {k} actions of space {}, at its weakest and strongest", object.alphabet)
        }
        None => format!("{} over space {}, draws {}", hunt.strategy, object.alphabet, object.draws),
    };
    let mut text = String::new();
    if let Some(watermark) = &object.watermark {
        text.push_str(&format!("{watermark}\n"));
    }
    text.push_str(&format!(
        "{}, policy {}, seed {}: {manner}\n{} trials in {:.1} CPU-s: {}. {} points of coverage.\n",
        object.scenario,
        object.policy,
        object.seed,
        hunt.trials,
        hunt.cpu_seconds,
        by_name(&hunt.outcomes),
        hunt.covered,
    ));
    if object.findings.is_empty() {
        // A trial without proof of arrival shows no result.
        let invalid = hunt.outcomes.get(&Outcome::Invalid).copied().unwrap_or_default();
        let valid = hunt.trials - invalid;
        let none = match object.exhausted {
            Some(k) if invalid == 0 => format!("None up to {k}.\n"),
            Some(k) => format!("None up to {k} in {valid} words; {invalid} were INVALID and show nothing.\n"),
            // Words of a guided search are no independent sample.
            None if hunt.strategy.is_uniform() => {
                let upper = rate_upper(0, valid, LEVEL) * 100.0;
                format!(
                    "None found: of sequences drawn so that arrive, below {upper:.2} % are findings (one-sided 95 %).\n"
                )
            }
            None => "None found. That is no proof that there is none.\n".to_owned(),
        };
        return text + &none + &nearest_told(hunt);
    }
    let mut table =
        new_table(&["finding", "class", "word, shrunk", "edge", "trial", "CPU-s", "shrunk in", "stopped by"]);
    for finding in &object.findings {
        table.add_row(row(finding));
    }
    text.push_str(&format!("{table}\n"));
    for finding in &object.findings {
        let name = finding.finding.as_deref().unwrap_or("no property broken");
        text.push_str(&format!("{}: {name}\n  {}\n", finding.name, finding.reproduce));
        if let Some(live) = &finding.live {
            text.push_str(&format!("  {}\n", live.describe()));
        }
    }
    text + "Edges are the twin's: live they lie within its jitter of these.\n"
}

/// Counts of classes in the alphabetical order of their names, as the object has them.
fn by_name(outcomes: &Outcomes) -> String {
    let classes: BTreeMap<&str, u64> = outcomes.iter().map(|(class, n)| (class.name(), *n)).collect();
    classes.iter().map(|(class, n)| format!("{class} {n}")).collect::<Vec<_>>().join(", ")
}

/// Nearest approaches of sequences that broke no property: the next question after a search without findings.
fn nearest_told(hunt: &SearchRow) -> String {
    let mut table = new_table(&["limit", "came to", "with the word"]);
    for row in &hunt.nearest {
        let percent = format!("{:.1} %", f64::from(row.thousandths) / 10.0);
        let word = if row.sequence.is_empty() { "none" } else { &row.sequence };
        table.add_row(vec![row.limit.name(), percent, word.to_owned()]);
    }
    format!("{table}\nBeyond 100 % the oracle still allows for clocks and periods, which its verdict has in it.\n")
}

fn row(finding: &FindingRow) -> Vec<String> {
    let edge = |m: &Margin| match m.fails {
        Some(fails) => format!("{} {}: {fails} is not, {} is", m.of, m.number, m.holds),
        None => format!("{} {}: {} is", m.of, m.number, m.holds),
    };
    vec![
        finding.name.clone(),
        format!("{} {}", finding.outcome.name(), finding.broken),
        finding.word.clone(),
        finding.margins.iter().map(edge).collect::<Vec<_>>().join("\n"),
        finding.trial.to_string(),
        format!("{:.2}", finding.cpu_seconds),
        finding.executions.to_string(),
        if finding.stopped_by.is_empty() { "-".to_owned() } else { finding.stopped_by.join(", ") },
    ]
}
