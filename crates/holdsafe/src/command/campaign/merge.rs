//! `holdsafe campaign merge DIR…`: merges the parts of a campaign, in any order and any number of times.
//!
//! A campaign's folder is a set of trials, and merging is the union of such sets, so repeated or overlapping parts
//! change no result. Parts of another campaign are refused, and so is a trial that came out differently in two of them.

use std::path::PathBuf;

use results::campaign::partition::Partition;

use super::journal::{Journal, each_row, read_plan, same};
use super::run::{conclude, exit, print_result};
use runner::failure::{Exit, Failure};
use runner::{Context, out};

#[derive(Debug, clap::Args)]
pub(in crate::command) struct Args {
    /// Folders that `holdsafe campaign run --out DIR` made.
    #[arg(required = true, value_name = "DIR")]
    parts: Vec<PathBuf>,
    /// Folder of the merged campaign; trials of the same campaign already there are part of it.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let first = args.parts.first().ok_or_else(|| Failure::new(Exit::Usage, "nothing to merge"))?;
    let plan = read_plan(first)?;
    // No file is written before every part is known to be of this campaign.
    for part in &args.parts {
        same(part, &plan, &read_plan(part)?)?;
    }
    let dir = out::directory(&args.out, Some(&args.out), "merged")?;
    let journal = Journal::open(&dir, &plan, &context.stop)?;
    let own_path = dir.canonicalize()?;
    for part in &args.parts {
        if part.canonicalize()? != own_path {
            each_row(part, &plan, |row| journal.add(&plan, &row))?;
        }
    }
    let merged = conclude(&dir, &plan, &journal, Partition::WHOLE)?;
    print_result(context, &dir, &merged)?;
    if !merged.complete {
        link::note!(
            "{} of {} trials are there; the parts that are missing are not among these folders",
            merged.trials,
            merged.planned
        );
    }
    Ok(exit(&merged, true))
}
