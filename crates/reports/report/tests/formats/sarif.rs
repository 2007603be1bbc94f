//! SARIF.

use report::sarif;
use serde_json::Value;

use super::{everything, hostile, read_results, violations, write_json};

const SCHEMA: &str = "sarif-schema-2.1.0.json";

fn results_of(run: &Value) -> &Vec<Value> {
    run["results"].as_array().expect("results")
}

/// The schema notices an invalid one.
#[test]
fn sarif_file_satisfies_its_schema() {
    let mut file = write_json("holdsafe.sarif", &sarif(&everything()));
    assert_eq!(violations(SCHEMA, &file), Vec::<String>::new());
    file["runs"][0]["results"][0]["level"] = "grave".into();
    file["runs"][0]["results"][0]["message"] = Value::Null;
    assert_eq!(violations(SCHEMA, &file).len(), 2);
}

/// Each result names its threat.
#[test]
fn only_unexpected_classes_are_results() {
    let file = write_json("matrix.sarif", &sarif(&read_results(&["matrix.json"])));
    let run = &file["runs"][0];
    let message = |r: &Value| {
        format!("{} {} {}", r["ruleId"].as_str().unwrap(), r["level"].as_str().unwrap(), r["properties"]["n"])
    };
    assert_eq!(results_of(run).iter().map(message).collect::<Vec<_>>(), ["A04 warning 2", "A40 warning 2"]);
    let loss = &results_of(run)[0];
    let text = loss["message"]["text"].as_str().unwrap();
    assert!(text.contains("HOLD_SAFE in 2 of 2 trials") && text.contains("expected DEGRADED"), "{text}");
    assert!(text.contains("holdsafe run loss --trials 2 --seed 1"), "{text}");
    let place = &loss["locations"][0]["physicalLocation"]["artifactLocation"];
    assert_eq!((&place["uri"], &place["uriBaseId"]), (&"scenarios/loss.toml".into(), &"SRCROOT".into()));
    let rule = &run["tool"]["driver"]["rules"][loss["ruleIndex"].as_u64().unwrap() as usize];
    assert_eq!(rule["id"], "A04");
}

#[test]
fn trial_result_names_the_broken_property() {
    let file = write_json("runs.sarif", &sarif(&read_results(&["runs.json"])));
    let rules: Vec<&str> = results_of(&file["runs"][0]).iter().map(|r| r["ruleId"].as_str().unwrap()).collect();
    assert_eq!(rules, ["HOLD_SAFE", "P10"]);
}

#[test]
fn finding_under_a_waived_check_is_a_note() {
    let file = write_json("search.sarif", &sarif(&read_results(&["search.json"])));
    let [finding] = results_of(&file["runs"][0]).as_slice() else { panic!("one finding") };
    assert_eq!((&finding["ruleId"], &finding["level"]), (&"P3".into(), &"note".into()));
    assert_eq!(finding["properties"]["stopped_by"][0], "guards.lease");
}

#[test]
fn fingerprint_is_stable_across_seed_and_count() {
    let mut other: Value = serde_json::from_str(&super::read("results/matrix.json")).unwrap();
    other["seed"] = 1000.into();
    let mut results = report::reader::Results::default();
    results.read("other.json", other.to_string().as_bytes()).unwrap();
    let prints = |text: String| {
        let file: Value = serde_json::from_str(&text).unwrap();
        results_of(&file["runs"][0]).iter().map(|r| r["partialFingerprints"].to_string()).collect::<Vec<_>>()
    };
    let (one, two) = (prints(sarif(&read_results(&["matrix.json"]))), prints(sarif(&results)));
    assert_eq!(one, two);
    // Another scenario of a name as long is another result.
    let renamed = super::read("results/matrix.json").replace("\"loss\"", "\"lost\"");
    let mut results = report::reader::Results::default();
    results.read("renamed.json", renamed.as_bytes()).unwrap();
    assert_ne!(one[0], prints(sarif(&results))[0]);
}

#[test]
fn no_text_of_a_result_makes_it_invalid() {
    let file = write_json("hostile.sarif", &sarif(&hostile("\"></x> ../%zz \u{0}\u{1b}\u{ffff} \u{202e} é")));
    assert_eq!(violations(SCHEMA, &file), Vec::<String>::new());
    // The schema does not say of a URI what may be in it.
    let uri = results_of(&file["runs"][0])[0]["locations"][0]["physicalLocation"]["artifactLocation"]["uri"].clone();
    let plain = |c: char| c.is_ascii_alphanumeric() || "-._~%/".contains(c);
    assert!(uri.as_str().unwrap().chars().all(plain), "{uri}");
    assert!(uri.as_str().unwrap().starts_with("scenarios/%22%3E%3C%2Fx%3E"), "{uri}");
}
