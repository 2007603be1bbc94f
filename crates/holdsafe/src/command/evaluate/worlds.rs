//! `evaluate --worlds N`: every shipped scenario of a platform in its own scene and in N drawn worlds of each family for its kind of body,
//! and the table of what holds in both. Finished trials are kept, so that it resumes after any interruption.

use std::path::Path;

use evidence::trial::Trial;
use parallel::progress::{Progress, Talk};
use results::mode::Mode;
use results::report::{Apart, InWorlds, WorldsRow, worlds_table};
use runner::batch::{self, Batch};
use runner::failure::{Exit, Failure};
use runner::kept::Kept;
use runner::plan::{self, Chosen, Planned, Wanted, Worlds, in_worlds};
use runner::{Context, lines, out};
use scenario::world::{Family, Kind};
use scenario::{Platform, load_platform};

/// File of the whole table, and of the result.
const TABLE: &str = "table.txt";
const RESULT: &str = "worlds.json";
/// The platform that drives in them where none is asked for.
const PLATFORM: &str = "ground";

/// The worlds that were asked for.
pub(super) struct Asked<'a> {
    /// Of each family.
    pub(super) worlds: u64,
    /// Another platform than the ground's.
    pub(super) platform: Option<&'a str>,
    /// Scenarios, in place of all.
    pub(super) names: &'a [String],
}

pub(super) fn run(context: &Context, asked: &Asked<'_>, out: Option<&Path>) -> Result<Exit, Failure> {
    let context = &context.with_fresh_seed();
    let (worlds, of_platform) = (asked.worlds, plan::platform_of(context, asked.platform.unwrap_or(PLATFORM))?);
    let platform = load_platform(&of_platform.file)?;
    let families = Family::developed_for(Kind::of(&platform));
    if families.is_empty() {
        let message = format!(
            "`{}` has no family of worlds; expected a body on wheels or rotors, or a satellite",
            of_platform.asked
        );
        return Err(Failure::new(Exit::Usage, message));
    }
    let in_each = worlds * families.len() as u64;
    if context.seed.checked_add(in_each).is_none() {
        return Err(Failure::new(Exit::Usage, format!("--seed {} leaves no seeds for {in_each} trials", context.seed)));
    }
    let (planned, apart) = plan_all(context, asked.names, (&of_platform, &platform))?;
    let runs = context.runs_folder()?;
    let own = match asked.platform {
        None => "worlds".to_owned(),
        Some(_) => format!("worlds-{}", platform.name.as_str()),
    };
    let dir = out::directory(&runs, Some(out.unwrap_or(&runs.join(own))), "worlds")?;
    let _lock = lines::lock(&dir, &context.stop)?;
    out::write_manifest(&dir, &out::Manifest::of(context, &planned)?)?;

    if context.talk == Talk::Normal {
        let (rows, seed) = (planned.len(), context.seed);
        link::note!(
            "evaluate: {rows} rows, each {in_each} times in its own scene and in {in_each} worlds; seeds from {seed} on"
        );
        link::note!(
            "Ctrl-C is safe: what is finished is kept in {}, and the same command goes on from there",
            dir.display()
        );
    }
    let total = planned.len() * 2 * in_each as usize;
    let evaluation = Evaluation {
        context,
        worlds,
        families: &families,
        kept: Kept::below(&dir)?,
        progress: Progress::new("evaluate: trials", total, context.talk),
    };
    let rows = planned.iter().map(|own| evaluation.row(own)).collect::<Result<Vec<_>, _>>()?;
    evaluation.progress.finish();

    let names: Vec<&str> = families.iter().map(|family| family.name()).collect();
    let result = InWorlds::new(context.seed, worlds, &names, rows, apart);
    out::write_result(&dir, RESULT, "worlds", &result)?;
    out::write_text(&dir, TABLE, &worlds_table(&result))?;
    if context.json {
        out::print_json("worlds", &result)?;
    } else {
        show(&result, &dir);
    }
    // What does not hold in worlds is the result, no failure of the command.
    Ok(if result.rows.is_empty() { Exit::NoEvidence } else { Exit::Fine })
}

