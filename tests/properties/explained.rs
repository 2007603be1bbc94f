//! Why a mode changed, told from what the services logged; and told the same without anybody else's word.

use campaign::explain::{Log, Place, Stage, explain, why_not};
use campaign::oracle::Witnessed;
use holdsafe_tests::shipped;
use wire::event::{Event, Sensor};
use wire::id::{NodeId, UnitId};
use wire::mode::Mode;

/// Scenarios, and where the first loss of each begins as far as services can tell.
const ORIGINS: [(&str, Place); 16] = [
    ("thermal_loss", Place::Sensor(Sensor::Thermal)),
    ("rgb_loss", Place::Sensor(Sensor::Rgb)),
    ("track_starvation", Place::Sensor(Sensor::Depth)),
    ("localisation_loss", Place::Sensor(Sensor::Localisation)),
    ("localisation_jump", Place::Sensor(Sensor::Localisation)),
    ("time_step", Place::Sensor(Sensor::Localisation)),
    ("loss", Place::Telemetry),
    ("cut_at_arming", Place::Telemetry),
    ("command_cut", Place::CommandPlane),
    ("hold_block", Place::CommandPlane),
    ("masquerade_gateway", Place::Gateway),
    ("process_ends", Place::Gateway),
    ("masquerade_forged", Place::Perception),
    ("slow_inference", Place::Perception),
    ("disk_full", Place::Recorder),
    ("heard_then_forward", Place::Teammate(UnitId::C)),
];

#[test]
fn the_first_loss_of_each_kind_of_attack_goes_back_to_where_it_was_done() {
    for (name, place) in ORIGINS {
        let run = shipped(name).run(1);
        let told = explain(&run.evidence.entries, &run.evidence.bounds);
        let loss = told.iter().find(|e| e.restricts()).unwrap_or_else(|| panic!("{name}: no loss"));
        assert_eq!(loss.origin.place, place, "{name}: {loss:#?}");
        assert!(loss.origin.since_us <= loss.at_us, "{name}: an origin after what it led to");
    }
}

#[test]
fn a_chain_leads_from_its_cause_to_the_display_in_order() {
    let run = shipped("thermal_loss").run(1);
    let told = explain(&run.evidence.entries, &run.evidence.bounds);
    let loss = told.iter().find(|e| e.restricts()).expect("a loss");
    let stages: Vec<Stage> = loss.chain.iter().map(|step| step.stage).collect();
    assert!(stages.is_sorted(), "{stages:?}");
    for stage in [Stage::Cause, Stage::Guard, Stage::Transition, Stage::Authority, Stage::Actuation, Stage::Display] {
        assert!(stages.contains(&stage), "{stage:?} is missing in {stages:?}");
    }
}

#[test]
fn an_explanation_needs_no_word_of_an_adversary_a_guard_or_the_launcher() {
    for (name, _) in ORIGINS {
        let run = shipped(name).run(2);
        let all = &run.evidence.entries;
        let outside = |w: &Witnessed| {
            let node = w.entry.node;
            let actor = node.is_insider() || node.is_mouth() || node == NodeId::CAMPAIGN;
            let relay = node == NodeId::RELAY_TELEMETRY || node == NodeId::RELAY_COMMAND;
            let injected = matches!(w.entry.event, Event::Fault { .. } | Event::Imposed { .. } | Event::Object { .. });
            actor || relay || injected
        };
        let services: Vec<Witnessed> = all.iter().filter(|w| !outside(w)).copied().collect();
        assert!(services.len() < all.len(), "{name}: nothing was left out");
        assert_eq!(explain(&services, &run.evidence.bounds), explain(all, &run.evidence.bounds), "{name}");
    }
}

#[test]
fn what_keeps_a_held_unit_from_ready_is_said_until_it_is_ready() {
    let run = shipped("loss").run(1);
    let log = Log::of(&run.evidence.entries, run.evidence.bounds);
    let held = why_not(&log, Mode::Ready, run.evidence.duration);
    assert_eq!(held.mode, Mode::HoldSafe);
    assert!(held.blocks.iter().any(|block| block.contains("no operator asked for resume")), "{held:?}");
    assert!(held.blocks.iter().any(|block| block.contains("nothing of the gateway")), "{held:?}");
    let before = why_not(&log, Mode::Ready, 2_000_000);
    assert_eq!((before.mode, before.blocks.len()), (Mode::Ready, 0), "{before:?}");
}
