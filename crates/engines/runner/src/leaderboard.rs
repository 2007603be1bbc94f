//! Rows of the leaderboard from trials in the twin: their plan, their run and the inputs that they depend on. `files` has the files of boards and
//! keys.
//!
//! The form of a row, its signature and its checks are the crate `board`'s.

mod files;

use std::collections::BTreeMap;
use std::path::Path;

use board::{Availability, BoardRow, BoardTrial, Contributor, GuestIdentity, Host, Inputs, ProgramIdentity};
use evidence::trial::{Outcomes, Trial};
use guest::{Conduct, Guest};
use parallel::progress::Progress;
use results::mode::Mode;
use scenario::world::Family;
use scenario::{Scenario, Setup};

use super::context::Context;
use super::error::EngineError;
use super::failure::{Exit, Failure};
use super::guest_options::{self, FOLLOWER, LoadedGuest};
use super::plan::{self, Chosen, PlanOptions, Planned, Worlds};
use super::trial_store::TrialStore;
use super::{batch, probe};

pub use files::{create_key, failure, parse, read_key, verified, write};

/// The trials of one row, before they run.
pub struct PlannedRow {
    cell: Option<String>,
    family: Option<Family>,
    seed: u64,
    n: u64,
    built_in: bool,
    /// One variation in the scenario's own scene, or one for each world.
    planned: Vec<Planned>,
}

/// Choice of the trials of a guest.
#[derive(Clone, Copy)]
pub struct Wanted<'a> {
    /// The guest's file, or the built-in one by its name.
    pub guest: &'a Path,
    /// Bare or guarded.
    pub conduct: Conduct,
    /// A platform in place of the scenarios' own.
    pub platform: Option<&'a Chosen>,
    /// Only this cell.
    pub cell: Option<&'a str>,
    /// Drawn worlds in place of the scenarios' own scenes.
    pub family: Option<Family>,
    /// Seed of the first trial, and of the first world.
    pub seed: u64,
    /// Trials of each row.
    pub n: u64,
}

/// The rows of a guest over `scenarios`, one for each cell. The guest has not run yet.
///
/// # Errors
/// The guest's file has a mistake, or a scenario does not fit platform or world.
pub fn entries(context: &Context, wanted: &Wanted<'_>, scenarios: &[Scenario]) -> Result<Vec<PlannedRow>, Failure> {
    if wanted.seed.checked_add(wanted.n).is_none() {
        return Err(Failure::new(
            Exit::Usage,
            format!("--seed {} leaves no seeds for {} trials", wanted.seed, wanted.n),
        ));
    }
    let guest = guest_options::guest(wanted.guest, wanted.conduct)?;
    let mut all = Vec::new();
    for scenario in scenarios {
        all.extend(of_scenario(context, wanted, scenario, &guest)?);
    }
    Ok(all)
}

/// Tests a guest for repeatability, on the first trial of its rows, and marks them.
///
/// # Errors
/// The trial cannot begin.
pub fn probe(entries: &mut [PlannedRow]) -> Result<(), Failure> {
    let Some(seed) = entries.first().map(|entry| entry.seed) else { return Ok(()) };
    probe::probe(entries.iter_mut().flat_map(|entry| &mut entry.planned), seed)
}

fn of_scenario(
    context: &Context,
    wanted: &Wanted<'_>,
    scenario: &Scenario,
    guest: &Guest,
) -> Result<Vec<PlannedRow>, Failure> {
    let options = guest_options::options(wanted.guest, wanted.conduct);
    // A platform that the scenario has anyway leaves its digest as it is.
    let platform = wanted.platform.filter(|chosen| *chosen.name != *scenario.platform.as_str()).cloned();
    let cell = wanted.cell.map(str::to_owned);
    let guest = Some(LoadedGuest { guest: guest.clone(), options });
    let planned =
        plan::of_scenario(context, scenario, &PlanOptions { platform, cell, guest, ..PlanOptions::default() })?;
    let entry = |in_scene: Planned| {
        let cell = in_scene.variation.cell.clone();
        let planned = match wanted.family {
            Some(family) => plan::in_worlds(&in_scene, &Worlds { family, seeds: wanted.seed..wanted.seed + wanted.n })?,
            None => vec![in_scene],
        };
        let Wanted { family, seed, n, .. } = *wanted;
        Ok(PlannedRow { cell, family, seed, n, built_in: wanted.guest == Path::new(FOLLOWER), planned })
    };
    planned.into_iter().map(entry).collect()
}

impl PlannedRow {
    /// Number of trials.
    pub fn trial_count(&self) -> usize {
        self.n as usize
    }

    /// Only the first `n` trials. Digests of inputs still cover all.
    #[must_use]
    pub fn with_trials(self, n: u64) -> Self {
        Self { n: self.n.min(n), ..self }
    }

