//! The reference evaluation. Every shipped scenario at least 59 times in the twin, or on the real stacks in
//! memory where it has no platform, and once live; those that other platforms share on these too; each row as it comes, a table, and a run
//! directory.

use std::path::{Path, PathBuf};

use evidence::trial::Trial;
use parallel::progress::Talk;
use results::mode::Mode;
use results::report::{Reference, ReferenceRow, latency_table, reference_line, reference_table};
use runner::batch::Batch;
use runner::failure::{Exit, Failure};
use runner::plan::{Chosen, Planned, Wanted, platform_of};
use runner::{Context, batch, out, plan};
use scenario::{Hosts, Scenario, load_platform};

/// The paper's findings, which the table begins with; the others follow by name.
const FIRST: [&str; 5] = ["teammate", "naive_relay", "thermal_loss", "rgb_loss", "track_starvation"];
/// Twin trials of each scenario and of each cell: the fewest that bound a 95th percentile.
const TWIN_TRIALS: u64 = 59;
/// Repetitions of a live run that a stall of the host alone makes INVALID; the tables name the repeated ones.
const RETRIES: u32 = 2;
/// Live runs side by side for each core. One takes about 40 % of a core: three networks for each frame, and what waits for them.
const LIVE_PER_CORE: usize = 1;

pub(super) fn run(context: &Context, domain: Option<&str>, apart: bool) -> Result<Exit, Failure> {
    // Every file is read before anything runs.
    let mut plans = match domain {
        Some(name) => on(context, &platform_of(context, name)?, true)?,
        None => everywhere(context)?,
    };
    if apart {
        plans.retain(|part| !part.live.is_empty());
        for part in &mut plans {
            part.twin.clear();
            part.live.iter_mut().for_each(|of| of.setup.hosts = Hosts::Namespaces);
        }
    }
    if plans.is_empty() {
        let folder = context.root()?.join("scenarios");
        return Err(Failure::new(Exit::NoEvidence, format!("no scenario in {}", folder.display())));
    }
    let dir = out::directory(&context.runs_folder()?, None, "reference")?;
    let all: Vec<Planned> =
        plans.iter().flat_map(|part| if apart { part.live.clone() } else { part.twin.clone() }).collect();
    out::write_json(&dir, "manifest.json", &out::Manifest::of(context, &all)?)?;

    let mut told = Told { dir: &dir, json: context.json, exit: Exit::Fine, rows: Vec::new() };
    let batch = |label: &str, mode: Mode, planned: &[Planned], n: u64, (out, jobs): (&Path, usize)| {
        let batch = Batch { label, mode, planned, n, seed: context.seed, jobs, out: Some(out) };
        batch.run(context.talk, &context.stop)
    };
    for Part { scenario, platform, twin, .. } in plans.iter().filter(|part| !part.twin.is_empty()) {
        let mode = if scenario.is_of_stacks() { Mode::Stack } else { Mode::Twin };
        let out = kept_in(&dir, platform);
        let mut trials = Vec::new();
        // One variation at a time, so that its verdict is printed before the next one runs.
        for one in twin {
            let cell = one.variation.cell.as_ref().map(|cell| format!(" {cell}")).unwrap_or_default();
            let label = format!("{}{cell} ({})", labelled(scenario, platform), mode.name());
            let own = batch(&label, mode, std::slice::from_ref(one), TWIN_TRIALS, (&out, 1))?;
            told.row(one, platform, mode, &own);
            trials.extend(own);
        }
        told.keep(&labelled(scenario, platform), mode, twin, &trials)?;
    }
    plans.retain(|part| !part.live.is_empty());
    let live: Vec<Planned> = plans.iter().flat_map(|part| part.live.clone()).collect();
    let trials = batch("live", Mode::Live, &live, 1, (&dir, LIVE_PER_CORE * parallel::cores()))?;
    let mut left = trials.as_slice();
    for Part { scenario, platform, live, .. } in &plans {
        let own = left.split_off(..live.len()).unwrap_or_default();
        live.iter().for_each(|one| told.row(one, platform, Mode::Live, own));
        told.keep(&labelled(scenario, platform), Mode::Live, live, own)?;
    }
    let exit = told.exit;
    finish(context, &Reference::new(context.seed, told.rows), &dir)?;
    Ok(exit)
}

/// A scenario of the evaluation, on its own platform or another one.
struct Part {
    scenario: Scenario,
    platform: Option<String>,
    twin: Vec<Planned>,
    live: Vec<Planned>,
}

/// Every shipped scenario on its own platform, in the twin and live; and in the twin on each platform that owes the same classes.
fn everywhere(context: &Context) -> Result<Vec<Part>, Failure> {
    let mut parts = Vec::new();
    for file in scenario::shipped(&context.root()?)? {
        let (scenario, twin) = plan::plan(context, &file, &Wanted::default())?;
        let live = if scenario.is_of_stacks() { Vec::new() } else { live(context, &scenario, None)? };
        parts.push(Part { scenario, platform: None, twin, live });
    }
    let first = |part: &Part| FIRST.iter().position(|name| *name == part.scenario.name.as_str());
    parts.sort_by_key(|part| first(part).unwrap_or(FIRST.len()));
    for file in scenario::platform_files(&context.root()?)? {
        if load_platform(&file)?.owes.is_some() {
            let asked = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let shared = on(context, &Chosen { asked, file }, false)?;
            parts.extend(shared.into_iter().filter(|part| part.platform.is_some()));
        }
    }
    Ok(parts)
}

