//! Verdicts of `verify` on a run directory with changed, added or removed parts; and files that no command overwrites.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use evidence::anchors::{ClockAnchor, TrustAnchors};
use evidence::log::by_recorder;
use link::instrument::Frame;
use link::mcap_frames::frames_of_folder;
use link::recorder::Recording;
use recording::RunFolder;
use recording::anchors::{read_anchors, write_anchors};
use wire::id::NodeId;

use super::evidence::recorded;
use super::{holdsafe, root};

fn verify(run: &Path) -> Output {
    holdsafe(&["inspect", "verify", run.to_str().unwrap()])
}

pub(super) fn output_text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// Every file of a run directory but `held.json`.
fn files(run: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![run.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.file_name().unwrap() != "held.json" {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// The bit may be anywhere in a run directory.
#[test]
fn flipped_bit_is_found_and_its_file_named() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "loss");
    assert_eq!(verify(&run).status.code(), Some(0), "untouched");
    let files = files(&run);
    assert!(files.len() > 1, "{files:?}");
    for file in files {
        let whole = fs::read(&file).unwrap();
        let name = file.strip_prefix(&run).unwrap().display().to_string();
        // Some of these are in an entry, and most are not.
        for at in (0..whole.len()).step_by(whole.len().div_ceil(12)).chain([whole.len() - 1]) {
            let mut changed = whole.clone();
            changed[at] ^= 1 << (at % 8);
            fs::write(&file, changed).unwrap();
            let output = verify(&run);
            assert_eq!(output.status.code(), Some(4), "byte {at} of {name}: {}", output_text(&output));
            assert!(output_text(&output).contains(&name), "byte {at} of {name}: {}", output_text(&output));
        }
        fs::write(&file, whole).unwrap();
    }
    assert_eq!(verify(&run).status.code(), Some(0), "as it was");
}

#[test]
fn missing_and_foreign_files_are_found() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "loss");
    let added = run.join("recording/audit-1.mcap");
    fs::copy(run.join("recording/audit-0.mcap"), &added).unwrap();
    let output = verify(&run);
    assert_eq!(output.status.code(), Some(4), "{}", output_text(&output));
    assert!(output_text(&output).contains("recording/audit-1.mcap"), "{}", output_text(&output));
    fs::remove_file(added).unwrap();
    for name in ["events.jsonl", "recording/audit-0.mcap"] {
        let (file, aside) = (run.join(name), dir.path().join("aside"));
        fs::rename(&file, &aside).unwrap();
        let output = verify(&run);
        assert_eq!(output.status.code(), Some(4), "{name}: {}", output_text(&output));
        assert!(output_text(&output).contains(name), "{name}: {}", output_text(&output));
        fs::rename(&aside, &file).unwrap();
    }
    assert_eq!(verify(&run).status.code(), Some(0), "as it was");
}

/// Writes the recording again with only the frames for which `keep` gives one.
fn rewrite(run: &Path, keep: impl Fn(Frame) -> Option<Frame>) {
    let folder = run.join("recording");
    let all = frames_of_folder(&folder).unwrap();
    fs::remove_dir_all(&folder).unwrap();
    let mut recording = Recording::new(folder);
    all.into_iter().filter_map(keep).for_each(|frame| recording.write(frame));
    assert_eq!(recording.finish().lost, 0);
}

/// A recording with the guards' entries zeroed is INVALID as well.
#[test]
fn recording_without_its_guards_is_invalid() {
    let dir = tempfile::tempdir().unwrap();
    let guard = |node: NodeId| node.name().starts_with("guard-");
    for (what, scenario) in [("taken out", "loss"), ("zeroed", "delay")] {
        let run = recorded(dir.path(), scenario);
        let mut of_guards = 0;
        frames_of_folder(&run.join("recording"))
            .unwrap()
            .iter()
            .for_each(|frame| of_guards += usize::from(guard(frame.node)));
        assert!(of_guards > 100, "{of_guards}");
        rewrite(&run, |frame| match guard(frame.node) {
            true if what == "taken out" => None,
            true => Some(Frame { bytes: vec![0; frame.bytes.len()], ..frame }),
            false => Some(frame),
        });
        let output = verify(&run);
        assert_eq!(output.status.code(), Some(4), "{what}: {}", output_text(&output));
        assert!(output_text(&output).contains("guard-unit-a"), "{what}, by its chain: {}", output_text(&output));
    }
}

