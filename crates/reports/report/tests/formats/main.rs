//! Every file for other tools against the schema of its format, and its content for the results that are in `results/`.
//!
//! The checked files are left in `target/tmp/`, for other validators (`schemas/README.md`).

mod junit;
mod navigator;
mod sarif;
mod sbom;

use std::fs;
use std::path::{Path, PathBuf};

use report::reader::Results;
use serde_json::Value;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests")
}

fn read(file: &str) -> String {
    fs::read_to_string(folder().join(file)).unwrap_or_else(|e| panic!("{file}: {e}"))
}

fn read_results(files: &[&str]) -> Results {
    let mut results = Results::default();
    for file in files {
        results.read(file, read(&format!("results/{file}")).as_bytes()).expect("a result");
    }
    results
}

fn everything() -> Results {
    read_results(&["matrix.json", "runs.json", "reference.json", "campaign.json", "search.json"])
}

/// Results of an unfriendly hand: every text is `text`.
fn hostile(text: &str) -> Results {
    let mut results = Results::default();
    for file in ["matrix.json", "runs.json", "campaign.json", "search.json"] {
        let mut value: Value = serde_json::from_str(&read(&format!("results/{file}"))).expect("JSON");
        spoil(&mut value, text);
        results.read(text, value.to_string().as_bytes()).expect("a result");
    }
    results
}

fn spoil(value: &mut Value, text: &str) {
    const FREE: [&str; 12] = [
        "scenario",
        "cell",
        "policy",
        "watermark",
        "threat",
        "containment",
        "broken",
        "finding",
        "word",
        "name",
        "reproduce",
        "id",
    ];
    match value {
        Value::Object(object) => object.iter_mut().for_each(|(key, value)| match value {
            Value::String(own) if FREE.contains(&key.as_str()) => *own = text.to_owned(),
            Value::String(_) | Value::Null | Value::Bool(_) | Value::Number(_) => {}
            Value::Array(_) | Value::Object(_) => spoil(value, text),
        }),
        Value::Array(all) => all.iter_mut().for_each(|value| spoil(value, text)),
        Value::String(_) | Value::Null | Value::Bool(_) | Value::Number(_) => {}
    }
}

/// Leaves a file where other validators find it, and gives it back as JSON.
fn write_json(name: &str, text: &str) -> Value {
    fs::write(Path::new(env!("CARGO_TARGET_TMPDIR")).join(name), text).expect("a file below target/");
    serde_json::from_str(text).expect("JSON")
}

/// Violations of a schema by a file.
fn violations(schema: &str, file: &Value) -> Vec<String> {
    let json = |name: &str| serde_json::from_str::<Value>(&read(&format!("schemas/{name}"))).expect("JSON");
    let namespace = "http://cyclonedx.org/schema/";
    let registry = jsonschema::Registry::new()
        .add(format!("{namespace}spdx.schema.json"), json("spdx.schema.json"))
        .and_then(|r| r.add(format!("{namespace}jsf-0.82.schema.json"), json("jsf-0.82.schema.json")))
        .and_then(|r| r.prepare())
        .expect("the schemas that others refer to");
    let options = jsonschema::options().with_registry(&registry).should_validate_formats(true);
    let validator = options.build(&json(schema)).expect("a schema");
    validator.iter_errors(file).map(|e| format!("{}: {e}", e.instance_path())).collect()
}
