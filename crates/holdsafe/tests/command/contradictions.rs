//! Results that contradict their recordings or their trials, files that no command replaces, and runs that ended early.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;

use super::evidence::recorded;
use super::verification::{bounded, output_text};
use super::{holdsafe, lock_machine, root};

/// The exit code and the words of a command.
fn run_command(arguments: &[&str]) -> (Option<i32>, String) {
    let output: Output = holdsafe(arguments);
    (output.status.code(), output_text(&output))
}

/// Replaces text in a file, at least once.
fn change(file: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(file).unwrap();
    assert!(text.contains(from), "{from} is not in {}", file.display());
    fs::write(file, text.replace(from, to)).unwrap();
}

/// Every command that shows a result or its recordings ends with exit code 4, with this reason.
fn all_refuse(dir: &Path, run: &Path, reason: &str) {
    let (page, folder) = (dir.join("page.html"), dir.join("thermal_loss"));
    let [page, folder, run] = [page.as_path(), &folder, run].map(|path| path.to_str().unwrap());
    for line in [
        &["report", folder, "--out", page][..],
        &["report", run, "--out", page],
        &["report", folder, "--format", "cite"],
        &["inspect", "explain", run],
        &["inspect", "verify", run],
    ] {
        let (code, text) = run_command(line);
        assert_eq!(code, Some(4), "{line:?}: {text}");
        assert!(text.contains(reason), "{line:?}: {text}");
    }
}

#[test]
fn changed_class_in_a_result_is_noticed() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "thermal_loss");
    let (result, page) = (dir.path().join("thermal_loss/result.json"), dir.path().join("page.html"));
    let whole = fs::read_to_string(&result).unwrap();
    // A change in its trial and its summary.
    change(&result, "DEGRADED\": 1", "HOLD_SAFE\": 1");
    change(&result, "\"outcome\": \"DEGRADED\"", "\"outcome\": \"HOLD_SAFE\"");
    all_refuse(dir.path(), &run, "result.json says HOLD_SAFE, the recording DEGRADED");
    // A change in its summary alone.
    fs::write(&result, &whole).unwrap();
    change(&result, "DEGRADED\": 1", "HOLD_SAFE\": 1");
    for line in [
        &["report", result.to_str().unwrap(), "--out", page.to_str().unwrap()][..],
        &["report", "--format", "cite", run.to_str().unwrap()],
    ] {
        let (code, text) = run_command(line);
        assert!(code == Some(4) && text.contains("its trials are DEGRADED 1, its summary says HOLD_SAFE 1"), "{text}");
    }
}

#[test]
fn whole_recording_of_another_run_is_noticed() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "thermal_loss");
    let output = holdsafe(&[
        "run",
        "thermal_loss",
        "--trials",
        "1",
        "--seed",
        "5",
        "--out",
        dir.path().join("fifth").to_str().unwrap(),
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", output_text(&output));
    fs::remove_dir_all(&run).unwrap();
    fs::rename(dir.path().join("fifth/twin/thermal_loss/5"), &run).unwrap();
    all_refuse(dir.path(), &run, "result.json names another recording of this trial");
}

#[test]
fn changed_campaign_is_noticed() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let page = dir.path().join("page.html");
    let [out_name, page] = [&out, &page].map(|path| path.to_str().unwrap());
    let campaign = ["campaign", "run", "loss", "--trials", "3", "--quiet", "--out", out_name];
    assert_eq!(run_command(&campaign).0, Some(0));
    assert_eq!(run_command(&["report", out_name, "--out", page]).0, Some(0));
    let result = out.join("campaign.json");
    let whole = fs::read_to_string(&result).unwrap();
    change(&result, "HOLD_SAFE", "REJECTED");
    let (code, text) = run_command(&["report", out_name, "--out", page]);
    assert!(code == Some(4) && text.contains("does not follow from the finished trials"), "{text}");
    fs::write(&result, whole).unwrap();
    change(&out.join("trials.jsonl"), "HOLD_SAFE", "REJECTED");
    for line in [&["report", out_name, "--out", page][..], &campaign] {
        let (code, text) = run_command(line);
        assert!(code == Some(2) && text.contains("trials.jsonl:1: changed by hand"), "{text}");
    }
}

