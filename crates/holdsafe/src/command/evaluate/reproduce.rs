//! `holdsafe evaluate --reproduce`: do all simulated runs still give the committed results?

use std::path::{Path, PathBuf};

use evidence::SCHEMA_VERSION;
use parallel::progress::Progress;
use results::mode::Mode;
use results::reproduction::{Again, Reference, References};
use runner::closing::Closing;
use runner::failure::{Exit, Failure};
use runner::plan::{PlanOptions, Planned};
use runner::{Context, Root, engine, out, plan};
use serde::Serialize;

/// Folder of the references below the root, a file for each architecture.
const FOLDER: &str = "references";
/// Decisions of a second that are printed.
const PRINTED: usize = 8;

#[derive(Debug, Default, clap::Args)]
pub(super) struct Reproduce {
    /// With --reproduce or --worlds: only these scenarios; else every shipped one that is simulated.
    #[arg(value_name = "SCENARIO", requires = "selects", conflicts_with = "renew")]
    pub(super) scenarios: Vec<String>,
    /// With --reproduce: write the references of this architecture anew, from the runs of now.
    #[arg(long, requires = "reproduce")]
    renew: bool,
}

/// One run that differs from its reference.
#[derive(Serialize)]
struct Row {
    scenario: String,
    cell: Option<String>,
    then: Option<Reference>,
    now: Reference,
    /// The comparison; absent without a reference.
    again: Option<Again>,
    reproduce: String,
}

#[derive(Serialize)]
struct Reproduced {
    schema_version: u32,
    architecture: String,
    seed: u64,
    runs: usize,
    /// Runs with the same log.
    same: usize,
    /// Runs with the same decisions and another log.
    same_decisions: usize,
    /// Other decisions, another class, or no reference.
    otherwise: Vec<Row>,
    /// References of scenarios and cells that are no more.
    gone: Vec<String>,
}

pub(super) fn run(context: &Context, args: &Reproduce) -> Result<Exit, Failure> {
    let chosen = context.choose_root()?;
    if let (Root::BuiltIn(_), true) = (&chosen, args.renew) {
        let message = "built-in references are not renewed; run this in a checkout, or name one with --root DIR";
        return Err(Failure::new(Exit::Usage, message));
    }
    let root = chosen.path();
    let file = root.join(FOLDER).join(format!("{}.jsonl", architecture()));
    let planned = planned(context, args, root)?;
    if args.renew {
        return renew(context, &planned, &file);
    }
    let references = read(root, &file)?;
    let made = made(context, &planned, references.seed, |reference, evidence| {
        let then = references.find(&reference.scenario, reference.cell.as_deref());
        then.map(|then| then.compare(reference, &evidence.entries))
    })?;
    let mut reproduced = Reproduced {
        schema_version: SCHEMA_VERSION,
        architecture: architecture(),
        seed: references.seed,
        runs: made.len(),
        same: 0,
        same_decisions: 0,
        otherwise: Vec::new(),
        gone: stale_references(&references, &made, args),
    };
    for (one, (now, again)) in planned.iter().zip(made) {
        let then = references.find(&now.scenario, now.cell.as_deref()).cloned();
        let same_class = then.as_ref().is_some_and(|then| then.outcome == now.outcome);
        match again {
            Some(Again::Same) if same_class => reproduced.same += 1,
            Some(Again::SameDecisions) if same_class => reproduced.same_decisions += 1,
            again => {
                let (scenario, cell) = (now.scenario.clone(), now.cell.clone());
                let reproduce = format!("holdsafe run {scenario}{} --trials 1 --seed {}", one.options, references.seed);
                reproduced.otherwise.push(Row { scenario, cell, then, now, again, reproduce });
            }
        }
    }
    let exit =
        if reproduced.otherwise.is_empty() && reproduced.gone.is_empty() { Exit::Fine } else { Exit::Unexpected };
    match context.json {
        true => out::print_json("reproduce", &reproduced)?,
        false => show(context, &reproduced),
    }
    Ok(exit)
}

fn architecture() -> String {
    format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS)
}

/// Every variation that runs in the twin.
fn planned(context: &Context, args: &Reproduce, root: &Path) -> Result<Vec<Planned>, Failure> {
    let files: Vec<PathBuf> = match args.scenarios.is_empty() {
        true => scenario::shipped(root)?,
        false => args.scenarios.iter().map(|name| plan::file_of(context, name)).collect::<Result<_, _>>()?,
    };
    let mut all = Vec::new();
    for file in files {
        all.extend(plan::plan(context, &file, &PlanOptions::default())?.1);
    }
    all.retain(|planned| planned.mode() == Mode::Twin);
    match all.is_empty() {
        true => Err(Failure::new(Exit::NoEvidence, "nothing of that runs in the twin")),
        false => Ok(all),
    }
}

