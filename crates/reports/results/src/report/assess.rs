//! An open-loop assessment of a recording, as an object and as tables: trips of each test with exact intervals, and the injections that were
//! noticed.

use std::collections::BTreeMap;

use assess::log::{Format, Log};
use assess::map::Map;
use assess::{Assessment, Check, Facts, Injected, Moment, Tripped};
use evidence::SCHEMA_VERSION;
use oracle::PROPERTIES;
use serde::{Deserialize, Serialize};
use stats::{EventRate, Share};

use crate::report::{Table, new_table};

/// The object of `assess --json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AssessObject {
    /// Version of this object.
    pub schema_version: u32,
    /// The recording, as it was named.
    pub file: String,
    /// SHA-256 of the recording.
    pub sha256: String,
    /// Format of the recording.
    pub format: Format,
    /// Length of the recording, bytes.
    pub bytes: u64,
    /// Offset of the first byte that was not read; the length if all were.
    pub read_to: u64,
    /// Reason for stopping there, if before the end.
    pub stopped: Option<String>,
    /// Title of the map.
    pub title: String,
    /// Platform whose bounds were used.
    pub platform: String,
    /// Seed of the injections' moments.
    pub seed: u64,
    /// Time for which the guards were judged, seconds.
    pub judged_s: f64,
    /// Restarts of the guards by the map's rule.
    pub restarts: u64,
    /// Facts about the readings.
    pub facts: Facts,
    /// Reservations about this recording.
    pub remarks: Vec<String>,
    /// Every test on the recording as it is.
    pub tests: Vec<TestRow>,
    /// Every injection.
    pub injections: Vec<InjectionRow>,
    /// Length of an injection, and the longest time to notice it, seconds.
    pub window_s: f64,
    /// Properties that an open loop cannot show.
    pub not_assessed: Vec<String>,
}

/// One test on the recording as it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TestRow {
    /// Test; absent in the row of all tests together.
    pub test: Option<Check>,
    /// False where the map gives it no input; its numbers are zero then.
    pub judged: bool,
    /// Number of times that it began to fail.
    pub trips: u64,
    /// Time for which it failed, seconds.
    pub failing_s: f64,
    /// Time for which it could trip, seconds.
    pub at_risk_s: f64,
    /// Trips an hour at risk, with an exact two-sided 95 % interval (Poisson); absent without time at risk.
    pub per_hour: Option<EventRate>,
    /// The first trips.
    pub first: Vec<Moment>,
}

/// One injection at all its moments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InjectionRow {
    /// Name with strength.
    pub injection: String,
    /// Moments.
    pub n: u64,
    /// Share of noticed injections, with an exact two-sided 95 % interval.
    pub noticed: Share,
    /// Share among the moments after which the vehicle moved by a metre or more.
    pub noticed_moving: Share,
    /// Median time to notice over all moments, seconds; absent where fewer than half were noticed.
    pub median_s: Option<f64>,
    /// Longest time of those that were noticed, seconds.
    pub longest_s: Option<f64>,
    /// Tests that failed at the first failing tick, by name; several may at one.
    pub by: BTreeMap<String, u64>,
}

/// The recording and the way in which it was assessed.
#[derive(Clone, Debug)]
pub struct Assessed<'a> {
    /// Name of the file.
    pub file: String,
    /// SHA-256 of it.
    pub sha256: String,
    /// The recording.
    pub log: &'a Log<'a>,
    /// The map.
    pub map: &'a Map,
    /// Name of the platform.
    pub platform: String,
    /// Seed.
    pub seed: u64,
}

impl AssessObject {
    /// The result of an assessment.
    pub fn new(assessed: Assessed<'_>, result: &Assessment) -> Self {
        let Assessed { file, sha256, log, map, platform, seed } = assessed;
        Self {
            schema_version: SCHEMA_VERSION,
            file,
            sha256,
            format: log.format,
            bytes: log.end.of,
            read_to: log.end.at,
            stopped: log.end.why.clone(),
            title: map.title.clone(),
            platform,
            seed,
            judged_s: result.judged_s,
            restarts: result.restarts,
            facts: result.facts.clone(),
            remarks: result.remarks.clone(),
            tests: result.trips.iter().map(TestRow::from_tripped).collect(),
            injections: result.injected.iter().map(InjectionRow::from_injected).collect(),
            window_s: *map.inject.window_s.as_ref(),
            not_assessed: not_assessed(),
        }
    }
}

/// Properties of the closed loop, which no recording can show: a recorded vehicle reacts to no guard.
fn not_assessed() -> Vec<String> {
    PROPERTIES.iter().map(|row| format!("{}, {}", row.name, row.brief)).collect()
}

