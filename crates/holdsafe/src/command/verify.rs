//! `holdsafe verify DIR`: whether the evidence of a run holds.

use std::path::PathBuf;

use evidence::SCHEMA_VERSION;
use runner::failure::{Exit, Failure};
use runner::verified::Verified;
use runner::{Context, out, runs};
use serde::Serialize;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Directory of a recorded run.
    #[arg(value_name = "DIR")]
    run: PathBuf,
    /// The SHA-256 of the run's held.json as it was told when the run was made; another one is INVALID.
    #[arg(long, value_name = "SHA256", value_parser = digest)]
    held: Option<String>,
}

#[derive(Serialize)]
struct Told {
    schema_version: u32,
    holds: bool,
    #[serde(flatten)]
    verified: Verified,
}

fn digest(text: &str) -> Result<String, String> {
    let whole = text.len() == 64 && text.chars().all(|c| c.is_ascii_hexdigit());
    whole.then(|| text.to_ascii_lowercase()).ok_or_else(|| "64 hexadecimal digits are expected".to_owned())
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let mut verified = runner::verified::verify(&runs::one(&args.run)?)?;
    if let Some(told) = args.held.as_ref().filter(|told| **told != verified.held) {
        verified.findings.insert(0, format!("held.json: SHA-256 {}, told was {told}", verified.held));
    }
    let holds = verified.sealed && verified.findings.is_empty();
    if !context.json {
        if !holds {
            let why = verified.findings.first().map_or("TRUNCATED: no closing seal", String::as_str);
            out::say(format_args!("INVALID: {}: {why}", args.run.display()));
        }
        let closed = if verified.sealed { "sealed" } else { "TRUNCATED: no closing seal" };
        let (events, head, heads) = (verified.events, &verified.head, verified.heads);
        out::say(format_args!("{events} events, head {head}, {heads} heads held outside the recorder, {closed}"));
        let (files, held) = (verified.files, &verified.held);
        out::say(format_args!("{files} files compared to the last byte, held.json has SHA-256 {held}"));
        for open in &verified.uncovered {
            out::say(format_args!("not covered: {open}"));
        }
        for finding in &verified.findings {
            out::say(format_args!("{finding}"));
        }
        if holds {
            out::say(format_args!("the evidence holds"));
        }
    } else {
        out::print_json("verify", &Told { schema_version: SCHEMA_VERSION, holds, verified })?;
    }
    Ok(if holds { Exit::Fine } else { Exit::NoEvidence })
}
