//! The kill table: one row for each process killed and mode of running. Counts and times only; the required responses
//! were stated and judged by the oracle.

use std::collections::BTreeMap;

use evidence::process_fault::{From, Response};
use evidence::trial::{Outcome, Trial};
use oracle::process_fault::RequiredResponse;
use results::mode::Mode;
use results::report::new_table;
use serde::Serialize;
use stats::{LEVEL, Sample, rate_upper};
use wire::bounds::Bounds;
use wire::mode::Mode as Driving;

/// A time over many trials, ms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Times {
    /// Number, mean, 95th percentile.
    #[serde(flatten)]
    pub sample: Sample,
    /// The longest.
    pub max: Option<f64>,
}

impl Times {
    pub(super) fn from_values(values: impl Iterator<Item = Option<f64>>) -> Times {
        let values: Vec<f64> = values.flatten().collect();
        Times { max: values.iter().copied().reduce(f64::max), sample: Sample::from_values(values) }
    }
}

/// One process killed in many trials.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct KillRow {
    /// The process.
    pub process: String,
    /// Twin or live.
    pub mode: Mode,
    /// Trials.
    pub n: u64,
    /// Number of these INVALID: the kill did not provably arrive, the log does not hold, the host overslept.
    pub invalid: u64,
    /// Classes of all trials.
    pub outcomes: BTreeMap<Outcome, u64>,
    /// The mode that was stated beforehand.
    pub expected: Option<Driving>,
    /// And its bound, ms; none where no change is required.
    pub within_ms: Option<u64>,
    /// Start of the times.
    pub from: Option<From>,
    /// Reason.
    pub reason: Option<&'static str>,
    /// Modes before the kill.
    pub before: BTreeMap<Driving, u64>,
    /// Modes at the end.
    pub after: BTreeMap<Driving, u64>,
    /// Causes named for them.
    pub causes: BTreeMap<String, u64>,
    /// To the first restriction.
    pub restricted_ms: Times,
    /// To the mode of the end.
    pub settled_ms: Times,
    /// True speed at the kill, mm/s.
    pub speed_mm_s: Times,
    /// Until no set-point was leased.
    pub lease_ended_ms: Times,
    /// Until the plant stood.
    pub standing_ms: Times,
    /// Valid trials in which every required response came in time.
    pub kept: u64,
    /// Exact one-sided upper 95 % bound on the rate of those in which it did not.
    pub broken_upper_95: f64,
}

impl KillRow {
    /// Row of `trials`, with the `responses` of the valid ones.
    pub fn new(
        process: String,
        mode: Mode,
        owed: Option<&RequiredResponse>,
        bounds: &Bounds,
        trials: &[&Trial],
        responses: &[&Response],
    ) -> KillRow {
        let plant = |get: &dyn Fn(&evidence::process_fault::PlantResponse) -> Option<f64>| {
            Times::from_values(responses.iter().map(|r| r.plant.as_ref().and_then(get)))
        };
        let kept = responses.iter().filter(|r| r.in_time).count() as u64;
        KillRow {
            process,
            mode,
            n: trials.len() as u64,
            invalid: trials.iter().filter(|t| t.outcome == Outcome::Invalid).count() as u64,
            outcomes: tally(trials.iter().map(|t| t.outcome)),
            expected: owed.map(|o| o.ends_in),
            within_ms: owed.and_then(|o| o.settled).map(|bound| bound(bounds)),
            from: owed.map(|o| o.from),
            reason: owed.map(|o| o.reason),
            before: tally(responses.iter().map(|r| r.before)),
            after: tally(responses.iter().map(|r| r.after)),
            causes: tally(responses.iter().filter_map(|r| r.cause.clone())),
            restricted_ms: Times::from_values(responses.iter().map(|r| r.restricted_ms)),
            settled_ms: Times::from_values(responses.iter().map(|r| r.settled_ms)),
            speed_mm_s: plant(&|p| Some(f64::from(p.speed_mm_s))),
            lease_ended_ms: plant(&|p| p.lease_ended_ms),
            standing_ms: plant(&|p| p.standing_ms),
            kept,
            broken_upper_95: rate_upper(responses.len() as u64 - kept, responses.len() as u64, LEVEL),
        }
    }
}

fn tally<K: Ord>(values: impl IntoIterator<Item = K>) -> BTreeMap<K, u64> {
    let mut counts = BTreeMap::new();
    values.into_iter().for_each(|value| *counts.entry(value).or_insert(0) += 1);
    counts
}

/// The kill table for a terminal.
pub fn kill_table(rows: &[KillRow]) -> String {
    let mut table = new_table(&[
        "killed",
        "n (invalid)",
        "before",
        "expected",
        "ended in",
        "cause",
        "restricted ms",
        "settled ms",
        "speed mm/s",
        "lease ended ms",
        "standing ms",
        "as owed",
    ]);
    for row in rows {
        let bound = row.within_ms.map_or_else(String::new, |ms| format!(" in {ms} ms"));
        let hold = if row.from == Some(From::Hold) { " of a HOLD" } else { "" };
        table.add_row(vec![
            format!("{} ({})", row.process, row.mode.name()),
            format!("{} ({})", row.n, row.invalid),
            counts(row.before.iter().map(|(mode, n)| (mode.name(), n))),
            row.expected.map_or_else(String::new, |mode| format!("{}{bound}{hold}", mode.name())),
            counts(row.after.iter().map(|(mode, n)| (mode.name(), n))),
            counts(row.causes.iter().map(|(cause, n)| (cause.as_str(), n))),
            times(&row.restricted_ms),
            times(&row.settled_ms),
            times(&row.speed_mm_s),
            times(&row.lease_ended_ms),
            times(&row.standing_ms),
            row.kept.to_string(),
        ]);
    }
    format!("{table}\nTimes: mean / longest, from the kill (broker: from the operator's HOLD after it).\n")
}

fn counts<'a>(of: impl Iterator<Item = (&'a str, &'a u64)>) -> String {
    of.map(|(name, n)| format!("{name} {n}")).collect::<Vec<_>>().join(", ")
}

fn times(times: &Times) -> String {
    match (times.sample.mean, times.max) {
        (Some(mean), Some(max)) => format!("{mean:.0} / {max:.0}"),
        (None, _) | (_, None) => "-".to_owned(),
    }
}
