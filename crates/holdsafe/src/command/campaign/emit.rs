//! `holdsafe campaign emit ENGINE --partitions N --out DIR -- ARGUMENTS`: a campaign in partitions, as jobs of an engine that exists.
//!
//! Every engine starts the same two scripts: `part I` runs one partition, `merge` merges those that are there. They may run on
//! any machine that sees the folder under the same path, in any order and more than once: a partition resumes
//! where it was, and merging is a union. Queues, retries and machines are left to the engine.

use std::env;
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use clap::Parser;
use runner::failure::{Exit, Failure};
use runner::{Context, out, quoted};

use super::{run::Args as Run, space};

/// Jobs of one campaign; Slurm takes arrays up to 1,001 as it comes.
const MAX_PARTITIONS: u64 = 1_000;

#[derive(Debug, clap::Args)]
pub(in crate::command) struct Args {
    /// The engine.
    engine: Engine,
    /// Number of partitions.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MAX_PARTITIONS))]
    partitions: u64,
    /// Write scripts and jobs here; partitions and result come to lie here too.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Arguments of `holdsafe campaign run`.
    #[arg(last = true, required = true, value_name = "ARGUMENTS")]
    campaign: Vec<String>,
}

/// An engine of jobs.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Engine {
    /// GNU make, on this machine.
    Make,
    /// Slurm: an array, and a job after it.
    Slurm,
    /// HyperQueue, on its own workers or on those that Slurm or PBS gives it.
    Hyperqueue,
}

/// The arguments behind `--`, as `campaign run` reads them.
#[derive(Debug, clap::Parser)]
#[command(name = "campaign run", no_binary_name = true)]
struct Campaign {
    #[command(flatten)]
    args: Run,
}

/// Everything that the files are written from.
struct Jobs {
    partitions: u64,
    /// Cores of a partition.
    cores: u16,
    /// The folder, absolute.
    dir: String,
}

/// Answer for other programs.
#[derive(serde::Serialize)]
struct Emitted<'a> {
    jobs: u64,
    /// Trials of the largest.
    most_trials: u64,
    /// Command that starts them.
    start: &'a str,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let campaign = match Campaign::try_parse_from(&args.campaign) {
        Ok(Campaign { args }) => args,
        Err(help) if !help.use_stderr() => {
            out::say(format_args!("{}", help.render()));
            return Ok(Exit::Fine);
        }
        Err(error) => return Err(Failure::new(Exit::Usage, format!("behind `--`: {}", error.render()))),
    };
    if campaign.partition.is_some() || campaign.out.is_some() || campaign.sequential {
        let why = "--partition and --out are set for each job, and a sequential campaign cannot be partitioned";
        return Err(Failure::new(Exit::Usage, format!("behind `--`: {why}")));
    }
    // Its mistakes are told now, not by each job.
    let (plan, _) = space::lay_out(context, &campaign)?;
    if args.partitions > plan.total() {
        let message = format!("{} partitions of {} trials; take at most as many", args.partitions, plan.total());
        return Err(Failure::new(Exit::Usage, message));
    }
    out::unused(&args.out)?;
    let dir = out::directory(&args.out, Some(&args.out), "jobs")?.canonicalize()?;
    let jobs = Jobs { partitions: args.partitions, cores: campaign.jobs.unwrap_or(1), dir: utf8(&dir)?.to_owned() };
    let part = part_script(context, &jobs, &args.campaign, campaign.jobs.is_none())?;
    script(&dir, "part", &part)?;
    script(&dir, "merge", &merge_script(&jobs)?)?;
    let start = jobs.write(&dir, args.engine)?;
    let each = plan.total().div_ceil(args.partitions);
    if context.json {
        out::print_json("jobs", &Emitted { jobs: args.partitions, most_trials: each, start: &start })?;
    } else {
        out::say(format_args!("{} jobs of at most {each} trials; start them with:\n{start}", args.partitions));
    }
    Ok(Exit::Fine)
}

/// Runs one partition, in the place of the shell, so that an engine's signals reach it.
fn part_script(context: &Context, jobs: &Jobs, campaign: &[String], one_thread: bool) -> Result<String, Failure> {
    let root = quoted(utf8(&context.root()?.canonicalize()?)?);
    let mut command = format!("{} --root {root} --seed {} --quiet campaign run", program()?, context.seed);
    campaign.iter().for_each(|argument| _ = write!(command, " {}", quoted(argument)));
    if one_thread {
        command += " --jobs 1";
    }
    let (here, dir) = (quoted(utf8(&env::current_dir()?)?), quoted(&jobs.dir));
    Ok(format!(
        "#!/bin/sh\n# Partition $1 of {n}; what is finished is not run again.\n\
         cd {here} || exit 5\n\
         exec {command} --partition \"$1/{n}\" --out {dir}/parts/\"$1\"\n",
        n = jobs.partitions,
    ))
}

fn merge_script(jobs: &Jobs) -> Result<String, Failure> {
    let (program, dir) = (program()?, quoted(&jobs.dir));
    Ok(format!(
        "#!/bin/sh\n# Merges the partitions that are there; ends with the code of the campaign.\n\
         cd {here} || exit 5\nexec {program} campaign merge {dir}/parts/* --out {dir}/result\n",
        here = quoted(utf8(&env::current_dir()?)?),
    ))
}

