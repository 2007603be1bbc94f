//! `holdsafe campaign run|merge|curve`: many trials, to claim something of them.

mod curve;
mod journal;
mod merge;
pub(super) mod recount;
mod run;
mod space;
mod table;

use runner::Context;
use runner::failure::{Exit, Failure};

#[derive(Debug, clap::Subcommand)]
pub(super) enum Verb {
    /// Run enough trials to test a claim; supports grids, random draws and partitions, and resumes after an interruption.
    Run(run::Args),
    /// Merge the partitions of a campaign.
    Merge(merge::Args),
    /// Take one value of a scenario through its range: outcomes and latencies of each point.
    Curve(curve::Args),
}

pub(super) fn run(context: &Context, verb: &Verb) -> Result<Exit, Failure> {
    match verb {
        Verb::Run(args) => run::run(context, args),
        Verb::Merge(args) => merge::run(context, args),
        Verb::Curve(args) => curve::run(context, args),
    }
}
