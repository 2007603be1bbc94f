//! The program as a user meets it: exit codes, one-screen errors, one JSON object.

#![expect(clippy::unwrap_used, reason = "a test may end here")]

#[path = "command/boards.rs"]
mod boards;
#[path = "command/bus.rs"]
mod bus;
#[path = "command/campaigns.rs"]
mod campaigns;
#[path = "command/closings.rs"]
mod closings;
#[path = "command/contradictions.rs"]
mod contradictions;
#[path = "command/detectors.rs"]
mod detectors;
#[path = "command/displays.rs"]
mod displays;
#[path = "command/documented.rs"]
mod documented;
#[path = "command/documents.rs"]
mod documents;
#[path = "command/evaluations.rs"]
mod evaluations;
#[path = "command/evidence.rs"]
mod evidence;
#[path = "command/exports.rs"]
mod exports;
#[path = "command/frames.rs"]
mod frames;
#[path = "command/golden.rs"]
mod golden;
#[path = "command/guests.rs"]
mod guests;
#[path = "command/judge.rs"]
mod judge;
#[path = "command/live.rs"]
mod live;
#[path = "command/manners.rs"]
mod manners;
#[path = "command/optimizers.rs"]
mod optimizers;
#[path = "command/partitions.rs"]
mod partitions;
#[path = "command/ramming.rs"]
mod ramming;
#[path = "command/rare.rs"]
mod rare;
#[path = "command/readers.rs"]
mod readers;
#[path = "command/recordings.rs"]
mod recordings;
#[path = "command/shipped.rs"]
mod shipped;
#[path = "command/tour.rs"]
mod tour;
#[path = "command/tutorials.rs"]
mod tutorials;
#[path = "command/verbs.rs"]
mod verbs;
#[path = "command/verification.rs"]
mod verification;

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{PoisonError, RwLock, RwLockWriteGuard};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The machine: shared by the programs that tests start, and of a live trial alone, which is INVALID where the host stalls a service.
static MACHINE: RwLock<()> = RwLock::new(());

/// The machine without the programs of other tests. [`holdsafe`] waits for its end.
fn lock_machine() -> RwLockWriteGuard<'static, ()> {
    MACHINE.write().unwrap_or_else(PoisonError::into_inner)
}

fn holdsafe(arguments: &[&str]) -> Output {
    let _shared = MACHINE.read().unwrap_or_else(PoisonError::into_inner);
    started(arguments)
}

/// The program's output; who calls it says if the machine is shared.
fn started(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_holdsafe"));
    let output = command.args(["--root", root().to_str().unwrap()]).args(arguments).output().unwrap();
    golden::hold(&output.stdout);
    output
}

/// A shipped scenario with everything written out that it takes from its base.
fn written_out() -> String {
    let text = fs::read_to_string(root().join("scenarios/telemetry/loss.toml")).unwrap();
    let base = fs::read_to_string(root().join("scenarios/bases/armed.toml")).unwrap();
    let (keys, steps) = base.split_at(base.find("[[operator.step]]").unwrap());
    text.replacen("extends = \"armed\"\n", keys, 1) + "\n" + steps
}

/// A shipped scenario with `from` replaced by `to`, in its own directory, and its path.
fn mistaken(dir: &Path, from: &str, to: &str) -> String {
    let text = written_out();
    let changed = text.replacen(from, to, 1);
    assert!(from.is_empty() || changed != text, "{from} is not in the scenario");
    fs::create_dir_all(dir.join("scenes")).unwrap();
    fs::copy(root().join("scenarios/scenes/yard.toml"), dir.join("scenes/yard.toml")).unwrap();
    let path = dir.join("loss.toml");
    fs::write(&path, changed).unwrap();
    path.to_str().unwrap().to_owned()
}

/// The answer fits on one screen, has file, line and remedy, and exit code 2.
#[test]
fn bad_input_is_answered_with_place_and_remedy() {
    let mistakes = [
        ("duration_s = 9.0", "duration = 9.0", "unknown field `duration`"),
        ("duration_s = 9.0", "duration_s = \"9\"", "invalid type"),
        ("duration_s = 9.0", "duration_s = 9000", "out of range"),
        ("duration_s = 9.0", "duration_s = nan", "not a finite number"),
        ("scenes/yard.toml", "../scenes/yard.toml", "path leaves the scenario directory"),
        ("scenes/yard.toml", "scenes/none.toml", "no such file"),
    ];
    for (from, to, message) in mistakes {
        let dir = tempfile::tempdir().unwrap();
        let output = holdsafe(&["run", &mistaken(dir.path(), from, to)]);
        let screen = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{to}: {screen}");
        assert!(screen.contains(message) && screen.contains("help: "), "{to}: {screen}");
        let in_file = screen.lines().any(|line| {
            line.split("loss.toml:").nth(1).is_some_and(|place| place.starts_with(|c: char| c.is_ascii_digit()))
        });
        assert!(in_file, "{to} names no line: {screen}");
        assert!(screen.lines().count() <= 24 && !screen.contains("panicked"), "{screen}");
    }
}