#[test]
fn what_the_launcher_noted_cannot_be_taken_out() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "process_ends");
    rewrite(&run, |frame| (frame.node != NodeId::CAMPAIGN).then_some(frame));
    let output = verify(&run);
    assert_eq!(output.status.code(), Some(4), "{}", output_text(&output));
    assert!(output_text(&output).contains("campaign, boot 1 wrote"), "by its chain: {}", output_text(&output));
}

/// A second run into the same folder is refused, and the kept run stays as it was.
#[test]
fn kept_run_is_not_overwritten() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "loss");
    let tree = |path: &Path| files(path).into_iter().map(|file| fs::read(file).unwrap()).collect::<Vec<_>>();
    let before = tree(dir.path());
    let out = dir.path().join("loss");
    let output = holdsafe(&["run", "loss", "--trials", "1", "--quiet", "--out", out.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2), "{}", output_text(&output));
    assert!(output_text(&output).contains("twin/loss/1"), "which folder: {}", output_text(&output));
    assert!(tree(dir.path()) == before, "something was written");
    assert_eq!(verify(&run).status.code(), Some(0));
    let other = holdsafe(&["run", "loss", "--trials", "1", "--seed", "2", "--quiet", "--out", out.to_str().unwrap()]);
    assert_eq!(other.status.code(), Some(2), "{}", output_text(&other));
    assert!(
        output_text(&other).contains("results of another run (seed: 1, this one has 2); name another --out"),
        "{}",
        output_text(&other)
    );
    assert!(tree(dir.path()) == before, "something was written");
    let live = run.to_str().unwrap();
    let output = holdsafe(&["run", "--live", "--watch", "loss", "--out", live]);
    assert_eq!(output.status.code(), Some(2), "{}", output_text(&output));
    assert_eq!(verify(&run).status.code(), Some(0), "{}", output_text(&verify(&run)));
}

#[test]
fn an_export_over_what_it_reads_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "loss");
    let scenario = dir.path().join("loss.toml");
    fs::copy(root().join("scenarios/telemetry/loss.toml"), &scenario).unwrap();
    fs::create_dir_all(dir.path().join("scenes")).unwrap();
    fs::copy(root().join("scenarios/scenes/yard.toml"), dir.path().join("scenes/yard.toml")).unwrap();
    let link = dir.path().join("link");
    symlink(&run, &link).unwrap();
    for (input, over) in [
        (&run, run.join("recording/audit-0.mcap")),
        (&run, run.join("run.mcap")),
        (&run, link.join("recording/audit-0.mcap")),
        (&link, run.join("held.json")),
        (&scenario, scenario.clone()),
    ] {
        let output =
            holdsafe(&["report", "--format", "mcap", input.to_str().unwrap(), "--out", over.to_str().unwrap()]);
        assert_eq!(output.status.code(), Some(2), "{}: {}", over.display(), output_text(&output));
        assert!(output_text(&output).contains("--out"), "{}", output_text(&output));
    }
    assert_eq!(verify(&run).status.code(), Some(0), "{}", output_text(&verify(&run)));
    assert_eq!(fs::read(&scenario).unwrap(), fs::read(root().join("scenarios/telemetry/loss.toml")).unwrap());
}

/// The command, ended after a minute: one that waits for a writer that never comes would wait for ever.
pub(super) fn bounded(arguments: &[&str]) -> Output {
    let program =
        Command::new("timeout").args(["-s", "KILL", "60", env!("CARGO_BIN_EXE_holdsafe")]).args(arguments).output();
    program.unwrap()
}

/// A recording that is no regular file, such as a pipe.
#[test]
fn irregular_recording_is_refused_without_waiting() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "loss");
    let pipe = dir.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for name in ["recording/audit-0.mcap", "held.json", "events.jsonl"] {
        let (file, aside) = (run.join(name), dir.path().join("aside"));
        fs::rename(&file, &aside).unwrap();
        for target in [pipe.as_path(), Path::new("/dev/zero")] {
            symlink(target, &file).unwrap();
            for command in ["verify", "explain"] {
                let output = bounded(&["inspect", command, run.to_str().unwrap()]);
                let code = output.status.code();
                assert!(!matches!(code, None | Some(124 | 137)), "{command}: {name} as {}: it waits", target.display());
                assert_ne!(code, Some(101), "{command}: {name} as {}: {}", target.display(), output_text(&output));
                if command == "verify" {
                    assert!(matches!(code, Some(2 | 4)), "{name} as {}: {}", target.display(), output_text(&output));
                    assert!(output_text(&output).contains("regular file"), "{}", output_text(&output));
                }
            }
            fs::remove_file(&file).unwrap();
        }
        fs::rename(&aside, &file).unwrap();
    }
}

