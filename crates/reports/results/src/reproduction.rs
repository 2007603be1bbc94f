//! Committed outcomes of runs in the twin, and their comparison with new runs.
//!
//! A reference is of one run under one seed, on one architecture: floating-point sums may differ on another. It has the run's two
//! hashes, and the hash of its decisions up to each second, so that a divergence is located to the second without the logs.

use std::io::{BufRead, Read, Write};

use evidence::diff::Decided;
use evidence::log::{Canonical, decision, hashes, hex};
use evidence::trial::Outcome;
use evidence::{Evidence, Micros, Witnessed};
use oracle::Verdict;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use wire::codec;

/// Version of the file's form.
pub const VERSION: u32 = 1;
/// The most that is read of a file, and the most runs.
const MAX_BYTES: u64 = 4 << 20;
const MAX_RUNS: usize = 10_000;
/// Bytes that are kept of the hash up to a second.
const SHORT: usize = 4;
const SECOND: Micros = 1_000_000;

/// One run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// Scenario.
    pub scenario: String,
    /// Its cell, where it has any.
    pub cell: Option<String>,
    /// The class that the oracle gave it.
    pub outcome: Outcome,
    /// Hash of everything.
    pub log_hash: String,
    /// Hash of the decisions, with their times.
    pub decision_hash: String,
    /// Hash up to the end of each second, its first four bytes.
    pub by_second: Vec<String>,
}

/// References of one architecture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct References {
    /// Seed of every run.
    pub seed: u64,
    /// References in the order of scenarios and cells.
    pub runs: Vec<Reference>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Head {
    schema_version: u32,
    seed: u64,
}

/// Comparison of a run with its reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Again {
    /// Every event at the same time.
    Same,
    /// Every decision at the same time; something else differs.
    SameDecisions,
    /// Decisions differ.
    Parted {
        /// The first second in which they do, from 0.
        second: usize,
        /// Decisions of the new run in that second.
        now: Vec<Decided>,
    },
}

impl Reference {
    /// Reference of a run.
    pub fn from_run(scenario: &str, cell: Option<&str>, evidence: &Evidence, verdict: &Verdict) -> Reference {
        let (log_hash, decision_hash) = hashes(&evidence.entries);
        Reference {
            scenario: scenario.to_owned(),
            cell: cell.map(str::to_owned),
            outcome: verdict.outcome,
            log_hash,
            decision_hash,
            by_second: by_second(&evidence.entries),
        }
    }

    /// Compares `now`, a run with these `entries`, with the reference.
    pub fn compare(&self, now: &Reference, entries: &[Witnessed]) -> Again {
        if self.log_hash == now.log_hash {
            return Again::Same;
        }
        if self.decision_hash == now.decision_hash {
            return Again::SameDecisions;
        }
        let both = self.by_second.iter().zip(&now.by_second);
        let second = both.take_while(|(a, b)| a == b).count();
        let decided = entries.iter().filter(|w| (w.at / SECOND) as usize == second).filter_map(|w| {
            let event = decision(w.entry.event)?;
            Some(Decided { at_us: w.at, event })
        });
        Again::Parted { second, now: decided.collect() }
    }
}

impl References {
    /// Reads a file.
    ///
    /// # Errors
    /// In words, with the line.
    pub fn read(from: impl Read) -> Result<References, String> {
        let mut lines = std::io::BufReader::new(from.take(MAX_BYTES)).lines().enumerate().map(|(i, line)| {
            let line = line.map_err(|e| format!("line {}: {e}", i + 1))?;
            Ok::<_, String>((i + 1, line))
        });
        let (_, head) = lines.next().ok_or("it is empty")??;
        let head: Head = serde_json::from_str(&head).map_err(|e| format!("line 1: {e}"))?;
        if head.schema_version != VERSION {
            return Err(format!("line 1: version {VERSION} is read, this is {}", head.schema_version));
        }
        let mut runs = Vec::new();
        for line in lines {
            let (number, line) = line?;
            runs.push(serde_json::from_str(&line).map_err(|e| format!("line {number}: {e}"))?);
            if runs.len() > MAX_RUNS {
                return Err(format!("line {number}: at most {MAX_RUNS} runs are read"));
            }
        }
        Ok(References { seed: head.seed, runs })
    }

