//! `lab records`: takes published figures again, keeps each with its origin, and writes the pages that carry them.

mod take;

use std::fs;
use std::path::{Path, PathBuf};

use parallel::progress::duration;
use runner::failure::{Exit, Failure};
use runner::{Context, out};
use serde::Serialize;

use self::take::{Origin, Session, take};
use crate::records::kept::{self, Kept};
use crate::records::list::{self, Entry, List, Tier};
use crate::records::{FOLDER, PAGE, page};

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
    /// Write the pages from the records that are there; run no command. Where a record's output is still there, its sentences are filled again.
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
        return show_list(context, &folder, &list, &chosen);
    }
    if args.pages {
        fill_again(&folder, args, &chosen)?;
        write_pages(&root, &list)?;
        return Ok(Exit::Fine);
    }
    // The output of a check is not that of the records.
    let out = if args.check { args.out.join("check") } else { args.out.clone() };
    let anew = args.check || args.again;
    let session = Session { context, root, out, anew, origin: Origin::new(args.holdsafe.as_deref(), list.seed)? };
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
        _ if args.pages => true,
        Wanted::Hour => entry.tier == Tier::Hour,
        Wanted::Long => entry.tier == Tier::Long,
        Wanted::All => true,
    };
    Ok(list.records.iter().filter(fits).collect())
}

/// The object of `--list` and of `--check`.
#[derive(Debug, Serialize)]
struct Listed<'a> {
    schema_version: u32,
    seed: u64,
    /// SHA-256 over the sources of this program.
    sources: &'a str,
    records: Vec<State<'a>>,
}

/// One record of it.
#[derive(Debug, Serialize)]
struct State<'a> {
    name: &'a str,
    minutes: f64,
    needs: &'a [String],
    /// The sources that it was taken of.
    of: Option<String>,
    /// Its figure.
    figure: Option<String>,
    /// Differences found by `--check`.
    differences: Vec<String>,
}

impl<'a> State<'a> {
    fn new(entry: &'a Entry, kept: Option<&Kept>) -> Self {
        State {
            name: &entry.name,
            minutes: entry.minutes,
            needs: &entry.needs,
            of: kept.map(|kept| kept.sources.clone()),
            figure: kept.map(|kept| kept.figure.clone()),
            differences: Vec::new(),
        }
    }
}

fn print_states(context: &Context, records: Vec<State<'_>>, seed: u64) -> Result<(), Failure> {
    let listed = Listed { schema_version: evidence::SCHEMA_VERSION, seed, sources: super::PROGRAM, records };
    if context.json { out::print_json("records", &listed) } else { Ok(()) }
}

fn show_list(context: &Context, folder: &Path, list: &List, chosen: &[&Entry]) -> Result<Exit, Failure> {
    let mut states = Vec::new();
    for entry in chosen {
        let kept = kept::read(folder, &entry.name).map_err(usage)?;
        let state = match &kept {
            Some(kept) if kept.sources == super::PROGRAM => "taken".to_owned(),
            Some(kept) => format!("of {} ({})", kept.commit, kept.day),
            None => "not taken".to_owned(),
        };
        let needs = if entry.needs.is_empty() { String::new() } else { format!(", needs {}", entry.needs.join(", ")) };
        if !context.json {
            out::say(format_args!("{:28} {:>4.0} min  {state}{needs}", entry.name, entry.minutes));
        }
        states.push(State::new(entry, kept.as_ref()));
    }
    if !context.json {
        out::say(format_args!("{} records, {}", chosen.len(), left(chosen)));
    }
    print_states(context, states, list.seed)?;
    Ok(Exit::Fine)
}

/// The minutes that the list states for these, as a text.
fn left(entries: &[&Entry]) -> String {
    duration(entries.iter().map(|entry| entry.minutes * 60.0).sum())
}

impl Session<'_> {
    /// Takes each record that is not there of these sources; one whose command gives no result does not end the rest.
    fn take_all(&self, chosen: &[&Entry]) -> Result<Exit, Failure> {
        let folder = self.root.join(FOLDER);
        let mut waiting = Vec::new();
        for entry in chosen {
            let kept = kept::read(&folder, &entry.name).map_err(usage)?;
            let is_there = |kept: &Kept| kept.sources == self.origin.sources && kept.seed == self.origin.seed;
            if self.anew || !kept.as_ref().is_some_and(is_there) {
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
        let mut states = Vec::new();
        let exit = self.each(&entries, |entry, again| {
            let Some((listed, before)) = pairs.iter().find(|(of, _)| of.name == entry.name) else { return Ok(()) };
            let state = State { differences: differences(entry, before, again), ..State::new(listed, Some(again)) };
            let verdict = if state.differences.is_empty() { "ok".to_owned() } else { state.differences.join("; ") };
            if !self.context.json {
                out::say(format_args!("{:28} {verdict}", entry.name));
            }
            states.push(state);
            Ok(())
        })?;
        let differ = states.iter().filter(|state| !state.differences.is_empty()).count();
        if !self.context.json {
            out::say(format_args!("{} records, {differ} differ", entries.len()));
        }
        print_states(self.context, states, self.origin.seed)?;
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

/// Fills the sentences of each record again whose output is still there.
fn fill_again(folder: &Path, args: &Args, chosen: &[&Entry]) -> Result<(), Failure> {
    for entry in chosen.iter().filter(|entry| args.out.join(&entry.name).is_dir()) {
        if let Some(kept) = kept::read(folder, &entry.name).map_err(usage)? {
            keep(folder, entry, &take::fill_again(&args.out, entry, kept)?)?;
        }
    }
    Ok(())
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
            out::note(name);
        }
    }
    out::note(PAGE);
    Ok(())
}
