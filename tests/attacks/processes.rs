//! Processes that end, hang, are slow or find their disk full.

use evidence::process_fault::ProcessFault;
use evidence::trial::Outcome;
use ground_truth::{Any, Note};
use holdsafe_tests::{Ready, shipped, variations};
use oracle::judge;
use scenario::{Ending, Process, Settings};
use topology::MemberRole;
use wire::event::Event;
use wire::id::NodeId;
use wire::mode::Mode;
use wire::time::Instant;
use wire::trust::RevocationList;

use crate::SEEDS;

/// The null attack with one process killed, as `lab kill` runs it.
fn killing(process: Process, expected: Outcome) -> Ready {
    let nominal = shipped("nominal");
    Ready { scenario: nominal.scenario.killing(process, &[expected]), ..nominal }
}

#[test]
fn plant_brakes_by_lease_after_autonomy_dies() {
    for run in killing(Process::Autonomy, Outcome::HoldSafe).expect(SEEDS) {
        let [response] = &run.verdict.responses[..] else { panic!("{:?}", run.verdict.responses) };
        let plant = response.plant.expect("the world lives on");
        assert!(plant.speed_mm_s > 1000, "it was driving: {plant:?}");
        let lease = plant.lease_ended_ms.expect("the lease ends");
        let requested = run.evidence.bounds.set_point_lease_ms as f64;
        assert!(lease > 0.0 && lease <= requested + 10.0, "one step after the lease at the latest: {plant:?}");
        assert!(plant.standing_ms.expect("it stands") > lease, "{plant:?}");
    }
}

/// For a driving and for a standing unit, when autonomy ends.
#[test]
fn plant_lease_ends_with_the_last_set_point() {
    for ready in variations("autonomy_ends") {
        for run in ready.expect(SEEDS) {
            let [response] = &run.verdict.responses[..] else { panic!("{:?}", run.verdict.responses) };
            let plant = response.plant.expect("the world lives on");
            assert_eq!(plant.speed_mm_s > 1000, ready.cell.as_deref() == Some("driving"), "{plant:?}");
            let requested = run.evidence.bounds.set_point_lease_ms as f64;
            assert!(plant.lease_ended_ms.is_some_and(|ms| ms <= requested + 10.0), "{plant:?}");
        }
    }
}

#[test]
fn long_lease_of_killed_unit_stops_within_th() {
    let mut ready = killing(Process::Autonomy, Outcome::HoldSafe);
    ready.setup.bounds.set_point_lease_ms = 5000;
    for run in ready.expect(SEEDS) {
        let lease = run.verdict.responses[0].plant.and_then(|plant| plant.lease_ended_ms);
        assert!(lease.is_some_and(|ms| ms > 900.0), "the plant's own limit ended it: {lease:?}");
    }
}

#[test]
fn each_killed_process_leaves_its_stated_mode() {
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
            assert!(response.in_time, "{:?}", run.verdict.findings);
        }
    }
}

/// The mission of `process_ends` with another fault of a process at one change of mode.
fn ending_at(process: Process, ending: Ending, change: (Mode, Mode)) -> Ready {
    let mission = shipped("process_ends");
    Ready { scenario: mission.scenario.ending_at(process, ending, change), ..mission }
}

const ARMING: (Mode, Mode) = (Mode::Ready, Mode::PrepareToAct);

#[test]
fn hung_gateway_at_arming_restores_no_grants() {
    for run in shipped("process_ends").expect(SEEDS) {
        let [response] = &run.verdict.responses[..] else { panic!("{:?}", run.verdict.responses) };
        assert!(response.in_time && response.fate == ProcessFault::Hang, "{response:?} {:?}", run.verdict.findings);
        assert!(response.restricted_ms.is_some_and(|ms| ms <= 1000.0), "{response:?}");
    }
}

#[test]
fn resumed_unit_holds_before_reading_backlog() {
    for run in ending_at(Process::Autonomy, Ending::Hang, ARMING).expect(SEEDS) {
        let [response] = &run.verdict.responses[..] else { panic!("{:?}", run.verdict.responses) };
        let lease = response.plant.and_then(|plant| plant.lease_ended_ms);
        assert!(lease.is_some_and(|ms| ms <= 310.0), "the plant did not wait for it: {response:?}");
        let after = run.verdict.transitions.iter().find(|t| t.t_ms > response.killed_ms + 1.0).expect("it changes");
        assert_eq!((after.to.as_str(), after.cause.as_str()), ("HOLD_SAFE", "lost:lease"));
    }
}

#[test]
fn short_pause_within_product_life_continues() {
    let mut ready = ending_at(Process::Autonomy, Ending::Hang, ARMING);
    let short = serde_json::json!(0.15);
    ready.scenario = Settings::one("kill.0.duration_s", short).applied_to(&ready.scenario).expect("a duration");
    for seed in SEEDS {
        let run = ready.run(seed);
        let in_time = run.verdict.responses.iter().all(|r| r.in_time);
        let restricted = run.verdict.transitions.iter().any(|t| t.cause.starts_with("lost"));
        assert!(in_time && !restricted, "{:?} {:?}", run.verdict.findings, run.verdict.transitions);
    }
}

