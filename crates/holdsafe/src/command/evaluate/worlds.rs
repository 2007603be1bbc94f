//! `evaluate --worlds N`: every shipped scenario of a platform in its own scene and in N drawn worlds of each family for its kind of body,
//! and the table of what holds in both. Finished trials are kept, so that it resumes after any interruption.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use evidence::trial::{Outcome, Trial};
use parallel::progress::{Progress, Talk};
use results::mode::Mode;
use results::report::{Apart, InWorlds, Tally, WorldsRow, worlds_table};
use runner::batch::{self, Batch};
use runner::closing::Closing;
use runner::failure::{Exit, Failure};
use runner::plan::{self, Chosen, PlanOptions, Planned, Worlds, in_worlds};
use runner::trial_store::TrialStore;
use runner::{Context, lines, out};
use scenario::world::{Family, Kind};
use scenario::{Platform, Scenario, load_platform};

/// File of the whole table, and of the result.
const TABLE: &str = "table.txt";
const RESULT: &str = "worlds.json";
/// The platform that drives in them where none is asked for.
const PLATFORM: &str = "ground";

/// Least number of trials of an honest fault or its attack in its own scene: none of 59 is at most 5 % at 95 %.
const TWIN_TRIALS: u64 = 59;

/// The choice of worlds and scenarios.
pub(super) struct Asked<'a> {
    /// Worlds of each family.
    pub worlds: u64,
    /// Another platform than the ground's.
    pub platform: Option<&'a str>,
    /// Honest faults and the attacks that they look like.
    pub twins: bool,
    /// Scenarios; none for all.
    pub names: &'a [String],
}

pub(super) fn run(context: &Context, requested: &Asked<'_>, out: Option<&Path>) -> Result<Exit, Failure> {
    let context = &context.with_fresh_seed();
    let (worlds, driven) = (requested.worlds, Driven::load(context, requested.platform.unwrap_or(PLATFORM))?);
    let in_each = worlds * driven.families.len() as u64;
    let in_own = if requested.twins { in_each.max(TWIN_TRIALS) } else { in_each };
    if context.seed.checked_add(in_own).is_none() {
        return Err(Failure::new(Exit::Usage, format!("--seed {} leaves no seeds for {in_own} trials", context.seed)));
    }
    let (planned, skipped) = plan_all(context, requested, &driven)?;
    let runs = context.runs_folder()?;
    let own_text = match requested.platform {
        None => "worlds".to_owned(),
        Some(_) => format!("worlds-{}", driven.platform.name.as_str()),
    };
    let dir = out::directory(&runs, Some(out.unwrap_or(&runs.join(own_text))), "worlds")?;
    let _lock = lines::lock(&dir, &context.stop)?;
    out::write_manifest(&dir, &out::Manifest::new(context, &planned)?)?;

    if context.talk == Talk::Normal {
        let (rows, seed) = (planned.len(), context.seed);
        link::note!(
            "evaluate: {rows} rows, each {in_own} times in its own scene and in {in_each} worlds; seeds from {seed} on"
        );
        link::note!(
            "Ctrl-C is safe: what is finished is kept in {}, and the same command goes on from there",
            dir.display()
        );
    }
    let drawn =
        planned.iter().filter(|own_planned| driven.homebound(&own_planned.variation.scenario).is_none()).count();
    let total = planned.len() * in_own as usize + drawn * in_each as usize;
    let evaluation = Evaluation {
        context,
        worlds,
        in_own,
        driven: &driven,
        kept: TrialStore::open(&dir)?,
        progress: Progress::new("evaluate: trials", total, context.talk),
    };
    let rows = planned.iter().map(|own_planned| evaluation.row(own_planned)).collect::<Result<Vec<_>, _>>()?;
    evaluation.progress.finish();

    let names: Vec<&str> = driven.families.iter().map(|family| family.name()).collect();
    let result = InWorlds::new(context.seed, worlds, &names, rows, skipped);
    out::write_result(&dir, RESULT, "worlds", &result)?;
    out::write_text(&dir, TABLE, &worlds_table(&result))?;
    if context.json {
        out::print_json("worlds", &result)?;
    } else {
        show(context, &result, &dir);
    }
    // What does not hold in worlds is the result, no failure of the command.
    Ok(if result.rows.is_empty() { Exit::NoEvidence } else { Exit::Fine })
}

