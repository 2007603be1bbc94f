//! `holdsafe emit ENGINE --partitions N --out DIR -- COMMAND`: a campaign, matrix, ablation, estimate or search in partitions, as jobs
//! of an engine that exists.
//!
//! Every engine starts the same two scripts: `part I` runs one partition, `merge` puts those that are there together. They may run on
//! any machine that sees the folder under the same path, in any order and more than once: a partition resumes
//! where it was, and putting together is a union. A third, `look`, is for a person: the result and the page of a campaign under way.
//! Queues, retries and machines are left to the engine.

mod jobs;

use std::env;
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use clap::Parser;
use evidence::SCHEMA_VERSION;
use runner::failure::{Exit, Failure};
use runner::{Context, Root, out, quoted};

use self::jobs::{Engine, Jobs};
use super::{ablate, campaign, estimate, matrix, search};

/// Interval at which a browser reloads the page of an unfinished campaign, seconds.
const RENEW_S: u32 = 30;
/// Most jobs of one command: Slurm's default limit for an array is 1,001.
const MAX_PARTITIONS: u64 = 1_000;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The engine.
    engine: Engine,
    /// Number of partitions.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MAX_PARTITIONS))]
    partitions: u64,
    /// Write scripts and jobs here; partitions and result come to lie here too.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// `campaign run`, `matrix`, `ablate`, `estimate` or `search`, with its arguments.
    #[arg(last = true, required = true, value_name = "COMMAND")]
    command: Vec<String>,
}

/// The words behind `--`, as the program reads them.
#[derive(Debug, clap::Parser)]
#[command(name = "holdsafe", no_binary_name = true, disable_help_subcommand = true)]
struct Line {
    #[command(subcommand)]
    work: Work,
}

/// A command that comes in partitions.
#[derive(Debug, clap::Subcommand)]
enum Work {
    #[command(subcommand)]
    Campaign(campaign::Verb),
    Matrix(matrix::Args),
    Ablate(ablate::Args),
    Estimate(estimate::Args),
    Search(search::Args),
}

/// A command's share in its jobs.
pub(super) struct Shares {
    /// Pieces of work that no partition splits, and their name in the plural.
    pub(super) pieces: u64,
    pub(super) of: &'static str,
    /// Threads that the user asks for.
    pub(super) threads: Option<u16>,
    /// True if the user sets an option that each job sets for itself.
    pub(super) set: bool,
    /// True if it comes in rounds, each of which depends on the results of those before.
    pub(super) rounds: bool,
}

/// Answer of a partition to other programs.
#[derive(serde::Serialize)]
struct PartitionKept<'a> {
    schema_version: u32,
    directory: &'a Path,
}

/// Answer for other programs.
#[derive(serde::Serialize)]
struct Emitted<'a> {
    schema_version: u32,
    jobs: u64,
    /// Pieces of work of the largest.
    most: u64,
    /// Name of these pieces.
    of: &'a str,
    /// Command that starts them.
    start: &'a str,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let work = match Line::try_parse_from(&args.command) {
        Ok(Line { work }) => work,
        Err(help) if !help.use_stderr() => {
            out::say(format_args!("{}", help.render()));
            return Ok(Exit::Fine);
        }
        Err(error) => return Err(Failure::new(Exit::Usage, format!("behind `--`: {}", error.render()))),
    };
    let shares = work.shares(context)?;
    if shares.set {
        let reason = "--partition, --after, --from and --out are set for each job";
        return Err(Failure::new(Exit::Usage, format!("behind `--`: {reason}")));
    }
    if args.partitions > shares.pieces {
        let message =
            format!("{} partitions of {} {}; take at most as many", args.partitions, shares.pieces, shares.of);
        return Err(Failure::new(Exit::Usage, message));
    }
    out::check_unused(&args.out)?;
    let dir = out::directory(&args.out, Some(&args.out), "jobs")?.canonicalize()?;
    let result = work.result();
    let jobs =
        Jobs { partitions: args.partitions, cores: shares.threads.unwrap_or(1), dir: utf8(&dir)?.to_owned(), result };
    let command = command(&work.seeded(context), &args.command)?;
    let start = jobs.write(&dir, args.engine)?;
    script(&dir, "part", &part_script(&jobs, &command, &work.options(&shares, &jobs))?)?;
    script(&dir, "merge", &work.merge_script(&jobs, &command, shares.rounds.then_some(&start))?)?;
    if matches!(work, Work::Campaign(_)) {
        script(&dir, "look", &look_script(context, &jobs)?)?;
    }
    let most = shares.pieces.div_ceil(args.partitions);
    if context.json {
        let (schema_version, jobs) = (SCHEMA_VERSION, args.partitions);
        out::print_json("jobs", &Emitted { schema_version, jobs, most, of: shares.of, start: &start })?;
    } else {
        out::say(format_args!("{} jobs of at most {most} {}; start them with:\n{start}", args.partitions, shares.of));
    }
    Ok(Exit::Fine)
}

