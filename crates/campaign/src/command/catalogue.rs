//! `holdsafe catalogue`: docs/threats.md out of docs/catalogue.toml and the scenarios, or the rows as JSON.

use serde::Serialize;

use super::failure::{Exit, Failure};
use super::{Context, out};
use crate::catalogue::{Catalogue, Row};
use crate::report::SCHEMA_VERSION;
use crate::scenario::{self, Scenario};

#[derive(Serialize)]
struct Listed<'a> {
    schema_version: u32,
    rows: Vec<ListedRow<'a>>,
}

#[derive(Serialize)]
struct ListedRow<'a> {
    #[serde(flatten)]
    row: &'a Row,
    scenarios: Vec<&'a str>,
}

pub(super) fn run(context: &Context) -> Result<Exit, Failure> {
    let (catalogue, scenarios) = load(context)?;
    if context.json {
        let named = |row: &Row| row.of(&scenarios).into_iter().map(|s| s.name.as_str()).collect();
        let rows = catalogue.row.iter().map(|row| ListedRow { row, scenarios: named(row) }).collect();
        out::print_json("catalogue", &Listed { schema_version: SCHEMA_VERSION, rows })?;
    } else {
        out::say(format_args!("{}", catalogue.page(&scenarios).trim_end()));
    }
    for found in catalogue.disagreements(&scenarios) {
        eprintln!("{found}");
    }
    Ok(Exit::Fine)
}

/// The catalogue and every shipped scenario.
pub(super) fn load(context: &Context) -> Result<(Catalogue, Vec<Scenario>), Failure> {
    let files = scenario::shipped(&context.root()?)?;
    let scenarios = files.iter().map(|file| scenario::load(file)).collect::<Result<_, _>>()?;
    Ok((Catalogue::load()?, scenarios))
}
