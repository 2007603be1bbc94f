//! The bill of materials.

use std::collections::BTreeSet;

use report::reader::Manifest;
use report::sbom;
use serde_json::Value;

use super::{read, violations, write_json};

const SCHEMA: &str = "bom-1.6.schema.json";

fn manifest() -> Manifest {
    Manifest::read("manifest.json", read("results/manifest.json").as_bytes()).expect("a manifest")
}

/// The schema notices an invalid one.
#[test]
fn bill_satisfies_its_schema() {
    let mut bom = write_json("holdsafe.cdx.json", &sbom(Some(&manifest())));
    assert_eq!(violations(SCHEMA, &bom), Vec::<String>::new());
    bom["components"][0]["hashes"][0]["content"] = "none".into();
    bom["components"][1]["licenses"] = serde_json::json!([{ "license": { "id": "no such licence" } }]);
    assert_eq!(violations(SCHEMA, &bom).len(), 2);
}

/// Each dependency is one of the listed components.
#[test]
fn bill_names_every_locked_package_once() {
    let bom = write_json("program.cdx.json", &sbom(None));
    let lock = read("../../../../Cargo.lock");
    let components = bom["components"].as_array().unwrap();
    assert_eq!(components.len(), lock.lines().filter(|line| *line == "[[package]]").count());
    let references: BTreeSet<&str> = components.iter().map(|c| c["bom-ref"].as_str().unwrap()).collect();
    assert_eq!(references.len(), components.len());
    let needed: Vec<&Value> =
        bom["dependencies"].as_array().unwrap().iter().flat_map(|d| d["dependsOn"].as_array().unwrap()).collect();
    assert!(needed.iter().all(|reference| references.contains(reference.as_str().unwrap())));
    let listed = lock.lines().filter(|line| line.starts_with(" \"")).count();
    let own_count = components.iter().filter(|c| c.get("purl").is_none()).count();
    assert_eq!(needed.len(), listed + own_count, "every dependency of the lock, and our own packages of the whole");
}

#[test]
fn packages_have_hashes_and_ours_a_licence() {
    let bom = write_json("program.cdx.json", &sbom(None));
    let component =
        |name: &str| bom["components"].as_array().unwrap().iter().find(|c| c["name"] == name).unwrap().clone();
    let serde = component("serde_json");
    assert!(serde["purl"].as_str().unwrap().starts_with("pkg:cargo/serde_json@"), "{serde}");
    let checksum = serde["hashes"][0]["content"].as_str().unwrap();
    assert!(read("../../../../Cargo.lock").contains(&format!("name = \"serde_json\"\nversion = {}", serde["version"])));
    assert!(read("../../../../Cargo.lock").contains(&format!("checksum = \"{checksum}\"")));
    assert_eq!(component("wire")["licenses"][0]["expression"], "MIT OR Apache-2.0");
    assert!(read("../../../../Cargo.toml").contains("license = \"MIT OR Apache-2.0\""));
}

#[test]
fn needed_version_of_several_is_named() {
    let bom = write_json("program.cdx.json", &sbom(None));
    let versions = |name: &str| bom["components"].as_array().unwrap().iter().filter(|c| c["name"] == name).count();
    assert!(versions("thiserror") > 1 && versions("toml") > 1, "another package has to be the example");
    let needs = bom["dependencies"]
        .as_array()
        .unwrap()
        .iter()
        .find(|d| d["ref"].as_str().unwrap().starts_with("holdsafe/report@"));
    let needs = needs.unwrap()["dependsOn"].to_string();
    assert!(needs.contains("pkg:cargo/thiserror@2.") && !needs.contains("pkg:cargo/thiserror@1."), "{needs}");
    assert!(needs.contains("pkg:cargo/toml@1.") && needs.contains("%2Bspec"), "a plus sign is escaped: {needs}");
}

#[test]
fn run_files_are_listed_with_digests() {
    let bom = write_json("run.cdx.json", &sbom(Some(&manifest())));
    let component =
        |name: &str| bom["components"].as_array().unwrap().iter().find(|c| c["name"] == name).unwrap().clone();
    let (model, scenario) = (component("crates/perception/models/detector.onnx"), component("scenarios/replay.toml"));
    assert_eq!((&model["type"], &scenario["type"]), (&"machine-learning-model".into(), &"file".into()));
    assert_eq!(scenario["hashes"][0]["content"], manifest().files["scenarios/replay.toml"].as_str());
}

/// Other files give another serial number.
#[test]
fn same_inputs_give_the_same_bytes() {
    assert_eq!(sbom(Some(&manifest())), sbom(Some(&manifest())));
    let serial = |text: String| serde_json::from_str::<Value>(&text).unwrap()["serialNumber"].to_string();
    assert_ne!(serial(sbom(Some(&manifest()))), serial(sbom(None)));
}

#[test]
fn a_manifest_without_digests_is_refused() {
    let refused = Manifest::read("m.json", br#"{"files":{"scenarios/x.toml":"none"}}"#).expect_err("a refusal");
    assert!(refused.to_string().contains("m.json: `scenarios/x.toml` has no SHA-256"), "{refused}");
}
