//! One trial in the twin, from scenario and seed to judged evidence.

use std::sync::Arc;

use super::assemble::assemble;
use super::part::baseline::Baseline;
use super::part::make::AssemblyError;
use super::queue::Micros;
use super::stopwatch::{Stopwatch, WorkStage};
use super::verified::SignatureCounts;
use super::{JournalEntry, Twin};
use crate::tamper::tamper;
use evidence::Evidence;
use evidence::anchors::TrustAnchors;
use evidence::log::Logged;
use guest::Guest;
use oracle::{Verdict, judge};
use recording::log::{chain_heads, verify_log};
use scenario::{Scenario, Setup};
use topology::{RunSecret, Topology, lay_out};
use wire::sign::SharedVerifier;

/// Time for which messages under way may take to arrive at the end of a run. Longer than any delay a relay imposes in
/// the shipped scenarios; messages still held by a relay then are in its own account.
pub const GRACE: Micros = 1_500_000;

/// A finished run.
pub struct Run {
    /// Topology of the trial.
    pub topology: Topology,
    /// Everything written to the instrument plane.
    pub log: Vec<Logged>,
    /// Trust anchors of the log outside the recorder.
    pub anchors: TrustAnchors,
    /// Evidence for the oracle.
    pub evidence: Evidence,
    /// Verdict of the oracle.
    pub verdict: Verdict,
    /// Inputs and outputs of the node that is to be viewed, if there is one.
    pub viewed: Vec<JournalEntry>,
    /// Number of signatures that cores asked about, and of those verified.
    pub signatures: SignatureCounts,
    /// The stopwatch of a twin that was watched, still in its last stage.
    pub stopwatch: Option<Stopwatch>,
}

/// Starts the twin of `scenario` at time zero.
pub fn start(scenario: &Scenario, setup: &Setup, seed: u64, journals: bool) -> Result<(Topology, Twin), AssemblyError> {
    let topology = lay_out(scenario, setup, seed, &RunSecret::seeded(seed));
    let twin = begin(&topology, setup, seed, journals)?;
    Ok((topology, twin))
}

/// Starts the twin of a topology at time zero.
pub fn begin(topology: &Topology, setup: &Setup, seed: u64, journals: bool) -> Result<Twin, AssemblyError> {
    let mut assembly = assemble(topology, seed, setup.policy.record_guard, journals, None)?;
    assembly.guest = topology.guest.as_ref().map(Guest::session);
    Ok(Twin::new(assembly))
}

/// Runs the twin of `scenario` and keeps it as a baseline.
pub fn baseline(scenario: &Scenario, setup: &Setup, seed: u64) -> Result<Baseline, AssemblyError> {
    let (topology, twin) = start(scenario, setup, seed, true)?;
    Baseline::record(&topology, twin, GRACE)
}

/// Starts the twin of `scenario` at time zero, each core along with `baseline` for as long as it is fed the same. Only
/// the time that it takes depends on that.
pub fn start_following(
    scenario: &Scenario,
    setup: &Setup,
    seed: u64,
    baseline: &Arc<Baseline>,
) -> Result<(Topology, Twin), AssemblyError> {
    let topology = lay_out(scenario, setup, seed, &RunSecret::seeded(seed));
    let twin = Twin::new(assemble(&topology, seed, setup.policy.record_guard, false, Some(baseline))?);
    Ok((topology, twin))
}

/// Runs the twin to its end and judges it.
pub fn conclude(topology: Topology, mut twin: Twin, setup: &Setup) -> Run {
    twin.run_until(topology.duration);
    twin.finish(GRACE);
    let (signatures, verifier) = (twin.signatures(), twin.verified().shared());
    let (cut_short, viewed) = (twin.cut_short(), twin.take_viewed());
    let (mut log, mut stopwatch) = twin.into_log();
    if let Some(stopwatch) = &mut stopwatch {
        stopwatch.enter(WorkStage::Judging);
    }
    let anchors = TrustAnchors { heads: chain_heads(&log), cut_short, ..topology.trust_anchors(None) };
    if let Some(hands) = topology.hands() {
        tamper(&hands, &mut log);
    }
    let mut evidence = evidence(&topology, setup, &log, &anchors, verifier);
    if cut_short {
        // As live: read from what the guards of the others saw, and no recording to hold against anything.
        evidence.log_flaws.clear();
    }
    let verdict = judge(&evidence);
    Run { topology, log, anchors, evidence, verdict, viewed, signatures, stopwatch }
}

fn evidence(
    topology: &Topology,
    setup: &Setup,
    log: &[Logged],
    anchors: &TrustAnchors,
    verifier: SharedVerifier,
) -> Evidence {
    let (entries, broken_log, verification) = verify_log(log, anchors, verifier);
    Evidence {
        under: topology.under,
        entries,
        broken_log: topology.detector_faults().or(broken_log),
        log_flaws: verification.flaws,
        differences: Vec::new(),
        bounds: setup.bounds,
        camera: setup.platform.sensors().camera,
        planned: topology.planned.clone(),
        duration: topology.duration,
        stall_limit: Micros::MAX,
        operators: topology.operators(),
        script: topology.script.clone(),
        route: topology.route(),
        contacts: topology.contacts.clone(),
        killed: topology.killed(),
    }
}
