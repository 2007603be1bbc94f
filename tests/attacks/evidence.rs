//! Strength of the evidence: denied receipts, recordings in an attacker's hands.

use std::collections::BTreeSet;
use std::os::unix::fs::PermissionsExt;
use std::sync::atomic::{AtomicBool, Ordering};
use wire::mode::Mode;

use evidence::anchors::{Life, TrustAnchors};
use evidence::log::{Logged, by_recorder};
use evidence::trial::{Outcome, Trial};
use evidence::{Plan, Planned, Witnessed};
use ground_truth::{Any, Entry, Note};
use holdsafe_tests::{root, shipped, variations};
use oracle::judge;
use recording::log::{LogVerifier, Verification, chain_heads};
use scenario::{Ending, Process, Settings};
use topology::is_attacked;
use twin::sabotage::sabotage;
use twin::trial::Run;
use wire::event::Event;
use wire::id::{Boot, NodeId};

use adversary::insider::{InsiderRecorder, RecordedEntry};
use adversary::plan::Tampering;

use crate::SEEDS;

/// N1: claims of the actors of each shipped scenario, in the log of the same trial without their actions.
#[test]
#[ignore = "long: every scenario"]
fn no_scenario_yields_a_false_receipt() {
    let (mut denied, mut believed) = (0, Vec::new());
    for file in scenario::shipped(&root()).expect("scenarios") {
        let name = file.file_stem().expect("a name").to_string_lossy().into_owned();
        let ready = variations(&name).into_iter().next().expect("a variation");
        if !is_attacked(&ready.scenario) {
            continue;
        }
        let done = sabotage(&ready.scenario, &ready.setup, 1).expect("it starts");
        assert!(done.claims > 0, "{name}: nobody claims anything");
        if done.verdict.receipt || done.verdict.outcome != Outcome::Invalid {
            believed.push(name);
        }
        denied += 1;
    }
    println!("{} of {denied} attacking scenarios INVALID; believed: {believed:?}", denied - believed.len());
    assert!(believed.is_empty(), "{believed:?} of {denied}");
    assert!(denied > 60, "{denied}");
}

#[test]
fn receipt_of_one_table_serves_no_other() {
    for (name, node) in [("view_forged", NodeId::INSIDER_GATEWAY), ("role_gateway", NodeId::INSIDER_OPERATOR)] {
        let run = shipped(name).run(1);
        assert!(run.verdict.receipt, "{name}");
        let deed = |w: &Witnessed| {
            w.entry.node == node && matches!(w.entry.event, Any::Instrument(Note::Attack { .. } | Note::Rogue { .. }))
        };
        let mut plans: Vec<Plan> = run.evidence.planned.clone();
        plans.retain(|plan| matches!(plan.what, Planned::Feed(_) | Planned::Rogue));
        assert!(plans.len() > 1, "{name}: {plans:?}");
        for plan in plans {
            let mut ablated_evidence = run.evidence.clone();
            ablated_evidence.entries.retain(|w| !deed(w) || w.at + 5_000 < plan.from || w.at > plan.until + 100_000);
            let verdict = judge(&ablated_evidence);
            assert_eq!((verdict.receipt, verdict.outcome), (false, Outcome::Invalid), "{name}: {plan:?}");
        }
    }
}

#[test]
fn recording_is_untouched_when_actors_are_idle() {
    let ready = shipped("hostile_recorder");
    let run = ready.run(1);
    assert!(run.topology.hands().is_some());
    assert!(run.topology.disarmed(&ready.scenario).hands().is_none());
}

/// The recording is edited, reordered or cut.
#[test]
fn edited_recording_is_invalid_and_located() {
    for run in shipped("evidence_tampered").expect(1..11) {
        let first = run.evidence.log_flaws.first().expect("a flaw");
        assert!(first.at > 0, "{first}");
    }
}

#[test]
fn consistent_forgery_fails_on_signatures_and_heads() {
    for run in shipped("hostile_recorder").expect(1..10) {
        assert!(!run.evidence.log_flaws.is_empty());
    }
}

