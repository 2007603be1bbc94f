//! SARIF 2.1.0, as code scanners show it: a run for each file, a rule for each threat, property and class, a result for each class that
//! was not expected and each finding of a search.
//!
//! Expected classes are no results, and a search's finding under a waived check is a note: it shows the benefit of the check. A result
//! lies at the scenario's file, relative to `SRCROOT`.

use std::collections::BTreeMap;

use evidence::trial::Outcome;
use results::report::{FindingRow, MatrixRow, SearchObject, property_statement};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use crate::reader::{FoundResult, Given, Results};
use crate::tried::{Tried, meaning, tried};

/// Published address of the schema.
const SCHEMA: &str = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json";

/// Rules by their id.
type Rules = BTreeMap<String, Value>;

/// The file.
pub fn sarif(results: &Results) -> String {
    let runs: Vec<Value> = results.files().iter().map(|file| run(results, file)).collect();
    format!("{:#}\n", json!({ "$schema": SCHEMA, "version": "2.1.0", "runs": runs }))
}

fn run(all: &Results, file: &Given) -> Value {
    let mut rules = Rules::new();
    let mut results = Vec::new();
    if let FoundResult::Matrix(matrix) = &file.found {
        rules.extend(matrix.rows.iter().map(|row| (row.id.clone(), threat(row))));
    }
    for one in tried(file) {
        let uri = uri(all, one.scenario);
        results.extend(one.unexpected().map(|(class, n)| unexpected(&mut rules, &one, class, n, &uri)));
    }
    if let FoundResult::Search(search) = &file.found {
        let uri = uri(all, &search.scenario);
        results.extend(search.findings.iter().map(|finding| found(&mut rules, search, finding, &uri)));
    }
    let place: BTreeMap<&str, usize> = rules.keys().map(String::as_str).zip(0..).collect();
    for result in &mut results {
        result["ruleIndex"] = result["ruleId"].as_str().and_then(|id| place.get(id)).copied().into();
    }
    let rules: Vec<&Value> = rules.values().collect();
    json!({
        "tool": { "driver": { "name": "holdsafe", "version": env!("CARGO_PKG_VERSION"), "rules": rules } },
        "automationDetails": { "id": file.file },
        "originalUriBaseIds": { "SRCROOT": { "description": { "text": "The root of the holdsafe repository." } } },
        "invocations": [{ "executionSuccessful": true }],
        "results": results,
        "properties": { "sha256": file.sha256 },
    })
}

fn threat(row: &MatrixRow) -> Value {
    let tags: Vec<&str> = ["security"].into_iter().chain(row.techniques.iter().map(String::as_str)).collect();
    // The name that files have, not the words.
    let requirement = json!(row.requirement);
    let requirement = requirement.as_str().unwrap_or_default();
    json!({
        "id": row.id,
        "shortDescription": { "text": row.threat },
        "fullDescription": { "text": format!("Must come of it: {}", row.containment) },
        "help": { "text": format!("{}, {}. STRIDE {}.", row.interface, requirement, row.stride) },
        "properties": { "tags": tags },
    })
}

/// The rule of a property, or of a class where no property is named.
fn rule(rules: &mut Rules, finding: Option<&str>, class: Outcome) -> String {
    let named = finding.and_then(|text| text.split(|c: char| !c.is_ascii_alphanumeric()).next());
    let (id, text) = named.and_then(property_statement).unwrap_or((class.name(), meaning(class)));
    rules.entry(id.to_owned()).or_insert_with(|| json!({ "id": id, "shortDescription": { "text": text } }));
    id.to_owned()
}

fn unexpected(rules: &mut Rules, one: &Tried, class: Outcome, n: u64, uri: &str) -> Value {
    let id = match one.row {
        Some(row) => row.id.clone(),
        None => rule(rules, one.findings.first().copied(), class),
    };
    let mut text =
        format!("{} in {n} of {} trials of {}; expected {}.", class.name(), one.n, one.name(), one.expected_told());
    for part in one.findings.iter().chain([&one.reproduce.as_str()]).filter(|part| !part.is_empty()) {
        text = format!("{text}\n{part}");
    }
    let seen = [&id, one.scenario, one.cell.unwrap_or(""), &one.set.join(" "), one.policy.unwrap_or(""), class.name()];
    let properties = json!({
        "n": one.n,
        "outcomes": one.outcomes.iter().map(|(class, n)| (class.name(), n)).collect::<BTreeMap<_, _>>(),
        "unsafe_upper_95": one.unsafe_upper_95,
        "evidence": one.evidence.name(),
        "counts": one.counts,
        "watermark": one.watermark,
        "seed": one.seed,
        "reproduce": one.reproduce,
    });
    result(&id, level(class), &text, uri, &seen, &properties)
}

fn found(rules: &mut Rules, search: &SearchObject, finding: &FindingRow, uri: &str) -> Value {
    let id = rule(rules, Some(&finding.broken), finding.outcome);
    let level = if search.watermark.is_some() { "note" } else { level(finding.outcome) };
    let parts = [finding.finding.as_deref(), search.watermark.as_deref(), Some(&finding.reproduce)];
    let text = parts.into_iter().flatten().fold(
        format!("{} while {} goes on: {}", finding.outcome.name(), search.scenario, finding.word),
        |text, part| format!("{text}\n{part}"),
    );
    let seen = [&id, &search.scenario, &search.policy, &search.alphabet, &finding.word, finding.outcome.name()];
    let properties = json!({
        "alphabet": search.alphabet,
        "stopped_by": finding.stopped_by,
        "watermark": search.watermark,
        "seed": search.seed,
        "draws": search.draws,
        "reproduce": finding.reproduce,
    });
    result(&id, level, &text, uri, &seen, &properties)
}

/// A broken property, or an undetected effect, is an error; another unexpected class a warning.
fn level(class: Outcome) -> &'static str {
    match class {
        Outcome::Unsafe | Outcome::Late | Outcome::Undetected => "error",
        Outcome::Invalid
        | Outcome::GuestFailed
        | Outcome::FalseTrip
        | Outcome::HoldSafe
        | Outcome::Degraded
        | Outcome::Rejected
        | Outcome::Stuck
        | Outcome::Nominal => "warning",
    }
}

/// One result; `seen` tells it from every other, whatever the number of trials and the seed.
fn result(id: &str, level: &str, text: &str, uri: &str, seen: &[&str], properties: &Value) -> Value {
    let mut digest = Sha256::new();
    for part in seen {
        // Lengths delimit the parts: different parts never hash as the same text.
        digest.update((part.len() as u64).to_le_bytes());
        digest.update(part);
    }
    let print: String = digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    json!({
        "ruleId": id,
        "level": level,
        "message": { "text": text },
        "locations": [{ "physicalLocation": {
            "artifactLocation": { "uri": uri, "uriBaseId": "SRCROOT" },
            "region": { "startLine": 1 },
        } }],
        "partialFingerprints": { "holdsafe/v1": print },
        "properties": properties,
    })
}

/// The file of a scenario, relative to `SRCROOT`: in the folder that it is known to lie in.
fn uri(results: &Results, scenario: &str) -> String {
    let folder = results.folder(scenario).map(|folder| format!("{}/", escaped(folder))).unwrap_or_default();
    format!("scenarios/{folder}{}.toml", escaped(scenario))
}

/// A name as part of a URI (RFC 3986, unreserved characters as they are).
fn escaped(name: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~".contains(&byte);
    name.bytes().map(|b| if plain(b) { char::from(b).to_string() } else { format!("%{b:02X}") }).collect()
}
