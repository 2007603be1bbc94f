//! Preparation of trials from names on the command line: the file of a scenario, its variations and their setups.

use std::path::{Path, PathBuf};

use evidence::log::hex;
use results::campaign::InputDigest;
use results::mode::Mode;
use scenario::world::{self, Body, Family, Kind};
use scenario::{Hosts, Scenario, SettingsError, Setup, Variation, load_platform};
use sha2::{Digest, Sha256};
use topology::{is_attacked, needs_rendering};

use super::Context;
use super::custom_detector::LoadedDetector;
use super::failure::{Exit, Failure};
use super::guest_options::LoadedGuest;
use super::quoted;

/// Remedy for a name that is near to no scenario's.
const LIST: &str = "`holdsafe scenario list` prints the shipped ones";

/// One variation of a scenario, ready to run.
#[derive(Clone, Debug)]
pub struct Planned {
    /// The variation to run.
    pub variation: Variation,
    /// Its setup.
    pub setup: Setup,
    /// The options beyond scenario and seed that reproduce it.
    pub options: String,
    /// The command line that reproduces it, without the seed, where the verb is not `run`.
    pub command: Option<String>,
    /// Actors do not act, and claim that they did.
    pub sabotage: bool,
}

impl Planned {
    /// Its mode when it does not run live.
    pub fn mode(&self) -> Mode {
        if self.variation.scenario.is_of_stacks() { Mode::Stack } else { Mode::Twin }
    }

    /// The inputs of its trials' outcome beside program, mode and seed.
    pub fn content(&self) -> Result<InputDigest, Failure> {
        content(&self.variation.scenario, &self.setup)
    }
}

/// The inputs of a trial's outcome beside program, mode and seed.
///
/// # Errors
/// When one cannot be written; a defect of ours.
pub fn content(scenario: &Scenario, setup: &Setup) -> Result<InputDigest, Failure> {
    let unwritable = |e: serde_json::Error| Failure::new(Exit::Internal, e.to_string());
    Ok(InputDigest {
        scenario: hex(&Sha256::digest(serde_json::to_string(scenario).map_err(unwritable)?)),
        policy: hex(&Sha256::digest(serde_json::to_string(&setup.policy).map_err(unwritable)?)),
        platform: hex(&Sha256::digest(platform(setup))),
    })
}

/// A platform as the user named it, and its file.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// Name or path on the command line.
    pub name: String,
    /// Its file.
    pub file: PathBuf,
}

/// Drawn worlds in place of the scenario's own: one of the family for each seed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Worlds {
    /// Their family.
    pub family: Family,
    /// Their seeds.
    pub seeds: std::ops::Range<u64>,
}

/// Options for every scenario of a plan.
#[derive(Clone, Debug, Default)]
pub struct PlanOptions {
    /// A policy file in place of the scenario's own.
    pub policy: Option<PathBuf>,
    /// A platform in place of the scenario's own.
    pub platform: Option<Chosen>,
    /// Only this cell.
    pub cell: Option<String>,
    /// Worlds in which each variation runs.
    pub worlds: Option<Worlds>,
    /// Rendered sensors and the detector.
    pub rendered: bool,
    /// Rendered sensors only where the shipped networks were trained for the platform's views, as in a live run without `--rendered`.
    pub where_trained: bool,
    /// Another detector than the shipped one; sensors are then rendered.
    pub detector: Option<LoadedDetector>,
    /// Actors do not act, and claim that they did.
    pub sabotage: bool,
    /// A guest in place of the unit's mission and navigation.
    pub guest: Option<LoadedGuest>,
}

/// True if a scenario is given by its file, and not by the name of a shipped one.
pub fn is_path(name: &str) -> bool {
    name.ends_with(".toml") || name.contains('/')
}

/// The files of all shipped scenarios: of the reference evaluation, rendered ones, those for showing and honest faults.
pub fn shipped_files(root: &Path) -> Result<Vec<PathBuf>, Failure> {
    Ok([scenario::shipped(root)?, scenario::rendered(root)?, scenario::demo(root)?, scenario::honest(root)?].concat())
}

