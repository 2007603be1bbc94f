//! `holdsafe replay DIR`: feeds each core its recorded inputs and compares every output byte.

use std::path::PathBuf;

use serde::Serialize;

use super::engine::{self, MouthReplay};
use super::failure::{Exit, Failure};
use super::{Context, out};
use crate::report::SCHEMA_VERSION;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Run directory of one trial.
    #[arg(value_name = "DIR")]
    run: PathBuf,
}

#[derive(Serialize)]
struct Replayed {
    schema_version: u32,
    identical: bool,
    cores: Vec<MouthReplay>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let cores = engine::replay(&args.run)?;
    if cores.is_empty() {
        return Err(Failure::new(Exit::NoEvidence, format!("{}: no mouth logs; nothing was fed", args.run.display())));
    }
    let identical = cores.iter().all(|core| core.difference.is_none());
    if !context.json {
        for core in &cores {
            let verdict = core.difference.as_deref().unwrap_or("identical");
            out::say(format_args!("{:16} {:8} inputs {:8} outputs  {verdict}", core.core, core.inputs, core.outputs));
        }
    }
    if context.json {
        out::print_json("replay", &Replayed { schema_version: SCHEMA_VERSION, identical, cores })?;
    }
    if !identical {
        eprintln!("reproduce: holdsafe replay {}", args.run.display());
    }
    Ok(if identical { Exit::Fine } else { Exit::Unexpected })
}
