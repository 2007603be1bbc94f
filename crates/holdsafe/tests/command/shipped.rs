//! The program in a directory without a checkout: it has the shipped files with it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::PoisonError;

use serde_json::Value;
use tempfile::TempDir;

use super::{MACHINE, golden, root};

/// A directory without a checkout, and its own cache.
struct Bare {
    here: TempDir,
    cache: TempDir,
}

impl Bare {
    fn new() -> Self {
        Self { here: tempfile::tempdir().unwrap(), cache: tempfile::tempdir().unwrap() }
    }

    fn holdsafe(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_holdsafe"));
        command.args(arguments).current_dir(self.here.path()).env("XDG_CACHE_HOME", self.cache.path());
        let _shared = MACHINE.read().unwrap_or_else(PoisonError::into_inner);
        let output = command.output().unwrap();
        golden::hold(&output.stdout);
        output
    }

    /// The object that a command prints which succeeds.
    fn object(&self, arguments: &[&str]) -> Value {
        let output = self.holdsafe(arguments);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    }

    /// The one folder that the files were unpacked into.
    fn unpacked(&self) -> PathBuf {
        let made: Vec<PathBuf> =
            fs::read_dir(self.cache.path().join("holdsafe")).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert_eq!(made.len(), 1, "{made:?}");
        made[0].clone()
    }
}

/// The path of the checkout, absolute.
fn checkout() -> String {
    root().canonicalize().unwrap().to_str().unwrap().to_owned()
}

#[test]
fn scenario_runs_the_same_without_a_checkout() {
    let bare = Bare::new();
    let run = ["run", "loss", "--trials", "1", "--json", "--quiet"];
    let in_checkout = bare.object(&[&["--root", &checkout()], &run[..]].concat());
    assert!(!bare.cache.path().join("holdsafe").exists(), "a named root needs no files of the program");
    let built_in = bare.object(&run);
    assert_eq!(built_in["trials"][0]["outcome"], "HOLD_SAFE");
    assert_eq!(built_in["trials"], in_checkout["trials"]);
    let waived = ["run", "loss", "--trials", "1", "--json", "--policy", "policies/freshness-waived.toml"];
    assert_eq!(bare.object(&waived)["trials"].as_array().unwrap().len(), 1, "a policy by its path below the root");
}

#[test]
fn every_shipped_file_comes_with_the_program() {
    let bare = Bare::new();
    bare.object(&["scenario", "check", "--json"]);
    let (checkout, unpacked) = (root(), bare.unpacked());
    let mut compared = 0;
    let mut folders: Vec<PathBuf> = ["scenarios", "platforms", "policies", "references"].map(PathBuf::from).into();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(checkout.join(&folder)).unwrap().map(|entry| entry.unwrap()) {
            let path = folder.join(entry.file_name());
            if entry.file_type().unwrap().is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "toml" || ending == "jsonl") {
                let read = |root: &Path| fs::read(root.join(&path)).unwrap();
                assert_eq!(read(&unpacked), read(&checkout), "{}", path.display());
                compared += 1;
            }
        }
    }
    assert!(compared > 200, "{compared}");
}

#[test]
fn altered_file_is_noticed_and_written_anew() {
    let bare = Bare::new();
    let check = ["scenario", "check", "loss", "--json"];
    bare.object(&check);
    let file = bare.unpacked().join("scenarios/telemetry/loss.toml");
    let text = fs::read(&file).unwrap();
    fs::remove_file(&file).unwrap();
    fs::write(&file, "name = \"other\"").unwrap();
    let output = bare.holdsafe(&check);
    assert_eq!(output.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&output.stderr).contains("loss.toml: not as the program has it"), "{output:?}");
    assert_eq!(fs::read(&file).unwrap(), text);
}

#[test]
fn named_root_and_checkout_precede_built_in_files() {
    let bare = Bare::new();
    let checked = |arguments: &[&str]| {
        let object = bare.object(&[arguments, &["scenario", "check", "loss", "--json"]].concat());
        PathBuf::from(object["files"][0]["file"].as_str().unwrap())
    };
    let reason = || {
        let doctor: Value = serde_json::from_slice(&bare.holdsafe(&["doctor", "--json"]).stdout).unwrap();
        doctor["root"].as_str().unwrap().to_owned()
    };
    assert!(checked(&["--root", &checkout()]).starts_with(checkout()));
    assert!(checked(&[]).starts_with(bare.unpacked()));
    assert_eq!(reason(), "built-in");
    for folder in ["scenarios", "platforms"] {
        fs::create_dir(bare.here.path().join(folder)).unwrap();
    }
    assert_eq!(reason(), "checkout");
    let run = bare.holdsafe(&["run", "loss", "--trials", "1"]);
    assert_ne!(run.status.code(), Some(0), "this checkout is empty, and no other files take its place");
}

#[test]
fn output_without_a_checkout_lies_below_here() {
    let bare = Bare::new();
    let matrix = bare.holdsafe(&["matrix", "--rows", "N0", "--trials", "1", "--seed", "1", "--quiet"]);
    assert_eq!(matrix.status.code(), Some(0), "{}", String::from_utf8_lossy(&matrix.stderr));
    assert!(bare.here.path().join("runs/matrix/matrix.json").is_file());
    assert!(!bare.unpacked().join("runs").exists());
    let renewed = bare.holdsafe(&["evaluate", "--reproduce", "--renew"]);
    assert_eq!(renewed.status.code(), Some(2), "references of the program are not written");
}

#[test]
fn jobs_without_a_checkout_name_no_root() {
    let bare = Bare::new();
    let command = ["--", "campaign", "run", "loss", "--trials", "4"];
    let emitted = bare.holdsafe(&[&["emit", "make", "--partitions", "2", "--out", "jobs"], &command[..]].concat());
    assert_eq!(emitted.status.code(), Some(0), "{}", String::from_utf8_lossy(&emitted.stderr));
    for script in ["part", "merge", "look"] {
        let text = fs::read_to_string(bare.here.path().join("jobs").join(script)).unwrap();
        assert!(!text.contains("--root") && !text.contains(bare.cache.path().to_str().unwrap()), "{script}: {text}");
    }
}
