//! `holdsafe inspect verify DIR`: the evidence of a run, verified, and its trial's own INVALID verdict, if any.

use std::path::{Path, PathBuf};

use evidence::SCHEMA_VERSION;
use live::store::HELD;
use runner::error::EngineError;
use runner::failure::{Exit, Failure};
use runner::verified::Verified;
use runner::{Context, checked, out, runs};
use serde::Serialize;

#[derive(Debug, clap::Args)]
pub(in crate::command) struct Args {
    /// Directory of a recorded run.
    #[arg(value_name = "DIR")]
    run: PathBuf,
    /// SHA-256 of the run's held.json as reported when the run was made; another one is INVALID.
    #[arg(long, value_name = "SHA256", value_parser = digest)]
    held: Option<String>,
}

#[derive(Serialize)]
struct Told {
    schema_version: u32,
    /// The evidence holds.
    holds: bool,
    /// It holds, and the trial did not end INVALID by itself.
    valid: bool,
    /// Reason for which the trial itself is INVALID.
    #[serde(skip_serializing_if = "Option::is_none")]
    ended: Option<String>,
    #[serde(flatten)]
    verified: Verified,
}

fn digest(text: &str) -> Result<String, String> {
    let whole = text.len() == 64 && text.chars().all(|c| c.is_ascii_hexdigit());
    whole.then(|| text.to_ascii_lowercase()).ok_or_else(|| "64 hexadecimal digits are expected".to_owned())
}

/// The failure of a run that cannot be verified: one without keys is no evidence.
fn unverified(run: &Path, error: EngineError) -> Failure {
    if let EngineError::Unreadable { file, message, .. } = &error
        && file.ends_with(HELD)
    {
        let text = format!("INVALID: {}: {HELD}: {message}: without it nothing is verified", run.display());
        return Failure::new(Exit::NoEvidence, text);
    }
    error.into()
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let run = runs::one(&args.run)?;
    let mut verified = runner::verified::verify(&run).map_err(|error| unverified(&run, error))?;
    if let Some(text) = args.held.as_ref().filter(|text| **text != verified.held) {
        verified.findings.insert(0, format!("held.json: SHA-256 {}, told was {text}", verified.held));
    }
    let (outcome, ended) = checked::ended(&run);
    let contradiction = ended.is_none().then(|| checked::contradiction(&run, &verified.held, outcome)).flatten();
    verified.findings.extend(contradiction);
    let holds = verified.sealed && verified.findings.is_empty();
    let valid = holds && ended.is_none();
    if !context.json {
        if let Some(reason) = ended.as_ref().filter(|_| holds) {
            out::say(format_args!("INVALID: {}: {reason}", args.run.display()));
        }
        if !holds {
            let reason = verified.findings.first().map_or("TRUNCATED: no closing seal", String::as_str);
            out::say(format_args!("INVALID: {}: {reason}", args.run.display()));
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
        match (holds, valid) {
            (true, true) => out::say(format_args!("the evidence holds")),
            (true, false) => out::say(format_args!("the evidence holds, of a trial that shows nothing")),
            (false, _) => {}
        }
    } else {
        out::print_json("verify", &Told { schema_version: SCHEMA_VERSION, holds, valid, ended, verified })?;
    }
    Ok(if valid { Exit::Fine } else { Exit::NoEvidence })
}
