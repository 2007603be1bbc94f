//! `--detector FILE --labels FILE`: a custom detector is tried in its own process, and one that differs from its
//! pin starts no run.

use std::fs;
use std::path::{Path, PathBuf};

use live::Options;
use live::child::Services;
use live::detector::{Limits, try_detector};
use live::trial::run_live;
use parallel::progress::Stop;
use perception::brought::Brought;
use perception::process::{load, pin};
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use scenario::{Confinement, Hosts, Setup, parse_labels};

use super::{holdsafe, lock_machine, root, started};

const GRID: &str = "head = \"grid\"\n";
const COLOURS: &str = "head = \"yolo-v8\"\n[classes]\ncount = 3\nvehicle = [0]\nperson = [2]\n";
/// Damaged models that are tried; `HOLDSAFE_CASES` asks for another number.
const CASES: u64 = 24;

fn services() -> Services {
    Services::Own(env!("CARGO_BIN_EXE_holdsafe").into())
}

fn shipped() -> PathBuf {
    root().join("crates/perception/models/detector.onnx")
}

fn seed(name: &str) -> PathBuf {
    root().join("fuzz/corpus/model").join(name)
}

fn brought(file: &Path, labels: &str) -> Brought {
    Brought::new(pin(file).unwrap(), parse_labels("labels.toml", labels).unwrap().head)
}

/// Files of these texts in their own folder, with the yard beside them.
fn folder(files: &[(&str, &str)]) -> (tempfile::TempDir, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let paths = files.iter().map(|(name, text)| {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    });
    let paths = paths.collect();
    fs::create_dir(folder.path().join("scenes")).unwrap();
    fs::copy(root().join("scenarios/scenes/yard.toml"), folder.path().join("scenes/yard.toml")).unwrap();
    (folder, paths)
}

/// Two seconds of the null attack without any action.
fn short() -> String {
    let nominal = fs::read_to_string(root().join("scenarios/control/nominal.toml")).unwrap();
    let (head, _) = nominal.split_once("[[operator.step]]").unwrap();
    head.replace("duration_s = 9.0", "duration_s = 2.0").replace("name = \"nominal\"", "name = \"short\"")
}

/// The log is that of the built-in one without the network beside it, and the manifest names the file's.
#[test]
fn shipped_detector_from_file_gives_the_same_log() {
    let (folder, files) = folder(&[("short.toml", &short()), ("grid.toml", GRID)]);
    let out = folder.path().join("out");
    let run = |more: &[&str]| {
        let output = holdsafe(&[&["run", &files[0], "--trials", "1", "--json"], more].concat());
        let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let brought = more.contains(&"--detector");
        assert_eq!(object["detector"].is_string(), brought, "{object}");
        object["trials"][0]["log_hash"].as_str().unwrap().to_owned()
    };
    let detector = shipped();
    let bring = ["--detector", detector.to_str().unwrap(), "--labels", &files[1], "--out", out.to_str().unwrap()];
    let policy = root().join("policies/fusion-waived.toml");
    let policy_options = ["--policy", policy.to_str().unwrap()];
    assert_eq!(run(&[&bring[..], &policy_options].concat()), run(&[&["--rendered"][..], &policy_options].concat()));
    let manifest: serde_json::Value = serde_json::from_slice(&fs::read(out.join("manifest.json")).unwrap()).unwrap();
    assert_eq!(manifest["detector"]["model"]["sha256"], pin(&detector).unwrap().sha256, "{manifest}");
    let seen = |labels: &str| run(&["--detector", seed("yolo-v8").to_str().unwrap(), "--labels", labels]);
    let (_folder, other) = self::folder(&[("colours.toml", COLOURS)]);
    assert_ne!(seen(&other[0]), run(&["--rendered"]), "another detector sees otherwise");
}

/// The refusal has exit code 2, and comes before any trial.
#[test]
fn changed_or_unusable_detector_is_refused() {
    let pinned = |sha256: &str| format!("sha256 = \"{sha256}\"\n{COLOURS}");
    let other = "0".repeat(64);
    let (_folder, files) =
        folder(&[("colours.toml", COLOURS), ("pinned.toml", &pinned(&other)), ("bad.toml", "head = \"yolo-v9\"\n")]);
    let cases = [
        ("yolo-v8", &files[1], "model changed"),
        ("hostile-external-data", &files[0], "weights in another file"),
        ("hostile-endless-loop", &files[0], "the operator `Loop`"),
        ("other-shape", &files[0], "detector gives Tensor<f32>(1, 9, 9)"),
        ("hostile-output-of-nobody", &files[0], "the runtime failed on it: it panicked"),
        ("other-slow", &files[0], "us of CPU for a frame on this host"),
        ("yolo-v8", &files[2], "unknown variant"),
        ("no-such-file", &files[0], "No such file"),
    ];
    for (name, labels, said) in cases {
        let file = seed(name);
        for verb in [&["run", "nominal", "--trials", "1"][..], &["run", "--live", "--watch", "nominal"]] {
            let output = holdsafe(&[verb, &["--detector", file.to_str().unwrap(), "--labels", labels]].concat());
            let screen = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(2), "{name}: {screen}");
            assert!(screen.contains(said) && !screen.contains("panicked at"), "{name}: {screen}");
        }
    }
    let single_output = holdsafe(&["run", "nominal", "--detector", shipped().to_str().unwrap()]);
    assert_eq!(single_output.status.code(), Some(2), "a detector without labels");
}

