//! Commands in documents: the program has each of them, and the cheap ones of the README run to their end.

use std::fs;
use std::process::{Command, Stdio};

use super::documents::{Documented, documented};
use super::root;

/// `--help` behind a command makes the parser check its verbs, options and values without running it.
#[test]
fn documented_commands_are_understood() {
    let all = documented(&root(), "holdsafe", true);
    assert!(all.len() > 80, "{} commands found", all.len());
    let manifest = fs::read_to_string(root().join("crates/holdsafe/Cargo.toml")).unwrap();
    let manifest: toml::Table = manifest.parse().unwrap();
    for Documented { place, features, arguments } in &all {
        for feature in features.iter().flat_map(|named| named.split(',')) {
            assert!(manifest["features"].get(feature).is_some(), "{place}: no feature {feature}");
        }
        let output = Command::new(env!("CARGO_BIN_EXE_holdsafe")).args(arguments).arg("--help").output().unwrap();
        assert!(output.status.success(), "{place}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn cheap_commands_of_the_readme_succeed() {
    let cheap = |run: &&Documented| {
        let begins = run.arguments.iter().take(2).map(String::as_str).collect::<Vec<_>>();
        run.place.contains("README.md")
            && matches!(begins[..], ["explain" | "doctor", ..] | ["scenario", "new"] | ["inspect", "explain"])
    };
    let all = documented(&root(), "holdsafe", true);
    let cheap: Vec<&Documented> = all.iter().filter(cheap).collect();
    assert!(cheap.len() >= 2, "{} found", cheap.len());
    let root = root().canonicalize().unwrap();
    for run in cheap {
        let folder = tempfile::tempdir().unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_holdsafe"));
        command.arg("--root").arg(&root).args(&run.arguments).current_dir(folder.path()).stdin(Stdio::null());
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}: {}", run.place, String::from_utf8_lossy(&output.stderr));
    }
}
