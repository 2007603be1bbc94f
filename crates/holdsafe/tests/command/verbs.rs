//! The verbs: each with the object that it prints, or with the mistake that it refuses.

use std::fs;

use serde_json::Value;

use super::displays::short;
use super::{holdsafe, lock_machine, root, started};

/// The kind of the object that a command prints.
fn kind(words: &[&str]) -> String {
    let output = holdsafe(&[words, &["--json"]].concat());
    let object: Value = serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {output:?}"));
    object["kind"].as_str().unwrap().to_owned()
}

#[test]
fn evaluate_reproduces_committed_results() {
    assert_eq!(kind(&["evaluate", "--reproduce", "loss"]), "reproduce");
    assert_eq!(holdsafe(&["evaluate", "loss"]).status.code(), Some(2), "a scenario without --reproduce");
}

#[test]
fn inspect_explains() {
    assert_eq!(kind(&["inspect", "explain", "loss"]), "explain");
}

#[test]
fn inspect_compares() {
    let policy = root().join("policies/freshness-waived.toml");
    let policy = policy.to_str().unwrap();
    assert_eq!(kind(&["inspect", "diff", "loss", "--policy", policy]), "diff");
}

#[test]
fn inspect_replays() {
    assert_eq!(kind(&["inspect", "replay", "loss"]), "replay");
}

#[test]
fn inspect_verifies_nothing_without_a_run() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path().to_str().unwrap();
    assert_eq!(holdsafe(&["inspect", "verify", dir]).status.code(), Some(2), "no run");
}

#[test]
#[ignore = "long: a range of values"]
fn campaign_takes_a_value_through_its_range() {
    let words = ["teammate_timing", "--trials", "1", "--at", "0"];
    assert_eq!(kind(&[&["campaign", "curve"], &words[..]].concat()), "curve");
}

#[test]
fn campaign_runs_and_merges() {
    let dir = tempfile::tempdir().unwrap();
    let path_of = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
    let (part, whole) = (path_of("part"), path_of("whole"));
    let words = ["loss", "--trials", "2", "--out", &part];
    assert_eq!(kind(&[&["campaign", "run"], &words[..]].concat()), "campaign");
    let words = [part.as_str(), "--out", &whole];
    assert_eq!(kind(&[&["campaign", "merge"], &words[..]].concat()), "campaign");
}

#[test]
fn estimate_tries_trials_times_repetitions() {
    let words = ["estimate", "nominal", "--event", "hold-safe", "--trials", "2", "--repetitions", "2", "--json"];
    let object: Value = serde_json::from_slice(&holdsafe(&words).stdout).unwrap();
    assert_eq!((&object["kind"], &object["stages"][0]["tried"]), (&"rare".into(), &4.into()));
}

#[test]
fn report_writes_a_file_for_viewers() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("run.mcap");
    let file = file.to_str().unwrap();
    let words = ["loss", "--out", file];
    let new = [&["report", "--format", "mcap"], &words[..]].concat();
    assert_eq!(kind(&new), "export");
    let title = holdsafe(&[&new[..], &["--title", "t"]].concat());
    assert_eq!(title.status.code(), Some(2), "a page has a title: {title:?}");
    assert_eq!(holdsafe(&["report", "--format", "mcap", "loss"]).status.code(), Some(2), "no file is named");
}

#[test]
fn report_cites_a_run() {
    let dir = tempfile::tempdir().unwrap();
    let run = dir.path().join("run");
    let run = run.to_str().unwrap();
    assert_eq!(holdsafe(&["run", "loss", "--trials", "1", "--out", run]).status.code(), Some(0));
    assert_eq!(kind(&["report", "--format", "cite", run]), "cite");
}

#[test]
fn watch_opens_windows() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path().to_str().unwrap();
    let text = |more: &[&str]| holdsafe(&[&["watch", dir], more].concat());
    assert_eq!(text(&["--text"]), text(&[]), "the terminal is the default");
    for wrong in
        [&["--window", "--web"][..], &["--sensors", "--once"], &["--text", "--foxglove"], &["--packets", "--web"]]
    {
        assert_eq!(holdsafe(&[&["watch", dir], wrong].concat()).status.code(), Some(2), "{wrong:?}");
    }
}

#[test]
fn run_shows_a_live_trial() {
    let (_folder, scenario) = short();
    let output = {
        let _alone = lock_machine();
        started(&["run", "--live", "--watch", "--retries", "5", &scenario, "--json"])
    };
    let object: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&object["kind"], output.status.code()), (&"trial".into(), Some(0)), "{output:?}");
    let shown = String::from_utf8(output.stderr).unwrap();
    assert!(shown.contains("SIMULATION"), "{shown}");
    assert_eq!(holdsafe(&["run", "--watch", "nominal"]).status.code(), Some(2), "not live");
    assert_eq!(holdsafe(&["run", "--live", "--watch", "nominal", "loss"]).status.code(), Some(2), "two scenarios");
}

#[test]
fn version_names_commit_target_and_sources() {
    let help = |option: &str| String::from_utf8(holdsafe(&[option]).stdout).unwrap();
    let version = concat!("holdsafe ", env!("CARGO_PKG_VERSION"));
    assert_eq!(help("-V").trim_end(), version);
    let text = help("--version");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!((lines.len(), lines[0]), (4, version), "{text}");
    assert!(lines[2].starts_with("target ") && lines[2].contains("linux"), "{text}");
    let hex = |text: &str, length: usize| text.len() == length && text.chars().all(|c| c.is_ascii_hexdigit());
    // A debug build is not made again after each commit, and records none.
    let commit = lines[1].strip_prefix("commit ").unwrap();
    assert!(commit == "not recorded" || hex(commit.trim_end_matches('+'), 40), "{text}");
    assert!(lines[3].strip_prefix("sources ").is_some_and(|digest| hex(digest, 64)), "{text}");
}

