//! The `holdsafe` command: its arguments, its exit codes, one verb a file.
//!
//! Results go to stdout, progress, logs and failures to stderr. What verbs share is in `runner`.

mod ablate;
mod beside;
mod campaign;
mod catalogue;
mod cite;
mod console;
mod curve;
mod dataset;
mod diff;
mod doctor;
mod explain;
mod export;
mod follow;
mod frame;
mod interrupt;
mod live;
mod matrix;
mod merge;
mod onlook;
mod rare;
mod reference;
mod replay;
mod report;
mod reproduce;
mod run;
mod scenario;
mod scheduling;
mod search;
mod sensors;
mod verify;
mod watch;

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{ArgAction, Parser, Subcommand};
use lab::bench;
use parallel::progress::Talk;
use runner::Context;
use runner::failure::{Exit, Failure, colour};

/// SHA-256 over the sources that this program was built from, whatever the build.
const PROGRAM: &str = env!("HOLDSAFE_PROGRAM");

const EXIT_CODES: &str = "Exit codes:
  0    every trial within its expected classes
  1    internal error
  2    usage, or a file that cannot be used
  3    an outcome that was not expected
  4    nothing ran, an unexpected INVALID, or a recorded run that is INVALID (--unverified: the command's own code)
  5    the environment lacks something (`holdsafe doctor` says what)
  130  interrupted";

/// Does trust decay safely? Without a command: the reference evaluation, every scenario in the twin and live.
#[derive(Debug, Parser)]
#[command(name = "holdsafe", version, after_help = EXIT_CODES, max_term_width = 110)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    verb: Option<Verb>,
    /// Options of every command.
    #[command(flatten)]
    common: Common,
}

/// Options of every command.
#[derive(Clone, Debug, clap::Args)]
pub struct Common {
    /// Print one JSON object on stdout.
    #[arg(long, global = true)]
    json: bool,
    /// Base seed; trial i has seed + i.
    #[arg(long, global = true, default_value_t = 1)]
    seed: u64,
    /// Say more on stderr; twice for per-packet detail.
    #[arg(short, long, global = true, action = ArgAction::Count, conflicts_with = "quiet")]
    verbose: u8,
    /// Say nothing on stderr but failures.
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Directory with scenarios/, platforms/ and policies/; found from here upwards when not given.
    #[arg(long, global = true, value_name = "DIR")]
    root: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Run scenarios, in the twin or live, and judge them.
    Run(run::Args),
    /// Run many trials over grids and distributions, and say what they show of a claim.
    Campaign(campaign::Args),
    /// Put the parts of a campaign together.
    Merge(merge::Args),
    /// Take one value of a scenario through its range: shares, latencies, the smallest value noticed before harm.
    Curve(curve::Args),
    /// Run one scenario live and show what the operator sees.
    Live(live::Args),
    /// Print what the console of a live run shows, from another terminal.
    Watch(watch::Args),
    /// Show what the sensors of a live run's unit give, in a window beside the operator's.
    Sensors(sensors::Args),
    /// Open a recorded run in the console's window: to look at, not to act in.
    Console(console::Args),
    /// Measure.
    #[command(subcommand)]
    Bench(bench::Bench),
    /// Feed the cores of a run what they were fed: every byte has to come out again, or what would another policy have changed?
    Replay(replay::Args),
    /// Set two runs side by side: where did each service first decide otherwise?
    Diff(diff::Args),
    /// Say why the platform changed its mode, by what its services logged.
    Explain(explain::Args),
    /// Write a run as an MCAP file that Foxglove and other viewers open: scene, images, detections, tracks, modes and log.
    Export(export::Args),
    /// Make one HTML page of results and recorded runs, for a reviewer, and its figures as files.
    Report(report::Args),
    /// Run the shipped scenarios in the twin again, and say whether they come to what they came to when they were committed.
    Reproduce(reproduce::Args),
    /// Say how to cite the results of a run: program, seed and digests, as BibTeX.
    Cite(cite::Args),
    /// Check the evidence of a run: chains and seals.
    Verify(verify::Args),
    /// Scenario files.
    #[command(subcommand)]
    Scenario(scenario::Verb),
    /// Run every row of the threat catalogue and print the threat matrix.
    Matrix(matrix::Args),
    /// Run every attack with each check waived in turn: what each is worth, and what it costs.
    Ablate(ablate::Args),
    /// Search for attacks that break something, and shrink each to the smallest that does.
    Search(search::Args),
    /// Estimate how likely a run is to come to what almost never happens, by multilevel splitting.
    Rare(rare::Args),
    /// Write labelled frames of random scenes, for a detector to learn from or be judged on; or draw a contact sheet.
    Dataset(dataset::Args),
    /// Print the threat catalogue: docs/reference/threats.md, or its rows with --json.
    Catalogue(catalogue::Args),
    /// Say whether everything that a run needs is here.
    Doctor,
}