#[test]
fn restarted_unit_is_idle_and_unarmed() {
    let mut ready = ending_at(Process::Autonomy, Ending::Kill, ARMING);
    let repeated = serde_json::json!(1.0);
    ready.scenario = Settings::one("kill.0.restart_after_s", repeated).applied_to(&ready.scenario).expect("a restart");
    for run in ready.expect(SEEDS) {
        let restarted = run.evidence.entries.iter().find_map(|w| match w.entry.event {
            Any::Instrument(Note::Restarted { node: NodeId::UNIT_A, boot }) => Some((w.at, boot.0)),
            _ => None,
        });
        let (restart_us, boot) = restarted.expect("it is started again");
        assert_eq!(boot, 2);
        let heard = |w: &evidence::Witnessed| w.at > restart_us && w.entry.node == NodeId::GATEWAY;
        let reports = run.evidence.entries.iter().filter(|w| heard(w)).any(|w| match w.entry.event {
            Any::Service(Event::Accepted { record, .. }) => record.node == NodeId::UNIT_A && record.boot.0 == 2,
            _ => false,
        });
        assert!(reports, "it reports under its new boot");
        let later: Vec<_> = run.verdict.transitions.iter().filter(|t| t.t_ms > restart_us as f64 / 1000.0).collect();
        assert!(later.is_empty(), "nobody enabled it: {later:?}");
    }
}

#[test]
fn restarted_judge_resumes_the_remaining_validity() {
    let ready = shipped("expired_operator");
    let (topology, _) = twin::trial::start(&ready.scenario, &ready.setup, 1, false).expect("it starts");
    let mandate = |member: &topology::Member| match &member.role {
        MemberRole::Autonomy(config) => config.mandates.first().copied(),
        MemberRole::Gateway(config) => config.mandates.first().copied(),
        _ => None,
    };
    let judges: Vec<_> = topology.members.iter().filter(|member| mandate(member).is_some()).collect();
    assert!(judges.iter().any(|m| m.node() == NodeId::UNIT_A) && judges.iter().any(|m| m.node() == NodeId::GATEWAY));
    for judge in judges {
        let (before, after) = (judge.restarted(2_000_000), judge.restarted(4_000_000));
        let is_up = |member| {
            let revoked = RevocationList::new(&[mandate(member).expect("it is still there")], Instant(0));
            revoked.check_admitted(NodeId::OPERATOR_2, Instant(1_400_000)).is_ok()
        };
        assert!(is_up(judge) && is_up(&before) && !is_up(&after), "3.5 s of the run, whoever starts when");
    }
}

#[test]
fn slow_broker_delays_a_message_from_any_start() {
    use Mode::{HoldSafe, PrepareToAct, Ready};
    for change in [ARMING, (PrepareToAct, Ready), (Ready, HoldSafe), (HoldSafe, Ready)] {
        for run in ending_at(Process::Broker, Ending::Slow, change).expect(SEEDS) {
            assert!(
                run.verdict.receipt && run.verdict.responses.iter().all(|r| !r.required && r.in_time),
                "{change:?}"
            );
        }
    }
}

#[test]
fn short_stop_owes_nothing_and_long_one_does() {
    let expected_at =
        |process, ending| ending_at(process, ending, ARMING).run(1).verdict.responses.iter().all(|r| r.required);
    for process in [Process::Sim, Process::Perception, Process::Autonomy, Process::Gateway, Process::Recorder] {
        assert!(expected_at(process, Ending::Hang) && expected_at(process, Ending::Kill), "{process:?}");
        assert!(!expected_at(process, Ending::Slow), "{process:?}");
    }
    assert!(!expected_at(Process::Console, Ending::Kill), "no bound asks for a person");
}

#[test]
fn stopped_plant_obeys_after_resuming() {
    for run in ending_at(Process::Sim, Ending::Hang, ARMING).expect(SEEDS) {
        assert!(run.verdict.responses.iter().all(|r| r.required && r.in_time), "{:?}", run.verdict.findings);
    }
}

#[test]
fn claimed_hang_with_writes_is_no_evidence() {
    let attacked = shipped("process_ends").run(1);
    let mut ready = shipped("process_ends");
    ready.scenario.kill = Default::default();
    let mut quiet = ready.run(1);
    let claims = attacked.evidence.entries.iter().filter(|w| w.entry.node == NodeId::CAMPAIGN);
    quiet.evidence.entries.extend(claims.copied());
    quiet.evidence.entries.sort_by_key(|w| w.at);
    quiet.evidence.planned = attacked.evidence.planned;
    let verdict = judge(&quiet.evidence);
    assert_eq!((verdict.receipt, verdict.outcome), (false, Outcome::Invalid), "{:?}", verdict.findings);
}

/// Times at which the gateway accepted a report of the unit's.
fn reported(run: &twin::trial::Run) -> Vec<u64> {
    let own_entries = run.evidence.entries.iter().filter(|w| match w.entry.event {
        Any::Service(Event::Accepted { record, .. }) => {
            w.entry.node == NodeId::GATEWAY && record.node == NodeId::UNIT_A
        }
        _ => false,
    });
    own_entries.map(|w| w.at).collect()
}

