//! Attacks on a host's shared memory: impostors of dead services, rogues beside living ones, perception's own keys misused.

use evidence::Witnessed;
use evidence::trial::Outcome;
use ground_truth::{Action, Any, Note};
use holdsafe_tests::{Ready, root, shipped};
use scenario::Setup;
use topology::{RunSecret, lay_out};
use twin::trial::Run;
use wire::core::Topic;
use wire::event::{Event, Interface};
use wire::id::NodeId;
use wire::mode::Guard;
use wire::policy::{Check, Requirement};
use wire::refusal::Reason;

use crate::SEEDS;

/// Refusals by `node` at `interface`, by reason.
fn refused(run: &Run, node: NodeId, interface: Interface) -> Vec<Reason> {
    let on = |w: &Witnessed| match w.entry.event {
        Any::Service(Event::Refused { at, reason, .. }) if at == interface && w.entry.node == node => Some(reason),
        _ => None,
    };
    run.evidence.entries.iter().filter_map(on).collect()
}

/// Number of actions `wanted` that the rogue claims.
fn did(run: &Run, wanted: Action) -> usize {
    let one =
        |w: &&Witnessed| matches!(w.entry.event, Any::Instrument(Note::Attack { action, .. }) if action == wanted);
    run.evidence.entries.iter().filter(one).count()
}

fn waiving(name: &str, checks: &[Check], guards: &[Guard]) -> Ready {
    let mut ready = shipped(name);
    ready.setup.policy.boundary.extend(checks.iter().map(|c| (*c, Requirement::Waived)));
    ready.setup.policy.guards.extend(guards.iter().map(|g| (*g, Requirement::Waived)));
    ready
}

#[test]
fn forged_tracks_for_dead_perception_are_refused() {
    for run in shipped("masquerade_forged").expect(SEEDS) {
        let refused = refused(&run, NodeId::UNIT_A, Interface::Bus(Topic::Tracks));
        assert_eq!(refused.iter().filter(|r| **r == Reason::Tag).count(), did(&run, Action::Forge));
    }
    let run = waiving("masquerade_forged", &[Check::Tag], &[]).run(1);
    assert_eq!(
        run.verdict.outcome,
        Outcome::Late,
        "without the tag the dead look alive: {:?}",
        run.verdict.transitions
    );
}

#[test]
fn replayed_tracks_of_dead_perception_are_refused() {
    for run in shipped("masquerade_replay").expect(SEEDS) {
        let refused = refused(&run, NodeId::UNIT_A, Interface::Bus(Topic::Tracks));
        assert!(did(&run, Action::Republish) > 0 && refused.iter().all(|r| *r == Reason::Stale), "{refused:?}");
        assert_eq!(refused.len(), did(&run, Action::Republish));
    }
    let run = waiving("masquerade_replay", &[Check::Freshness], &[]).run(1);
    assert!(refused(&run, NodeId::UNIT_A, Interface::Bus(Topic::Tracks)).iter().all(|r| *r == Reason::Replayed));
    assert_eq!(run.verdict.outcome, Outcome::HoldSafe);
    let run = waiving("masquerade_replay", &[Check::Freshness, Check::Sequence], &[]).run(1);
    assert!(refused(&run, NodeId::UNIT_A, Interface::Bus(Topic::Tracks)).is_empty());
    assert_eq!(run.verdict.outcome, Outcome::HoldSafe, "the frames in them are still old");
}

/// The heartbeat is sent under perception's own key.
#[test]
fn heartbeat_without_work_keeps_no_liveness() {
    for run in shipped("masquerade_beat").expect(SEEDS) {
        assert!(
            did(&run, Action::Forge) > 0 && refused(&run, NodeId::UNIT_A, Interface::Bus(Topic::Tracks)).is_empty()
        );
    }
    let stages = [Guard::Tracks, Guard::Rgb, Guard::Depth, Guard::Thermal, Guard::Lidar];
    let run = waiving("masquerade_beat", &[], &stages).run(1);
    assert_eq!(
        run.verdict.outcome,
        Outcome::Late,
        "the stamps of the products are what tells: {:?}",
        run.verdict.transitions
    );
}