/// Lays a run of the twin out as a live one is: guards and launcher keep their own logs. Gives its trust anchors.
fn as_live(run: &Path) -> TrustAnchors {
    let (mut anchors, _) = read_anchors(&RunFolder::new(run)).unwrap();
    let all = frames_of_folder(&run.join("recording")).unwrap();
    let mut witnesses: Vec<NodeId> = all.iter().map(|frame| frame.node).filter(|node| !by_recorder(*node)).collect();
    witnesses.sort();
    witnesses.dedup();
    for node in witnesses {
        let node_entries = all.iter().filter(|frame| frame.node == node).map(|frame| frame.bytes.as_slice());
        link::witness::write_entries(&run.join(format!("guard/{node}.cbor")), node_entries).unwrap();
        anchors.clocks.insert(node, ClockAnchor::default());
    }
    rewrite(run, |frame| by_recorder(frame.node).then_some(frame));
    seal_anew(run, &anchors);
    anchors
}

/// A recording without the result of its command, as it is handed on.
fn handed_on(dir: &Path, scenario: &str) -> PathBuf {
    let run = recorded(dir, scenario);
    fs::remove_file(dir.join(scenario).join("result.json")).unwrap();
    run
}

/// Makes the digests of a changed directory again, as an attacker can.
fn seal_anew(run: &Path, anchors: &TrustAnchors) {
    fs::remove_file(run.join("held.json")).unwrap();
    write_anchors(&RunFolder::new(run), anchors).unwrap();
}

/// A guard's own log that ends behind its first entry, with the digests made again.
#[test]
fn truncated_guard_log_is_found_despite_new_digests() {
    let dir = tempfile::tempdir().unwrap();
    let run = handed_on(dir.path(), "process_ends");
    let anchors = as_live(&run);
    assert_eq!(verify(&run).status.code(), Some(0), "{}", output_text(&verify(&run)));
    let (_, text) = read_anchors(&RunFolder::new(&run)).unwrap();
    let logs: Vec<PathBuf> = files(&run).into_iter().filter(|file| file.parent().unwrap().ends_with("guard")).collect();
    assert!(logs.len() > 3, "{logs:?}");
    for log in logs {
        let whole = fs::read(&log).unwrap();
        let first = 4 + u32::from_be_bytes(*whole.first_chunk().unwrap()) as usize;
        for cut in [0, first] {
            fs::write(&log, &whole[..cut]).unwrap();
            seal_anew(&run, &anchors);
            let output = verify(&run);
            assert_eq!(output.status.code(), Some(4), "{}: {}", log.display(), output_text(&output));
            assert!(output_text(&output).contains("by its own account"), "{}: {}", log.display(), output_text(&output));
        }
        fs::write(&log, whole).unwrap();
    }
    seal_anew(&run, &anchors);
    let to = |digest: &str| holdsafe(&["inspect", "verify", run.to_str().unwrap(), "--held", digest]).status.code();
    assert_eq!((to(&text), to(&"0".repeat(64)), to("1")), (Some(0), Some(4), Some(2)));
}

/// A directory of a program that covered less.
#[test]
fn directory_of_an_earlier_program_lists_uncovered_parts() {
    let dir = tempfile::tempdir().unwrap();
    let run = handed_on(dir.path(), "loss");
    let (mut anchors, _) = read_anchors(&RunFolder::new(&run)).unwrap();
    anchors.files = None;
    anchors.heads.retain(|head| by_recorder(head.node));
    anchors.keys.retain(|node, _| by_recorder(*node));
    anchors.clocks.retain(|node, _| by_recorder(*node));
    fs::write(run.join("held.json"), serde_json::to_vec(&anchors).unwrap()).unwrap();
    let output = verify(&run);
    assert_eq!(output.status.code(), Some(0), "{}", output_text(&output));
    assert_eq!(output_text(&output).matches("not covered: ").count(), 2, "{}", output_text(&output));
}
