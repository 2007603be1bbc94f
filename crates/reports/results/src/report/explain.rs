//! Explanations as text, as JSON and as a diagram.

use std::fmt::Write;

use evidence::{Micros, SCHEMA_VERSION};
use explain::{Explanation, LinkStage, WhyNot};
use serde::Serialize;

/// Explanations of one run, as one object.
#[derive(Clone, Debug, Serialize)]
pub struct ExplainObject {
    schema_version: u32,
    run: String,
    /// Fault of the log that they were made from, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    flaw: Option<String>,
    /// Assumption about the run where the recording lacks the value, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    assumed: Option<&'static str>,
    explanations: Vec<Explanation>,
    #[serde(skip_serializing_if = "Option::is_none")]
    why_not: Option<WhyNot>,
}

impl ExplainObject {
    /// Object for the run with this name.
    pub fn new(
        run: &str,
        flaw: Option<String>,
        assumed: Option<&'static str>,
        explanations: Vec<Explanation>,
        why_not: Option<WhyNot>,
    ) -> Self {
        Self { schema_version: SCHEMA_VERSION, run: run.to_owned(), flaw, assumed, explanations, why_not }
    }
}

/// The chain of one change of mode, a line a link.
pub fn explained(explanation: &Explanation) -> String {
    write_with(explanation, |time| format!("{} ms", time / 1000), |time| format!("{} ms", ms(time)))
}

/// The explanation with times of the run in seconds, as a recording's window has them.
pub fn explained_in_seconds(explanation: &Explanation) -> String {
    let seconds = |time: Micros| format!("{:.4} s", time as f64 / 1e6);
    write_with(explanation, seconds, seconds)
}

/// The explanation with the time of the change and the times of its links written so.
fn write_with(explanation: &Explanation, change: fn(Micros) -> String, link: fn(Micros) -> String) -> String {
    let Explanation { at_us, from, to, cause, chain, split, .. } = explanation;
    let mut text = format!("{}: {} to {} ({})\n", change(*at_us), from.name(), to.name(), cause.label());
    for step in chain {
        let (stage, time, author) = (stage_name(step.stage), link(step.at_us), step.by.name());
        // Writing to a string does not fail.
        let _ = writeln!(text, "  {stage:10} {time:>15}  {author:10}  {}", step.what);
    }
    let parts = [
        ("origin to change", Some(split.noticed_us)),
        ("change to plant", split.plant_us),
        ("change to standing", split.standing_us),
        ("change to display", split.display_us),
    ];
    let parts = parts.into_iter().filter_map(|(name, us)| Some(format!("{name} {} ms", ms(us?))));
    let _ = writeln!(text, "  took       {}", parts.collect::<Vec<_>>().join(", "));
    text
}

/// The chain as a Mermaid flow chart.
pub fn diagram(explanation: &Explanation) -> String {
    let mut text = String::from("flowchart TD\n");
    for (i, step) in explanation.chain.iter().enumerate() {
        let label = format!(
            "{} · {} ms · {}<br/>{}",
            stage_name(step.stage),
            ms(step.at_us),
            step.by.name(),
            plain(&step.what)
        );
        let _ = writeln!(text, "    s{i}[\"{label}\"]");
        if i > 0 {
            let before = i - 1;
            let _ = writeln!(text, "    s{before} --> s{i}");
        }
    }
    text
}

/// Conditions that keep it out of a mode.
pub fn kept_out(not: &WhyNot) -> String {
    let (time, mode, since) = (ms(not.at_us), not.mode.name(), ms(not.since_us));
    let mut text = format!("at {time} ms it is {mode}, since {since} ms\n");
    if not.blocks.is_empty() {
        let _ = writeln!(text, "  that is the mode asked about");
    }
    for block in &not.blocks {
        let _ = writeln!(text, "  {block}");
    }
    text
}

/// Milliseconds to the nearest tenth.
fn ms(us: Micros) -> String {
    let tenths = (us + 50) / 100;
    format!("{}.{}", tenths / 10, tenths % 10)
}

/// The name of a kind of link.
pub fn stage_name(stage: LinkStage) -> &'static str {
    match stage {
        LinkStage::Cause => "cause",
        LinkStage::Refusals => "refusals",
        LinkStage::Health => "health",
        LinkStage::Guard => "guard",
        LinkStage::Transition => "transition",
        LinkStage::Authority => "authority",
        LinkStage::Actuation => "actuation",
        LinkStage::Display => "display",
    }
}

/// Words without diagram syntax: refused values are quoted, and may come from outside.
fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_alphanumeric() || " ,.:;_-+/()".contains(c) { c } else { ' ' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quoted_refusal_cannot_end_a_diagram_label() {
        assert_eq!(plain("a\"] --> evil[\"<b>"), "a   --  evil   b ");
    }
}
