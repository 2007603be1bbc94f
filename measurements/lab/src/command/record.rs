//! `lab record NAME COMMAND…`: runs a measurement and keeps its object with command, commit and machine, for docs/results.md.

use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use runner::failure::{Exit, Failure};
use runner::{Context, out};

use crate::results::{FOLDER, Record, file};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Name of the record: docs/results/NAME.json.
    #[arg(value_name = "NAME", value_parser = name)]
    name: String,
    /// The command, of `lab` or `holdsafe`; `--json` is added to it.
    #[arg(value_name = "COMMAND", required = true, trailing_var_arg = true, allow_hyphen_values = true)]
    command: Vec<String>,
}

fn name(text: &str) -> Result<String, String> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    let fits = !text.is_empty() && text.chars().all(plain);
    fits.then(|| text.to_owned()).ok_or_else(|| "lower-case letters, digits and hyphens are expected".to_owned())
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let root = context.root()?;
    let folder = root.join(FOLDER);
    let (program, words) = args.command.split_first().ok_or_else(|| Failure::new(Exit::Usage, "no command"))?;
    if !["lab", "holdsafe"].contains(&program.as_str()) {
        return Err(Failure::new(Exit::Usage, format!("`{program}` is neither `lab` nor `holdsafe`")));
    }
    // The commit is read first: a measurement takes long, and the tree may move on meanwhile.
    let (commit, machine) = (commit(&root)?, machine());
    let beside = std::env::current_exe()?.with_file_name(program);
    let mut measurement = Command::new(&beside);
    measurement.arg("--root").arg(&root).args(words).arg("--json").stderr(Stdio::inherit());
    let output = measurement.output().map_err(|error| {
        Failure::new(Exit::Environment, format!("{}: {error}; build it with the same profile", beside.display()))
    })?;
    let result = serde_json::from_slice(&output.stdout)
        .map_err(|error| Failure::new(Exit::NoEvidence, format!("`{program}` printed no JSON object: {error}")))?;
    let record = Record { command: args.command.join(" "), exit: output.status.code(), commit, machine, result };
    let path = file(&folder, &args.name);
    fs::write(&path, serde_json::to_string_pretty(&record).map_err(Failure::internal)? + "\n")?;
    out::say(format_args!("{}", path.display()));
    Ok(Exit::Fine)
}

/// The commit that is checked out, with a plus where tracked files differ from it.
fn commit(root: &Path) -> Result<String, Failure> {
    let id = git(root, &["rev-parse", "--short", "HEAD"])?;
    let changed = !git(root, &["status", "--porcelain", "--untracked-files=no"])?.is_empty();
    Ok(if changed { format!("{id}+") } else { id })
}

fn git(root: &Path, arguments: &[&str]) -> Result<String, Failure> {
    let words = arguments.iter().map(OsString::from);
    let output = Command::new("git").arg("-C").arg(root).args(words).output();
    let output = output.map_err(|error| Failure::new(Exit::Environment, format!("git: {error}")))?;
    if !output.status.success() {
        let reason = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        return Err(Failure::new(Exit::Environment, format!("git {}: {reason}", arguments.join(" "))));
    }
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Processor and number of cores of this host.
fn machine() -> String {
    let processors = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = processors.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    format!("{}, {} cores", model.map_or("unknown processor", |(_, name)| name), parallel::cores())
}
