//! The `lab` command: measurements that only the authors run, pages that are generated, and labelled frames.
//!
//! Options of every command and exit codes are as in `holdsafe`.

mod catalogue;
mod dataset;
mod records;

use std::ffi::OsString;

use clap::{CommandFactory, Parser, Subcommand};
use runner::failure::Exit;
use runner::start::{self, Common};

use crate::bench::{self, Bench};

/// SHA-256 over the sources of `holdsafe` at which this program was built.
const PROGRAM: &str = env!("HOLDSAFE_PROGRAM");

/// Measures the platform, for its authors: no verdict rests on this. Results go to stdout, progress to stderr.
#[derive(Debug, Parser)]
#[command(name = "lab", version, max_term_width = 110)]
struct Cli {
    /// Command.
    #[command(subcommand)]
    verb: Verb,
    /// Options of every command.
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Subcommand)]
enum Verb {
    #[command(flatten)]
    Measure(Bench),
    /// Write labelled frames of random scenes, to train or test a detector; or draw a contact sheet.
    Dataset(dataset::Args),
    /// Print the threat catalogue: docs/reference/threats.md, or its rows with --json.
    Catalogue(catalogue::Args),
    /// Take published figures again, keep each with its origin, and write docs/results.md and the sentences of other pages.
    Records(records::Args),
}

/// Runs the command line `arguments` (the program's name first) and gives the exit code.
pub fn main(arguments: Vec<OsString>) -> Exit {
    let cli: Cli = match start::parse(Cli::command(), &arguments) {
        Ok(cli) => cli,
        Err(exit) => return exit,
    };
    let context = cli.common.context(PROGRAM, &[]);
    let result = match cli.verb {
        Verb::Measure(measurement) => bench::run(&context, &measurement),
        Verb::Dataset(args) => dataset::run(&context, &args),
        Verb::Catalogue(args) => catalogue::run(&context, &args),
        Verb::Records(args) => records::run(&context, &args),
    };
    result.unwrap_or_else(|failure| failure.report(context.json))
}
