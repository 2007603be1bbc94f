//! Every shipped scenario in the twin, named after its attack, against the classes it committed to beforehand.
//!
//! A few seeds each: rates with bounds are `holdsafe run`'s business.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use campaign::oracle::{Witnessed, judge};
use campaign::scenario::Process;
use campaign::trial::Outcome;
use holdsafe_tests::{Ready, shipped, under, variations};
use wire::command::CommandKind;
use wire::event::{Account, Event, GuardVerdict, Interface};
use wire::id::NodeId;
use wire::refusal::Reason;
use wire::stream::{Deed, Sight};

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
fn a_hold_in_a_stalled_command_stream_is_not_needed_and_comes_too_late() {
    for run in shipped("command_stall").expect(SEEDS) {
        let given = run.evidence.entries.iter().find_map(|w| match w.entry.event {
            Event::Intended { kind: CommandKind::Hold, .. } => Some(w.at as f64 / 1000.0),
            _ => None,
        });
        let given = given.expect("the operator held");
        let held = run.verdict.transitions.iter().find(|t| t.to == "HOLD_SAFE").expect("the lease lapsed").t_ms;
        assert!(held >= given && held - given <= 560.0, "lease, one control period and a hop: {given} to {held} ms");
        // The operator asks again when nothing is acknowledged; of what waited in the stall only the young is executed.
        let first = run.evidence.entries.iter().find_map(|w| match w.entry.event {
            Event::Executed { kind: CommandKind::Hold, refused, .. } => Some(refused),
            _ => None,
        });
        assert_eq!(first, Some(Some(Reason::Late)), "the order came out of the stall and was refused");
    }
}

#[test]
fn a_cut_command_connection_loses_the_hold_and_comes_back_by_itself() {
    for run in shipped("command_cut").expect(SEEDS) {
        let done = |wanted: CommandKind| {
            let one = |w: &&Witnessed| match w.entry.event {
                Event::Executed { kind, refused: None, .. } => kind == wanted,
                _ => false,
            };
            run.evidence.entries.iter().filter(one).count()
        };
        assert!(done(CommandKind::Hold) > 0 && done(CommandKind::Resume) == 1, "{:?}", run.verdict.transitions);
    }
}

#[test]
fn a_damaged_confirmation_is_refused_by_the_secure_layer_and_no_act_follows_from_it() {
    for run in shipped("command_corrupt").expect(SEEDS) {
        let times = |test: &dyn Fn(&Event) -> bool| {
            let found = run.evidence.entries.iter().filter(|w| test(&w.entry.event)).map(|w| w.at);
            found.collect::<Vec<_>>()
        };
        assert!(!times(&|e| matches!(e, Event::StreamSaw { sight: Sight::Refused, .. })).is_empty());
        // The operator asks again when nothing is acknowledged, and may act once the path is whole.
        let damaged = times(&|e| matches!(e, Event::Tampered { deed: Deed::Damaged, .. }));
        let acted = times(&|e| matches!(e, Event::PlantAct { .. }));
        assert!(acted.first().is_none_or(|at| Some(at) > damaged.last()), "{acted:?} {damaged:?}");
    }
}

/// What the adversary claims in a run with the attack, put into the log of the same run without it: the claims name the
/// right streams and places, and nothing of them is true.
#[test]
fn a_stream_relay_that_says_it_acted_and_did_not_has_no_receipt() {
    for name in ["command_stall", "command_cut", "command_corrupt"] {
        let mut ready = shipped(name);
        let attacked = ready.run(1);
        assert!(attacked.verdict.receipt, "{name}");
        let s = &mut ready.scenario;
        (s.stall, s.cut, s.stream_corrupt) = Default::default();
        let mut quiet = ready.run(1);
        assert!(quiet.verdict.zero.is_none(), "{name}");
        let claims = attacked.evidence.entries.iter().filter(|w| matches!(w.entry.event, Event::Tampered { .. }));
        quiet.evidence.entries.extend(claims.copied());
        quiet.evidence.entries.sort_by_key(|w| w.at);
        quiet.evidence.planned = attacked.evidence.planned;
        let verdict = judge(&quiet.evidence);
        assert_eq!((verdict.receipt, verdict.outcome), (false, Outcome::Invalid), "{name}: {:?}", verdict.findings);
    }
}

#[test]
fn a_datagram_that_leaves_the_relay_and_is_in_no_account_makes_the_run_invalid() {
    let run = shipped("nominal").run(1);
    assert_eq!(run.verdict.findings, []);
    for node in [NodeId::GATEWAY, NodeId::UNIT_A] {
        let mut evidence = run.evidence.clone();
        let one_less = |w: &mut Witnessed| {
            if let Event::Count { account: Account::Datagrams, n } = &mut w.entry.event
                && Some(w.entry.node) == node.guard()
            {
                *n -= 1;
            }
        };
        evidence.entries.iter_mut().for_each(one_less);
        assert_eq!(judge(&evidence).outcome, Outcome::Invalid, "{node}");
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
