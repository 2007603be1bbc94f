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
    let output = holdsafe(&["assess", &recording, "--map", map.to_str().unwrap(), "--json"]);
    let object: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&object["kind"], &object["facts"]["fixes"]), (&"assess".into(), &15.into()), "{object}");
    assert_eq!(object["not_assessed"].as_array().map(Vec::len), Some(12));
}

#[test]
fn cut_recording_is_read_up_to_the_cut() {
    let output =
        holdsafe(&["assess", &seed("foreign/ulog-cut-in-a-record"), "--map", &seed("settings/map-of-a-recording")]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && text.contains("read to byte 1886 of 1895: a record"), "{text}");
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
    let mut words = String::new();
    parser.stderr.take().unwrap().read_to_string(&mut words).unwrap();
    assert_eq!(parser.wait().unwrap().code(), Some(2));
    assert!(words.contains("noise: "), "{words}");
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
    let output = holdsafe(&["assess", &seed("foreign/ulog-of-a-later-version"), "--guess"]);
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(text.contains("at byte 7: ULog version 2, expected 0 or 1"), "{text}");
}

/// A folder with the circle twice, as `bag_2` and `bag_10`, beside the file of words about them.
fn bag() -> (tempfile::TempDir, String) {
    let dir = tempfile::tempdir().unwrap();
    let made = root().join("crates/judge/assess/tests/made");
    std::fs::create_dir(dir.path().join("bag")).unwrap();
    for name in ["bag_10.mcap", "bag_2.mcap"] {
        std::fs::copy(made.join("lz4.mcap"), dir.path().join("bag").join(name)).unwrap();
    }
    std::fs::write(dir.path().join("bag/metadata.yaml"), "relative_file_paths: [../../secret.mcap]\n").unwrap();
    std::fs::copy(made.join("circle.toml"), dir.path().join("map.toml")).unwrap();
    let path = dir.path().to_str().unwrap().to_owned();
    (dir, path)
}

#[test]
fn folder_of_a_bag_is_one_recording() {
    let (_dir, path) = bag();
    let (folder, map) = (format!("{path}/bag"), format!("{path}/map.toml"));
    let files = ["bag_2", "bag_10"].map(|name| format!("{folder}/{name}.mcap"));
    let error_text = |paths: &[&str]| {
        let output = holdsafe(&[&["assess"], paths, &["--map", &map, "--json"]].concat());
        serde_json::from_slice::<Value>(&output.stdout).unwrap_or_else(|error| panic!("{error}: {output:?}"))
    };
    let whole = error_text(&[&folder]);
    assert_eq!((&whole["facts"]["fixes"], &whole["facts"]["parts"]), (&102.into(), &2.into()), "{whole}");
    assert_eq!(whole["sha256"], error_text(&[&files[0], &files[1]])["sha256"]);
    assert!(whole["remarks"].to_string().contains("stamps go back by 5.1 s at 5.1 s"), "{whole}");
    std::fs::remove_file(&files[0]).and_then(|()| std::fs::remove_file(&files[1])).unwrap();
    let empty = holdsafe(&["assess", &folder, "--guess"]);
    assert!(String::from_utf8(empty.stderr).unwrap().contains("a folder without a recording"));
}

#[test]
fn limits_are_those_of_the_named_platform() {
    let (dir, path) = bag();
    let text = std::fs::read_to_string(root().join("platforms/ground.toml")).unwrap();
    let short = text.replace("name = \"ground\"", "name = \"short\"").replace("wheelbase_m = 1.2", "wheelbase_m = 0.8");
    let file = dir.path().join("short.toml");
    std::fs::write(&file, short).unwrap();
    let (map, recording) = (format!("{path}/map.toml"), format!("{path}/bag/bag_2.mcap"));
    for (platform, words) in [(None, "origin is 0.6 m ahead"), (file.to_str(), "origin is 0.4 m ahead")] {
        let texts = platform.map_or(vec![], |file| vec!["--platform", file]);
        let output = holdsafe(&[&["assess", &recording, "--map", &map][..], &texts].concat());
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success() && text.contains(words), "{text}{}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn damage_is_the_first_thing_that_is_told() {
    let (_dir, path) = bag();
    let (file, map) = (format!("{path}/bag/bag_2.mcap"), format!("{path}/map.toml"));
    let mut bytes = std::fs::read(&file).unwrap();
    bytes[2000] ^= 4;
    std::fs::write(&file, bytes).unwrap();
    for rest in [&["--guess"][..], &["--map", &map]] {
        let output = holdsafe(&[&["assess", &file], rest].concat());
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && text.contains("1 part could not be read: bytes 42 to "), "{text}");
        assert!(text.find("could not be read") < text.find("/fix"), "{text}");
    }
}

/// A telemetry log, its guessed map, and the route of both as a scenario: checked and run, and left alone where it is there already.
#[test]
fn recorded_route_runs_in_the_closed_loop() {
    let dir = tempfile::tempdir().unwrap();
    let recording = root().join("crates/judge/assess/tests/made/rover.tlog").to_str().unwrap().to_owned();
    let [map, file] = ["map.toml", "mine.toml"].map(|name| dir.path().join(name).to_str().unwrap().to_owned());
    std::fs::write(&map, holdsafe(&["assess", &recording, "--guess"]).stdout).unwrap();
    let make = |platform: &[&str]| {
        let output = holdsafe(&[&["assess", &recording, "--map", &map, "--scenario", &file], platform].concat());
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let air = root().join("platforms/air.toml").to_str().unwrap().to_owned();
    let (code, text) = make(&["--platform", &air]);
    assert!(code == Some(2) && text.contains("has wheels and platform `air` flies"), "{text}");
    assert!(!std::path::Path::new(&file).exists(), "nothing is left of a file that was not made");
    assert_eq!(make(&[]), (Some(0), String::new()));
    let (code, text) = make(&[]);
    assert!(code == Some(2) && text.contains("choose another name"), "{text}");
    assert!(holdsafe(&["scenario", "check", &file]).status.success());
    let output = holdsafe(&["run", &file, "--trials", "1", "--json"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && text.contains("NOMINAL"), "{text}");
}
