//! Trials that are run to be measured, each function one call.

use evidence::Witnessed;
use parallel::progress::Stop;
use runner::engine::{View, run_live};
use runner::error::EngineError;
use scenario::{Scenario, Setup};
use wire::person::Act;

use crate::leak;
use crate::stages::Delays;

/// Adds the stages of one trial in the twin.
pub fn twin_stages(scenario: &Scenario, setup: &Setup, seed: u64, to: &mut Delays) -> Result<(), EngineError> {
    let (topology, mut twin) = twin::trial::start(scenario, setup, seed, true).map_err(EngineError::failed)?;
    twin.run_until(topology.duration);
    to.take_twin(&topology, &twin);
    Ok(())
}

/// One trial in the twin as an observer of its links sees it, second by second.
pub fn twin_seconds(scenario: &Scenario, setup: &Setup, seed: u64) -> Result<leak::Run, EngineError> {
    let (topology, mut twin) = twin::trial::start(scenario, setup, seed, true).map_err(EngineError::failed)?;
    twin.run_until(topology.duration);
    Ok(leak::Run::of_twin(seed, &topology, &twin))
}

/// Adds the stages of one live run.
pub fn live_stages(
    scenario: &Scenario,
    setup: &Setup,
    seed: u64,
    stop: &Stop,
    to: &mut Delays,
) -> Result<(), EngineError> {
    let run = run_live(scenario, setup, seed, stop, View::unattended(&mut |_| {}))?;
    to.take_live(&run.topology, run.logs.folder()).map_err(EngineError::failed)
}

/// One live run with these acts of a person, and its recording.
pub fn live_acts(
    scenario: &Scenario,
    setup: &Setup,
    seed: u64,
    stop: &Stop,
    acts: Vec<(u64, Act)>,
) -> Result<Vec<Witnessed>, EngineError> {
    let run = run_live(scenario, setup, seed, stop, View { acts, ..View::unattended(&mut |_| {}) })?;
    Ok(run.evidence.entries)
}