#[test]
fn scenarios_are_listed_by_folder_with_titles() {
    let text = String::from_utf8(holdsafe(&["scenario", "list"]).stdout).unwrap();
    let (_, below) = text.split_once("scenarios/localisation/\n").unwrap();
    let drift = below.lines().find(|line| line.starts_with("  localisation_drift ")).unwrap();
    assert!(drift.ends_with("  A position that drifts away below the gate"), "{drift}");
    let object: Value = serde_json::from_slice(&holdsafe(&["scenario", "list", "--json"]).stdout).unwrap();
    let rows = object["scenarios"].as_array().unwrap();
    assert!(object["kind"] == "scenario-list" && rows.len() > 140, "{} scenarios", rows.len());
    let demo = rows.iter().find(|row| row["name"] == "demo").unwrap();
    assert_eq!(demo["folder"], "scenarios/demo");
    assert_eq!(text.lines().filter(|line| line.starts_with("  ")).count(), rows.len());
}

#[test]
fn completions_and_manual_pages_are_printed() {
    let printed = |arguments: &[&str]| {
        let output = holdsafe(arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = printed(&["completions", shell]);
        assert!(["holdsafe", "campaign", "platform"].iter().all(|word| script.contains(word)), "{shell}: {script}");
    }
    let page = printed(&["man"]);
    assert!(page.contains(".TH holdsafe 1") && page.contains("holdsafe\\-campaign(1)"), "{page}");
    assert!(!page.contains("completions"), "a verb that the help leaves out");
    let page = printed(&["man", "campaign", "run"]);
    assert!(page.contains(".TH holdsafe-campaign-run 1") && page.contains("\\-\\-claim"), "{page}");
    assert_eq!(holdsafe(&["man", "no-such-verb"]).status.code(), Some(2));
}

#[test]
fn attack_runs_in_drawn_worlds_or_is_refused() {
    let run = |more: &[&str]| holdsafe(&[&["run", "--trials", "1", "--seed", "4", "--json"], more].concat());
    let both = run(&["loss", "--world", "yard", "--worlds", "2"]);
    let both: Value = serde_json::from_slice(&both.stdout).unwrap();
    assert_eq!((&both["trials"][0]["cell"], &both["trials"][1]["cell"]), (&"yard:4".into(), &"yard:5".into()));
    let repeated = run(&["loss", "--world", "yard:5"]);
    let repeated: Value = serde_json::from_slice(&repeated.stdout).unwrap();
    assert_eq!(repeated["trials"][0]["log_hash"], both["trials"][1]["log_hash"], "{repeated}");
    assert!(repeated["trials"][0]["log_hash"].is_string(), "{repeated}");
    for refused in [
        &["decoy_warm", "--world", "yard"][..],
        &["teammate", "--world", "yard"],
        &["nominal", "--world", "yard", "--platform", "space"],
        &["loss", "--world", "no-such"],
        &["loss", "--world", "yard:x"],
        &["loss", "--worlds", "3"],
    ] {
        let output = run(refused);
        assert_eq!(output.status.code(), Some(2), "{refused:?}: {output:?}");
        assert!(String::from_utf8_lossy(&output.stderr).contains("world"), "{refused:?}: {output:?}");
    }
}

#[test]
fn scenario_that_stays_in_its_scene_is_told_apart() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("worlds");
    let output = holdsafe(&["evaluate", "--worlds", "1", "teammate", "--json", "--out", out.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(4), "nothing ran: {output:?}");
    let value: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&value["apart"][0]["scenario"], value["rows"].as_array().map(Vec::len)), (&"teammate".into(), Some(0)));
    for refused in [
        &["evaluate", "loss"][..],
        &["evaluate", "--worlds", "0"],
        &["evaluate", "--worlds", "1", "--quick"],
        &["evaluate", "--twins"],
    ] {
        assert_eq!(holdsafe(refused).status.code(), Some(2), "{refused:?}");
    }
}

#[test]
fn drawn_world_is_a_scene_to_drive_in() {
    let dir = tempfile::tempdir().unwrap();
    let draw = ["scenario", "world", "yard", "--seed", "3"];
    let drawn = holdsafe(&draw);
    assert_eq!(drawn.status.code(), Some(0), "{drawn:?}");
    fs::write(dir.path().join("drawn.toml"), &drawn.stdout).unwrap();
    let text = "schema_version = 1\nname = \"own\"\nextends = \"nominal\"\ntitle = \"Own\"\ndescription = \"None.\"\nthreats = [\"N0\"]\nstride = []\n\
                interface = \"control\"\nevidence = \"model\"\nrequirement = \"runtime-assurance\"\nexpected = [\"NOMINAL\"]\nscene_file = \"drawn.toml\"\n";
    let file = dir.path().join("own.toml");
    fs::write(&file, text).unwrap();
    let checked = holdsafe(&["scenario", "check", file.to_str().unwrap()]);
    assert_eq!(checked.status.code(), Some(0), "{}", String::from_utf8_lossy(&checked.stderr));
    let object: Value = serde_json::from_slice(&holdsafe(&[&draw[..], &["--json"]].concat()).stdout).unwrap();
    assert_eq!((&object["family"], &object["held_out"]), (&"yard".into(), &false.into()));
}
