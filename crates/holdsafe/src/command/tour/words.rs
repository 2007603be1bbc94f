//! Sentences and lines of the tour, made from the records of trials: latencies, causes, refusals, findings and the explained origin.

use std::collections::BTreeMap;

use evidence::trial::{Outcome, Outcomes, Trial};
use explain::Explanation;
use results::report::Summary;

/// Columns of the widest line.
pub(super) const WIDTH: usize = 100;
/// Columns before a row's text.
const INDENT: usize = 5;
/// Kinds of refusal, or of change of mode, that a sentence names.
const NAMED: usize = 3;
/// Width of the matrix' first column.
const FIRST: usize = 20;
/// Width of a policy's column, with a gap.
const COLUMN: usize = 27;
/// Verbs to go on with, and their results.
const NEXT: [(&str, &str); 5] = [
    ("run teammate --trials 20", "the finding's 18 cells, with every refusal by name"),
    ("inspect explain thermal_loss", "why the mode changed, link by link"),
    ("scenario new my_attack", "an attack of your own, as a commented file"),
    ("guest new mine", "an autonomy of your own, to be put to the test"),
    ("evaluate", "every shipped scenario, about an hour; it resumes"),
];

/// Name of the program as it was started, where it is a plain word.
fn program() -> String {
    let plain = |name: &str| {
        !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.'))
    };
    let started = std::env::args_os().next().and_then(|name| name.into_string().ok());
    started.filter(|name| plain(name)).unwrap_or_else(|| "holdsafe".to_owned())
}

/// The commands to go on with.
pub(super) fn next_commands() -> Vec<String> {
    let program = program();
    NEXT.iter().map(|(verb, _)| format!("{program} {verb}")).collect()
}

/// The next commands as lines, each with its purpose.
pub(super) fn next_lines() -> Vec<String> {
    let longest = next_commands().iter().map(String::len).max().unwrap_or_default();
    let line = |(command, (_, gives)): (String, &(&str, &str))| format!("  {command:longest$}  {gives}");
    next_commands().into_iter().zip(&NEXT).map(line).collect()
}

/// Reason of a live run that the host spoilt.
pub(super) fn host_stalled(ms: f64) -> String {
    format!("the host stalled for {ms:.0} ms")
}

/// Classes with their counts, or the class alone where all trials ended in it.
pub(super) fn classes(outcomes: &Outcomes) -> String {
    match outcomes.keys().next() {
        Some(class) if outcomes.len() == 1 => class.name().to_owned(),
        Some(_) | None => report::tried::class_counts(outcomes),
    }
}

/// The text in lines, at most `most`; the first begins at the margin, or all of them are `indented`.
pub(super) fn lines(text: &str, indented: bool, most: usize) -> Vec<String> {
    let margin = |first: bool| if first && !indented { String::new() } else { " ".repeat(INDENT) };
    let mut lines: Vec<String> = vec![margin(true)];
    let mut begun = false;
    for word in text.split_whitespace() {
        let word: String = word.chars().take(WIDTH - 2 * INDENT).collect();
        let now = lines.len();
        let Some(line) = lines.last_mut() else { break };
        let gap = if begun { " " } else { "" };
        // Room for the mark of an omission.
        let limit = if now == most { WIDTH - 2 } else { WIDTH };
        if line.chars().count() + gap.len() + word.chars().count() <= limit {
            line.push_str(gap);
            line.push_str(&word);
        } else if now == most {
            line.push_str(" …");
            break;
        } else {
            lines.push(margin(false) + &word);
        }
        begun = true;
    }
    lines
}

/// The lines with `mark` at the margin of the first line.
pub(super) fn marked_lines(mark: &str, text: &str, most: usize) -> Vec<String> {
    let mut lines = lines(text, true, most);
    if let Some(first) = lines.first_mut() {
        *first = format!("{mark:INDENT$}{}", first.trim_start());
    }
    lines
}

/// Response of the platform and its reason, from the records of the trials; `explained` is the last restricting change of the first one.
pub(super) fn response(trials: &[&Trial], explained: Option<&Explanation>) -> String {
    let origin = explained.map(|explanation| format!("its last cause in trial 1: {}", explanation.origin.what));
    let parts = [
        latency(trials),
        changes(trials),
        origin,
        refusals(trials),
        set_points(trials),
        finding(trials),
        repeated(trials),
    ];
    let mut parts: Vec<String> = parts.into_iter().flatten().collect();
    if changes(trials).is_none() {
        parts.extend(quiet_sentence(trials));
    }
    parts.join("; ")
}

