//! `holdsafe evaluate`: the reference evaluation; `--reproduce` checks that the committed results still come out.

mod reference;
mod reproduce;

use runner::Context;
use runner::failure::{Exit, Failure};

#[derive(Debug, Default, clap::Args)]
pub(super) struct Args {
    /// Only check that simulated runs still give the results in references/.
    #[arg(long)]
    reproduce: bool,
    /// Only this platform: every scenario that it shares with the ground platform, and its own; also live.
    #[arg(long, value_name = "PLATFORM", conflicts_with = "reproduce")]
    domain: Option<String>,
    /// Only the live runs, with the hosts in network namespaces of their own, on a wire with the adversary at its bridge.
    #[arg(long, conflicts_with = "reproduce")]
    apart: bool,
    #[command(flatten)]
    of: reproduce::Reproduce,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    if args.reproduce {
        reproduce::run(context, &args.of)
    } else {
        reference::run(context, args.domain.as_deref(), args.apart)
    }
}
