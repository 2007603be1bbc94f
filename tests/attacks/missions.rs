//! Trials that are evidence only where their mission took place: the operator's steps before the attack, done; and the
//! obstacles to seeing it.

use evidence::trial::Outcome;
use ground_truth::Any;
use holdsafe_tests::{Ready, root, shipped};
use oracle::Property;
use scenario::{Name, Settings, Setup, parse, template};
use serde_json::json;
use twin::trial::Run;
use wire::event::Event;

use crate::SEEDS;

fn has_authority(run: &Run) -> bool {
    run.evidence.entries.iter().any(|w| matches!(w.entry.event, Any::Service(Event::Minted { .. })))
}

/// The shipped scenario with this put into it.
fn with_value(name: &str, path: &str, value: serde_json::Value) -> Ready {
    let mut ready = shipped(name);
    ready.scenario = Settings::one(path, value).applied_to(&ready.scenario).expect("it fits");
    ready
}

/// A scenario whose operator finds no track to arm on: the car has left.
fn without_the_car(name: &str) -> Ready {
    with_value(name, "scene.object", json!([]))
}

#[test]
#[ignore = "long: rendered missions"]
fn new_scenario_arms_in_twin_and_rendered() {
    let text = template(&Name::new("x").expect("a name"));
    let scenario = parse("x.toml", "x", &text).expect("the template is a scenario");
    for (rendered, seeds) in [(false, 1..4), (true, 1..3)] {
        let setup = Setup::load(&root(), &scenario, None, rendered).expect("its policy and platform load");
        let ready = Ready { cell: None, scenario: scenario.clone(), setup };
        for run in ready.expect(seeds) {
            assert!(has_authority(&run), "rendered {rendered}: {:?}", run.verdict.transitions);
        }
    }
}

#[test]
fn quiet_run_without_arming_is_inconclusive() {
    let run = without_the_car("nominal").run(1);
    assert_eq!(run.verdict.outcome, Outcome::Invalid, "{:?}", run.verdict.transitions);
    let text = "arm, due at 2500 ms: never, no vehicle shown";
    assert!(run.verdict.mission.missing[0].ends_with(text), "{:?}", run.verdict.mission);
}

#[test]
fn loss_without_authority_is_inconclusive() {
    for name in ["thermal_loss", "loss"] {
        let run = without_the_car(name).run(1);
        assert!(run.verdict.receipt, "{name}");
        assert_eq!(run.verdict.outcome, Outcome::Invalid, "{name}: {:?}", run.verdict.transitions);
    }
}

/// A cold wall that covers the parked car in part, while the unit drives up to it: length along its heading, width, height.
fn walled(place: [f64; 2], size: [f64; 3]) -> Ready {
    let wall =
        json!({ "name": "wall", "class": "obstacle", "path_m": [place], "size_m": size, "temperature_k": 288.0 });
    with_value("nominal", "scene.object.4", wall)
}

#[test]
fn cold_partial_cover_is_not_taken_for_vehicle() {
    let walls = [
        ([-5.0, -4.2], [3.0, 0.5, 1.0]),
        ([-2.0, -4.2], [3.0, 0.5, 1.0]),
        ([1.0, -3.5], [0.5, 1.5, 1.0]),
        ([3.0, -3.2], [0.5, 0.5, 1.5]),
        ([4.0, -4.0], [1.0, 1.0, 0.8]),
    ];
    for (at, size) in walls {
        for seed in SEEDS {
            let run = walled(at, size).run(seed);
            let wrong: Vec<_> = run.verdict.findings.iter().filter(|f| f.property == Property::P11).collect();
            assert!(wrong.is_empty(), "{at:?} {size:?} seed {seed}: {wrong:?}");
        }
    }
}
