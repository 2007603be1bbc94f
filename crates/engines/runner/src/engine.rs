//! One trial in any mode, judged; each function is one call. The cost of a trial is measured in `lab`.

use evidence::Evidence;
use evidence::anchors::TrustAnchors;
use evidence::trial::Trial;
use live::child::Services;
use live::trial::STOPPED;
use live::{LiveError, viewer_files};
use oracle::{Verdict, judged};
use parallel::progress::Stop;
use recording::anchors::write_anchors;
use recording::events::write_events;
use recording::replays::{self, CoreReplay};
use recording::verdict::RecordedVerdict;
use recording::write::write_log;
use recording::{Checked, RecordingError, RunFolder};
use results::mode::Mode;
use scenario::{Scenario, Setup};
use serde::Serialize;
use topology::{RunSecret, lay_out};
use twin::replay::{Journalled, ReplayedCore, Same};
use twin::sabotage::sabotage;
use wire::id::NodeId;
use wire::person::{Act, Role};

use super::error::EngineError;
use super::out;
use super::plan::Planned;

/// Replay of one core's input journal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReplayRow {
    /// Core.
    pub core: String,
    /// Inputs replayed.
    pub inputs: u64,
    /// Outputs compared.
    pub outputs: u64,
    /// The first output that differs, where one does.
    pub difference: Option<String>,
}

impl From<CoreReplay> for ReplayRow {
    fn from(CoreReplay { node, inputs, outputs, difference }: CoreReplay) -> Self {
        Self { core: node.to_string(), inputs, outputs, difference }
    }
}

impl From<&ReplayedCore> for ReplayRow {
    /// A core of a run in the twin, in the form of a live run's.
    fn from(replayed: &ReplayedCore) -> Self {
        let difference = replayed.parted.as_ref().map(|p| {
            let difference =
                format!("at {:.3} s, input {}: {:?} in the run, {:?} now", p.at as f64 / 1e6, p.input, p.then, p.now);
            difference.chars().take(400).collect()
        });
        ReplayRow { core: replayed.node.to_string(), inputs: replayed.inputs, outputs: replayed.outputs, difference }
    }
}

/// Runs one trial.
pub fn trial(mode: Mode, scenario: &Scenario, setup: &Setup, seed: u64, stop: &Stop) -> Result<Trial, EngineError> {
    tracing::debug!(scenario = scenario.name.as_str(), policy = setup.policy_name, seed, "trial");
    match mode {
        Mode::Twin => {
            let (topology, mut twin) = twin::trial::start(scenario, setup, seed, false).map_err(EngineError::failed)?;
            if setup.run_dir.is_some() {
                twin.view(NodeId::CONSOLE);
            }
            let run = twin::trial::conclude(topology, twin, setup);
            let trial = judged::trial(seed, scenario.level(), &run.evidence, &run.verdict);
            let Some(folder) = setup.run_dir.as_ref().map(RunFolder::new) else { return Ok(trial) };
            write_log(&folder, &run.log).map_err(EngineError::failed)?;
            write_events(&folder, &run.evidence).map_err(EngineError::failed)?;
            viewer_files::write_display(&folder, &run.topology, &run.evidence.entries, &run.viewed)
                .map_err(EngineError::failed)?;
            close_folder(&folder, &run.anchors, trial)
        }
        Mode::Stack => stacks::trial(scenario, seed).map_err(EngineError::failed),
        Mode::Live => live_trial(scenario, setup, seed, stop, View::from_setup(setup, &mut |_| {})),
    }
}

/// Writes how a trial ended, and last of all the trust anchors, which cover every file in the folder.
fn close_folder(folder: &RunFolder, anchors: &TrustAnchors, trial: Trial) -> Result<Trial, EngineError> {
    RecordedVerdict::from_trial(&trial).write(folder).map_err(EngineError::failed)?;
    let anchors_sha256 = write_anchors(folder, anchors).map_err(EngineError::failed)?;
    Ok(Trial { held: Some(anchors_sha256), ..trial })
}