/// The file of a scenario given by name or by path.
///
/// # Errors
/// A name that no scenario has, with the nearest one; a file that by its ending is no scenario.
pub fn file_of(context: &Context, name: &str) -> Result<PathBuf, Failure> {
    let path = Path::new(name);
    let missing = |reason: &str| Failure::new(Exit::Usage, format!("`{name}` {reason}; {LIST}"));
    if path.extension().is_some_and(|ending| ending != "toml") && path.exists() {
        return Err(missing("is no scenario: a scenario's file ends in .toml"));
    }
    if is_path(name) {
        return Ok(path.to_owned());
    }
    let root = context.root()?;
    if let Some(file) = scenario::find(&root, name) {
        return Ok(file);
    }
    if path.is_dir() {
        return Err(missing("is a folder"));
    }
    Err(unknown("scenario", name, &shipped_files(&root)?, &format!("{LIST}.")))
}

/// The platform given by name or by path.
///
/// # Errors
/// A name that no platform has, with the nearest one, or all.
pub fn platform_of(context: &Context, name: &str) -> Result<Chosen, Failure> {
    let chosen = |file| Chosen { name: name.to_owned(), file };
    if is_path(name) {
        return Ok(chosen(PathBuf::from(name)));
    }
    let root = context.root()?;
    let path = root.join("platforms").join(format!("{name}.toml"));
    if path.is_file() {
        return Ok(chosen(path));
    }
    let files = scenario::platform_files(&root)?;
    let all: Vec<String> = files.iter().map(|file| stem(file)).collect();
    Err(unknown("platform", name, &files, &format!("there are: {}.", all.join(", "))))
}

/// Failure for a name that no file has: with the nearest name, else with `all`, the way to list them.
fn unknown(kind: &str, name: &str, files: &[PathBuf], all: &str) -> Failure {
    let known: Vec<String> = files.iter().map(|file| stem(file)).collect();
    let hint = match scenario::closest(name, known.iter().map(String::as_str)) {
        Some(nearest) => format!("did you mean `{nearest}`?"),
        None => all.to_owned(),
    };
    Failure::new(Exit::Usage, format!("no {kind} `{name}`; {hint} A file is named by its path, ending in .toml"))
}

/// Loads a scenario and prepares its variations.
pub fn plan(context: &Context, file: &Path, options: &PlanOptions) -> Result<(Scenario, Vec<Planned>), Failure> {
    let scenario = context.scenario(file)?;
    let planned = of_scenario(context, &scenario, options)?;
    Ok((scenario, planned))
}

/// Every variation of every shipped scenario that runs in the twin.
pub fn plan_shipped(context: &Context) -> Result<Vec<Planned>, Failure> {
    let mut all = Vec::new();
    for file in scenario::shipped(&context.root()?)? {
        let (scenario, planned) = plan(context, &file, &PlanOptions::default())?;
        all.extend(planned.into_iter().filter(|_| !scenario.is_of_stacks()));
    }
    Ok(all)
}

/// Prepares the variations of a loaded scenario.
pub fn of_scenario(context: &Context, scenario: &Scenario, options: &PlanOptions) -> Result<Vec<Planned>, Failure> {
    let policy = options.policy.as_deref().map(stem);
    let platform = options.platform.as_ref().map(|chosen| on_platform(scenario, chosen));
    let scenario = &platform.transpose()?.unwrap_or_else(|| scenario.clone());
    let mut variations = scenario.variations(policy.as_deref());
    if let Some(cell) = &options.cell {
        variations.retain(|v| v.cell.as_ref() == Some(cell));
    }
    if variations.is_empty() {
        let labels: Vec<String> = scenario.cell.iter().map(|c| c.name.as_str().to_owned()).collect();
        let name = scenario.name.as_str();
        let message = match labels.is_empty() {
            true => format!("`{name}` has no cells; leave --cell out"),
            false => format!("no cell of `{name}` fits; there are: {}", labels.join(", ")),
        };
        return Err(Failure::new(Exit::Usage, message));
    }
    let planned: Result<Vec<Planned>, Failure> =
        variations.into_iter().map(|variation| prepare(context, variation, options)).collect();
    let Some(worlds) = &options.worlds else { return planned };
    Ok(planned?.iter().map(|planned| in_worlds(planned, worlds)).collect::<Result<Vec<_>, _>>()?.concat())
}

