//! `holdsafe console RUN`: a recorded run in the console's window, to look at.

use std::path::PathBuf;

use console::process::replay;

use super::failure::{Exit, Failure};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The run's directory, as given to `live --out`.
    #[arg(value_name = "RUN")]
    run: PathBuf,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let recorded = replay::open(&args.run).map_err(|why| Failure::new(Exit::NoEvidence, why.to_string()))?;
    link::display::Environment::own().probe().map_err(|why| Failure::new(Exit::Environment, why.to_string()))?;
    recorded.show().map_err(|why| Failure::new(Exit::Environment, why))?;
    Ok(Exit::Fine)
}