#[test]
fn replayed_grants_of_dead_gateway_renew_nothing() {
    shipped("masquerade_gateway").expect(SEEDS);
}

#[test]
fn forged_seals_for_dead_recorder_seal_nothing() {
    for run in shipped("masquerade_recorder").expect(SEEDS) {
        let refused = refused(&run, NodeId::UNIT_A, Interface::Bus(Topic::Seals));
        assert!(!refused.is_empty() && refused.iter().all(|r| *r == Reason::Tag));
    }
}

#[test]
fn keyless_rogue_is_refused_on_every_channel() {
    for run in shipped("rogue_ipc").expect(SEEDS) {
        let readers = [
            (NodeId::PERCEPTION, Topic::Candidates),
            (NodeId::PERCEPTION, Topic::Navigation),
            (NodeId::UNIT_A, Topic::Navigation),
            (NodeId::UNIT_A, Topic::Tracks),
            (NodeId::UNIT_A, Topic::Seals),
            (NodeId::SIM, Topic::Drive),
            (NodeId::SIM, Topic::Act),
        ];
        for (node, topic) in readers {
            assert!(refused(&run, node, Interface::Bus(topic)).contains(&Reason::Tag), "{node} {topic:?}");
        }
    }
    for run in shipped("rogue_ipc_control").expect(SEEDS) {
        assert!(refused(&run, NodeId::CONSOLE, Interface::Bus(Topic::Feed)).contains(&Reason::Tag));
        assert!(refused(&run, NodeId::GATEWAY, Interface::Bus(Topic::Intents)).contains(&Reason::Tag));
    }
    let run = waiving("rogue_ipc", &[Check::Tag], &[]).run(1);
    assert_ne!(run.verdict.outcome, Outcome::Rejected, "{:?}", run.verdict.transitions);
}

#[test]
fn genuine_tracks_pass_a_flood_of_forgeries() {
    for run in shipped("rogue_flood").expect(SEEDS) {
        assert!(did(&run, Action::Forge) > 2_900);
    }
}

#[test]
fn perception_cannot_write_navigation_to_autonomy() {
    for run in shipped("rogue_reader").expect(SEEDS) {
        let refused = refused(&run, NodeId::UNIT_A, Interface::Bus(Topic::Navigation));
        assert_eq!(refused.iter().filter(|r| **r == Reason::Tag).count(), did(&run, Action::Forge));
    }
}

/// A service that reads the channel can deceive only itself.
#[test]
fn services_cannot_impersonate_on_any_channel() {
    let vehicle = ["sim", "perception", "autonomy", "recorder"];
    let control = ["gateway", "console"];
    let channels = [
        ("candidates", "sim", &vehicle[..]),
        ("navigation", "sim", &vehicle),
        ("tracks", "perception", &vehicle),
        ("drive", "autonomy", &vehicle),
        ("act", "autonomy", &vehicle),
        ("seals", "recorder", &vehicle),
        ("feed", "gateway", &control),
        ("intents", "console", &control),
    ];
    let mut pairs = 0;
    for (topic, producer, services) in channels {
        for holder in services.iter().filter(|holder| **holder != producer) {
            let run = pair(topic, holder).run(1);
            let itself = NodeId::from_name(if *holder == "autonomy" { "unit-a" } else { holder }).expect("a service");
            let sights: Vec<&Witnessed> = run
                .evidence
                .entries
                .iter()
                .filter(|w| matches!(w.entry.event, Any::Instrument(Note::MouthSaw { reader, .. }) if reader != itself))
                .collect();
            for sight in &sights {
                let Any::Instrument(Note::MouthSaw { reader, at, .. }) = sight.entry.event else { continue };
                let answered = run.evidence.entries.iter().any(|w| {
                    let by_tag = |at_, reason| at_ == at && reason == Reason::Tag;
                    w.at == sight.at
                        && w.entry.node == reader
                        && matches!(
                            w.entry.event,
                            Any::Service(Event::Refused { at, reason, .. }) if by_tag(at, reason)
                        )
                });
                assert!(answered, "{topic} with the keys of {holder}: {reader} at {} ms", sight.at / 1000);
            }
            assert!(run.verdict.receipt, "{topic} with the keys of {holder} arrived");
            pairs += 1;
        }
    }
    assert_eq!(pairs, 20);
}

