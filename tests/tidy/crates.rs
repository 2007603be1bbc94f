//! The crates: their allowed dependencies, that none becomes a room for everything, and that the program's digest covers all that
//! a trial is made of.

use std::collections::BTreeMap;
use std::fs;

use super::measurements::MEASUREMENTS;
use super::{CORES, code, root, sources};

/// Crates that a service may know: it is a core and a process around it, and the process is of `link`. Not `ground_truth`: no service
/// has a name for an attack, a fault or the truth.
const SERVICE: &[&str] = &["wire", "config", "link"];

/// Crates that parts of the instrument may know which run like services, and the broker, whose ingress is observed.
const OBSERVED: &[&str] = &["wire", "config", "ground_truth", "link"];

/// Every crate with our crates that it may depend on, from the bottom up.
const MAY_KNOW: [(&str, &[&str]); 35] = [
    ("wire", &[]),
    // Orbits and attitudes: pure functions, with no message of ours.
    ("spacecraft", &[]),
    // What a core is made of: it crosses no link.
    ("config", &["wire", "spacecraft"]),
    // A process's own confinement.
    ("sandbox", &[]),
    // Guests, which are programs of users: the pure part, and their processes.
    ("ground_truth", &["wire"]),
    ("guest", &["wire", "ground_truth"]),
    ("confine", &["wire", "guest", "sandbox"]),
    // The other end of the protocol, for guests: it knows nothing of ours.
    ("guest-client", &[]),
    ("parallel", &[]),
    ("stats", &[]),
    ("link", &["wire", "config", "ground_truth", "sandbox"]),
    ("sim", &["wire", "config", "ground_truth", "link", "spacecraft"]),
    ("perception", &["wire", "config", "link", "spacecraft"]),
    ("autonomy", SERVICE),
    ("gateway", SERVICE),
    ("broker", OBSERVED),
    ("adversary", OBSERVED),
    ("console", SERVICE),
    ("export", &["wire", "ground_truth", "sim", "perception"]),
    ("evidence", &["wire", "config", "ground_truth"]),
    // Signed rows of finished trials: no run, no scenario.
    ("board", &["guest", "stats", "evidence"]),
    // The judge and the explainer read the log: no service, no scenario, no run.
    ("oracle", &["wire", "ground_truth", "evidence"]),
    ("explain", &["wire", "ground_truth", "evidence"]),
    // The folder of a recorded run: whoever made it, and whatever the run was of.
    ("recording", &["wire", "ground_truth", "link", "evidence"]),
    (
        "scenario",
        &["wire", "config", "guest", "ground_truth", "spacecraft", "perception", "adversary", "parallel", "evidence"],
    ),
    // Other people's recordings before the product's own guards: no run, no judge.
    ("assess", &["wire", "config", "autonomy", "scenario"]),
    (
        "topology",
        &[
            "guest",
            "wire",
            "config",
            "ground_truth",
            "sim",
            "perception",
            "autonomy",
            "gateway",
            "adversary",
            "console",
            "evidence",
            "scenario",
            "spacecraft",
        ],
    ),
    (
        "twin",
        &[
            "guest",
            "wire",
            "config",
            "ground_truth",
            "link",
            "sim",
            "perception",
            "autonomy",
            "gateway",
            "broker",
            "adversary",
            "console",
            "evidence",
            "oracle",
            "recording",
            "scenario",
            "topology",
        ],
    ),
    (
        "live",
        &[
            "guest",
            "sandbox",
            "confine",
            "wire",
            "ground_truth",
            "link",
            "sim",
            "perception",
            "autonomy",
            "gateway",
            "broker",
            "adversary",
            "console",
            "parallel",
            "evidence",
            "oracle",
            "recording",
            "scenario",
            "topology",
            "twin",
        ],
    ),
    ("stacks", &["wire", "link", "live", "broker", "evidence", "scenario"]),
    ("search", &["wire", "ground_truth", "link", "parallel", "stats", "evidence", "oracle", "scenario", "twin"]),
    (
        "results",
        &[
            "wire",
            "guest",
            "ground_truth",
            "autonomy",
            "stats",
            "evidence",
            // The table of properties, for their statements.
            "oracle",
            "explain",
            "scenario",
            "assess",
            "topology",
            "search",
        ],
    ),
    // A dossier states results as they are given: of ours it knows their objects, and neither logs nor runs.
    ("report", &["stats", "evidence", "scenario", "results"]),
    (
        "runner",
        &[
            "guest",
            "board",
            "confine",
            "sandbox",
            "wire",
            "config",
            "link",
            "perception",
            "parallel",
            "evidence",
            "oracle",
            "recording",
            "scenario",
            "topology",
            "twin",
            "live",
            "stacks",
            "search",
            "results",
        ],
    ),
    (
        "holdsafe",
        &[
            "guest",
            "board",
            // The built-in guest, a service of the program.
            "guest-client",
            "confine",
            "sandbox",
            "wire",
            "config",
            "link",
            "sim",
            "perception",
            "console",
            "assess",
            "report",
            "export",
            "parallel",
            "stats",
            "evidence",
            "recording",
            "explain",
            "scenario",
            "topology",
            "twin",
            "live",
            "search",
            "results",
            "runner",
        ],
    ),
];

/// The most lines of code, neither blank nor comment, that a crate may have.
const MOST_LINES: usize = 6_000;

