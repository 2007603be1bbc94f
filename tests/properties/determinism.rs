//! Same seed, same log; another seed, another log.

use std::fs::File;

use campaign::cast::{RunSecret, cast};
use campaign::evidence::hashes;
use campaign::reproduction::{Again, Reference, References};
use campaign::scenario::Settings;
use holdsafe_tests::{Ready, root, shipped, variations};

#[test]
fn the_same_seed_gives_the_same_log_and_another_seed_another() {
    for name in ["nominal", "replay", "loss"] {
        let ready = shipped(name);
        let of = |seed| hashes(&ready.run(seed).evidence.entries);
        let (first, again, other) = (of(1), of(1), of(2));
        assert_eq!(first, again, "{name}");
        assert_ne!(first.0, other.0, "{name}: log");
        assert_ne!(first.1, other.1, "{name}: decisions");
    }
}

#[test]
fn every_model_that_a_scenario_says_is_off_reaches_the_world_and_changes_what_happens() {
    let ready = shipped("nominal");
    let as_shipped = hashes(&ready.run(1).evidence.entries).0;
    for (path, factor) in [("models.noise", 2.0), ("models.load", 1.5), ("models.grip", 0.1)] {
        let scenario = Settings::one(path, factor.into()).applied_to(&ready.scenario).expect("a scenario");
        let cast = cast(&scenario, &ready.setup, 1, &RunSecret::seeded(1));
        let world = cast.world().expect("a world").fidelity;
        let told = [("models.noise", world.noise), ("models.load", world.load), ("models.grip", world.grip)];
        let off: Vec<_> = told.into_iter().filter(|(_, factor)| *factor != 1.0).collect();
        assert_eq!(off, [(path, factor as f32)]);
        let off = Ready { scenario, ..shipped("nominal") };
        assert_ne!(hashes(&off.run(1).evidence.entries).0, as_shipped, "{path}");
    }
}

/// One reference in so many is run again; `holdsafe reproduce` runs them all.
const ONE_IN: usize = 4;

#[test]
fn runs_come_to_what_they_came_to_when_their_references_were_committed() {
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
        let now = Reference::of(&then.scenario, then.cell.as_deref(), &run.evidence, &run.verdict);
        let again = then.again(&now, &run.evidence.entries);
        assert_eq!(again, Again::Same, "{} {:?}: {RENEW}", then.scenario, then.cell);
        assert_eq!(then.outcome, now.outcome, "{} {:?}: {RENEW}", then.scenario, then.cell);
    }
}

/// What to do when that is wanted.
const RENEW: &str = "if it is meant to be otherwise now, `holdsafe reproduce --renew` writes references anew, and their change is reviewed";
