//! What the command runs and judges trials with, each function one call. Measuring what they cost is left to `cost`.

use std::path::{Path, PathBuf};

use evidence::custody::{Custodian, Held};
use evidence::log::{Logged, by_recorder};
use evidence::trial::Trial;
use evidence::{Evidence, Verdict, Witnessed};
use lab::leak;
use lab::stages::Delays;
use link::instrument::Frame;
use live::child::Services;
use live::mouths::CoreReplay;
use live::{LiveError, keep};
use oracle::judged;
use parallel::progress::Stop;
use results::mode::Mode;
use scenario::{Scenario, Setup};
use serde::Serialize;
use topology::{RunSecret, cast};
use twin::refeed::{Fed, Refed, Same, fed};
use twin::sabotage::sabotage;
use wire::person::{Act, Role};

use super::checked::Checked;
use super::plan::Planned;

/// The longest `replay.json` that is read.
const MAX_REPLAY_BYTES: u64 = 1 << 20;

/// Why an engine gave no result.
#[derive(Clone, Debug, thiserror::Error)]
pub enum EngineError {
    /// A defect of ours.
    #[error("{0}")]
    Failed(String),
    /// The host lacks something.
    #[error("{0}; `holdsafe doctor` checks what a run needs")]
    Environment(String),
    /// A file of the run cannot be used.
    #[error("{}: {message}; {remedy}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// What is wrong with it, with the line or offset.
        message: String,
        /// What to do.
        remedy: String,
    },
    /// The user stopped it.
    #[error("stopped")]
    Stopped,
}

/// The mouth log of one core fed back into it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MouthReplay {
    /// Core.
    pub core: String,
    /// Inputs fed.
    pub inputs: u64,
    /// Outputs compared.
    pub outputs: u64,
    /// The first output that differs, where one does.
    pub difference: Option<String>,
}

/// What the evidence of a run is worth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verified {
    /// SHA-256 of `held.json`, hexadecimal: the same as when the run was made, or the whole directory may be another's.
    pub held: String,
    /// Files that are covered, each to the last byte.
    pub files: u64,
    /// What is covered by nothing, in a directory of a program that did not cover it.
    pub uncovered: Vec<String>,
    /// Events in the log.
    pub events: u64,
    /// Head of the chain, hexadecimal.
    pub head: String,
    /// Heads held outside the recorder that it was set against.
    pub heads: u64,
    /// Whether the closing seal is there; without it the log is TRUNCATED.
    pub sealed: bool,
    /// What does not hold, each with its position.
    pub findings: Vec<String>,
}

/// Runs one trial.
pub(super) fn trial(
    mode: Mode,
    scenario: &Scenario,
    setup: &Setup,
    seed: u64,
    stop: &Stop,
) -> Result<Trial, EngineError> {
    tracing::debug!(scenario = scenario.name.as_str(), policy = setup.policy_name, seed, "trial");
    match mode {
        Mode::Twin => {
            let (cast, twin) = twin::trial::start(scenario, setup, seed, false).map_err(failed)?;
            let run = twin::trial::conclude(cast, twin, setup);
            let trial = judged::trial(seed, scenario.level(), &run.evidence, &run.verdict);
            let Some(directory) = &setup.run_dir else { return Ok(trial) };
            keep::recording(directory, &run.log).map_err(failed)?;
            keep::events(directory, &run.evidence).map_err(failed)?;
            held(directory, &run.held, trial)
        }
        Mode::Stack => stacks::trial(scenario, seed).map_err(failed),
        Mode::Live => live_trial(scenario, setup, seed, stop, View::of(setup, &mut |_| {})),
    }
}

/// Writes how a trial ended, and last of all `held.json`, which covers every file in `directory`.
fn held(directory: &Path, held: &Held, trial: Trial) -> Result<Trial, EngineError> {
    keep::verdict(directory, &trial).map_err(failed)?;
    let held = keep::held(directory, held).map_err(failed)?;
    Ok(Trial { held: Some(held), ..trial })
}