const ALL: [Tampering; 9] = [
    Tampering::Edit,
    Tampering::Swap,
    Tampering::Delete,
    Tampering::Truncate,
    Tampering::Omit,
    Tampering::Rechain,
    Tampering::CutAtSeal,
    Tampering::Feign,
    Tampering::Retime,
];

/// A finished run's recording, and its trust anchors outside the recorder: without the logs of guards and launcher, which it cannot
/// touch.
fn recorded() -> (Run, Vec<RecordedEntry>) {
    let mut run = shipped("nominal").run(1);
    run.anchors.heads.retain(|head| by_recorder(head.node));
    let records = kept_of(&run, by_recorder);
    (run, records)
}

/// Logs of those writers for which that is true.
fn kept_of(run: &Run, is_author: impl Fn(NodeId) -> bool) -> Vec<RecordedEntry> {
    let loggeds = run.log.iter().filter(|l| is_author(l.node));
    loggeds.map(|Logged { at, node, bytes }| RecordedEntry { at: *at, node: *node, bytes: bytes.clone() }).collect()
}

fn judged(records: &[RecordedEntry], anchors: &TrustAnchors) -> Verification {
    let mut log_verifier = LogVerifier::new(anchors);
    for one in records {
        let _noted = log_verifier.take(one.at, one.node, &one.bytes);
    }
    log_verifier.close()
}

/// Each kind of tampering is applied at forty places.
#[test]
fn every_tampering_is_found_everywhere() {
    let (run, records) = recorded();
    assert_eq!(judged(&records, &run.anchors).flaws, [], "untouched");
    let recorder = run.topology.members.iter().find(|m| m.node() == NodeId::RECORDER).expect("a recorder");
    for does in ALL {
        let mut places = BTreeSet::new();
        for seed in 0..40 {
            let mut hands = records.clone();
            let place = InsiderRecorder::new(recorder.setup.key(), does, seed).lay_on(&mut hands);
            let verification = judged(&hands, &run.anchors);
            assert!(!verification.flaws.is_empty(), "{does:?} at {place:?} of {}", records.len());
            // Bytes that were changed are found where they are, or at the next entry of their chain.
            if matches!(does, Tampering::Edit) {
                assert!(verification.flaws[0].at >= place.expect("a place"), "{does:?}: {}", verification.flaws[0]);
            }
            places.insert(place);
        }
        assert!(places.len() > 5, "{does:?}: {places:?}");
    }
}

/// Benefit of each of the two defences behind the chains: without one, an attack gets through that the other found.
#[test]
fn missing_signatures_or_heads_admit_forgeries() {
    let (run, records) = recorded();
    let recorder = run.topology.members.iter().find(|m| m.node() == NodeId::RECORDER).expect("a recorder");
    let after = |does| {
        let mut hands = records.clone();
        InsiderRecorder::new(recorder.setup.key(), does, 3).lay_on(&mut hands);
        hands
    };
    // A reader without a head knows nothing of any life; that is not what is asked here.
    let headless = TrustAnchors { heads: Vec::new(), ..run.anchors.clone() };
    let tampered = |does| {
        let mut flaws = judged(&after(does), &headless).flaws;
        flaws.retain(|flaw| !flaw.what.starts_with("nobody knows of"));
        flaws
    };
    assert_eq!(tampered(Tampering::CutAtSeal), [], "a run cut at a seal looks like a shorter run");
    for does in [Tampering::Omit, Tampering::Rechain] {
        assert!(tampered(does).iter().any(|f| f.what.contains("sign")), "{does:?}: {:?}", tampered(does));
    }
}

