//! One record's measurement: its commands run by a shell, their output kept, and its sentences filled from it.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use runner::Context;
use runner::failure::{Exit, Failure};
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::super::PROGRAM;
use crate::records::fill;
use crate::records::kept::{self, Claim, Kept, Quoted, Raw};
use crate::records::list::{Entry, Quote};

/// Programs that take `--json` and `--seed`.
const OWN: [&str; 2] = ["holdsafe", "lab"];
/// Exit codes that come with a result: every claim stands, an unexpected outcome, no evidence.
const WITH_RESULT: [i32; 3] = [0, 3, 4];
/// Longest output of one command.
const LONGEST_OUTPUT: u64 = 1 << 30;

/// A call of the command.
pub(super) struct Session<'a> {
    pub(super) context: &'a Context,
    pub(super) root: PathBuf,
    /// Folder of the commands' output.
    pub(super) out: PathBuf,
    /// True if output of an earlier call is left aside.
    pub(super) anew: bool,
    pub(super) origin: Origin,
}

/// The programs that are measured, and the host.
pub(super) struct Origin {
    commit: String,
    pub(super) sources: String,
    host: String,
    pub(super) seed: u64,
    /// The two programs, by the names that commands call them by.
    programs: [(&'static str, PathBuf); 2],
}

impl Origin {
    /// Of the program `holdsafe` at this path, or beside this one.
    pub(super) fn new(holdsafe: Option<&Path>, seed: u64) -> Result<Self, Failure> {
        let lab = std::env::current_exe()?;
        let holdsafe = holdsafe.map_or_else(|| lab.with_file_name("holdsafe"), Path::to_owned);
        let said = Command::new(&holdsafe).arg("--version").output().map_err(|error| {
            let why = format!("{}: {error}; build it, or name it by --holdsafe", holdsafe.display());
            Failure::new(Exit::Environment, why)
        })?;
        let said = String::from_utf8_lossy(&said.stdout).into_owned();
        let line =
            |name: &str| said.lines().find_map(|line| line.strip_prefix(name)).unwrap_or_default().trim().to_owned();
        let (commit, sources) = (line("commit "), line("sources "));
        if sources != PROGRAM {
            let why = format!(
                "{} has the sources {sources}, this program {}: build both of one commit",
                holdsafe.display(),
                PROGRAM
            );
            return Err(Failure::new(Exit::Environment, why));
        }
        Ok(Origin {
            commit,
            sources,
            host: host(),
            seed,
            programs: [("holdsafe", holdsafe.canonicalize()?), ("lab", lab)],
        })
    }

    /// `PATH` with a folder first that has links to the two programs. Their own folders may hold others of these names.
    fn path(&self, out: &Path) -> Result<String, Failure> {
        let folder = std::path::absolute(out.join("programs"))?;
        fs::create_dir_all(&folder)?;
        for (name, program) in &self.programs {
            let link = folder.join(name);
            match fs::remove_file(&link) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error.into()),
                _ => std::os::unix::fs::symlink(program, &link)?,
            }
        }
        Ok(format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default()))
    }
}

/// Processor, cores and memory of this host.
fn host() -> String {
    let read = |file: &str| fs::read_to_string(file).unwrap_or_default();
    let (processors, memory) = (read("/proc/cpuinfo"), read("/proc/meminfo"));
    let model =
        processors.lines().find_map(|line| Some(line.strip_prefix("model name")?.split_once(": ")?.1.to_owned()));
    let kib =
        memory.lines().find_map(|line| line.strip_prefix("MemTotal:")?.trim().strip_suffix(" kB")?.parse::<f64>().ok());
    format!(
        "{}, {} cores, {:.0} GiB",
        model.unwrap_or_else(|| "unknown processor".to_owned()),
        parallel::cores(),
        kib.unwrap_or_default() / 1_048_576.0
    )
}

