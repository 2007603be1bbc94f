//! The table of faults: attempts, survivals, losses, the time to the stated mode, and anything that was left on the machine.

use evidence::trial::{Outcome, Trial};
use results::report::new_table;
use serde::Serialize;
use stats::{LEVEL, rate_upper};

use super::kill::Times;

/// Things of ours on the machine, besides this process.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Left {
    /// Processes of this program.
    pub processes: usize,
    /// Segments and marks in shared memory.
    pub segments: usize,
    /// Folders for sockets and logs, among the temporary files.
    pub folders: usize,
    /// Network namespaces that processes of this program are in, beside the machine's.
    pub namespaces: usize,
}

/// One fault, many attempts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FaultRow {
    /// Number of the fault, `F1` to `F13`, or `combined`.
    pub fault: &'static str,
    /// The fault in words.
    pub what: String,
    /// Twin, live or files.
    pub mode: &'static str,
    /// Attempts.
    pub attempts: u64,
    /// Number of these INVALID: the fault did not provably arrive, or the host overslept.
    pub invalid: u64,
    /// Valid attempts after which the platform was in the stated mode in time, and runs that were refused in words before they began.
    pub survived: u64,
    /// Number of these refused before the run began.
    pub refused: u64,
    /// Valid attempts without that.
    pub lost: u64,
    /// Exact one-sided upper 95 % bound on the rate of those.
    pub lost_upper_95: f64,
    /// To the stated mode.
    pub to_mode_ms: Times,
    /// Left behind after all attempts.
    pub left: Left,
}

/// Results of attempts that are not trials of a batch.
#[derive(Clone, Debug, Default)]
pub struct Attempts {
    /// Trials that ran.
    pub trials: Vec<Trial>,
    /// Runs that were refused before they began.
    pub refused: u64,
}

impl FaultRow {
    /// Row of attempts at one fault.
    pub fn new(fault: &'static str, what: String, mode: &'static str, of: &Attempts, left: Left) -> Self {
        let valid: Vec<&Trial> = of.trials.iter().filter(|trial| trial.outcome != Outcome::Invalid).collect();
        let lost = valid.iter().filter(|trial| !survived(trial)).count() as u64;
        let attempts = of.trials.len() as u64 + of.refused;
        let judged = valid.len() as u64 + of.refused;
        let responses = valid.iter().flat_map(|trial| &trial.responses).filter(|response| response.required);
        let by_process: Vec<Option<f64>> = responses.map(|response| response.settled_ms).collect();
        let to_mode_ms = match by_process.is_empty() {
            false => Times::from_values(by_process.into_iter()),
            true => Times::from_values(valid.iter().map(|t| t.latency_ms.to_hold_safe.or(t.latency_ms.to_degraded))),
        };
        let lost_upper_95 = rate_upper(lost, judged, LEVEL);
        let (invalid, survived, refused) = (of.trials.len() as u64 - valid.len() as u64, judged - lost, of.refused);
        Self { fault, what, mode, attempts, invalid, survived, refused, lost, lost_upper_95, to_mode_ms, left }
    }
}

/// True if the platform was in the stated mode in time; of an INVALID trial it is not known, and said to be so.
pub fn survived(trial: &Trial) -> bool {
    let broken = [Outcome::Unsafe, Outcome::GuestFailed, Outcome::Late];
    !broken.contains(&trial.outcome) && trial.responses.iter().all(|response| response.in_time)
}

/// The table for a terminal.
pub fn fault_table(rows: &[FaultRow]) -> String {
    let mut table =
        new_table(&["", "fault", "mode", "attempts", "invalid", "survived", "lost", "below", "to mode ms", "left"]);
    for row in rows {
        let refused = if row.refused > 0 { format!(" ({} refused)", row.refused) } else { String::new() };
        let Left { processes, segments, folders, namespaces } = row.left;
        let times = match (row.to_mode_ms.sample.mean, row.to_mode_ms.sample.p95, row.to_mode_ms.max) {
            (Some(mean), p95, Some(max)) => {
                format!("{mean:.0} / {} / {max:.0}", p95.map_or("-".to_owned(), |p95| format!("{p95:.0}")))
            }
            (None, ..) | (_, _, None) => "-".to_owned(),
        };
        table.add_row(vec![
            row.fault.to_owned(),
            row.what.clone(),
            row.mode.to_owned(),
            row.attempts.to_string(),
            row.invalid.to_string(),
            format!("{}{refused}", row.survived),
            row.lost.to_string(),
            format!("{:.2} %", row.lost_upper_95 * 100.0),
            times,
            (processes + segments + folders + namespaces).to_string(),
        ]);
    }
    format!(
        "{table}\nTimes: mean / p95 / longest. Below: exact one-sided 95 % bound on the rate lost. Left: processes, segments, folders and \
         network namespaces of ours after all attempts.\n"
    )
}
