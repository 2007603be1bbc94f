//! `lab search` over its own list.

use std::fs;
use std::os::unix::fs::PermissionsExt;

use super::lab;

const WEAK: &str = "[[weakness]]\nname = \"weak\"\nscenario = \"nominal\"\nspace = \"display\"\n\
                    waive = [\"display.signature\"]\nfind = [\"UNSAFE\"]\n";

fn bench(list: &str, more: &[&str]) -> serde_json::Value {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("list.toml");
    fs::write(&file, list).unwrap();
    let output = lab(&[&["search", "--json", "--list", file.to_str().unwrap()], more].concat());
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The number of trials is the same for one thread and two.
#[test]
fn strategies_find_weaknesses_independently_of_threads() {
    let trials = |jobs: &str| {
        let object = bench(WEAK, &["--draws", "2", "--budget", "48", "--jobs", jobs]);
        let hunts = object["weaknesses"][0]["hunts"].as_array().unwrap().clone();
        hunts.iter().map(|hunt| (hunt["strategy"].clone(), hunt["each_trials"].clone())).collect::<Vec<_>>()
    };
    let first = trials("1");
    let strategies: Vec<&str> = first.iter().map(|(strategy, _)| strategy.as_str().unwrap()).collect();
    assert_eq!(strategies, ["uniform", "transitions", "guided", "novelty", "distance"]);
    let ended = |wait: &serde_json::Value| wait["came"] == true || wait["waited"] == 48.0;
    assert!(
        first.iter().all(|(_, each)| each.as_array().is_some_and(|each| each.len() == 2 && each.iter().all(ended)))
    );
    assert_eq!(first, trials("2"));
}

/// A sequence that is a finding with one part put right is none of the whole weakness.
#[test]
fn finding_needs_every_part_of_a_weakness() {
    let more = WEAK.replace("\"weak\"", "\"weaker\"").replace("signature\"]", "signature\", \"boundary.jump\"]");
    let object = bench(&format!("{WEAK}{more}"), &["--draws", "3", "--budget", "48", "--strategy", "uniform"]);
    let found = |n: usize| object["weaknesses"][n]["hunts"][0]["found"].clone();
    assert_eq!((found(0), found(1)), (3.into(), 0.into()), "{object}");
    let text = object["weaknesses"][0]["hunts"][0]["each_finding"][0].as_str().unwrap();
    assert!(text.starts_with("UNSAFE P"), "{text}");
}

/// To the same attack sequence, and no shorter one has the effect.
#[test]
fn findings_of_several_seeds_shrink_to_one() {
    let object = bench(WEAK, &["--shrink", "5", "--budget", "200"]);
    let [row] = object["rows"].as_array().unwrap().as_slice() else { panic!("more than one cause: {object}") };
    assert_eq!((&row["n"], row["minima"].as_array().unwrap().len()), (&5.into(), 1), "{row}");
    assert_eq!((&row["letters"], &row["fewer_letters"]), (&1.into(), &serde_json::Value::Null));
    assert!(row["executions"]["max"].as_f64().unwrap() <= 100.0, "{row}");
}

#[test]
fn list_with_unknown_names_is_answered_with_known() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("list.toml");
    let file = file.to_str().unwrap();
    for (list, more, message) in [
        (WEAK.to_owned(), &["--only", "strong"][..], "no weakness `strong`; there are: weak"),
        (
            WEAK.replace("display.signature", "display.sign"),
            &[],
            "no check `display.sign`; there are: boundary.freshness",
        ),
        (WEAK.replace("\"display\"", "\"screen\""), &[], "no attack space `screen`; there are: broker, display"),
    ] {
        fs::write(file, list).unwrap();
        let output = lab(&[&["search", "--list", file], more].concat());
        let screen = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{screen}");
        assert!(screen.contains(message), "{message}: {screen}");
    }
}

/// Each search by another program: its row is beside that of uniform drawing, with a ratio.
#[test]
fn own_optimizer_is_compared_with_uniform_drawing() {
    let dir = tempfile::tempdir().unwrap();
    let program = dir.path().join("own.sh");
    let answer = r#"{"sequences":[[{"move":4,"begins":50,"places":[395]}]]}"#;
    fs::write(&program, format!("#!/bin/sh\nread begin\nwhile read round; do echo '{answer}'; done\n")).unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    let more = ["--strategy", "uniform", "--optimizer", program.to_str().unwrap(), "--draws", "2", "--budget", "16"];
    let object = bench(WEAK, &more);
    let row = &object["weaknesses"][0]["hunts"][1];
    assert_eq!((&row["strategy"], &row["n"], &row["found"]), (&"optimizer:own.sh".into(), &2.into(), &2.into()));
    assert!(row["each_trials"].as_array().unwrap().iter().all(|wait| wait["waited"] == 1.0), "{row}");
    assert!(row["each_finding"][1].as_str().unwrap().contains("alter at 0.50 s"), "{row}");
}
