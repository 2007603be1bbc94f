//! One live trial, from scenario and seed to judged evidence.

use std::io::Read;

use super::mouths::{self, CoreReplay};
use super::{Aftermath, LiveError, Logs, Options, run};
use crate::cast::{Cast, RunSecret, cast};
use crate::custody::{Custodian, Flaw, Held};
use crate::evidence::{Logged, read};
use crate::oracle::{Evidence, Verdict, judge};
use crate::scenario::{Scenario, Setup};

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
    let Aftermath { mut log, custody, held, lost, lasted, logs } =
        run(&cast, &secret, setup.policy.record_guard, options)?;
    log.sort_by_key(|l| l.at);
    let (entries, broken_log) = read(&log);
    let lost = lost.map(|(at, node)| format!("{node} ended by itself at {} ms", at / 1000));
    let evidence = Evidence {
        entries,
        broken_log: broken_log.or(lost),
        custody,
        bounds: setup.bounds,
        planned: cast.planned.clone(),
        duration: lasted,
        stall_limit: super::OVERSLEPT_US,
        operators: cast.operators(),
        script: cast.script.clone(),
        killed: cast.killed(),
    };
    let verdict = judge(&evidence);
    let replays = mouths::replay(&cast, logs.folder());
    Ok(Run { cast, held, evidence, verdict, replays, logs })
}

/// What does not hold of a recording, in the order in which it was kept. One that a living recorder left empty holds nothing.
pub(super) fn custody(recorded: &[Logged], held: &Held) -> Vec<Flaw> {
    let mut custodian = Custodian::new(held);
    for logged in recorded {
        // What does not continue its chain is in the custodian's own list.
        let _noted = custodian.take(logged.at, logged.node, &logged.bytes);
    }
    custodian.close().flaws
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recording_that_a_living_recorder_left_empty_is_flawed() {
        assert!(!custody(&[], &Held::default()).is_empty());
    }
}