/// Whether a trial can begin: the services take their setups, and the adversary its plan.
///
/// # Errors
/// The first refusal.
pub(super) fn can_start(scenario: &Scenario, setup: &Setup, seed: u64) -> Result<(), EngineError> {
    match scenario.is_of_stacks() {
        true => Ok(()),
        false => twin::trial::start(scenario, setup, seed, false).map(|_| ()).map_err(failed),
    }
}

/// Sabotages the receipts of one trial in the twin.
pub(super) fn sabotaged(scenario: &Scenario, setup: &Setup, seed: u64) -> Result<Trial, EngineError> {
    let done = sabotage(scenario, setup, seed).map_err(failed)?;
    Ok(judged::trial(seed, scenario.level(), &done.evidence, &done.verdict))
}

/// How a live run is looked at.
pub(super) struct View<'a> {
    /// Takes what the console shows, text by text.
    pub show: &'a mut dyn FnMut(&str),
    /// Whether it has a window besides, until whose end the run lasts.
    pub window: bool,
    /// What a person at the console may do.
    pub role: Role,
    /// What a person does at the console, each at its time of the run, microseconds.
    pub acts: Vec<(u64, Act)>,
}

impl<'a> View<'a> {
    /// The window that the setup asks for.
    fn of(setup: &Setup, show: &'a mut dyn FnMut(&str)) -> Self {
        let role = setup.window.unwrap_or(Role::Supervise);
        Self { window: setup.window.is_some(), role, ..Self::nobody(show) }
    }

    /// Nobody looks, and nobody acts.
    fn nobody(show: &'a mut dyn FnMut(&str)) -> Self {
        Self { show, window: false, role: Role::Supervise, acts: Vec::new() }
    }
}

/// Runs one live trial that somebody looks at.
pub(super) fn watched(
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
    let run = run_live(scenario, setup, seed, stop, view)?;
    if let Some(directory) = &setup.run_dir {
        keep::events(directory, &run.evidence)
            .and_then(|()| keep::replays(directory, &run.replays))
            .and_then(|()| keep::console(directory, &run.cast, &run.evidence.entries))
            .map_err(failed)?;
        // What cannot be thinned stays whole: that costs room and nothing else.
        if let Err(why) = keep::thinned(directory, &run.replays, setup.frames) {
            link::note!("{}: mouth logs stay whole: {why}", directory.display());
        }
    }
    let host_stall_ms = run.spoilt.map(|by| by as f64 / 1000.0);
    let trial = Trial { host_stall_ms, ..judged::trial(seed, scenario.level(), &run.evidence, &run.verdict) };
    match &setup.run_dir {
        Some(directory) => held(directory, &run.held, trial),
        None => Ok(trial),
    }
}

/// Runs one live trial with this program as every service; its logs are kept where the setup says so.
fn run_live(
    scenario: &Scenario,
    setup: &Setup,
    seed: u64,
    stop: &Stop,
    view: View<'_>,
) -> Result<live::trial::Run, EngineError> {
    let program = std::env::current_exe().map_err(failed)?;
    let View { show, window, role, acts } = view;
    let (keep, services) = (setup.run_dir.clone(), Services::Own(program));
    let options = live::Options { keep, services, stop, show, window, role, acts };
    live::trial::run_live(scenario, setup, seed, options).map_err(|error| match error {
        LiveError::Stopped => EngineError::Stopped,
        LiveError::Environment(why) => EngineError::Environment(why),
    })
}

/// Adds the stages of one trial in the twin.
pub(super) fn twin_stages(scenario: &Scenario, setup: &Setup, seed: u64, to: &mut Delays) -> Result<(), EngineError> {
    let (cast, mut twin) = twin::trial::start(scenario, setup, seed, true).map_err(failed)?;
    twin.run_until(cast.duration);
    to.take_twin(&cast, &twin);
    Ok(())
}

