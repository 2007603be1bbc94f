//! Objects of measurements that take seconds, against their golden files; the others are held where a test runs them.

use super::lab;

#[test]
fn quick_measurements_keep_their_form() {
    let quick: [&[&str]; 11] = [
        &["faults", "--only", "F5", "--runs", "1"],
        &["window", "--records", "100"],
        &["liveness", "--hours", "1"],
        &["explain", "--runs", "1"],
        &["judges", "--logs", "2"],
        &["growth", "--rounds", "1", "--trials", "1"],
        &["kill", "--runs", "1", "--only", "sim", "--twin"],
        &["kill", "--runs", "1", "--only", "sim", "--twin", "--at-transitions"],
        &["load", "--sessions", "2", "--seconds", "1", "--flood", "100", "--flood-seconds", "1"],
        &["replay", "--runs", "1"],
        &["plant"],
    ];
    for words in quick {
        let output = lab(&[words, &["--json", "--quiet"]].concat());
        assert!(output.stdout.starts_with(b"{\"kind\":\"bench-"), "{words:?}: {output:?}");
    }
}
