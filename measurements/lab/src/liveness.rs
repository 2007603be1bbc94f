//! Cost of noticing silence sooner: detectors of silence on a modelled stream of periodic messages.
//!
//! The stream represents grants to a unit and for reports to the gateway: one message every 100 ms, lost with some
//! probability or late by some jitter. Three kinds of detector watch the very same arrivals:
//!
//! - a *fixed* time since the last arrival, as the supervision lease is;
//! - *accrual* (N. Hayashibara et al., *The φ accrual failure detector*, SRDS 2004): the spacing of arrivals in a
//!   window is taken to be normal, and silence is suspected once it is less likely than 10^−φ;
//! - *configured* (W. Chen, S. Toueg, M. K. Aguilera, *On the quality of service of failure detectors*, IEEE Trans.
//!   Computers 51, 2002, NFD-E): the next arrival is expected from the mean of those before, and as many losses in a row are
//!   tolerated as the measured share of lost messages needs for a wanted time between mistakes.
//!
//! None is later than the lease, which stays the hard stop. No part of the platform is run here: the worth of a
//! detector is asked before one is built in.

use std::collections::VecDeque;

use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use serde::Serialize;
use statrs::function::erf::erfc_inv;

/// Time between messages, milliseconds.
pub const PERIOD_MS: f64 = 100.0;
/// The hard stop: time since the last arrival, milliseconds.
pub const LEASE_MS: f64 = 500.0;
/// Messages that an adaptive detector remembers: a minute.
const WINDOW: usize = 600;
/// It uses the lease alone before it has seen that many.
const WARM: usize = 100;
/// Least scatter assumed of arrivals, milliseconds: the host's contribution.
const SCATTER_MS: f64 = 5.0;
/// Suspicions that follow within this time are one: the mode's hysteresis, milliseconds.
const HYSTERESIS_MS: f64 = 1000.0;
/// Spacing of the blackouts that are tried, messages.
const BLACKOUTS: usize = 97;
/// Length of a spell of changing weather, messages: a minute.
const SPELL: usize = 600;

/// Conditions of the stream.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Weather {
    /// Share of messages lost.
    pub loss: f64,
    /// Longest uniform delay beside the usual, milliseconds.
    pub jitter_ms: f64,
    /// True if the loss comes and goes with the minute.
    pub changing: bool,
}

/// A detector at one operating point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Detector {
    /// So long after the last arrival.
    Fixed {
        /// Milliseconds.
        ms: u32,
    },
    /// At this suspicion.
    Accrual {
        /// φ.
        phi: i32,
    },
    /// For one mistake in so long a time.
    Configured {
        /// Seconds.
        recurrence_s: u32,
    },
}

impl Detector {
    /// Every operating point that is compared.
    pub fn all() -> Vec<Detector> {
        let fixed = (3..=10).map(|n| Detector::Fixed { ms: n * 50 });
        let accrual = [1, 2, 4, 8, 12, 16].map(|phi| Detector::Accrual { phi });
        let configured = [60, 600, 3_600, 36_000, 360_000].map(|recurrence_s| Detector::Configured { recurrence_s });
        fixed.chain(accrual).chain(configured).collect()
    }

    /// Name in tables.
    pub fn name(self) -> String {
        match self {
            Detector::Fixed { ms } => format!("fixed {ms} ms"),
            Detector::Accrual { phi } => format!("accrual φ {phi}"),
            Detector::Configured { recurrence_s } => format!("configured {recurrence_s} s"),
        }
    }

    /// True if it learns from the stream.
    pub fn adapts(self) -> bool {
        match self {
            Detector::Fixed { .. } => false,
            Detector::Accrual { .. } | Detector::Configured { .. } => true,
        }
    }
}

/// Result of a detector in some weather.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Detector.
    pub detector: Detector,
    /// Weather.
    pub weather: Weather,
    /// Hours of stream.
    pub hours: f64,
    /// Suspicions of a source that was alive.
    pub false_trips: u64,
    /// Time from a blackout to its suspicion, mean, milliseconds.
    pub latency_ms: f64,
    /// Its 95th percentile.
    pub latency_p95_ms: f64,
}

