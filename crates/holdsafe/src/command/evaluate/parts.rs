//! The parts of the reference evaluation: every shipped scenario on its own platform, and on each other that shares it.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use results::mode::Mode;
use runner::failure::{Exit, Failure};
use runner::plan::{Chosen, PlanOptions, Planned};
use runner::{Context, plan};
use scenario::{Hosts, Scenario, load_platform};

use super::Args;

/// The paper's findings, which come first; the others follow by name.
pub(super) const FIRST: [&str; 5] = ["teammate", "naive_relay", "thermal_loss", "rgb_loss", "track_starvation"];
/// Simulated trials of each scenario and of each cell: the fewest that bound a 95th percentile.
pub(super) const TRIALS: u64 = 59;
/// Trials of a smoke check, which bounds no rate.
pub(super) const QUICK_TRIALS: u64 = 3;
/// Repetitions of a live run that a stall of the host alone makes INVALID; the tables name the repeated ones.
const RETRIES: u32 = 2;

/// A scenario of the evaluation, on its own platform or another one.
pub(super) struct Part {
    pub(super) scenario: Scenario,
    /// The platform, where it is another one.
    pub(super) platform: Option<String>,
    /// The variations that are simulated, in the twin or on the stacks.
    pub(super) simulated: Vec<Planned>,
    /// The variations that run live.
    pub(super) live: Vec<Planned>,
}

impl Part {
    /// Mode of its simulated trials.
    pub(super) fn mode(&self) -> Mode {
        if self.scenario.is_of_stacks() { Mode::Stack } else { Mode::Twin }
    }

    /// Name of its files.
    pub(super) fn label(&self) -> String {
        let name = self.name();
        self.platform.as_ref().map_or_else(|| name.to_owned(), |platform| format!("{name}.{platform}"))
    }

    /// Name of the part's scenario.
    pub(super) fn name(&self) -> &str {
        self.scenario.name.as_str()
    }

    /// Folder of the twin's recordings: a scenario has some for each platform that it runs on.
    pub(super) fn recordings(&self, dir: &Path) -> PathBuf {
        self.platform.as_ref().map_or_else(|| dir.to_owned(), |platform| dir.join(platform))
    }
}

/// The parts that were asked for, in the order of the result.
///
/// # Errors
/// A file of them cannot be used, or there is none.
pub(super) fn plan_parts(context: &Context, args: &Args) -> Result<Vec<Part>, Failure> {
    let mut parts = match &args.domain {
        Some(name) => plan_on(context, &plan::platform_of(context, name)?, (args.rendered, true))?,
        None => plan_everywhere(context)?,
    };
    for part in &mut parts {
        if args.quick {
            part.live.clear();
        }
        if args.apart {
            part.simulated.clear();
            part.live.iter_mut().for_each(|planned| planned.setup.hosts = Hosts::Namespaces);
        }
    }
    parts.retain(|part| !part.simulated.is_empty() || !part.live.is_empty());
    if parts.is_empty() {
        let folder = context.root()?.join("scenarios");
        return Err(Failure::new(Exit::NoEvidence, format!("no scenario in {}", folder.display())));
    }
    Ok(parts)
}

/// Every shipped scenario on its own platform, in the twin and live; and in the twin on each platform that has the same expected classes.
fn plan_everywhere(context: &Context) -> Result<Vec<Part>, Failure> {
    let mut parts = Vec::new();
    for file in scenario::shipped(&context.root()?)? {
        let (scenario, simulated) = plan::plan(context, &file, &PlanOptions::default())?;
        let live = if scenario.is_of_stacks() { Vec::new() } else { plan_live(context, &scenario, None)? };
        parts.push(Part { scenario, platform: None, simulated, live });
    }
    let first = |part: &Part| FIRST.iter().position(|name| *name == part.name());
    parts.sort_by_key(|part| first(part).unwrap_or(FIRST.len()));
    for file in scenario::platform_files(&context.root()?)? {
        if load_platform(&file)?.owes.is_some() {
            let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let shared = plan_on(context, &Chosen { name, file }, (false, false))?;
            parts.extend(shared.into_iter().filter(|part| part.platform.is_some()));
        }
    }
    Ok(parts)
}

/// The scenarios of `chosen` and those that it shares with the platform of which it has the expected classes, rendered and live too if wanted.
fn plan_on(context: &Context, chosen: &Chosen, (rendered, also_live): (bool, bool)) -> Result<Vec<Part>, Failure> {
    let platform = load_platform(&chosen.file)?;
    let mut parts = Vec::new();
    for file in scenario::shipped(&context.root()?)? {
        let scenario = context.scenario(&file)?;
        let (own_part, shared) = (
            *scenario.platform == *platform.name,
            platform.owes.as_ref().is_some_and(|name| **name == *scenario.platform),
        );
        if scenario.is_of_stacks() || !(own_part || shared) {
            continue;
        }
        let platform_of_owed = shared.then(|| chosen.clone());
        let wanted =
            PlanOptions { platform: platform_of_owed, rendered, where_trained: rendered, ..PlanOptions::default() };
        let mut simulated = plan::of_scenario(context, &scenario, &wanted)?;
        // A scenario that states no class there says nothing of it.
        simulated.retain(|planned| !planned.variation.scenario.expected.is_empty());
        if simulated.is_empty() {
            continue;
        }
        let live = if also_live { plan_live(context, &scenario, wanted.platform.clone())? } else { Vec::new() };
        parts.push(Part { scenario, platform: shared.then(|| platform.name.as_str().to_owned()), simulated, live });
    }
    Ok(parts)
}

fn plan_live(context: &Context, scenario: &Scenario, platform: Option<Chosen>) -> Result<Vec<Planned>, Failure> {
    let wanted = PlanOptions { platform, rendered: true, where_trained: true, ..PlanOptions::default() };
    let mut planned = one_of_each_policy(plan::of_scenario(context, scenario, &wanted)?);
    planned.iter_mut().for_each(|one| one.setup.retries = RETRIES);
    Ok(planned)
}

/// The first variation under each policy: a scenario without cells has one, the teammate table one a policy.
fn one_of_each_policy(mut planned: Vec<Planned>) -> Vec<Planned> {
    let mut seen = BTreeSet::new();
    planned.retain(|p| seen.insert(p.setup.policy_name.clone()));
    planned
}

#[cfg(test)]
mod tests {
    use parallel::progress::{Stop, Talk};

    use runner::shipped::Shipped;

    use super::*;

    #[test]
    fn recordings_of_the_evaluation_have_places_of_their_own() {
        let root = scenario::find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
        let (talk, stop) = (Talk::Quiet, Stop::default());
        let (json, seed, seed_is_named, shipped, started_us) = (false, 1, false, Shipped::default(), 0);
        let root = Some(root);
        let context = Context { json, seed, seed_is_named, talk, root, stop, started_us, program: "", shipped };
        let parts = plan_parts(&context, &Args::default()).unwrap();
        let mut places = BTreeSet::new();
        for part in &parts {
            let folder = part.recordings(Path::new("run")).join(part.mode().name()).join(part.name());
            for one in &part.simulated {
                let cell = one.variation.cell.clone();
                assert!(places.insert((folder.clone(), cell)), "{} on {:?}", part.name(), part.platform);
            }
        }
        assert!(parts.iter().any(|part| part.platform.is_some()), "no other platform shares a scenario");
        let quick = plan_parts(&context, &Args { quick: true, ..Args::default() }).unwrap();
        assert!(quick.len() == parts.len() && quick.iter().all(|part| part.live.is_empty()));
    }
}
