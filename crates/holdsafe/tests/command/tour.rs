//! `holdsafe tour`: rows, report and exit code of the simulated part; its live part is that of `run --live`.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;

use super::{golden, root};

/// A tour without live runs over the scenarios of `root`, into `out`.
fn tour(root: &Path, out: &Path, more: &[&str]) -> Output {
    let _shared = super::MACHINE.read().unwrap_or_else(std::sync::PoisonError::into_inner);
    let mut command = Command::new(env!("CARGO_BIN_EXE_holdsafe"));
    command.arg("--root").arg(root).args(["tour", "--twin", "--out"]).arg(out).args(more).output().unwrap()
}

#[test]
fn ctrl_c_ends_the_tour_with_a_result() {
    let dir = tempfile::tempdir().unwrap();
    let _shared = super::MACHINE.read().unwrap_or_else(std::sync::PoisonError::into_inner);
    let mut command = Command::new(env!("CARGO_BIN_EXE_holdsafe"));
    command.arg("--root").arg(root()).args(["--quiet", "tour", "--twin", "--out"]).arg(dir.path());
    let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines().map(Result::unwrap);
    assert!(lines.next().is_some_and(|line| line.starts_with("Seed 1.")));
    kill(Pid::from_raw(child.id() as i32), Signal::SIGINT).unwrap();
    let after: Vec<String> = lines.collect();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{after:?}");
    assert!(after.iter().any(|line| line.starts_with("Stopped before its end")), "{after:?}");
    let object: Value = serde_json::from_slice(&fs::read(dir.path().join("tour.json")).unwrap()).unwrap();
    golden::hold(object.to_string().as_bytes());
    assert!(object["rows"].as_array().unwrap().len() < 24 && object["interrupted"] == true, "{object}");
    assert!(!dir.path().join("report.html").exists());
}

#[test]
#[ignore = "long: a whole tour"]
fn twin_tour_shows_its_rows_and_reports() {
    let dir = tempfile::tempdir().unwrap();
    let output = tour(&root(), dir.path(), &[]);
    let (screen, words) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(0), "{screen}{words}");
    assert!(screen.lines().count() <= 60, "{screen}");
    assert!(screen.lines().all(|line| line.chars().count() <= 100), "{screen}");
    let text = fs::read_to_string(dir.path().join("tour.json")).unwrap();
    let object: Value = serde_json::from_str(&text).unwrap();
    golden::hold(object.to_string().as_bytes());
    let rows = object["rows"].as_array().unwrap();
    let cells = rows.iter().filter(|row| row["scenario"] == "teammate" && row["cell"].is_string()).count();
    assert_eq!((cells, rows.len()), (18, 24));
    assert!(rows.iter().all(|row| row["n"] == 20), "{object}");
    let guest = |conduct: &str| rows.iter().find(|row| row["guest"] == conduct).unwrap();
    let (bare, guarded) = (guest("bare"), guest("guarded"));
    assert!(bare["not_judged"].is_string() && bare["outcomes"].get("GUEST_FAILED").is_none(), "{bare}");
    assert_eq!((&guarded["as_expected"], &guarded["outcomes"]["HOLD_SAFE"]), (&true.into(), &20.into()), "{guarded}");
    let page = fs::read_to_string(dir.path().join("report.html")).unwrap();
    assert!(page.contains("thermal_loss") && screen.contains("report.html") && screen.contains("Next:"), "{screen}");
}

#[test]
#[ignore = "long: a whole tour"]
fn failed_expectation_is_named_with_exit_3() {
    let dir = tempfile::tempdir().unwrap();
    for folder in ["scenarios", "platforms", "policies"] {
        let copied = Command::new("cp").arg("-r").arg(root().join(folder)).arg(dir.path()).status().unwrap();
        assert!(copied.success(), "{folder}");
    }
    let file = dir.path().join("scenarios/control/nominal.toml");
    let text = fs::read_to_string(&file).unwrap();
    fs::write(&file, text.replacen("expected = [\"NOMINAL\"]", "expected = [\"DEGRADED\"]", 1)).unwrap();
    let output = tour(dir.path(), &dir.path().join("out"), &["--json"]);
    let line = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{line}");
    assert!(line.contains("nominal, twin: expected DEGRADED, got NOMINAL 20 of 20"), "{line}");
    assert!(line.contains("reproduce: holdsafe run nominal --trials 1 --seed 1"), "{line}");
    golden::hold(&output.stdout);
    let object: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&object["kind"], &object["as_expected"]), (&"tour".into(), &false.into()));
}
