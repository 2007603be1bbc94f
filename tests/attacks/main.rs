//! Every shipped scenario in the twin, named after its attack, against the classes it committed to beforehand.
//!
//! A few seeds each: rates with bounds are `holdsafe run`'s business.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use campaign::scenario::Process;
use campaign::trial::Outcome;
use holdsafe_tests::{Ready, shipped, under, variations};
use wire::event::{Account, Event, GuardVerdict, Interface};
use wire::id::NodeId;

const SEEDS: std::ops::Range<u64> = 1..4;

#[test]
fn null_attack_trips_nothing_and_the_operator_gets_the_mission_done() {
    for run in shipped("nominal").expect(SEEDS) {
        let acts = run.evidence.entries.iter().filter(|w| matches!(w.entry.event, Event::PlantAct { .. })).count();
        assert_eq!(acts, 1, "{:?}", run.verdict.transitions);
    }
}

/// A lossy link is weather, not an attack: what it costs is a false trip.
#[test]
fn a_hold_brought_about_by_the_links_own_loss_is_a_false_trip() {
    let mut ready = shipped("nominal");
    ready.scenario = ready.scenario.soak(60.0, 0.4);
    for seed in SEEDS {
        let verdict = ready.run(seed).verdict;
        assert_eq!(verdict.outcome, Outcome::FalseTrip, "{:?}", verdict.transitions);
        assert!(verdict.false_trips > 0 && verdict.zero.is_none());
    }
}

#[test]
fn replayed_records_of_the_same_session_are_never_delivered() {
    for run in shipped("replay").expect(SEEDS) {
        let gateway = NodeId::GATEWAY.guard().expect("a guard");
        let count = |node: NodeId, wanted: Account| {
            run.evidence.entries.iter().find_map(|w| match w.entry.event {
                Event::Count { account, n } if account == wanted && w.entry.node == node => Some(n),
                _ => None,
            })
        };
        let added = count(NodeId::RELAY_TELEMETRY, Account::RelayAdded(wire::core::Side::Server)).unwrap_or(0);
        assert!(added > 0, "something was replayed");
        assert_eq!(count(gateway, Account::Discarded), Some(added));
        assert_eq!(count(NodeId::GATEWAY, Account::Received(Interface::Uplink)), count(gateway, Account::Delivered));
    }
}

#[test]
fn delay_beyond_the_freshness_window_holds() {
    shipped("delay").expect(SEEDS);
}

#[test]
fn duplicates_are_accepted_once() {
    shipped("duplicate").expect(SEEDS);
}

#[test]
fn damaged_ciphertext_is_discarded_and_the_association_stands() {
    shipped("corrupt").expect(SEEDS);
}

#[test]
fn loss() {
    shipped("loss").expect(SEEDS);
}

#[test]
fn a_teammate_forwards_a_third_units_telemetry_in_every_form_under_every_policy() {
    for cell in variations("teammate") {
        cell.expect(1..3);
    }
}

#[test]
fn a_naive_relay_gets_no_record_in() {
    for run in shipped("naive_relay").expect(SEEDS) {
        let refused = run.evidence.entries.iter().any(
            |w| matches!(w.entry.event, Event::GuardSaw { association, .. } if association == campaign::twin::STRANGER),
        );
        assert!(refused, "the guard saw the stranger");
    }
}

#[test]
fn loss_of_the_thermal_camera_degrades_and_revokes_authority() {
    for run in shipped("thermal_loss").expect(SEEDS) {
        assert!(run.verdict.latency.to_authority_revoked.is_some(), "{:?}", run.verdict.transitions);
    }
}

#[test]
fn loss_of_the_colour_camera_degrades_and_revokes_authority() {
    for run in shipped("rgb_loss").expect(SEEDS) {
        assert!(run.verdict.latency.to_authority_revoked.is_some(), "{:?}", run.verdict.transitions);
    }
}

#[test]
fn starved_tracks_degrade() {
    shipped("track_starvation").expect(SEEDS);
}

#[test]
fn loss_of_localisation_holds() {
    shipped("localisation_loss").expect(SEEDS);
}

#[test]
fn malformed_but_authenticated_records_are_refused_by_name() {
    for run in shipped("malformed").expect(SEEDS) {
        let refused = run.evidence.entries.iter().any(|w| matches!(w.entry.event, Event::Refused { .. }));
        assert!(refused);
    }
}

