//! An object in the scene is disguised as a vehicle, to one modality after another.

use evidence::trial::Outcome;
use evidence::{Plan, Planned, Witnessed};
use ground_truth::Any;
use holdsafe_tests::{shipped, variations};
use oracle::judge;
use scenario::Settings;
use twin::sabotage::sabotage;
use twin::trial::Run;
use wire::event::Event;
use wire::id::ObjectId;
use wire::policy::{Check, Requirement};
use wire::sensor::{Class, Modalities, Modality};

use crate::SEEDS;

/// Perception's doubts, by objecting modality.
fn doubts(run: &Run) -> Vec<Modalities> {
    let entries = run.evidence.entries.iter();
    entries
        .filter_map(|w| match w.entry.event {
            Any::Service(Event::Doubted { class: Class::Vehicle, vetoed, .. }) => Some(vetoed),
            _ => None,
        })
        .collect()
}

fn authority(run: &Run) -> bool {
    run.evidence.entries.iter().any(|w| matches!(w.entry.event, Any::Service(Event::Minted { .. })))
}

/// Every trial is refused, by a doubt of each of these modalities, and no unit gets authority.
fn refused_by(name: &str, modalities: &[Modality]) {
    for run in shipped(name).expect(SEEDS) {
        let doubts = doubts(&run);
        for modality in modalities {
            assert!(doubts.iter().any(|vetoed| vetoed.contains(*modality)), "{name}: {modality:?} not in {doubts:?}");
        }
        assert!(!authority(&run), "{name}: {:?}", run.verdict.transitions);
    }
}

/// The run with some checks of perception waived.
fn run_waiving(name: &str, checks: &[Check]) -> Run {
    let mut ready = shipped(name);
    ready.setup.policy.boundary.extend(checks.iter().map(|check| (*check, Requirement::Waived)));
    ready.run(1)
}

#[test]
fn painted_vehicle_is_refused_by_size() {
    refused_by("billboard", &[Modality::Depth]);
}

#[test]
fn a_heated_wall_is_refused_by_its_size() {
    refused_by("billboard_warm", &[Modality::Depth]);
}

#[test]
fn cold_inflatable_is_refused_by_thermal_camera() {
    refused_by("decoy_cold", &[Modality::Thermal]);
    for run in shipped("decoy_cold").expect(SEEDS) {
        let thermal = Modalities::default().with_modality(Modality::Thermal);
        assert!(doubts(&run).iter().all(|vetoed| *vetoed == thermal), "{:?}", doubts(&run));
    }
}

/// The decoy deceives every modality, and the operator consents.
#[test]
fn full_decoy_is_acted_on_with_consent() {
    for run in shipped("decoy_warm").expect(SEEDS) {
        assert!(doubts(&run).is_empty() && authority(&run), "{:?}", run.verdict.transitions);
    }
}

/// The decoy stands cold in view for longer than a second; no vehicle warms so fast.
#[test]
fn heater_switched_on_in_view_earns_nothing() {
    for run in shipped("decoy_heating").expect(SEEDS) {
        let warm_and_doubted = |w: &Witnessed| match w.entry.event {
            Any::Service(Event::Doubted { class: Class::Vehicle, supported, vetoed, .. }) => {
                supported.contains(Modality::Thermal) && vetoed.contains(Modality::Thermal)
            }
            _ => false,
        };
        assert!(run.evidence.entries.iter().any(warm_and_doubted), "the heater came on");
        assert!(!authority(&run), "{:?}", run.verdict.transitions);
    }
    let mut ready = shipped("decoy_heating");
    ready.setup.policy.boundary.insert(Check::Steady, Requirement::Waived);
    for seed in SEEDS {
        let run = ready.run(seed);
        assert_eq!(run.verdict.outcome, Outcome::Unsafe, "{:?}", run.verdict.transitions);
    }
}

/// A mission of the same kind; the unit drives to where it has seen the vehicle from far enough around, unless that is further
/// than it gets.
#[test]
fn authority_waits_for_bearings_far_enough_apart() {
    let mut look = shipped("look");
    for run in look.expect(SEEDS) {
        assert!(authority(&run), "{:?}", run.verdict.transitions);
    }
    let wider = Settings::one("bounds.designation_bearings_mrad", 1500.into());
    look.scenario = wider.applied_to(&look.scenario).unwrap();
    look.setup.bounds.designation_bearings_mrad = 1500;
    let run = look.run(1);
    assert!(!authority(&run), "{:?}", run.verdict.transitions);
}

#[test]
fn decoy_earns_nothing_while_its_vetoer_is_gone() {
    for run in shipped("decoy_thermal_lost").expect(SEEDS) {
        assert!(!authority(&run), "{:?}", run.verdict.transitions);
    }
}

#[test]
fn each_decoy_works_without_its_check() {
    let walls = [Check::Extent, Check::Cluster, Check::Warmth];
    for (name, checks) in
        [("decoy_cold", &[Check::Warmth][..]), ("billboard_warm", &walls[..2]), ("billboard", &walls[..])]
    {
        let run = run_waiving(name, checks);
        assert_eq!(run.verdict.outcome, Outcome::Unsafe, "{name}: {:?}", run.verdict.transitions);
    }
}