/// The refusal has exit code 2.
#[test]
fn unsuitable_scenario_file_is_refused_unread() {
    let dir = tempfile::tempdir().unwrap();
    let huge = dir.path().join("huge.toml");
    File::create(&huge).unwrap().set_len(1_000_000_000).unwrap();
    let none = dir.path().join("none.toml");
    for (file, message) in [(&huge, "at most 262144 are read"), (&none, "no such file")] {
        let output = holdsafe(&["scenario", "check", file.to_str().unwrap(), "--json"]);
        assert_eq!(output.status.code(), Some(2));
        let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let text = object["files"][0]["problems"][0]["message"].as_str().unwrap().to_owned();
        assert!(text.contains(message), "{text}");
    }
    let output = holdsafe(&["inspect", "replay", none.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
}

/// The answer names the nearest scenario, or the command that lists all.
#[test]
fn unknown_scenario_is_answered_with_known_names() {
    for (name, answer) in [("nominall", "did you mean `nominal`?"), ("xqz", "`holdsafe scenario list`")] {
        let output = holdsafe(&["run", name, "--json"]);
        assert_eq!(output.status.code(), Some(2));
        let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(object["error"].as_str().unwrap().contains(answer), "{object}");
    }
}

/// The new scenario is written into the user's folder, and checked by name.
#[test]
fn new_scenario_is_checked_like_a_shipped_one() {
    let dir = tempfile::tempdir().unwrap();
    let run_here = |arguments: &[&str]| {
        let root = root().canonicalize().unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_holdsafe"));
        command.args(["--root", root.to_str().unwrap()]).args(arguments).current_dir(dir.path()).output().unwrap()
    };
    let output = run_here(&["scenario", "new", "mine-of-this-test"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let elsewhere = root().join("scenarios/mine-of-this-test.toml");
    let is_elsewhere = elsewhere.exists();
    let _ = fs::remove_file(elsewhere);
    assert!(dir.path().join("mine-of-this-test.toml").is_file() && !is_elsewhere);
    assert_eq!(run_here(&["scenario", "check", "mine-of-this-test.toml"]).status.code(), Some(0));
    assert_eq!(run_here(&["scenario", "new", "mine-of-this-test"]).status.code(), Some(2), "it is there already");
    // A file of the user's may extend a shipped one, as the template says.
    let template = fs::read_to_string(dir.path().join("mine-of-this-test.toml")).unwrap();
    let extending = template.replace("\"mine-of-this-test\"", "\"extending\"").replacen("# extends =", "extends =", 1);
    fs::write(dir.path().join("extending.toml"), extending).unwrap();
    let extending = run_here(&["scenario", "check", "extending.toml"]);
    assert_eq!(extending.status.code(), Some(0), "{}", String::from_utf8_lossy(&extending.stderr));
    let by_name = run_here(&["scenario", "check", "nominal"]);
    assert_eq!(by_name.status.code(), Some(0), "{}", String::from_utf8_lossy(&by_name.stderr));
    let none = run_here(&["scenario", "check", "nominall"]);
    assert!(String::from_utf8_lossy(&none.stderr).contains("no scenario `nominall`"), "{none:?}");
}

/// Reported in words and in JSON. The scene has no object that could be armed on.
#[test]
fn step_never_carried_out_is_reported() {
    let dir = tempfile::tempdir().unwrap();
    let file = mistaken(dir.path(), "when_track = \"vehicle\"", "when_track = \"obstacle\"\nwithin_s = 1.0");
    let run = |more: &[&str]| holdsafe(&[&["run", &file, "--trials", "1", "--quiet"], more].concat());
    let output = run(&["--json"]);
    assert_eq!(output.status.code(), Some(4), "{output:?}");
    let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let trial = &object["trials"][0];
    assert_eq!((&trial["outcome"], &trial["mission"]["owed"]), (&"INVALID".into(), &"armed".into()), "{trial}");
    let arm = &trial["mission"]["steps"][1];
    assert_eq!((&arm["do"], &arm["done_ms"]), (&"arm".into(), &serde_json::Value::Null), "{arm}");
    assert_eq!(arm["why"], "no obstacle shown");
    assert!(trial["findings"].to_string().contains("mission: armed by "), "{trial}");
    let table = String::from_utf8(run(&[]).stdout).unwrap();
    assert!(table.contains("arm: never, no obstacle shown (1 of 1)") && table.contains("armed 0 of 1"), "{table}");
}

#[test]
fn every_shipped_scenario_passes_the_check() {
    let output = holdsafe(&["scenario", "check"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
}

/// A run prints one object.
#[test]
fn same_seed_gives_the_same_hashes() {
    let run = |seed: &str| {
        let output = holdsafe(&["run", "loss", "--trials", "2", "--seed", seed, "--json", "--quiet"]);
        let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(object["seed"].to_string(), seed);
        object["trials"].as_array().unwrap().iter().map(|t| t["log_hash"].to_string()).collect::<Vec<_>>()
    };
    let first = run("7");
    assert_eq!(first, run("7"));
    assert_eq!(first[1], run("8")[0], "trial i has seed + i");
    assert_ne!(first[0], first[1]);
}

/// The exit codes are in the help.
#[test]
fn usage_errors_exit_with_2() {
    assert_eq!(holdsafe(&["run"]).status.code(), Some(2));
    let help = String::from_utf8(holdsafe(&["--help"]).stdout).unwrap();
    for code in ["0 ", "1 ", "2 ", "3 ", "4 ", "5 ", "130 "] {
        assert!(help.contains(&format!("\n  {code}")), "{code}: {help}");
    }
}

/// The state is that after a `kill -9`: the last line that was being written is cut short.
#[test]
#[ignore = "long: a matrix, twice"]
fn interrupted_matrix_resumes_to_the_same_result() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("matrix");
    let matrix = || {
        let output = holdsafe(&[
            "matrix",
            "--rows",
            "N0",
            "--trials",
            "3",
            "--seed",
            "1",
            "--out",
            out.to_str().unwrap(),
            "--quiet",
        ]);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let text = fs::read_to_string(out.join("matrix.json")).unwrap();
        let matrix: serde_json::Value = serde_json::from_str(&text).unwrap();
        matrix["rows"][0]["kinds"].clone()
    };
    let first = matrix();
    let paths: Vec<PathBuf> = fs::read_dir(out.join("kept")).unwrap().map(|e| e.unwrap().path()).collect();
    assert!(!paths.is_empty());
    let before: Vec<String> = paths.iter().map(|file| fs::read_to_string(file).unwrap()).collect();
    for (file, text) in paths.iter().zip(&before) {
        assert_eq!(text.lines().count(), 3);
        fs::write(file, &text[..text.len() - 20]).unwrap();
    }
    assert_eq!(matrix(), first);
    for (file, text) in paths.iter().zip(&before) {
        let after = fs::read_to_string(file).unwrap();
        // Whole lines stay to the byte, processor time included: their trials were not run again.
        let whole = text.lines().take(2).map(|line| format!("{line}\n")).collect::<String>();
        assert!(after.starts_with(&whole) && after.lines().count() == 3);
    }
}

/// The finding's file is a scenario that shows it.
#[test]
fn search_finds_an_attack_that_a_waiver_admits() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().to_str().unwrap();
    let search = |jobs: &str| {
        let waive = ["search", "nominal", "--attack-space", "display", "--waive", "display.signature", "--first"];
        let more = ["--budget", "400", "--draws", "1", "--jobs", jobs, "--json", "--out", out];
        let output = holdsafe(&[&waive[..], &more].concat());
        assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
        let mut object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let finding = object["findings"][0].take();
        (finding["word"].clone(), finding["stopped_by"].clone(), finding["trial"].clone())
    };
    let first = search("1");
    assert_eq!(first.1, serde_json::json!(["display.signature"]), "{}", first.0);
    assert_eq!(first, search("2"), "other threads, another finding");

    let file = dir.path().join("found-1.toml");
    let (file, policy) = (file.to_str().unwrap(), dir.path().join("searched.toml"));
    let run = |more: &[&str]| holdsafe(&[&["run", file, "--trials", "1"], more].concat()).status.code();
    assert_eq!(run(&["--policy", policy.to_str().unwrap()]), Some(3), "the finding stands while the check is waived");
    assert_eq!(run(&[]), Some(0), "with the check it is refused");

    let policy = root().join("policies/freshness-waived.toml");
    let texts = ["search", "nominal", "--policy", policy.to_str().unwrap(), "--budget", "16", "--first", "--out", out];
    assert_eq!(holdsafe(&texts).status.code(), Some(3), "under a policy of which the scenario declares nothing");
}

#[test]
fn a_search_that_cannot_begin_says_why() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("odd.toml");
    let odd = "name = \"odd\"\ntitle = \"t\"\nlongest = 1\nbegins_ms = [500, 900]\ntick_ms = 10\n[[move]]\nname = \"odd\"\n\
               table = \"loss\"\nlasts_ms = { from = -50, to = 100, step = 10 }\nset = { share = 1.0 }\n";
    fs::write(&file, odd).unwrap();
    let unfit = file.to_str().unwrap();
    for (arguments, message) in [
        (
            &["search", "nominal", "--attack-space", "paths"][..],
            "no attack space `paths`; there are: broker, display, memory, path",
        ),
        (
            &["search", "nominal", "--waive", "boundary.fresh"],
            "no check `boundary.fresh`; there are: boundary.freshness",
        ),
        (&["search", "teammate"], "`teammate` has several cells; choose one with --cell"),
        (&["search", "certificates"], "runs on the real stacks in memory; a search needs the twin"),
        (&["search", "nominal", "--find", "INVALID"], "no class that can be found"),
        (&["search", "nominal", "--exhaust", "6"], "exhaust fewer actions"),
        (
            &["search", "localisation_drift", "--attack-space", unfit],
            "action type odd of attack space odd does not fit `localisation_drift`",
        ),
    ] {
        let output = holdsafe(arguments);
        let screen = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {screen}");
        assert!(screen.contains(message), "{arguments:?}: {screen}");
    }
}
