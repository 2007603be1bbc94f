//! Log verification comes first: the answers of every command that reads a recorded run to one that is INVALID.

use std::fs;
use std::path::{Path, PathBuf};

use link::input_journal::{Header, Writer};
use serde_json::Value;
use sha2::{Digest, Sha256};
use wire::core::{Input, Output};
use wire::id::{Boot, NodeId};
use wire::time::Instant;

use super::evidence::{object, recorded};
use super::{holdsafe, root};

/// Changes one bit of a recording, in a place for which `verify` reports that the evidence does not hold.
pub(super) fn flip_a_bit(run: &Path) {
    let file = run.join("recording/audit-0.mcap");
    let whole = fs::read(&file).unwrap();
    for at in (whole.len() / 2..whole.len()).step_by(7) {
        let mut flipped = whole.clone();
        flipped[at] ^= 0x10;
        fs::write(&file, flipped).unwrap();
        if holdsafe(&["inspect", "verify", run.to_str().unwrap()]).status.code() == Some(4) {
            return;
        }
    }
    panic!("no bit matters");
}

/// Makes `held.json` cover the files that are there now, as if the run had left them, and the result name it.
fn cover(run: &Path) {
    let digest = |text: &str| evidence::log::hex(&Sha256::digest(text));
    let file = run.join("held.json");
    let before = fs::read_to_string(&file).unwrap();
    let mut held: Value = serde_json::from_str(&before).unwrap();
    held["files"] = serde_json::to_value(recording::anchors::file_digests(run).unwrap()).unwrap();
    fs::write(file, held.to_string()).unwrap();
    let result = run.ancestors().nth(3).unwrap().join("result.json");
    let text = fs::read_to_string(&result).unwrap();
    fs::write(result, text.replace(&digest(&before), &digest(&held.to_string()))).unwrap();
}

/// Adds the files that a live run has beside its recording, as far as a command needs them: the result of the replay of
/// its cores, and its console's input journal.
fn as_if_live(run: &Path) {
    fs::write(run.join("replay.json"), r#"[{"node":"gateway","inputs":3,"outputs":2,"difference":null}]"#).unwrap();
    fs::create_dir(run.join("inputs")).unwrap();
    let file = fs::File::create(run.join("inputs/console.cbor")).unwrap();
    let header = Header { node: NodeId::CONSOLE, boot: Boot(1), started: Instant(0) };
    let mut log = Writer::new(file, header, 1 << 20).unwrap();
    log.input(Instant(1), &Input::Timeout).unwrap();
    log.output(&Output::Text { text: "unit-a IDLE".to_owned(), picture: r#"{"version":1}"#.to_owned() }).unwrap();
    log.input(Instant(2), &Input::Finish).unwrap();
    drop(log);
    cover(run);
}

/// The line of each command that reads a recorded run, and its exit code for a sound one.
fn readers<'a>(run: &'a str, folder: &'a str, out: &'a str, page: &'a str) -> Vec<(Vec<&'a str>, i32)> {
    vec![
        (vec!["inspect", "explain", run], 0),
        (vec!["inspect", "explain", run, "--all", "--diagram"], 0),
        (vec!["inspect", "explain", run, "--why-not", "PREPARE_TO_ACT"], 0),
        (vec!["inspect", "replay", run], 0),
        (vec!["inspect", "diff", run, "thermal_loss"], 0),
        (vec!["inspect", "diff", "thermal_loss", run], 0),
        (vec!["report", "--format", "mcap", run, "--out", out], 0),
        (vec!["report", run, "--out", page], 0),
        (vec!["report", folder, "--out", page], 0),
        (vec!["report", "--format", "cite", folder], 0),
        (vec!["watch", run], 0),
        (vec!["watch", run, "--once"], 0),
    ]
}

/// A run to be read, and the destination of its exports.
struct Read {
    _dir: tempfile::TempDir,
    folder: PathBuf,
    run: PathBuf,
    out: PathBuf,
    page: PathBuf,
}

impl Read {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        let run = recorded(dir.path(), "thermal_loss");
        as_if_live(&run);
        let (folder, out, page) =
            (dir.path().join("thermal_loss"), dir.path().join("r.mcap"), dir.path().join("r.html"));
        Self { _dir: dir, folder, run, out, page }
    }

    fn lines(&self) -> Vec<(Vec<&str>, i32)> {
        let [run, folder, out, page] = [&self.run, &self.folder, &self.out, &self.page].map(|p| p.to_str().unwrap());
        readers(run, folder, out, page)
    }
}

fn first_line(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).lines().next().unwrap_or_default().to_owned()
}

