//! Downhill by the mean gradient of some views at each step, within bounds.

/// Share of the step before that is kept (momentum, Dong et al. 2018).
const MOMENTUM: f32 = 0.8;
/// Share of the way from the middle of the bounds to an end that the first step goes at most.
const FIRST: f32 = 0.25;

/// Values on their way down.
#[derive(Clone)]
pub(crate) struct Descent {
    pub(crate) values: Vec<f32>,
    pace: Vec<f32>,
    low: f32,
    high: f32,
}

impl Descent {
    /// Descent from `values`, each of which stays between `low` and `high`.
    pub(crate) fn new(values: Vec<f32>, low: f32, high: f32) -> Self {
        Descent { pace: vec![0.0; values.len()], values, low, high }
    }

    /// One step against `gradient`. Large steps first, to cross from one end to the other; small ones to settle: `left` is the
    /// share of all steps that is still to be made.
    pub(crate) fn step(&mut self, gradient: &[f32], left: f32) {
        let size = gradient.iter().map(|v| v.abs()).sum::<f32>().max(f32::MIN_POSITIVE) / gradient.len() as f32;
        let length = 0.5 * (self.high - self.low) * FIRST * left;
        for ((value, pace), of) in self.values.iter_mut().zip(&mut self.pace).zip(gradient) {
            *pace = MOMENTUM * *pace + of / size;
            *value = (*value - length * pace.clamp(-1.0, 1.0)).clamp(self.low, self.high);
        }
    }
}
