//! Every parser of bytes from outside keeps its promise (`holdsafe_tests::parsers`) on the seeds of `fuzz/corpus/` and on
//! damaged ones; that of the measurements is left to `measurements/mavlink_relay/tests/framing.rs`. The damage is drawn by a fixed seed, unguided; coverage-guided inputs are in `fuzz/`.

use std::collections::BTreeSet;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use holdsafe_tests::parsers::{TARGETS, Target};
use holdsafe_tests::root;
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};

/// Damaged inputs of each target; `HOLDSAFE_CASES` asks for another number.
const CASES: usize = 400;
/// Longest damaged input, and how much of one a failure prints, bytes.
const MAX_INPUT: usize = 64 * 1024;
/// Most seeds of one target, and most bytes of all seeds: they are read at every test run and kept by hand.
const MAX_SEEDS: usize = 40;
const MAX_CORPUS: u64 = 1 << 20;

/// Target of a parser in the measurements. Its tests are there; its binary and its seeds are beside the others.
const MEASURED: &str = "mavlink";

/// A seed: its name and its bytes.
type Seed = (String, Vec<u8>);

fn folder(target: &str) -> PathBuf {
    root().join("fuzz/corpus").join(target)
}

/// Every target with a binary and seeds.
fn target_names() -> impl Iterator<Item = &'static str> {
    TARGETS.iter().map(|target| target.name).chain([MEASURED])
}

fn names(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
}

fn seeds(target: &str) -> Vec<Seed> {
    let folder = folder(target);
    let seeds = names(&folder).into_iter().map(|name| (name.clone(), fs::read(folder.join(&name)).expect("a seed")));
    let seeds: Vec<Seed> = seeds.collect();
    assert!((1..=MAX_SEEDS).contains(&seeds.len()), "{}: {} seeds", folder.display(), seeds.len());
    seeds
}

/// The broken promise of the target on this input, with the input.
fn broken(target: &Target, name: &str, bytes: &[u8]) -> Option<String> {
    let panic = catch_unwind(AssertUnwindSafe(|| (target.holds)(bytes))).err()?;
    let words = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
    let input: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    Some(format!("{} on {name}: {}\n  input {input}", target.name, words.unwrap_or("a panic")))
}

/// No more than one failure of each target, but of every target.
fn assert_all_hold(failures: impl Iterator<Item = Option<String>>) {
    let failures: Vec<String> = failures.flatten().collect();
    assert!(failures.is_empty(), "{} targets broke their promise:\n{}", failures.len(), failures.join("\n"));
}

#[test]
fn every_parser_keeps_its_promise_on_every_seed() {
    assert_all_hold(TARGETS.iter().map(|target| {
        seeds(target.name)
            .iter()
            .find_map(|(name, bytes)| broken(target, name, bytes))
            .or_else(|| broken(target, "nothing", &[]))
    }));
}

#[test]
fn every_parser_keeps_its_promise_on_damaged_seeds() {
    let cases = std::env::var("HOLDSAFE_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(CASES);
    assert_all_hold(TARGETS.iter().map(|target| {
        let (seeds, mut rng) = (seeds(target.name), ChaCha8Rng::seed_from_u64(1));
        (0..cases).find_map(|case| {
            let (name, bytes) = damaged(&mut rng, &seeds);
            broken(target, &format!("case {case}, {name} damaged"), &bytes)
        })
    }));
}

#[test]
fn targets_have_binaries_and_seeds_have_targets() {
    let known: BTreeSet<String> = target_names().map(str::to_owned).collect();
    assert_eq!(names(&root().join("fuzz/corpus")), known);
    let files: BTreeSet<String> = known.iter().map(|name| format!("{name}.rs")).collect();
    assert_eq!(names(&root().join("fuzz/fuzz_targets")), files);
    let manifest = fs::read_to_string(root().join("fuzz/Cargo.toml")).expect("fuzz/Cargo.toml");
    let document = fs::read_to_string(root().join("docs/developer/fuzzing.md")).expect("docs/developer/fuzzing.md");
    for name in &known {
        assert!(manifest.contains(&format!("path = \"fuzz_targets/{name}.rs\"")), "{name} is no binary");
        let binary = fs::read_to_string(root().join(format!("fuzz/fuzz_targets/{name}.rs"))).expect("a target");
        assert!(binary.contains(&format!("::{name}(bytes)")), "{name}.rs calls another target");
        assert!(document.contains(&format!("| `{name}` |")), "docs/developer/fuzzing.md does not tell of `{name}`");
    }
}

/// If all or no seeds are accepted, a format has changed or the promise is never tested.
#[test]
fn seeds_include_accepted_and_refused_inputs() {
    for target in &TARGETS {
        let (accepted, refused): (Vec<bool>, _) =
            seeds(target.name).iter().map(|(_, b)| (target.holds)(b)).partition(|t| *t);
        assert!(!accepted.is_empty(), "{}: no seed is taken any more", target.name);
        assert!(!refused.is_empty() || target.name == "relay", "{}: none is refused", target.name);
    }
}

#[test]
fn the_seeds_are_small() {
    let all: usize = target_names().flat_map(seeds).map(|(_, bytes)| bytes.len()).sum();
    assert!(all as u64 <= MAX_CORPUS, "{all} bytes of seeds");
}

/// A seed with one to four places damaged.
fn damaged(rng: &mut ChaCha8Rng, seeds: &[Seed]) -> (String, Vec<u8>) {
    let (name, bytes) = &seeds[uniform_below(rng, seeds.len())];
    let mut bytes = bytes.clone();
    for _ in 0..=uniform_below(rng, 4) {
        let other = &seeds[uniform_below(rng, seeds.len())].1;
        damage(rng, &mut bytes, other);
    }
    bytes.truncate(MAX_INPUT);
    (name.clone(), bytes)
}

fn damage(rng: &mut ChaCha8Rng, bytes: &mut Vec<u8>, other: &[u8]) {
    /// Lengths and numbers at the ends of their ranges.
    const EDGES: [&[u8]; 8] =
        [&[0], &[0xff], &[0x7f], &[0x80], &[0xff; 2], &[0xff; 4], &[0xff; 8], &[0x7f, 0xff, 0xff, 0xff]];
    let index = uniform_below(rng, bytes.len() + 1);
    let end = index + uniform_below(rng, bytes.len() - index + 1).min(32);
    let from = uniform_below(rng, other.len() + 1);
    match uniform_below(rng, 7) {
        0 => bytes.truncate(index),
        1 => drop(bytes.drain(index..end)),
        2 => drop(bytes.splice(index..index, other[from..].iter().take(64).copied())),
        3 => drop(bytes.splice(index.., other[from..].iter().copied())),
        4 => {
            let edge = EDGES[uniform_below(rng, EDGES.len())];
            bytes.splice(index..(index + edge.len()).min(bytes.len()), edge.iter().copied());
        }
        5 => {
            let repeated = bytes[index..end].to_vec();
            bytes.splice(index..index, repeated);
        }
        _ => {
            if let Some(byte) = bytes.get_mut(index) {
                *byte ^= 1 << uniform_below(rng, 8);
            }
        }
    }
}

/// A number below `n`.
fn uniform_below(rng: &mut ChaCha8Rng, n: usize) -> usize {
    (rng.next_u64() % n as u64) as usize
}