/// Runs the command line `arguments` (the program's name first) and gives the exit code.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> Exit {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let cli = match Cli::try_parse_from(&arguments) {
        Ok(cli) => cli,
        Err(error) if error.use_stderr() => {
            // `--json` is read by hand: arguments that cannot be parsed give no `Cli`.
            let json = arguments.iter().take_while(|word| *word != "--").any(|word| word == "--json");
            return usage(&error, json);
        }
        Err(help) => {
            // A closed stdout needs no help.
            let _unread = help.print();
            return Exit::Fine;
        }
    };
    start_log(&cli.common);
    let context = Context {
        json: cli.common.json,
        seed: cli.common.seed,
        talk: if cli.common.quiet { Talk::Quiet } else { Talk::Normal },
        root: cli.common.root,
        stop: interrupt::watch(),
        program: PROGRAM,
    };
    let result = match cli.verb {
        None => reference::run(&context),
        Some(Verb::Run(args)) => run::run(&context, &args),
        Some(Verb::Campaign(args)) => campaign::run(&context, &args),
        Some(Verb::Merge(args)) => merge::run(&context, &args),
        Some(Verb::Curve(args)) => curve::run(&context, &args),
        Some(Verb::Live(args)) => live::run(&context, &args),
        Some(Verb::Watch(args)) => watch::run(&context, &args),
        Some(Verb::Sensors(args)) => sensors::run(&context, &args),
        Some(Verb::Console(args)) => console::run(&context, &args),
        Some(Verb::Bench(bench)) => bench::run(&context, &bench),
        Some(Verb::Replay(args)) => replay::run(&context, &args),
        Some(Verb::Diff(args)) => diff::run(&context, &args),
        Some(Verb::Explain(args)) => explain::run(&context, &args),
        Some(Verb::Export(args)) => export::run(&context, &args),
        Some(Verb::Reproduce(args)) => reproduce::run(&context, &args),
        Some(Verb::Cite(args)) => cite::run(&context, &args),
        Some(Verb::Report(args)) => report::run(&context, &args),
        Some(Verb::Verify(args)) => verify::run(&context, &args),
        Some(Verb::Scenario(verb)) => scenario::run(&context, &verb),
        Some(Verb::Matrix(args)) => matrix::run(&context, &args),
        Some(Verb::Ablate(args)) => ablate::run(&context, &args),
        Some(Verb::Search(args)) => search::run(&context, &args),
        Some(Verb::Rare(args)) => rare::run(&context, &args),
        Some(Verb::Dataset(args)) => dataset::run(&context, &args),
        Some(Verb::Catalogue(args)) => catalogue::run(&context, &args),
        Some(Verb::Doctor) => doctor::run(&context),
    };
    result.unwrap_or_else(|failure| failure.tell(context.json))
}

/// Reports arguments that cannot be parsed: on stderr in colours where it is a terminal, with `json` as an object on stdout.
fn usage(error: &clap::Error, json: bool) -> Exit {
    if !json {
        let _unread = error.print();
        return Exit::Usage;
    }
    let text = error.render().to_string();
    Failure::new(Exit::Usage, text.trim_start_matches("error: ")).tell(true)
}

fn start_log(common: &Common) {
    let level = match (common.quiet, common.verbose) {
        (true, _) => "error",
        // The DTLS library warns of every extension that it does not know, for each hello of a storm.
        (false, 0) => "warn,dtls=error",
        (false, 1) => "debug",
        (false, _) => "trace",
    };
    let filter = tracing_subscriber::EnvFilter::try_from_default_env();
    let filter = filter.unwrap_or_else(|_| tracing_subscriber::EnvFilter::new(level));
    let started =
        tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).with_ansi(colour()).try_init();
    if started.is_err() {
        tracing::debug!("a log writer was there already");
    }
}