/// The platform, and the families that development drives it in.
struct Driven {
    chosen: Chosen,
    platform: Platform,
    families: Vec<Family>,
}

impl Driven {
    fn load(context: &Context, requested: &str) -> Result<Self, Failure> {
        let chosen = plan::platform_of(context, requested)?;
        let platform = load_platform(&chosen.file)?;
        let families = Family::developed_for(Kind::from_platform(&platform));
        if families.is_empty() {
            let expected = "expected a body on wheels or rotors, or a satellite";
            let message = format!("`{}` has no family of worlds; {expected}", chosen.name);
            return Err(Failure::new(Exit::Usage, message));
        }
        Ok(Self { chosen, platform, families })
    }

    /// True if the platform takes over the classes of a scenario of another.
    fn shares(&self, scenario: &Scenario) -> bool {
        self.platform.owes.as_ref().is_some_and(|name| **name == *scenario.platform)
    }

    /// Reason for which a scenario stays in its own scene.
    fn homebound(&self, scenario: &Scenario) -> Option<String> {
        let is_of_another = *scenario.platform != *self.platform.name && !self.shares(scenario);
        let of_another = is_of_another.then(|| format!("it is not of the platform `{}`", self.platform.name.as_str()));
        scenario.check_for_worlds().err().map(|error| error.to_string()).or(of_another)
    }
}

/// The variations of every scenario that was asked for, and the scenarios that stay in their own scene, with the reason.
fn plan_all(context: &Context, requested: &Asked<'_>, driven: &Driven) -> Result<(Vec<Planned>, Vec<Apart>), Failure> {
    let files = match (requested.names, requested.twins) {
        ([], false) => scenario::shipped(&context.root()?)?,
        ([], true) => with_attacks(context, scenario::honest(&context.root()?)?)?,
        (names, twins) => {
            let named = names.iter().map(|name| plan::file_of(context, name)).collect::<Result<_, _>>()?;
            if twins { with_attacks(context, named)? } else { named }
        }
    };
    let (mut all, mut skipped) = (Vec::new(), Vec::new());
    for file in files {
        let scenario = context.scenario(&file)?;
        let reason = driven.homebound(&scenario);
        if reason.is_none() || requested.twins && !scenario.is_of_stacks() {
            let platform = driven.shares(&scenario).then(|| driven.chosen.clone());
            let planned = plan::of_scenario(context, &scenario, &PlanOptions { platform, ..PlanOptions::default() })?;
            // A scenario that states no class there says nothing of it.
            all.extend(planned.into_iter().filter(|planned| !planned.variation.scenario.expected.is_empty()));
        }
        skipped.extend(reason.map(|why| Apart { scenario: scenario.name.as_str().to_owned(), why }));
    }
    Ok((all, skipped))
}

/// Files of honest faults, and those of the attacks that they look like, each once.
fn with_attacks(context: &Context, honest: Vec<PathBuf>) -> Result<Vec<PathBuf>, Failure> {
    let mut attacks = BTreeSet::new();
    for file in &honest {
        let scenario = context.scenario(file)?;
        let named = scenario.twin_of.iter().map(|attack| plan::file_of(context, attack.as_str()));
        attacks.extend(named.collect::<Result<Vec<_>, _>>()?);
    }
    let further = attacks.into_iter().filter(|file| !honest.contains(file));
    Ok(honest.iter().cloned().chain(further).collect())
}

