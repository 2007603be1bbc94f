//! A CycloneDX 1.6 bill of materials: every package that `Cargo.lock` names, and, with the manifest of a run, every file that its results
//! depend on.
//!
//! It names the packages that may be linked, not those that are: the lock covers every platform and the tests, and tells no licences
//! of dependencies. A package's hash is that of its archive in the registry. There is no time in it, and the serial number is made
//! from the rest, so the same lock and manifest give the same bytes.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use crate::reader::Manifest;

/// The lock that this program was built with.
const LOCK: &str = include_str!("../../../../Cargo.lock");

/// The licence of our own packages, as in the workspace's manifest.
const LICENCE: &str = "MIT OR Apache-2.0";

#[derive(Deserialize)]
struct Lock {
    package: Vec<Package>,
}

#[derive(Deserialize)]
struct Package {
    name: String,
    version: String,
    /// `None`: one of our own.
    source: Option<String>,
    checksum: Option<String>,
    /// `name`, where that is not unique `name version`, where that is not either `name version (source)`.
    #[serde(default)]
    dependencies: Vec<String>,
}

/// The bill of materials of this program, and of the run that `manifest` is of.
pub fn sbom(manifest: Option<&Manifest>) -> String {
    let lock: Lock = toml::from_str(LOCK).expect("invariant: a test reads the lock that is built in");
    let mut bom = bom(&lock, manifest);
    bom["serialNumber"] = serial(&bom).into();
    format!("{bom:#}\n")
}

fn bom(lock: &Lock, manifest: Option<&Manifest>) -> Value {
    let files: Vec<Value> = manifest.into_iter().flat_map(|manifest| &manifest.files).map(file).collect();
    let own_packages = lock.package.iter().filter(|package| package.source.is_none()).map(Package::reference);
    let root = json!({ "ref": "holdsafe", "dependsOn": own_packages.collect::<Vec<_>>() });
    let dependencies: Vec<Value> = [root].into_iter().chain(dependencies(lock)).collect();
    json!({
        "$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {
            "lifecycles": [{ "phase": "pre-build" }],
            "component": {
                "type": "application",
                "bom-ref": "holdsafe",
                "name": "holdsafe",
                "version": env!("CARGO_PKG_VERSION"),
                "licenses": [{ "expression": LICENCE }],
            },
        },
        "components": lock.package.iter().map(component).chain(files).collect::<Vec<_>>(),
        "dependencies": dependencies,
    })
}

fn component(package: &Package) -> Value {
    let mut component = json!({
        "type": "library",
        "bom-ref": package.reference(),
        "name": package.name,
        "version": package.version,
    });
    if package.source.is_some() {
        component["purl"] = package.reference().into();
    } else {
        component["licenses"] = json!([{ "expression": LICENCE }]);
    }
    if let Some(checksum) = &package.checksum {
        component["hashes"] = json!([{ "alg": "SHA-256", "content": checksum }]);
    }
    component
}

impl Package {
    /// Package URL; a plain name for a workspace crate, which no registry has.
    fn reference(&self) -> String {
        // A plus sign in a package URL's version is escaped.
        let version = self.version.replace('+', "%2B");
        let registry = if self.source.is_some() { "pkg:cargo/" } else { "holdsafe/" };
        format!("{registry}{}@{version}", self.name)
    }

    fn is_named_by(&self, dependency: &str) -> bool {
        let mut words = dependency.split(' ');
        words.next() == Some(&self.name) && words.next().is_none_or(|version| version == self.version)
    }
}

fn dependencies(lock: &Lock) -> impl Iterator<Item = Value> {
    let mut by_name: BTreeMap<&str, Vec<&Package>> = BTreeMap::new();
    lock.package.iter().for_each(|package| by_name.entry(&package.name).or_default().push(package));
    lock.package.iter().map(move |package| {
        let needs = |dependency: &String| {
            let name = dependency.split(' ').next().unwrap_or_default();
            by_name.get(name)?.iter().find(|other| other.is_named_by(dependency)).map(|other| other.reference())
        };
        json!({ "ref": package.reference(), "dependsOn": package.dependencies.iter().filter_map(needs).collect::<Vec<_>>() })
    })
}

/// A file that results depend on: scenario, scene, policy, platform, model.
fn file((path, sha256): (&String, &String)) -> Value {
    let model = path.ends_with(".onnx");
    json!({
        "type": if model { "machine-learning-model" } else { "file" },
        "bom-ref": format!("file:{path}"),
        "name": path,
        "hashes": [{ "alg": "SHA-256", "content": sha256 }],
    })
}

/// A UUID of version 8 (RFC 9562: made in a way of one's own) from the rest of the bill.
fn serial(bom: &Value) -> String {
    let digest = Sha256::digest(bom.to_string());
    let mut bytes: [u8; 16] = digest[..16].try_into().expect("invariant: a digest has 32 bytes");
    // The version and the variant (RFC 9562, 4.1 and 4.2).
    bytes[6] = bytes[6] & 0x0f | 0x80;
    bytes[8] = bytes[8] & 0x3f | 0x80;
    let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("urn:uuid:{}-{}-{}-{}-{}", &hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..])
}
