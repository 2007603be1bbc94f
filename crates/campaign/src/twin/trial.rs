//! One trial in the twin, from scenario and seed to judged evidence.

use super::Twin;
use super::assemble::{AssemblyError, assemble};
use super::queue::Micros;
use super::stopwatch::{Stage, Stopwatch};
use crate::cast::{Cast, RunSecret, cast};
use crate::evidence::{Logged, read};
use crate::oracle::{Evidence, Verdict, judge};
use crate::scenario::{Scenario, Setup};
use wire::sign::Asked;

/// How long what is under way may take to arrive at the end of a run. Longer than any delay a relay imposes in the
/// shipped scenarios; what is still held by a relay then is in its own account.
const GRACE: Micros = 1_500_000;

/// A finished run.
pub struct Run {
    /// Who took part.
    pub cast: Cast,
    /// Everything written to the instrument plane.
    pub log: Vec<Logged>,
    /// What the oracle saw.
    pub evidence: Evidence,
    /// What it said.
    pub verdict: Verdict,
    /// How often a core asked about a signature, and how often one was verified.
    pub signatures: Asked,
    /// The stopwatch of a twin that was watched, still in its last stage.
    pub stopwatch: Option<Stopwatch>,
}

/// Starts the twin of `scenario` at time zero.
pub fn start(scenario: &Scenario, setup: &Setup, seed: u64, mouths: bool) -> Result<(Cast, Twin), AssemblyError> {
    let cast = cast(scenario, setup, seed, &RunSecret::seeded(seed));
    let guard = setup.policy.record_guard;
    let twin = Twin::new(assemble(&cast, seed, guard, mouths)?);
    Ok((cast, twin))
}

/// Runs the twin to its end and judges it.
pub fn conclude(cast: Cast, mut twin: Twin, setup: &Setup) -> Run {
    twin.run_until(cast.duration);
    twin.finish(GRACE);
    let signatures = twin.signatures();
    let (log, mut stopwatch) = twin.into_log();
    if let Some(stopwatch) = &mut stopwatch {
        stopwatch.enter(Stage::Judging);
    }
    let evidence = evidence(&cast, setup, &log);
    let verdict = judge(&evidence);
    Run { cast, log, evidence, verdict, signatures, stopwatch }
}

fn evidence(cast: &Cast, setup: &Setup, log: &[Logged]) -> Evidence {
    let (entries, broken_log) = read(log);
    Evidence {
        entries,
        broken_log,
        bounds: setup.bounds,
        planned: cast.planned.clone(),
        duration: cast.duration,
        stall_limit: Micros::MAX,
        killed: cast.killed(),
    }
}
