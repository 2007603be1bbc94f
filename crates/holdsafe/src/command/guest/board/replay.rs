//! `holdsafe guest board replay BOARD --row N`: the trials of a row again, with the guest that is here.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use ::board::{BoardRow, Replay, ReplayVerdict};
use evidence::SCHEMA_VERSION;
use parallel::progress::Progress;
use runner::closing::Closing;
use runner::failure::{Exit, Failure};
use runner::leaderboard::{self, PlannedRow, Wanted};
use runner::{Context, out, plan};
use scenario::world::Family;
use serde::Serialize;

use super::{board_command, note_failure, program};

#[derive(Debug, clap::Args)]
pub(in crate::command) struct Args {
    /// The leaderboard.
    #[arg(value_name = "BOARD")]
    file: PathBuf,
    /// Number of the row, as `show` prints it.
    #[arg(long, value_name = "N")]
    row: usize,
    /// The guest's file [default: guests/NAME/guest.toml, or the built-in one].
    #[arg(long, value_name = "GUEST.TOML")]
    autonomy: Option<PathBuf>,
    /// The scenario's file, where it is not a shipped one.
    #[arg(long, value_name = "SCENARIO.TOML")]
    scenario: Option<PathBuf>,
    /// Only the first trials [default: all].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    trials: Option<u64>,
}

#[derive(Serialize)]
struct ReplayObject {
    schema_version: u32,
    row: usize,
    title: String,
    /// Differences between the row's inputs and those at hand.
    remarks: Vec<String>,
    #[serde(flatten)]
    replay: Replay,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let board = leaderboard::verified(&args.file)?;
    let row = board.row(args.row).ok_or_else(|| {
        let (file, rows) = (args.file.display(), board.rows().len());
        Failure::new(Exit::Usage, format!("{file}: row 1 to {rows} expected, got {}", args.row))
    })?;
    let mut entries = entries(context, args, row)?;
    let draft = |entry: &PlannedRow| entry.draft(program(context), row.contributor.clone());
    // The guest does not run before it is known to be the row's.
    entries.iter().try_for_each(|entry| check_same(row, &draft(entry)?))?;
    leaderboard::probe(&mut entries)?;
    let [entry] = &entries[..] else { return Err(different("cells", "one", &entries.len().to_string())) };
    let local = draft(entry)?;
    let remarks = remarks(row, &local);
    let progress = Progress::new("replay", entry.trial_count(), context.talk);
    let trials = entry.run(context, None, &progress)?;
    progress.finish();
    note_failure(&row.title(), &trials);
    let trials = leaderboard::completed(local, &trials).trials;
    let replay = Replay::new(row, &trials);
    let exit = if replay.verdict == ReplayVerdict::Differs { Exit::Unexpected } else { Exit::Fine };
    let object = ReplayObject { schema_version: SCHEMA_VERSION, row: args.row, title: row.title(), remarks, replay };
    if context.json {
        out::print_json("board-replay", &object)?;
    } else {
        print_result(context, &args.file, &object);
    }
    Ok(exit)
}

/// The row's trials, or the first of them, planned from the files that are here.
fn entries(context: &Context, args: &Args, row: &BoardRow) -> Result<Vec<PlannedRow>, Failure> {
    let root = context.root()?;
    let default = || match row.guest.files.is_empty() {
        true => PathBuf::from(runner::guest_options::FOLLOWER),
        false => root.join("guests").join(&row.guest.name).join("guest.toml"),
    };
    let guest = args.autonomy.clone().unwrap_or_else(default);
    let shipped = || plan::file_of(context, &row.scenario);
    let unshipped =
        |e: Failure| Failure::new(e.exit(), format!("{e}; --scenario names the file of one that is not shipped"));
    let file = args.scenario.clone().map_or_else(|| shipped().map_err(unshipped), Ok)?;
    let scenario = context.scenario(&file)?;
    let platform = (row.platform != scenario.platform.as_str()).then(|| plan::platform_of(context, &row.platform));
    let platform = platform.transpose()?;
    let n = (row.trials.len() as u64).min(args.trials.unwrap_or(u64::MAX));
    let wanted = Wanted {
        guest: Path::new(&guest),
        conduct: row.conduct,
        platform: platform.as_ref(),
        cell: row.cell.as_deref(),
        family: row.world.as_deref().map(family).transpose()?,
        seed: row.seed,
        n: row.trials.len() as u64,
    };
    let entries = leaderboard::entries(context, &wanted, &[scenario])?;
    Ok(entries.into_iter().map(|entry| entry.with_trials(n)).collect())
}