/// The sentence of all trials under one policy.
pub(super) fn policy_sentence(policy: &str, trials: &[&Trial]) -> String {
    let refused = refusals(trials).unwrap_or_else(|| "nothing refused".to_owned());
    let parts = [Some(refused), changes(trials), unanswered(trials)];
    format!("{policy}: {}", parts.into_iter().flatten().collect::<Vec<_>>().join("; "))
}

fn latency(trials: &[&Trial]) -> Option<String> {
    let summary = Summary::from_trials(trials).latency_ms;
    let bare = trials.iter().any(|trial| trial.guest.as_ref().is_some_and(|guest| guest.bare));
    let (mode, sample) = match summary.to_hold_safe.n {
        0 => ("DEGRADED", summary.to_degraded),
        _ => (if bare { "standing" } else { "HOLD_SAFE" }, summary.to_hold_safe),
    };
    let (mean, p95) = sample.mean.zip(sample.p95)?;
    Some(match sample.n {
        1 => format!("{mode} after {mean:.0} ms"),
        n => format!("{mode} after {mean:.0} ms on average (n = {n}, 95th percentile {p95:.0} ms)"),
    })
}

/// Changes of mode that a loss forced, the most frequent first.
fn changes(trials: &[&Trial]) -> Option<String> {
    let mut counts: BTreeMap<String, u64> = BTreeMap::new();
    for trial in trials {
        let forced = |cause: &str| cause.starts_with("lost:") || cause.starts_with("unrecovered:");
        let own_rows = trial.transitions.iter().filter(|change| forced(&change.cause));
        let mut change_texts: Vec<String> =
            own_rows.map(|change| format!("{} by {}", change.to, change.cause)).collect();
        change_texts.sort();
        change_texts.dedup();
        change_texts.into_iter().for_each(|change| *counts.entry(change).or_default() += 1);
    }
    most_frequent(&counts, |change, n| match trials.len() {
        1 => change.to_owned(),
        all => format!("{change} in {n} of {all}"),
    })
}

fn refusals(trials: &[&Trial]) -> Option<String> {
    let mut counts: BTreeMap<String, u64> = BTreeMap::new();
    for (reason, n) in trials.iter().flat_map(|trial| &trial.dropped) {
        *counts.entry(reason.clone()).or_default() += n;
    }
    most_frequent(&counts, |reason, n| format!("{reason} {n}")).map(|named| format!("refused: {named}"))
}

/// The most frequent of these, each in words.
fn most_frequent(counts: &BTreeMap<String, u64>, words: impl Fn(&str, u64) -> String) -> Option<String> {
    let mut all: Vec<(&str, u64)> = counts.iter().map(|(name, n)| (name.as_str(), *n)).collect();
    // Stable: of equal counts the order is that of the names.
    all.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    let first: Vec<String> = all.iter().take(NAMED).map(|(name, n)| words(name, *n)).collect();
    (!first.is_empty()).then(|| first.join(", "))
}

/// Fate of a guest's set-points.
fn set_points(trials: &[&Trial]) -> Option<String> {
    let guests: Vec<_> = trials.iter().filter_map(|trial| trial.guest.as_ref()).collect();
    let steps: u64 = guests.iter().map(|guest| u64::from(guest.steps)).sum();
    let limited: u64 = guests.iter().map(|guest| u64::from(guest.limited)).sum();
    guests.first().map(|guest| match guest.bare {
        true => format!("{steps} set-points went to the plant as they were"),
        false => format!("the guards limited {limited} of {steps} set-points"),
    })
}

/// The first finding of the oracle.
fn finding(trials: &[&Trial]) -> Option<String> {
    trials.iter().find_map(|trial| trial.findings.first().map(|name| format!("seed {}: {name}", trial.seed)))
}

fn repeated(trials: &[&Trial]) -> Option<String> {
    let spoilt: Vec<String> =
        trials.iter().flat_map(|trial| &trial.host_spoilt_ms).map(|ms| format!("{ms:.0}")).collect();
    (!spoilt.is_empty()).then(|| format!("repeated since the host stalled for {} ms", spoilt.join(", ")))
}

fn unanswered(trials: &[&Trial]) -> Option<String> {
    let n = trials.iter().filter(|trial| trial.outcome == Outcome::Undetected).count();
    (n > 0).then(|| format!("no response in {n}"))
}

