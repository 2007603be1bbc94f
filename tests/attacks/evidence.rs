//! What the evidence is worth: receipts that are denied, recordings that somebody had in his hands.

use std::collections::BTreeSet;

use campaign::cast::is_attacked;
use campaign::custody::{Custodian, Custody, Held};
use campaign::evidence::{Logged, by_recorder, heads};
use campaign::sabotage::sabotage;
use campaign::scenario;
use campaign::trial::Outcome;
use campaign::twin::trial::Run;
use holdsafe_tests::{root, shipped, variations};
use wire::event::Event;
use wire::id::NodeId;

use adversary::insider::{InsiderRecorder, Kept};
use adversary::plan::Tampering;

/// Of a process that is only slowed the launcher's word has to do, for it goes on writing (`oracle::receipt`). Where nothing
/// else is injected that word alone is believed.
const BELIEVED: [&str; 1] = ["slow_inference"];

/// N1: what the actors of each shipped scenario claim, in the log of the same trial in which nobody acted.
#[test]
fn of_no_scenario_but_the_slow_one_is_an_injection_believed_that_did_not_happen() {
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
    assert_eq!(believed, BELIEVED, "of {denied}");
    assert!(denied > 60, "{denied}");
}

#[test]
fn a_recording_that_is_edited_reordered_or_cut_is_invalid_and_the_place_is_told() {
    for run in shipped("evidence_tampered").expect(1..9) {
        let first = run.evidence.custody.first().expect("a flaw");
        assert!(first.at > 0, "{first}");
    }
}

#[test]
fn a_recorder_whose_story_holds_together_is_found_out_by_what_it_cannot_sign_and_does_not_hold() {
    for run in shipped("hostile_recorder").expect(1..10) {
        assert!(!run.evidence.custody.is_empty());
    }
}

const ALL: [Tampering; 7] = [
    Tampering::Edit,
    Tampering::Swap,
    Tampering::Delete,
    Tampering::Truncate,
    Tampering::Omit,
    Tampering::Rechain,
    Tampering::CutAtSeal,
];

/// A finished run's recording, and what is held outside the recorder.
fn recorded() -> (Run, Vec<Kept>) {
    let run = shipped("nominal").run(1);
    let kept = run.log.iter().filter(|l| by_recorder(l.node));
    let kept = kept.map(|Logged { at, node, bytes }| Kept { at: *at, node: *node, bytes: bytes.clone() }).collect();
    (run, kept)
}

fn judged(kept: &[Kept], held: &Held) -> Custody {
    let mut custodian = Custodian::new(held);
    for one in kept {
        let _noted = custodian.take(&one.bytes);
    }
    custodian.close()
}

/// Every kind of tampering, each at forty places.
#[test]
fn every_kind_of_tampering_is_found_wherever_it_is_done() {
    let (run, kept) = recorded();
    assert_eq!(judged(&kept, &run.held).flaws, [], "untouched");
    let recorder = run.cast.members.iter().find(|m| m.node() == NodeId::RECORDER).expect("a recorder");
    for does in ALL {
        let mut places = BTreeSet::new();
        for seed in 0..40 {
            let mut hands = kept.clone();
            let place = InsiderRecorder::new(recorder.setup.key(), does, seed).lay_on(&mut hands);
            let custody = judged(&hands, &run.held);
            assert!(!custody.flaws.is_empty(), "{does:?} at {place:?} of {}", kept.len());
            // Bytes that were changed are found where they are, or at the next entry of their chain.
            if matches!(does, Tampering::Edit) {
                assert!(custody.flaws[0].at >= place.expect("a place"), "{does:?}: {}", custody.flaws[0]);
            }
            places.insert(place);
        }
        assert!(places.len() > 5, "{does:?}: {places:?}");
    }
}

/// What each of the two defences behind the chains is worth: with one gone, something gets through that the other found.
#[test]
fn without_signatures_or_without_heads_outside_a_hostile_recorder_gets_through() {
    let (run, kept) = recorded();
    let recorder = run.cast.members.iter().find(|m| m.node() == NodeId::RECORDER).expect("a recorder");
    let after = |does| {
        let mut hands = kept.clone();
        InsiderRecorder::new(recorder.setup.key(), does, 3).lay_on(&mut hands);
        hands
    };
    let headless = Held { heads: Vec::new(), ..run.held.clone() };
    assert_eq!(
        judged(&after(Tampering::CutAtSeal), &headless).flaws,
        [],
        "a run cut at a seal looks like a shorter run"
    );
    let of = |does| judged(&after(does), &headless).flaws;
    for does in [Tampering::Omit, Tampering::Rechain] {
        assert!(of(does)[0].what.contains("sign"), "{does:?}: {:?}", of(does));
    }
}

#[test]
fn a_service_that_the_recorder_leaves_out_altogether_is_missed() {
    let (run, mut kept) = recorded();
    kept.retain(|one| one.node != NodeId::CONSOLE);
    let flaws = judged(&kept, &run.held).flaws;
    assert!(flaws.iter().any(|f| f.what.contains("console wrote")), "{flaws:?}");
    let full = heads(&run.log);
    assert!(full.iter().any(|head| head.node == NodeId::CONSOLE));
}

#[test]
fn no_secret_of_a_run_is_in_what_is_held_of_it_or_in_its_log() {
    let run = shipped("nominal").run(1);
    let text = serde_json::to_vec(&run.held).expect("JSON");
    for member in &run.cast.members {
        let hex: String = member.setup.secret.0.iter().map(|b| format!("{b:02x}")).collect();
        let channels = member.setup.channels.iter().map(|c| c.key.0);
        for secret in channels.chain([member.setup.secret.0]) {
            let found = |bytes: &[u8]| bytes.windows(32).any(|window| window == secret);
            assert!(!found(&text) && run.log.iter().all(|l| !found(&l.bytes)), "{}", member.node());
        }
        assert!(!String::from_utf8_lossy(&text).contains(&hex), "{}", member.node());
    }
    assert!(
        run.log
            .iter()
            .any(|l| matches!(wire::audit::Entry::decode(&l.bytes).map(|e| e.event), Ok(Event::Signed { .. })))
    );
}