/// Prints the folder with the results of a partition.
pub(super) fn tell_kept(context: &Context, directory: &Path) -> Result<(), Failure> {
    if context.json {
        return out::print_json("partition", &PartitionKept { schema_version: SCHEMA_VERSION, directory });
    }
    let folder = quoted(&directory.to_string_lossy());
    out::say(format_args!("its results are kept; to put the parts together: the same command with --from {folder}"));
    Ok(())
}

impl Work {
    /// The context with the base seed that the command takes without one.
    fn seeded(&self, context: &Context) -> Context {
        if matches!(self, Work::Matrix(_)) { context.with_fresh_seed() } else { context.clone() }
    }

    /// The command's mistakes are told now, not by each job.
    fn shares(&self, context: &Context) -> Result<Shares, Failure> {
        match self {
            Work::Campaign(campaign::Verb::Run(args)) => args.shares(context),
            Work::Campaign(_) => {
                Err(Failure::new(Exit::Usage, "behind `--`: of campaigns only `campaign run` comes in partitions"))
            }
            Work::Matrix(args) => args.shares(context),
            Work::Ablate(args) => args.shares(context),
            Work::Estimate(args) => args.shares(context),
            Work::Search(args) => args.shares(context),
        }
    }

    /// Options of each partition besides its number and its folder.
    fn options(&self, shares: &Shares, jobs: &Jobs) -> String {
        let one_thread = match self {
            Work::Campaign(_) | Work::Estimate(_) | Work::Search(_) => " --jobs 1",
            Work::Matrix(_) | Work::Ablate(_) => " --threads 1",
        };
        let threads = if shares.threads.is_none() { one_thread } else { "" };
        let after = if shares.rounds { format!(" --after {}/result", quoted(&jobs.dir)) } else { String::new() };
        format!("{threads}{after}")
    }

    /// The file that it ends with.
    fn result(&self) -> &'static str {
        match self {
            Work::Campaign(_) => "campaign.json",
            Work::Matrix(_) => "matrix.json",
            Work::Ablate(_) => "ablation.json",
            Work::Estimate(_) => "estimate.json",
            Work::Search(_) => "result.json",
        }
    }

    /// Ends with the command's own code; after a round that left the claim open it starts the next, by the command `repeated`.
    fn merge_script(&self, jobs: &Jobs, command: &str, repeated: Option<&String>) -> Result<String, Failure> {
        let dir = quoted(&jobs.dir);
        let merge = match (self, repeated) {
            // Under Make this script is a recipe: `done` marks a finished partition, and the next `make` must not take
            // the options of the one that runs this.
            (Work::Campaign(_), Some(again)) => format!(
                "{} campaign merge {dir}/parts/* --out {dir}/result\ncode=$?\n\
                 grep -q '\"complete\": *false' {dir}/result/campaign.json || exit $code\n\
                 rm -f {dir}/parts/*/done\nunset MAKEFLAGS\nexec {again}\n",
                program()?
            ),
            (Work::Campaign(_), None) => {
                format!("exec {} campaign merge {dir}/parts/* --out {dir}/result\n", program()?)
            }
            (Work::Matrix(_) | Work::Ablate(_) | Work::Estimate(_) | Work::Search(_), _) => format!(
                "set --\nfor part in {dir}/parts/*; do\n    set -- \"$@\" --from \"$part\"\ndone\nexec {command} \"$@\" --out {dir}/result\n"
            ),
        };
        Ok(format!(
            "#!/bin/sh\n# Puts the partitions that are there together.\ncd {} || exit 5\n{merge}",
            working_directory()?
        ))
    }
}