/// With the reason.
/// A34: the launcher looked at the file, and then it was another one.
#[test]
fn swapped_model_ends_the_run_before_it_begins() {
    let (folder, files) = folder(&[("short.toml", &short())]);
    let file = folder.path().join("detector.onnx");
    fs::copy(shipped(), &file).unwrap();
    let mut detector = brought(&file, GRID);
    detector.loaded = Some(std::sync::Arc::new(load(&detector).unwrap()));
    fs::copy(seed("yolo-v8"), &file).unwrap();
    let scenario = scenario::load(Path::new(&files[0])).unwrap();
    let mut setup = Setup::load(&root(), &scenario, None, true).unwrap();
    setup.detector = Some(detector);
    let (stop, keep) = (Stop::default(), folder.path().join("run"));
    let options = Options {
        keep: Some(keep.clone()),
        services: services(),
        stop: &stop,
        show: &mut |_| {},
        window: false,
        role: wire::person::Role::default(),
        acts: Vec::new(),
        confinement: Confinement::Best,
        hosts: Hosts::Loopback,
        shared_kib: sandbox::host::SHARED_KIB,
    };
    let Err(error) = run_live(&scenario, &setup, 1, options) else { panic!("a run with a swapped model") };
    let reason = error.to_string();
    assert!(reason.starts_with("perception did not start: ") && reason.contains("model changed"), "{reason}");
    assert!(reason.contains(&pin(&file).unwrap().sha256), "what is there now: {reason}");
    // The recording holds no decision of a unit.
    let recorded = fs::read_dir(keep.join("recording")).unwrap().count();
    assert!(recorded <= 1, "{recorded} files of a run that did not begin");
}

/// A model that is fine on the images that it is tried on, and ends its process in a run: the run is INVALID by its name, and its evidence whole.
#[test]
fn failing_model_costs_only_its_own_run() {
    let (folder, files) = folder(&[("colours.toml", COLOURS)]);
    let (detector, out) = (seed("hostile-index-by-image"), folder.path().join("out"));
    let bring =
        ["--detector", detector.to_str().unwrap(), "--labels", &files[0], "--json", "--out", out.to_str().unwrap()];
    let named = |output: &std::process::Output, trials: usize| {
        let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let all = object["trials"].as_array().unwrap();
        assert_eq!((output.status.code(), all.len()), (Some(4), trials), "{object}");
        for trial in all {
            let findings = trial["findings"].to_string();
            assert!(trial["outcome"] == "INVALID" && findings.contains("the detector failed on "), "{trial}");
            assert!(findings.contains("the runtime failed on it"), "{trial}");
        }
    };
    named(&holdsafe(&[&["run", "nominal", "--trials", "2"], &bring[..]].concat()), 2);
    let verified = holdsafe(&["inspect", "verify", out.to_str().unwrap()]);
    assert!(String::from_utf8_lossy(&verified.stdout).contains("the evidence holds"), "{verified:?}");
    let _alone = lock_machine();
    let live = folder.path().join("live");
    let bring = [&bring[..6], &[live.to_str().unwrap()]].concat();
    named(&started(&[&["run", "nominal", "--live", "--retries", "5"], &bring[..]].concat()), 1);
    assert!(live.join("live/nominal/1/held.json").exists());
}

/// A model that runs for hours or takes terabytes ends the process that tries it, at that process's limits.
#[test]
fn greedy_model_ends_at_its_limits() {
    let tried = |name: &str, cpu_s: u64| {
        try_detector(&services(), &brought(&seed(name), COLOURS), Limits { cpu_s, ..Limits::USUAL })
    };
    tried("yolo-v8", 1).expect("an honest one stays within them");
    let reason = tried("hostile-endless-products", 1).unwrap_err().to_string();
    assert!(reason.contains("not loaded and tried within 1 s of CPU"), "{reason}");
    let reason = tried("hostile-grows", Limits::USUAL.cpu_s).unwrap_err().to_string();
    assert!(reason.contains("wanted more than 2048 MiB"), "{reason}");
}

/// Each damaged model is refused or loaded. A trial of a damaged file ends in bounded time, and harms at most the
/// process that runs it.
#[test]
fn damaged_models_never_bring_their_caller_down() {
    let cases = std::env::var("HOLDSAFE_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(CASES);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("damaged.onnx");
    let seeds = [(shipped(), GRID), (seed("yolo-v8"), COLOURS)].map(|(path, labels)| (fs::read(path).unwrap(), labels));
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut below = |n: usize| rng.next_u64() as usize % n;
    let (mut loaded, mut refused) = (0, std::collections::BTreeMap::<String, u64>::new());
    for case in 0..cases {
        let (whole, labels) = &seeds[below(seeds.len())];
        let mut bytes = whole.clone();
        for _ in 0..=below(3) {
            // The part with the structure: weights change only numbers.
            let near = if below(2) == 0 { below(bytes.len().min(3_000)) } else { bytes.len() - 1 - below(600) };
            bytes[near] = if below(2) == 0 { below(256) as u8 } else { bytes[near] ^ 1 << below(8) };
        }
        fs::write(&file, &bytes).unwrap();
        match try_detector(&services(), &brought(&file, labels), Limits::USUAL) {
            Ok(()) => loaded += 1,
            Err(error) => {
                let reason = error.to_string();
                assert!(!reason.starts_with("cannot"), "case {case}: {reason}");
                *refused.entry(reason.chars().take(40).collect()).or_default() += 1;
            }
        }
    }
    println!("{loaded} of {cases} loaded; refused: {refused:#?}");
    assert!(refused.values().sum::<u64>() > 0 && loaded > 0, "damage that hits nothing, or everything");
}
