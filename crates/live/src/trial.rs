//! One live trial, from scenario and seed to judged evidence.

use std::io::Read;

use super::mouths::{self, CoreReplay};
use super::{Aftermath, LiveError, Logs, Options, run};
use evidence::custody::{Custodian, Custody, Held};
use evidence::log::Logged;
use evidence::reading::read;
use evidence::trial::Outcome;
use evidence::{Evidence, Micros, Verdict};
use oracle::{judge, stalled};
use scenario::{Scenario, Setup};
use topology::{Cast, RunSecret, cast};

/// A finished live run.
pub struct Run {
    /// Who took part.
    pub cast: Cast,
    /// What is held of the recording outside the recorder.
    pub held: Held,
    /// What the oracle saw.
    pub evidence: Evidence,
    /// What it said.
    pub verdict: Verdict,
    /// By how much the host overslept at most, microseconds, where that alone makes the run INVALID.
    pub spoilt: Option<Micros>,
    /// What came of feeding every core its own mouth log again.
    pub replays: Vec<CoreReplay>,
    /// Where its recording and mouth logs are.
    pub logs: Logs,
}

/// Runs and judges one live trial.
pub fn run_live(scenario: &Scenario, setup: &Setup, seed: u64, options: Options<'_>) -> Result<Run, LiveError> {
    let mut secret = [0; 32];
    let random = std::fs::File::open("/dev/urandom").and_then(|mut f| f.read_exact(&mut secret));
    random.map_err(|e| format!("no randomness from the host: {e}"))?;
    let secret = RunSecret::random(secret);
    let cast = cast(scenario, setup, seed, &secret).seating(options.role);
    let after = run(&cast, &secret, setup.policy.record_guard, options)?;
    let Judged { evidence, verdict, spoilt, replays } = conclude(&cast, setup, &after);
    let Aftermath { held, logs, .. } = after;
    Ok(Run { cast, held, evidence, verdict, spoilt, replays, logs })
}

/// What is made of a run that is over.
pub struct Judged {
    /// What the oracle saw.
    pub evidence: Evidence,
    /// What it said.
    pub verdict: Verdict,
    /// By how much the host overslept at most, microseconds, where that alone makes the run INVALID.
    pub spoilt: Option<Micros>,
    /// What came of feeding every core its own mouth log again.
    pub replays: Vec<CoreReplay>,
}

/// Feeds every core of a run that is over its own mouth log again, and judges what the run left. The first is part of what is
/// judged: a live trial whose cores do not replay is no evidence.
pub fn conclude(cast: &Cast, setup: &Setup, after: &Aftermath) -> Judged {
    let replays = mouths::replay(cast, after.logs.folder());
    let (entries, broken_log) = read(&after.log);
    let lost = after.lost.map(|(at, node)| format!("{node} ended by itself at {} ms", at / 1000));
    let evidence = Evidence {
        entries,
        broken_log: broken_log.or(lost),
        custody: after.custody.flaws.clone(),
        differences: replays.iter().filter_map(CoreReplay::told).collect(),
        bounds: setup.bounds,
        planned: cast.planned.clone(),
        duration: after.lasted,
        stall_limit: super::OVERSLEPT_US,
        operators: cast.operators(),
        script: cast.script.clone(),
        killed: cast.killed(),
    };
    let verdict = judge(&evidence);
    let spoilt = spoilt(&evidence, &verdict, after.custody.late);
    Judged { evidence, verdict, spoilt, replays }
}

/// By how much the host overslept, where a run that is INVALID would not be so on a host that had not. Lateness within the
/// recording counts as the host's where the launcher overslept as much; another reason to be INVALID does not.
fn spoilt(evidence: &Evidence, verdict: &Verdict, late: Option<Micros>) -> Option<Micros> {
    let by = stalled(evidence)?;
    let explained = evidence.custody.is_empty() || late.is_some_and(|late| late <= by + evidence.stall_limit);
    if verdict.outcome != Outcome::Invalid || !explained {
        return None;
    }
    let calm = Evidence { custody: Vec::new(), stall_limit: Micros::MAX, ..evidence.clone() };
    (!matches!(judge(&calm).outcome, Outcome::Invalid | Outcome::Unsafe)).then_some(by)
}

/// What came of a recording, in the order in which it was kept. One that a living recorder left empty holds nothing.
pub(super) fn custody(recorded: &[Logged], held: &Held) -> Custody {
    let mut custodian = Custodian::new(held);
    for logged in recorded {
        // What does not continue its chain is in the custodian's own list.
        let _noted = custodian.take(logged.at, logged.node, &logged.bytes);
    }
    custodian.close()
}

#[cfg(test)]
mod tests {
    use super::*;

    use evidence::custody::Flaw;
    use std::path::Path;
    use wire::audit::Entry;
    use wire::event::{Account, Event};
    use wire::id::{Boot, NodeId};
    use wire::time::{Instant, Span};

    /// What a host that overslept by `by` leaves of a run that is NOMINAL on another.
    fn on_a_host_that_overslept(by: u64) -> Evidence {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let scenario = scenario::load(&root.join("scenarios/control/nominal.toml")).unwrap();
        let setup = Setup::load(&root, &scenario, None, false).unwrap();
        let (cast, twin) = twin::trial::start(&scenario, &setup, 1, false).unwrap();
        let mut evidence = twin::trial::conclude(cast, twin, &setup).evidence;
        evidence.stall_limit = crate::OVERSLEPT_US;
        let (at, event) = (evidence.duration, Event::Stalled { by: Span(by) });
        let entry =
            Entry { node: NodeId::CAMPAIGN, boot: Boot(1), counter: 9_999, at: Instant(at), event, previous: [0; 32] };
        evidence.entries.push(evidence::Witnessed { at, entry });
        evidence
    }

    fn found(evidence: &Evidence, late: Option<u64>) -> (Outcome, Option<u64>) {
        let verdict = judge(evidence);
        (verdict.outcome, spoilt(evidence, &verdict, late))
    }

    #[test]
    fn a_run_is_the_hosts_to_spoil_only_where_its_stall_alone_makes_it_invalid() {
        let calm = on_a_host_that_overslept(100_000);
        assert_eq!(found(&calm, None), (Outcome::Nominal, None));
        let stalled = on_a_host_that_overslept(312_000);
        assert_eq!(found(&stalled, None), (Outcome::Invalid, Some(312_000)));
        let mut unbalanced = stalled.clone();
        for w in &mut unbalanced.entries {
            if let Event::Count { account: Account::Datagrams, n } = &mut w.entry.event {
                *n += 1;
            }
        }
        assert_eq!(found(&unbalanced, None), (Outcome::Invalid, None), "the accounts do not balance either");
        let flawed = |evidence: &Evidence| {
            let custody = vec![Flaw { at: 1, what: "something does not hold".to_owned() }];
            Evidence { custody, ..evidence.clone() }
        };
        assert_eq!(found(&flawed(&stalled), None), (Outcome::Invalid, None), "not of lateness alone");
        assert_eq!(found(&flawed(&stalled), Some(312_000)), (Outcome::Invalid, Some(312_000)));
        assert_eq!(found(&flawed(&stalled), Some(500_000)), (Outcome::Invalid, None), "later than the host was");
        assert_eq!(found(&flawed(&calm), Some(99_000)), (Outcome::Invalid, None), "the host was in time");
    }

    #[test]
    fn a_recording_that_a_living_recorder_left_empty_is_flawed() {
        assert!(!custody(&[], &Held::default()).flaws.is_empty());
    }
}
