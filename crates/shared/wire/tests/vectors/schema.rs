//! The vectors against `docs/reference/telemetry.cddl`, judged by an independent validator.

use std::path::Path;

use cddl_cat::{cbor::validate_cbor_bytes, parse_cddl};

use crate::item::items;
use crate::values;

fn schema() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../docs/reference/telemetry.cddl");
    std::fs::read_to_string(path).expect("docs/reference/telemetry.cddl")
}

#[test]
fn every_vector_meets_the_rule_of_its_message() {
    let schema = schema();
    for (message, values) in values::all() {
        for value in values {
            let verdict = validate_cbor_bytes(message, &schema, &value.bytes);
            assert!(verdict.is_ok(), "{message}/{}: {verdict:?}", value.name);
        }
    }
}

/// No vector meets the rule of another message on its channel.
#[test]
fn vectors_match_no_neighbours_rule() {
    let schema = schema();
    let channels = [&["intent", "confirmation", "ack", "report"][..], &["drive", "act"], &["seal", "tracks"]];
    for channel in channels {
        for (message, values) in values::all().into_iter().filter(|(m, _)| channel.contains(m)) {
            for other in channel.iter().filter(|o| **o != message) {
                for value in &values {
                    let verdict = validate_cbor_bytes(other, &schema, &value.bytes);
                    assert!(verdict.is_err(), "{message}/{} passes as {other}", value.name);
                }
            }
        }
    }
}

#[test]
fn a_float_anywhere_meets_no_rule() {
    let schema = schema();
    for (message, values) in values::all() {
        for value in &values {
            for item in items(&value.bytes) {
                let bytes = [&value.bytes[..item.start], &[0xf9, 0x3c, 0x00], &value.bytes[item.end..]].concat();
                let verdict = validate_cbor_bytes(message, &schema, &bytes);
                assert!(verdict.is_err(), "{message}/{} at {}", value.name, item.start);
            }
        }
    }
}

#[test]
fn the_schema_has_a_rule_for_every_message() {
    let schema = schema();
    let rules = parse_cddl(&schema).expect("valid CDDL").rules;
    for (message, _) in values::all() {
        assert!(rules.iter().any(|rule| rule.name == message), "no rule `{message}`");
    }
}
