//! Layers of the ATT&CK Navigator.

use report::layers;
use serde_json::Value;

use super::{everything, hostile, read_results, violations, write_json};

const SCHEMA: &str = "layer-4.5.schema.json";

fn layer(results: &report::reader::Results, name: &str) -> Value {
    let layers = layers(results);
    let (_, text) = layers.iter().find(|(file, _)| *file == name).expect("a layer");
    write_json(name, text)
}

fn technique<'a>(layer: &'a Value, id: &str) -> &'a Value {
    let all = layer["techniques"].as_array().expect("techniques");
    all.iter().find(|t| t["techniqueID"] == id).expect("a technique")
}

/// The schema notices an invalid one.
#[test]
fn each_layer_satisfies_its_schema() {
    let results = everything();
    assert_eq!(layers(&results).len(), 3);
    for (name, text) in layers(&results) {
        let mut layer = write_json(name, &text);
        assert_eq!(violations(SCHEMA, &layer), Vec::<String>::new(), "{name}");
        layer["techniques"][0]["techniqueID"] = "replay".into();
        assert_eq!(violations(SCHEMA, &layer).len(), 1, "{name}");
    }
}

#[test]
fn each_technique_is_in_one_layer() {
    let (ics, enterprise) = (layer(&everything(), "attack-ics.json"), layer(&everything(), "attack-enterprise.json"));
    assert_eq!(technique(&ics, "T0830")["techniqueID"], "T0830");
    assert_eq!(technique(&enterprise, "T1557")["techniqueID"], "T1557");
    let atlas = layer(&everything(), "atlas.json");
    let ids: Vec<&str> =
        atlas["techniques"].as_array().unwrap().iter().map(|t| t["techniqueID"].as_str().unwrap()).collect();
    assert_eq!(ids, ["AML.T0015", "AML.T0029"]);
}

#[test]
fn few_trials_score_low_worst_class_colours() {
    let ics = layer(&everything(), "attack-ics.json");
    let relay = technique(&ics, "T0830");
    // Two clean trials: unsafe below 77.6 %.
    assert_eq!((&relay["score"], &relay["color"]), (&22.into(), &"#57534e".into()), "UNDETECTED came out");
    assert!(relay["metadata"][0]["value"].as_str().unwrap().contains("n 4: HOLD_SAFE 2, REJECTED 2"), "{relay}");
    let blocked = technique(&ics, "T0804");
    assert!(blocked["metadata"][0]["value"].as_str().unwrap().contains("; 2 not as expected;"), "{blocked}");
}

/// The bound counts INVALID as unsafe.
#[test]
fn score_is_that_of_the_worst_run() {
    let mut matrix: Value = serde_json::from_str(&super::read("results/matrix.json")).unwrap();
    matrix["rows"][0]["runs"][0]["summary"]["unsafe_upper_95_invalid_counted"] = 0.01.into();
    matrix["rows"][0]["runs"][1]["summary"]["unsafe_upper_95_invalid_counted"] = 0.9.into();
    let mut results = report::reader::Results::default();
    results.read("other.json", matrix.to_string().as_bytes()).unwrap();
    assert_eq!(technique(&layer(&results, "attack-ics.json"), "T0830")["score"], 9);
}

#[test]
fn an_invalid_trial_is_no_evidence_of_safety() {
    let tampered = layer(&everything(), "attack-enterprise.json");
    let tampered = technique(&tampered, "T1070");
    assert_eq!((&tampered["score"], &tampered["color"]), (&0.into(), &"#6d28d9".into()));
}

#[test]
fn what_was_not_run_has_no_score() {
    let atlas = layer(&everything(), "atlas.json");
    let frozen = technique(&atlas, "AML.T0015");
    assert!(frozen.get("score").is_none() && frozen.get("color").is_none());
    assert!(frozen["metadata"][0]["value"].as_str().unwrap().starts_with("not run: "), "{frozen}");
}

/// A waived check, a missing mechanism and a control.
#[test]
fn waived_or_unreal_runs_and_controls_score_nothing() {
    let score_with = |key: &str, value: Value| {
        let mut matrix: Value = serde_json::from_str(&super::read("results/matrix.json")).unwrap();
        for run in matrix["rows"][0]["runs"].as_array_mut().unwrap() {
            run[key] = value.clone();
        }
        let mut results = report::reader::Results::default();
        results.read("other.json", matrix.to_string().as_bytes()).unwrap();
        let ics = layer(&results, "attack-ics.json");
        technique(&ics, "T0830").get("score").cloned()
    };
    assert_eq!(score_with("policy", "default".into()), Some(22.into()));
    assert_eq!(score_with("watermark", "ABLATION".into()), None);
    assert_eq!(score_with("counts", false.into()), None);
    assert_eq!(score_with("expected", serde_json::json!(["UNSAFE"])), None);
}

#[test]
fn without_a_matrix_there_are_no_layers() {
    assert!(layers(&read_results(&["runs.json", "campaign.json", "search.json"])).is_empty());
}

#[test]
fn result_text_cannot_break_a_layer() {
    for (name, text) in layers(&hostile("\"></x> \u{0}\u{1b}\u{ffff} é")) {
        let layer: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(violations(SCHEMA, &layer), Vec::<String>::new(), "{name}");
    }
}