impl Jobs {
    /// Writes the engine's own file, and says how to start it.
    fn write(&self, dir: &Path, engine: Engine) -> Result<String, Failure> {
        let folder = quoted(&self.dir);
        match engine {
            Engine::Make => {
                out::write_text(dir, "Makefile", &self.makefile())?;
                Ok(format!("make -C {folder} -j {}", parallel::cores()))
            }
            Engine::Slurm => {
                out::write_text(dir, "part.sbatch", &self.array())?;
                out::write_text(dir, "merge.sbatch", &self.after())?;
                script(dir, "submit", &self.submit())?;
                Ok(format!("{folder}/submit"))
            }
            Engine::Hyperqueue => {
                out::write_text(dir, "job.toml", &self.tasks()?)?;
                Ok(format!("hq job submit-file {folder}/job.toml"))
            }
        }
    }

    fn makefile(&self) -> String {
        let n = self.partitions;
        format!(
            "parts := $(shell seq 1 {n})\n\n\
             result/campaign.json: $(parts:%=parts/%/done)\n\t./merge\n\n\
             parts/%/done:\n\t./part $*\n\ttouch $@\n"
        )
    }

    fn array(&self) -> String {
        let Jobs { partitions, cores, dir } = self;
        format!(
            "#!/bin/sh\n#SBATCH --job-name=holdsafe\n#SBATCH --array=1-{partitions}\n#SBATCH --cpus-per-task={cores}\n\
             #SBATCH --requeue\n#SBATCH --output=/dev/null\n\
             exec {part} \"$SLURM_ARRAY_TASK_ID\" >{dir}/part-\"$SLURM_ARRAY_TASK_ID\".log 2>&1\n",
            part = quoted(&format!("{dir}/part")),
            dir = quoted(dir),
        )
    }

    fn after(&self) -> String {
        let dir = quoted(&self.dir);
        format!(
            "#!/bin/sh\n#SBATCH --job-name=holdsafe-merge\n#SBATCH --output=/dev/null\n\
             exec {dir}/merge >{dir}/merge.log 2>&1\n"
        )
    }

    fn submit(&self) -> String {
        let dir = quoted(&self.dir);
        format!(
            "#!/bin/sh\n# Submits the array, and the merging for when all of it has succeeded.\n\
             parts=$(sbatch --parsable {dir}/part.sbatch) || exit\n\
             exec sbatch --dependency=afterok:\"$parts\" {dir}/merge.sbatch\n"
        )
    }

    /// HyperQueue's job definition file.
    fn tasks(&self) -> Result<String, Failure> {
        let text = |value: String| toml::Value::String(value);
        let table = |of: Vec<(&str, toml::Value)>| {
            toml::Value::Table(of.into_iter().map(|(key, value)| (key.to_owned(), value)).collect())
        };
        let output = |name: String| text(format!("{}/{name}.log", self.dir));
        let cores = table(vec![("resources", table(vec![("cpus", i64::from(self.cores).into())]))]);
        let one = |i: u64| {
            let command = vec![text(format!("{}/part", self.dir)), text(i.to_string())];
            let logged = output(format!("part-{i}"));
            table(vec![
                ("id", (i as i64).into()),
                ("command", command.into()),
                ("stdout", logged.clone()),
                ("stderr", logged),
                ("request", vec![cores.clone()].into()),
            ])
        };
        let all: Vec<toml::Value> = (1..=self.partitions).map(|i| (i as i64).into()).collect();
        let merge = table(vec![
            ("id", 0.into()),
            ("command", vec![text(format!("{}/merge", self.dir))].into()),
            ("stdout", output("merge".to_owned())),
            ("stderr", output("merge".to_owned())),
            ("deps", all.into()),
        ]);
        let tasks: Vec<toml::Value> = (1..=self.partitions).map(one).chain([merge]).collect();
        let job = table(vec![("name", text("holdsafe".to_owned())), ("task", tasks.into())]);
        toml::to_string(&job).map_err(Failure::internal)
    }
}

/// This program, or another that the environment names.
fn program() -> Result<String, Failure> {
    let own = env::current_exe()?;
    Ok(format!("\"${{HOLDSAFE:-{}}}\"", in_default(utf8(&own)?)))
}

fn script(dir: &Path, name: &str, text: &str) -> Result<(), Failure> {
    out::write_text(dir, name, text)?;
    Ok(fs::set_permissions(dir.join(name), fs::Permissions::from_mode(0o755))?)
}

fn utf8(path: &Path) -> Result<&str, Failure> {
    let told = || format!("{}: a path in UTF-8 expected", path.display());
    OsStr::to_str(path.as_os_str()).ok_or_else(|| Failure::new(Exit::Usage, told()))
}

/// Within double quotes, as the value of a variable that is not set.
fn in_default(word: &str) -> String {
    let special = |c: char| matches!(c, '"' | '\\' | '$' | '`' | '}');
    word.chars().flat_map(|c| special(c).then_some('\\').into_iter().chain([c])).collect()
}