impl TestRow {
    fn from_tripped(tripped: &Tripped) -> Self {
        let hours = tripped.at_risk_s / 3600.0;
        let judged = tripped.judged;
        Self {
            test: tripped.check,
            judged,
            trips: tripped.trips,
            failing_s: if judged { tripped.failing_s } else { 0.0 },
            at_risk_s: if judged { tripped.at_risk_s } else { 0.0 },
            per_hour: EventRate::new(tripped.trips, hours).filter(|_| judged),
            first: tripped.first.clone(),
        }
    }
}

impl InjectionRow {
    fn from_injected(injected: &Injected) -> Self {
        let middle = injected.n as usize / 2;
        Self {
            injection: injected.injection.name(),
            n: injected.n,
            noticed: Share::new(injected.noticed, injected.n),
            noticed_moving: Share::new(injected.noticed_moving, injected.moving),
            median_s: injected.after_s.get(middle).copied(),
            longest_s: injected.after_s.last().copied(),
            by: injected.by.iter().map(|(check, n)| (check.name().to_owned(), *n)).collect(),
        }
    }
}

/// The tables for a terminal.
pub fn assess_table(object: &AssessObject) -> String {
    let stopped = object.stopped.as_ref().map_or_else(String::new, |reason| format!(": {reason}"));
    format!(
        "{} ({}), platform {}, seed {}: read to byte {} of {}{stopped}\n{}\n\nOpen loop: the guards judge the recording and nothing reacts to \
         them. {:.1} s judged{}.\n{}\n\nInjections of {} s into copies of the recording, at seeded moments from which on no guard fails \
         without them:\n{}\n\nNOT ASSESSED, of the closed loop:\n{}\n",
        object.file,
        object.title,
        object.platform,
        object.seed,
        object.read_to,
        object.bytes,
        object.remarks.iter().map(|remark| format!("- {remark}")).collect::<Vec<_>>().join("\n"),
        object.judged_s,
        if object.restarts > 0 { format!(", {} restarts of the guards", object.restarts) } else { String::new() },
        tests_table(object),
        object.window_s,
        injections_table(object),
        object.not_assessed.iter().map(|name| format!("  {name}")).collect::<Vec<_>>().join("\n"),
    )
}

fn tests_table(object: &AssessObject) -> Table {
    let mut table =
        new_table(&["test", "trips", "failing s", "at risk s", "trips an hour at risk (95 %)", "first at s"]);
    for row in &object.tests {
        let name = row.test.map_or("any", Check::name).to_owned();
        if !row.judged {
            table.add_row([name, "NOT ASSESSED: no input".to_owned()]);
            continue;
        }
        let rate = row.per_hour.as_ref().map_or_else(
            || "no time at risk".to_owned(),
            |rate| format!("{:.1} ({:.1} to {:.1})", rate.rate, rate.lower_95, rate.upper_95),
        );
        let first = row.first.iter().map(|moment| match &moment.mode {
            Some(mode) => format!("{:.1} ({mode})", moment.at_s),
            None => format!("{:.1}", moment.at_s),
        });
        table.add_row([
            name,
            row.trips.to_string(),
            format!("{:.1}", row.failing_s),
            format!("{:.1}", row.at_risk_s),
            rate,
            first.take(3).collect::<Vec<_>>().join(", "),
        ]);
    }
    table
}

fn injections_table(object: &AssessObject) -> String {
    if object.injections.iter().all(|row| row.n == 0) {
        return format!("NOT ASSESSED: no {} s of the recording are free of trips.", object.window_s + 1.0);
    }
    let header = ["injection", "noticed (95 %)", "of those in motion", "median s", "longest s", "first by"];
    let mut table = new_table(&header);
    let seconds = |s: Option<f64>| s.map_or_else(|| "-".to_owned(), |s| format!("{s:.2}"));
    for row in &object.injections {
        if row.n == 0 {
            table.add_row([row.injection.as_str(), "NOT ASSESSED: no moment with enough past"]);
            continue;
        }
        let Share { hits, n, lower_95, upper_95, .. } = row.noticed;
        table.add_row([
            row.injection.clone(),
            format!("{hits} of {n} ({lower_95:.2} to {upper_95:.2})"),
            format!("{} of {}", row.noticed_moving.hits, row.noticed_moving.n),
            seconds(row.median_s),
            seconds(row.longest_s),
            row.by.iter().map(|(name, n)| format!("{name} {n}")).collect::<Vec<_>>().join(", "),
        ]);
    }
    table.to_string()
}