/// A variation in each drawn world, as a cell for each.
///
/// # Errors
/// The family is for another kind of body, the scenario has no meaning there, or no fair world was drawn.
pub fn in_worlds(planned: &Planned, worlds: &Worlds) -> Result<Vec<Planned>, Failure> {
    let (Variation { cell, scenario }, family) = (&planned.variation, worlds.family);
    let platform = &planned.setup.platform;
    family
        .check_for(platform)
        .map_err(|e| Failure::new(Exit::Usage, format!("{e}; name another family or leave out --world")))?;
    let body = Body::from_platform(platform);
    let drawn = |seed| {
        let scene = world::draw(family, seed, &body).map_err(|e| Failure::new(Exit::Usage, e.to_string()))?;
        let placed = match Kind::from_platform(platform) {
            Kind::Satellite => scenario.in_pass(scene, world::stations(seed, platform), seed),
            Kind::Wheels | Kind::Rotors | Kind::Wing => scenario.in_world(scene, seed),
        };
        let scenario = placed.map_err(|e| {
            let name = scenario.name.as_str();
            Failure::new(Exit::Usage, format!("`{name}` is in no drawn world: {e}; leave out --world"))
        })?;
        let world = format!("{}:{seed}", family.name());
        let options = format!("{} --world {world}", planned.options);
        let cell = cell.iter().cloned().chain([world]).collect::<Vec<_>>().join("/");
        Ok(Planned { variation: Variation { cell: Some(cell), scenario }, options, ..planned.clone() })
    };
    worlds.seeds.clone().map(drawn).collect()
}

/// The scenario on a platform; reports when neither states the expected classes.
fn on_platform(scenario: &Scenario, chosen: &Chosen) -> Result<Scenario, Failure> {
    let platform = load_platform(&chosen.file)?;
    let on = scenario.on_platform(&platform);
    if scenario.states_no_class_on(&platform) {
        let (platform, name) = (&chosen.name, scenario.name.as_str());
        link::note!(
            "`{platform}` owes no class of `{name}`, and the scenario states none for it: FALSE_TRIP, LATE and UNSAFE are unexpected, and what \
             else comes is told and not judged"
        );
    }
    Ok(on)
}

/// Gives a variation its policy, bounds and platform.
pub fn prepare(context: &Context, variation: Variation, options: &PlanOptions) -> Result<Planned, Failure> {
    let variation = if options.sabotage {
        if !is_attacked(&variation.scenario) {
            let message = format!("`{}` has no injection with a receipt to deny", variation.scenario.name.as_str());
            return Err(Failure::new(Exit::Usage, message));
        }
        Variation { scenario: variation.scenario.sabotaged(), ..variation }
    } else {
        variation
    };
    let rendered = options.rendered || options.detector.is_some();
    if options.guest.is_some() && variation.scenario.is_of_stacks() {
        let message = format!(
            "`{}` runs on the real stacks, where nothing drives; a guest has no part in it",
            variation.scenario.name.as_str()
        );
        return Err(Failure::new(Exit::Usage, message));
    }
    check_bus(&variation.scenario, options.guest.as_ref())?;
    let root = context.root()?;
    let policy = options.policy.as_deref().map(|path| find_policy(&root, path));
    let policy = policy.as_deref();
    let mut setup = match &options.platform {
        Some(chosen) => Setup::load_on(&root, &variation.scenario, &chosen.file, policy, rendered)?,
        None => Setup::load(&root, &variation.scenario, policy, rendered)?,
    };
    if options.rendered && !options.where_trained && !setup.platform.has_camera() {
        let message = format!("`{}` has no camera: leave out --rendered", setup.platform.name.as_str());
        return Err(Failure::new(Exit::Usage, message));
    }
    setup.rendered &= !options.where_trained || setup.platform.is_trained_for();
    if let Some(reason) = needs_rendering(&variation.scenario).filter(|_| !setup.rendered) {
        let message = format!("`{}`: {reason}; run it with --rendered, or live", variation.scenario.name.as_str());
        return Err(Failure::new(Exit::Usage, message));
    }
    setup.detector = options.detector.as_ref().map(|loaded| loaded.brought.clone());
    setup.guest = options.guest.as_ref().map(|engaged| engaged.guest.clone());
    setup.stop = context.stop.clone();
    let sabotage = options.sabotage;
    let options = command_line(options, variation.cell.as_deref());
    Ok(Planned { variation, setup, options, command: None, sabotage })
}

