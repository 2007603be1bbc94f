//! `lab records`: takes published figures again, keeps each with its origin, and writes the pages that carry them.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use parallel::progress::duration;
use runner::failure::{Exit, Failure};
use runner::{Context, out};
use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::records::kept::{self, Claim, Kept, Quoted, Raw};
use crate::records::list::{self, Entry, List, Tier};
use crate::records::{FOLDER, PAGE, fill, page};

/// Programs that take `--json` and `--seed`.
const OWN: [&str; 2] = ["holdsafe", "lab"];
/// Exit codes that come with a result: every claim stands, an unexpected outcome, no evidence.
const WITH_RESULT: [i32; 3] = [0, 3, 4];
/// Longest output of one command.
const LONGEST_OUTPUT: u64 = 1 << 30;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Names of records; all of the tier by default.
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// Those that fit an hour together, the others, or all.
    #[arg(long, default_value = "hour")]
    tier: Wanted,
    /// Take again what is there of these sources.
    #[arg(long)]
    again: bool,
    /// Take what is there again and compare: a figure that repeats must be the same, of others the claims must hold. Keeps nothing.
    #[arg(long, conflicts_with = "again")]
    check: bool,
    /// List the records and their state; run no command.
    #[arg(long, conflicts_with_all = ["again", "check", "pages"])]
    list: bool,
    /// Write the pages from the records that are there; run no command.
    #[arg(long, conflicts_with_all = ["again", "check"])]
    pages: bool,
    /// The program `holdsafe`, of the same sources as this one; beside it by default.
    #[arg(long, value_name = "PATH")]
    holdsafe: Option<PathBuf>,
    /// Keep what the commands print here.
    #[arg(long, value_name = "DIR", default_value = "runs/records")]
    out: PathBuf,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Wanted {
    Hour,
    Long,
    All,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let root = context.root()?;
    let folder = root.join(FOLDER);
    let list = list::read(&folder).map_err(usage)?;
    let chosen = chosen(&list, args)?;
    if args.list {
        return show_list(&folder, &chosen);
    }
    if args.pages {
        write_pages(&root, &list)?;
        return Ok(Exit::Fine);
    }
    let session = Session { context, root, args, origin: Origin::of(args, list.seed)? };
    if args.check {
        return session.check(&chosen);
    }
    let exit = session.take_all(&chosen)?;
    write_pages(&session.root, &list)?;
    Ok(exit)
}

fn usage(reason: String) -> Failure {
    Failure::new(Exit::Usage, reason)
}

fn chosen<'a>(list: &'a List, args: &Args) -> Result<Vec<&'a Entry>, Failure> {
    if let Some(unknown) = args.names.iter().find(|name| list.records.iter().all(|entry| entry.name != **name)) {
        return Err(usage(format!(
            "no record `{unknown}` in {FOLDER}/{}: `lab records --list --tier all`",
            list::FILE
        )));
    }
    let fits = |entry: &&Entry| match args.tier {
        _ if !args.names.is_empty() => args.names.contains(&entry.name),
        Wanted::Hour => entry.tier == Tier::Hour,
        Wanted::Long => entry.tier == Tier::Long,
        Wanted::All => true,
    };
    Ok(list.records.iter().filter(fits).collect())
}

fn show_list(folder: &Path, chosen: &[&Entry]) -> Result<Exit, Failure> {
    for entry in chosen {
        let state = match kept::read(folder, &entry.name).map_err(usage)? {
            Some(kept) if kept.sources == super::PROGRAM => "taken".to_owned(),
            Some(kept) => format!("of {} ({})", kept.commit, kept.day),
            None => "not taken".to_owned(),
        };
        let needs = if entry.needs.is_empty() { String::new() } else { format!(", needs {}", entry.needs.join(", ")) };
        out::say(format_args!("{:28} {:>4.0} min  {state}{needs}", entry.name, entry.minutes));
    }
    out::say(format_args!("{} records, {}", chosen.len(), left(chosen)));
    Ok(Exit::Fine)
}

/// The minutes that the list states for these, as a text.
fn left(entries: &[&Entry]) -> String {
    duration(entries.iter().map(|entry| entry.minutes * 60.0).sum())
}

/// A call of the command.
struct Session<'a> {
    context: &'a Context,
    root: PathBuf,
    args: &'a Args,
    origin: Origin,
}