/// The answers of every command to a run that is INVALID because of `reason`.
fn all_say_it(read: &Read, reason: &str) {
    for (line, own) in read.lines() {
        let output = holdsafe(&line);
        let first = first_line(&output.stdout);
        assert_eq!(output.status.code(), Some(4), "{line:?}: {output:?}");
        assert!(
            first.trim_start_matches("%% ").starts_with("INVALID: ") && first.contains(reason),
            "{line:?}: {first}"
        );
        let told = holdsafe(&[&line[..], &["--unverified"]].concat());
        // A broken recording may leave less to compare.
        let differs = line.contains(&"diff") && told.status.code() == Some(3);
        assert!(differs || told.status.code() == Some(own), "its own code: {line:?}: {told:?}");
        assert_eq!(first_line(&told.stdout), first, "and marked all the same");
        if line.contains(&"--diagram") {
            continue;
        }
        let output = holdsafe(&[&line[..], &["--json"]].concat());
        assert_eq!(output.status.code(), Some(4), "{line:?}: {output:?}");
        let object: Value = serde_json::from_str(&first_line(&output.stdout)).unwrap();
        let values = object["recordings"].as_array().unwrap_or_else(|| panic!("{line:?}: {object}"));
        assert!(values.len() == 1 && values[0]["valid"] == false, "{line:?}: {object}");
        assert!(values[0]["reason"].as_str().unwrap().contains(reason), "{line:?}: {object}");
        assert_eq!(values[0]["sha256"].as_str().unwrap().len(), 64);
        assert!(first_line(&output.stderr).starts_with("INVALID: "), "{line:?}: {output:?}");
    }
}

/// Each says INVALID first, with the reason, and ends with exit code 4.
#[test]
fn every_reader_reports_a_flipped_bit_first() {
    let read = Read::new();
    for (line, own) in read.lines() {
        let output = holdsafe(&line);
        assert_eq!(output.status.code(), Some(own), "{line:?}: {output:?}");
        assert!(!String::from_utf8_lossy(&output.stdout).contains("INVALID"), "{line:?}: {output:?}");
    }
    flip_a_bit(&read.run);
    all_say_it(&read, "the recording does not verify: ");
    // The window's strip is the console's own test; here no window opens for want of a display.
    let console = holdsafe(&["watch", read.run.to_str().unwrap(), "--window"]);
    assert!(first_line(&console.stdout).starts_with("INVALID: "), "{console:?}");
}

