//! `holdsafe inspect diff A B`: the first different decisions of two runs.

use std::path::{Path, PathBuf};

use evidence::diff::{Decided, Difference, diff};
use evidence::{SCHEMA_VERSION, Witnessed};
use recording::{Checked, RecordedLog};
use runner::checked::Unverified;
use runner::failure::{Exit, Failure};
use runner::plan::PlanOptions;
use runner::recorded::note_assumptions;
use runner::{Context, checked, engine, out, plan};
use serde::Serialize;

#[derive(Debug, clap::Args)]
pub(in crate::command) struct Args {
    /// Directory of a recorded run, or a scenario that is run in the twin under --seed.
    #[arg(value_name = "A")]
    a: String,
    /// The same; A again where it is left out.
    #[arg(value_name = "B")]
    b: Option<String>,
    /// Of B, if it is a scenario: a policy file in place of its own.
    #[arg(long, value_name = "FILE")]
    policy: Option<PathBuf>,
    /// Of scenarios: only this cell; else the first.
    #[arg(long)]
    cell: Option<String>,
    #[command(flatten)]
    unverified: Unverified,
}

#[derive(Serialize)]
struct Compared<'a> {
    schema_version: u32,
    a: &'a str,
    b: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    watermark: Option<String>,
    #[serde(flatten)]
    found: &'a Difference,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let other = args.b.as_deref().unwrap_or(&args.a);
    if args.b.is_none() && args.policy.is_none() {
        return Err(Failure::new(
            Exit::Usage,
            "one run alone differs from nothing: name another, or a --policy for it",
        ));
    }
    let a = log(context, &args.a, args, None)?;
    let b = log(context, other, args, args.policy.as_deref())?;
    let read: Vec<&Checked> = a.checked.iter().chain(&b.checked).collect();
    checked::print_marks(context, &read);
    let (found, watermark) = (diff(&a.entries, &b.entries), b.watermark);
    if context.json {
        let (schema_version, a) = (SCHEMA_VERSION, args.a.as_str());
        checked::print_json("diff", &Compared { schema_version, a, b: other, watermark, found: &found }, &read)?;
    } else {
        watermark.iter().for_each(|mark| out::say(format_args!("B: {mark}")));
        show(&found);
    }
    Ok(args.unverified.exit(&read, if found.same_order { Exit::Fine } else { Exit::Unexpected }))
}

/// A run's log.
struct Side {
    entries: Vec<Witnessed>,
    /// Watermark of every artefact of an ablation.
    watermark: Option<String>,
    /// The recording that it was read from.
    checked: Option<Checked>,
}

fn log(context: &Context, run: &str, args: &Args, policy: Option<&Path>) -> Result<Side, Failure> {
    let path = Path::new(run);
    if path.is_dir() {
        if policy.is_some() {
            return Err(Failure::new(
                Exit::Usage,
                format!("{run} is recorded, and under its own policy; name a scenario"),
            ));
        }
        let checked = checked::open_one_run(path)?;
        let found = RecordedLog::read(&checked)?;
        note_assumptions(&found, run);
        return Ok(Side { entries: found.entries, watermark: None, checked: Some(checked) });
    }
    let wanted = PlanOptions { cell: args.cell.clone(), ..PlanOptions::default() };
    let (scenario, planned) = plan::plan(context, &plan::file_of(context, run)?, &wanted)?;
    let one = planned.into_iter().next().filter(|_| !scenario.is_of_stacks());
    let mut one = one.ok_or_else(|| Failure::new(Exit::Usage, format!("`{run}` has no run in the twin")))?;
    if let Some(policy) = policy {
        one = plan::with_policy(context, &one, policy)?;
    }
    let entries = engine::twin_verdict(&one.variation.scenario, &one.setup, context.seed)?.0.entries;
    Ok(Side { entries, watermark: one.setup.watermark(), checked: None })
}

fn show(found: &Difference) {
    let text = match (found.same_log, found.same_decisions, found.same_order) {
        (true, ..) => "the same: every event at the same time",
        (_, true, _) => "the same decisions at the same times",
        (.., true) => "every service decides the same in the same order; the times differ",
        _ => "they differ",
    };
    out::say(format_args!("{text}"));
    for first in &found.first {
        out::say(format_args!("{}: after {} decisions that are the same", first.node, first.after));
        out::say(format_args!("  A  {}", decision_text(first.a.as_ref())));
        out::say(format_args!("  B  {}", decision_text(first.b.as_ref())));
    }
    for count in &found.counts {
        let [a, b] = count.n;
        out::say(format_args!("{:16} {:32} A {a:6}  B {b:6}", count.node.to_string(), count.kind));
    }
}

fn decision_text(decided: Option<&Decided>) -> String {
    let Some(Decided { at_us, event }) = decided else { return "decides nothing more".to_owned() };
    let event = serde_json::to_string(event).unwrap_or_default();
    format!("{:.3} s  {event}", *at_us as f64 / 1e6)
}