/// The scenarios of `chosen` and those that it shares with the platform of which it owes the classes, live too if wanted.
fn on(context: &Context, chosen: &Chosen, also_live: bool) -> Result<Vec<Part>, Failure> {
    let platform = load_platform(&chosen.file)?;
    let mut parts = Vec::new();
    for file in scenario::shipped(&context.root()?)? {
        let scenario = context.scenario(&file)?;
        let (own, shared) = (
            *scenario.platform == *platform.name,
            platform.owes.as_ref().is_some_and(|owes| **owes == *scenario.platform),
        );
        if scenario.is_of_stacks() || !(own || shared) {
            continue;
        }
        let wanted = Wanted { platform: shared.then(|| chosen.clone()), ..Wanted::default() };
        let mut twin = plan::of_scenario(context, &scenario, &wanted)?;
        // A scenario that states no class there says nothing of it.
        twin.retain(|planned| !planned.variation.scenario.expected.is_empty());
        if twin.is_empty() {
            continue;
        }
        let live = if also_live { live(context, &scenario, wanted.platform.clone())? } else { Vec::new() };
        parts.push(Part { scenario, platform: shared.then(|| platform.name.as_str().to_owned()), twin, live });
    }
    Ok(parts)
}

fn live(context: &Context, scenario: &Scenario, platform: Option<Chosen>) -> Result<Vec<Planned>, Failure> {
    let wanted = Wanted { platform, rendered: true, where_trained: true, ..Wanted::default() };
    let mut planned = one_of_each_policy(plan::of_scenario(context, scenario, &wanted)?);
    planned.iter_mut().for_each(|of| of.setup.retries = RETRIES);
    Ok(planned)
}

/// Folder of the twin's recordings: a scenario is kept once for each platform that it runs on.
fn kept_in(dir: &Path, platform: &Option<String>) -> PathBuf {
    platform.as_ref().map_or_else(|| dir.to_owned(), |platform| dir.join(platform))
}

fn labelled(scenario: &Scenario, platform: &Option<String>) -> String {
    let name = scenario.name.as_str();
    platform.as_ref().map_or_else(|| name.to_owned(), |platform| format!("{name}.{platform}"))
}

/// The first variation under each policy: a scenario without cells has one, the teammate table one a policy.
fn one_of_each_policy(mut planned: Vec<Planned>) -> Vec<Planned> {
    let mut seen = std::collections::BTreeSet::new();
    planned.retain(|p| seen.insert(p.setup.policy_name.clone()));
    planned
}

/// The rows so far, printed and written.
struct Told<'a> {
    dir: &'a Path,
    json: bool,
    exit: Exit,
    rows: Vec<ReferenceRow>,
}

impl Told<'_> {
    /// The row of one variation, whose trials are among these.
    fn row(&mut self, planned: &Planned, platform: &Option<String>, mode: Mode, trials: &[Trial]) {
        let variation = &planned.variation;
        let own: Vec<&Trial> = trials.iter().filter(|t| t.cell == variation.cell).collect();
        let row = ReferenceRow::new(&variation.scenario, (platform.clone(), variation.cell.clone()), mode, &own);
        if !self.json {
            out::say(format_args!("{}", reference_line(&row)));
        }
        self.rows.push(row);
    }

    /// Writes and judges all trials of a scenario.
    fn keep(&mut self, name: &str, mode: Mode, planned: &[Planned], trials: &[Trial]) -> Result<(), Failure> {
        out::write_trials(self.dir, &format!("{name}.{}.jsonl", mode.name()), trials)?;
        self.exit = batch::graver(self.exit, batch::judge(mode, planned, trials));
        Ok(())
    }
}

fn finish(context: &Context, reference: &Reference, dir: &Path) -> Result<(), Failure> {
    out::write_result(dir, "reference.json", "reference", reference)?;
    if context.json {
        out::print_json("reference", reference)?;
    } else {
        out::say(format_args!("{}", reference_table(reference)));
        if !reference.live_latency_ms.is_empty() {
            out::say(format_args!("{}", latency_table(&reference.live_latency_ms)));
        }
    }
    if context.talk == Talk::Normal {
        link::note!("seed {}, run directory {}", context.seed, dir.display());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use parallel::progress::Stop;
    use runner::shipped::Shipped;

    use super::*;

    #[test]
    fn recordings_of_the_evaluation_have_places_of_their_own() {
        let root = scenario::find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
        let (talk, stop) = (Talk::Quiet, Stop::default());
        let context =
            Context { json: false, seed: 1, talk, root: Some(root), stop, program: "", shipped: Shipped::default() };
        let parts = everywhere(&context).unwrap();
        let mut places = BTreeSet::new();
        for Part { scenario, platform, twin, .. } in &parts {
            let mode = if scenario.is_of_stacks() { Mode::Stack } else { Mode::Twin };
            for one in twin {
                let (folder, name) = (kept_in(Path::new("run"), platform), scenario.name.as_str());
                let cell = one.variation.cell.clone();
                assert!(places.insert((folder.join(mode.name()).join(name), cell)), "{name} on {platform:?}");
            }
        }
        assert!(parts.iter().any(|part| part.platform.is_some()), "no other platform shares a scenario");
    }
}