fn longest_pause(times: &[u64]) -> u64 {
    times.windows(2).map(|pair| pair[1] - pair[0]).max().expect("several reports")
}

/// Time at which the recorder's disk was reported full, or to have room again.
fn disk(run: &twin::trial::Run, full: bool) -> Option<u64> {
    let disk_full = |on: bool| Any::Instrument(Note::DiskFull { node: NodeId::RECORDER, on });
    run.evidence.entries.iter().find(|w| w.entry.event == disk_full(full)).map(|w| w.at)
}

/// Within the seal limit.
#[test]
fn full_disk_revokes_authority_without_blocking() {
    let undisturbed = longest_pause(&reported(&shipped("nominal").run(1)));
    for cell in variations("disk_full") {
        for run in cell.expect(SEEDS) {
            let [response] = &run.verdict.responses[..] else { panic!("{:?}", run.verdict.responses) };
            assert!(response.in_time && response.fate == ProcessFault::Full, "{response:?} {:?}", run.verdict.findings);
            let bounds = run.evidence.bounds;
            let limit = (bounds.seal_limit_ms + bounds.control_period_ms) as f64;
            assert!(response.restricted_ms.is_some_and(|ms| ms <= limit), "{response:?}");
            let first = run.verdict.transitions.iter().find(|t| t.t_ms > response.killed_ms).expect("it changes");
            assert_eq!((first.to.as_str(), first.cause.as_str()), ("DEGRADED", "lost:sealed_log"));
            let pause = longest_pause(&reported(&run));
            assert!(pause <= undisturbed + 20_000, "reports wait for nothing: {pause} us, {undisturbed} else");
        }
    }
}

/// The unit recovers by itself.
#[test]
fn freed_disk_loses_nothing_and_arms_nothing() {
    let cells = variations("disk_full");
    let cell = cells.iter().find(|cell| cell.cell.as_deref() == Some("for_a_time")).expect("it is there");
    for run in cell.expect(SEEDS) {
        let freed = disk(&run, false).expect("it has room again");
        let later: Vec<_> = run.verdict.transitions.iter().filter(|t| t.t_ms > freed as f64 / 1000.0).collect();
        let to: Vec<&str> = later.iter().map(|t| t.to.as_str()).collect();
        assert_eq!(to, ["READY"], "{later:?}");
        let own_entries =
            |w: &&evidence::Witnessed| evidence::log::by_recorder(w.entry.node) && w.entry.node != NodeId::RECORDER;
        let sealed = run.evidence.entries.iter().rev().find_map(|w| match w.entry.event {
            Any::Service(Event::Sealed { entries, .. }) => Some(entries),
            _ => None,
        });
        assert_eq!(sealed, Some(run.evidence.entries.iter().filter(own_entries).count() as u64));
    }
}

#[test]
fn claimed_full_disk_needs_a_stalled_recording() {
    for cell in variations("disk_full") {
        let run = cell.run(1);
        let full = disk(&run, true).expect("it is full");
        let is_sealed = |w: &evidence::Witnessed| matches!(w.entry.event, Any::Instrument(Note::Kept { .. }));
        let mut unseen = run.evidence.clone();
        unseen.entries.retain(|w| !is_sealed(w));
        assert_eq!(judge(&unseen).outcome, Outcome::Invalid, "nobody looked");
        let mut grows = run.evidence.clone();
        let last = *grows.entries.iter().find(|w| is_sealed(w)).expect("it grew");
        grows.entries.push(evidence::Witnessed { at: full + 1_000_000, ..last });
        grows.entries.sort_by_key(|w| w.at);
        assert_eq!(judge(&grows).outcome, Outcome::Invalid, "it went on growing");
    }
}

/// Noticed in time, with half and with a quarter of it.
#[test]
fn losses_are_noticed_on_a_slow_processor() {
    for name in ["constrained_loss", "constrained_blackout"] {
        let cells = variations(name);
        assert_eq!(cells.len(), 2);
        cells.iter().for_each(|cell| drop(cell.expect(SEEDS)));
    }
}

#[test]
fn late_products_are_a_lost_stage() {
    shipped("slow_inference").expect(SEEDS);
}

/// The log without the hold: the judge has to miss it.
#[test]
fn unit_ignoring_its_hang_is_late() {
    let mut run = ending_at(Process::Autonomy, Ending::Hang, ARMING).run(1);
    let holds = |event: &Any| matches!(event, Any::Service(Event::Transition { to: Mode::HoldSafe, .. }));
    run.evidence.entries.retain(|w| !holds(&w.entry.event));
    let verdict = judge(&run.evidence);
    // The display heard of the hold, so it is at odds with the cut log as well (P7).
    assert!(matches!(verdict.outcome, Outcome::Late | Outcome::Unsafe), "{:?}", verdict.outcome);
    assert!(verdict.findings.iter().any(|f| f.message.contains("in which it did not run")), "{:?}", verdict.findings);
}