#[test]
#[ignore = "long: rendered trials by the dozen"]
fn print_deceives_neither_thermal_nor_the_fused_network() {
    let [run] = &shipped("decoy_printed").expect(1..2)[..] else { panic!("one run") };
    let both = Modalities::default().with_modality(Modality::Thermal).with_modality(Modality::Rgb);
    assert!(doubts(run).contains(&both) && !authority(run), "{:?}", doubts(run));
    for check in [Check::Warmth, Check::Fusion] {
        let other = run_waiving("decoy_printed", &[check]);
        assert_eq!(other.verdict.outcome, Outcome::Rejected, "{check:?}: {:?}", other.verdict.transitions);
    }
    let neither = run_waiving("decoy_printed", &[Check::Warmth, Check::Fusion]);
    assert_eq!(neither.verdict.outcome, Outcome::Unsafe, "{:?}", neither.verdict.transitions);
}

/// The print has its full strength. With less of it the fused network does not share the detector's claim, and alone
/// contradicts it.
#[test]
fn printed_heated_inflatable_is_acted_on() {
    let mut heated = shipped("decoy_printed_heated");
    assert_eq!(heated.run(1).verdict.outcome, Outcome::Unsafe);
    let weak = Settings::one("scene.object.0.print.strength", 4.into());
    heated.scenario = weak.applied_to(&heated.scenario).unwrap();
    let run = heated.run(1);
    assert_eq!(run.verdict.outcome, Outcome::Rejected, "{:?}", run.verdict.transitions);
    assert!(
        doubts(&run).contains(&Modalities::default().with_modality(Modality::Rgb)) && !authority(&run),
        "{:?}",
        doubts(&run)
    );
}

/// Made against detector, thermal stage and corroboration at once (`trainer joint`). The remaining bounds of temperature hold:
/// a vehicle's warmest part is at least 300 K, 12 above this ground.
#[test]
fn warm_colour_print_is_acted_on() {
    let mut joint = shipped("decoy_joint");
    let run = joint.run(1);
    assert_eq!(run.verdict.outcome, Outcome::Unsafe, "{:?}", run.verdict.transitions);
    let cooler = Settings::one("scene.object.0.print.heat.strength_k", 10.into());
    joint.scenario = cooler.applied_to(&joint.scenario).unwrap();
    let run = joint.run(1);
    assert_eq!(run.verdict.outcome, Outcome::Rejected, "{:?}", run.verdict.transitions);
    assert!(
        doubts(&run).iter().any(|vetoed| vetoed.contains(Modality::Thermal)) && !authority(&run),
        "{:?}",
        doubts(&run)
    );
}

/// Made with the detector's weights and judged in other places (`trainer perturbations`). An object as cold as the ground is refused; a
/// heated decoy is not taken for a vehicle until the pattern is added.
#[test]
#[ignore = "long: rendered trials by the dozen"]
fn pattern_deceives_neither_thermal_nor_the_fused_network() {
    let mut cells = variations("perturbation").into_iter();
    let (mut cold, mut heated) = (cells.next().unwrap(), cells.next().unwrap());
    let [run] = &cold.expect(1..2)[..] else { panic!("one run") };
    let both = Modalities::default().with_modality(Modality::Thermal).with_modality(Modality::Rgb);
    assert!(doubts(run).contains(&both) && !authority(run), "{:?}", doubts(run));
    let waived = [Check::Warmth, Check::Fusion].map(|check| (check, Requirement::Waived));
    cold.setup.policy.boundary.extend(waived);
    assert_eq!(cold.run(1).verdict.outcome, Outcome::Unsafe);
    assert_eq!(heated.run(1).verdict.outcome, Outcome::Unsafe);
    heated.scenario = Settings::one("fault.0.magnitude.0", 0.0.into()).applied_to(&heated.scenario).unwrap();
    let plain = heated.run(1);
    assert!(plain.verdict.receipt && !authority(&plain), "{:?}", plain.verdict.transitions);
}

/// A claim about images that perception was never given is no receipt, whatever it looked at.
#[test]
#[ignore = "long: renders every claimed pattern"]
fn claimed_perturbation_or_print_has_no_receipt() {
    for name in ["perturbation", "decoy_printed", "decoy_printed_heated", "decoy_joint"] {
        let ready = shipped(name);
        let done = sabotage(&ready.scenario, &ready.setup, 1).unwrap();
        assert!(done.claims > 0, "{name}");
        assert_eq!((done.verdict.receipt, done.verdict.outcome), (false, Outcome::Invalid), "{name}");
    }
}

/// The sim logs no print, so none arrived, whatever perception looked at.
#[test]
fn print_unknown_to_sim_has_no_receipt() {
    let mut quiet = shipped("nominal").run(1);
    quiet.evidence.planned = vec![Plan::from(Planned::Print(ObjectId(0), Class::Decoy))];
    let verdict = judge(&quiet.evidence);
    assert_eq!((verdict.receipt, verdict.outcome), (false, Outcome::Invalid));
}

/// A disguise of an object that was not taken for a vehicle, put into the plan of a run without one.
#[test]
fn ineffective_disguise_has_no_receipt() {
    let mut quiet = shipped("nominal").run(1);
    let disguised = |object| vec![Plan::from(Planned::Disguise(ObjectId(object), Class::Vehicle))];
    for object in [1, 2, 3] {
        quiet.evidence.planned = disguised(object);
        let verdict = judge(&quiet.evidence);
        assert_eq!((verdict.receipt, verdict.outcome), (false, Outcome::Invalid), "object {object}");
    }
    // The vehicle itself is taken for one: that the receipt is of the object meant is what the others show.
    quiet.evidence.planned = disguised(0);
    assert!(judge(&quiet.evidence).receipt);
}
