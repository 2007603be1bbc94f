//! `holdsafe guest board key|add|merge|verify|show|replay`: the leaderboard, a file of signed rows.

mod add;
mod replay;
mod verify;

use std::path::{Path, PathBuf};

use ::board::{Board, ProgramIdentity, ShownBoard};
use evidence::SCHEMA_VERSION;
use evidence::trial::{Outcome, Trial};
use runner::batch::reasons;
use runner::closing::Closing;
use runner::failure::{Exit, Failure};
use runner::{Context, leaderboard, out};
use serde::Serialize;

use crate::command::COMMIT;

#[derive(Debug, clap::Subcommand)]
pub(in crate::command) enum Verb {
    /// Write a new key of a contributor, and print its public half.
    Key {
        /// A new file, which its owner alone can read.
        #[arg(value_name = "KEY")]
        file: PathBuf,
    },
    /// Run guests bare and inside the guards, and add a signed row for each attack and conduct.
    Add(add::Args),
    /// Add the rows of other leaderboards.
    Merge {
        /// The leaderboard that takes them.
        #[arg(value_name = "BOARD")]
        file: PathBuf,
        /// The others.
        #[arg(required = true, value_name = "OTHER")]
        others: Vec<PathBuf>,
    },
    /// Verify the bounds, counts, signatures and order of all rows.
    Verify(verify::Args),
    /// Print the table in Markdown: guest by attack by world, bare beside guarded.
    Show {
        /// The leaderboard.
        #[arg(value_name = "BOARD")]
        file: PathBuf,
    },
    /// Run the trials of a row again, and compare classes and logs.
    Replay(replay::Args),
}

#[derive(Serialize)]
struct KeyObject<'a> {
    schema_version: u32,
    file: &'a Path,
    public: String,
}

#[derive(Serialize)]
struct AddedObject {
    schema_version: u32,
    /// New rows.
    added: usize,
    /// All rows.
    rows: usize,
}

pub(super) fn run(context: &Context, verb: &Verb) -> Result<Exit, Failure> {
    match verb {
        Verb::Key { file } => key(context, file),
        Verb::Add(args) => add::run(context, args),
        Verb::Merge { file, others } => merge(context, file, others),
        Verb::Verify(args) => verify::run(context, args),
        Verb::Show { file } => show(context, file),
        Verb::Replay(args) => replay::run(context, args),
    }
}

fn key(context: &Context, file: &Path) -> Result<Exit, Failure> {
    let public = leaderboard::create_key(file)?;
    if context.json {
        out::print_json("board-key", &KeyObject { schema_version: SCHEMA_VERSION, file, public })?;
    } else {
        out::say(format_args!("{}: keep it; the public half is {public}", file.display()));
    }
    Ok(Exit::Fine)
}

fn merge(context: &Context, file: &Path, others: &[PathBuf]) -> Result<Exit, Failure> {
    let mut board = load(file)?;
    let mut added = 0;
    for other in others {
        let rows = leaderboard::verified(other)?;
        added += board.merge(rows).map_err(|error| leaderboard::failure(other, &error))?;
    }
    write(context, file, &board, added)
}

/// The verified leaderboard of a file; an empty one where there is none.
fn load(file: &Path) -> Result<Board, Failure> {
    if file.exists() { leaderboard::verified(file) } else { Ok(Board::default()) }
}

/// Writes the leaderboard and reports the number of new rows.
fn write(context: &Context, file: &Path, board: &Board, added: usize) -> Result<Exit, Failure> {
    leaderboard::write(file, board)?;
    let rows = board.rows().len();
    if context.json {
        out::print_json("board-add", &AddedObject { schema_version: SCHEMA_VERSION, added, rows })?;
    } else {
        let closing = Closing::new(context).part(format!("{}: {added} rows added, {rows} in all", file.display()));
        closing.print([board_command(context, "show", file), board_command(context, "verify", file)]);
    }
    Ok(Exit::Fine)
}

/// A command about this leaderboard.
fn board_command(context: &Context, verb: &str, file: &Path) -> String {
    context.command(["guest", "board", verb, &file.to_string_lossy()])
}

fn show(context: &Context, file: &Path) -> Result<Exit, Failure> {
    let shown = ShownBoard::new(&leaderboard::verified(file)?);
    if context.json {
        out::print_json("board", &shown)?;
    } else {
        out::say(format_args!("{}", shown.markdown().trim_end()));
    }
    Ok(Exit::Fine)
}

/// Reports the first trial in which the guest failed.
fn note_failure(title: &str, trials: &[Trial]) {
    if let Some(trial) = trials.iter().find(|trial| trial.outcome == Outcome::GuestFailed) {
        out::note(format_args!("{title}: the guest failed in the trial of seed {}{}", trial.seed, reasons(trial)));
    }
}

/// This program.
fn program(context: &Context) -> ProgramIdentity {
    ProgramIdentity {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        commit: COMMIT.to_owned(),
        sources: context.program.to_owned(),
    }
}