    /// Writes it, a run a line.
    ///
    /// # Errors
    /// As the writer below.
    pub fn write(&self, mut to: impl Write) -> std::io::Result<()> {
        writeln!(to, "{}", serde_json::to_string(&Head { schema_version: VERSION, seed: self.seed })?)?;
        self.runs.iter().try_for_each(|run| writeln!(to, "{}", serde_json::to_string(run)?))
    }

    /// The run of this scenario and cell.
    pub fn find(&self, scenario: &str, cell: Option<&str>) -> Option<&Reference> {
        self.runs.iter().find(|run| run.scenario == scenario && run.cell.as_deref() == cell)
    }
}

/// Hash of the decisions up to the end of each second of a log in order of time.
fn by_second(entries: &[Witnessed]) -> Vec<String> {
    let mut so_far = Sha256::new();
    let mut seconds = Vec::new();
    let short = |so_far: &Sha256| hex(&so_far.clone().finalize()[..SHORT]);
    for w in entries {
        while (w.at / SECOND) as usize > seconds.len() {
            seconds.push(short(&so_far));
        }
        if let Some(event) = decision(w.entry.event) {
            so_far.update(codec::encode(&Canonical { at: w.at, node: w.entry.node, event }));
        }
    }
    seconds.push(short(&so_far));
    seconds
}

#[cfg(test)]
mod tests {
    use ground_truth::{Any, Entry};
    use wire::event::Event;
    use wire::id::{Boot, NodeId};
    use wire::mode::Cause;
    use wire::time::Instant;

    use super::*;

    fn revoked(at: Micros, authority: u32) -> Witnessed {
        let event = Any::Service(Event::Revoked { authority, cause: Cause::Expired });
        let entry =
            Entry { node: NodeId::UNIT_A, boot: Boot(1), counter: 1, at: Instant(at), event, previous: [0; 32] };
        Witnessed { at, entry }
    }

    fn reference(entries: &[Witnessed]) -> Reference {
        let (log_hash, decision_hash) = hashes(entries);
        let outcome = Outcome::Nominal;
        Reference { scenario: "a".into(), cell: None, outcome, log_hash, decision_hash, by_second: by_second(entries) }
    }

    #[test]
    fn diverging_runs_are_located_to_the_second() {
        let run = [revoked(100_000, 1), revoked(2_500_000, 2), revoked(4_000_000, 3)];
        let found = reference(&run);
        assert_eq!(found.compare(&found, &run), Again::Same);
        let mut other = run;
        other[1] = revoked(2_700_000, 2);
        let now = vec![Decided { at_us: 2_700_000, event: other[1].entry.event }];
        assert_eq!(found.compare(&reference(&other), &other), Again::Parted { second: 2, now });
        // One that says less has parted where it stopped.
        assert_eq!(found.compare(&reference(&run[..2]), &run[..2]), Again::Parted { second: 3, now: Vec::new() });
        let mut more = run.to_vec();
        more.push(Witnessed { at: 5, entry: Entry { event: Any::Service(Event::Started), ..run[0].entry } });
        assert_eq!(found.compare(&reference(&more), &more), Again::SameDecisions);
    }

    #[test]
    fn reference_file_round_trips_or_names_its_line() {
        let whole = References { seed: 7, runs: vec![reference(&[revoked(1, 1)]), reference(&[revoked(2, 1)])] };
        let mut file = Vec::new();
        whole.write(&mut file).expect("memory takes it");
        assert_eq!(References::read(&file[..]), Ok(whole));
        let text = String::from_utf8(file).expect("text");
        for (from, to, line) in
            [("\"seed\":7", "\"seed\":-7", "line 1"), ("NOMINAL", "NONE", "line 2"), ("\":1,", "\":9,", "line 1")]
        {
            let refused = References::read(text.replacen(from, to, 1).as_bytes()).expect_err(to);
            assert!(refused.starts_with(line), "{to}: {refused}");
        }
        assert!(References::read(&b""[..]).is_err());
    }
}