fn read(root: &Path, file: &Path) -> Result<References, Failure> {
    let Ok(found) = link::files::open(file) else {
        let other_entries = std::fs::read_dir(root.join(FOLDER)).into_iter().flatten().filter_map(Result::ok);
        let other_texts: Vec<String> =
            other_entries.filter_map(|e| Some(e.path().file_stem()?.to_string_lossy().into_owned())).collect();
        let message = format!(
            "no references of {} are committed (there are: {}); `--renew` makes them",
            architecture(),
            other_texts.join(", ")
        );
        return Err(Failure::new(Exit::NoEvidence, message));
    };
    References::read(found).map_err(|reason| Failure::new(Exit::Usage, format!("{}: {reason}", file.display())))
}

/// Runs each, and maps its evidence by `compute`.
fn made<T: Send>(
    context: &Context,
    planned: &[Planned],
    seed: u64,
    compute: impl Fn(&Reference, &evidence::Evidence) -> T + Sync,
) -> Result<Vec<(Reference, T)>, Failure> {
    let progress = Progress::new("runs", planned.len(), context.talk);
    let made = parallel::map(parallel::cores(), planned, |one| {
        if context.stop.is_requested() {
            return Err(runner::error::EngineError::Stopped);
        }
        let scenario = &one.variation.scenario;
        let (evidence, verdict) = engine::twin_verdict(scenario, &one.setup, seed)?;
        let now = Reference::from_run(scenario.name.as_str(), one.variation.cell.as_deref(), &evidence, &verdict);
        let made = compute(&now, &evidence);
        progress.step();
        Ok((now, made))
    })?;
    progress.finish();
    Ok(made)
}

fn renew(context: &Context, planned: &[Planned], file: &Path) -> Result<Exit, Failure> {
    let runs: Vec<Reference> =
        made(context, planned, context.seed, |_, _| ())?.into_iter().map(|(run, ())| run).collect();
    let mut bytes = Vec::new();
    let n = runs.len();
    References { seed: context.seed, runs }.write(&mut bytes)?;
    let unwritable = |e: std::io::Error| Failure::new(Exit::Usage, format!("{}: {e}", file.display()));
    file.parent().map_or(Ok(()), std::fs::create_dir_all).map_err(unwritable)?;
    std::fs::write(file, bytes).map_err(unwritable)?;
    out::say(format_args!("{n} references written to {}", file.display()));
    Ok(Exit::Fine)
}

/// References to scenarios and cells that are not shipped; none where only some scenarios were named.
fn stale_references<T>(references: &References, made: &[(Reference, T)], args: &Reproduce) -> Vec<String> {
    let is_current =
        |then: &&Reference| made.iter().any(|(now, _)| now.scenario == then.scenario && now.cell == then.cell);
    let all = references.runs.iter().filter(|then| args.scenarios.is_empty() && !is_current(then));
    all.map(|then| label(&then.scenario, then.cell.as_deref())).collect()
}

fn label(scenario: &str, cell: Option<&str>) -> String {
    cell.map_or_else(|| scenario.to_owned(), |cell| format!("{scenario} {cell}"))
}

fn show(context: &Context, reproduced: &Reproduced) {
    for row in &reproduced.otherwise {
        let name = label(&row.scenario, row.cell.as_deref());
        match (&row.then, &row.again) {
            (Some(then), Some(Again::Parted { second, now })) => {
                let classes = format!("{} then, {} now", then.outcome.name(), row.now.outcome.name());
                out::show(format_args!(
                    "{name}: decides otherwise from its second {second} on ({classes}); there it now decides"
                ));
                for decided in now.iter().take(PRINTED) {
                    let event = serde_json::to_string(&decided.event).unwrap_or_default();
                    out::show(format_args!("  {:.3} s  {event}", decided.at_us as f64 / 1e6));
                }
                if now.len() > PRINTED {
                    out::show(format_args!("  and {} more", now.len() - PRINTED));
                }
            }
            (Some(then), _) => {
                let (then, now) = (then.outcome.name(), row.now.outcome.name());
                out::show(format_args!("{name}: decides the same and is judged otherwise: {then} then, {now} now"));
            }
            (None, _) => out::show(format_args!("{name}: has no reference")),
        }
        out::note(format_args!("reproduce: {}", row.reproduce));
    }
    reproduced.gone.iter().for_each(|name| out::show(format_args!("{name}: has a reference and is not shipped")));
    let Reproduced { runs, same, same_decisions, architecture, seed, .. } = reproduced;
    out::show(format_args!(
        "{runs} runs, seed {seed}, {architecture}: {same} with the same log, {same_decisions} with the same decisions in another log, {} otherwise",
        reproduced.otherwise.len()
    ));
    let differing = reproduced.otherwise.first().map(|row| context.own_command(&row.reproduce));
    let first =
        differing.unwrap_or_else(|| context.command(["evaluate", "--quick", "--out", &context.free_folder("quick")]));
    let text = match reproduced.otherwise.len() + reproduced.gone.len() {
        0 => "every run as committed".to_owned(),
        n => format!("UNEXPECTED {n}"),
    };
    Closing::new(context).part(text).part(format!("{runs} runs")).print([first, context.command(["scenario", "list"])]);
}
