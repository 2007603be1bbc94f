//! Explanations, reports and replays of kept runs.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use super::judge::Line;
use super::{holdsafe, root};

/// The directory of one recorded trial of a scenario in the twin.
pub(super) fn recorded(dir: &Path, scenario: &str) -> PathBuf {
    let out = dir.join(scenario);
    let output = holdsafe(&["run", scenario, "--trials", "1", "--quiet", "--out", out.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    out.join("twin").join(scenario).join("1")
}

pub(super) fn object(output: &Output) -> serde_json::Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {output:?}"))
}

#[test]
fn recording_and_run_have_the_same_explanation() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "thermal_loss");
    let recording = object(&holdsafe(&["inspect", "explain", run.to_str().unwrap(), "--json"]));
    let twin = object(&holdsafe(&["inspect", "explain", "thermal_loss", "--json"]));
    assert_eq!(recording["explanations"], twin["explanations"]);
    assert_eq!(twin["explanations"][0]["origin"]["place"]["sensor"], "thermal", "{twin}");
    let value =
        object(&holdsafe(&["inspect", "explain", run.to_str().unwrap(), "--why-not", "READY", "--at", "6", "--json"]));
    assert_eq!(value["why_not"]["mode"], "DEGRADED", "{value}");
}

/// Assumptions are reported where `events.jsonl` is missing.
#[test]
fn recording_is_explained_at_times_of_its_run() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "thermal_loss");
    let explain = |more: &[&str]| holdsafe(&[&["inspect", "explain", run.to_str().unwrap(), "--json"], more].concat());
    let first_time = |output: &Output| object(output)["explanations"][0]["at_us"].as_u64().unwrap();
    let (thinned, whole) = (first_time(&explain(&[])), object(&explain(&[])));
    assert!(whole.get("assumed").is_none(), "{whole}");
    // A recording of a run that began when its host's clock stood at a second.
    let log = run.join("events.jsonl");
    let text = fs::read_to_string(&log).unwrap();
    let (head, events) = text.split_once('\n').unwrap();
    let lines = events.lines().map(|line| {
        let mut line: Line = serde_json::from_str(line).unwrap();
        line.t_us = line.t_us.saturating_sub(1_000_000);
        serde_json::to_string(&line).unwrap() + "\n"
    });
    fs::write(&log, format!("{head}\n{}", lines.collect::<String>())).unwrap();
    assert_eq!(first_time(&explain(&[])), thinned - 1_000_000);
    let seconds = (thinned as f64 / 1e6 - 0.9).to_string();
    assert_eq!(first_time(&explain(&["--at", &seconds])), thinned - 1_000_000, "the change in force then");
    fs::remove_file(&log).unwrap();
    let output = explain(&[]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("no events.jsonl"), "{output:?}");
    assert!(object(&output)["assumed"].as_str().unwrap().contains("ground platform"), "{output:?}");
}

/// A cut one is explained as far as it goes.
#[test]
fn unreadable_recording_is_answered_with_one_line() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "loss");
    let file = run.join("recording/audit-0.mcap");
    let whole = fs::read(&file).unwrap();
    fs::write(&file, &whole[..whole.len() / 2]).unwrap();
    let cut = holdsafe(&["inspect", "explain", run.to_str().unwrap(), "--all"]);
    assert_eq!(cut.status.code(), Some(4), "{cut:?}");
    let text = String::from_utf8_lossy(&cut.stdout).into_owned();
    assert!(
        text.starts_with("INVALID: ") && text.contains(" to READY"),
        "first that it is cut, then what stands: {text}"
    );
    let told = holdsafe(&["inspect", "explain", run.to_str().unwrap(), "--all", "--unverified"]);
    assert_eq!(told.status.code(), Some(0), "{told:?}");
    for hostile in [vec![0xff; 4096], b"not a recording".to_vec(), Vec::new()] {
        fs::write(&file, hostile).unwrap();
        let output = holdsafe(&["inspect", "explain", run.to_str().unwrap()]);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_ne!(output.status.code(), Some(0), "{text}");
        assert!(text.lines().count() <= 2 && !text.contains("panicked"), "{text}");
    }
    let empty_output =
        holdsafe(&["inspect", "explain", dir.path().join("loss/twin/loss/1/recording").to_str().unwrap()]);
    assert_eq!(empty_output.status.code(), Some(2), "{empty_output:?}");
    assert_eq!(holdsafe(&["inspect", "explain", "loss", "--why-not", "SLEEPING"]).status.code(), Some(2));
}

