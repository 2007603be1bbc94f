//! `holdsafe guest board add BOARD GUEST…`: trials of guests, each row signed. Finished trials are kept, so that it resumes.

use std::path::PathBuf;

use ::board::{Board, BoardRow, Contributor, ContributorKey, MAX_TRIALS, SignedRow};
use guest::Conduct;
use parallel::progress::Progress;
use runner::failure::{Exit, Failure};
use runner::leaderboard::{self, PlannedRow, Wanted};
use runner::trial_store::TrialStore;
use runner::{Context, out, plan};
use scenario::Scenario;
use scenario::world::Family;

use super::{load, note_failure, program, write};

/// Usage on one line: that of the parser is longer than help may be wide.
const USAGE: &str = "holdsafe guest board add [OPTIONS] --scenarios LIST --key KEY --name NAME BOARD GUEST...";

#[derive(Debug, clap::Args)]
#[command(override_usage = USAGE)]
pub(in crate::command) struct Args {
    /// The leaderboard; a new file where there is none.
    #[arg(value_name = "BOARD")]
    file: PathBuf,
    /// Guest files; `follower` is built in.
    #[arg(required = true, value_name = "GUEST")]
    guests: Vec<PathBuf>,
    /// Scenarios, by name or by file.
    #[arg(long, required = true, value_delimiter = ',', value_name = "LIST")]
    scenarios: Vec<String>,
    /// The contributor's key, as `board key` writes it.
    #[arg(long, value_name = "KEY")]
    key: PathBuf,
    /// The contributor's name.
    #[arg(long, value_name = "NAME")]
    name: String,
    /// Trials of each row; trial i has seed + i.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..=MAX_TRIALS as u64))]
    trials: u64,
    /// A shipped platform in place of the scenarios' own, by name.
    #[arg(long, value_name = "PLATFORM")]
    platform: Option<String>,
    /// Drawn worlds of this family in place of the scenarios' own scenes: trial i in the world of seed + i.
    #[arg(long, value_name = "FAMILY", value_parser = family)]
    world: Option<Family>,
    /// Keep finished trials here, and resume from there [default: runs/board]. That of `guest compare` will do.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

fn family(text: &str) -> Result<Family, String> {
    let families = || Family::ALL.map(Family::name).join(", ");
    Family::from_name(text).ok_or_else(|| format!("no family `{text}`; there are: {}", families()))
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let key = leaderboard::read_key(&args.key)?;
    let drafts = drafts(context, args, &load(&args.file)?, &key)?;
    let default = context.runs_folder()?.join("board");
    let dir = out::directory(&default, Some(args.out.as_deref().unwrap_or(&default)), "board")?;
    let store = TrialStore::open(&dir)?;
    let progress = Progress::new("board", drafts.iter().map(|(entry, _)| entry.trial_count()).sum(), context.talk);
    let mut rows = Vec::new();
    for (entry, draft) in drafts {
        let trials = entry.run(context, Some(&store), &progress)?;
        note_failure(&draft.title(), &trials);
        let row = leaderboard::completed(draft, &trials);
        rows.push(SignedRow::new(row, &key).map_err(|fault| Failure::new(Exit::Usage, fault.to_string()))?);
    }
    progress.finish();
    // Another command may have added rows in the meantime.
    let (mut board, added) = (load(&args.file)?, rows.len());
    rows.into_iter().try_for_each(|row| board.add(row)).map_err(|error| leaderboard::failure(&args.file, &error))?;
    write(context, &args.file, &board, added)
}

/// Every row before its trials run. A row that is there already, or cannot be signed, is refused here, and not after hours.
fn drafts(
    context: &Context,
    args: &Args,
    board: &Board,
    key: &ContributorKey,
) -> Result<Vec<(PlannedRow, BoardRow)>, Failure> {
    let files = args.scenarios.iter().map(|name| plan::file_of(context, name)).collect::<Result<Vec<_>, _>>()?;
    let scenarios = files.iter().map(|file| Ok(context.scenario(file)?)).collect::<Result<Vec<Scenario>, Failure>>()?;
    let platform = args.platform.as_ref().map(|name| plan::platform_of(context, name)).transpose()?;
    let contributor = Contributor { name: args.name.clone(), key: key.public() };
    let draft = |entry: &PlannedRow| entry.draft(program(context), contributor.clone());
    let mut parts = Vec::new();
    for (guest, conduct) in args.guests.iter().flat_map(|guest| [(guest, Conduct::Bare), (guest, Conduct::Guarded)]) {
        let (platform, family) = (platform.as_ref(), args.world);
        let wanted = Wanted { guest, conduct, platform, cell: None, family, seed: context.seed, n: args.trials };
        let entries = leaderboard::entries(context, &wanted, &scenarios)?;
        entries.iter().try_for_each(|entry| check_new(args, board, &draft(entry)?))?;
        parts.push(entries);
    }
    let mut drafts = Vec::new();
    for mut entries in parts {
        leaderboard::probe(&mut entries)?;
        for entry in entries {
            let row = draft(&entry)?;
            drafts.push((entry, row));
        }
    }
    Ok(drafts)
}

fn check_new(args: &Args, board: &Board, draft: &BoardRow) -> Result<(), Failure> {
    ::board::check_draft(draft).map_err(|fault| Failure::new(Exit::Usage, format!("{}: {fault}", draft.title())))?;
    let Some(number) = board.number_of(draft) else { return Ok(()) };
    let (file, title) = (args.file.display(), draft.title());
    Err(Failure::new(Exit::Usage, format!("{file}: row {number} is {title} already; name another --seed")))
}
