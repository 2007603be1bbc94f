//! `holdsafe verify DIR`: whether the evidence of a run holds.

use std::path::PathBuf;

use serde::Serialize;

use super::engine::{self, Verified};
use super::failure::{Exit, Failure};
use super::{Context, out, runs};
use crate::report::SCHEMA_VERSION;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Directory of a recorded run.
    #[arg(value_name = "DIR")]
    run: PathBuf,
}

#[derive(Serialize)]
struct Told {
    schema_version: u32,
    holds: bool,
    #[serde(flatten)]
    verified: Verified,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let verified = engine::verify(&runs::one(&args.run)?)?;
    let holds = verified.sealed && verified.findings.is_empty();
    if !context.json {
        let closed = if verified.sealed { "sealed" } else { "TRUNCATED: no closing seal" };
        let (events, head, heads) = (verified.events, &verified.head, verified.heads);
        out::say(format_args!("{events} events, head {head}, {heads} heads held outside the recorder, {closed}"));
        for finding in &verified.findings {
            out::say(format_args!("{finding}"));
        }
        out::say(format_args!("{}", if holds { "the evidence holds" } else { "INVALID" }));
    } else {
        out::print_json("verify", &Told { schema_version: SCHEMA_VERSION, holds, verified })?;
    }
    Ok(if holds { Exit::Fine } else { Exit::NoEvidence })
}
