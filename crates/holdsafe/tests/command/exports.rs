//! A run as a file for viewers.

use std::collections::BTreeMap;
use std::fs;

use super::evidence::{object, recorded};
use super::judge::Line;
use super::{holdsafe, root};

/// Messages by topic, as reported.
pub(super) fn message_counts(exported: &serde_json::Value) -> BTreeMap<String, u64> {
    let channels = exported["channels"].as_array().unwrap();
    channels.iter().map(|c| (c["topic"].as_str().unwrap().to_owned(), c["messages"].as_u64().unwrap())).collect()
}

/// The export of a run in the twin has the messages between services too.
#[test]
fn export_has_every_event_of_a_run() {
    let dir = tempfile::tempdir().unwrap();
    let run = recorded(dir.path(), "thermal_loss");
    let file = dir.path().join("run.mcap");
    let export = |run: &str| holdsafe(&["report", "--format", "mcap", run, "--out", file.to_str().unwrap(), "--json"]);
    let recording = message_counts(&object(&export(run.to_str().unwrap())));
    let length = fs::metadata(&file).unwrap().len();
    let log = fs::read_to_string(run.join("events.jsonl")).unwrap();
    let nodes = log.lines().skip(1).map(|line| serde_json::from_str::<Line>(line).unwrap().node());
    let mut expected: BTreeMap<String, u64> = BTreeMap::new();
    nodes.for_each(|node| *expected.entry(format!("/audit/{node}")).or_default() += 1);
    let audit = |map: &BTreeMap<String, u64>| -> BTreeMap<String, u64> {
        map.iter().filter(|(topic, _)| topic.starts_with("/audit/")).map(|(t, n)| (t.clone(), *n)).collect()
    };
    assert_eq!(audit(&recording), expected);
    assert!(recording.contains_key("/audit/unit-a") && recording.contains_key("/mode/unit-a"), "{recording:?}");
    assert!(!recording.contains_key("/tracks"), "a recording of the twin has no input journals");
    let twin = message_counts(&object(&export("thermal_loss")));
    assert_eq!(audit(&twin), expected);
    assert!(twin["/tracks"] > 80 && fs::metadata(&file).unwrap().len() > length, "{twin:?}");
}

/// The error has a remedy.
#[test]
fn failed_export_leaves_no_file() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("run.mcap");
    let out = out.to_str().unwrap();
    let run = root();
    let mistakes: [(&[&str], &str); 4] = [
        (&["report", "--format", "mcap", "nominal", "--out", "/nowhere/run.mcap"], "/nowhere/run.mcap"),
        (
            &["report", "--format", "mcap", "alert", "--cell", "none", "--out", out],
            "`alert` has no cells; leave --cell out",
        ),
        (&["report", "--format", "mcap", "no_such_run", "--out", out], "no scenario `no_such_run`"),
        (&["report", "--format", "mcap", run.to_str().unwrap(), "--out", out], "name the directory of one run"),
    ];
    for (arguments, message) in mistakes {
        let output = holdsafe(arguments);
        let screen = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {screen}");
        assert!(screen.contains(message) && !screen.contains("panicked"), "{arguments:?}: {screen}");
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
}
