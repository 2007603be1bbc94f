//! One live trial, from scenario and seed to judged evidence.

use std::io::Read;

use super::hosts::Levels;
use super::journals;
use super::{Aftermath, LiveError, Logs, Options, run};
use evidence::anchors::TrustAnchors;
use evidence::trial::Outcome;
use evidence::{Evidence, Micros};
use oracle::{Verdict, judge, stalled};
use recording::RunFolder;
use recording::log::read_log;
use recording::replays::CoreReplay;
use scenario::{Scenario, Setup};
use topology::{RunSecret, Topology, lay_out};

/// Reason for which a run that the user stopped is INVALID.
pub const STOPPED: &str = "stopped by the user";

/// A finished live run.
pub struct Run {
    /// The participants.
    pub topology: Topology,
    /// Trust anchors held outside the recorder.
    pub anchors: TrustAnchors,
    /// The oracle's input.
    pub evidence: Evidence,
    /// Its verdict.
    pub verdict: Verdict,
    /// Most that the host overslept or kept a service waiting for a core, microseconds, where that alone makes the run INVALID.
    pub spoilt: Option<Micros>,
    /// Most that the host overslept or kept a service waiting for a core, microseconds.
    pub late: Micros,
    /// Results of replaying every core's input journal.
    pub replays: Vec<CoreReplay>,
    /// Levels of confinement that its services reached.
    pub levels: Levels,
    /// True if the user stopped it before its end: it is INVALID, and its files are complete up to there.
    pub stopped: bool,
    /// Folder of its recording and input journals.
    pub logs: Logs,
}

/// Runs and judges one live trial.
pub fn run_live(scenario: &Scenario, setup: &Setup, seed: u64, options: Options<'_>) -> Result<Run, LiveError> {
    let mut secret = [0; 32];
    let random = std::fs::File::open("/dev/urandom").and_then(|mut f| f.read_exact(&mut secret));
    random.map_err(LiveError::Randomness)?;
    let secret = RunSecret::random(secret);
    let topology = lay_out(scenario, setup, seed, &secret).seating(options.role);
    let after = run(&topology, &secret, setup.policy.record_guard, options)?;
    let Judged { evidence, verdict, spoilt, replays } = conclude(&topology, setup, &after);
    let Aftermath { anchors, levels, stopped, logs, overslept, waited, .. } = after;
    let late = overslept.max(waited);
    Ok(Run { topology, anchors, evidence, verdict, spoilt, late, replays, levels, stopped, logs })
}

/// Judgement of a finished run.
pub struct Judged {
    /// The oracle's input.
    pub evidence: Evidence,
    /// Its verdict.
    pub verdict: Verdict,
    /// Most that the host overslept or kept a service waiting for a core, microseconds, where that alone makes the run INVALID.
    pub spoilt: Option<Micros>,
    /// Results of replaying every core's input journal.
    pub replays: Vec<CoreReplay>,
}

/// Replays every core's input journal of a finished run, and judges the run's records. The replay is part of the judgement: a live trial with
/// cores that do not replay is no evidence.
pub fn conclude(topology: &Topology, setup: &Setup, after: &Aftermath) -> Judged {
    let replays = journals::replay(topology, &RunFolder::new(after.logs.folder()));
    let (entries, broken_log) = read_log(&after.log);
    let lost = after.lost.map(|lost| lost.to_string());
    let stopped = || format!("{STOPPED} at {} of {} ms", after.lasted / 1000, topology.duration / 1000);
    let stopped = after.stopped.then(stopped);
    let evidence = Evidence {
        under: topology.under,
        entries,
        broken_log: stopped.or(topology.detector_faults()).or(broken_log).or(lost),
        log_flaws: after.verification.flaws.clone(),
        differences: replays.iter().filter_map(CoreReplay::named_difference).collect(),
        bounds: setup.bounds,
        camera: setup.platform.sensors().camera,
        planned: topology.planned.clone(),
        duration: after.lasted,
        stall_limit: super::OVERSLEPT_US,
        operators: topology.operators(),
        script: topology.script.clone(),
        route: topology.route(),
        contacts: topology.contacts.clone(),
        killed: topology.killed(),
    };
    let verdict = judge(&evidence);
    let spoilt = spoilt(&evidence, &verdict, after.verification.late, after.waited).filter(|_| !after.stopped);
    Judged { evidence, verdict, spoilt, replays }
}

