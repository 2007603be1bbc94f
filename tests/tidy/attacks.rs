//! Attacks: a file and two lines each, and no crate that knows one of them by its name without a reason.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::{root, sources};

/// Folder of the attacks.
const FOLDER: &str = "crates/engines/scenario/src/attack";

/// Fields of attacks that other files read, and why.
const READ: [(&str, &str, &str); 7] = [
    (
        "crates/engines/scenario/src/check.rs",
        "loss",
        "a condition of the link and an attack of the same kind exclude each other",
    ),
    ("crates/engines/scenario/src/check.rs", "burst_loss", "the same"),
    ("crates/engines/scenario/src/check.rs", "delay", "the same"),
    ("crates/engines/scenario/src/check.rs", "jitter", "the same"),
    ("crates/engines/topology/src/attack.rs", "loss", "the share of the link's own loss has the same name"),
    ("crates/engines/topology/src/attack.rs", "teammate", "the third unit is silent where the insider speaks for it"),
    ("crates/engines/scenario/src/check.rs", "teammate", "the third unit has to be there"),
];

/// Attacks by an actor that is cast with its own key: the crate of participants reads the identity of that key.
const CAST: [(&str, &str); 2] =
    [("crates/engines/topology/src/station.rs", "rogue"), ("crates/engines/topology/src/station.rs", "takeover")];

/// Keys and types, from the rows of the registration.
fn rows() -> Vec<(String, String)> {
    let text = fs::read_to_string(root().join(FOLDER).join("mod.rs")).expect("the registration");
    let row = |line: &str| {
        let (key, rest) = line.trim().split_once(": ")?;
        let (kind, rest) = rest.split_once(", ")?;
        rest.ends_with("\";").then(|| (key.to_owned(), kind.to_owned()))
    };
    text.lines().filter_map(row).collect()
}

#[test]
fn each_attack_is_a_file_and_a_row() {
    let entries = fs::read_dir(root().join(FOLDER)).expect("the folder").map(|e| e.expect("an entry").path());
    let mut files: Vec<String> =
        entries.map(|path| path.file_stem().expect("a name").to_string_lossy().into_owned()).collect();
    files.retain(|name| name != "mod");
    let mut keys: Vec<String> = rows().into_iter().map(|(key, _)| key).collect();
    files.sort();
    keys.sort();
    assert_eq!(files, keys, "a file of {FOLDER} is named as the table of its row");
}

#[test]
fn no_other_file_names_an_attack() {
    let mut named = Vec::new();
    let readers = ["crates/engines/scenario/src", "crates/engines/topology/src"].into_iter().flat_map(sources);
    for (file, text) in readers.filter(|(file, _)| !file.starts_with(FOLDER) && !file.contains("tests")) {
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        for (key, _) in rows() {
            let read = [format!("s.{key}."), format!("scenario.{key}.")].iter().any(|field| code.contains(field));
            let known = READ.iter().any(|(name, field, _)| (*name, *field) == (file.as_str(), key.as_str()))
                || CAST.contains(&(file.as_str(), key.as_str()));
            if read && !known {
                named.push(format!("{file} reads `{key}`"));
            }
        }
    }
    assert!(named.is_empty(), "what an attack does stands in its own file: {named:?}");
}

/// File of a new kind of attack, with an act that the relay can do already.
const BLACKOUT: &str = r#"//! `[[blackout]]`: the relay without a key loses every telemetry datagram.

use adversary::plan::DatagramAction;
use evidence::{Planned, Takes};
use ground_truth::Action;

use super::{Act, Attack, Injection, attacks, during};

attacks! {
    /// Loses every datagram.
    Blackout {}
}

impl Attack for Blackout {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Datagram(during(self, self.direction, phase_ms, DatagramAction::Loss { permille: 1000 })))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::of(Planned::Action(Action::Drop)).taking(Takes::Records(self.direction.side())))
    }
}
"#;

/// Copies the files that git tracks, without build output.
fn copy(to: &Path) {
    let listed = Command::new("git").args(["ls-files", "-z"]).current_dir(root()).output().expect("git");
    for file in String::from_utf8(listed.stdout).expect("names").split('\0').filter(|file| !file.is_empty()) {
        let target = to.join(file);
        fs::create_dir_all(target.parent().expect("a folder")).expect("a folder");
        fs::copy(root().join(file), target).expect("a copy");
    }
}

#[test]
#[ignore = "long: compiles half of the workspace"]
fn a_new_attack_touches_two_files() {
    let tree = tempfile::tempdir().expect("a folder");
    copy(tree.path());
    let folder = tree.path().join(FOLDER);
    fs::write(folder.join("blackout.rs"), BLACKOUT).expect("the attack");
    let registration = fs::read_to_string(folder.join("mod.rs")).expect("the registration");
    let (module, row) = ("pub(super) mod broker_delay;\n", "            delay: Delay,");
    let replaced = registration.replacen(module, &format!("pub(super) mod blackout;\n{module}"), 1).replacen(
        row,
        &format!("            blackout: Blackout, 16, \"Every telemetry datagram lost.\";\n{row}"),
        1,
    );
    fs::write(folder.join("mod.rs"), replaced).expect("the registration");
    let scenario = scenario::find(tree.path(), "loss").expect("a shipped scenario");
    let text = fs::read_to_string(&scenario).expect("a scenario");
    fs::write(scenario, text.replace("[[loss]]", "[[blackout]]").replace("share = 1.0\n", "")).expect("a scenario");
    let run = Command::new(env!("CARGO"))
        .args(["run", "--offline", "--locked", "--bin", "holdsafe", "--", "run", "loss"])
        .current_dir(tree.path())
        // Cargo would take the copy's build output in this checkout's folder for this checkout's own.
        .env("CARGO_TARGET_DIR", root().join("target/attack"))
        .output()
        .expect("cargo");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
}
