//! `lab mavlink`, end to end with pymavlink; skipped where it is not installed.

use std::process::{Command, Stdio};

use serde_json::Value;

use super::lab;

/// A Python interpreter with pymavlink: `HOLDSAFE_PYTHON`, or `python3`.
fn python() -> Option<String> {
    let program = std::env::var("HOLDSAFE_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let mut probe = Command::new(&program);
    let probe = probe.args(["-c", "import pymavlink"]).stderr(Stdio::null()).status();
    if probe.is_ok_and(|status| status.success()) {
        return Some(program);
    }
    link::note!(
        "skipped: {program} has no pymavlink (pip install pymavlink==2.4.50, HOLDSAFE_PYTHON names another interpreter)"
    );
    None
}

fn rows(python: &str, more: &[&str]) -> Vec<Value> {
    let output = lab(&[&["mavlink", "--messages", "3", "--json", "--quiet", "--python", python], more].concat());
    let object: Value = serde_json::from_slice(&output.stdout).unwrap();
    object["rows"].as_array().unwrap().clone()
}

#[test]
fn broken_receivers_are_findings_over_real_sockets() {
    let Some(python) = python() else { return };
    let (sound, broken) = (rows(&python, &[]), rows(&python, &["--accept-unsigned"]));
    assert_eq!((sound.len(), broken.len()), (80, 80));
    assert!(sound.iter().all(|row| row["verdict"] != "INVALID" && row["undelivered"] == 0), "{sound:?}");
    let signed = |rows: &[Value], name: &str| {
        let at = |row: &&Value| row["attack"] == name && row["link"] == "signed";
        rows.iter().filter(at).map(|row| row["attacker"]["measured"].clone()).collect::<Vec<_>>()
    };
    for name in ["unsigned-command", "downgrade", "key-change-unsigned"] {
        assert_eq!(signed(&sound, name), ["REFUSED", "REFUSED"], "{name}");
        assert_eq!(signed(&broken, name), ["ACCEPTED", "ACCEPTED"], "{name}");
    }
}

#[test]
fn missing_pymavlink_is_answered_with_its_remedy() {
    let output = lab(&["mavlink", "--python", "/nonexistent/python"]);
    let screen = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(5), "{screen}");
    assert!(screen.contains("pip install pymavlink==2.4.50"), "{screen}");
}
