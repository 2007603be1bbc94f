//! Reason for a change of mode, from the services' logs; and the same without any other log.

use evidence::Witnessed;
use explain::{Explanation, FaultSite, LinkStage, Log, explain, why_not};
use ground_truth::{Any, Note, Sensor};
use holdsafe_tests::{Ready, root, shipped};
use scenario::AttackSpace;
use search::{Action, AttackSequence};
use twin::trial::Run;
use wire::event::{Event, Interface};
use wire::id::{NodeId, PeerId, UnitId};
use wire::mode::Mode;

/// Scenarios, and where the first loss of each begins as far as services can tell.
const ORIGINS: [(&str, FaultSite); 16] = [
    ("thermal_loss", FaultSite::Sensor(Sensor::Thermal)),
    ("rgb_loss", FaultSite::Sensor(Sensor::Rgb)),
    ("track_starvation", FaultSite::Sensor(Sensor::Depth)),
    ("localisation_loss", FaultSite::Sensor(Sensor::Localisation)),
    ("localisation_jump", FaultSite::Sensor(Sensor::Localisation)),
    ("time_step", FaultSite::Sensor(Sensor::Localisation)),
    ("loss", FaultSite::Telemetry),
    ("cut_at_arming", FaultSite::Telemetry),
    ("command_cut", FaultSite::CommandPlane),
    ("hold_block", FaultSite::CommandPlane),
    ("masquerade_gateway", FaultSite::Gateway),
    ("process_ends", FaultSite::Gateway),
    ("masquerade_forged", FaultSite::Perception),
    ("slow_inference", FaultSite::Perception),
    ("disk_full", FaultSite::Recorder),
    ("heard_then_forward", FaultSite::Teammate(UnitId::C)),
];

