//! The `holdsafe` command: its verbs, one a file or a folder, and its exit codes.
//!
//! Results go to stdout, progress, logs and failures to stderr. Code shared by the verbs is in `runner`; `misspelt`
//! answers a word that is no verb, `help` groups the verbs by their users.

mod ablate;
mod assess;
mod campaign;
mod completions;
mod doctor;
mod emit;
mod estimate;
mod evaluate;
mod guest;
mod help;
mod inspect;
mod man;
mod matrix;
mod misspelt;
mod report;
mod run;
mod scenario;
mod search;
mod tour;
mod watch;

use std::ffi::OsString;

use clap::{CommandFactory, Parser, Subcommand};
use runner::failure::{Exit, Failure};
use runner::guest_options;
use runner::shipped::ShippedFile;
use runner::start::{self, Common};

/// SHA-256 over the sources that this program was built from, the same for every build of them.
const PROGRAM: &str = env!("HOLDSAFE_PROGRAM");

/// Version, commit, target and sources, a line each: the answer to `--version`; `-V` gives the version alone.
const LONG_VERSION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "\ncommit ",
    env!("HOLDSAFE_COMMIT"),
    "\ntarget ",
    env!("HOLDSAFE_TARGET"),
    "\nsources ",
    env!("HOLDSAFE_PROGRAM")
);

/// Shipped scenarios, platforms, policies and references, as the build script lists them.
const FILES: &[ShippedFile] = include!(concat!(env!("OUT_DIR"), "/files.rs"));

/// Commit that this program was built of; `not recorded` in a debug build.
const COMMIT: &str = env!("HOLDSAFE_COMMIT");

const EXIT_CODES: &str = "Exit codes:
  0    every judged trial within its expected classes
  1    internal error
  2    usage, or a file that cannot be used
  3    an outcome that was not expected
  4    nothing ran, an unexpected INVALID, or a recorded run that is INVALID (see --unverified)
  5    the environment lacks something (`holdsafe doctor` says what)
  130  interrupted";

/// Tests how an autonomous platform loses trust: does it reach a safe mode in time? Alone: `tour`.
#[derive(Debug, Parser)]
#[command(name = "holdsafe", version, long_version = LONG_VERSION, after_help = EXIT_CODES, max_term_width = 100)]
pub struct Cli {
    /// Command; `tour` where there is none.
    #[command(subcommand)]
    verb: Option<Verb>,
    /// Options of every command.
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Show the attacks, the platform's responses and their reasons in a few minutes.
    Tour(tour::Args),
    /// Run and judge every shipped scenario, or check that committed results still come out.
    Evaluate(evaluate::Args),
    /// Run scenarios, simulated or live, and judge them.
    Run(run::Args),
    /// Test a claim with many trials over grids and draws, or take one value through its range.
    #[command(subcommand)]
    Campaign(campaign::Verb),
    /// Run every row of the threat catalogue and print the threat matrix.
    Matrix(matrix::Args),
    /// Measure each check: every attack again with that check waived.
    Ablate(ablate::Args),
    /// Write a campaign, matrix or search in partitions, as jobs of make, Slurm or HyperQueue.
    Emit(emit::Args),
    /// Search for attack sequences that break something, and shrink each to the smallest.
    Search(search::Args),
    /// Estimate the probability of a rare event by multilevel splitting.
    Estimate(estimate::Args),
    /// Run the guards over another vehicle's recording, and over copies of it with false fixes.
    Assess(assess::Args),
    /// Watch a run as its operator sees it: as text, in a browser, in Foxglove or in a window.
    Watch(watch::Args),
    /// Explain, compare, verify or replay a recorded run.
    #[command(subcommand)]
    Inspect(inspect::Verb),
    /// Write results as an HTML page, a citation or an MCAP file.
    Report(report::Args),
    /// List or check scenario files, print their schema, or start a new one.
    #[command(subcommand)]
    Scenario(scenario::Verb),
    /// Put an autonomy of your own to the test: alone, or compared bare and inside the guards.
    #[command(subcommand)]
    Guest(guest::Verb),
    /// Check that this host has everything a run needs.
    Doctor,
    /// Print a script that completes verbs and options in a shell.
    #[command(hide = true)]
    Completions(completions::Args),
    /// Print the manual page of the program or of a verb.
    #[command(hide = true)]
    Man(man::Args),
}

/// Runs a service of this program's own; `None` for an unknown name.
pub fn service(name: &str) -> Option<Exit> {
    match name {
        assess::confined::NAME => Some(assess::confined::main()),
        guest_options::FOLLOWER => Some(guest::follower::main()),
        _ => None,
    }
}

/// Runs the command line `arguments` (the program's name first) and gives the exit code.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> Exit {
    let command = help::grouped(Cli::command());
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    if let Some(message) = misspelt::suggestion(&command, &arguments) {
        return Failure::new(Exit::Usage, message).report(start::asks_for_json(&arguments));
    }
    let cli: Cli = match start::parse(command, &arguments) {
        Ok(cli) => cli,
        Err(exit) => return exit,
    };
    let context = cli.common.context(PROGRAM, FILES);
    let result = match cli.verb.unwrap_or_default() {
        Verb::Tour(args) => tour::run(&context, &args),
        Verb::Evaluate(args) => evaluate::run(&context, &args),
        Verb::Run(args) => run::run(&context, &args),
        Verb::Campaign(verb) => campaign::run(&context, &verb),
        Verb::Matrix(args) => matrix::run(&context, &args),
        Verb::Ablate(args) => ablate::run(&context, &args),
        Verb::Emit(args) => emit::run(&context, &args),
        Verb::Search(args) => search::run(&context, &args),
        Verb::Estimate(args) => estimate::run(&context, &args),
        Verb::Assess(args) => assess::run(&context, &args),
        Verb::Watch(args) => watch::run(&context, &args),
        Verb::Inspect(verb) => inspect::run(&context, &verb),
        Verb::Report(args) => report::run(&context, &args),
        Verb::Scenario(verb) => scenario::run(&context, &verb),
        Verb::Guest(verb) => guest::run(&context, &verb),
        Verb::Doctor => doctor::run(&context),
        Verb::Completions(args) => completions::run(Cli::command(), &args),
        Verb::Man(args) => man::run(Cli::command(), &args),
    };
    result.unwrap_or_else(|failure| failure.report(context.json))
}

impl Default for Verb {
    fn default() -> Self {
        Verb::Tour(tour::Args::default())
    }
}
