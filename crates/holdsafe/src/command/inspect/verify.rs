//! `holdsafe inspect verify DIR`: the evidence of a run, verified, and its trial's own INVALID verdict, if any.

use std::path::PathBuf;

use evidence::SCHEMA_VERSION;
use evidence::trial::Outcome;
use recording::find::find_one_run;
use recording::verdict::recorded_class;
use recording::verify::{VerifiedRun, verify_run};
use recording::{RecordingError, RunFolder};
use runner::closing::Closing;
use runner::failure::{Exit, Failure};
use runner::{Context, claims, out};
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
struct VerifyObject {
    schema_version: u32,
    /// The evidence holds.
    holds: bool,
    /// It holds, and the trial did not end INVALID by itself.
    valid: bool,
    /// Reason for which the trial itself is INVALID.
    #[serde(skip_serializing_if = "Option::is_none")]
    ended: Option<String>,
    #[serde(flatten)]
    verified: VerifiedRun,
}

fn digest(text: &str) -> Result<String, String> {
    let whole = text.len() == 64 && text.chars().all(|c| c.is_ascii_hexdigit());
    whole.then(|| text.to_ascii_lowercase()).ok_or_else(|| "64 hexadecimal digits are expected".to_owned())
}

/// The failure of a run that cannot be verified: one without keys is no evidence.
fn unverified(run: &RunFolder, error: RecordingError) -> Failure {
    if let RecordingError::NoAnchors { message, .. } = &error {
        let (run, file) = (run.path().display(), RunFolder::ANCHORS);
        let text = format!("INVALID: {run}: {file}: {message}: without it nothing is verified");
        return Failure::new(Exit::NoEvidence, text);
    }
    error.into()
}

/// Summary, and the outcome of the run or, of one that is no evidence, its remains.
fn close(context: &Context, args: &Args, (holds, valid): (bool, bool), outcome: Option<Outcome>) {
    let text = match (holds, valid) {
        (true, true) => "the evidence holds",
        (true, false) => "the evidence holds, of a trial that shows nothing",
        (false, _) => "INVALID: the evidence does not hold",
    };
    let run = args.run.to_string_lossy();
    let verb = |words: &[&'static str]| {
        let unverified = (!valid).then_some("--unverified");
        context.command(words.iter().copied().chain([run.as_ref()]).chain(unverified))
    };
    let class = outcome.map(|outcome| format!("ended {}", outcome.name())).unwrap_or_default();
    Closing::new(context).part(text).part(class).print([verb(&["inspect", "explain", "--all"]), verb(&["report"])]);
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let run = find_one_run(&args.run)?;
    let mut verified = verify_run(&run).map_err(|error| unverified(&run, error))?;
    if let Some(text) = args.held.as_ref().filter(|text| **text != verified.anchors_sha256) {
        verified.findings.insert(0, format!("held.json: SHA-256 {}, told was {text}", verified.anchors_sha256));
    }
    let (outcome, ended) = recorded_class(&run);
    let contradiction = || claims::contradiction(run.path(), Some(&verified.anchors_sha256), outcome);
    let contradiction = if ended.is_none() { contradiction() } else { None };
    verified.findings.extend(contradiction);
    let holds = verified.holds();
    let valid = holds && ended.is_none();
    if !context.json {
        if let Some(reason) = ended.as_ref().filter(|_| holds) {
            out::show(format_args!("INVALID: {}: {reason}", args.run.display()));
        }
        if !holds {
            let reason = verified.findings.first().map_or("TRUNCATED: no closing seal", String::as_str);
            out::show(format_args!("INVALID: {}: {reason}", args.run.display()));
        }
        let closed = if verified.sealed { "sealed" } else { "TRUNCATED: no closing seal" };
        let (events, head, heads) = (verified.events, &verified.head, verified.heads);
        out::show(format_args!(
            "{events} events, {heads} heads held outside the recorder, {closed}; the last head:\n  {head}"
        ));
        let (files, sha256) = (verified.files, &verified.anchors_sha256);
        out::say(format_args!(
            "{files} files compared to the last byte; SHA-256 of held.json, to be noted:\n  {sha256}"
        ));
        for open in &verified.uncovered {
            out::say(format_args!("not covered: {open}"));
        }
        for finding in &verified.findings {
            out::say(format_args!("{finding}"));
        }
        close(context, args, (holds, valid), outcome);
    } else {
        out::print_json("verify", &VerifyObject { schema_version: SCHEMA_VERSION, holds, valid, ended, verified })?;
    }
    Ok(if valid { Exit::Fine } else { Exit::NoEvidence })
}
