//! Every message of `wire` as bytes: fixed vectors, hostile variants of them, and arbitrary input.
//!
//! `vectors/<message>.txt` holds named encodings in hex with their diagnostic notation; `vectors/values.rs` holds the
//! Rust values of the same names; `docs/reference/telemetry.cddl` is the schema that both have to meet.

#[path = "vectors/arbitrary.rs"]
mod arbitrary;
#[path = "vectors/hostile.rs"]
mod hostile;
#[path = "vectors/item.rs"]
mod item;
#[path = "vectors/schema.rs"]
mod schema;
#[path = "vectors/values.rs"]
mod values;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use values::Named;

/// A vector as its file states it.
struct Vector {
    name: String,
    notation: String,
    bytes: Vec<u8>,
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vectors")
}

/// Reads `# diagnostic notation` followed by `name: hex`.
fn read(path: &Path) -> Vec<Vector> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut vectors = Vec::new();
    let mut notation = String::new();
    for line in text.lines().filter(|l| !l.is_empty()) {
        if let Some(comment) = line.strip_prefix("# ") {
            notation = comment.to_string();
        } else {
            let (name, hex) = line.split_once(": ").expect("a line `name: hex`");
            let bytes = unhex(hex).unwrap_or_else(|| panic!("{name}: not hex"));
            vectors.push(Vector { name: name.into(), notation: std::mem::take(&mut notation), bytes });
        }
    }
    vectors
}

fn unhex(hex: &str) -> Option<Vec<u8>> {
    let digits: Vec<u8> = hex.chars().map(|c| c.to_digit(16).map(|d| d as u8)).collect::<Option<_>>()?;
    digits.len().is_multiple_of(2).then(|| digits.chunks(2).map(|d| d[0] << 4 | d[1]).collect())
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// The file that goes with `values`, as it would be written today.
fn written(values: &[Named]) -> String {
    let lines = values.iter().map(|v| format!("# {}\n{}: {}\n", item::notation(&v.bytes), v.name, hex(&v.bytes)));
    lines.collect::<Vec<_>>().join("\n")
}

/// With `HOLDSAFE_RENEW` set the vectors are written again; then read the diff.
#[test]
fn named_values_match_bytes_and_notation() {
    for (message, values) in values::all() {
        let path = folder().join(format!("{message}.txt"));
        if std::env::var_os("HOLDSAFE_RENEW").is_some() {
            std::fs::write(&path, written(&values)).expect("the vectors can be written");
        }
        let vectors = read(&path);
        let names: Vec<&str> = vectors.iter().map(|v| v.name.as_str()).collect();
        let expected: Vec<&str> = values.iter().map(|v| v.name).collect();
        assert_eq!(names, expected, "{message}.txt; as it would be written now:\n{}", written(&values));
        for (vector, value) in vectors.iter().zip(&values) {
            assert_eq!(hex(&vector.bytes), hex(&value.bytes), "{message}/{}", value.name);
            assert_eq!(vector.notation, item::notation(&vector.bytes), "{message}/{}", value.name);
        }
    }
}

#[test]
fn each_vector_decodes_to_its_named_value() {
    for (message, values) in values::all() {
        for value in values {
            assert_eq!((value.decode)(&value.bytes, value.bytes.len()), Ok(true), "{message}/{}", value.name);
        }
    }
}

#[test]
fn no_vector_file_is_left_without_values() {
    let known: BTreeSet<String> = values::all().into_iter().map(|(message, _)| format!("{message}.txt")).collect();
    let files = std::fs::read_dir(folder()).expect("the vectors").map(|e| e.expect("an entry").file_name());
    let files = files.map(|name| name.to_string_lossy().into_owned()).filter(|name| name.ends_with(".txt"));
    assert_eq!(files.collect::<BTreeSet<_>>(), known);
}

#[test]
fn every_event_has_a_vector() {
    let (_, entries) = values::all().into_iter().find(|(message, _)| *message == "entry").expect("entries");
    let tags: BTreeSet<u8> = entries.iter().map(|e| e.event).collect();
    assert_eq!(tags.into_iter().collect::<Vec<_>>(), values::events().collect::<Vec<_>>());
}

#[test]
fn shared_memory_layout_matches_the_schema() {
    let body = wire::codec::encode(&values::drive());
    let key = wire::bus::ChannelKey([1; 32]);
    let (boot, now) = (wire::id::Boot(0x0102), wire::time::Instant(0x0a0b));
    let mut sender = wire::bus::Sender::new(wire::core::Topic::Drive, wire::id::NodeId::UNIT_A, boot, key);
    let sealed = sender.seal(now, &body);
    let (header, tag) = ("04000201000001000000000000000b0a000000000000", "793fd3998c9050f117c020de87b4c9a0");
    assert_eq!(hex(&sealed), format!("{header}{}{tag}", hex(&body)));
}