/// Checks that a trial can begin: the services take their setups, and the adversary its plan.
///
/// # Errors
///
/// The first refusal.
pub fn can_start(scenario: &Scenario, setup: &Setup, seed: u64) -> Result<(), EngineError> {
    match scenario.is_of_stacks() {
        true => Ok(()),
        false => twin::trial::start(scenario, setup, seed, false).map(|_| ()).map_err(EngineError::failed),
    }
}

/// Runs one trial in the twin with sabotaged receipts.
pub fn run_sabotaged(scenario: &Scenario, setup: &Setup, seed: u64) -> Result<Trial, EngineError> {
    let done = sabotage(scenario, setup, seed).map_err(EngineError::failed)?;
    Ok(judged::trial(seed, scenario.level(), &done.evidence, &done.verdict))
}

/// Observation of a live run.
pub struct View<'a> {
    /// Receives the console's display texts.
    pub show: &'a mut dyn FnMut(&str),
    /// True for an additional window; the run lasts until it is closed.
    pub window: bool,
    /// Permissions of a person at the console.
    pub role: Role,
    /// Acts of a person at the console, each at its time of the run, microseconds.
    pub acts: Vec<(u64, Act)>,
}

impl<'a> View<'a> {
    /// The window that the setup requests.
    fn from_setup(setup: &Setup, show: &'a mut dyn FnMut(&str)) -> Self {
        let role = setup.window.unwrap_or(Role::Supervise);
        Self { window: setup.window.is_some(), role, ..Self::unattended(show) }
    }

    /// A view without window and acts.
    pub fn unattended(show: &'a mut dyn FnMut(&str)) -> Self {
        Self { show, window: false, role: Role::Supervise, acts: Vec::new() }
    }
}

/// Runs one observed live trial.
pub fn run_watched(
    scenario: &Scenario,
    setup: &Setup,
    seed: u64,
    stop: &Stop,
    view: View<'_>,
) -> Result<Trial, EngineError> {
    (view.show)(&format!("{}: policy {}, seed {seed}", scenario.title.as_str(), setup.policy_name));
    live_trial(scenario, setup, seed, stop, view)
}

fn live_trial(
    scenario: &Scenario,
    setup: &Setup,
    seed: u64,
    stop: &Stop,
    view: View<'_>,
) -> Result<Trial, EngineError> {
    let run = live_run(scenario, setup, seed, stop, view)?;
    let folder = setup.run_dir.as_ref().map(RunFolder::new);
    if let Some(folder) = &folder {
        write_events(folder, &run.evidence)
            .and_then(|()| replays::write_replays(folder, &run.replays))
            .and_then(|()| viewer_files::write_console(folder, &run.topology, &run.evidence.entries))
            .map_err(EngineError::failed)?;
        // A journal that cannot be thinned stays whole: that costs room only.
        if let Err(error) = replays::thin_journals(folder, &run.replays, setup.frames) {
            out::note(format_args!("{}: input journals stay whole: {error}", folder.path().display()));
        }
    }
    let mut trial = judged::trial(seed, scenario.level(), &run.evidence, &run.verdict);
    trial.host_late_ms = Some(run.late as f64 / 1000.0);
    trial.host_stall_ms = run.spoilt.map(|stall_us| stall_us as f64 / 1000.0);
    trial.confinement = Some(run.levels.summary());
    // The user's wish explains more than what the host did.
    trial.findings.sort_by_key(|finding| !finding.contains(STOPPED));
    let trial = match &folder {
        Some(folder) => close_folder(folder, &run.anchors, trial)?,
        None => trial,
    };
    if !run.stopped {
        return Ok(trial);
    }
    if let (Some(folder), Some(anchors_sha256)) = (&folder, &trial.held) {
        let (ms, place) = (run.evidence.duration / 1000, folder.path().display());
        out::note(format_args!(
            "stopped at {ms} ms; sealed as far as it came: {place}, whose held.json has SHA-256 {anchors_sha256}"
        ));
    }
    Err(EngineError::Stopped)
}