struct Evaluation<'a> {
    context: &'a Context,
    /// Worlds of each family.
    worlds: u64,
    /// Trials in the own scene.
    in_own: u64,
    driven: &'a Driven,
    kept: TrialStore,
    progress: Progress,
}

impl Evaluation<'_> {
    /// The row of a variation: its trials in its own scene, and one in each world, with the world's seed.
    fn row(&self, own_planned: &Planned) -> Result<WorldsRow, Failure> {
        let scenario = &own_planned.variation.scenario;
        let families = if self.driven.homebound(scenario).is_none() { &self.driven.families[..] } else { &[] };
        let own_trials = self.run(std::slice::from_ref(own_planned), self.in_own, self.context.seed)?;
        let mut drawn: Vec<(&'static str, Planned, Trial)> = Vec::new();
        for seed in self.context.seed..self.context.seed + self.worlds {
            let worlds = |family: &Family| in_worlds(own_planned, &Worlds { family: *family, seeds: seed..seed + 1 });
            let planned = families.iter().map(worlds).collect::<Result<Vec<_>, _>>()?.concat();
            let trials = self.run(&planned, 1, seed)?;
            let each = families.iter().zip(planned).zip(trials);
            drawn.extend(each.map(|((family, planned), trial)| (family.name(), planned, trial)));
        }
        let by_family: Vec<(&'static str, &Trial)> = drawn.iter().map(|(family, _, trial)| (*family, trial)).collect();
        let row = WorldsRow::new(scenario, own_planned.variation.cell.clone(), &own_trials, &by_family);
        let is_otherwise = |trial: &Trial| row.otherwise.values().any(|classes| classes.contains_key(&trial.outcome));
        let gravest =
            drawn.iter().filter(|(_, _, trial)| is_otherwise(trial)).min_by_key(|(_, _, trial)| trial.outcome);
        let reproduce = gravest.map(|(_, planned, trial)| batch::reproduce(Mode::Twin, planned, trial.seed));
        Ok(WorldsRow { reproduce, ..row })
    }

    fn run(&self, planned: &[Planned], n: u64, seed: u64) -> Result<Vec<Trial>, Failure> {
        let mode = Mode::Twin;
        let shelves = planned.iter().map(|planned| self.kept.shelf(mode, planned)).collect::<Result<Vec<_>, _>>()?;
        let batch = Batch { label: "evaluate", mode, planned, n, seed, jobs: 1, out: None };
        let present = planned.len() * n as usize - batch.missing(&shelves);
        (0..present).for_each(|_| self.progress.step());
        batch.run_kept(&shelves, batch.threads(), &self.progress, &self.context.stop)
    }
}

fn show(context: &Context, result: &InWorlds, dir: &Path) {
    out::show(worlds_table(result).trim_end());
    for line in result.rows.iter().filter_map(|row| row.reproduce.as_ref()) {
        out::say(format_args!("otherwise: {line}"));
    }
    for apart in &result.apart {
        out::say(format_args!("in its own scene only: {}: {}", apart.scenario, apart.why));
    }
    let n = result.worlds as usize * result.families.len();
    out::say(format_args!("each in {n} worlds"));
    out::say(format_args!("the table is in {}, the result in {RESULT} beside it", dir.join(TABLE).display()));
    let unsafe_in = |tally: &Tally| tally.outcomes.get(&Outcome::Unsafe).copied().unwrap_or(0);
    let worse: u64 = result.rows.iter().map(|row| unsafe_in(&row.own) + unsafe_in(&row.drawn)).sum();
    let otherwise = result.rows.iter().find_map(|row| row.reproduce.as_ref());
    let first = otherwise.map_or_else(|| context.command(["scenario", "list"]), |line| context.own_command(line));
    let closing = Closing::new(context).part(result.count()).part(format!("UNSAFE {worse}"));
    closing.print([first, context.citation_of(dir)]);
}
