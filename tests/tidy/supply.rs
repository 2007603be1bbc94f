//! The tool's own supply chain: the threats to it have tests, no private key is in git, and `unsafe` is for benchmarks.
//!
//! Licences, sources and advisories of dependencies are left to `deny.toml`; their `unsafe` is counted by `tools/release/unsafe`.

use std::fs;
use std::process::Command;

use crate::crates::folders;
use crate::{code, crate_sources, root};

/// The threat model of the tool.
const PAGE: &str = "docs/reviewer/tool-threats.md";

/// Threats that it has, from O1 on.
const THREATS: usize = 14;

/// The head of a private key as text, as an extended regular expression that does not match itself.
const KEY: &str = "BEGIN ([A-Z0-9]+ )*PRIVATE KEY";

/// Tests that a row quotes, as file and name.
fn tests_of(row: &str) -> Vec<(&str, &str)> {
    let quoted = row.split('`').skip(1).step_by(2).filter_map(|text| text.split_once("::"));
    quoted.filter(|(file, _)| file.ends_with(".rs")).collect()
}

#[test]
fn every_threat_to_the_tool_has_a_test() {
    let page = fs::read_to_string(root().join(PAGE)).expect(PAGE);
    let rows: Vec<&str> = page.lines().filter(|line| line.starts_with("| O")).collect();
    assert_eq!(rows.len(), THREATS, "{PAGE}");
    for (index, row) in rows.into_iter().enumerate() {
        let number = index + 1;
        assert!(row.starts_with(&format!("| O{number} |")), "{PAGE}: O{number} is not in its place");
        let tests = tests_of(row);
        assert!(!tests.is_empty(), "{PAGE}: O{number} names no test");
        for (file, name) in tests {
            let text = fs::read_to_string(root().join(file)).unwrap_or_else(|e| panic!("{PAGE} names {file}: {e}"));
            assert!(
                text.contains(&format!("fn {name}(")),
                "{PAGE}: O{number} names {file}::{name}, which is not there"
            );
        }
    }
}

#[test]
fn no_file_in_git_has_a_private_key() {
    let search = ["grep", "--cached", "--files-with-matches", "--extended-regexp", KEY];
    match Command::new("git").args(search).current_dir(root()).output() {
        Ok(found) if found.status.code() == Some(1) => {}
        Ok(found) if found.status.success() => panic!("private keys in {}", String::from_utf8_lossy(&found.stdout)),
        Ok(_) | Err(_) => println!("skipped: git is missing, or this is no clone"),
    }
}

/// Unsafe code is allowed in the files that count allocations.
#[test]
fn only_benchmarks_have_unsafe_code() {
    for folder in folders() {
        let manifest = fs::read_to_string(root().join(&folder).join("Cargo.toml")).expect("a manifest");
        assert!(manifest.contains("[lints]\nworkspace = true"), "{folder} does not take the workspace's lints");
    }
    for (file, text) in crate_sources() {
        let lifted = code(&text).contains("(unsafe_code");
        assert!(!lifted || file.contains("/benches/"), "{file} lifts the lint against `unsafe`");
    }
}

#[test]
fn quoted_tests_are_told_from_other_code() {
    let row = "| O1 | `LoopbackAddr::of_run` in `crates/a/src/b.rs` | `crates/a/src/b.rs::claim`, `c.rs::other` |";
    assert_eq!(tests_of(row), [("crates/a/src/b.rs", "claim"), ("c.rs", "other")]);
}
