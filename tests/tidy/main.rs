//! The invariants of ARCHITECTURE.md, held over the sources themselves.

mod attacks;
mod catalogue;
mod circles;
mod confinement;
mod crates;
mod domains;
mod figures;
mod judge;
mod links;
mod measurements;
mod records;
mod results;
mod supply;
mod words;

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().expect("the workspace is there")
}

/// Every Rust source below `folder`, with its path from the root; build folders aside.
fn sources(folder: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut waiting = vec![root().join(folder)];
    while let Some(directory) = waiting.pop() {
        for entry in fs::read_dir(&directory).expect("a readable folder") {
            let path = entry.expect("a readable entry").path();
            if path.is_dir() && path.file_name().is_some_and(|name| name != "target") {
                waiting.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let name = path.strip_prefix(root()).expect("below the root").display().to_string();
                found.push((name, fs::read_to_string(&path).expect("a readable source")));
            }
        }
    }
    found.sort();
    found
}

/// Sources of the product's crates and of the authors' measurements.
fn crate_sources() -> Vec<(String, String)> {
    ["crates", "measurements"].into_iter().flat_map(sources).collect()
}

/// Code without its comments.
fn code(text: &str) -> String {
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// Files of a service crate that belong to its process, not to its core.
fn is_process(file: &str) -> bool {
    let process = ["/process.rs", "/main.rs", "console/src/gui/app.rs"];
    let live_broker = ["broker/src/server.rs", "broker/src/tls.rs", "broker/src/gate.rs", "broker/src/watched.rs"];
    file.contains("/process/") || process.iter().chain(&live_broker).any(|end| file.ends_with(end))
}

const CORES: [&str; 9] =
    ["wire", "config", "sim", "perception", "autonomy", "gateway", "broker", "adversary", "console"];

#[test]
fn no_core_knows_clock_socket_tokio_or_link() {
    let foreign = [
        "Instant::now",
        "SystemTime",
        "thread::sleep",
        "tokio",
        "std::net",
        "UdpSocket",
        "TcpStream",
        "std::fs",
        "std::env",
        " link::",
    ];
    for name in CORES {
        for (file, text) in sources(&format!("{}/src", crates::crate_folder(name))) {
            if is_process(&file) {
                continue;
            }
            let code = code(&text);
            for word in foreign {
                assert!(
                    !code.contains(word),
                    "{file} has `{word}`: cores are handed time and bytes; only link and processes do I/O"
                );
            }
        }
    }
}

/// The macros of the standard library panic when the stream is gone. The trainer is a tool of authors.
#[test]
fn one_module_writes_lines_for_a_person() {
    for (file, text) in crate_sources() {
        let is_product = file.contains("/src/") && !file.starts_with("measurements/trainer/");
        let printed = ["println!(", "print!("].iter().any(|word| code(&text).contains(word));
        assert!(!is_product || !printed, "{file} prints by itself: use link::terminal, or link::note!");
    }
}

/// A mutant without its place is never switched on, and would be taken for one that was noticed or not.
#[test]
fn every_mutant_has_one_place_in_sources() {
    for list in ["mutants.toml", "properties.toml"] {
        let text = fs::read_to_string(root().join("tests/mutants").join(list)).unwrap();
        let table: toml::Table = text.parse().unwrap();
        let mutants: Vec<&toml::Value> = table.values().filter_map(toml::Value::as_array).flatten().collect();
        // One in several places lists them; any other is its place.
        let places = |mutant: &toml::Value| mutant.get("places").and_then(toml::Value::as_array).cloned();
        let places = mutants.iter().flat_map(|mutant| places(mutant).unwrap_or_else(|| vec![(*mutant).clone()]));
        let found = places.map(|place| {
            let text = |key: &str| place.get(key).and_then(toml::Value::as_str).expect(key).to_owned();
            let times = fs::read_to_string(root().join(text("file"))).unwrap().matches(&text("find")).count();
            assert_eq!(times, 1, "{list}: `{}` in {}", text("find"), text("file"));
            for part in ["find", "replace"].map(text) {
                // Each is put between braces.
                assert_eq!(part.matches('{').count(), part.matches('}').count(), "{list}: `{part}`");
            }
        });
        assert!(found.count() >= mutants.len() && mutants.len() > 20, "{list}");
    }
}

#[test]
fn only_the_window_knows_how_anything_is_drawn() {
    for (file, text) in crate_sources().into_iter().filter(|(file, _)| file.contains("/src/")) {
        let draws = ["eframe", "egui"].iter().any(|name| code(&text).contains(name));
        assert!(!draws || file.starts_with("crates/console/src/gui/"), "{file} draws: only the console's window may");
    }
}

#[test]
fn cores_are_forked_at_one_place() {
    let call = ".fork(world)";
    let callers: Vec<String> = crate_sources()
        .into_iter()
        .filter(|(_, text)| code(text).lines().any(|l| l.contains(call) && l.contains("core")))
        .map(|(file, _)| file)
        .collect();
    assert_eq!(callers, ["crates/engines/twin/src/part.rs"]);
}

/// Only the twin shares them, and the judge that verifies one recording repeatedly.
#[test]
fn verified_signatures_are_shared_by_few_crates() {
    let sharers: Vec<String> = crate_sources()
        .into_iter()
        .filter(|(file, text)| code(text).contains("Verified::default") && !file.ends_with("twin/src/verified.rs"))
        .map(|(file, _)| file)
        .collect();
    assert_eq!(sharers, ["crates/engines/twin/src/assemble.rs", "measurements/lab/src/bench/tamper.rs"]);
    let implementers: Vec<String> = crate_sources()
        .into_iter()
        .filter(|(_, text)| code(text).contains("impl Verifier for"))
        .map(|(file, _)| file)
        .collect();
    assert_eq!(implementers, ["crates/engines/twin/src/verified.rs"]);
}

/// A peer gives away neither name nor number (`tests/boundary`); the ways left are its certificate's text and its number in
/// `wire`.
#[test]
fn peer_and_origin_meet_in_attribution_alone() {
    let ways = ["PeerId::from_name", "PeerId::from_uri", "NodeId::numbered", "peer.number()", "NodeId::from_name"];
    for folder in ["wire", "autonomy", "gateway", "console"] {
        for (file, text) in sources(&format!("{}/src", crates::crate_folder(folder))) {
            let found = ways.iter().find(|way| code(&text).contains(**way));
            let is_attribution = file == "crates/shared/wire/src/trust/attribution.rs";
            assert!(
                is_attribution || found.is_none(),
                "{file} makes a peer or a node of a name: {}",
                found.unwrap_or(&"")
            );
        }
    }
}

#[test]
fn every_file_says_what_it_is() {
    for (file, text) in ["crates", "fuzz", "measurements", "tests"].into_iter().flat_map(sources) {
        let fixture = file.contains("/compile_fail/");
        assert!(
            fixture || text.starts_with("//!"),
            "{file} does not start with what it is and what it leaves to others"
        );
    }
}

#[test]
fn every_scenario_and_every_refusal_is_documented() {
    let scenarios =
        fs::read_to_string(root().join("docs/reference/scenarios.md")).expect("docs/reference/scenarios.md");
    let folders = [scenario::shipped, scenario::rendered, scenario::demo, scenario::honest];
    let listed = folders.map(|list| list(&root()));
    for path in listed.into_iter().flat_map(|files| files.expect("scenarios/")) {
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        assert!(scenarios.contains(&format!("`{name}`")), "docs/reference/scenarios.md does not tell of `{name}`");
    }
    let refusals = fs::read_to_string(root().join("docs/reference/refusals.md")).expect("docs/reference/refusals.md");
    for reason in wire::refusal::Reason::ALL {
        assert!(
            refusals.contains(&format!("| `{}` |", reason.name())),
            "docs/reference/refusals.md does not tell of `{}`",
            reason.name()
        );
    }
}

/// Checks each `(N s long` in the row of a scenario, or of several.
#[test]
fn documented_scenario_lengths_are_those_of_files() {
    let page = fs::read_to_string(root().join("docs/reference/scenarios.md")).expect("docs/reference/scenarios.md");
    let mut compared = 0;
    for row in page.lines().filter(|line| line.starts_with("| `")) {
        let mut cells = row.trim_start_matches("| ").split(" | ");
        let names = cells.next().unwrap_or_default().split('`').skip(1).step_by(2);
        let stated = cells.next().unwrap_or_default().split(" s long").next().and_then(|text| text.rsplit('(').next());
        let Some(stated) = stated.and_then(|text| text.parse::<f64>().ok()) else { continue };
        for name in names {
            let file = scenario::find(&root(), name).unwrap_or_else(|| panic!("no scenario {name}"));
            let seconds = scenario::load(&file).expect("it loads").duration_s.get();
            assert!((seconds - stated).abs() < 1e-9, "docs/reference/scenarios.md: {name} lasts {seconds} s");
            compared += 1;
        }
    }
    assert!(compared > 8, "{compared} lengths found");
}

/// A dependency of tests turns this on for every build with tests in it, so no test of a value would miss it.
#[test]
fn shipped_program_reads_json_numbers_exactly() {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).expect("a manifest");
    let manifest: toml::Table = toml::from_str(&manifest).expect("a valid manifest");
    let features = &manifest["workspace"]["dependencies"]["serde_json"]["features"];
    let exact = features.as_array().is_some_and(|all| all.iter().any(|f| f.as_str() == Some("float_roundtrip")));
    assert!(
        exact,
        "Cargo.toml: serde_json without `float_roundtrip` changes one finished trial in ten as it is read back"
    );
}

