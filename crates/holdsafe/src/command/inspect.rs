//! `holdsafe inspect explain|diff|verify|replay`: questions about a recorded run, most of them also about a simulated
//! one.

mod diff;
mod explain;
mod replay;
mod verify;

use runner::Context;
use runner::failure::{Exit, Failure};

#[derive(Debug, clap::Subcommand)]
pub(super) enum Verb {
    /// Explain why the platform changed its mode, from the logs of its services.
    Explain(explain::Args),
    /// Compare two runs: the first different decision of each service.
    Diff(diff::Args),
    /// Verify the evidence of a run: hash chains, signatures and seals.
    Verify(verify::Args),
    /// Replay the inputs of each service and compare every output byte; with --policy, every decision under another policy.
    Replay(replay::Args),
}

pub(super) fn run(context: &Context, verb: &Verb) -> Result<Exit, Failure> {
    match verb {
        Verb::Explain(args) => explain::run(context, args),
        Verb::Diff(args) => diff::run(context, args),
        Verb::Verify(args) => verify::run(context, args),
        Verb::Replay(args) => replay::run(context, args),
    }
}
