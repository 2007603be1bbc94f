//! `lab record`, `lab results` and `lab catalogue`.

use std::fs;

use serde_json::Value;

use super::{lab, root};

/// A folder that looks like the repository: the tests write no file into the real one.
fn repository() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for folder in ["scenarios", "platforms", "docs/results"] {
        fs::create_dir_all(dir.path().join(folder)).unwrap();
    }
    let rows = "[[row]]\nrecord = \"window\"\nwhat = \"records\"\nfigure = \"{/records}\"\nn = \"seed {/seed}\"\n";
    fs::write(dir.path().join("docs/results/rows.toml"), rows).unwrap();
    fs::write(dir.path().join("docs/results/by-hand.txt"), "").unwrap();
    let git = |arguments: &[&str]| {
        let own_texts = ["-c", "user.name=t", "-c", "user.email=t@example.org"];
        let done = std::process::Command::new("git").arg("-C").arg(dir.path()).args(own_texts).args(arguments).output();
        assert!(done.unwrap().status.success(), "{arguments:?}");
    };
    git(&["init", "--quiet"]);
    git(&["add", "."]);
    git(&["commit", "--quiet", "--message", "t"]);
    dir
}

#[test]
fn a_recorded_figure_is_on_the_page() {
    let dir = repository();
    let at = dir.path().to_str().unwrap();
    let lab = |arguments: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_lab"));
        command.args(["--root", at]).args(arguments).output().unwrap()
    };
    let recorded = lab(&["record", "window", "lab", "window", "--records", "100", "--seed", "3"]);
    assert_eq!(recorded.status.code(), Some(0), "{recorded:?}");
    assert_eq!(lab(&["results"]).status.code(), Some(0));
    let page = fs::read_to_string(dir.path().join("docs/results.md")).unwrap();
    assert!(page.contains("| records | 100 | seed 3 | `lab window --records 100 --seed 3` | `"), "{page}");
}

#[test]
fn only_own_programs_are_recorded() {
    let refused = lab(&["record", "x", "true"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(!root().join("docs/results/x.json").exists());
}

#[test]
fn catalogue_rows_are_one_object() {
    let object: Value = serde_json::from_slice(&lab(&["catalogue", "--json"]).stdout).unwrap();
    assert_eq!(object["kind"], "catalogue");
    assert!(!object["rows"].as_array().unwrap().is_empty());
}