/// The stall of the host, asleep or by keeping a service waiting for a core, without which an INVALID run would not be INVALID. Lateness
/// within the recording counts as the host's where the stall was as long; another reason to be INVALID does not.
fn spoilt(evidence: &Evidence, verdict: &Verdict, late: Option<Micros>, waited: Micros) -> Option<Micros> {
    let stall = stalled(evidence).max((waited > evidence.stall_limit).then_some(waited))?;
    let explained = evidence.log_flaws.is_empty() || late.is_some_and(|late| late <= stall + evidence.stall_limit);
    if verdict.outcome != Outcome::Invalid || !explained {
        return None;
    }
    let calm = Evidence { log_flaws: Vec::new(), stall_limit: Micros::MAX, ..evidence.clone() };
    (!matches!(judge(&calm).outcome, Outcome::Invalid | Outcome::Unsafe)).then_some(stall)
}

#[cfg(test)]
mod tests {
    use super::*;

    use evidence::Flaw;
    use ground_truth::{Any, Entry, Note};
    use std::path::Path;
    use wire::event::{Account, Event};
    use wire::id::{Boot, NodeId};
    use wire::time::{Instant, Span};

    /// Evidence of a run that is NOMINAL, but for a host that overslept by `stall`.
    fn evidence_of_stalled_host(stall: u64) -> Evidence {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..");
        let scenario = scenario::load(&root.join("scenarios/control/nominal.toml")).unwrap();
        let setup = Setup::load(&root, &scenario, None, false).unwrap();
        let (topology, twin) = twin::trial::start(&scenario, &setup, 1, false).unwrap();
        let mut evidence = twin::trial::conclude(topology, twin, &setup).evidence;
        evidence.stall_limit = crate::OVERSLEPT_US;
        let (time, event) = (evidence.duration, Any::Instrument(Note::Stalled { by: Span(stall) }));
        let entry = Entry {
            node: NodeId::CAMPAIGN,
            boot: Boot(1),
            counter: 9_999,
            at: Instant(time),
            event,
            previous: [0; 32],
        };
        evidence.entries.push(evidence::Witnessed { at: time, entry });
        evidence
    }

    fn found(evidence: &Evidence, late: Option<u64>) -> (Outcome, Option<u64>) {
        let verdict = judge(evidence);
        (verdict.outcome, spoilt(evidence, &verdict, late, 0))
    }

    #[test]
    fn host_stall_alone_spoils_a_run() {
        let calm = evidence_of_stalled_host(100_000);
        assert_eq!(found(&calm, None), (Outcome::Nominal, None));
        let stalled = evidence_of_stalled_host(312_000);
        assert_eq!(found(&stalled, None), (Outcome::Invalid, Some(312_000)));
        let mut unbalanced = stalled.clone();
        for w in &mut unbalanced.entries {
            if let Any::Service(Event::Count { account: Account::Datagrams, n }) = &mut w.entry.event {
                *n += 1;
            }
        }
        assert_eq!(found(&unbalanced, None), (Outcome::Invalid, None), "the accounts do not balance either");
        let flawed = |evidence: &Evidence| {
            let verification = vec![Flaw { at: 1, what: "something does not hold".to_owned() }];
            Evidence { log_flaws: verification, ..evidence.clone() }
        };
        assert_eq!(found(&flawed(&stalled), None), (Outcome::Invalid, None), "not of lateness alone");
        assert_eq!(found(&flawed(&stalled), Some(312_000)), (Outcome::Invalid, Some(312_000)));
        assert_eq!(found(&flawed(&stalled), Some(500_000)), (Outcome::Invalid, None), "later than the host was");
        assert_eq!(found(&flawed(&calm), Some(99_000)), (Outcome::Invalid, None), "the host was in time");
        let late = flawed(&calm);
        let waited = |late_us, waited_us| spoilt(&late, &judge(&late), Some(late_us), waited_us);
        assert_eq!(waited(150_000, 120_000), Some(120_000), "a service waited for a core");
        assert_eq!(waited(150_000, 90_000), None, "no longer than is allowed");
        assert_eq!(waited(400_000, 120_000), None, "later than the wait explains");
    }
}