#[test]
fn report_replaces_no_evidence() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "loss");
    let folder = dir.path().join("loss");
    let link = dir.path().join("link.html");
    symlink(folder.join("result.json"), &link).unwrap();
    let before = fs::read(folder.join("result.json")).unwrap();
    let contradictions: [PathBuf; 6] = [
        run.join("recording/audit-0.mcap"),
        run.join("new.html"),
        folder.join("result.json"),
        folder.join("manifest.json"),
        folder.join("loss.jsonl"),
        link,
    ];
    let text = folder.to_str().unwrap();
    for over in &contradictions {
        let contradiction = over.to_str().unwrap();
        let page = dir.path().join("page.html");
        for (line, option) in [
            (&["report", text, "--out", contradiction][..], "--out"),
            (&["report", text, "--out", page.to_str().unwrap(), "--sarif", contradiction], "--sarif"),
        ] {
            let (code, words) = run_command(line);
            assert!(code == Some(2) && words.contains("name another file"), "{line:?}: {words}");
            assert!(words.contains(&format!("{option} {contradiction}: ")), "{line:?}: {words}");
        }
    }
    assert_eq!(run_command(&["inspect", "verify", run.to_str().unwrap()]).0, Some(0));
    assert_eq!(fs::read(folder.join("result.json")).unwrap(), before);
    let path = folder.join("report.html");
    for _ in 0..2 {
        assert_eq!(
            run_command(&["report", text, "--out", path.to_str().unwrap()]).0,
            Some(0),
            "its own page is replaced"
        );
    }
}

#[test]
fn twin_run_shows_its_last_view_and_cannot_be_followed() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "loss");
    let path = run.to_str().unwrap();
    let (got, text) = run_command(&["watch", path]);
    assert!(got == Some(0) && text.contains("REPLAY of a recording") && text.contains("unit-a   "), "{text}");
    let (got, text) = run_command(&["watch", "--web", path]);
    assert!(got == Some(4) && text.contains("is over") && text.contains("--window"), "{text}");
    let (got, text) = run_command(&["inspect", "replay", path]);
    assert!(got == Some(2) && text.contains("a run in the twin") && text.contains("no input journals"), "{text}");
    fs::remove_file(run.join("held.json")).unwrap();
    let (code, text) = run_command(&["inspect", "verify", run.to_str().unwrap()]);
    assert!(code == Some(4) && text.contains("held.json") && text.contains("nothing is verified"), "{text}");
}

/// Its length is compared before a byte is read.
#[test]
fn recording_that_grew_is_named_by_its_length() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "loss");
    let file = fs::OpenOptions::new().write(true).open(run.join("recording/audit-0.mcap")).unwrap();
    file.set_len(1 << 40).unwrap();
    for verb in ["verify", "explain"] {
        let output = bounded(&["inspect", verb, run.to_str().unwrap()]);
        let text = output_text(&output);
        assert!(text.contains("recording/audit-0.mcap: 1099511627776 bytes, the run left "), "{verb}: {text}");
    }
}

#[test]
fn interrupted_live_run_is_sealed_so_far() {
    let _alone = lock_machine();
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let mut child = Command::new(env!("CARGO_BIN_EXE_holdsafe"))
        .args([
            "--root",
            root().to_str().unwrap(),
            "run",
            "nominal",
            "--live",
            "--quiet",
            "--out",
            out.to_str().unwrap(),
        ])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Entries are recorded before the run begins, and the console's journal grows with it.
    let run = out.join("live/nominal/1");
    let begun = || fs::metadata(run.join("inputs/console.cbor")).is_ok_and(|log| log.len() > 20_000);
    while !begun() {
        assert_eq!(child.try_wait().unwrap(), None, "it ended before it was interrupted");
        std::thread::yield_now();
    }
    kill(Pid::from_raw(child.id() as i32), Signal::SIGINT).unwrap();
    let output = child.wait_with_output().unwrap();
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(130), "{words}");
    assert!(words.contains("sealed as far as it came"), "{words}");
    let verified = super::started(&["inspect", "verify", run.to_str().unwrap(), "--json"]);
    let object: Value = serde_json::from_slice(&verified.stdout).unwrap();
    // On a busy host some entries came late, too.
    assert_eq!((verified.status.code(), object["sealed"].as_bool()), (Some(4), Some(true)), "{object}");
    assert!(object["ended"].as_str().unwrap().contains("stopped by the user at "), "{object}");
}
