//! Rows of the leaderboard from trials in the twin: their plan, their run and what they depend on; and the files of boards and keys.
//!
//! The form of a row, its signature and its checks are the crate `board`'s.

use std::collections::BTreeMap;
use std::fs;
use std::io::{Read, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use board::{
    Availability, Board, BoardError, BoardTrial, Contributor, ContributorKey, GuestIdentity, Host, Inputs,
    MAX_FILE_BYTES, MAX_KEY_BYTES, ProgramIdentity, Row,
};
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

/// The trials of one row, before they run.
pub struct Entry {
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
pub fn entries(context: &Context, wanted: &Wanted<'_>, scenarios: &[Scenario]) -> Result<Vec<Entry>, Failure> {
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
pub fn probe(entries: &mut [Entry]) -> Result<(), Failure> {
    let Some(seed) = entries.first().map(|entry| entry.seed) else { return Ok(()) };
    probe::probe(entries.iter_mut().flat_map(|entry| &mut entry.planned), seed)
}

fn of_scenario(
    context: &Context,
    wanted: &Wanted<'_>,
    scenario: &Scenario,
    guest: &Guest,
) -> Result<Vec<Entry>, Failure> {
    let options = guest_options::options(wanted.guest, wanted.conduct);
    // A platform that the scenario has anyway leaves its digest as it is.
    let platform = wanted.platform.filter(|chosen| *chosen.name != *scenario.platform.as_str()).cloned();
    let cell = wanted.cell.map(str::to_owned);
    let guest = Some(LoadedGuest { guest: guest.clone(), options });
    let planned =
        plan::of_scenario(context, scenario, &PlanOptions { platform, cell, guest, ..PlanOptions::default() })?;
    let entry = |own: Planned| {
        let cell = own.variation.cell.clone();
        let planned = match wanted.family {
            Some(family) => plan::in_worlds(&own, &Worlds { family, seeds: wanted.seed..wanted.seed + wanted.n })?,
            None => vec![own],
        };
        let Wanted { family, seed, n, .. } = *wanted;
        Ok(Entry { cell, family, seed, n, built_in: wanted.guest == Path::new(FOLLOWER), planned })
    };
    planned.into_iter().map(entry).collect()
}

impl Entry {
    /// Number of trials.
    pub fn len(&self) -> usize {
        self.n as usize
    }

    /// Only the first `n` trials. The inputs stay those of all.
    #[must_use]
    pub fn with_trials(self, n: u64) -> Self {
        Self { n: self.n.min(n), ..self }
    }

    /// True without trials.
    pub fn is_empty(&self) -> bool {
        self.n == 0
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
        // A world has a file of its own, which is open for its trial alone.
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
            progress.step();
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

    /// SHA-256 of what the trials depend on beside guest, program and seeds.
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
    /// As [`Entry::inputs`].
    pub fn draft(&self, program: ProgramIdentity, contributor: Contributor) -> Result<Row, Failure> {
        let first = self.first()?;
        let guest = first.setup.guest.as_ref().ok_or_else(|| Failure::internal("a row without a guest"))?;
        Ok(Row {
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
pub fn completed(draft: Row, trials: &[Trial]) -> Row {
    let marks: Vec<BoardTrial> = trials.iter().map(BoardTrial::from).collect();
    Row { outcomes: Row::counted(&marks), availability: Availability::from_trials(trials), trials: marks, ..draft }
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

/// Reads a leaderboard whose form is right. Its rows are not checked.
///
/// # Errors
/// The file cannot be read, or is no leaderboard.
pub fn parse(path: &Path) -> Result<Board, Failure> {
    let unread = |reason: String| Failure::new(Exit::Usage, format!("{}: {reason}", path.display()));
    let bytes = link::files::read(path, MAX_FILE_BYTES).map_err(|e| unread(e.to_string()))?;
    let text = String::from_utf8(bytes).map_err(|_| unread("UTF-8 expected".to_owned()))?;
    Board::parse(&text).map_err(|error| failure(path, &error))
}

/// Reads a leaderboard and checks each row.
///
/// # Errors
/// As [`parse`], or the first row with a fault.
pub fn verified(path: &Path) -> Result<Board, Failure> {
    let board = parse(path)?;
    board.findings().into_iter().next().map_or(Ok(board), |finding| Err(failure(path, &finding.into())))
}

/// The failure of a file by an error of `board`.
pub fn failure(path: &Path, error: &BoardError) -> Failure {
    let exit = match error {
        BoardError::Row(_) => Exit::NoEvidence,
        BoardError::TooLong { .. }
        | BoardError::Head
        | BoardError::Version { .. }
        | BoardError::End
        | BoardError::TooMany { .. }
        | BoardError::Line { .. } => Exit::Usage,
    };
    Failure::new(exit, format!("{}: {error}", path.display()))
}

/// Writes a leaderboard in the place of the one before.
///
/// # Errors
/// The file beside it, which takes its place when it is whole, cannot be written.
pub fn write(path: &Path, board: &Board) -> Result<(), Failure> {
    let mut name = path.as_os_str().to_owned();
    name.push(".new");
    let beside = PathBuf::from(name);
    fs::write(&beside, board.text())?;
    Ok(fs::rename(&beside, path)?)
}

/// Reads a contributor's key.
///
/// # Errors
/// The file cannot be read, others may read it, or it is no key.
pub fn read_key(path: &Path) -> Result<ContributorKey, Failure> {
    let refused = |reason: String| Failure::new(Exit::Usage, format!("{}: {reason}", path.display()));
    let mode = fs::metadata(path).map_err(|e| refused(format!("{e}; `holdsafe guest board key FILE` writes a key")))?;
    if mode.permissions().mode() & 0o077 != 0 {
        return Err(refused(format!("others may read this key; `chmod 600 {}` keeps it", path.display())));
    }
    let bytes = link::files::read(path, MAX_KEY_BYTES).map_err(|e| refused(e.to_string()))?;
    let text = String::from_utf8(bytes).map_err(|_| refused("UTF-8 expected".to_owned()))?;
    ContributorKey::from_pem(&text).map_err(|error| refused(error.to_string()))
}

/// Writes a new key into a new file that its owner alone may read; gives the public half, hexadecimal.
///
/// # Errors
/// There is a file already, or it cannot be written.
pub fn create_key(path: &Path) -> Result<String, Failure> {
    let mut secret = [0; 32];
    fs::File::open("/dev/urandom")?.read_exact(&mut secret)?;
    let key = ContributorKey::from_bytes(&secret);
    let mut file = link::files::create(path).map_err(|e| {
        Failure::new(Exit::Usage, format!("{}: {e}; name a file that is not there yet", path.display()))
    })?;
    file.write_all(key.to_pem().as_bytes())?;
    Ok(key.public())
}
