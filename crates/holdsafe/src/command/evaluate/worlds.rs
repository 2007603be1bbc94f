//! `evaluate --worlds N`: every shipped scenario of the ground platform in its own scene and in N drawn worlds of each family, and the
//! table of what holds in both. Finished trials are kept, so that it resumes after any interruption.

use std::path::Path;

use evidence::trial::{Outcome, Trial};
use parallel::progress::Progress;
use results::mode::Mode;
use results::report::{Apart, InWorlds, WorldsRow, worlds_table};
use runner::batch::{self, Batch};
use runner::failure::{Exit, Failure};
use runner::kept::Kept;
use runner::plan::{self, Planned, Wanted, Worlds, in_worlds};
use runner::{Context, lines, out};
use scenario::world::Family;

/// File of the whole table, and of the result.
const TABLE: &str = "table.txt";
const RESULT: &str = "worlds.json";

/// A scenario, or a cell of one, in its own scene and in worlds.
struct Pair {
    own: Planned,
    /// By family, and then by seed.
    drawn: Vec<Planned>,
}

pub(super) fn run(context: &Context, worlds: u64, names: &[String], out: Option<&Path>) -> Result<Exit, Failure> {
    let context = &context.with_fresh_seed();
    let (pairs, apart) = plan_pairs(context, worlds, names)?;
    let runs = context.runs_folder()?;
    let dir = out::directory(&runs, Some(out.unwrap_or(&runs.join("worlds"))), "worlds")?;
    let _lock = lines::lock(&dir, &context.stop)?;
    let all: Vec<Planned> =
        pairs.iter().flat_map(|pair| std::iter::once(&pair.own).chain(&pair.drawn)).cloned().collect();
    out::write_manifest(&dir, &out::Manifest::of(context, &all)?)?;

    let n = worlds * families().len() as u64;
    let progress = Progress::new("evaluate: runs", pairs.len() * 2 * n as usize, context.talk);
    let (kept, mut rows) = (Kept::below(&dir)?, Vec::new());
    for pair in &pairs {
        let own = run_kept(context, &kept, std::slice::from_ref(&pair.own), n, &progress)?;
        let drawn = run_kept(context, &kept, &pair.drawn, 1, &progress)?;
        rows.push(pair.row(&own, &drawn, worlds));
    }
    progress.finish();

    let names: Vec<&str> = families().iter().map(|family| family.name()).collect();
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

/// Those that development drives in.
fn families() -> Vec<Family> {
    Family::ALL.into_iter().filter(|family| !family.is_held_out()).collect()
}

/// Every scenario that was asked for in both, and those that stay in their own scene, with the reason.
fn plan_pairs(context: &Context, worlds: u64, names: &[String]) -> Result<(Vec<Pair>, Vec<Apart>), Failure> {
    let files = match names {
        [] => scenario::shipped(&context.root()?)?,
        names => names.iter().map(|name| plan::file_of(context, name)).collect::<Result<_, _>>()?,
    };
    let (mut pairs, mut apart) = (Vec::new(), Vec::new());
    for file in files {
        let scenario = context.scenario(&file)?;
        let of_another_body =
            (scenario.platform.as_str() != "ground").then(|| "it is not of the ground platform".to_owned());
        let why = scenario.can_be_in_a_world().err().map(|why| why.to_string()).or(of_another_body);
        if let Some(why) = why {
            apart.push(Apart { scenario: scenario.name.as_str().to_owned(), why });
            continue;
        }
        let (_, planned) = plan::plan(context, &file, &Wanted::default())?;
        for own in planned {
            let seeds = context.seed..context.seed + worlds;
            let of = |family| in_worlds(&own, &Worlds { family, seeds: seeds.clone() });
            let drawn = families().into_iter().map(of).collect::<Result<Vec<_>, _>>()?.concat();
            pairs.push(Pair { own, drawn });
        }
    }
    Ok((pairs, apart))
}

fn run_kept(
    context: &Context,
    kept: &Kept,
    planned: &[Planned],
    n: u64,
    progress: &Progress,
) -> Result<Vec<Trial>, Failure> {
    let (mode, seed) = (Mode::Twin, context.seed);
    let shelves = planned.iter().map(|planned| kept.shelf(mode, planned)).collect::<Result<Vec<_>, _>>()?;
    let batch = Batch { label: "evaluate", mode, planned, n, seed, jobs: 1, out: None };
    let there = planned.len() * n as usize - batch.missing(&shelves);
    (0..there).for_each(|_| progress.step());
    batch.run_kept(&shelves, batch.threads(), progress, &context.stop)
}

impl Pair {
    fn row(&self, own: &[Trial], drawn: &[Trial], worlds: u64) -> WorldsRow {
        let scenario = &self.own.variation.scenario;
        let families = families().into_iter().flat_map(|family| std::iter::repeat_n(family.name(), worlds as usize));
        let drawn_by: Vec<(&'static str, &Trial)> = families.zip(drawn).collect();
        let name = (scenario.name.as_str(), self.own.variation.cell.clone());
        let row = WorldsRow::new(name, &scenario.expected, own, &drawn_by);
        let unexpected =
            self.drawn.iter().zip(drawn).filter(|(_, trial)| {
                trial.outcome != Outcome::Invalid && trial.outcome.is_unexpected(&scenario.expected)
            });
        let gravest = unexpected.min_by_key(|(_, trial)| trial.outcome);
        let reproduce = gravest.map(|(planned, trial)| batch::reproduce(Mode::Twin, planned, trial.seed));
        WorldsRow { reproduce, ..row }
    }
}

fn show(result: &InWorlds, dir: &Path) {
    out::say(format_args!("{}", worlds_table(result).trim_end()));
    for row in result.rows.iter().filter_map(|row| row.reproduce.as_ref()) {
        out::say(format_args!("otherwise: {row}"));
    }
    for apart in &result.apart {
        out::say(format_args!("in its own scene only: {}: {}", apart.scenario, apart.why));
    }
    let n = result.worlds as usize * result.families.len();
    out::say(format_args!("{}, each in {n} worlds", result.count()));
    out::say(format_args!("the table is in {}, the result in {RESULT} beside it", dir.join(TABLE).display()));
}