/// A guard observes the basis of a receipt; its log is a chain like any other.
#[test]
#[ignore = "long: every entry of a live run altered"]
fn guard_and_launcher_logs_resist_tampering() {
    let run = shipped("process_ends").run(1);
    let whole = kept_of(&run, |_| true);
    assert_eq!(judged(&whole, &run.anchors).flaws, [], "untouched");
    let mut witnesses: Vec<NodeId> = whole.iter().map(|one| one.node).filter(|node| !by_recorder(*node)).collect();
    witnesses.sort();
    witnesses.dedup();
    assert!(witnesses.len() > 3 && witnesses.contains(&NodeId::CAMPAIGN), "{witnesses:?}");
    let found = |name: &str, records: &[RecordedEntry]| {
        let flaws = judged(records, &run.anchors).flaws;
        assert!(!flaws.is_empty(), "{name}");
        flaws
    };
    for witness in witnesses {
        let own_indices: Vec<usize> = (0..whole.len()).filter(|i| whole[*i].node == witness).collect();
        let flaws = found("left out", &kept_of(&run, |node| node != witness));
        assert!(flaws.iter().any(|f| f.what.contains(&format!("{witness}, boot 1 wrote"))), "{flaws:?}");
        for i in own_indices.iter().copied().step_by(own_indices.len().div_ceil(40)) {
            let mut cut = whole.clone();
            cut.remove(i);
            found(&format!("{witness}: entry {i} is gone"), &cut);
            let mut ended = whole.clone();
            ended.retain(|one| one.node != witness || one.at < whole[i].at);
            found(&format!("{witness}: ended before entry {i}"), &ended);
            for byte in 0..whole[i].bytes.len() {
                let mut changed = whole.clone();
                changed[i].bytes[byte] ^= 1 << (byte % 8);
                found(&format!("{witness}: byte {byte} of entry {i}"), &changed);
            }
        }
        // With its chain written again by somebody who has not its key, and no head to hold it to.
        let mut anchors = run.anchors.clone();
        anchors.heads.retain(|head| head.node != witness);
        anchors.killed.push(Life { node: witness, boot: Boot(1) });
        let mut records = whole.clone();
        let mut entry = Entry::decode(&records[own_indices[0]].bytes).expect("an entry");
        entry.at.0 += 1;
        records[own_indices[0]].bytes = wire::codec::encode(&entry);
        let recorder = run.topology.members.iter().find(|m| m.node() == NodeId::RECORDER).expect("a recorder");
        InsiderRecorder::new(recorder.setup.key(), Tampering::Rechain, 0).chain_anew(&mut records);
        let flaws = judged(&records, &anchors).flaws;
        let unsigned = format!("{witness}, boot 1 did not sign its chain here");
        assert!(flaws.iter().any(|f| f.what == unsigned), "{unsigned}: {flaws:?}");
    }
}

#[test]
fn service_left_out_by_the_recorder_is_missed() {
    let (run, mut records) = recorded();
    records.retain(|one| one.node != NodeId::CONSOLE);
    let flaws = judged(&records, &run.anchors).flaws;
    assert!(flaws.iter().any(|f| f.what.contains("console, boot 1 wrote")), "{flaws:?}");
    let full = chain_heads(&run.log);
    assert!(full.iter().any(|head| head.node == NodeId::CONSOLE));
}

/// The entries of one life.
fn of_life(records: &[RecordedEntry], life: Life) -> Vec<RecordedEntry> {
    records
        .iter()
        .filter(|one| Entry::decode(&one.bytes).is_ok_and(|e| Life::from_entry(&e) == life))
        .cloned()
        .collect()
}

