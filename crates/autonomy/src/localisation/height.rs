//! Height of a unit that flies: pressure and satellite receiver, held against each other and against the velocity
//! between them.
//!
//! The height is carried forward by the measured climb. Each source is held against it and against the other one; while
//! one of them is further off than their errors can explain, neither is used, and height uses the climb alone. World
//! frame, millimetres.

use config::platform::Aloft;
use wire::mode::Because;
use wire::motion::Spatial;
use wire::time::{Instant, Span};

/// Time over which the height follows its sources, seconds.
const FOLLOWS_S: f64 = 2.0;
/// A disagreement ends within this share of the gate, so that noise does not make it flicker.
const RETURN: f64 = 0.7;

/// Sources and estimate.
#[derive(Clone, Debug)]
pub(super) struct Height {
    gate_mm: f64,
    /// Time of the newest reading of each: pressure, fix, velocity.
    heard: [Instant; 3],
    estimate: Option<f64>,
    climb: f64,
    disagrees: bool,
}

impl Height {
    pub(super) fn new(limits: &Aloft) -> Self {
        let gate_mm = f64::from(limits.height_gate_mm);
        Height { gate_mm, heard: [Instant(0); 3], estimate: None, climb: 0.0, disagrees: false }
    }

    /// Takes the readings of `stamp`, `elapsed` seconds after those before.
    pub(super) fn take(&mut self, reading: &Spatial, stamp: Instant, elapsed: f64) {
        let Spatial { fix_up_mm, pressure_up_mm, left_up_mm_s, .. } = *reading;
        let present = [pressure_up_mm.is_some(), fix_up_mm.is_some(), left_up_mm_s.is_some()];
        for (heard, there) in self.heard.iter_mut().zip(present) {
            *heard = if there { stamp } else { *heard };
        }
        self.climb = left_up_mm_s.map_or(self.climb, |[_, up]| f64::from(up));
        let sources = [pressure_up_mm.map(f64::from), fix_up_mm.map(|mm| mm as f64)];
        let sources: Vec<f64> = sources.into_iter().flatten().collect();
        let mean = sources.iter().sum::<f64>() / sources.len().max(1) as f64;
        let Some(before) = self.estimate else {
            self.estimate = (!sources.is_empty()).then_some(mean);
            return;
        };
        let carried = before + self.climb * elapsed;
        let gate = self.gate_mm * if self.disagrees { RETURN } else { 1.0 };
        let off = |height: &f64| (height - carried).abs() > gate;
        let disagree = sources.windows(2).any(|pair| (pair[0] - pair[1]).abs() > gate);
        self.disagrees = disagree || sources.iter().any(off);
        let follows = if self.disagrees || sources.is_empty() { 0.0 } else { (elapsed / FOLLOWS_S).min(1.0) };
        self.estimate = Some(carried + follows * (mean - carried));
    }

    /// Reason that the height is lost, if it is: silence of a source for more than `limit`, or disagreement.
    pub(super) fn lost(&self, now: Instant, limit: Span) -> Option<Because> {
        let oldest = self.heard.into_iter().min().unwrap_or_default();
        if now.since(oldest) > limit || self.estimate.is_none() {
            return Some(Because::Silence(oldest));
        }
        self.disagrees.then_some(Because::Itself)
    }

    /// The height; absent before the first reading.
    pub(super) fn estimate(&self) -> Option<f64> {
        self.estimate
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::tests::LIMITS;

    const LIMIT: Span = Span::ms(300);

    /// Climbs for `n` readings from `from`, 20 a second, at 500 mm/s, with the sources displaced by `offset(seconds)`.
    fn climb(height: &mut Height, from: u64, n: u64, offset: impl Fn(f64) -> [f64; 2]) -> Instant {
        for i in from..from + n {
            let t = i as f64 * 0.05;
            let [pressure, fix] = offset(t).map(|off| 2500.0 + 500.0 * t + off);
            let reading = Spatial {
                fix_up_mm: Some(fix as i64),
                pressure_up_mm: Some(pressure as i32),
                left_up_mm_s: Some([0, 500]),
                ..Spatial::default()
            };
            height.take(&reading, instant(i), 0.05);
        }
        instant(from + n - 1)
    }

    fn instant(i: u64) -> Instant {
        Instant(1_000_000 + i * 50_000)
    }

    #[test]
    fn height_follows_a_climb() {
        let mut height = Height::new(&LIMITS);
        let now = climb(&mut height, 0, 60, |_| [0.0; 2]);
        assert_eq!(height.lost(now, LIMIT), None);
        assert!((height.estimate().unwrap() - 3975.0).abs() < 5.0, "{height:?}");
    }

    #[test]
    fn jump_or_drift_of_a_source_loses_the_height() {
        for offset in [|_: f64| [1000.0, 0.0], |_: f64| [0.0, -1000.0], |t: f64| [(t - 3.0) * 200.0, 0.0]] {
            let mut height = Height::new(&LIMITS);
            climb(&mut height, 0, 60, |_| [0.0; 2]);
            let now = climb(&mut height, 60, 120, offset);
            assert_eq!(height.lost(now, LIMIT), Some(Because::Itself));
            let off = (height.estimate().unwrap() - (2500.0 + 500.0 * 8.95)).abs();
            assert!(off < 500.0, "{off}");
        }
    }

    #[test]
    fn silence_of_a_source_is_a_loss() {
        let mut height = Height::new(&LIMITS);
        let now = climb(&mut height, 0, 3, |_| [0.0; 2]);
        let deaf = Spatial {
            pressure_up_mm: None,
            ..Spatial { fix_up_mm: Some(2500), left_up_mm_s: Some([0, 0]), ..Spatial::default() }
        };
        height.take(&deaf, now + Span::ms(301), 0.3);
        assert_eq!(height.lost(now + Span::ms(301), LIMIT), Some(Because::Silence(now)));
    }
}
