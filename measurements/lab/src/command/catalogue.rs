//! `lab catalogue`: docs/reference/threats.md out of docs/reference/catalogue.toml and the scenarios, the rows as JSON,
//! or docs/researcher/figures.md.

use evidence::SCHEMA_VERSION;
use results::catalogue::ThreatRow;
use runner::failure::{Exit, Failure};
use runner::plan::PlanOptions;
use runner::{Context, out, plan};
use serde::Serialize;
use topology::{RunSecret, lay_out};

#[derive(Serialize)]
struct Listed<'a> {
    schema_version: u32,
    rows: Vec<ListedRow<'a>>,
}

#[derive(Serialize)]
struct ListedRow<'a> {
    #[serde(flatten)]
    row: &'a ThreatRow,
    scenarios: Vec<&'a str>,
}

/// The scenario whose topology is drawn: two units, and a participant that is admitted and hostile.
const DRAWN: &str = "teammate";

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// docs/researcher/figures.md: states, architecture, and the scenarios that test each threat, as Mermaid diagrams.
    #[arg(long, conflicts_with = "json")]
    figures: bool,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let (catalogue, scenarios) = context.catalogue()?;
    if args.figures {
        let (_, planned) = plan::plan(context, &plan::file_of(context, DRAWN)?, &PlanOptions::default())?;
        let one = planned.first().ok_or_else(|| Failure::internal("a scenario without a variation"))?;
        let topology = lay_out(&one.variation.scenario, &one.setup, context.seed, &RunSecret::seeded(context.seed));
        let platforms = scenario::platforms(&context.root()?)?;
        out::say(format_args!("{}", catalogue.figures(&scenarios, DRAWN, &topology, &platforms).trim_end()));
    } else if context.json {
        let named = |row: &ThreatRow| row.scenarios_naming(&scenarios).into_iter().map(|s| s.name.as_str()).collect();
        let rows = catalogue.row.iter().map(|row| ListedRow { row, scenarios: named(row) }).collect();
        out::print_json("catalogue", &Listed { schema_version: SCHEMA_VERSION, rows })?;
    } else {
        out::say(format_args!("{}", catalogue.page(&scenarios).trim_end()));
    }
    for found in catalogue.disagreements(&scenarios) {
        link::note!("{found}");
    }
    Ok(Exit::Fine)
}