/// An attack on a guest's bus needs a guest that offers it.
fn check_bus(scenario: &Scenario, loaded: Option<&LoadedGuest>) -> Result<(), Failure> {
    let offered = loaded.map_or(&[][..], |loaded| &loaded.guest.program.bus);
    let missing = scenario.guest_bus.iter().map(|table| table.attack).find(|attack| !offered.contains(attack));
    let Some(attack) = missing else { return Ok(()) };
    let (name, attack) = (scenario.name.as_str(), attack.name());
    let message = match loaded {
        Some(loaded) => format!(
            "`{name}` has the attack `{attack}` on the guest's own bus, which `{}` does not offer: its file has no `bus` with it",
            loaded.guest.program.name
        ),
        None => format!(
            "`{name}` has the attack `{attack}` on a guest's own bus: name a guest whose file offers it, such as \
             --autonomy guests/ros2/guest.toml"
        ),
    };
    Err(Failure::new(Exit::Usage, message))
}

/// A policy file by its path from the current directory, or, where that is missing, by the same path below the root.
fn find_policy(root: &Path, path: &Path) -> PathBuf {
    let below = root.join(path);
    if !path.exists() && below.exists() { below } else { path.to_owned() }
}

/// A variation under another policy in place of the one that its scenario or cell names.
pub fn with_policy(context: &Context, planned: &Planned, policy: &Path) -> Result<Planned, Failure> {
    let options = PlanOptions { policy: Some(policy.to_owned()), ..PlanOptions::default() };
    prepare(context, planned.variation.clone(), &options)
}

/// Bounds, platform, sensing, guest and networks, in words that are hashed. A run with the shipped detector, without a guest and on one
/// loopback interface keeps its words.
fn platform(setup: &Setup) -> String {
    let words = format!("{:?} {:?} {}", setup.bounds, setup.platform, setup.rendered);
    let words = match &setup.detector {
        Some(brought) => format!("{words} {} {:?}", brought.model.sha256, brought.head),
        None => words,
    };
    let words = match &setup.guest {
        Some(guest) => format!("{words} {} {:?}", guest.conduct.name(), guest.program.digests),
        None => words,
    };
    let words = match setup.hosts {
        Hosts::Loopback => words,
        Hosts::Namespaces => format!("{words} hosts in namespaces"),
    };
    match &setup.misset {
        Some(misset) => format!("{words} misset {misset:?}"),
        None => words,
    }
}

/// The command line options that reproduce the choice of a variation.
fn command_line(options: &PlanOptions, cell: Option<&str>) -> String {
    let mut line = String::new();
    if let Some(policy) = &options.policy {
        line.push_str(&format!(" --policy {}", quoted(&policy.to_string_lossy())));
    }
    if let Some(platform) = &options.platform {
        line.push_str(&format!(" --platform {}", platform.name));
    }
    if let Some(cell) = cell {
        line.push_str(&format!(" --cell {cell}"));
    }
    match &options.detector {
        Some(loaded) => line.push_str(&loaded.options),
        None if options.rendered => line.push_str(" --rendered"),
        None => {}
    }
    if let Some(engaged) = &options.guest {
        line.push_str(&engaged.options);
    }
    if options.sabotage {
        line.push_str(" --sabotage");
    }
    line
}

/// The name of a file without its ending.
pub fn stem(path: &Path) -> String {
    path.file_stem().and_then(|s| s.to_str()).unwrap_or_default().to_owned()
}

/// SHA-256 of the custom detector of these variations, if they have one.
pub fn detector(planned: &[Planned]) -> Option<String> {
    planned.iter().find_map(|one| Some(one.setup.detector.as_ref()?.model.sha256.clone()))
}

/// The failure of `Variation::with_settings`, with the place and the remedy that a cell's error has in its file.
pub fn unfit(variation: &Variation, error: &SettingsError) -> Failure {
    let cell = variation.cell.as_ref().map(|cell| format!(" {cell}")).unwrap_or_default();
    let name = variation.scenario.name.as_str();
    let remedy =
        "a path and its values are as in a cell's `set`; `holdsafe scenario schema` prints every key with its range";
    Failure::new(Exit::Usage, format!("in {name}{cell}: {error}; {remedy}"))
}
