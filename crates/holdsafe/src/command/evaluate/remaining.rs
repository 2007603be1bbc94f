//! Trials of an evaluation that remain, and an estimate of their time. Times are handed in; no clock is read here.

use results::mode::Mode;
use scenario::Scenario;

/// Simulated seconds per second of a core, assumed until a rate has been measured: `holdsafe run nominal --trials 200`
/// on a slow host.
const TWIN_SPEED: f64 = 220.0;
/// Seconds of a core for a trial on the stacks, assumed until then.
const STACK_S: f64 = 0.03;
/// Seconds that a live run takes in addition to its length, to begin, to be verified and to be replayed; assumed until
/// then.
const LIVE_BEYOND_S: f64 = 8.0;
/// Expected seconds of work after which a measured rate weighs as much as the one assumed before.
const TRUST_S: f64 = 20.0;

/// The whole work: trials in the twin and on the stacks, and then live runs.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Remaining {
    pub(super) simulated: Share,
    pub(super) live: Share,
}

/// Trials of one kind, sequential or in parallel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Share {
    /// All of them.
    pub(super) trials: usize,
    /// Number of finished trials.
    pub(super) finished: usize,
    /// Expected seconds of those that were missing at the start.
    expected_s: f64,
    /// Expected seconds of those that have run since.
    done_s: f64,
    /// Time at which the first of these began.
    began_us: u64,
    /// Seconds that they took.
    took_s: f64,
}

/// Seconds that one trial adds to the whole, a given number of live ones side by side, before any rate has been measured.
pub(super) fn expect_seconds(mode: Mode, scenario: &Scenario, cores: usize, live_jobs: usize) -> f64 {
    let (length_s, cores) = (scenario.duration_s.get(), cores as f64);
    match mode {
        Mode::Twin => length_s / TWIN_SPEED / cores,
        Mode::Stack => STACK_S / cores,
        Mode::Live => (length_s + LIVE_BEYOND_S) / live_jobs as f64,
    }
}

impl Share {
    /// Adds trials, of which some are missing and each is expected to take `each_s`.
    pub(super) fn add(&mut self, trials: usize, missing: usize, each_s: f64) {
        self.trials += trials;
        self.finished += trials.saturating_sub(missing);
        self.expected_s += missing as f64 * each_s;
    }

    /// Trials that are missing.
    pub(super) fn missing(&self) -> usize {
        self.trials.saturating_sub(self.finished)
    }

    /// Notes the time at which its trials begin.
    pub(super) fn begin(&mut self, now_us: u64) {
        self.began_us = now_us;
    }

    /// Notes that a trial with this expected time has run.
    pub(super) fn finish(&mut self, expected_s: f64, now_us: u64) {
        self.finished += 1;
        self.done_s += expected_s;
        self.took_s = now_us.saturating_sub(self.began_us) as f64 / 1e6;
    }

    /// Estimate of the seconds until all are finished: the expected ones, at the measured rate.
    fn seconds_left(&self) -> f64 {
        let rate = (self.took_s + TRUST_S) / (self.done_s + TRUST_S);
        (self.expected_s - self.done_s).max(0.0) * rate
    }
}

impl Remaining {
    /// The share of this mode.
    pub(super) fn share(&mut self, mode: Mode) -> &mut Share {
        match mode {
            Mode::Twin | Mode::Stack => &mut self.simulated,
            Mode::Live => &mut self.live,
        }
    }

    /// The estimate in words.
    pub(super) fn describe_time(&self) -> String {
        describe_duration(self.simulated.seconds_left() + self.live.seconds_left())
    }

    /// Finished and all trials, in words.
    pub(super) fn describe_finished(&self) -> String {
        self.describe_shares(|share| format!("{} of {}", group_digits(share.finished), group_digits(share.trials)))
    }

    /// All trials, in words.
    pub(super) fn describe_all(&self) -> String {
        self.describe_shares(|share| group_digits(share.trials))
    }

    /// Each share that has trials, by `number` and with its name.
    fn describe_shares(&self, number: impl Fn(&Share) -> String) -> String {
        let shares = [(&self.simulated, "twin and stack trials"), (&self.live, "live runs")];
        let words = shares
            .iter()
            .filter(|(share, _)| share.trials > 0)
            .map(|(share, name)| format!("{} {name}", number(share)));
        words.collect::<Vec<_>>().join(", ")
    }
}

/// A length of time as a person would say it.
fn describe_duration(seconds: f64) -> String {
    let minutes = (seconds / 60.0).round() as u64;
    match (minutes / 60, minutes % 60) {
        (0, 0) => "less than a minute".to_owned(),
        (0, minutes) => format!("about {minutes} min"),
        (hours, minutes) => format!("about {hours} h {minutes} min"),
    }
}

/// A number with its digits in groups of three.
pub(super) fn group_digits(n: usize) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A share of 100 trials, 20 of them there already, each expected to take ten seconds.
    fn share() -> Share {
        let mut share = Share::default();
        share.add(100, 80, 10.0);
        share.begin(5_000_000);
        share
    }

    #[test]
    fn only_missing_trials_take_time() {
        let mut share = share();
        assert_eq!((share.trials, share.finished, share.missing()), (100, 20, 80));
        assert_eq!(share.seconds_left(), 800.0);
        share.add(10, 0, 10.0);
        assert_eq!((share.finished, share.seconds_left()), (30, 800.0));
    }

    #[test]
    fn estimate_follows_the_measured_rate() {
        let mut share = share();
        // Twice as slow as expected.
        for n in 1..=60 {
            share.finish(10.0, 5_000_000 + n * 20_000_000);
        }
        let rate = (1_200.0 + TRUST_S) / (600.0 + TRUST_S);
        assert!((share.seconds_left() - 200.0 * rate).abs() < 1e-9 && rate > 1.9, "{}", share.seconds_left());
        for n in 61..=80 {
            share.finish(10.0, 5_000_000 + n * 20_000_000);
        }
        assert_eq!((share.missing(), share.seconds_left()), (0, 0.0));
    }

    #[test]
    fn first_trial_alone_does_not_set_the_rate() {
        let mut share = share();
        share.finish(10.0, 105_000_000);
        assert!(share.seconds_left() < 790.0 * 5.0, "{}", share.seconds_left());
    }

    #[test]
    fn progress_names_each_share_with_trials() {
        let mut remaining = Remaining::default();
        remaining.share(Mode::Twin).add(33_453, 33_453 - 12_340, 0.0);
        remaining.share(Mode::Stack).add(4_366, 4_366, 0.0);
        assert_eq!(remaining.describe_finished(), "12,340 of 37,819 twin and stack trials");
        remaining.share(Mode::Live).add(153, 150, 12.4);
        assert_eq!(remaining.describe_finished(), "12,340 of 37,819 twin and stack trials, 3 of 153 live runs");
        assert_eq!(
            (remaining.describe_all(), remaining.describe_time()),
            ("37,819 twin and stack trials, 153 live runs".into(), "about 31 min".into())
        );
        assert_eq!(
            [0.0, 29.0, 31.0, 5_430.0].map(describe_duration),
            ["less than a minute", "less than a minute", "about 1 min", "about 1 h 31 min"]
        );
        assert_eq!([0, 999, 1_000, 1_234_567].map(group_digits), ["0", "999", "1,000", "1,234,567"]);
    }
}