#[test]
fn life_before_a_restart_rests_on_signatures() {
    let mut ready = shipped("process_ends");
    let change = (Mode::Ready, Mode::PrepareToAct);
    ready.scenario = ready.scenario.ending_at(Process::Autonomy, Ending::Kill, change);
    let repeated = Settings::one("kill.0.restart_after_s", serde_json::json!(1.0));
    ready.scenario = repeated.applied_to(&ready.scenario).expect("a restart");
    let run = ready.run(1);
    assert_eq!(run.evidence.log_flaws, []);
    let [first, second] = [1, 2].map(|boot| Life { node: NodeId::UNIT_A, boot: Boot(boot) });
    // Live nobody holds the head of one that was killed.
    let mut anchors = run.anchors.clone();
    anchors.heads.retain(|head| head.life() != first && by_recorder(head.node));
    let records = kept_of(&run, by_recorder);
    assert_eq!(judged(&records, &anchors).flaws, [], "that it was killed is on record");
    let recorder = run.topology.members.iter().find(|m| m.node() == NodeId::RECORDER).expect("a recorder");
    let lives = [first, second].map(|life| of_life(&records, life).len());
    assert!(lives.iter().all(|n| *n > 20), "{lives:?}");
    let hands = InsiderRecorder::new(recorder.setup.key(), Tampering::Rechain, 0);
    for (what, unsigned) in [("rewritten", false), ("rewritten without its signatures", true)] {
        let mut records = records.clone();
        let mut old = 0;
        records.retain_mut(|one| {
            let Ok(mut entry) = Entry::decode(&one.bytes) else { return true };
            if Life::from_entry(&entry) != first {
                return true;
            }
            old += 1;
            if old == 5 {
                entry.event = Any::Service(Event::Started);
                one.bytes = wire::codec::encode(&entry);
            }
            !unsigned || !matches!(entry.event, Any::Service(Event::Signed { .. }))
        });
        hands.chain_anew(&mut records);
        let flaws = judged(&records, &anchors).flaws;
        assert!(flaws.iter().any(|f| f.what.contains("unit-a, boot 1 did not sign")), "{what}: {flaws:?}");
    }
    anchors.killed.clear();
    let flaws = judged(&records, &anchors).flaws;
    assert!(flaws.iter().any(|f| f.what == "nobody knows of unit-a, boot 1"), "{flaws:?}");
}

#[test]
fn entry_kept_as_anothers_is_a_flaw() {
    let (run, mut records) = recorded();
    let i = records.iter().position(|one| one.node == NodeId::CONSOLE).expect("an entry of the console's");
    records[i].node = NodeId::GATEWAY;
    let flaws = judged(&records, &run.anchors).flaws;
    assert_eq!(flaws.iter().map(|f| f.at).collect::<Vec<_>>(), [i + 1], "{flaws:?}");
}

/// The recorder's own last entry has no later entry that would cover it.
#[test]
fn no_entrys_time_can_be_moved() {
    let (run, records) = recorded();
    for i in 0..records.len() {
        let mut hands = records.clone();
        let mut entry = Entry::decode(&hands[i].bytes).expect("an entry");
        entry.at.0 += 1;
        hands[i].bytes = wire::codec::encode(&entry);
        let verification = judged(&hands, &run.anchors);
        assert!(!verification.flaws.is_empty(), "entry {} of {}, {}", i + 1, records.len(), entry.node);
    }
}

#[test]
fn anchors_and_log_hold_no_secret() {
    let run = shipped("nominal").run(1);
    let text = serde_json::to_vec(&run.anchors).expect("JSON");
    for member in &run.topology.members {
        let hex: String = member.setup.secret.0.iter().map(|b| format!("{b:02x}")).collect();
        let channels = member.setup.channels.iter().map(|c| c.key.0);
        for secret in channels.chain([member.setup.secret.0]) {
            let found = |bytes: &[u8]| bytes.windows(32).any(|window| window == secret);
            assert!(!found(&text) && run.log.iter().all(|l| !found(&l.bytes)), "{}", member.node());
        }
        assert!(!String::from_utf8_lossy(&text).contains(&hex), "{}", member.node());
    }
    for (witness, secret) in &run.topology.witnesses {
        let found = |bytes: &[u8]| bytes.windows(32).any(|window| window == secret.0);
        assert!(!found(&text) && run.log.iter().all(|l| !found(&l.bytes)), "{witness}");
    }
    assert!(run.log.iter().any(|l| matches!(
        ground_truth::Entry::decode(&l.bytes).map(|e| e.event),
        Ok(Any::Service(Event::Signed { .. }))
    )));
}

/// Every trial of one cell of `passive_observer`, within its expected classes.
fn observed(cell: &str) -> Vec<Trial> {
    seen_in("telemetry/passive_observer", cell)
}

/// Every trial of one cell of a scenario with an observer, within its expected classes.
fn seen_in(name: &str, cell: &str) -> Vec<Trial> {
    let scenario = scenario::load(&root().join(format!("scenarios/{name}.toml"))).expect("it loads");
    let variation = scenario.variations(None).into_iter().find(|v| v.cell.as_deref() == Some(cell)).expect("a cell");
    let expected = &variation.scenario.expected;
    let trials = SEEDS.map(|seed| stacks::trial(&variation.scenario, seed).expect("it runs"));
    let verdicts =
        trials.inspect(|t| assert!(expected.contains(&t.outcome), "{cell}: {:?} {:?}", t.outcome, t.findings));
    verdicts.collect()
}