/// One trial in the twin as an observer of its links sees it, second by second.
pub(super) fn twin_seconds(scenario: &Scenario, setup: &Setup, seed: u64) -> Result<leak::Run, EngineError> {
    let (cast, mut twin) = twin::trial::start(scenario, setup, seed, true).map_err(failed)?;
    twin.run_until(cast.duration);
    Ok(leak::Run::of_twin(seed, &cast, &twin))
}

/// Adds the stages of one live run.
pub(super) fn live_stages(
    scenario: &Scenario,
    setup: &Setup,
    seed: u64,
    stop: &Stop,
    to: &mut Delays,
) -> Result<(), EngineError> {
    let run = run_live(scenario, setup, seed, stop, View::nobody(&mut |_| {}))?;
    to.take_live(&run.cast, run.logs.folder()).map_err(failed)
}

/// One live run in which a person does this; what was recorded of it.
pub(super) fn live_acts(
    scenario: &Scenario,
    setup: &Setup,
    seed: u64,
    stop: &Stop,
    acts: Vec<(u64, Act)>,
) -> Result<Vec<Witnessed>, EngineError> {
    let run = run_live(scenario, setup, seed, stop, View { acts, ..View::nobody(&mut |_| {}) })?;
    Ok(run.evidence.entries)
}

fn failed(error: impl std::fmt::Display) -> EngineError {
    EngineError::Failed(error.to_string())
}

/// What came of feeding every mouth log of `run` back into its core. That was done right after the run: the keys
/// that the cores sign with are gone since, so no later replay could give the same bytes.
pub(super) fn replay(run: &Checked) -> Result<Vec<MouthReplay>, EngineError> {
    let file = run.path().join("replay.json");
    let unreadable = |message: String| EngineError::Unreadable {
        file: file.clone(),
        message,
        remedy: "name the directory of one live trial, as `run SCENARIO --live --out DIR` makes below DIR/live"
            .to_owned(),
    };
    let text = link::files::read(&file, MAX_REPLAY_BYTES).map_err(|e| unreadable(e.to_string()))?;
    let cores: Vec<CoreReplay> = serde_json::from_slice(&text).map_err(|e| unreadable(e.to_string()))?;
    let told = |r: CoreReplay| MouthReplay {
        core: r.node.to_string(),
        inputs: r.inputs,
        outputs: r.outputs,
        difference: r.difference,
    };
    Ok(cores.into_iter().map(told).collect())
}

/// Feeds it to cores that are set up otherwise, and compares what they decide.
pub(super) fn otherwise(eaten: &Fed, other: &Planned, seed: u64) -> Result<Vec<Refed>, EngineError> {
    let cast = cast(&other.variation.scenario, &other.setup, seed, &RunSecret::seeded(seed));
    eaten.again(&cast, Same::Decisions).map_err(failed)
}

/// A run in the twin with what its cores were fed.
pub(super) fn eaten(planned: &Planned, seed: u64) -> Result<Fed, EngineError> {
    fed(&planned.variation.scenario, &planned.setup, seed).map_err(failed)
}

/// Feeds it to its own cores again.
pub(super) fn again(eaten: &Fed) -> Result<Vec<Refed>, EngineError> {
    eaten.again(eaten.cast(), Same::Bytes).map_err(failed)
}

/// One run in the twin: what the oracle saw, and what it said.
pub(super) fn twin_verdict(scenario: &Scenario, setup: &Setup, seed: u64) -> Result<(Evidence, Verdict), EngineError> {
    let run = concluded(scenario, setup, seed)?;
    Ok((run.evidence, run.verdict))
}

/// One run in the twin to its end.
pub(super) fn concluded(scenario: &Scenario, setup: &Setup, seed: u64) -> Result<twin::trial::Run, EngineError> {
    let (cast, twin) = twin::trial::start(scenario, setup, seed, false).map_err(failed)?;
    Ok(twin::trial::conclude(cast, twin, setup))
}

