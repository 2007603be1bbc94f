//! `holdsafe guest board verify BOARD`: every row checked, with its number and the reason where one does not hold.

use std::collections::BTreeMap;
use std::path::PathBuf;

use ::board::{Board, Finding, public_key};
use evidence::SCHEMA_VERSION;
use runner::closing::Closing;
use runner::failure::{Exit, Failure};
use runner::{Context, leaderboard, out};
use serde::Serialize;

#[derive(Debug, clap::Args)]
pub(in crate::command) struct Args {
    /// The leaderboard.
    #[arg(value_name = "BOARD")]
    file: PathBuf,
    /// Public key of a contributor, hexadecimal; several times for several. A row of any other key is INVALID.
    #[arg(long = "key", value_name = "PUBLIC", value_parser = key)]
    keys: Vec<String>,
}

fn key(text: &str) -> Result<String, String> {
    public_key(text).map_err(|error| error.to_string())
}

#[derive(Serialize)]
struct VerifiedObject {
    schema_version: u32,
    /// Every row holds.
    holds: bool,
    rows: usize,
    contributors: Vec<ContributorObject>,
    /// Rows that do not hold, each with the first reason.
    findings: Vec<String>,
}

/// A key with the names that its rows state.
#[derive(Serialize)]
struct ContributorObject {
    key: String,
    names: Vec<String>,
    rows: usize,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let board = leaderboard::parse(&args.file)?;
    let mut findings = board.findings();
    if !args.keys.is_empty() {
        findings.extend(board.strangers(&args.keys));
    }
    let (holds, contributors) = (findings.is_empty(), contributors(&board));
    if context.json {
        let (rows, findings) = (board.rows().len(), findings.iter().map(Finding::to_string).collect());
        let object = VerifiedObject { schema_version: SCHEMA_VERSION, holds, rows, contributors, findings };
        out::print_json("board-verify", &object)?;
    } else {
        for finding in &findings {
            out::show(format_args!("INVALID: {finding}"));
        }
        for ContributorObject { key, names, rows } in &contributors {
            // The text of a row that does not hold may be of any characters.
            let (key, names) =
                if holds { (key.clone(), names.join(", ")) } else { (format!("{key:?}"), format!("{names:?}")) };
            out::say(format_args!("{key} {names}: {rows} rows"));
        }
        let (rows, file) = (board.rows().len(), args.file.to_string_lossy());
        let verb = |words: &[&str]| context.command(["guest", "board"].into_iter().chain(words.iter().copied()));
        let text = match holds {
            true => format!("{rows} rows: every row holds"),
            false => format!("{rows} rows: not every row holds · INVALID {}", findings.len()),
        };
        Closing::new(context).part(text).print(match holds {
            true => [verb(&["show", &file]), verb(&["replay", &file, "--row", "1"])],
            false => [verb(&["verify", &file, "--json"]), verb(&["verify", "--help"])],
        });
    }
    Ok(if holds { Exit::Fine } else { Exit::NoEvidence })
}

fn contributors(board: &Board) -> Vec<ContributorObject> {
    let mut found: BTreeMap<&str, ContributorObject> = BTreeMap::new();
    for signed in board.rows() {
        let (key, name) = (&signed.row.contributor.key, &signed.row.contributor.name);
        let new = || ContributorObject { key: key.clone(), names: Vec::new(), rows: 0 };
        let entry = found.entry(key).or_insert_with(new);
        entry.rows += 1;
        if !entry.names.contains(name) {
            entry.names.push(name.clone());
        }
    }
    found.into_values().collect()
}