#[test]
fn telemetry_observer_reads_only_certificates() {
    for trial in observed("telemetry/path") {
        assert_eq!(trial.findings.len(), 4, "{:?}", trial.findings);
        for what in
            ["the name of gateway", "the name of unit-", "the certificate of gateway", "the certificate of unit-"]
        {
            let text = format!("in the clear: {what}");
            assert!(trial.findings.iter().any(|f| f.starts_with(&text)), "{text}: {:?}", trial.findings);
        }
        assert_eq!((trial.receipt, trial.accepted), (true, 16));
    }
}

#[test]
fn command_observer_reads_only_the_broker_name() {
    for trial in observed("command/path") {
        assert_eq!(trial.findings, ["in the clear: the name of broker"]);
        assert_eq!((trial.receipt, trial.accepted), (true, 16));
    }
}

#[test]
fn unprotected_link_reveals_every_word() {
    let read = |cell: &str, name: &str| {
        let counts = observed(cell).into_iter().map(|t| t.findings.iter().filter(|f| f.contains(name)).count());
        counts.collect::<Vec<_>>()
    };
    for (cell, what, n) in [
        ("telemetry/behind", "read: record ", 16),
        ("telemetry/behind", "read: signed report ", 7),
        ("telemetry/behind", "read: command nonce ", 7),
        ("command/behind", "read: order ", 8),
        ("command/behind", "read: acknowledgement ", 8),
        ("command/behind", "read: reason ", 8),
        ("command/behind", "read: a topic", 1),
    ] {
        assert_eq!(read(cell, what), [n; 3], "{cell}: {what}");
    }
    for cell in ["telemetry/behind", "command/behind"] {
        for what in ["key", "secret"] {
            assert_eq!(read(cell, what), [0; 3], "{cell}: what was not said is not found");
        }
    }
}

#[test]
fn confidential_bus_shows_a_listener_nothing() {
    for trial in seen_in("process/bus_listener", "bus/path") {
        assert_eq!((trial.receipt, trial.accepted, trial.findings), (true, 16, Vec::new()));
    }
    for trial in seen_in("process/bus_listener", "bus/late") {
        assert_eq!((trial.receipt, trial.dropped["time"], trial.findings), (true, 16, Vec::new()));
    }
    for trial in seen_in("process/bus_listener", "bus/behind") {
        let read = |name: &str| trial.findings.iter().filter(|f| f.starts_with(name)).count();
        let counts = ["read: order ", "read: acknowledgement ", "read: reason ", "read: the channel's key"].map(read);
        assert_eq!(counts, [8, 8, 8, 0], "{:?}", trial.findings);
    }
}

/// The library of shared memory changes the file mask of a process while it makes a socket.
#[test]
fn bus_trials_at_once_leave_the_file_mask_alone() {
    let folder = tempfile::tempdir().unwrap();
    let made = |name: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir(&path).unwrap();
        let mode = std::fs::metadata(&path).unwrap().permissions().mode();
        std::fs::remove_dir(path).unwrap();
        mode
    };
    let (before, bool) = (made("before"), AtomicBool::new(false));
    std::thread::scope(|scope| {
        let trials = [(); 3].map(|()| scope.spawn(|| seen_in("process/bus_listener", "bus/path")));
        let reader = scope.spawn(|| {
            let going_on = std::iter::repeat(()).take_while(|()| !bool.load(Ordering::Relaxed));
            going_on.map(|()| made("meanwhile")).filter(|mode| *mode != before).count()
        });
        trials.into_iter().for_each(|trials| assert!(!trials.join().unwrap().is_empty()));
        bool.store(true, Ordering::Relaxed);
        assert_eq!(reader.join().unwrap(), 0, "folders came out with other rights");
    });
    assert_eq!(made("after"), before);
}
