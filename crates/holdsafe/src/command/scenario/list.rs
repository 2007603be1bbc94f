//! `holdsafe scenario list`: the shipped scenarios by folder, with their titles. Their attacks and expected classes are in
//! docs/reference/scenarios.md.

use std::path::Path;

use evidence::SCHEMA_VERSION;
use results::report::wrap_labelled;
use runner::failure::{Exit, Failure};
use runner::{Context, out, plan};
use serde::Serialize;

/// Every shipped scenario.
#[derive(Serialize)]
struct Listed {
    schema_version: u32,
    scenarios: Vec<Row>,
}

/// One of them.
#[derive(Serialize)]
struct Row {
    name: String,
    title: String,
    /// Below the root.
    folder: String,
}

pub(super) fn run(context: &Context) -> Result<Exit, Failure> {
    let root = context.root()?;
    let mut scenarios = Vec::new();
    for file in plan::shipped_files(&root)? {
        let scenario = context.scenario(&file)?;
        let folder = file.parent().unwrap_or(Path::new(""));
        scenarios.push(Row {
            name: scenario.name.as_str().to_owned(),
            title: scenario.title.as_str().to_owned(),
            folder: folder.strip_prefix(&root).unwrap_or(folder).display().to_string(),
        });
    }
    scenarios.sort_by(|a, b| (&a.folder, &a.name).cmp(&(&b.folder, &b.name)));
    if context.json {
        out::print_json("scenario-list", &Listed { schema_version: SCHEMA_VERSION, scenarios })?;
    } else {
        out::say(format_args!("{}", text(&scenarios)));
    }
    Ok(Exit::Fine)
}

/// A heading for each folder, and a line for each scenario below it.
fn text(scenarios: &[Row]) -> String {
    let widest = scenarios.iter().map(|row| row.name.chars().count()).max().unwrap_or_default();
    let mut lines = Vec::new();
    for of_folder in scenarios.chunk_by(|a, b| a.folder == b.folder) {
        lines.extend(of_folder.first().map(|row| format!("{}/", row.folder)));
        lines.extend(
            of_folder.iter().map(|Row { name, title, .. }| wrap_labelled(&format!("  {name:widest$}  "), title)),
        );
    }
    lines.join("\n")
}