    /// Runs the trials, in the order of their seeds. One that is in the store is taken from there, one that runs is kept there.
    ///
    /// # Errors
    /// A trial cannot run, or the user asks to stop.
    pub fn run(
        &self,
        context: &Context,
        store: Option<&TrialStore>,
        progress: &Progress,
    ) -> Result<Vec<Trial>, Failure> {
        let shelf = |planned: &Planned| store.map(|store| store.shelf(Mode::Twin, planned)).transpose();
        // Each world has another file, which is open for its trial alone.
        let shared = if self.family.is_none() { self.planned.first().map(shelf).transpose()?.flatten() } else { None };
        let seeds: Vec<u64> = (self.seed..self.seed + self.n).collect();
        parallel::map(parallel::cores(), &seeds, |seed| {
            if context.stop.is_requested() {
                return Err(EngineError::Stopped.into());
            }
            let planned = self.planned(*seed)?;
            let own_shelf = if self.family.is_some() { shelf(planned)? } else { None };
            let shelf = shared.as_ref().or(own_shelf.as_ref());
            let known = shelf.and_then(|shelf| shelf.get(*seed)).cloned();
            let trial = match known {
                Some(trial) => trial,
                None => {
                    let trial = batch::trial(Mode::Twin, planned, &planned.setup, *seed, &context.stop)?;
                    shelf.map_or(Ok(()), |shelf| shelf.put(&trial))?;
                    trial
                }
            };
            batch::count(progress, &trial);
            Ok(trial)
        })
    }

    /// The variation that a seed's trial is of.
    fn planned(&self, seed: u64) -> Result<&Planned, Failure> {
        let index = if self.family.is_some() { (seed - self.seed) as usize } else { 0 };
        self.planned.get(index).ok_or_else(|| Failure::internal("fewer worlds than trials"))
    }

    fn first(&self) -> Result<&Planned, Failure> {
        self.planned.first().ok_or_else(|| Failure::internal("a row without trials"))
    }

    /// SHA-256 of all inputs of the trials beside guest, program and seeds.
    ///
    /// # Errors
    /// An input cannot be written; a defect of ours.
    pub fn inputs(&self) -> Result<Inputs, Failure> {
        let digests = |planned: &Planned| {
            plan::content(&planned.variation.scenario, &Setup { guest: None, ..planned.setup.clone() })
        };
        let content = digests(self.first()?)?;
        let (policy, platform) = (content.policy, content.platform);
        if self.family.is_none() {
            return Ok(Inputs { scenario: content.scenario, policy, platform });
        }
        let each = self.planned.iter().map(|planned| Ok(digests(planned)?.scenario + "\n"));
        let lines = each.collect::<Result<Vec<_>, Failure>>()?.concat();
        Ok(Inputs { scenario: board::digest(lines.as_bytes()), policy, platform })
    }

    /// The row without its trials.
    ///
    /// # Errors
    /// As [`PlannedRow::inputs`].
    pub fn draft(&self, program: ProgramIdentity, contributor: Contributor) -> Result<BoardRow, Failure> {
        let first = self.first()?;
        let guest = first.setup.guest.as_ref().ok_or_else(|| Failure::internal("a row without a guest"))?;
        Ok(BoardRow {
            guest: identity(guest, self.built_in),
            conduct: guest.conduct,
            scenario: first.variation.scenario.name.as_str().to_owned(),
            cell: self.cell.clone(),
            platform: first.setup.platform.name.as_str().to_owned(),
            world: self.family.map(|family| family.name().to_owned()),
            inputs: self.inputs()?,
            seed: self.seed,
            outcomes: Outcomes::new(),
            availability: Availability::default(),
            trials: Vec::new(),
            repeatable: guest.repeatable,
            waived: (!first.setup.policy.is_full()).then(|| first.setup.policy_name.clone()),
            program,
            host: Host {
                target: format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS),
                build: if cfg!(debug_assertions) { "debug" } else { "release" }.to_owned(),
                confined: guest.unconfined.is_none(),
            },
            contributor,
        })
    }
}

/// A drafted row with the results of its trials.
pub fn completed(draft: BoardRow, trials: &[Trial]) -> BoardRow {
    let marks: Vec<BoardTrial> = trials.iter().map(BoardTrial::from).collect();
    BoardRow {
        outcomes: BoardRow::counted(&marks),
        availability: Availability::from_trials(trials),
        trials: marks,
        ..draft
    }
}

/// The guest by its files, with paths from its folder. The built-in guest is a part of the program, whose sources a row names.
fn identity(guest: &Guest, built_in: bool) -> GuestIdentity {
    let program = &guest.program;
    let relative = |path: &String| match Path::new(path).strip_prefix(&program.folder) {
        Ok(below) => below.display().to_string(),
        Err(_) if Path::new(path).is_absolute() => {
            // The folders above are the user's affair.
            format!("../{}", Path::new(path).file_name().unwrap_or_default().to_string_lossy())
        }
        Err(_) => path.clone(),
    };
    let files = program.digests.iter().map(|(path, digest)| (relative(path), digest.clone()));
    GuestIdentity { name: program.name.clone(), files: if built_in { BTreeMap::new() } else { files.collect() } }
}
