//! Attacks composed in time: steps that wait for a mode, for traffic, for a received message, for each other.

use evidence::Witnessed;
use evidence::trial::Outcome;
use ground_truth::{Action, Any, Note};
use holdsafe_tests::{shipped, with_policy};
use oracle::judge;
use twin::trial::Run;
use wire::event::Event;
use wire::id::NodeId;
use wire::mode::Mode;

use crate::SEEDS;

/// Time at which the step of this name began or ended.
fn step_time(run: &Run, name: &str, begun: bool) -> Option<u64> {
    run.evidence.entries.iter().find_map(|w| match w.entry.event {
        Any::Instrument(Note::Step { step, begun: is }) if step.as_str() == name && is == begun => Some(w.at),
        _ => None,
    })
}

fn first(run: &Run, wanted: Action, node: NodeId) -> Option<u64> {
    run.evidence.entries.iter().find_map(|w| match w.entry.event {
        Any::Instrument(Note::Attack { action, .. }) if action == wanted && w.entry.node == node => Some(w.at),
        _ => None,
    })
}

fn entered(run: &Run, mode: Mode) -> Option<u64> {
    run.evidence.entries.iter().find_map(|w| match w.entry.event {
        Any::Service(Event::Transition { to, .. }) if to == mode && w.entry.node == NodeId::UNIT_A => Some(w.at),
        _ => None,
    })
}

#[test]
fn link_cut_at_arming_holds() {
    for run in shipped("cut_at_arming").expect(SEEDS) {
        let armed = entered(&run, Mode::PrepareToAct).expect("it arms");
        let cut = step_time(&run, "cut", true).expect("the step begins");
        assert!((50_000..60_000).contains(&(cut - armed)), "armed at {armed}, cut at {cut}");
        assert!(first(&run, Action::Drop, NodeId::RELAY_TELEMETRY).is_some_and(|time| time >= cut));
    }
}

/// Time at which the unit's session opened or ended, from `from` on.
fn session(run: &Run, is: bool, from: u64) -> Option<u64> {
    run.evidence.entries.iter().find_map(|w| match w.entry.event {
        Any::Service(Event::Session { open, .. }) if open == is && w.entry.node == NodeId::UNIT_A && w.at >= from => {
            Some(w.at)
        }
        _ => None,
    })
}

/// As live: an end without input for two seconds dials again, and the six flights of that handshake need the path like any
/// datagram.
#[test]
fn cut_session_returns_after_the_cut() {
    /// Lengths of the two ClientHellos.
    const HELLOS: [u16; 2] = [149, 169];
    for run in shipped("cut_at_arming").expect(SEEDS) {
        let (cut, end) =
            (step_time(&run, "cut", true).expect("it begins"), step_time(&run, "cut", false).expect("it ends"));
        let ended = session(&run, false, cut).expect("nothing is heard");
        assert!((1_900_000..2_000_000).contains(&(ended - cut)), "cut at {cut}, ended at {ended}");
        let opened = session(&run, true, ended).expect("it comes back");
        assert!((end..end + 1_200_000).contains(&opened), "over at {end}, opened at {opened}");
        let dropped = |w: &&Witnessed| match w.entry.event {
            Any::Instrument(Note::Attack { action: Action::Drop, length, .. }) => HELLOS.contains(&length),
            _ => false,
        };
        let hellos = run.evidence.entries.iter().filter(dropped).count();
        assert!(hellos >= 8, "{hellos} of a dialler that repeats itself every quarter of a second");
    }
}

#[test]
fn attack_without_its_moment_is_no_evidence() {
    let mut ready = shipped("cut_at_arming");
    ready.scenario.operator = Default::default();
    for seed in SEEDS {
        let run = ready.run(seed);
        assert_eq!(step_time(&run, "cut", true), None);
        assert_eq!(run.verdict.outcome, Outcome::Invalid, "{:?}", run.verdict.transitions);
    }
}

#[test]
fn claimed_step_without_effect_is_no_evidence() {
    let attacked = shipped("cut_at_arming").run(1);
    let mut ready = shipped("cut_at_arming");
    ready.scenario.loss = Default::default();
    let mut quiet = ready.run(1);
    let claims =
        attacked.evidence.entries.iter().filter(|w| matches!(w.entry.event, Any::Instrument(Note::Step { .. })));
    quiet.evidence.entries.extend(claims.copied());
    quiet.evidence.planned = attacked.evidence.planned;
    assert_eq!(judge(&quiet.evidence).outcome, Outcome::Invalid);
}

#[test]
fn storm_cut_and_mute_in_sequence_hold() {
    for run in shipped("storm_then_cut").expect(SEEDS) {
        let step_at =
            |name, begun| step_time(&run, name, begun).unwrap_or_else(|| panic!("{name} {begun} is not told"));
        let (storm, end) = (step_at("storm", true), step_at("storm", false));
        assert!((990_000..1_010_000).contains(&(end - storm)), "200 hellos, 5 ms apart: {storm} to {end}");
        let (cut, mute) = (step_at("cut", true), step_at("mute", true));
        assert!(cut > end && cut - end < 10_000, "the cut waits for the end of the storm");
        assert!((100_000..110_000).contains(&(mute - cut)), "the mute waits for the beginning of the cut");
        let hello = first(&run, Action::Inject, NodeId::RELAY_TELEMETRY).expect("a hello is sent");
        assert!(hello >= storm);
    }
}

/// The report is the first with authority that the insider hears.
#[test]
fn insider_forwards_from_the_first_authority_report() {
    for run in shipped("heard_then_forward").expect(SEEDS) {
        let armed = entered(&run, Mode::PrepareToAct).expect("it arms");
        let began = step_time(&run, "forward", true).expect("the step begins");
        assert!(began > armed && began - armed < 300_000, "a report later: {armed}, {began}");
        assert!(first(&run, Action::Forward, NodeId::INSIDER_B).is_some_and(|time| time >= began));
    }
}

/// Without the moment the same forwarding is the table's; under a boundary that asks who speaks it is refused all the same.
#[test]
fn timing_does_not_defeat_attribution() {
    let ready = with_policy("heard_then_forward", "session-bound");
    for seed in SEEDS {
        assert_eq!(ready.run(seed).verdict.outcome, Outcome::Rejected);
    }
}
