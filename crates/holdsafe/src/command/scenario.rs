//! `holdsafe scenario list|check|schema|new|world`: scenario files and, with `--platform`, platform files; drawn scenes.

mod list;
mod world;

use std::io::Write;
use std::path::Path;

use evidence::SCHEMA_VERSION;
use parallel::paint::{Stream, takes_colours};
use runner::failure::{Exit, Failure};
use runner::plan::PlanOptions;
use runner::{Context, engine, out, plan};
use scenario::{Name, Problem, ProblemRow, Problems, Setup};
use serde::Serialize;
use topology::needs_rendering;

#[derive(Debug, clap::Subcommand)]
pub(super) enum Verb {
    /// List the shipped scenarios: name and title of each, by folder.
    List,
    /// Check scenario files or platform files; without any, every shipped one.
    Check {
        /// Scenarios or platforms, by name or by file.
        #[arg(value_name = "SCENARIO")]
        names: Vec<String>,
        /// Check platform files in place of scenarios.
        #[arg(long)]
        platform: bool,
    },
    /// Print the JSON Schema of a scenario file or of a platform file.
    Schema {
        /// That of a platform file.
        #[arg(long)]
        platform: bool,
    },
    /// Write a commented scenario or platform to start from, into the folder that you are in.
    New {
        /// Its name; the file is NAME.toml.
        name: String,
        /// Write a platform file.
        #[arg(long)]
        platform: bool,
    },
    /// Draw a world and print it as a scene file, which a scenario names as its `scene_file`; `--seed` says which.
    World(world::Args),
}

#[derive(Serialize)]
struct Checked {
    schema_version: u32,
    files: Vec<CheckedFile>,
}

#[derive(Serialize)]
struct CheckedFile {
    file: String,
    fine: bool,
    problems: Vec<ProblemRow>,
}

pub(super) fn run(context: &Context, verb: &Verb) -> Result<Exit, Failure> {
    match verb {
        Verb::List => list::run(context),
        Verb::Check { names, platform } => check(context, names, *platform),
        Verb::Schema { platform } => {
            let schema = if *platform { scenario::platform_schema() } else { scenario::schema() };
            let text = serde_json::to_string_pretty(&schema).map_err(Failure::internal)?;
            out::say(format_args!("{text}"));
            Ok(Exit::Fine)
        }
        Verb::New { name, platform } => new(name, *platform),
        Verb::World(args) => world::run(context, args),
    }
}

fn check(context: &Context, names: &[String], platform: bool) -> Result<Exit, Failure> {
    let files = match (names.is_empty(), platform) {
        (true, true) => scenario::platform_files(&context.root()?)?,
        (true, false) => scenario::shipped(&context.root()?)?,
        (false, true) => {
            names.iter().map(|name| Ok(plan::platform_of(context, name)?.file)).collect::<Result<_, Failure>>()?
        }
        (false, false) => names.iter().map(|name| plan::file_of(context, name)).collect::<Result<_, _>>()?,
    };
    let mut rows = Vec::new();
    for file in &files {
        let problems = if platform { scenario::load_platform(file).err() } else { problems_of(context, file)? };
        let name = file.display().to_string();
        if let (Some(problems), false) = (&problems, context.json) {
            link::note!("{}", problems.render(takes_colours(Stream::Stderr)).trim_end());
        } else if !context.json {
            out::say(format_args!("{name}: fine"));
        }
        let problems = problems.map(|p| p.rows()).unwrap_or_default();
        rows.push(CheckedFile { file: name, fine: problems.is_empty(), problems });
    }
    let fine = rows.iter().all(|row| row.fine);
    if context.json {
        out::print_json("scenario-check", &Checked { schema_version: SCHEMA_VERSION, files: rows })?;
    }
    Ok(if fine { Exit::Fine } else { Exit::Usage })
}

/// The problems of one scenario: in itself, and with the platform and policies that it names.
fn problems_of(context: &Context, file: &Path) -> Result<Option<Problems>, Failure> {
    let scenario = match context.scenario(file) {
        Ok(scenario) => scenario,
        Err(problems) => return Ok(Some(problems)),
    };
    let root = context.root()?;
    for variation in scenario.variations(None) {
        let rendered = needs_rendering(&variation.scenario).is_some();
        let setup = match Setup::load(&root, &variation.scenario, None, rendered) {
            Ok(setup) => setup,
            Err(problems) => return Ok(Some(problems)),
        };
        if let Err(error) = engine::can_start(&variation.scenario, &setup, context.seed) {
            let remedy = "correct the value; `holdsafe scenario schema` prints every key with its type and range";
            return Ok(Some(Problem::with_file(&file.display().to_string(), error.to_string(), remedy).into()));
        }
    }
    for under in &scenario.under {
        let file = |folder: &str, name: &Name| root.join(folder).join(format!("{}.toml", name.as_str()));
        let policy = under.policy.as_deref().map(|name| file("policies", name));
        let platform = under.platform.as_deref().map(|name| plan::platform_of(context, name.as_str())).transpose()?;
        plan::of_scenario(context, &scenario, &PlanOptions { policy, platform, ..PlanOptions::default() })?;
    }
    Ok(None)
}

fn new(name: &str, platform: bool) -> Result<Exit, Failure> {
    let name = Name::new(name).map_err(|reason| Failure::new(Exit::Usage, format!("`{name}`: {reason}")))?;
    let path = format!("{name}.toml");
    let created = std::fs::OpenOptions::new().write(true).create_new(true).open(&path);
    let mut file = created.map_err(|e| {
        let remedy = "choose another name or remove the file";
        Failure::new(Exit::Usage, format!("{path}: {e}; {remedy}"))
    })?;
    let text = if platform { scenario::platform_template(&name) } else { scenario::template(&name) };
    file.write_all(text.as_bytes())?;
    out::say(format_args!("{path}"));
    Ok(Exit::Fine)
}