impl Outcome {
    /// False trips an hour.
    pub fn per_hour(&self) -> f64 {
        self.false_trips as f64 / self.hours
    }
}

/// The draws behind every stream: the same for each weather and detector.
pub struct Draws(Vec<(f32, f32)>);

impl Draws {
    /// For a given number of hours of messages.
    pub fn new(seed: u64, hours: u64) -> Draws {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut unit = || (rng.next_u32() >> 8) as f32 / 16_777_216.0;
        let messages = hours * 3_600_000 / PERIOD_MS as u64;
        Draws((0..messages).map(|_| (unit(), unit())).collect())
    }

    /// Time at which message `i` arrives in `weather`, milliseconds; `None` when it is lost.
    fn arrival(&self, i: usize, weather: &Weather) -> Option<f64> {
        let (lost, late) = self.0[i];
        let calm = weather.changing && (i / SPELL).is_multiple_of(2);
        let kept = calm || f64::from(lost) >= weather.loss;
        kept.then(|| i as f64 * PERIOD_MS + f64::from(late) * weather.jitter_ms)
    }

    /// Lets `detector` watch the stream in `weather`.
    pub fn watch(&self, detector: Detector, weather: Weather) -> Outcome {
        let mut watcher = Watcher::new(detector);
        let mut latencies = Vec::new();
        let (mut false_trips, mut tripped) = (0, f64::MIN);
        // The source speaks at 0, and the stream begins.
        for i in 1..self.0.len() {
            if let Some(at) = self.arrival(i, &weather) {
                let suspected = watcher.suspects_at();
                if at > suspected {
                    false_trips += u64::from(suspected > tripped + HYSTERESIS_MS);
                    tripped = at;
                }
                watcher.take(i, at);
            }
            if i.is_multiple_of(BLACKOUTS) {
                // Somewhere between this message and the next, which is never sent: its draw is of no other use.
                let phase = self.0.get(i + 1).map_or(0.5, |(_, late)| f64::from(*late));
                let blackout = (i as f64 + phase) * PERIOD_MS;
                latencies.push((watcher.suspects_at() - blackout).max(0.0));
            }
        }
        latencies.sort_by(f64::total_cmp);
        let p95 = latencies.get(latencies.len() * 95 / 100).copied().unwrap_or_default();
        let mean = latencies.iter().sum::<f64>() / latencies.len().max(1) as f64;
        let hours = self.0.len() as f64 * PERIOD_MS / 3.6e6;
        Outcome { detector, weather, hours, false_trips, latency_ms: mean, latency_p95_ms: p95 }
    }
}

/// A detector and its learned state.
struct Watcher {
    detector: Detector,
    /// Deviations of a normal distribution that belong to φ.
    deviations: f64,
    last: (usize, f64),
    /// Spacing of arrivals, and how far each was after its due time, oldest first.
    spacing: Moments,
    lateness: Moments,
    /// Sequences that came within the window.
    came: VecDeque<usize>,
}

impl Watcher {
    fn new(detector: Detector) -> Watcher {
        let deviations = match detector {
            Detector::Accrual { phi } => core::f64::consts::SQRT_2 * erfc_inv(2.0 * 10f64.powi(-phi)),
            Detector::Fixed { .. } | Detector::Configured { .. } => 0.0,
        };
        let (spacing, lateness) = (Moments::default(), Moments::default());
        Watcher { detector, deviations, last: (0, 0.0), spacing, lateness, came: VecDeque::new() }
    }

    fn take(&mut self, sequence: usize, at: f64) {
        if self.detector.adapts() {
            self.spacing.add(at - self.last.1);
            self.lateness.add(at - sequence as f64 * PERIOD_MS);
            self.came.push_back(sequence);
            while self.came.front().is_some_and(|first| first + WINDOW <= sequence) {
                self.came.pop_front();
            }
        }
        self.last = (sequence, at);
    }