fn family(name: &str) -> Result<Family, Failure> {
    let unknown =
        || Failure::new(Exit::Usage, format!("no family of worlds `{name}` here; a newer holdsafe may have it"));
    Family::from_name(name).ok_or_else(unknown)
}

fn different(part: &str, expected: &str, got: &str) -> Failure {
    let message = format!(
        "{part}: the row has {expected}, here is {got}; build the row's commit, or name the file that it was made with"
    );
    Failure::new(Exit::Usage, message)
}

/// Checks that the trials are of the row's guest and inputs.
fn check_same(row: &BoardRow, local: &BoardRow) -> Result<(), Failure> {
    let (stated_file, local_file) = (digest(row, ""), digest(local, ""));
    let parts = [
        ("guest", row.guest.name.as_str(), local.guest.name.as_str()),
        ("guest's file", &stated_file, &local_file),
        ("scenario", &row.inputs.scenario, &local.inputs.scenario),
        ("policy", &row.inputs.policy, &local.inputs.policy),
        ("platform", &row.inputs.platform, &local.inputs.platform),
    ];
    let other = parts.into_iter().find(|(_, stated, got)| stated != got);
    other.map_or(Ok(()), |(part, stated, got)| Err(different(part, stated, got)))
}

/// Digest of a file of the guest.
fn digest(row: &BoardRow, name: &str) -> String {
    row.guest.files.get(name).map_or("none", String::as_str).to_owned()
}

/// Differences that a comparison survives, since it compares logs.
fn remarks(row: &BoardRow, local: &BoardRow) -> Vec<String> {
    let mut remarks = Vec::new();
    if row.program.sources != local.program.sources {
        let short = |row: &BoardRow| row.program.sources.chars().take(12).collect::<String>();
        let (stated, got, commit) = (short(row), short(local), &row.program.commit);
        remarks.push(format!("another program: sources {stated} in the row (commit {commit}), {got} here"));
    }
    let names: BTreeSet<&String> = row.guest.files.keys().chain(local.guest.files.keys()).collect();
    let differing = names.into_iter().filter(|name| digest(row, name) != digest(local, name));
    remarks.extend(differing.map(|name| format!("another file {name} of the guest")));
    if row.repeatable != local.repeatable {
        let word = |repeatable| if repeatable { "repeatable" } else { "not repeatable" };
        remarks.push(format!("the guest is {} here, {} in the row", word(local.repeatable), word(row.repeatable)));
    }
    remarks
}

fn print_result(context: &Context, file: &Path, object: &ReplayObject) {
    let ReplayObject { row, title, remarks, replay, .. } = object;
    out::show(format_args!("row {row}: {title}"));
    remarks.iter().for_each(|remark| out::show(format_args!("remark: {remark}")));
    for pair in &replay.classes {
        let (class, stated, got) = (pair.class.name(), pair.stated.hits, pair.got.hits);
        out::show(format_args!("{class}: {stated} in the row, {got} here"));
    }
    for differing in &replay.differing {
        let (stated, got) = (differing.stated.name(), differing.got.name());
        out::show(format_args!("seed {}: {stated} in the row, {got} here, with another log", differing.seed));
    }
    let verdict = match replay.verdict {
        ReplayVerdict::Reproduced => "reproduced",
        ReplayVerdict::WithinInterval => "not repeatable; the 95 % intervals of each class meet",
        ReplayVerdict::Differs => "differs",
    };
    let text =
        format!("{} of {} trials run, {} with the row's log: {verdict}", replay.trials, replay.of, replay.same_logs);
    let next = ["show", "verify"].map(|verb| board_command(context, verb, file));
    Closing::new(context).part(text).print(next);
}