/// Runs the commands of one record, keeps their output in a folder of its own, and fills its sentences. Commands that an interrupted call of
/// the same program finished are not run again; the others go on where they can.
pub(super) fn take(session: &Session<'_>, entry: &Entry) -> Result<Kept, Failure> {
    let origin = &session.origin;
    let run: Vec<String> = entry.run.iter().map(|command| command_line(command, origin.seed)).collect();
    let out = std::path::absolute(session.out.join(&entry.name))?;
    open_folder(session, &out, &run)?;
    let (mut seconds, mut results, mut raws) = (0.0, Vec::new(), Vec::new());
    for (i, line) in run.iter().enumerate() {
        let ended = match Ended::read(&out, i) {
            Some(ended) => ended,
            None => measure(session, &out, i, line)?,
        };
        let printed = fs::read(output(&out, i))?;
        results.push(result(entry, line, &printed)?);
        raws.push(Raw { exit: ended.exit, bytes: printed.len() as u64, sha256: digest(&printed) });
        seconds += ended.seconds;
    }
    let kept = Kept {
        version: kept::VERSION,
        run,
        commit: origin.commit.clone(),
        sources: origin.sources.clone(),
        host: origin.host.clone(),
        seed: origin.seed,
        day: day()?,
        seconds: seconds.round(),
        results: raws,
        figure: String::new(),
        sample: String::new(),
        claims: Vec::new(),
        quotes: Vec::new(),
    };
    filled(entry, kept, &Value::from(results))
}

/// Makes the folder of a record, or keeps that of an interrupted call with the same program, seed and commands.
fn open_folder(session: &Session<'_>, out: &Path, run: &[String]) -> Result<(), Failure> {
    let file = out.join("origin");
    let origin = format!("{}\n{}\n", session.origin.sources, run.join("\n"));
    if out.exists() && (session.anew || fs::read_to_string(&file).ok().as_deref() != Some(&origin)) {
        fs::remove_dir_all(out)?;
    }
    fs::create_dir_all(out)?;
    Ok(fs::write(file, origin)?)
}

/// Runs one command, and keeps its output and its end.
fn measure(session: &Session<'_>, out: &Path, index: usize, line: &str) -> Result<Ended, Failure> {
    let began_us = link::clock::trace_us();
    let (exit, printed) = shell(session, out, line)?;
    fs::write(output(out, index), &printed)?;
    if !WITH_RESULT.contains(&exit) {
        return Err(Failure::new(Exit::NoEvidence, format!("`{line}` ended with code {exit} and no result")));
    }
    let ended = Ended { exit, seconds: link::clock::trace_us().saturating_sub(began_us) as f64 / 1e6 };
    fs::write(Ended::file(out, index), format!("{} {:.1}\n", ended.exit, ended.seconds))?;
    Ok(ended)
}

/// The end of a command: exit code and duration.
struct Ended {
    exit: i32,
    seconds: f64,
}

impl Ended {
    fn file(folder: &Path, index: usize) -> PathBuf {
        folder.join(format!("{index}.end"))
    }

    /// That of a command which an earlier call finished.
    fn read(folder: &Path, index: usize) -> Option<Self> {
        let text = fs::read_to_string(Self::file(folder, index)).ok()?;
        let (exit, seconds) = text.trim().split_once(' ')?;
        Some(Ended { exit: exit.parse().ok()?, seconds: seconds.parse().ok()? })
    }
}

/// A record filled again from the output that is kept of it, held to its digests: the list's words may have changed since.
pub(super) fn fill_again(out: &Path, entry: &Entry, kept: Kept) -> Result<Kept, Failure> {
    let mut results = Vec::new();
    for (i, (command, raw)) in entry.run.iter().zip(&kept.results).enumerate() {
        let file = output(&out.join(&entry.name), i);
        let printed = fs::read(&file)?;
        if digest(&printed) != raw.sha256 {
            return Err(Failure::new(Exit::NoEvidence, format!("{}: not the output of the record", file.display())));
        }
        results.push(result(entry, command, &printed)?);
    }
    filled(entry, kept, &Value::from(results))
}

