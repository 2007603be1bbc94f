//! Names the program by its sources: SHA-256 over every file that a trial is made of, the same for every build of them. Lists the files
//! that `holdsafe` brings along: the shipped scenarios and everything that they name. Gives `--version` its commit and its target.
//!
//! Partitions of a campaign may come from several machines and builds; only campaigns of one program are merged.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use sha2::{Digest, Sha256};

/// Inputs of a trial in the twin or on the stacks, as paths below the workspace.
const MADE_OF: [&str; 36] = [
    "Cargo.toml",
    "Cargo.lock",
    "rust-toolchain.toml",
    "crates/shared/wire/src",
    "crates/guests/guest/src",
    "crates/guests/guest-client/src",
    "crates/shared/config/src",
    "crates/shared/sandbox/services.toml",
    "crates/shared/sandbox/src",
    "crates/guests/confine/src",
    "crates/judge/ground_truth/src",
    "crates/shared/link/src",
    "crates/shared/spacecraft/src",
    "crates/sim/src",
    "crates/perception/src",
    "crates/perception/models",
    "crates/autonomy/src",
    "crates/gateway/src",
    "crates/broker/src",
    "crates/adversary/src",
    "crates/console/src",
    "crates/shared/parallel/src",
    "crates/shared/stats/src",
    "crates/judge/evidence/src",
    "crates/judge/recording/src",
    "crates/engines/scenario/src",
    "crates/judge/oracle/src",
    "crates/judge/explain/src",
    "crates/engines/topology/src",
    "crates/engines/twin/src",
    "crates/engines/live/src",
    "crates/engines/stacks/src",
    "crates/engines/search/src",
    "crates/reports/results/src",
    "crates/engines/runner/src",
    "crates/holdsafe/src",
];

/// Places of the files that `holdsafe` reads below a checkout's root, and brings along for where there is none.
const SHIPPED: [&str; 4] = ["scenarios", "platforms", "policies", "references"];
/// Their endings: other files beside them, such as an editor's, are not shipped.
const ENDINGS: [&str; 2] = ["toml", "jsonl"];

fn main() -> std::io::Result<()> {
    // Read when the script runs: a cache may bring this very script from another clone.
    let folder = std::env::var_os("CARGO_MANIFEST_DIR").ok_or_else(|| std::io::Error::other("not run by cargo"))?;
    let root = Path::new(&folder).join("../..");
    let mut digest = Sha256::new();
    for name in MADE_OF {
        println!("cargo::rerun-if-changed={}", root.join(name).display());
        for file in files(&root.join(name))? {
            let path = file.strip_prefix(&root).unwrap_or(&file).display().to_string();
            let bytes = fs::read(&file)?;
            digest.update(format!("{path}\n{}\n", bytes.len()));
            digest.update(bytes);
        }
    }
    let hex: String = digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    println!("cargo::rustc-env=HOLDSAFE_PROGRAM={hex}");
    // `lab` has this script too, and works in a checkout alone.
    if std::env::var_os("CARGO_PKG_NAME").is_none_or(|name| name != "holdsafe") {
        return Ok(());
    }
    let target = std::env::var("TARGET").map_err(std::io::Error::other)?;
    println!("cargo::rustc-env=HOLDSAFE_TARGET={target}");
    println!("cargo::rustc-env=HOLDSAFE_COMMIT={}", commit(&root).unwrap_or_else(|| "not recorded".to_owned()));
    list_shipped(&root)
}

/// The commit that a release is built of: `HOLDSAFE_COMMIT`, or the clone's, with a plus where files were changed since. None in a debug
/// build, which would be made again after each commit.
fn commit(root: &Path) -> Option<String> {
    println!("cargo::rerun-if-env-changed=HOLDSAFE_COMMIT");
    if let Ok(given) = std::env::var("HOLDSAFE_COMMIT") {
        return Some(given);
    }
    if std::env::var("PROFILE").is_ok_and(|profile| profile == "debug") {
        return None;
    }
    let git = |arguments: &[&str]| {
        let output = Command::new("git").arg("-C").arg(root).args(arguments).output().ok()?;
        let text = output.status.success().then(|| String::from_utf8(output.stdout).ok())??;
        Some(text.trim().to_owned())
    };
    // A copy of the sources may lie in a clone of something else.
    if fs::canonicalize(git(&["rev-parse", "--show-toplevel"])?).ok()? != fs::canonicalize(root).ok()? {
        return None;
    }
    println!("cargo::rerun-if-changed={}", root.join(git(&["rev-parse", "--git-path", "logs/HEAD"])?).display());
    let changed = !git(&[&["status", "--porcelain", "--"], &MADE_OF[..], &SHIPPED[..]].concat())?.is_empty();
    Some(git(&["rev-parse", "HEAD"])? + if changed { "+" } else { "" })
}

/// Writes the shipped files as an expression: a slice of paths below the root with contents.
fn list_shipped(root: &Path) -> std::io::Result<()> {
    let mut list = String::from("&[\n");
    for place in SHIPPED {
        println!("cargo::rerun-if-changed={}", root.join(place).display());
        for file in files(&root.join(place))? {
            if file.extension().is_some_and(|ending| ENDINGS.iter().any(|shipped| ending == *shipped)) {
                let path = file.strip_prefix(root).unwrap_or(&file).display().to_string();
                // Without the folder's name: it would reach the compiled crate, and no two folders would give the same program.
                let below = format!("/../../{path}");
                list.push_str(&format!(
                    "({path:?}, include_bytes!(concat!(env!(\"CARGO_MANIFEST_DIR\"), {below:?}))),\n"
                ));
            }
        }
    }
    let out = std::env::var_os("OUT_DIR").ok_or_else(|| std::io::Error::other("not run by cargo"))?;
    fs::write(Path::new(&out).join("files.rs"), list + "]\n")
}

/// Every file at or below a path, in the order of their names.
fn files(path: &Path) -> std::io::Result<Vec<PathBuf>> {
    if path.is_file() {
        return Ok(vec![path.to_owned()]);
    }
    let mut entries = fs::read_dir(path)?.map(|entry| entry.map(|e| e.path())).collect::<Result<Vec<_>, _>>()?;
    entries.sort();
    let below = entries.iter().map(|entry| files(entry)).collect::<Result<Vec<_>, _>>()?;
    Ok(below.concat())
}