    /// Time at which it suspects, if no message comes before.
    fn suspects_at(&self) -> f64 {
        let (sequence, at) = self.last;
        let suspects = match self.detector {
            Detector::Fixed { ms } => at + f64::from(ms),
            Detector::Accrual { .. } | Detector::Configured { .. } if self.came.len() < WARM => at + LEASE_MS,
            Detector::Accrual { .. } => at + self.spacing.mean() + self.deviations * self.spacing.scatter(),
            Detector::Configured { recurrence_s } => {
                let tolerated = self.tolerated(f64::from(recurrence_s));
                let due = (sequence + 1 + tolerated) as f64 * PERIOD_MS;
                due + self.lateness.mean() + 3.0 * self.lateness.scatter()
            }
        };
        suspects.min(at + LEASE_MS)
    }

    /// Losses in a row that have to be tolerated for one mistake in `recurrence_s` seconds.
    fn tolerated(&self, recurrence_s: f64) -> usize {
        let oldest = self.came.front().copied().unwrap_or_default();
        let sent = (self.last.0 + 1 - oldest) as f64;
        // Half a loss more than was seen (Jeffreys), so that a minute without one is not taken for a loss rate of zero.
        let lost = (sent - self.came.len() as f64 + 0.5) / (sent + 1.0);
        let mistakes_s = |n: usize| lost.powi(n as i32) * (1.0 - lost) * 1000.0 / PERIOD_MS;
        (1..4).find(|n| mistakes_s(*n) * recurrence_s <= 1.0).unwrap_or(4)
    }
}

/// Mean and scatter of the newest values.
#[derive(Default)]
struct Moments {
    values: VecDeque<f64>,
    sum: f64,
    squares: f64,
}

impl Moments {
    fn add(&mut self, value: f64) {
        self.values.push_back(value);
        self.sum += value;
        self.squares += value * value;
        if self.values.len() > WINDOW
            && let Some(old) = self.values.pop_front()
        {
            self.sum -= old;
            self.squares -= old * old;
        }
    }

    fn mean(&self) -> f64 {
        self.sum / self.values.len().max(1) as f64
    }

    /// Standard deviation, no less than the host adds.
    fn scatter(&self) -> f64 {
        let mean = self.mean();
        let variance = self.squares / self.values.len().max(1) as f64 - mean * mean;
        variance.max(0.0).sqrt().max(SCATTER_MS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CALM: Weather = Weather { loss: 0.0, jitter_ms: 0.0, changing: false };

    /// No detector is later than the lease.
    #[test]
    fn perfect_stream_trips_no_detector() {
        let draws = Draws::new(1, 1);
        for detector in Detector::all() {
            let outcome = draws.watch(detector, CALM);
            assert_eq!(outcome.false_trips, 0, "{outcome:?}");
            assert!(outcome.latency_p95_ms <= LEASE_MS, "{outcome:?}");
        }
    }

    /// As often as a given number of losses in a row come.
    #[test]
    fn lease_trips_as_often_as_loss_bursts() {
        let draws = Draws::new(1, 20);
        let weather = Weather { loss: 0.2, ..CALM };
        let outcome = draws.watch(Detector::Fixed { ms: 450 }, weather);
        let expected = 10.0 * 0.8 * 0.2_f64.powi(4) * 3600.0;
        assert!((outcome.per_hour() / expected - 1.0).abs() < 0.2, "{outcome:?} expected {expected}");
    }

    /// It is quick on a quiet one.
    #[test]
    fn adaptive_detector_is_slower_on_a_lossy_stream() {
        let draws = Draws::new(1, 2);
        for detector in [Detector::Accrual { phi: 8 }, Detector::Configured { recurrence_s: 36_000 }] {
            let latency = |loss| draws.watch(detector, Weather { loss, ..CALM }).latency_ms;
            assert!(latency(0.0) + 100.0 < latency(0.2), "{detector:?}");
        }
    }
}