/// A run without its keys and heads, or with a trial that ended INVALID, is no better than a changed one.
#[test]
fn run_without_keys_or_valid_trial_is_invalid() {
    let read = Read::new();
    let verdict = read.run.join("verdict.json");
    let mut ended: Value = serde_json::from_str(&fs::read_to_string(&verdict).unwrap()).unwrap();
    assert_eq!((&ended["kind"], &ended["outcome"]), (&"verdict".into(), &"DEGRADED".into()), "{ended}");
    ended["outcome"] = "INVALID".into();
    ended["findings"] = serde_json::json!(["P10 at 9000 ms: the host overslept by 300 ms"]);
    fs::write(&verdict, ended.to_string()).unwrap();
    cover(&read.run);
    all_say_it(&read, "the trial itself ended INVALID: P10 at 9000 ms: the host overslept");
    let output = holdsafe(&["inspect", "verify", read.run.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(4), "{output:?}");
    assert!(first_line(&output.stdout).contains("the trial itself ended INVALID"), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("the evidence holds, of a trial that shows nothing"));
    fs::write(&verdict, "{}").unwrap();
    let output = holdsafe(&["inspect", "explain", read.run.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(4), "a class that cannot be read: {output:?}");
    fs::remove_file(&verdict).unwrap();
    let output = holdsafe(&["inspect", "explain", read.run.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(4), "{output:?}");
    assert!(first_line(&output.stdout).contains("verdict.json: missing"), "{output:?}");
    cover(&read.run);
    assert_eq!(holdsafe(&["inspect", "explain", read.run.to_str().unwrap()]).status.code(), Some(0), "none is told");
    fs::remove_file(read.run.join("held.json")).unwrap();
    let output = holdsafe(&["inspect", "explain", read.run.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(4), "{output:?}");
    assert!(first_line(&output.stdout).contains("held.json"), "{output:?}");
}

#[test]
fn explained_scenario_reports_its_invalid_trial() {
    let dir = tempfile::tempdir().unwrap();
    let nominal = fs::read_to_string(root().join("scenarios/control/nominal.toml")).unwrap();
    // No operator enables it.
    let changed = nominal.replacen("do = \"enable\"", "do = \"hold\"", 1);
    fs::create_dir(dir.path().join("scenes")).unwrap();
    fs::copy(root().join("scenarios/scenes/yard.toml"), dir.path().join("scenes/yard.toml")).unwrap();
    let file = dir.path().join("nominal.toml");
    fs::write(&file, changed).unwrap();
    let line = ["inspect", "explain", file.to_str().unwrap(), "--all"];
    let output = holdsafe(&line);
    assert_eq!(output.status.code(), Some(4), "{output:?}");
    let first = first_line(&output.stdout);
    assert!(first.starts_with("INVALID: ") && first.contains("ended INVALID: mission: "), "{first}");
    assert_eq!(holdsafe(&[&line[..], &["--unverified"]].concat()).status.code(), Some(0));
}

/// The list has each digest and verification; the first line counts them.
#[test]
fn report_lists_and_counts_each_recording() {
    let read = Read::new();
    let whole = recorded(read.folder.parent().unwrap(), "loss");
    flip_a_bit(&read.run);
    let [folder, whole, page] = [&read.folder, &whole, &read.page].map(|p| p.to_str().unwrap());
    let output = holdsafe(&["report", folder, whole, "--out", page, "--json"]);
    assert_eq!(output.status.code(), Some(4), "{output:?}");
    let text = fs::read_to_string(page).unwrap();
    let (head, body) = text.split_once("<main>").expect("a body");
    assert!(head.contains("<h1><em>1 of 2 recordings is INVALID"), "{head}");
    let (mark, sentence) = (head.find("is INVALID"), head.find("The results say"));
    assert!(mark < sentence && sentence.is_some(), "first of all: {head}");
    assert!(head.contains("No INVALID recording supports a result"), "{head}");
    let object = object(&output);
    let values = object["recordings"].as_array().unwrap();
    assert_eq!(values.iter().map(|r| r["valid"].as_bool().unwrap()).collect::<Vec<_>>(), [false, true], "{object}");
    for recording in values {
        assert!(body.contains(recording["sha256"].as_str().unwrap()), "{recording}");
    }
    assert!(body.contains("does not hold") && body.contains("<td>holds</td>"), "{body}");
}

#[test]
fn export_is_marked_where_its_run_is_invalid() {
    let read = Read::new();
    flip_a_bit(&read.run);
    let [run, out] = [&read.run, &read.out].map(|p| p.to_str().unwrap());
    let exported = object(&holdsafe(&["report", "--format", "mcap", run, "--out", out, "--json", "--unverified"]));
    let map = super::exports::message_counts(&exported);
    assert_eq!(map.get("/custody"), Some(&1), "{map:?}");
}

/// Of several runs each is listed.
#[test]
fn run_is_found_from_any_level() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "loss");
    as_if_live(&run);
    let (out, page) = (dir.path().join("r.mcap"), dir.path().join("r.html"));
    let [out, page] = [&out, &page].map(|p| p.to_str().unwrap());
    let whole = dir.path().join("loss");
    for level in [&run, run.parent().unwrap(), &whole.join("twin"), &whole] {
        let level = level.to_str().unwrap();
        let lines: [&[&str]; 7] = [
            &["inspect", "verify", level],
            &["inspect", "explain", level],
            &["inspect", "replay", level],
            &["inspect", "diff", level, "loss"],
            &["report", "--format", "mcap", level, "--out", out],
            &["report", level, "--out", page],
            &["report", "--format", "cite", level],
        ];
        for line in lines.into_iter().chain([&["watch", level, "--once"][..]]) {
            let output = holdsafe(line);
            assert_eq!(output.status.code(), Some(0), "{line:?}: {output:?}");
        }
    }
    let other = recorded(dir.path(), "thermal_loss");
    let all = dir.path().to_str().unwrap();
    for line in [
        &["inspect", "verify", all][..],
        &["inspect", "explain", all],
        &["inspect", "replay", all],
        &["inspect", "diff", all, "loss"],
        &["report", "--format", "mcap", all, "--out", out],
        &["watch", all],
        &["watch", "--sensors", all],
        &["watch", all, "--window"],
    ] {
        let output = holdsafe(line);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{line:?}: {text}");
        assert!(text.contains(run.to_str().unwrap()) && text.contains(other.to_str().unwrap()), "{line:?}: {text}");
        assert!(text.contains("name the directory of one run"), "{line:?}: {text}");
    }
    let report = object(&holdsafe(&["report", all, "--out", page, "--json"]));
    assert_eq!(report["recordings"].as_array().map(Vec::len), Some(2), "a report tells all of them: {report}");
    assert_eq!(holdsafe(&["inspect", "explain", root().join("policies").to_str().unwrap()]).status.code(), Some(2));
}