#[test]
fn the_pinned_toolchain_is_the_stated_minimum() {
    let read = |name: &str| fs::read_to_string(root().join(name)).expect(name).parse::<toml::Table>().expect("valid");
    let (pinned, workspace) = (read("rust-toolchain.toml"), read("Cargo.toml"));
    let stated = workspace["workspace"]["package"]["rust-version"].as_str().expect("a version");
    assert_eq!(pinned["toolchain"]["channel"].as_str(), Some(format!("{stated}.0").as_str()));
}

/// Mark of a test that `cargo test` leaves out; the reason follows.
const LONG: &str = "#[ignore = \"long: ";

#[test]
fn nothing_is_left_over() {
    // Measurements and a thousand sessions of guests take minutes, and a launcher that is killed is a part of a test.
    let by_hand = |file: &str, marker: &str| marker == "#[ignore" && file.starts_with("crates/guests/confine/tests/");
    // Long tests run before a release, by `tools/release/check`.
    let by_hand = |file: &str, text: &str, marker: &str| {
        by_hand(file, marker) || (marker == "#[ignore" && !text.replace(LONG, "").contains(marker))
    };
    for (file, text) in crate_sources() {
        for marker in ["todo!(", "unimplemented!(", "dbg!(", "#[ignore"] {
            let code = code(&text);
            let left = code.contains(marker) && !by_hand(&file, &code, marker);
            assert!(!left, "{file} has a left-over `{marker}`");
        }
    }
}
