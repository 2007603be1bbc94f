//! The workspaces of the measurements and of the fuzzer: built of the product's versions, optimised as
//! the released program is. Whether they compile, and their tests, are left to `tools/release/measurements`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use toml::Table;

use super::crates::{crates, dependencies};
use super::root;

/// The crates of the measurements.
pub(super) const MEASUREMENTS: [&str; 4] = ["dataset", "lab", "mavlink_relay", "trainer"];

/// Crates of ours that a crate of the measurements may depend on; `lab` may depend on all. `mavlink_relay` attacks other authors'
/// link, with none of our messages.
const MAY_KNOW: [(&str, &[&str]); 3] = [
    ("mavlink_relay", &[]),
    ("dataset", &["wire", "config", "sim", "perception"]),
    ("trainer", &["wire", "config", "ground_truth", "sim", "perception", "dataset", "parallel"]),
];

/// The one registry that packages come from.
const REGISTRY: &str = "registry+https://github.com/rust-lang/crates.io-index";

fn read(file: &str) -> Table {
    fs::read_to_string(root().join(file)).expect(file).parse().expect(file)
}

/// Packages of a lock that come from elsewhere, with their versions.
fn locked(file: &str) -> BTreeMap<String, BTreeSet<String>> {
    let mut found: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for package in read(file)["package"].as_array().expect("packages") {
        let text = |key: &str| package.get(key).and_then(|value| value.as_str());
        let Some(source) = text("source") else { continue };
        assert_eq!(source, REGISTRY, "{file}: {:?}", text("name"));
        let version = text("version").expect("a version").to_owned();
        found.entry(text("name").expect("a name").to_owned()).or_default().insert(version);
    }
    found
}

#[test]
fn measurements_know_the_listed_crates() {
    let members = &read("measurements/Cargo.toml")["workspace"]["members"];
    assert_eq!(*members, toml::Value::from(MEASUREMENTS.to_vec()));
    let our_crates: Vec<String> = crates().into_keys().chain(MEASUREMENTS.map(str::to_owned)).collect();
    for (name, may) in MAY_KNOW {
        for dependency in dependencies(&format!("measurements/{name}")).iter().filter(|d| our_crates.contains(d)) {
            assert!(may.contains(&dependency.as_str()), "{name} may not depend on {dependency}");
        }
    }
}

/// One digest of sources and versions names the program for both workspaces.
#[test]
fn locks_agree_on_versions() {
    let product = locked("Cargo.lock");
    for file in ["measurements/Cargo.lock", "fuzz/Cargo.lock"] {
        let other = locked(file);
        // The window of macOS, which nobody builds here.
        let own_packages = product.iter().filter(|(name, _)| !name.starts_with("objc2"));
        let shared = own_packages.filter_map(|(name, versions)| Some((name, versions, other.get(name)?)));
        for (name, versions, others) in shared {
            assert!(!versions.is_disjoint(others), "{file}: {name} in {others:?}, the product's is {versions:?}");
        }
    }
}

/// A lower level anywhere would be of other code than the released program's, which is optimised throughout.
#[test]
fn measured_code_is_optimised_as_released() {
    let measured = read("measurements/Cargo.toml");
    let release = measured["profile"]["release"].as_table().expect("a profile");
    assert!(!release.contains_key("package") && !release.contains_key("opt-level"), "{release}");
}

#[test]
fn workspaces_share_toolchain_and_lints() {
    let (product, measured, fuzz) = (read("Cargo.toml"), read("measurements/Cargo.toml"), read("fuzz/Cargo.toml"));
    for part in ["package", "lints"] {
        assert_eq!(measured["workspace"][part], product["workspace"][part], "{part}");
    }
    assert_eq!(fuzz["package"]["rust-version"], product["workspace"]["package"]["rust-version"]);
}

/// A level that is not the highest would hold in the released program too, which inherits it unless it has its own.
#[test]
fn released_program_is_optimised_throughout() {
    let profile = &read("Cargo.toml")["profile"];
    assert_eq!(profile["released"]["opt-level"].as_integer(), Some(3));
    let own_value = profile["released"].get("package");
    for (name, inherited) in profile["release"]["package"].as_table().expect("packages") {
        let settings = own_value.and_then(|packages| packages.get(name)).unwrap_or(inherited);
        assert_eq!(settings["opt-level"].as_integer(), Some(3), "{name}");
    }
}
