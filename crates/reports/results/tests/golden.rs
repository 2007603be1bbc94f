//! Result objects against a golden file for each kind and schema version, `golden/<kind>-v<version>.json`.
//!
//! A file has every field of its object at least once. It is read into the object that the program has today and written again, to
//! the byte: a field that is removed, renamed, moved or of another type does not come back the same, and one that is added without a
//! default is missed when an older file is read. A new form is a new version with its own file; the older file stays.
//! The objects that only one verb prints, and no program reads, are held likewise in `crates/holdsafe/tests/command/golden.rs`.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use evidence::SCHEMA_VERSION;
use evidence::trial::Trial;
use results::report::{
    Ablation, AssessObject, BenchLive, CampaignObject, CurveObject, Matrix, RareObject, Reference, RunObject,
    RunsObject, SearchObject, TwinCost,
};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Reads an object and writes it again.
type Again = fn(&str) -> Result<String, String>;

/// Every kind of version 1, with its object.
const VERSION_1: [(&str, Again); 13] = [
    ("ablation", reserialise::<Ablation>),
    ("assess", reserialise::<AssessObject>),
    ("bench-live", reserialise::<BenchLive>),
    ("bench-twin", reserialise::<TwinCost>),
    ("campaign", reserialise::<CampaignObject>),
    ("curve", reserialise::<CurveObject>),
    ("matrix", reserialise::<Matrix>),
    ("rare", reserialise::<RareObject>),
    ("reference", reserialise::<Reference>),
    ("run", reserialise::<RunObject>),
    ("runs", reserialise::<RunsObject>),
    ("search", reserialise::<SearchObject>),
    // The one without a number of its version.
    ("trial", reserialise::<Trial>),
];

fn reserialise<T: DeserializeOwned + Serialize>(text: &str) -> Result<String, String> {
    let object: T = serde_json::from_str(text).map_err(|e| e.to_string())?;
    serde_json::to_string_pretty(&object).map_err(|e| e.to_string())
}

fn golden(kind: &str) -> String {
    let file = format!("tests/golden/{kind}-v1.json");
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(&file)).unwrap_or_else(|e| panic!("{file}: {e}"))
}

/// The object without the name of its kind, which its printing adds in front.
fn unnamed(text: &str, kind: &str) -> String {
    let named = format!("{{\n  \"kind\": \"{kind}\",\n");
    assert!(text.starts_with(&named), "{kind}: the file names another kind");
    text.replacen(&named, "{\n", 1)
}

#[test]
fn golden_file_is_read_and_written_to_the_byte() {
    for (kind, again) in VERSION_1 {
        let text = golden(kind);
        let written = again(&text).unwrap_or_else(|e| panic!("{kind}-v1.json: {e}"));
        assert_eq!(written + "\n", unnamed(&text, kind), "{kind}-v1.json");
    }
}

#[test]
fn version_of_today_has_golden_files() {
    assert_eq!(SCHEMA_VERSION, 1, "the new version needs its own files and table; those of version 1 stay");
    let folder = fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden")).unwrap();
    let files: BTreeSet<String> = folder.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    let named: BTreeSet<String> = VERSION_1.iter().map(|(kind, _)| format!("{kind}-v1.json")).collect();
    assert_eq!(files, named);
}

/// Fields that version 1 did not have from the start, by kind and place.
const ADDED: [(&str, &str, &str); 13] = [
    ("ablation", "/checks/0", "unchanged_upper_95"),
    ("campaign", "/rows/0/claim", "looked_at"),
    ("curve", "", "detector"),
    ("curve", "/lines/0/points/0", "believed_m"),
    ("curve", "/lines/0/points/0", "claims_accepted"),
    ("run", "", "detector"),
    ("run", "", "expected"),
    ("run", "", "mission"),
    ("run", "", "platform"),
    ("run", "/mission", "progress"),
    ("run", "/summary", "host_spoilt"),
    ("run", "/trials/0", "knowledge"),
    ("run", "/trials/0/mission", "progress"),
];

#[test]
fn result_from_before_a_field_is_read() {
    for (kind, place, field) in ADDED {
        let (_, repeated) = VERSION_1.into_iter().find(|(name, _)| *name == kind).unwrap();
        let mut older: serde_json::Value = serde_json::from_str(&golden(kind)).unwrap();
        let value =
            older.pointer_mut(place).and_then(|parent| parent.as_object_mut()).and_then(|map| map.remove(field));
        assert!(value.is_some(), "{kind}{place} has no {field}");
        repeated(&older.to_string()).unwrap_or_else(|e| panic!("{kind} without {place}/{field}: {e}"));
    }
}
