//! `holdsafe report --format html|cite|mcap`: results and runs for readers who do not run this program.

mod cite;
mod mcap;
pub(super) mod page;

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use runner::Context;
use runner::checked::Unverified;
use runner::failure::{Exit, Failure};

/// Output format.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Format {
    /// One HTML page of results and recorded runs, for a reviewer.
    #[default]
    Html,
    /// A BibTeX entry on stdout: program, seed and digests of the results of a run.
    Cite,
    /// A run as an MCAP file for Foxglove and other viewers: scene, images, detections, tracks, modes and log.
    Mcap,
}

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// html: results (printed by --json, or the folder of a command) and folders of recorded runs. cite: the folder of one run. mcap: one
    /// recorded run, or a scenario to simulate under --seed.
    #[arg(value_name = "RESULT", required = true)]
    given: Vec<PathBuf>,
    /// Format.
    #[arg(long, value_enum, default_value = "html")]
    format: Format,
    /// The file to write: with html report.html where none is named.
    #[arg(long, value_name = "FILE", required_if_eq("format", "mcap"))]
    out: Option<PathBuf>,
    #[command(flatten)]
    unverified: Unverified,
    #[command(flatten)]
    page: page::PageOptions,
    #[command(flatten)]
    mcap: mcap::McapOptions,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    fits(args)?;
    match args.format {
        Format::Html => page::run(context, args),
        Format::Cite => cite::run(context, args.one()?, args.unverified),
        Format::Mcap => mcap::run(context, args),
    }
}

impl Args {
    /// The one run that is given.
    fn one(&self) -> Result<&Path, Failure> {
        match self.given.as_slice() {
            [one] => Ok(one),
            several => {
                Err(Failure::new(Exit::Usage, format!("{} runs are named; this format takes one", several.len())))
            }
        }
    }
}

/// Refuses options of another format.
fn fits(args: &Args) -> Result<(), Failure> {
    let misplaced = |format: Format, is_given: bool| (is_given && args.format != format).then_some(format);
    let foreign = misplaced(Format::Html, args.page.any_given()).or(misplaced(Format::Mcap, args.mcap.any_given()));
    let foreign = foreign.and_then(|format| format.to_possible_value());
    let to_no_file = args.out.is_some() && args.format == Format::Cite;
    match foreign {
        Some(format) => {
            let message = format!("an option of `--format {}` is given with another format", format.get_name());
            Err(Failure::new(Exit::Usage, message))
        }
        None if to_no_file => Err(Failure::new(Exit::Usage, "a citation goes to stdout; leave --out out")),
        None => Ok(()),
    }
}
