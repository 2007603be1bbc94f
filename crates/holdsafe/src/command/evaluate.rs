//! `holdsafe evaluate`: the reference evaluation; `--reproduce` checks that the committed results still come out.

mod load;
mod parts;
mod reference;
mod remaining;
mod reproduce;
mod tell;
mod worlds;

use std::path::PathBuf;

use runner::Context;
use runner::failure::{Exit, Failure};

#[derive(Debug, Default, clap::Args)]
pub(super) struct Args {
    /// Only check that simulated runs still give the results in references/.
    #[arg(long, group = "selects")]
    reproduce: bool,
    /// Only this platform: every scenario that it shares with the ground platform, and its own; also live.
    #[arg(long, value_name = "PLATFORM", conflicts_with = "reproduce")]
    domain: Option<String>,
    /// With --domain: simulated trials with rendered sensors and the detector, too, where networks ship for the platform's views.
    #[arg(long, requires = "domain", conflicts_with = "worlds")]
    rendered: bool,
    /// Only the live runs, with the hosts in network namespaces of their own, on a wire with the adversary at its bridge.
    #[arg(long, conflicts_with = "reproduce")]
    apart: bool,
    /// A smoke check of a minute or two: every scenario and cell 3 times in the twin or on the stacks, and no live run.
    #[arg(long, conflicts_with_all = ["reproduce", "apart"])]
    quick: bool,
    /// Every scenario of the ground platform, or with --domain of another, in its own scene and in N drawn worlds of each family for
    /// such a body: which classes hold in both.
    #[arg(long, value_name = "N", group = "selects", conflicts_with_all = ["reproduce", "apart", "quick"], value_parser = clap::value_parser!(u64).range(1..=100))]
    worlds: Option<u64>,
    /// With --worlds: the honest faults of scenarios/honest and the attacks that they look like, or of the named ones, each at least 59 times
    /// in its own scene, side by side.
    #[arg(long, requires = "worlds")]
    twins: bool,
    /// Keep finished trials, recordings and the result here, and resume from there [default: runs/reference, and a name of its own
    /// with --quick, --domain, --apart or --worlds].
    #[arg(long, value_name = "DIR", conflicts_with = "reproduce")]
    out: Option<PathBuf>,
    /// Print the whole table, too, which is written to table.txt in any case.
    #[arg(long, conflicts_with_all = ["reproduce", "worlds"])]
    table: bool,
    #[command(flatten)]
    of: reproduce::Reproduce,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    if let Some(worlds) = args.worlds {
        let (platform, twins, names) = (args.domain.as_deref(), args.twins, &args.of.scenarios[..]);
        let requested = worlds::Asked { worlds, platform, twins, names };
        return worlds::run(context, &requested, args.out.as_deref());
    }
    if args.reproduce { reproduce::run(context, &args.of) } else { reference::run(context, args) }
}