impl Session<'_> {
    /// Takes each record that is not there of these sources; one whose command gives no result does not end the rest.
    fn take_all(&self, chosen: &[&Entry]) -> Result<Exit, Failure> {
        let folder = self.root.join(FOLDER);
        let mut waiting = Vec::new();
        for entry in chosen {
            let kept = kept::read(&folder, &entry.name).map_err(usage)?;
            let is_there = |kept: &Kept| kept.sources == self.origin.sources && kept.seed == self.origin.seed;
            if self.args.again || !kept.as_ref().is_some_and(is_there) {
                waiting.push(*entry);
            }
        }
        self.each(&waiting, |entry, kept| keep(&folder, entry, kept))
    }

    /// Takes each record that is there again, and compares.
    fn check(&self, chosen: &[&Entry]) -> Result<Exit, Failure> {
        let folder = self.root.join(FOLDER);
        let mut pairs = Vec::new();
        for entry in chosen {
            pairs.extend(kept::read(&folder, &entry.name).map_err(usage)?.map(|kept| (*entry, kept)));
        }
        let entries: Vec<&Entry> = pairs.iter().map(|(entry, _)| *entry).collect();
        let mut differ = 0;
        let exit = self.each(&entries, |entry, again| {
            let before = pairs.iter().find(|(of, _)| of.name == entry.name);
            let reasons = before.map(|(_, before)| differences(entry, before, again)).unwrap_or_default();
            differ += usize::from(!reasons.is_empty());
            let verdict = if reasons.is_empty() { "ok".to_owned() } else { reasons.join("; ") };
            out::say(format_args!("{:28} {verdict}", entry.name));
            Ok(())
        })?;
        out::say(format_args!("{} records, {differ} differ", entries.len()));
        Ok(if differ > 0 { Exit::Unexpected } else { exit })
    }

    fn each(
        &self,
        waiting: &[&Entry],
        mut done: impl FnMut(&Entry, &Kept) -> Result<(), Failure>,
    ) -> Result<Exit, Failure> {
        let mut exit = Exit::Fine;
        for (i, entry) in waiting.iter().enumerate() {
            let rest = waiting.get(i..).unwrap_or_default();
            out::note(format_args!("{} of {}, {} left by the list: {}", i + 1, waiting.len(), left(rest), entry.name));
            match take(self, entry) {
                Ok(kept) => done(entry, &kept)?,
                Err(failure) if self.context.stop.is_requested() => return Err(failure),
                Err(failure) => {
                    out::note(format_args!("{}: {failure}", entry.name));
                    exit = Exit::NoEvidence;
                }
            }
        }
        Ok(exit)
    }
}

/// Differences beyond the record's tolerance.
fn differences(entry: &Entry, before: &Kept, again: &Kept) -> Vec<String> {
    let mut found = Vec::new();
    if entry.repeats && before.figure != again.figure {
        found.push(format!("`{}`, recorded `{}`", again.figure, before.figure));
    }
    let broken = again.claims.iter().filter(|claim| !claim.holds && !before.claims.contains(claim));
    found.extend(broken.map(|claim| format!("does not hold: {}", claim.claim)));
    found
}

fn keep(folder: &Path, entry: &Entry, kept: &Kept) -> Result<(), Failure> {
    let path = kept::file(folder, &entry.name);
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent)?;
    }
    fs::write(&path, serde_json::to_string_pretty(kept).map_err(Failure::internal)? + "\n")?;
    let broken = kept.claims.iter().filter(|claim| !claim.holds).count();
    let remark = if broken == 0 { String::new() } else { format!("; {broken} claims do not hold") };
    out::note(format_args!("  {} ({}){remark}", kept.figure, duration(kept.seconds)));
    Ok(())
}

/// The programs that are measured, and the host.
struct Origin {
    commit: String,
    sources: String,
    host: String,
    seed: u64,
    /// `PATH` with the two programs first.
    path: String,
}

