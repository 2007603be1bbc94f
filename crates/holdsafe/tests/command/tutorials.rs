//! Tutorials: the commands of each page run word for word in one fresh folder, and their output has every line that the page shows.
//!
//! Prose is not checked, nor are keys and clicks.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::PoisonError;

use super::live::TRIES;
use super::{MACHINE, lock_machine, root};

/// Tutorials, below `docs/`.
const PAGES: [&str; 5] = [
    "operator/first-shift.md",
    "researcher/first-attack.md",
    "researcher/first-recording.md",
    "researcher/first-ros2-node.md",
    "reviewer/first-audit.md",
];

/// Words of a tutorial, its blocks included.
const LONGEST: usize = 400;

/// Folders of a clone, which commands in its root may name.
const CLONE: [&str; 6] = ["crates", "guests", "platforms", "policies", "scenarios", "tools"];

/// A `sh` block, and the lines of the `text` block below it.
struct Step {
    commands: String,
    shown: Vec<String>,
}

fn text_of(page: &str) -> String {
    fs::read_to_string(root().join("docs").join(page)).unwrap()
}

fn steps(page: &str) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
    for block in text_of(page).split("```").skip(1).step_by(2) {
        let (language, body) = block.split_once('\n').unwrap();
        match (language, steps.last_mut()) {
            ("sh", _) => steps.push(Step { commands: body.to_owned(), shown: Vec::new() }),
            ("text", Some(step)) => step.shown.extend(body.lines().map(str::to_owned)),
            (language, _) => panic!("{page}: `sh` and then `text` expected, got `{language}`"),
        }
    }
    steps
}

/// A folder without files of its own, from which the clone's folders are seen as from its root.
fn fresh_folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let root = root().canonicalize().unwrap();
    for name in CLONE {
        symlink(root.join(name), folder.path().join(name)).unwrap();
    }
    folder
}

/// Both streams of a block's commands, in their order.
fn output_of(commands: &str, folder: &Path) -> String {
    let script = format!("exec 2>&1\nholdsafe() {{ '{}' \"$@\"; }}\n{commands}", env!("CARGO_BIN_EXE_holdsafe"));
    let mut shell = Command::new("bash");
    let output = shell.args(["-c", &script]).current_dir(folder).stdin(Stdio::null()).output().unwrap();
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Lines of a page that are not in the output, each with the commands and output of its block.
fn lines_not_shown(page: &str) -> Vec<String> {
    let folder = fresh_folder();
    let mut missing = Vec::new();
    for Step { commands, shown } in steps(page) {
        let output = output_of(&commands, folder.path());
        let absent = shown.iter().filter(|line| !output.contains(line.as_str()));
        missing
            .extend(absent.map(|line| format!("{line}\n--- is no part of\n{commands}--- with the output\n{output}")));
    }
    missing
}

fn runs_word_for_word(page: &str) {
    let _shared = MACHINE.read().unwrap_or_else(PoisonError::into_inner);
    let missing = lines_not_shown(page);
    assert!(missing.is_empty(), "{page}: {}", missing.join("\n"));
}

#[test]
#[ignore = "long: a whole tutorial"]
fn first_attack_runs_word_for_word() {
    runs_word_for_word("researcher/first-attack.md");
}

#[test]
#[ignore = "long: a whole tutorial"]
fn first_recording_runs_word_for_word() {
    runs_word_for_word("researcher/first-recording.md");
}

#[test]
#[ignore = "long: a whole tutorial"]
fn first_audit_runs_word_for_word() {
    runs_word_for_word("reviewer/first-audit.md");
}

/// With ROS 2 in the clone, where the page's first command has nothing left to install.
#[test]
#[ignore = "long: a whole tutorial"]
fn first_ros2_node_runs_word_for_word() {
    let python = root().join("guests/ros2/.venv/bin/python");
    let imported = Command::new(python).args(["-c", "import rclpy"]).output();
    if !imported.is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: rclpy is not installed (make -C guests/ros2)");
        return;
    }
    runs_word_for_word("researcher/first-ros2-node.md");
}

/// A live run, which a busy host may spoil.
#[test]
#[ignore = "long: a whole tutorial"]
fn first_shift_runs_word_for_word() {
    let _alone = lock_machine();
    let mut missing = Vec::new();
    for _ in 0..TRIES {
        missing = lines_not_shown("operator/first-shift.md");
        if missing.is_empty() {
            return;
        }
    }
    panic!("each of {TRIES} times: {}", missing.join("\n"));
}

#[test]
fn every_tutorial_is_listed_short_and_tested() {
    let mut found = BTreeSet::new();
    for folder in ["developer", "operator", "reference", "researcher", "reviewer"] {
        let files = fs::read_dir(root().join("docs").join(folder)).unwrap();
        let names = files.map(|file| file.unwrap().file_name().into_string().unwrap());
        found.extend(names.filter(|name| name.starts_with("first-")).map(|name| format!("{folder}/{name}")));
    }
    assert_eq!(found, PAGES.map(str::to_owned).into());
    let index = text_of("README.md");
    for page in PAGES {
        assert!(index.contains(&format!("]({page})")), "docs/README.md does not list {page}");
        let words = text_of(page).split_whitespace().count();
        assert!(words <= LONGEST, "{page} has {words} words");
        let steps = steps(page);
        assert!(
            !steps.is_empty() && steps.iter().all(|step| !step.shown.is_empty()),
            "{page}: a block shows no output"
        );
    }
}

/// Links of the form [`Type::item`](file), apart from those to pages.
fn symbols(text: &str) -> Vec<(&str, &str)> {
    let links = text.split("[`").skip(1).filter_map(|rest| rest.split_once("`]("));
    let links = links.filter_map(|(symbol, rest)| Some((symbol, rest.split(')').next()?)));
    links.filter(|(_, file)| !file.ends_with(".md")).collect()
}

#[test]
fn symbols_stand_in_the_linked_files() {
    let page = "reviewer/first-audit.md";
    let (text, folder) = (text_of(page), root().join("docs/reviewer"));
    let symbols = symbols(&text);
    assert!(symbols.len() >= 3, "{symbols:?}");
    for (symbol, file) in symbols {
        let source = fs::read_to_string(folder.join(file)).unwrap();
        let names: BTreeSet<&str> = source.split(|c: char| !c.is_alphanumeric() && c != '_').collect();
        assert!(symbol.split("::").all(|name| names.contains(name)), "{page}: {file} has no `{symbol}`");
    }
}