/// Crates that have more, the most that these may have, and why.
const LARGE: [(&str, usize, &str); 7] = [
    ("autonomy", 6_450, "boundary, machine and driving are one core, which is forked and judged as one"),
    ("holdsafe", 8_400, "a verb a file or a folder, each with its options, its lines and their tests"),
    ("results", 6_200, "an object a command, each with its table, and the summary of one run over time for the report"),
    (
        "lab",
        7_500,
        "a measurement a file, on plans, tables and statistics that they share, and the records of published figures",
    ),
    (
        "scenario",
        8_900,
        "an attack a file, each with its checks, the platform file with its own, and a family of worlds a file",
    ),
    (
        "link",
        8_100,
        "every stack that touches the outside stands behind this one boundary, each in a folder of its own",
    ),
    (
        "console",
        11_700,
        "the window, with its map, plots and alarms, is more than half of it, in the one folder that knows how anything is drawn",
    ),
];

/// Crates on which no outcome of a trial depends.
const OUTSIDE_TRIALS: [&str; 4] = ["assess", "board", "report", "export"];

/// Folders below `crates/` that hold crates, beside the crates that stand there themselves.
const ROOMS: [&str; 5] = ["shared", "guests", "judge", "engines", "reports"];

/// The product's crates by name, each with its folder.
pub(super) fn crates() -> BTreeMap<String, String> {
    let rooms = ROOMS.iter().map(|room| format!("crates/{room}"));
    let mut found = BTreeMap::new();
    for parent in std::iter::once("crates".to_owned()).chain(rooms) {
        for entry in fs::read_dir(root().join(&parent)).expect("a readable folder") {
            let name = entry.expect("a readable entry").file_name().to_string_lossy().into_owned();
            let folder = format!("{parent}/{name}");
            if root().join(&folder).join("Cargo.toml").exists() {
                assert_eq!(found.insert(name, folder.clone()), None, "a second crate of the name of {folder}");
            } else {
                assert!(parent == "crates" && ROOMS.contains(&name.as_str()), "{folder} is no crate and no room");
            }
        }
    }
    found
}

/// The folder of one of the product's crates.
pub(super) fn crate_folder(name: &str) -> String {
    crates().remove(name).unwrap_or_else(|| panic!("no crate {name}"))
}

/// Folders of the product's crates and of the authors' measurements.
pub(super) fn folders() -> Vec<String> {
    crates().into_values().chain(MEASUREMENTS.map(|name| format!("measurements/{name}"))).collect()
}

/// Dependencies of the crate in a folder, tests aside.
pub(super) fn dependencies(folder: &str) -> Vec<String> {
    let manifest = fs::read_to_string(root().join(folder).join("Cargo.toml")).expect("a manifest");
    let manifest: toml::Table = toml::from_str(&manifest).expect("a valid manifest");
    let listed = manifest.get("dependencies").and_then(|d| d.as_table()).expect("a table of dependencies");
    listed.keys().cloned().collect()
}

#[test]
fn dependencies_point_one_way() {
    let allowed: BTreeMap<&str, &[&str]> = MAY_KNOW.into_iter().collect();
    for (name, folder) in crates() {
        let may = allowed.get(name.as_str()).unwrap_or_else(|| panic!("{folder} is not in this table"));
        for dependency in dependencies(&folder).iter().filter(|d| allowed.contains_key(d.as_str())) {
            assert!(may.contains(&dependency.as_str()), "{name} may not depend on {dependency}");
        }
    }
    let place = |name: &str| MAY_KNOW.iter().position(|(text, _)| *text == name);
    for (name, may) in MAY_KNOW {
        let later = may.iter().find(|other| place(other) >= place(name));
        assert_eq!(later, None, "{name} stands before what it may depend on");
    }
}

#[test]
fn only_link_knows_the_transport_crates() {
    assert!(CORES.iter().all(|core| crates().contains_key(*core)));
    // The live broker is one of them; the export makes whole files, the assessment reads them, and neither sends messages. The sandbox
    // asks the kernel for interfaces.
    let may = ["link", "broker", "export", "assess", "sandbox"].map(crate_folder);
    for folder in folders().iter().filter(|folder| !may.contains(folder)) {
        for transport in ["dtls", "rumqttc", "iceoryx2", "mcap", "tokio", "rustls", "mqtt5"] {
            let knows = dependencies(folder).iter().any(|d| d == transport);
            assert!(!knows, "{folder} depends on {transport}: only link (and the broker) may");
        }
    }
}

#[test]
fn only_recording_reads_a_log_off_its_files() {
    // The launcher reads what its own processes wrote, before there are trust anchors.
    let may = ["crates/shared/link/src/", "crates/judge/recording/src/", "crates/engines/live/src/witness.rs"];
    for (file, text) in ["crates", "measurements"].into_iter().flat_map(sources) {
        let reads = ["frames_of_folder", "frames_within_lengths", "frames_of_bytes", "witness::read_entries"]
            .iter()
            .any(|reader| code(&text).contains(reader));
        let is_test = file.contains("/tests/");
        assert!(!reads || is_test || may.iter().any(|may| file.starts_with(may)), "{file} reads a log past `Checked`");
    }
}

#[test]
fn no_crate_is_a_room_for_everything() {
    let lines_of = |text: &str| text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with("//")).count();
    for folder in folders() {
        let lines: usize = sources(&format!("{folder}/src")).iter().map(|(_, text)| lines_of(text)).sum();
        let name = folder.rsplit('/').next().unwrap_or_default();
        let most = LARGE.iter().find(|(large, ..)| *large == name).map_or(MOST_LINES, |(_, most, _)| *most);
        assert!(lines <= most, "{folder} has {lines} lines of code, more than {most}: split it");
    }
}

#[test]
fn program_digest_covers_every_trial_crate() {
    let build = fs::read_to_string(root().join("crates/holdsafe/build.rs")).expect("the digest's script");
    for (_, folder) in crates().into_iter().filter(|(name, _)| !OUTSIDE_TRIALS.contains(&name.as_str())) {
        assert!(build.contains(&format!("\"{folder}/src\"")), "crates/holdsafe/build.rs leaves {folder} out");
    }
}