#[test]
fn without_the_age_bound_a_replay_of_old_state_is_still_not_delivered_by_the_session() {
    let ready = under("replay", "session-only");
    for seed in SEEDS {
        let outcome = ready.run(seed).verdict.outcome;
        assert!(!matches!(outcome, Outcome::Unsafe | Outcome::Invalid), "{outcome:?}");
    }
}

/// The null attack with one process killed, as `holdsafe bench kill` runs it.
fn killing(process: Process, expected: Outcome) -> Ready {
    let nominal = shipped("nominal");
    Ready { scenario: nominal.scenario.killing(process, &[expected]), ..nominal }
}

#[test]
fn when_autonomy_is_killed_the_plant_brakes_by_its_own_lease() {
    for run in killing(Process::Autonomy, Outcome::HoldSafe).expect(SEEDS) {
        let [response] = &run.verdict.responses[..] else { panic!("{:?}", run.verdict.responses) };
        let plant = response.plant.expect("the world lives on");
        assert!(plant.speed_mm_s > 1000, "it was driving: {plant:?}");
        let lease = plant.lease_ended_ms.expect("the lease ends");
        let asked = run.evidence.bounds.set_point_lease_ms as f64;
        assert!(lease > 0.0 && lease <= asked + 10.0, "one step after the lease at the latest: {plant:?}");
        assert!(plant.standing_ms.expect("it stands") > lease, "{plant:?}");
    }
}

#[test]
fn a_unit_that_asked_for_a_lease_beyond_th_and_is_killed_is_stopped_by_the_plant_within_th() {
    let mut ready = killing(Process::Autonomy, Outcome::HoldSafe);
    ready.setup.bounds.set_point_lease_ms = 5000;
    for run in ready.expect(SEEDS) {
        let lease = run.verdict.responses[0].plant.and_then(|plant| plant.lease_ended_ms);
        assert!(lease.is_some_and(|ms| ms > 900.0), "the plant's own limit ended it: {lease:?}");
    }
}

#[test]
fn every_process_that_is_killed_leaves_the_platform_in_the_mode_that_was_stated() {
    for (process, expected) in [
        (Process::Sim, Outcome::HoldSafe),
        (Process::Perception, Outcome::HoldSafe),
        (Process::Gateway, Outcome::HoldSafe),
        (Process::Adversary, Outcome::HoldSafe),
        (Process::Broker, Outcome::HoldSafe),
        (Process::Recorder, Outcome::Degraded),
        (Process::Console, Outcome::Undetected),
    ] {
        for run in killing(process, expected).expect(SEEDS) {
            let [response] = &run.verdict.responses[..] else { panic!("{:?}", run.verdict.responses) };
            assert!(response.kept, "{:?}", run.verdict.findings);
        }
    }
}

#[test]
fn a_keyless_alert_ends_nothing_and_without_the_guard_a_series_of_them_holds() {
    for run in shipped("alert").expect(SEEDS) {
        assert!(run.evidence.entries.iter().all(|w| !matches!(w.entry.event, Event::Session { open: false, .. })));
    }
    for seed in SEEDS {
        let run = under("alert", "guard-off").run(seed);
        assert_eq!(run.verdict.outcome, Outcome::HoldSafe, "{:?}", run.verdict.transitions);
    }
}

#[test]
fn one_silent_hello_keeps_nobody_out_even_when_the_association_must_come_back() {
    shipped("silent_hello").expect(SEEDS);
    for seed in SEEDS {
        let run = under("silent_hello", "guard-off").run(seed);
        assert_eq!(run.verdict.outcome, Outcome::Rejected, "{:?}", run.verdict.transitions);
        let unit = |w: &&campaign::oracle::Witnessed| w.entry.node == NodeId::UNIT_A;
        let sessions = run.evidence.entries.iter().filter(unit).filter_map(|w| match w.entry.event {
            Event::Session { open, .. } => Some(open),
            _ => None,
        });
        assert_eq!(sessions.collect::<Vec<_>>(), [true, false, true], "ended once and came back");
    }
}

#[test]
fn hellos_whose_lengths_lie_are_refused_by_name() {
    for run in shipped("malformed_hello").expect(SEEDS) {
        let refused = |w: &&campaign::oracle::Witnessed| {
            matches!(w.entry.event, Event::GuardSaw { verdict: GuardVerdict::Malformed, .. })
        };
        assert_eq!(run.evidence.entries.iter().filter(refused).count(), 120);
    }
}