/// Runs one live trial to its end, with this program as every service; its logs are kept if the setup has a folder for them.
pub fn run_live(
    scenario: &Scenario,
    setup: &Setup,
    seed: u64,
    stop: &Stop,
    view: View<'_>,
) -> Result<live::trial::Run, EngineError> {
    let run = live_run(scenario, setup, seed, stop, view)?;
    if run.stopped { Err(EngineError::Stopped) } else { Ok(run) }
}

/// Runs one live trial to its end, or to the request to stop.
fn live_run(
    scenario: &Scenario,
    setup: &Setup,
    seed: u64,
    stop: &Stop,
    view: View<'_>,
) -> Result<live::trial::Run, EngineError> {
    let program = std::env::current_exe().map_err(EngineError::failed)?;
    let View { show, window, role, acts } = view;
    let (keep, services) = (setup.run_dir.clone(), Services::Own(program));
    let (confinement, hosts, shared_kib) = (setup.confinement, setup.hosts, sandbox::host::SHARED_KIB);
    let options = live::Options { keep, services, stop, show, window, role, acts, confinement, hosts, shared_kib };
    live::trial::run_live(scenario, setup, seed, options).map_err(|error| {
        let stopped = matches!(error, LiveError::Stopped);
        if stopped { EngineError::Stopped } else { EngineError::Environment(error.to_string()) }
    })
}

/// Results of replaying every input journal of `run` in its core, done right after the run. The signing keys of the cores are not kept, so no
/// later replay could give the same bytes.
pub fn replay(run: &Checked) -> Result<Vec<ReplayRow>, RecordingError> {
    Ok(replays::read_replays(run)?.into_iter().map(ReplayRow::from).collect())
}

/// Replays the inputs of a run in cores with another setup, and compares their decisions.
pub fn replay_in_other_cores(
    journalled: &Journalled,
    other: &Planned,
    seed: u64,
) -> Result<Vec<ReplayedCore>, EngineError> {
    let topology = lay_out(&other.variation.scenario, &other.setup, seed, &RunSecret::seeded(seed));
    journalled.replay_cores(&topology, Same::Decisions).map_err(EngineError::failed)
}

/// A run in the twin with the inputs of its cores.
pub fn run_journalled(planned: &Planned, seed: u64) -> Result<Journalled, EngineError> {
    twin::replay::journalled(&planned.variation.scenario, &planned.setup, seed).map_err(EngineError::failed)
}

/// Replays the inputs of a run in its own cores.
pub fn replay_in_own_cores(journalled: &Journalled) -> Result<Vec<ReplayedCore>, EngineError> {
    journalled.replay_cores(journalled.topology(), Same::Bytes).map_err(EngineError::failed)
}

/// One run in the twin: the oracle's input, and its verdict.
pub fn twin_verdict(scenario: &Scenario, setup: &Setup, seed: u64) -> Result<(Evidence, Verdict), EngineError> {
    let run = run_twin(scenario, setup, seed)?;
    Ok((run.evidence, run.verdict))
}

/// One run in the twin to its end.
pub fn run_twin(scenario: &Scenario, setup: &Setup, seed: u64) -> Result<twin::trial::Run, EngineError> {
    let (topology, twin) = twin::trial::start(scenario, setup, seed, false).map_err(EngineError::failed)?;
    Ok(twin::trial::conclude(topology, twin, setup))
}

/// One run in the twin with its receipts denied: the oracle's input, and its verdict.
pub fn run_denied(scenario: &Scenario, setup: &Setup, seed: u64) -> Result<(Evidence, Verdict), EngineError> {
    let done = sabotage(scenario, setup, seed).map_err(EngineError::failed)?;
    Ok((done.evidence, done.verdict))
}