/// The command line that every job begins with.
fn command(context: &Context, words: &[String]) -> Result<String, Failure> {
    let mut command = format!("{}{} --seed {} --quiet", program()?, root_option(context)?, context.seed);
    words.iter().for_each(|word| _ = write!(command, " {}", quoted(word)));
    Ok(command)
}

/// Runs one partition, in the place of the shell, so that an engine's signals reach it.
fn part_script(jobs: &Jobs, command: &str, options: &str) -> Result<String, Failure> {
    Ok(format!(
        "#!/bin/sh\n# Partition $1 of {n}; what is finished is not run again.\n\
         cd {here} || exit 5\n\
         exec {command}{options} --partition \"$1/{n}\" --out {dir}/parts/partition=\"$1\"\n",
        n = jobs.partitions,
        here = working_directory()?,
        dir = quoted(&jobs.dir),
    ))
}

/// The trials that are there now, merged apart from the result, and the page of them. It may run at any time.
fn look_script(context: &Context, jobs: &Jobs) -> Result<String, Failure> {
    let (dir, program, folder) = (quoted(&jobs.dir), program()?, working_directory()?);
    let root = root_option(context)?;
    Ok(format!(
        "#!/bin/sh\n# The campaign so far: result and page in so-far/.\ncd {folder} || exit 5\nset --\n\
         for part in {dir}/parts/*; do\n    test ! -f \"$part/plan.json\" || set -- \"$@\" \"$part\"\ndone\n\
         test $# -gt 0 || {{ echo 'no partition has begun'; exit 0; }}\n\
         {program} --quiet campaign merge \"$@\" --out {dir}/so-far\ncode=$?\n\
         test $code -eq 0 -o $code -eq 3 -o $code -eq 4 || exit $code\n\
         exec {program}{root} --quiet report {dir}/so-far --renew {RENEW_S} --out {dir}/so-far/report.html\n"
    ))
}

/// The root as an option of a job; none for built-in files, which each machine unpacks for itself.
fn root_option(context: &Context) -> Result<String, Failure> {
    match context.choose_root()? {
        Root::Named(root) | Root::Checkout(root) => Ok(format!(" --root {}", quoted(utf8(&root.canonicalize()?)?))),
        Root::BuiltIn(_) => Ok(String::new()),
    }
}

fn working_directory() -> Result<String, Failure> {
    Ok(quoted(utf8(&env::current_dir()?)?))
}

/// This program, or another that the environment names.
fn program() -> Result<String, Failure> {
    let own_path = env::current_exe()?;
    Ok(format!("\"${{HOLDSAFE:-{}}}\"", in_default(utf8(&own_path)?)))
}

fn script(dir: &Path, name: &str, text: &str) -> Result<(), Failure> {
    out::write_text(dir, name, text)?;
    Ok(fs::set_permissions(dir.join(name), fs::Permissions::from_mode(0o755))?)
}

fn utf8(path: &Path) -> Result<&str, Failure> {
    let error_text = || format!("{}: a path in UTF-8 expected", path.display());
    OsStr::to_str(path.as_os_str()).ok_or_else(|| Failure::new(Exit::Usage, error_text()))
}

/// Within double quotes, as the value of a variable that is not set.
fn in_default(word: &str) -> String {
    let special = |c: char| matches!(c, '"' | '\\' | '$' | '`' | '}');
    word.chars().flat_map(|c| special(c).then_some('\\').into_iter().chain([c])).collect()
}