/// `rogue_ipc` with one channel written, by one who holds `holder`'s keys.
fn pair(topic: &str, holder: &str) -> Ready {
    let folder = tempfile::tempdir().expect("a folder");
    let text = std::fs::read_to_string(root().join("scenarios/process/rogue_ipc.toml")).expect("the scenario");
    let head = text.split("[[forge]]").next().expect("what stands before");
    let table = format!(
        "[[forge]]\ntopic = \"{topic}\"\nholder = \"{holder}\"\nsays = \"echo\"\nat_s = 4.0\nduration_s = 1.0\nevery_ms = 100\n"
    );
    std::fs::create_dir(folder.path().join("scenes")).expect("a folder");
    std::fs::copy(root().join("scenarios/scenes/yard.toml"), folder.path().join("scenes/yard.toml"))
        .expect("the scene");
    std::fs::copy(root().join("scenarios/bases/armed.toml"), folder.path().join("armed.toml")).expect("the base");
    let file = folder.path().join("rogue_ipc.toml");
    std::fs::write(&file, format!("{head}{table}")).expect("a scenario");
    let scenario = scenario::load(&file).expect("it loads");
    let setup = Setup::load(&root(), &scenario, None, false).expect("its policy and platform load");
    Ready { cell: None, scenario, setup }
}

/// The tracks are tagged under the right key, and leave no trace.
#[test]
fn synthetic_and_replayed_tracks_are_refused() {
    for run in shipped("synthetic_product").expect(SEEDS) {
        let refused = refused(&run, NodeId::UNIT_A, Interface::Bus(Topic::Tracks));
        assert_eq!(refused.len(), did(&run, Action::Forge));
        assert!(refused.iter().all(|r| *r == Reason::Product), "perception's own go on: {refused:?}");
    }
    let run = waiving("synthetic_product", &[Check::Product], &[]).run(1);
    assert!(
        refused(&run, NodeId::UNIT_A, Interface::Bus(Topic::Tracks)).contains(&Reason::Epoch),
        "then they take perception's place"
    );
}

#[test]
fn fabricated_vehicle_is_stopped_by_consent_alone() {
    shipped("fabricated_track").expect(SEEDS);
    for run in shipped("fabricated_track_declined").expect(SEEDS) {
        assert!(run.evidence.entries.iter().all(|w| !matches!(w.entry.event, Any::Instrument(Note::PlantAct { .. }))));
    }
}

/// Without the check the platform acts at an empty place.
#[test]
fn moved_track_is_refused_as_not_shown() {
    let acted = |run: &Run| {
        run.evidence.entries.iter().any(|w| matches!(w.entry.event, Any::Instrument(Note::PlantAct { .. })))
    };
    for run in shipped("track_moved").expect(SEEDS) {
        assert!(!acted(&run) && did(&run, Action::Forge) > 0);
        let reasons = refused(&run, NodeId::UNIT_A, Interface::Commands);
        assert!(reasons.contains(&Reason::Shown), "{reasons:?}");
    }
    assert!(acted(&waiving("track_moved", &[Check::Shown], &[]).run(1)));
}

/// The station reads the feed and is no producer of it: a key would let it write there in the gateway's name.
#[test]
fn second_station_has_no_key_of_the_feed() {
    let stations = ["rogue_station", "stolen_key", "expired_operator", "view_forged"].map(shipped);
    let mut found = 0;
    for ready in stations {
        let topology = lay_out(&ready.scenario, &ready.setup, 1, &RunSecret::seeded(1));
        for member in topology.members.iter().filter(|member| member.node() == NodeId::INSIDER_OPERATOR) {
            found += 1;
            assert!(member.subscribes.contains(&Topic::Feed) && !member.publishes.contains(&Topic::Feed));
            assert!(member.setup.channels.iter().all(|channel| channel.topic != Topic::Feed));
        }
    }
    assert!(found >= 2, "{found} second stations");
}
