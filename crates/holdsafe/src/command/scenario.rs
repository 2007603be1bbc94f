//! `holdsafe scenario check|schema|new`: scenario files.

use std::io::Write;
use std::path::Path;

use evidence::SCHEMA_VERSION;
use runner::failure::{Exit, Failure};
use runner::plan::Wanted;
use runner::{Context, engine, failure, out, plan};
use scenario::{Name, Problem, ProblemRow, Problems, Setup};
use serde::Serialize;
use topology::needs_rendering;

#[derive(Debug, clap::Subcommand)]
pub(super) enum Verb {
    /// Check scenario files; without any, every shipped one.
    Check {
        /// Scenarios, by name or by file.
        #[arg(value_name = "SCENARIO")]
        scenarios: Vec<String>,
    },
    /// Print the JSON Schema of a scenario file.
    Schema,
    /// Write a commented scenario to start from, into the folder that you are in.
    New {
        /// Its name; the file is NAME.toml.
        name: String,
    },
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
        Verb::Check { scenarios } => check(context, scenarios),
        Verb::Schema => {
            let schema = scenario::schema();
            let text = serde_json::to_string_pretty(&schema).map_err(Failure::internal)?;
            out::say(format_args!("{text}"));
            Ok(Exit::Fine)
        }
        Verb::New { name } => new(name),
    }
}

fn check(context: &Context, scenarios: &[String]) -> Result<Exit, Failure> {
    let files = if scenarios.is_empty() {
        scenario::shipped(&context.root()?)?
    } else {
        scenarios.iter().map(|name| plan::file_of(context, name)).collect::<Result<_, _>>()?
    };
    let mut rows = Vec::new();
    for file in &files {
        let problems = problems_of(context, file)?;
        let name = file.display().to_string();
        if let (Some(problems), false) = (&problems, context.json) {
            link::note!("{}", problems.render(failure::colour()).trim_end());
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
        if let Err(why) = engine::can_start(&variation.scenario, &setup, context.seed) {
            let remedy = "correct the value; `holdsafe scenario schema` prints every key with its type and range";
            return Ok(Some(Problem::with_file(&file.display().to_string(), why.to_string(), remedy).into()));
        }
    }
    for under in &scenario.under {
        let policy = Some(root.join("policies").join(format!("{}.toml", under.policy.as_str())));
        plan::of_scenario(context, &scenario, &Wanted { policy, ..Wanted::default() })?;
    }
    Ok(None)
}

fn new(name: &str) -> Result<Exit, Failure> {
    let name = Name::new(name).map_err(|why| Failure::new(Exit::Usage, format!("`{name}`: {why}")))?;
    let path = format!("{name}.toml");
    let created = std::fs::OpenOptions::new().write(true).create_new(true).open(&path);
    let mut file = created.map_err(|e| {
        let remedy = "choose another name or remove the file";
        Failure::new(Exit::Usage, format!("{path}: {e}; {remedy}"))
    })?;
    file.write_all(scenario::template(&name).as_bytes())?;
    out::say(format_args!("{path}"));
    Ok(Exit::Fine)
}
