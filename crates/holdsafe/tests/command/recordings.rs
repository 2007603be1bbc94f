//! Recordings of other vehicles: a guessed map, an assessment, and the errors of both.

use std::io::{Read, Write};
use std::process::{Command, Stdio};

use serde_json::Value;

use super::{holdsafe, root};

fn seed(name: &str) -> String {
    root().join("fuzz/corpus").join(name).to_str().unwrap().to_owned()
}

#[test]
fn guessed_map_is_enough_to_assess() {
    let (recording, dir) = (seed("foreign/ulog-with-px4-names"), tempfile::tempdir().unwrap());
    let guessed = holdsafe(&["assess", &recording, "--guess"]);
    assert!(guessed.status.success(), "{guessed:?}");
    let map = dir.path().join("map.toml");
    std::fs::write(&map, &guessed.stdout).unwrap();
    let told = holdsafe(&["assess", &recording, "--map", map.to_str().unwrap(), "--json"]);
    let object: Value = serde_json::from_slice(&told.stdout).unwrap();
    assert_eq!((&object["kind"], &object["facts"]["fixes"]), (&"assess".into(), &15.into()), "{object}");
    assert_eq!(object["not_assessed"].as_array().map(Vec::len), Some(12));
}

#[test]
fn cut_recording_is_read_up_to_the_cut() {
    let told =
        holdsafe(&["assess", &seed("foreign/ulog-cut-in-a-record"), "--map", &seed("settings/map-of-a-recording")]);
    let text = String::from_utf8(told.stdout).unwrap();
    assert!(told.status.success() && text.contains("read to byte 1886 of 1895: a record"), "{text}");
}

/// A pipe holds 64 KiB, so that a longer recording is written only as it is read.
#[test]
fn recording_is_parsed_by_a_process_without_rights() {
    let mut parser = Command::new(env!("CARGO_BIN_EXE_holdsafe"));
    let mut parser = parser
        .args(["service", "assess"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let status = format!("/proc/{}/status", parser.id());
    let field = |name: &str| {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        text.lines().find_map(|line| Some(line.strip_prefix(name)?.trim().to_owned()))
    };
    let mut pipe = parser.stdin.take().unwrap();
    pipe.write_all(b"{\"file\": \"noise\", \"judged\": null, \"seed\": 1, \"json\": false}\n").unwrap();
    pipe.write_all(&[b'n'; 256 * 1024]).unwrap();
    // It reads the recording, and its end is still to come.
    assert_eq!(["Seccomp:", "NoNewPrivs:"].map(field), ["2", "1"].map(|value| Some(value.to_owned())));
    drop(pipe);
    let mut said = String::new();
    parser.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert_eq!(parser.wait().unwrap().code(), Some(2));
    assert!(said.contains("noise: "), "{said}");
}

/// A limit on the size of files would end it.
#[test]
fn assessment_is_added_to_a_large_file() {
    let mut all = tempfile::tempfile().unwrap();
    all.write_all(&[b'\n'; 2 << 20]).unwrap();
    let status = Command::new(env!("CARGO_BIN_EXE_holdsafe"))
        .args(["assess", &seed("foreign/ulog-with-px4-names"), "--guess"])
        .stdout(all.try_clone().unwrap())
        .status()
        .unwrap();
    assert!(status.success() && all.metadata().unwrap().len() > 2 << 20, "{status}");
}

#[test]
fn unusable_recording_names_the_byte() {
    let told = holdsafe(&["assess", &seed("foreign/ulog-of-a-later-version"), "--guess"]);
    let text = String::from_utf8(told.stderr).unwrap();
    assert_eq!(told.status.code(), Some(2));
    assert!(text.contains("at byte 7: ULog version 2, expected 0 or 1"), "{text}");
}
