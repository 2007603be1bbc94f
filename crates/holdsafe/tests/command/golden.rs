//! Objects that verbs print and no program reads, against a golden file for each kind: `tests/golden/<kind>-v<version>.json`.
//!
//! A golden file has the fields that every object of its kind has. Every object that a test of this program makes it print is held
//! against it: a field that is gone, renamed or of another type fails that test. A field may be added, or null, or depend on the run;
//! counts by name are empty in a golden file, and a null in it represents any value. The objects that are read again are held to the
//! byte, in `crates/reports/results/tests/golden.rs`.

use std::fs;
use std::path::Path;

use serde_json::Value;

/// Holds the first line that was printed against the golden file of its kind, if it is an object of a kind that has one here.
pub(super) fn hold(printed: &[u8]) {
    let first = printed.split(|byte| *byte == b'\n').next().unwrap_or_default();
    let Ok(printed) = serde_json::from_slice::<Value>(first) else { return };
    let (Some(kind), version) = (printed["kind"].as_str(), printed["schema_version"].as_u64().unwrap_or(1)) else {
        return;
    };
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/golden/{kind}-v{version}.json"));
    let Ok(text) = fs::read_to_string(file) else { return };
    let golden = serde_json::from_str(&text).unwrap();
    if let Err(fault) = like(&golden, &printed, kind) {
        panic!("{fault}; an object of another form is another version, with a golden file of its own");
    }
}

/// Ok if `printed` has every field of `golden`, and of its type.
fn like(golden: &Value, printed: &Value, place: &str) -> Result<(), String> {
    match (golden, printed) {
        (Value::Null, _)
        | (_, Value::Null)
        | (Value::Bool(_), Value::Bool(_))
        | (Value::String(_), Value::String(_)) => Ok(()),
        (Value::Number(golden), Value::Number(printed)) if golden.is_f64() == printed.is_f64() => Ok(()),
        (Value::Array(golden), Value::Array(printed)) => {
            let Some(one) = golden.first() else { return Ok(()) };
            printed.iter().try_for_each(|value| like(one, value, &format!("{place}[]")))
        }
        (Value::Object(golden), Value::Object(printed)) => golden.iter().try_for_each(|(key, one)| {
            let value = printed.get(key).ok_or_else(|| format!("{place} has no `{key}`"))?;
            like(one, value, &format!("{place}.{key}"))
        }),
        (golden, printed) => Err(format!("{place} is {printed}, of another type than {golden}")),
    }
}

#[test]
fn lost_or_retyped_field_is_found() {
    let golden = serde_json::json!({"a": [{"b": 1.5}], "c": {}, "d": null});
    let fault = |printed: Value| like(&golden, &printed, "x").err();
    assert_eq!(fault(serde_json::json!({"a": [{"b": 2.0, "new": 1}], "c": {"n": 1}, "d": "any"})), None);
    assert_eq!(fault(serde_json::json!({"a": [{"b": 2.0}, {}], "c": {}, "d": 1})).as_deref(), Some("x.a[] has no `b`"));
    let retyped = fault(serde_json::json!({"a": [{"b": 2}], "c": {}, "d": 1}));
    assert_eq!(retyped.as_deref(), Some("x.a[].b is 2, of another type than 1.5"));
    assert_eq!(fault(serde_json::json!({"a": [], "c": {}})).as_deref(), Some("x has no `d`"));
}
