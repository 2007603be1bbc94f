//! `holdsafe console RUN`: a recorded run in the console's window, to look at, and beside it what the unit's sensors gave and why its
//! mode changed.

use std::path::PathBuf;

use console::process::replay;

use super::Context;
use super::beside::Beheld;
use super::bring::Bring;
use super::failure::{Exit, Failure};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The run's directory, as given to `live --out`.
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// With a detector of one's own: what that sees is marked.
    #[command(flatten)]
    bring: Bring,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let mut recorded = replay::open(&args.run).map_err(|why| Failure::new(Exit::NoEvidence, why.to_string()))?;
    link::display::Environment::own().probe().map_err(|why| Failure::new(Exit::Environment, why.to_string()))?;
    if let Some(beheld) = Beheld::open(&args.run, || args.bring.stages())? {
        recorded = recorded.beside(Box::new(beheld));
    }
    let stop = context.stop.clone();
    recorded.show(move || stop.asked()).map_err(|why| Failure::new(Exit::Environment, why))?;
    Ok(Exit::Fine)
}