/// The report is made from results and runs.
#[test]
fn report_begins_with_its_finding() {
    let dir = tempfile::tempdir().unwrap();
    let (run, page, figures) =
        (recorded(dir.path(), "thermal_loss"), dir.path().join("r.html"), dir.path().join("figures"));
    let result = dir.path().join("thermal_loss");
    let texts = [result.to_str().unwrap(), run.to_str().unwrap(), "--out", page.to_str().unwrap()];
    let (junit, sarif, sbom) = (dir.path().join("j.xml"), dir.path().join("s.json"), dir.path().join("b.json"));
    let [junit, sarif, sbom] = [&junit, &sarif, &sbom].map(|file| file.to_str().unwrap());
    let other = ["--junit", junit, "--sarif", sarif, "--sbom", sbom, "--figures", figures.to_str().unwrap()];
    let output = holdsafe(&[&["report"], &texts[..], &other].concat());
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(fs::read_to_string(junit).unwrap().contains("thermal_loss"));
    assert!(fs::read_to_string(sarif).unwrap().contains("\"2.1.0\""));
    assert!(
        fs::read_to_string(sbom).unwrap().contains("scenarios/perception/thermal_loss.toml"),
        "the run's inputs are in it"
    );
    let text = fs::read_to_string(&page).unwrap();
    let (head, body) = text.split_once("<main>").expect("a body");
    assert!(head.contains("slows the unit down"), "{head}");
    assert!(body.contains("PREPARE_TO_ACT → DEGRADED: Thermal camera lost"), "{body}");
    assert!(body.contains("fault of Thermal: Dropout"), "the attack is drawn");
    let drawn: Vec<String> =
        fs::read_dir(&figures).unwrap().map(|f| f.unwrap().file_name().into_string().unwrap()).collect();
    assert!(
        ["svg", "csv", "tex", "txt"]
            .iter()
            .all(|kind| drawn.iter().any(|f| f.starts_with("run-") && f.ends_with(kind)))
    );
}

/// Drawn in the report of a recorded run.
#[test]
fn hang_known_to_the_launcher_is_drawn_once() {
    let dir = tempfile::tempdir().unwrap();
    let (run, page) = (recorded(dir.path(), "process_ends"), dir.path().join("r.html"));
    let output = holdsafe(&["report", run.to_str().unwrap(), "--out", page.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert_eq!(fs::read_to_string(&page).unwrap().matches("<td>hang of gateway</td>").count(), 1);
}

#[test]
fn report_refuses_unknown_and_repeated_inputs() {
    let dir = tempfile::tempdir().unwrap();
    recorded(dir.path(), "loss");
    let (result, page) = (dir.path().join("loss"), dir.path().join("r.html"));
    let refused = |texts: &[&str]| {
        let output = holdsafe(&[&["report"], texts, &["--out", page.to_str().unwrap()]].concat());
        assert_eq!((output.status.code(), page.exists()), (Some(2), false), "{output:?}");
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let file = result.join("result.json");
    assert!(refused(&[result.to_str().unwrap(), file.to_str().unwrap()]).contains("give each once"));
    assert!(refused(&[result.join("manifest.json").to_str().unwrap()]).contains("no `kind`"));
    let empty_folder = tempfile::tempdir().unwrap();
    assert!(refused(&[empty_folder.path().to_str().unwrap()]).contains("neither a recorded run"));
}

/// Another policy is asked of the same inputs.
#[test]
fn replayed_cores_give_every_byte_again() {
    let same = object(&holdsafe(&["inspect", "replay", "replay", "--json"]));
    assert_eq!(same["identical"], true, "{same}");
    let policy = root().join("policies/freshness-waived.toml");
    let requested = object(&holdsafe(&["inspect", "replay", "replay", "--policy", policy.to_str().unwrap(), "--json"]));
    assert!(requested["watermark"].as_str().is_some_and(|mark| mark.starts_with("ABLATION")), "{requested}");
    let core = |name: &str| requested["cores"].as_array().unwrap().iter().find(|c| c["core"] == name).cloned().unwrap();
    assert_eq!(core("sim").get("first"), None, "{requested}");
    let first = &core("gateway")["first"];
    assert_eq!(
        (&first["then"][0]["reason"], &first["now"][0]["reason"]),
        (&"no_echo".into(), &"session".into()),
        "{first}"
    );
    let output = holdsafe(&[
        "inspect",
        "replay",
        root().join("policies").to_str().unwrap(),
        "--policy",
        policy.to_str().unwrap(),
    ]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
}

#[test]
fn two_runs_are_set_side_by_side() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "replay");
    let same = object(&holdsafe(&["inspect", "diff", run.to_str().unwrap(), "replay", "--json"]));
    assert_eq!(same["same_log"], true, "{same}");
    let policy = root().join("policies/session-only.toml");
    let cell = ["--cell", "verbatim/present/origin-signed", "--policy", policy.to_str().unwrap()];
    let output = holdsafe(&[&["inspect", "diff", "teammate", "--json"], &cell[..]].concat());
    assert_eq!(output.status.code(), Some(3), "{output:?}");
    let other = object(&output);
    let gateway =
        other["first"].as_array().unwrap().iter().find(|f| f["node"] == "gateway").expect("the boundary differs");
    assert_eq!(
        (&gateway["a"]["event"]["reason"], &gateway["b"]["event"]["is"]),
        (&"origin".into(), &"accepted".into()),
        "{gateway}"
    );
    assert_eq!(holdsafe(&["inspect", "diff", "replay"]).status.code(), Some(2));
}