/// Attack spaces, moves of theirs with when they begin and how long they last (ms), and where the first loss then begins.
type Moved = (&'static str, &'static [(&'static str, u32, u32)], FaultSite);

const MOVES: [Moved; 19] = [
    ("processes", &[("gateway-hangs", 4_600, 1_200)], FaultSite::Gateway),
    ("processes", &[("adversary-hangs", 4_600, 470)], FaultSite::Telemetry),
    ("processes", &[("adversary-hangs", 4_600, 1_200)], FaultSite::Telemetry),
    // Longer than a session waits: the unit is back in another one, in which numbers begin again.
    ("processes", &[("adversary-hangs", 4_100, 2_900)], FaultSite::Telemetry),
    ("path", &[("cut", 4_100, 2_900)], FaultSite::Telemetry),
    ("processes", &[("gateway-hangs", 4_100, 2_900)], FaultSite::Gateway),
    ("processes", &[("gateway-hangs", 5_500, 4_000)], FaultSite::Gateway),
    // One that comes back, and whose records are refused until the end of the run.
    ("processes", &[("gateway-hangs", 5_090, 3_770)], FaultSite::Gateway),
    ("processes", &[("autonomy-hangs", 4_500, 1_000)], FaultSite::Unit),
    // As long as a unit without navigation may be silent too.
    ("processes", &[("autonomy-hangs", 5_660, 410)], FaultSite::Unit),
    // Back again when its loss is found.
    ("sensors", &[("thermal-out", 3_560, 240)], FaultSite::Sensor(Sensor::Thermal)),
    ("processes", &[("sim-hangs", 4_500, 1_500)], FaultSite::World),
    ("processes", &[("perception-hangs", 4_500, 1_500)], FaultSite::Perception),
    ("path", &[("cut", 4_600, 1_200)], FaultSite::Telemetry),
    ("path", &[("cut-up", 4_600, 1_200)], FaultSite::Uplink),
    ("path", &[("cut-down", 4_600, 1_200)], FaultSite::Downlink),
    ("perception", &[("elsewhere", 4_570, 1_730)], FaultSite::Sensor(Sensor::Localisation)),
    ("perception", &[("echo-navigation", 4_160, 2_090)], FaultSite::Sensor(Sensor::Localisation)),
    ("perception", &[("synthetic", 4_660, 3_230), ("echo", 5_600, 3_010)], FaultSite::Perception),
];

fn space(name: &str) -> AttackSpace {
    AttackSpace::load(&root().join("scenarios/spaces").join(format!("{name}.toml"))).expect("a shipped attack space")
}

/// The first loss of `ready` with these moves in it.
fn first_loss(ready: Ready, name: &str, moves: &[(&str, u32, u32)]) -> Explanation {
    lost(ready, name, moves).1
}

/// The explanation with the run that it is of.
fn lost(mut ready: Ready, text: &str, moves: &[(&str, u32, u32)]) -> (Run, Explanation) {
    let space = space(text);
    let actions = moves.iter().map(|(name, begins, lasts)| {
        let kind = space.moves.iter().position(|m| m.name.as_str() == *name).expect("a move of it");
        // Every length of these attack spaces goes from 50 ms on in steps of 10; what else varies is at its first value.
        let lasts = (lasts - 50) / 10;
        let places = (0..space.moves[kind].ranges().count()).map(|i| if i == 0 { lasts } else { 0 }).collect();
        Action { begins: begins / space.tick_ms.unsigned() as u32, kind, places }
    });
    ready.scenario = AttackSequence::new(actions.collect()).in_scenario(&space, &ready.scenario).expect("it fits");
    let run = ready.run(1);
    let explanations = explain(&run.evidence.entries, &run.evidence.bounds);
    let loss = explanations.into_iter().find(Explanation::restricts).unwrap_or_else(|| panic!("{moves:?}: no loss"));
    (run, loss)
}

#[test]
fn what_looks_alike_is_told_apart() {
    for (space, moves, place) in MOVES {
        let loss = first_loss(shipped("nominal"), space, moves);
        assert_eq!((loss.origin.place, &loss.origin.or[..]), (place, &[][..]), "{moves:?}: {loss:#?}");
        let began = u64::from(moves.iter().map(|(_, begins, _)| *begins).max().unwrap_or_default()) * 1000;
        let since = loss.origin.since_us;
        assert!(since + DATED_BACK >= began && since <= loss.at_us, "{moves:?}: since {since}, begun at {began}");
    }
}

#[test]
fn frozen_camera_is_dated_from_its_last_frame() {
    let run = shipped("thermal_freeze").run(1);
    let explanations = explain(&run.evidence.entries, &run.evidence.bounds);
    let loss = explanations.iter().find(|e| e.restricts()).expect("a loss");
    assert_eq!(loss.origin.place, FaultSite::Sensor(Sensor::Thermal), "{loss:#?}");
    let zero = run.verdict.zero.expect("a receipt");
    assert!(loss.origin.since_us <= zero && zero < loss.at_us, "injected at {zero}: {loss:#?}");
}

/// It also differs from a gateway that died later.
#[test]
fn holding_link_differs_from_a_stalled_gateway() {
    let explained = |name: &str, moves: &[(&str, u32, &[u32])]| {
        let (mut ready, space) = (shipped("nominal"), space(name));
        let actions = moves.iter().map(|(name, begins, places)| {
            let kind = space.moves.iter().position(|m| m.name.as_str() == *name).expect("a move of it");
            Action { begins: begins / space.tick_ms.unsigned() as u32, kind, places: places.to_vec() }
        });
        ready.scenario = AttackSequence::new(actions.collect()).in_scenario(&space, &ready.scenario).expect("it fits");
        ready
    };
    let place = |ready: &Ready| {
        let run = ready.run(1);
        let explanations = explain(&run.evidence.entries, &run.evidence.bounds);
        let loss = explanations.into_iter().find(Explanation::restricts).expect("a loss");
        (loss.origin.place, loss.origin.or)
    };
    // For 3.97 s, by 2.08 s.
    assert_eq!(place(&explained("path", &[("hold", 3_750, &[392, 207])])), (FaultSite::Telemetry, vec![]));
    let mut cut = explained("path", &[("cut", 4_090, &[48])]);
    let dies = AttackSequence::new(vec![Action { begins: 563, kind: 3, places: vec![] }]);
    let processes = space("processes");
    assert_eq!(processes.moves[3].name.as_str(), "gateway-ends");
    cut.scenario = dies.in_scenario(&processes, &cut.scenario).expect("it fits");
    assert_eq!(place(&cut), (FaultSite::Telemetry, vec![]));
}

/// The hang is distinguished from a fault of the order path.
#[test]
fn late_hold_of_a_hung_console_is_recognised() {
    // The operator gives a HOLD at 7 s in that attack space.
    let mut ready = shipped("nominal");
    ready.scenario = AttackSequence::default().in_scenario(&space("stations"), &ready.scenario).expect("it fits");
    let loss = first_loss(ready, "processes", &[("console-hangs", 4_830, 3_000)]);
    assert_eq!((loss.origin.place, &loss.origin.or[..]), (FaultSite::Console, &[][..]), "{loss:#?}");
}

/// Explained from the link of one unit.
#[test]
fn stalled_gateway_is_told_by_other_units() {
    for lasts in [1_200, 2_400, 4_000] {
        for (moved, of, place) in
            [("gateway-hangs", "processes", FaultSite::Gateway), ("cut", "path", FaultSite::Telemetry)]
        {
            let mut ready = shipped("nominal");
            ready.scenario =
                AttackSequence::default().in_scenario(&space("teammates"), &ready.scenario).expect("it fits");
            let loss = first_loss(ready, of, &[(moved, 4_600, lasts)]);
            assert_eq!((loss.origin.place, &loss.origin.or[..]), (place, &[][..]), "{moved} for {lasts}: {loss:#?}");
        }
    }
}

/// The silence lasts to the end of the run, and the teammates are silent: the only fact left is that the unit heard no
/// more.
#[test]
fn ambiguous_link_and_gateway_are_both_named() {
    for (moved, of) in [("gateway-hangs", "processes"), ("cut", "path")] {
        let mut ready = shipped("nominal");
        ready.scenario = AttackSequence::default().in_scenario(&space("teammates"), &ready.scenario).expect("it fits");
        let (run, _) = lost(ready, of, &[(moved, 5_300, 4_000)]);
        let of_a_teammate = |event: &Any| {
            matches!(
                event,
                Any::Service(Event::Accepted { at: Interface::Uplink, peer, .. }) if *peer != PeerId::UNIT_A
            )
        };
        let entries: Vec<Witnessed> =
            run.evidence.entries.into_iter().filter(|w| !of_a_teammate(&w.entry.event)).collect();
        let explanations = explain(&entries, &run.evidence.bounds);
        let origin = &explanations.iter().find(|e| e.restricts()).expect("a loss").origin;
        assert_eq!(
            (origin.place, &origin.or[..]),
            (FaultSite::Telemetry, &[FaultSite::Gateway][..]),
            "{moved}: {origin:#?}"
        );
    }
}

#[test]
fn swallowed_order_traces_to_the_session_takeover() {
    let loss = first_loss(shipped("nominal"), "stations", &[("take-session", 4_500, 3_900)]);
    assert_eq!((loss.origin.place, &loss.origin.or[..]), (FaultSite::CommandPlane, &[][..]), "{loss:#?}");
    assert!(loss.origin.since_us.abs_diff(4_500_000) < DATED_BACK, "{loss:#?}");
    // A theft that ended before another party swallowed the order is not its origin.
    let mut ready = shipped("nominal");
    let stations = space("stations");
    let kind = stations.moves.iter().position(|m| m.name.as_str() == "take-session").expect("a move of it");
    let begins = 4_500 / stations.tick_ms.unsigned() as u32;
    // For 1.5 s: to 6.0 s. The operator gives a HOLD at 7 s.
    let theft = AttackSequence::new(vec![Action { begins, kind, places: vec![145] }]);
    ready.scenario = theft.in_scenario(&stations, &ready.scenario).expect("it fits");
    let loss = first_loss(ready, "broker", &[("drop-holds", 6_300, 2_500)]);
    assert_eq!((loss.origin.place, &loss.origin.or[..]), (FaultSite::CommandPlane, &[][..]), "{loss:#?}");
    assert!(loss.origin.since_us > 6_300_000, "{loss:#?}");
}

/// A missing product is dated by the last good one, at the most this much before, microseconds.
const DATED_BACK: u64 = 400_000;

#[test]
fn first_loss_traces_to_its_attack() {
    for (name, place) in ORIGINS {
        let run = shipped(name).run(1);
        let explanations = explain(&run.evidence.entries, &run.evidence.bounds);
        let loss = explanations.iter().find(|e| e.restricts()).unwrap_or_else(|| panic!("{name}: no loss"));
        assert_eq!(loss.origin.place, place, "{name}: {loss:#?}");
        assert!(loss.origin.since_us <= loss.at_us, "{name}: an origin after what it led to");
        let zero = run.verdict.zero.unwrap_or_else(|| panic!("{name}: no receipt"));
        assert!(loss.origin.since_us + DATED_BACK >= zero, "{name}: an origin before anything was done: {loss:#?}");
    }
}

#[test]
fn chain_leads_from_cause_to_display() {
    let run = shipped("thermal_loss").run(1);
    let explanations = explain(&run.evidence.entries, &run.evidence.bounds);
    let loss = explanations.iter().find(|e| e.restricts()).expect("a loss");
    let stages: Vec<LinkStage> = loss.chain.iter().map(|step| step.stage).collect();
    assert!(stages.is_sorted(), "{stages:?}");
    for stage in [
        LinkStage::Cause,
        LinkStage::Guard,
        LinkStage::Transition,
        LinkStage::Authority,
        LinkStage::Actuation,
        LinkStage::Display,
    ] {
        assert!(stages.contains(&stage), "{stage:?} is missing in {stages:?}");
    }
}

#[test]
fn explanation_needs_only_the_services_logs() {
    for (name, _) in ORIGINS {
        let run = shipped(name).run(2);
        let all = &run.evidence.entries;
        let outside = |w: &Witnessed| {
            let node = w.entry.node;
            let actor = node.is_insider() || node.is_mouth() || node == NodeId::CAMPAIGN;
            let relay = node == NodeId::RELAY_TELEMETRY || node == NodeId::RELAY_COMMAND;
            let injected = matches!(
                w.entry.event,
                Any::Instrument(Note::Fault { .. } | Note::Imposed { .. } | Note::Object { .. })
            );
            actor || relay || injected
        };
        let services: Vec<Witnessed> = all.iter().filter(|w| !outside(w)).copied().collect();
        assert!(services.len() < all.len(), "{name}: nothing was left out");
        assert_eq!(explain(&services, &run.evidence.bounds), explain(all, &run.evidence.bounds), "{name}");
    }
}

#[test]
fn obstacles_to_ready_are_named_until_ready() {
    let run = shipped("loss").run(1);
    let log = Log::from_entries(&run.evidence.entries, run.evidence.bounds);
    let held = why_not(&log, Mode::Ready, run.evidence.duration);
    assert_eq!(held.mode, Mode::HoldSafe);
    assert!(held.blocks.iter().any(|block| block.contains("no operator asked for resume")), "{held:?}");
    assert!(held.blocks.iter().any(|block| block.contains("nothing of the gateway")), "{held:?}");
    let before = why_not(&log, Mode::Ready, 2_000_000);
    assert_eq!((before.mode, before.blocks.len()), (Mode::Ready, 0), "{before:?}");
}
