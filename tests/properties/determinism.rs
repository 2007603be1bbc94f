//! Same seed, same log; another seed, another log.

use std::collections::BTreeSet;
use std::fs::File;

use evidence::Plan;
use evidence::log::hashes;
use holdsafe_tests::{Ready, root, shipped, variations};
use results::reproduction::{Again, Reference, References};
use scenario::Settings;
use topology::{RunSecret, lay_out};

#[test]
fn same_seed_same_log() {
    for name in ["nominal", "replay", "loss"] {
        let ready = shipped(name);
        let log_of = |seed| hashes(&ready.run(seed).evidence.entries);
        let (first, repeated, other) = (log_of(1), log_of(1), log_of(2));
        assert_eq!(first, repeated, "{name}");
        assert_ne!(first.0, other.0, "{name}: log");
        assert_ne!(first.1, other.1, "{name}: decisions");
    }
}

/// The names of all shipped scenarios with a platform.
fn names() -> Vec<String> {
    let files = scenario::shipped(&root()).expect("the scenarios are there").into_iter();
    let mut names: Vec<String> = files.filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned())).collect();
    names.retain(|name| !shipped(name).scenario.is_of_stacks());
    names
}

#[test]
#[ignore = "long: every scenario twice"]
fn no_scenario_hangs_on_anything_but_its_seed() {
    // A random number without a seed, or the iteration order of a hash table, would differ in the second run.
    let repeat_run = |name: &String| {
        let ready = shipped(name);
        let record = || {
            let run = ready.run(11);
            (hashes(&run.evidence.entries), run.evidence.planned, run.verdict)
        };
        Ok::<_, std::convert::Infallible>((record() != record()).then(|| name.clone()))
    };
    let differ = parallel::map(parallel::cores(), &names(), repeat_run).unwrap_or_default();
    assert_eq!(differ.into_iter().flatten().collect::<Vec<_>>(), [""; 0]);
}

/// Start of the planned attack, under this seed.
fn planned(ready: &Ready, seed: u64) -> Vec<Plan> {
    lay_out(&ready.scenario, &ready.setup, seed, &RunSecret::seeded(seed)).planned
}

#[test]
fn seed_moves_an_injection_over_its_phase() {
    const SEEDS: u64 = 40;
    let mut varied = 0;
    for name in names() {
        let ready = shipped(&name);
        let (from, to) = ready.scenario.varies.phase_s();
        let timed = |plan: &&Plan| plan.step.is_none() && plan.from > 0;
        let starts = |seed: u64| planned(&ready, seed).iter().find(timed).map(|plan| plan.from);
        let Some(first) = starts(1).filter(|_| to > from) else { continue };
        let starts: BTreeSet<u64> = (1..=SEEDS).filter_map(starts).collect();
        let (least, most) = (starts.first().copied().unwrap_or(first), starts.last().copied().unwrap_or(first));
        let range = ((to - from) * 1e6) as u64;
        assert!(starts.len() as u64 > SEEDS / 2, "{name}: {starts:?}");
        assert!(most - least <= range && most - least > range / 2, "{name}: {least} to {most} of {range}");
        varied += 1;
    }
    assert!(varied > 40, "{varied} scenarios");
}

#[test]
fn injection_starts_as_planned_under_every_seed() {
    for name in ["thermal_loss", "loss", "localisation_jump"] {
        let ready = shipped(name);
        let mut zeros = BTreeSet::new();
        for seed in 1..=6 {
            let from = planned(&ready, seed).iter().map(|plan| plan.from).min().expect("something is planned");
            let zero = ready.run(seed).verdict.zero.expect("it took hold");
            // The relay and the sim act at the next datagram, reading or frame.
            assert!((from..=from + 150_000).contains(&zero), "{name} seed {seed}: {zero}, planned at {from}");
            zeros.insert(zero);
        }
        assert_eq!(zeros.len(), 6, "{name}: {zeros:?}");
    }
}

#[test]
fn every_model_error_reaches_the_world() {
    let ready = shipped("nominal");
    let as_shipped = hashes(&ready.run(1).evidence.entries).0;
    for (path, factor) in [("models.noise", 2.0), ("models.load", 1.5), ("models.grip", 0.1)] {
        let scenario = Settings::one(path, factor.into()).applied_to(&ready.scenario).expect("a scenario");
        let topology = lay_out(&scenario, &ready.setup, 1, &RunSecret::seeded(1));
        let world = topology.world().expect("a world").fidelity;
        let settings = [("models.noise", world.noise), ("models.load", world.load), ("models.grip", world.grip)];
        let off: Vec<_> = settings.into_iter().filter(|(_, factor)| *factor != 1.0).collect();
        assert_eq!(off, [(path, factor as f32)]);
        let off = Ready { scenario, ..shipped("nominal") };
        assert_ne!(hashes(&off.run(1).evidence.entries).0, as_shipped, "{path}");
    }
}

/// One reference of this number is run again; `holdsafe evaluate --reproduce` runs them all.
const ONE_IN: usize = 4;

#[test]
fn runs_reproduce_their_committed_references() {
    let name = format!("references/{}-{}.jsonl", std::env::consts::ARCH, std::env::consts::OS);
    let Ok(file) = File::open(root().join(&name)) else {
        eprintln!("{name} is not committed: nothing is compared on this architecture");
        return;
    };
    let references = References::read(file).expect("references can be read");
    for then in references.runs.iter().step_by(ONE_IN) {
        let ready = variations(&then.scenario).into_iter().find(|ready| ready.cell == then.cell);
        let ready = ready.unwrap_or_else(|| panic!("{} {:?} is no more: {RENEW}", then.scenario, then.cell));
        let run = ready.run(references.seed);
        let now = Reference::from_run(&then.scenario, then.cell.as_deref(), &run.evidence, &run.verdict);
        let repeated = then.compare(&now, &run.evidence.entries);
        assert_eq!(repeated, Again::Same, "{} {:?}: {RENEW}", then.scenario, then.cell);
        assert_eq!(then.outcome, now.outcome, "{} {:?}: {RENEW}", then.scenario, then.cell);
    }
}

/// Remedy for an intended change.
const RENEW: &str = "if it is meant to be otherwise now, `holdsafe evaluate --reproduce --renew` writes references anew, and their change is reviewed";