/// The variations of every scenario that was asked for on a platform, and the scenarios that stay in their own scene, with the reason.
fn plan_all(
    context: &Context,
    names: &[String],
    (chosen, platform): (&Chosen, &Platform),
) -> Result<(Vec<Planned>, Vec<Apart>), Failure> {
    let files = match names {
        [] => scenario::shipped(&context.root()?)?,
        names => names.iter().map(|name| plan::file_of(context, name)).collect::<Result<_, _>>()?,
    };
    let (mut all, mut apart) = (Vec::new(), Vec::new());
    for file in files {
        let scenario = context.scenario(&file)?;
        let own = *scenario.platform == *platform.name;
        let shared = platform.owes.as_ref().is_some_and(|owes| **owes == *scenario.platform);
        let of_another = (!own && !shared).then(|| format!("it is not of the platform `{}`", platform.name.as_str()));
        match scenario.check_for_worlds().err().map(|why| why.to_string()).or(of_another) {
            Some(why) => apart.push(Apart { scenario: scenario.name.as_str().to_owned(), why }),
            None => {
                let wanted = Wanted { platform: shared.then(|| chosen.clone()), ..Wanted::default() };
                let mut planned = plan::of_scenario(context, &scenario, &wanted)?;
                // A scenario that states no class there says nothing of it.
                planned.retain(|planned| !planned.variation.scenario.expected.is_empty());
                all.extend(planned);
            }
        }
    }
    Ok((all, apart))
}

struct Evaluation<'a> {
    context: &'a Context,
    /// Of each family.
    worlds: u64,
    families: &'a [Family],
    kept: Kept,
    progress: Progress,
}

impl Evaluation<'_> {
    /// The row of a variation: its trials in its own scene, and one in each world, with the world's seed.
    fn row(&self, own: &Planned) -> Result<WorldsRow, Failure> {
        let (scenario, families) = (&own.variation.scenario, self.families);
        let own_trials = self.run(std::slice::from_ref(own), self.worlds * families.len() as u64, self.context.seed)?;
        let mut drawn: Vec<(&'static str, Planned, Trial)> = Vec::new();
        for seed in self.context.seed..self.context.seed + self.worlds {
            let of = |family: &Family| in_worlds(own, &Worlds { family: *family, seeds: seed..seed + 1 });
            let planned = families.iter().map(of).collect::<Result<Vec<_>, _>>()?.concat();
            let trials = self.run(&planned, 1, seed)?;
            let each = families.iter().zip(planned).zip(trials);
            drawn.extend(each.map(|((family, planned), trial)| (family.name(), planned, trial)));
        }
        let by_family: Vec<(&'static str, &Trial)> = drawn.iter().map(|(family, _, trial)| (*family, trial)).collect();
        let row = WorldsRow::new(scenario, own.variation.cell.clone(), &own_trials, &by_family);
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
        let there = planned.len() * n as usize - batch.missing(&shelves);
        (0..there).for_each(|_| self.progress.step());
        batch.run_kept(&shelves, batch.threads(), &self.progress, &self.context.stop)
    }
}

fn show(result: &InWorlds, dir: &Path) {
    out::say(format_args!("{}", worlds_table(result).trim_end()));
    for line in result.rows.iter().filter_map(|row| row.reproduce.as_ref()) {
        out::say(format_args!("otherwise: {line}"));
    }
    for apart in &result.apart {
        out::say(format_args!("in its own scene only: {}: {}", apart.scenario, apart.why));
    }
    let n = result.worlds as usize * result.families.len();
    out::say(format_args!("{}, each in {n} worlds", result.count()));
    out::say(format_args!("the table is in {}, the result in {RESULT} beside it", dir.join(TABLE).display()));
}
