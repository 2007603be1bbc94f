//! Each property of the oracle has been seen to fail: on a log in which it is broken, and only there. Here are the requirements
//! on the log as a whole (P6, P10, the class); each other file has a group of properties, `log` their input.

mod approach;
mod authority;
mod deaths;
mod display;
mod guards;
mod guests;
mod limits;
mod limits_trust;
mod log;
mod masked;
mod missions;
mod orders;
mod plant;
mod receipts;
mod trust;
mod under;

use evidence::trial::Outcome;
use evidence::{Evidence, Under};
use ground_truth::Note;
use oracle::{Property, judge};
use wire::event::{Account, Event, Interface};
use wire::id::NodeId;
use wire::mode::{Cause, Guard, Mode};
use wire::sensor::Camera;
use wire::time::Span;

use log::BOUNDS;
pub(crate) use log::{Log, command};

#[test]
fn a_whole_log_breaks_nothing() {
    let log = Log::whole();
    assert_eq!(log.breaks(), []);
    assert_eq!(log.judge().outcome, Outcome::Nominal);
}

#[test]
fn p6_accounts_that_do_not_add_up() {
    let mut log = Log::whole();
    log.add(9999, NodeId::GATEWAY, Event::Count { account: Account::Received(Interface::Uplink), n: 7 });
    assert_eq!(log.breaks(), [Property::P6]);
    assert_eq!(log.judge().outcome, Outcome::Invalid);
}

#[test]
fn p10_a_broken_log() {
    let log = Log::whole();
    let mut entries = log.entries.clone();
    entries.sort_by_key(|w| w.at);
    let verdict = judge(&Evidence {
        under: Under::A,
        entries,
        broken_log: Some("chain of unit-a broken at entry 9".into()),
        log_flaws: Vec::new(),
        differences: Vec::new(),
        bounds: BOUNDS,
        camera: Camera::GROUND,
        planned: Vec::new(),
        duration: 10_000_000,
        stall_limit: u64::MAX,
        operators: Vec::new(),
        script: evidence::mission::Script::default(),
        route: evidence::progress::Route::default(),
        contacts: config::contact::Contacts::default(),
        killed: Vec::new(),
    });
    assert_eq!(verdict.outcome, Outcome::Invalid);
    assert!(verdict.findings.iter().all(|f| f.property == Property::P10));
}

#[test]
fn p10_core_that_does_not_replay() {
    let name = "gateway, replayed from its input journal, differs after input 7: expected nothing, got an audit entry";
    let evidence = Evidence { differences: vec![name.into()], ..Log::whole().evidence(Vec::new()) };
    let verdict = judge(&evidence);
    assert_eq!(verdict.outcome, Outcome::Invalid);
    let [found] = verdict.findings.as_slice() else { panic!("{:?}", verdict.findings) };
    assert_eq!((found.property, found.message.as_str()), (Property::P10, name));
}

#[test]
fn overslept_host_makes_a_run_inconclusive() {
    let overslept = |duration: u64| {
        let mut log = Log::whole();
        log.add(5000, NodeId::CAMPAIGN, Note::Stalled { by: Span::ms(duration) });
        judge(&Evidence { stall_limit: 50_000, ..log.evidence(Vec::new()) })
    };
    assert_eq!((overslept(50).outcome, overslept(51).outcome), (Outcome::Nominal, Outcome::Invalid));
    let verdict = overslept(51);
    let name = &verdict.findings.last().expect("a finding").message;
    let parts =
        ["overslept by 51 ms", "at most 50 ms", "nothing is said about the platform", "--jobs 1", "--retries 2"];
    assert!(parts.iter().all(|part| name.contains(part)), "{name}");
}

#[test]
fn trip_without_a_fault_is_false() {
    let mut log = Log::whole();
    log.cut_display(5000).transition(5000, Mode::PrepareToAct, Mode::Degraded, Cause::Lost(Guard::Thermal));
    assert_eq!(log.judge().outcome, Outcome::FalseTrip);
}
