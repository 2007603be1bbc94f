//! The start of a program with verbs: its services, the options that every verb takes, the log, and arguments that cannot be parsed.

use std::ffi::{OsStr, OsString};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{ArgAction, FromArgMatches};
use parallel::paint::{Stream, takes_colours};
use parallel::progress::{Talk, beside};

use crate::failure::{Exit, Failure};
use crate::shipped::{Shipped, ShippedFile};
use crate::{Context, interrupt};

/// Options of every command.
#[derive(Clone, Debug, clap::Args)]
pub struct Common {
    /// Print one JSON object on stdout.
    #[arg(long, global = true)]
    json: bool,
    /// Base seed; trial i has seed + i [default: 1; evaluate, matrix: drawn].
    #[arg(long, global = true)]
    seed: Option<u64>,
    /// Say more on stderr; twice for per-packet detail.
    #[arg(short, long, global = true, action = ArgAction::Count, conflicts_with = "quiet")]
    verbose: u8,
    /// Say nothing on stderr but failures.
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Folder of scenarios/, platforms/, policies/ [default: here, above, or built in].
    #[arg(long, global = true, value_name = "DIR")]
    root: Option<PathBuf>,
}

/// Base seed where none is named.
const FIRST_SEED: u64 = 1;

impl Common {
    /// Starts the log and watches for Ctrl-C; gives the context of a verb. `program` is the digest of the program's sources, `files` are those
    /// that it brings.
    pub fn context(self, program: &'static str, files: &'static [ShippedFile]) -> Context {
        start_log(&self);
        Context {
            json: self.json,
            seed: self.seed.unwrap_or(FIRST_SEED),
            seed_is_named: self.seed.is_some(),
            talk: if self.quiet { Talk::Quiet } else { Talk::Normal },
            root: self.root,
            stop: interrupt::watch(),
            started_us: link::clock::trace_us(),
            program,
            shipped: Shipped::new(files),
        }
    }
}

/// Main function of a program. With the first argument `service` it is a service of a live run or one of the program's `services`, else the
/// command line.
pub fn program(
    name: &str,
    services: impl FnOnce(&str) -> Option<Exit>,
    command: impl FnOnce(Vec<OsString>) -> Exit,
) -> ExitCode {
    // An argument need not be UTF-8: the command line reports its own arguments.
    let arguments: Vec<OsString> = std::env::args_os().collect();
    if let [_, service, service_name, ..] = arguments.as_slice()
        && service.as_os_str() == OsStr::new("service")
    {
        let service_name = service_name.to_string_lossy();
        let ended = live::service::main(&service_name)
            .or_else(|| services(&service_name).map(|exit| ExitCode::from(exit.code())));
        return ended.unwrap_or_else(|| {
            link::note!("{name}: no service `{service_name}`");
            ExitCode::from(Exit::Usage.code())
        });
    }
    ExitCode::from(command(arguments).code())
}

/// Parses `arguments`, the program's name first; gives the exit code where they request help or cannot be parsed.
///
/// # Errors
/// The exit code with which the program ends; the reason is printed.
pub fn parse<C: FromArgMatches>(command: clap::Command, arguments: &[OsString]) -> Result<C, Exit> {
    let parsed = command.try_get_matches_from(arguments).and_then(|matches| C::from_arg_matches(&matches));
    parsed.map_err(|error| {
        if error.use_stderr() {
            return usage(&error, asks_for_json(arguments));
        }
        // There is no remedy for a closed stdout.
        let _unread = error.print();
        Exit::Fine
    })
}

/// True if `--json` is among the arguments. It is read by hand, since arguments that cannot be parsed give no command
/// line.
pub fn asks_for_json(arguments: &[OsString]) -> bool {
    arguments.iter().take_while(|word| *word != "--").any(|word| word == "--json")
}

/// Reports arguments that cannot be parsed: on stderr in colours where it is a terminal, with `json` as an object on stdout.
fn usage(error: &clap::Error, json: bool) -> Exit {
    if !json {
        let _unread = error.print();
        return Exit::Usage;
    }
    let text = error.render().to_string();
    Failure::new(Exit::Usage, text.trim_start_matches("error: ")).report(true)
}

/// Stderr, with the line of progress out of the way of a line of the log.
struct LogLine;

impl std::io::Write for LogLine {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        beside(|| std::io::stderr().write(bytes))
    }

    fn flush(&mut self) -> std::io::Result<()> {
        std::io::stderr().flush()
    }
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
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_writer(|| LogLine);
    let started = log.with_ansi(takes_colours(Stream::Stderr)).try_init();
    if started.is_err() {
        tracing::debug!("a log writer was there already");
    }
}
