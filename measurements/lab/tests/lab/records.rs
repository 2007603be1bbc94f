//! `lab records` and `lab catalogue`.

use std::fs;

use serde_json::Value;

use super::lab;

/// A folder that looks like the repository, with this list of records: the tests write no file into the real one.
fn repository(list: &str) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for folder in ["scenarios", "platforms", "docs/results"] {
        fs::create_dir_all(dir.path().join(folder)).unwrap();
    }
    fs::write(dir.path().join("docs/results/records.toml"), list).unwrap();
    fs::write(dir.path().join("README.md"), "Measured: 7 records, seed 1.\n").unwrap();
    dir
}

const LIST: &str = r#"
seed = 3
[[record]]
name = "window"
part = "Speed"
what = "records"
run = ["lab window --records 100", "printf 'took 5 ms'"]
tier = "hour"
minutes = 0.1
figure = "{/0/records}, {/1/ms} ms"
sample = "seed {/0/seed}"
holds = ["/0/records >= 100", "/1/ms <= 4"]
take = { ms = 'took ([0-9]+) ms' }
quotes = [{ page = "README.md", text = "Measured: {/0/records} records, seed {/0/seed}" }]
"#;

/// A stand-in for `holdsafe`, which is only asked for its version.
fn program(dir: &std::path::Path) -> String {
    let file = dir.join("holdsafe");
    let sources = env!("HOLDSAFE_PROGRAM");
    fs::write(&file, format!("#!/bin/sh\nprintf 'holdsafe 0\\ncommit abc\\nsources {sources}\\n'\n")).unwrap();
    let mut rights = fs::metadata(&file).unwrap().permissions();
    std::os::unix::fs::PermissionsExt::set_mode(&mut rights, 0o755);
    fs::set_permissions(&file, rights).unwrap();
    file.display().to_string()
}

fn records(dir: &std::path::Path, arguments: &[&str]) -> std::process::Output {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_lab"));
    let out = dir.join("out").display().to_string();
    command.args(["--root", dir.to_str().unwrap(), "records", "--out", &out, "--holdsafe", &program(dir)]);
    command.args(arguments).output().unwrap()
}

#[test]
fn a_record_is_kept_once_and_fills_the_pages() {
    let dir = repository(LIST);
    let taken = records(dir.path(), &[]);
    assert_eq!(taken.status.code(), Some(0), "{taken:?}");
    let read = |file: &str| fs::read_to_string(dir.path().join(file)).unwrap();
    let page = read("docs/results.md");
    assert!(page.contains("| records | 100, 5 ms; **does not hold**: `/1/ms <= 4` | seed 3 |"), "{page}");
    assert_eq!(read("README.md"), "Measured: 100 records, seed 3.\n");
    let kept = read("docs/results/records/window.json");
    assert!(kept.contains("\"commit\": \"abc\"") && kept.contains("--records 100 --seed 3 --json"), "{kept}");
    let listed = records(dir.path(), &["--list", "--json"]);
    let object: Value = serde_json::from_slice(&listed.stdout).unwrap();
    assert_eq!(object["records"][0]["figure"], "100, 5 ms");
    super::golden::hold(&listed.stdout);
    let checked = records(dir.path(), &["--check"]);
    assert!(String::from_utf8_lossy(&checked.stdout).contains("1 records, 0 differ"), "{checked:?}");
    // A second call has nothing left to do; changed pages are written again.
    fs::remove_dir_all(dir.path().join("out")).unwrap();
    assert_eq!(records(dir.path(), &[]).status.code(), Some(0));
    assert!(!dir.path().join("out").exists());
}

/// A figure that repeats and differs, or a claim that held and does not, is told by name.
#[test]
fn differing_record_is_told() {
    let dir = repository(&LIST.replace("tier =", "repeats = true\ntier ="));
    assert_eq!(records(dir.path(), &[]).status.code(), Some(0));
    let changed = LIST.replace("tier =", "repeats = true\ntier =").replace("took 5 ms", "took 6 ms");
    fs::write(dir.path().join("docs/results/records.toml"), changed).unwrap();
    let checked = records(dir.path(), &["--check"]);
    let said = String::from_utf8_lossy(&checked.stdout).into_owned();
    assert!(checked.status.code() == Some(3) && said.contains("`100, 6 ms`, recorded `100, 5 ms`"), "{said}");
}

#[test]
fn a_command_without_a_result_keeps_no_record() {
    let dir = repository(&LIST.replace("printf 'took 5 ms'", "exit 5"));
    let taken = records(dir.path(), &[]);
    let said = String::from_utf8_lossy(&taken.stderr).into_owned();
    assert!(taken.status.code() == Some(4) && said.contains("ended with code 5"), "{said}");
    assert!(!dir.path().join("docs/results/records/window.json").exists());
    assert!(fs::read_to_string(dir.path().join("docs/results.md")).unwrap().contains("## Not taken again"));
}

#[test]
fn lists_with_faults_are_refused() {
    for (from, to, why) in [
        ("part = \"Speed\"", "part = \"Pace\"", "heading"),
        ("\"window\"", "\"Window\"", "lower-case"),
        ("seed = 3", "seed = 3\nseeds = 4", "unknown field"),
    ] {
        let refused = records(repository(&LIST.replacen(from, to, 1)).path(), &["--list"]);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(refused.status.code() == Some(2) && said.contains(why), "{said}");
    }
    let refused = records(repository(LIST).path(), &["none"]);
    assert!(String::from_utf8_lossy(&refused.stderr).contains("no record `none`"));
}

#[test]
fn catalogue_rows_are_one_object() {
    let object: Value = serde_json::from_slice(&lab(&["catalogue", "--json"]).stdout).unwrap();
    assert_eq!(object["kind"], "catalogue");
    assert!(!object["rows"].as_array().unwrap().is_empty());
}
