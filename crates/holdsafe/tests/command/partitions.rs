//! An estimate and a search in partitions, as the jobs of an engine start them: results equal to one process's, and refusals.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use runner::lines::reseal;
use tempfile::TempDir;

use super::holdsafe;

/// A folder, and a command that comes in partitions.
struct Place {
    directory: TempDir,
    words: &'static [&'static str],
}

impl Place {
    fn new(words: &'static [&'static str]) -> Self {
        Self { directory: tempfile::tempdir().unwrap(), words }
    }

    fn dir(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// The command with further options, and what it said.
    fn run(&self, out: &str, more: &[&str]) -> (Option<i32>, String) {
        let out = self.dir(out);
        let own_texts = ["--quiet", "--out", out.to_str().unwrap()];
        code_and_text(&holdsafe(&[self.words, &own_texts, more].concat()))
    }

    fn emit(&self) -> (Option<i32>, String) {
        let jobs = self.dir("jobs");
        let emit = ["emit", "make", "--partitions", "3", "--out", jobs.to_str().unwrap(), "--"];
        code_and_text(&holdsafe(&[&emit, self.words].concat()))
    }

    fn script(&self, name: &str, argument: &str) -> (Option<i32>, String) {
        code_and_text(&Command::new(self.dir("jobs").join(name)).arg(argument).output().unwrap())
    }

    /// A result but for the time that it took and its folder.
    fn result(&self, file: &str) -> Vec<String> {
        let text = fs::read_to_string(self.dir(file)).unwrap();
        let of_here = |line: &&str| line.contains("cpu_seconds") || line.contains("\"reproduce\"");
        text.lines().filter(|line| !of_here(line)).map(str::to_owned).collect()
    }

    fn trial_files(&self, dir: &str) -> Vec<String> {
        let text = fs::read_to_string(self.dir(dir).join("results.jsonl")).unwrap();
        text.lines().map(str::to_owned).collect()
    }
}

fn code_and_text(output: &Output) -> (Option<i32>, String) {
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// Partitions come in any order, repeated, and though one is lost.
#[test]
fn partitions_of_an_estimate_equal_one_process() {
    let place = Place::new(&[
        "estimate",
        "nominal",
        "--set",
        "conditions.loss=0.3",
        "--event",
        "hold-safe",
        "--levels",
        "250,450",
        "--trials",
        "8",
        "--repetitions",
        "4",
    ]);
    assert_eq!(place.run("whole", &[]).0, Some(0));
    assert_eq!(place.emit().0, Some(0));
    for part in ["3", "1", "3"] {
        let (code, text) = place.script("part", part);
        assert_eq!(code, Some(0), "{text}");
    }
    assert!(!place.dir("jobs/parts/partition=1/estimate.json").exists(), "a partition has no result");
    assert!(!place.dir("jobs/look").exists(), "an estimate has no page");
    assert_eq!(place.script("merge", "").0, Some(0));
    assert_eq!(place.result("jobs/result/estimate.json"), place.result("whole/estimate.json"));
    assert_eq!(place.trial_files("jobs/result").len(), 4, "three were taken, and the lost one ran");

    let whole = place.dir("whole");
    let (code, text) = place.run("other", &["--seed", "2", "--from", whole.to_str().unwrap()]);
    assert!(code == Some(2) && text.contains("is of other work: seed: expected 2, got 1"), "{text}");
    let (code, text) = place.run("none", &["--from", "/nowhere"]);
    assert!(code == Some(2) && text.contains("name the folder that the same command made with --out DIR"), "{text}");
    let altered: Vec<String> =
        place.trial_files("whole").iter().map(|line| line.replacen("\"spent\":", "\"spent\":1", 1)).collect();
    let part = place.dir("jobs/parts/partition=1");
    fs::write(part.join("results.jsonl"), altered.join("\n") + "\n").unwrap();
    let (code, text) = place.run("whole", &["--from", part.to_str().unwrap()]);
    assert!(code == Some(2) && text.contains("results.jsonl:1: changed by hand"), "{text}");
    let altered = reseal((altered.join("\n") + "\n").as_bytes());
    fs::write(part.join("results.jsonl"), altered).unwrap();
    let (code, text) = place.run("whole", &["--from", part.to_str().unwrap()]);
    assert!(code == Some(3) && text.contains("result 0 came out differently elsewhere"), "{text}");
    let impossible = place.trial_files("whole").join("\n").replace("\"tried\":8", "\"tried\":18446744073709551615");
    fs::write(part.join("results.jsonl"), reseal((impossible + "\n").as_bytes())).unwrap();
    let (code, text) = place.run("fresh", &["--from", part.to_str().unwrap()]);
    assert!(code == Some(2) && text.contains("results.jsonl:1: no repetition of this estimate"), "{text}");
    let (code, text) = code_and_text(&holdsafe(&[place.words, &["--partition", "1/2"]].concat()));
    assert!(code == Some(2) && text.contains("--out"), "a partition is kept somewhere: {text}");
}

/// Two strategies and every sequence up to a length; a strategy that learns is refused.
#[test]
#[ignore = "long: three searches, twice each"]
fn partitions_of_a_search_equal_one_process() {
    const WAIVED: [&str; 6] = ["search", "nominal", "--waive", "boundary.freshness", "--budget", "20"];
    let uniform: &[&str] =
        &["search", "nominal", "--waive", "boundary.freshness", "--budget", "20", "--strategy", "uniform"];
    let every: &[&str] = &["search", "nominal", "--attack-space", "processes", "--exhaust", "1"];
    let transitions: &[&str] =
        &["search", "nominal", "--waive", "boundary.freshness", "--budget", "20", "--strategy", "transitions"];
    for (words, code) in [(uniform, 3), (transitions, 3), (every, 0)] {
        let place = Place::new(words);
        let whole = place.run("whole", &[]);
        assert_eq!(whole.0, Some(code), "{}", whole.1);
        assert_eq!(place.emit().0, Some(0));
        for part in ["2", "3"] {
            let (code, text) = place.script("part", part);
            assert_eq!(code, Some(0), "{text}");
        }
        assert_eq!(place.script("merge", "").0, Some(code));
        assert_eq!(place.result("jobs/result/result.json"), place.result("whole/result.json"), "{words:?}");
        let tried = place.trial_files("jobs/result").len();
        assert!(words == every || tried == 20, "{tried}");
        let parts = ["2", "3"].map(|part| place.trial_files(&format!("jobs/parts/partition={part}")).len());
        assert!(parts.iter().all(|n| tried / 3 <= *n && *n <= tried.div_ceil(3)), "{parts:?} of {tried}");
    }
    let learning = Place::new(&WAIVED);
    let (code, text) = learning.emit();
    assert!(code == Some(2) && text.contains("depends on the results of earlier ones; partitions take"), "{text}");
    let (code, text) = learning.run("part", &["--partition", "1/2"]);
    assert!(code == Some(2) && text.contains("depends on the results of earlier ones; partitions take"), "{text}");
    let first = Place::new(&["search", "nominal", "--strategy", "uniform", "--first"]);
    let (code, text) = first.emit();
    assert!(code == Some(2) && text.contains("leave --first out") && !first.dir("jobs").exists(), "{text}");
    let (code, text) = learning.run("part", &["--partition", "1/2", "--first"]);
    assert!(code == Some(2) && text.contains("cannot be used with"), "{text}");
}
