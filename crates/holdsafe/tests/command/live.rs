//! One short live trial: its class, and the replay of its cores' input journals.

use std::fs;
use std::path::Path;

use evidence::Evidence;
use evidence::trial::Outcome;
use ground_truth::{Any, Note};
use link::input_journal::{Entry, Reader, Writer};
use live::child::Services;
use live::trial::{Judged, conclude};
use live::{Aftermath, Options, run};
use parallel::progress::Stop;
use scenario::{Confinement, Hosts, Setup};
use topology::{RunSecret, Topology, lay_out};
use wire::core::Output;
use wire::id::NodeId;
use wire::person::Role;

use super::displays::short;
use super::{lock_machine, root};

/// Trials that a busy host may spoil before one is taken as it is.
pub(super) const TRIES: u64 = 5;

/// The verdict of the verifier for an entry that was handed over late.
pub(super) const LATE: &str = "handed this over";

/// True if the host, and not the platform, explains the findings: the launcher overslept, or a service was kept from
/// running so long that its entries came late to the recording.
fn spoilt(evidence: &Evidence) -> bool {
    let overslept = evidence
        .entries
        .iter()
        .any(|w| matches!(w.entry.event, Any::Instrument(Note::Stalled { by }) if by.0 > evidence.stall_limit));
    overslept || evidence.log_flaws.iter().any(|flaw| flaw.what.contains(LATE))
}

/// The live run of a seed, and its judgement.
fn trial(scenario: &Path, seed: u64) -> (Topology, Setup, Aftermath, Judged) {
    let scenario = scenario::load(scenario).unwrap();
    let setup = Setup::load(&root(), &scenario, None, true).unwrap();
    let secret = RunSecret::seeded(seed);
    let topology = lay_out(&scenario, &setup, seed, &secret).seating(Role::Supervise);
    let (stop, mut show) = (Stop::default(), |_: &str| {});
    let services = Services::Own(env!("CARGO_BIN_EXE_holdsafe").into());
    let options = Options {
        keep: None,
        services,
        stop: &stop,
        show: &mut show,
        window: false,
        role: Role::Supervise,
        acts: Vec::new(),
        confinement: Confinement::Best,
        hosts: Hosts::Loopback,
        shared_kib: sandbox::host::SHARED_KIB,
    };
    let after = run(&topology, &secret, setup.policy.record_guard, options).unwrap();
    let judged = conclude(&topology, &setup, &after);
    (topology, setup, after, judged)
}

/// Writes the input journal of `node` again, with the first input after which it wrote an audit entry fed a microsecond
/// later. Gives the number of that input, from 1.
fn shift_an_input(folder: &Path, node: NodeId) -> usize {
    let path = folder.join("inputs").join(format!("{node}.cbor"));
    let whole = fs::read(&path).unwrap();
    let log = Reader::new(whole.as_slice()).unwrap();
    let header = log.header();
    // Entries from a core's construction come out with its first input.
    let mut entries: Vec<Entry> = log.map(Result::unwrap).collect();
    let is_input = |entry: &Entry| matches!(entry, Entry::Input { .. });
    let is_signed = |entries: &[Entry], at: usize| {
        let mut after = entries[at + 1..].iter().take_while(|entry| !is_input(entry));
        after.any(|entry| matches!(entry, Entry::Output(Output::Audit { .. })))
    };
    let inputs: Vec<usize> = (0..entries.len()).filter(|index| is_input(&entries[*index])).collect();
    let (n, index) = inputs.into_iter().enumerate().skip(1).find(|(_, index)| is_signed(&entries, *index)).unwrap();
    if let Entry::Input { now, .. } = &mut entries[index] {
        now.0 += 1;
    }
    let mut bytes = Vec::new();
    let mut writer = Writer::new(&mut bytes, header, u64::MAX).unwrap();
    entries.iter().for_each(|entry| writer.entry(entry).unwrap());
    fs::write(&path, bytes).unwrap();
    n + 1
}

/// One wrong time in an input journal makes it INVALID.
#[test]
fn short_live_trial_is_nominal_and_replays() {
    let (_folder, scenario) = short();
    let scenario = Path::new(&scenario);
    let _alone = lock_machine();
    let mut tries = (1..=TRIES).map(|seed| trial(scenario, seed));
    let replayed = |judged: &Judged| {
        let wrong: Vec<_> = judged.replays.iter().filter(|core| core.difference.is_some()).collect();
        assert!(wrong.is_empty() && judged.evidence.differences.is_empty(), "{wrong:?}");
        assert!(judged.replays.len() >= 6 && judged.replays.iter().all(|core| core.inputs > 0), "{:?}", judged.replays);
    };
    // On any host every core does again what its log records; the class is checked on a run that the host did not
    // stall.
    let mut last = None;
    for done in tries.by_ref() {
        replayed(&done.3);
        let spoilt = spoilt(&done.3.evidence);
        last = Some((spoilt, done));
        if !spoilt {
            break;
        }
    }
    let (spoilt, (topology, setup, after, judged)) = last.unwrap();
    let Judged { verdict, .. } = &judged;
    if spoilt {
        eprintln!("the host overslept in each of {TRIES} live trials; asserted is that they are INVALID for that");
        assert_eq!(verdict.outcome, Outcome::Invalid, "{:?}", verdict.findings);
    } else {
        assert_eq!((verdict.outcome, verdict.findings.as_slice()), (Outcome::Nominal, &[][..]));
    }

    let input = shift_an_input(after.logs.folder(), NodeId::GATEWAY);
    let Judged { evidence, verdict, .. } = conclude(&topology, &setup, &after);
    assert_eq!(verdict.outcome, Outcome::Invalid, "{:?}", verdict.findings);
    let named = format!("gateway, replayed from its input journal: differs after input {input}, ");
    let found = verdict.findings.iter().find(|f| f.property.row().name == "P10" && f.message.starts_with(&named));
    let found = found.unwrap_or_else(|| panic!("{named}: {:?}", verdict.findings));
    assert!(found.message.contains("expected entry ") && found.message.contains("got entry "), "{found:?}");
    let mut lines = Vec::new();
    recording::events::write_lines(&mut lines, &evidence).unwrap();
    let head: serde_json::Value = serde_json::from_slice(lines.split(|b| *b == b'\n').next().unwrap()).unwrap();
    assert_eq!(head["differences"][0].as_str(), Some(found.message.as_str()), "for the second judge");
}
