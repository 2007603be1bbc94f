//! Lateness with which this host wakes a sleeping thread: too much of it spoils a live run.
//!
//! A short measurement of an unloaded program, so an estimate from below: a live run has a dozen processes.

use std::time::Duration;

use link::clock::oversleeps;
use live::OVERSLEPT_US;
use serde::Serialize;

/// Requested length of each sleep.
const NAP: Duration = Duration::from_millis(5);
/// Number of sleeps of each thread: about two seconds in all.
const NAPS: usize = 350;
/// Threads, at most: one for each core that the program may use.
const MAX_THREADS: usize = 16;

/// Lateness of many short sleeps, one thread for each core at the same time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Scheduling {
    /// Threads that slept.
    threads: usize,
    /// Sleeps, of all threads together.
    sleeps: usize,
    /// Median lateness, milliseconds.
    p50_ms: f64,
    /// 99th percentile, milliseconds.
    p99_ms: f64,
    /// Greatest lateness, milliseconds.
    max_ms: f64,
    /// Lateness above which a live run is INVALID, milliseconds.
    limit_ms: f64,
    /// True if the latest was within the limit.
    within: bool,
    /// Advice where it was not.
    #[serde(skip_serializing_if = "Option::is_none")]
    advice: Option<&'static str>,
}

/// Advice for a host that is too late, or nearly.
const ADVICE: &str =
    "end other work before a live run, and run one at a time (--jobs 1); --retries 2 repeats what the host spoils";

/// Sleeps for about two seconds and reports the lateness.
pub(super) fn measure() -> Scheduling {
    let threads = parallel::cores().clamp(1, MAX_THREADS);
    let all: Vec<u64> = std::thread::scope(|scope| {
        let sleepers: Vec<_> = (0..threads).map(|_| scope.spawn(|| oversleeps(NAP, NAPS))).collect();
        sleepers.into_iter().flat_map(|sleeper| sleeper.join().unwrap_or_default()).collect()
    });
    Scheduling::from_delays(threads, all)
}

impl Scheduling {
    /// Quantiles of sleeps that were late by a given number of microseconds.
    fn from_delays(threads: usize, mut late: Vec<u64>) -> Self {
        late.sort_unstable();
        let quantile = |share: f64| late.get(((late.len() as f64 * share).ceil() as usize).saturating_sub(1)).copied();
        let ms = |us: Option<u64>| us.unwrap_or(0) as f64 / 1000.0;
        let max = late.last().copied();
        // Half of the limit in two quiet seconds leaves little for a run.
        let advice = max.is_some_and(|max| max > OVERSLEPT_US / 2).then_some(ADVICE);
        Self {
            threads,
            sleeps: late.len(),
            p50_ms: ms(quantile(0.5)),
            p99_ms: ms(quantile(0.99)),
            max_ms: ms(max),
            limit_ms: ms(Some(OVERSLEPT_US)),
            within: max.is_none_or(|max| max <= OVERSLEPT_US),
            advice,
        }
    }

    /// The mark of its line: lateness is no missing requirement, since the twin is unaffected.
    pub(super) fn mark(&self) -> &'static str {
        if self.within { "ok     " } else { "LATE   " }
    }

    /// The measurement in words.
    pub(super) fn found(&self) -> String {
        format!(
            "late by {:.1} ms (p50), {:.1} ms (p99), {:.1} ms (max) in {} sleeps on {} threads; {:.0} ms spoil a live run",
            self.p50_ms, self.p99_ms, self.max_ms, self.sleeps, self.threads, self.limit_ms
        )
    }

    /// Advice, if there is any.
    pub(super) fn advice(&self) -> Option<&'static str> {
        self.advice
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Near the limit there is advice.
    #[test]
    fn lateness_is_compared_with_the_limit() {
        let quiet = Scheduling::from_delays(2, (1..=100).map(|n| n * 10).collect());
        assert_eq!((quiet.p50_ms, quiet.p99_ms, quiet.max_ms), (0.5, 0.99, 1.0));
        assert!(quiet.within && quiet.advice().is_none());
        let near = Scheduling::from_delays(2, vec![100, OVERSLEPT_US]);
        assert!(near.within && near.advice().is_some());
        let late = Scheduling::from_delays(2, vec![100, OVERSLEPT_US + 1]);
        assert!(!late.within && late.mark().starts_with("LATE") && late.advice().is_some());
    }

    #[test]
    fn every_thread_sleeps_as_often_as_was_meant() {
        let measured = measure();
        assert_eq!(measured.sleeps, measured.threads * NAPS);
        assert!(measured.p50_ms <= measured.p99_ms && measured.p99_ms <= measured.max_ms);
    }
}