/// The same with its receipts denied.
pub(super) fn denied(scenario: &Scenario, setup: &Setup, seed: u64) -> Result<(Evidence, Verdict), EngineError> {
    let done = sabotage(scenario, setup, seed).map_err(failed)?;
    Ok((done.evidence, done.verdict))
}

/// The log of a recorded run, and the first thing that does not hold of its chains.
pub(super) fn recorded(run: &Checked) -> Result<(Vec<Witnessed>, Option<String>), EngineError> {
    let frames = frames(run.path())?;
    let log: Vec<Logged> =
        frames.into_iter().map(|f| Logged { at: f.trace_us, node: f.node, bytes: f.bytes }).collect();
    Ok(evidence::reading::read(&log))
}

fn frames(run: &Path) -> Result<Vec<Frame>, EngineError> {
    readable(run)?;
    link::recorded::frames(&run.join("recording")).map_err(|e| not_a_run(run.to_owned(), e.to_string()))
}

fn not_a_run(file: PathBuf, message: String) -> EngineError {
    let remedy = "name the directory of one run, with `recording/` and `held.json` in it".to_owned();
    EngineError::Unreadable { file, message, remedy }
}

/// Checks every file of the run in `run` to the last byte, then chains, seals, signatures and heads, by what is held in the file
/// beside them.
pub(super) fn verify(run: &Path) -> Result<Verified, EngineError> {
    readable(run)?;
    let (held, digest) = keep::read_held(run).map_err(|e| not_a_run(run.join(keep::HELD), e.to_string()))?;
    let differences = held.files.as_ref().map(|files| keep::whole::differences(run, files)).transpose();
    let mut findings = differences.map_err(|e| not_a_run(run.to_owned(), e.to_string()))?.unwrap_or_default();
    let log = match logged(run, held.knows_witnesses()) {
        // Of a file that is another's, or gone, that is said already.
        Err(_) if !findings.is_empty() => Vec::new(),
        log => log?,
    };
    let mut custodian = Custodian::new(&held);
    for Logged { at, node, bytes } in &log {
        // What does not continue its chain is in the custodian's own list.
        let _noted = custodian.take(*at, *node, bytes);
    }
    let custody = custodian.close();
    findings.extend(custody.flaws.iter().map(ToString::to_string));
    Ok(Verified {
        held: digest,
        files: held.files.as_ref().map_or(0, |files| files.len() as u64),
        uncovered: uncovered(&held),
        events: custody.events as u64,
        head: custody.head,
        heads: held.heads.len() as u64,
        sealed: custody.sealed || held.cut_short,
        findings,
    })
}

/// What went by way of the recorder, and behind it, where they sign it, what guards and launcher kept themselves.
fn logged(run: &Path, witnesses: bool) -> Result<Vec<Logged>, EngineError> {
    let frames = frames(run)?.into_iter().filter(|frame| witnesses || by_recorder(frame.node));
    let mut log: Vec<Logged> = frames.map(|f| Logged { at: f.trace_us, node: f.node, bytes: f.bytes }).collect();
    if witnesses {
        log.extend(live::own_logs(run).map_err(|e| not_a_run(run.to_owned(), e.to_string()))?);
    }
    Ok(log)
}

/// What a directory of an earlier program leaves open.
fn uncovered(held: &Held) -> Vec<String> {
    let files = "bytes that are in no entry, and every file but the recording: held.json lists no file";
    let witnesses = "what guards saw and the launcher noted: held.json has no key and no head of theirs";
    let open = [(held.files.is_none(), files), (!held.knows_witnesses(), witnesses)];
    open.into_iter().filter(|(open, _)| *open).map(|(_, what)| what.to_owned()).collect()
}

fn readable(run: &Path) -> Result<(), EngineError> {
    if run.is_dir() {
        return Ok(());
    }
    let message = if run.exists() { "not a run directory" } else { "no such run directory" };
    let remedy = "name the directory that `run --live --out DIR` made".to_owned();
    Err(EngineError::Unreadable { file: run.to_owned(), message: message.to_owned(), remedy })
}
