//! `holdsafe guest check|compare|board|schema|new`: autonomy programs of others.

mod board;
mod check;
mod compare;
pub(super) mod follower;

use std::io::Write;
use std::path::{Path, PathBuf};

use runner::failure::{Exit, Failure};
use runner::{Context, out};

/// A guest file and a program to start from.
const FILES: [(&str, &str); 2] =
    [("guest.toml", include_str!("guest/template.toml")), ("guest.py", include_str!("guest/template.py"))];

#[derive(Debug, clap::Subcommand)]
pub(super) enum Verb {
    /// Exercise a guest without a run, and say what it gets wrong.
    Check {
        /// The guest's file.
        #[arg(value_name = "GUEST.TOML")]
        file: PathBuf,
    },
    /// Run guests bare and inside the guards over scenarios, and set the two side by side.
    Compare(compare::Args),
    /// Write, verify, show or run again a leaderboard of guests, whose rows their contributors sign.
    #[command(subcommand)]
    Board(board::Verb),
    /// Print the JSON Schema of guest files and of both directions of the protocol.
    Schema,
    /// Write a guest to start from into a new folder of this name.
    New {
        /// Its name, of a-z, 0-9, - and _.
        name: String,
    },
}

pub(super) fn run(context: &Context, verb: &Verb) -> Result<Exit, Failure> {
    match verb {
        Verb::Check { file } => check::run(context, file),
        Verb::Compare(args) => compare::run(context, args),
        Verb::Board(verb) => board::run(context, verb),
        Verb::Schema => {
            let text = serde_json::to_string_pretty(&::guest::jsonl::schema()).map_err(Failure::internal)?;
            out::say(format_args!("{text}"));
            Ok(Exit::Fine)
        }
        Verb::New { name } => new(name),
    }
}

fn new(name: &str) -> Result<Exit, Failure> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || matches!(c, '-' | '_');
    if !(1..=wire::guest::MAX_NAME).contains(&name.len()) || !name.chars().all(plain) {
        let message = format!("`{name}` is no name of a guest: 1 to {} of a-z, 0-9, - and _", wire::guest::MAX_NAME);
        return Err(Failure::new(Exit::Usage, message));
    }
    let folder = Path::new(name);
    std::fs::create_dir(folder)
        .map_err(|e| Failure::new(Exit::Usage, format!("{name}: {e}; choose another name or remove the folder")))?;
    for (file, text) in FILES {
        let path = folder.join(file);
        std::fs::File::create_new(&path)?.write_all(text.replace("NAME", name).as_bytes())?;
        out::say(format_args!("{}", path.display()));
    }
    Ok(Exit::Fine)
}