impl Origin {
    fn of(args: &Args, seed: u64) -> Result<Self, Failure> {
        let lab = std::env::current_exe()?;
        let holdsafe = args.holdsafe.clone().unwrap_or_else(|| lab.with_file_name("holdsafe"));
        let said = Command::new(&holdsafe).arg("--version").output().map_err(|error| {
            let why = format!("{}: {error}; build it, or name it by --holdsafe", holdsafe.display());
            Failure::new(Exit::Environment, why)
        })?;
        let said = String::from_utf8_lossy(&said.stdout).into_owned();
        let line =
            |name: &str| said.lines().find_map(|line| line.strip_prefix(name)).unwrap_or_default().trim().to_owned();
        let (commit, sources) = (line("commit "), line("sources "));
        if sources != super::PROGRAM {
            let why = format!(
                "{} has the sources {sources}, this program {}: build both of one commit",
                holdsafe.display(),
                super::PROGRAM
            );
            return Err(Failure::new(Exit::Environment, why));
        }
        let folders = [holdsafe.canonicalize()?, lab].map(|file| file.parent().map(Path::to_owned).unwrap_or_default());
        let path = std::env::var("PATH").unwrap_or_default();
        let path =
            folders.iter().map(|folder| folder.display().to_string()).chain([path]).collect::<Vec<_>>().join(":");
        Ok(Origin { commit, sources, host: host(), seed, path })
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

/// Runs the commands of one record and fills its sentences.
fn take(session: &Session<'_>, entry: &Entry) -> Result<Kept, Failure> {
    let origin = &session.origin;
    let out = std::path::absolute(session.args.out.join(&entry.name))?;
    if out.exists() {
        fs::remove_dir_all(&out)?;
    }
    fs::create_dir_all(&out)?;
    let began = Instant::now();
    let (mut run, mut results, mut raws) = (Vec::new(), Vec::new(), Vec::new());
    for (i, command) in entry.run.iter().enumerate() {
        let line = command_line(command, origin.seed);
        let (exit, printed) = shell(session, &out, &line)?;
        fs::write(out.join(format!("{i}.out")), &printed)?;
        if !WITH_RESULT.contains(&exit) {
            return Err(Failure::new(Exit::NoEvidence, format!("`{line}` ended with code {exit} and no result")));
        }
        results.push(result(entry, command, &printed)?);
        raws.push(Raw { exit, bytes: printed.len() as u64, sha256: digest(&printed) });
        run.push(line);
    }
    let results = Value::from(results);
    let filled = |text: &str| fill::fill(text, &results).map_err(|reason| Failure::new(Exit::NoEvidence, reason));
    let claim = |claim: &String| {
        let holds = fill::compare(claim, &results).map_err(|reason| Failure::new(Exit::NoEvidence, reason))?;
        Ok(Claim { claim: claim.clone(), holds })
    };
    let quoted =
        |quote: &list::Quote| Ok::<_, Failure>(Quoted { page: quote.page.clone(), text: filled(&quote.text)? });
    Ok(Kept {
        version: kept::VERSION,
        run,
        commit: origin.commit.clone(),
        sources: origin.sources.clone(),
        host: origin.host.clone(),
        seed: origin.seed,
        day: day()?,
        seconds: began.elapsed().as_secs_f64().round(),
        results: raws,
        figure: filled(&entry.figure)?,
        sample: filled(&entry.sample)?,
        claims: entry.holds.iter().map(claim).collect::<Result<_, Failure>>()?,
        quotes: entry.quotes.iter().map(quoted).collect::<Result<_, _>>()?,
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
    command.args(["-c", line]).current_dir(root).env("PATH", &session.origin.path).env("OUT", out);
    command.env("SEED", session.origin.seed.to_string());
    command.env("HOLDSAFE_ROOT", root);
    let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn()?;
    let printed = child.stdout.take().ok_or_else(|| Failure::new(Exit::Internal, "no output"))?;
    let reader = std::thread::spawn(move || {
        let mut bytes = Vec::new();
        printed.take(LONGEST_OUTPUT).read_to_end(&mut bytes).map(|_| bytes)
    });
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        // Ctrl-C reaches the child too, which ends in its own way.
        std::thread::sleep(Duration::from_millis(50));
    };
    let printed = reader.join().map_err(|_| Failure::new(Exit::Internal, "the reader panicked"))??;
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

/// Writes docs/results.md and the quoted sentences.
fn write_pages(root: &Path, list: &List) -> Result<(), Failure> {
    let folder = root.join(FOLDER);
    let text = page::page(list, &folder, super::PROGRAM).map_err(usage)?;
    out::write_text(root, PAGE, &text)?;
    let pages: std::collections::BTreeSet<&str> =
        list.records.iter().flat_map(|entry| &entry.quotes).map(|quote| quote.page.as_str()).collect();
    for name in pages {
        let before = fs::read_to_string(root.join(name))?;
        let after = page::quoted(name, &before, list, &folder).map_err(usage)?;
        if after != before {
            out::write_text(root, name, &after)?;
            out::say(format_args!("{name}"));
        }
    }
    out::say(format_args!("{PAGE}"));
    Ok(())
}