/// Accounts of trials without a forced change of mode.
fn quiet_sentence(trials: &[&Trial]) -> Option<String> {
    let trips: u64 = trials.iter().map(|trial| u64::from(trial.false_trips)).sum();
    let accepted: u64 = trials.iter().map(|trial| trial.accepted).sum();
    (!trials.is_empty()).then(|| format!("no mode lost, {accepted} records accepted, {trips} false trips"))
}

/// The matrix of cells named `form/presence/policy`, each with its classes: a line for form and presence, a column a policy.
pub(super) fn matrix(cells: &[(&str, &Outcomes)]) -> Vec<String> {
    let parts: Vec<(&str, &str, &Outcomes)> =
        cells.iter().filter_map(|(cell, map)| cell.rsplit_once('/').map(|(row, policy)| (row, policy, *map))).collect();
    let (mut rows, mut policies): (Vec<&str>, Vec<&str>) = (Vec::new(), Vec::new());
    for (row, policy, _) in &parts {
        if !rows.contains(row) {
            rows.push(row);
        }
        if !policies.contains(policy) {
            policies.push(policy);
        }
    }
    let line = |row: &str, columns: Vec<String>| {
        let row = row.replace('/', ", ");
        let columns: String = columns.iter().map(|text| format!("{text:COLUMN$}")).collect();
        format!("{row:FIRST$}{columns}").trim_end().to_owned()
    };
    let described = |row: &str, policy: &str| {
        let found = parts.iter().find(|(name, policy_name, _)| *name == row && *policy_name == policy);
        found.map(|(_, _, outcomes)| classes_in_column(outcomes)).unwrap_or_default()
    };
    let mut lines = vec![line("form/third unit", policies.iter().map(|policy| (*policy).to_owned()).collect())];
    lines.extend(rows.iter().map(|row| line(row, policies.iter().map(|policy| described(row, policy)).collect())));
    lines
}

/// Classes in the room of a column: of too many the gravest, and how many others.
fn classes_in_column(outcomes: &Outcomes) -> String {
    let whole = classes(outcomes).replace(',', "");
    let n: u64 = outcomes.values().sum();
    match outcomes.iter().next() {
        Some((class, of)) if whole.len() >= COLUMN => format!("{} {of}, others {}", class.name(), n - of),
        Some(_) | None => whole,
    }
}

#[cfg(test)]
mod tests {
    use evidence::trial::TransitionRow;

    use super::*;

    #[test]
    fn lines_keep_their_width_and_number() {
        let text = "word ".repeat(200) + &"x".repeat(300);
        for indented in [true, false] {
            let lines = lines(&text, indented, 3);
            assert_eq!(lines.len(), 3);
            assert!(lines.iter().all(|line| line.chars().count() <= WIDTH), "{lines:?}");
            assert!(lines[2].ends_with('…') && lines[1].starts_with("     word"));
        }
        assert_eq!(lines("a b", true, 3), ["     a b"]);
        assert_eq!(marked_lines("ok", "a b", 3), ["ok   a b"]);
    }

    #[test]
    fn response_follows_the_trials() {
        let mut lost = Trial::example(1, Outcome::Degraded);
        let (from, to, cause) = ("READY".to_owned(), "DEGRADED".to_owned(), "lost:thermal".to_owned());
        lost.transitions = vec![TransitionRow { t_ms: 1.0, from, to, cause }];
        let other = Trial { dropped: BTreeMap::new(), ..Trial::example(2, Outcome::Nominal) };
        let of_both = response(&[&lost, &other], None);
        assert!(of_both.contains("DEGRADED by lost:thermal in 1 of 2") && of_both.contains("stale 10"), "{of_both}");
        let calm = response(&[&other], None);
        assert!(calm.contains("no mode lost") && !calm.contains("refused"), "{calm}");
    }

    #[test]
    fn matrix_has_a_column_for_each_policy() {
        let (held, mixed) = (
            Outcomes::from([(Outcome::HoldSafe, 20)]),
            Outcomes::from([(Outcome::Unsafe, 1), (Outcome::HoldSafe, 10), (Outcome::Undetected, 9)]),
        );
        let cells =
            [("re-signed/present/one", &held), ("re-signed/present/two", &mixed), ("re-signed/silent/one", &held)];
        let lines = matrix(&cells);
        assert_eq!(lines.len(), 3);
        assert!(
            lines[0].starts_with("form, third unit    one") && lines[1].contains("UNSAFE 1, others 19"),
            "{lines:?}"
        );
    }
}