/// File of a command's output.
fn output(folder: &Path, index: usize) -> PathBuf {
    folder.join(format!("{index}.out"))
}

fn filled(entry: &Entry, kept: Kept, results: &Value) -> Result<Kept, Failure> {
    let fault = |reason: String| Failure::new(Exit::NoEvidence, reason);
    let filled = |text: &str| fill::fill(text, results).map_err(fault);
    let claim = |claim: &String| {
        let holds = fill::compare(claim, results).map_err(fault)?;
        Ok(Claim { claim: claim.clone(), holds })
    };
    let quoted = |quote: &Quote| Ok::<_, Failure>(Quoted { page: quote.page.clone(), text: filled(&quote.text)? });
    Ok(Kept {
        figure: filled(&entry.figure)?,
        sample: filled(&entry.sample)?,
        claims: entry.holds.iter().map(claim).collect::<Result<_, Failure>>()?,
        quotes: entry.quotes.iter().map(quoted).collect::<Result<_, _>>()?,
        ..kept
    })
}

/// A command of our own programs gets `--json`, and the seed where it names none.
fn command_line(command: &str, seed: u64) -> String {
    let mut line = command.to_owned();
    if OWN.iter().any(|name| command.split_whitespace().next() == Some(name)) {
        if !command.contains("--seed ") {
            line += &format!(" --seed {seed}");
        }
        line += " --json";
    }
    line
}

/// Exit code and output of a command; progress stays on stderr. A request to stop ends it.
fn shell(session: &Session<'_>, out: &Path, line: &str) -> Result<(i32, Vec<u8>), Failure> {
    let mut command = Command::new("sh");
    let root = &session.root;
    command.args(["-c", line]).current_dir(root).env("PATH", session.origin.path(&session.out)?).env("OUT", out);
    command.env("SEED", session.origin.seed.to_string());
    command.env("HOLDSAFE_ROOT", root);
    let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn()?;
    let mut printed = Vec::new();
    if let Some(output) = child.stdout.take() {
        output.take(LONGEST_OUTPUT).read_to_end(&mut printed)?;
    }
    // Ctrl-C reaches the child too, which ends in its own way.
    let status = child.wait()?;
    if session.context.stop.is_requested() {
        return Err(Failure::new(Exit::Interrupted, "interrupted: what is finished is kept, the same command goes on"));
    }
    Ok((status.code().unwrap_or(-1), printed))
}

/// The object that a command of ours printed, or the numbers that the list takes from a text.
fn result(entry: &Entry, command: &str, printed: &[u8]) -> Result<Value, Failure> {
    let fault = |why: String| Failure::new(Exit::NoEvidence, format!("`{command}`: {why}"));
    if OWN.iter().any(|name| command.split_whitespace().next() == Some(name)) {
        return serde_json::from_slice(printed).map_err(|error| fault(format!("no JSON object: {error}")));
    }
    let text = String::from_utf8_lossy(printed);
    let mut numbers = serde_json::Map::new();
    for (name, pattern) in &entry.take {
        let pattern = regex::Regex::new(pattern).map_err(|error| fault(format!("{name}: {error}")))?;
        let Some(found) = pattern.captures(&text).and_then(|groups| groups.get(1)) else { continue };
        let value = found.as_str().replace(',', "");
        numbers.insert(name.clone(), value.parse::<f64>().map_or_else(|_| Value::from(value.clone()), Value::from));
    }
    Ok(Value::Object(numbers))
}

fn digest(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Today in UTC.
fn day() -> Result<String, Failure> {
    let said = Command::new("date").args(["-u", "+%Y-%m-%d"]).output()?;
    Ok(String::from_utf8_lossy(&said.stdout).trim().to_owned())
}
