//! A sampled quantity between its samples: linear, with its integral.

/// Samples in order of time.
#[derive(Clone, Debug, Default)]
pub(crate) struct Curve {
    at: Vec<u64>,
    value: Vec<f64>,
    /// Integral up to each sample, value seconds.
    sum: Vec<f64>,
}

impl Curve {
    /// A curve through samples `(microseconds, value)` whose times increase.
    pub(crate) fn from_samples(samples: impl IntoIterator<Item = (u64, f64)>) -> Self {
        let mut curve = Self::default();
        for (at, value) in samples {
            let (before, last) = (curve.at.last().copied().unwrap_or(at), curve.value.last().copied().unwrap_or(value));
            let sum = curve.sum.last().copied().unwrap_or(0.0);
            curve.sum.push(sum + (at - before) as f64 / 1e6 * (value + last) / 2.0);
            curve.at.push(at);
            curve.value.push(value);
        }
        curve
    }

    /// Times of the samples.
    pub(crate) fn times(&self) -> &[u64] {
        &self.at
    }

    /// First and last time.
    pub(crate) fn ends(&self) -> Option<(u64, u64)> {
        Some((*self.at.first()?, *self.at.last()?))
    }

    /// Time from the newest sample at or before `time`; none before the first.
    pub(crate) fn age(&self, time: u64) -> Option<u64> {
        let next = self.at.partition_point(|sample| *sample <= time);
        Some(time - self.at[next.checked_sub(1)?])
    }

    /// The value at a time; that of the nearest end outside the samples.
    pub(crate) fn value(&self, time: u64) -> f64 {
        self.read(time).0
    }

    /// Mean between two times, the first before the second.
    pub(crate) fn mean(&self, from: u64, to: u64) -> f64 {
        match to > from {
            true => (self.read(to).1 - self.read(from).1) / ((to - from) as f64 / 1e6),
            false => self.value(to),
        }
    }

    /// Value and integral at a time.
    fn read(&self, time: u64) -> (f64, f64) {
        let behind = self.at.partition_point(|sample| *sample <= time);
        let seconds = |from: u64, to: u64| (to as f64 - from as f64) / 1e6;
        let Some(low) = behind.checked_sub(1) else {
            let (first, value) = (self.at.first().copied().unwrap_or(time), self.value.first().copied().unwrap_or(0.0));
            return (value, -seconds(time, first) * value);
        };
        let (value, elapsed) = (self.value[low], seconds(self.at[low], time));
        let slope = match self.at.get(behind) {
            Some(next) => (self.value[behind] - value) / seconds(self.at[low], *next),
            None => 0.0,
        };
        (value + slope * elapsed, self.sum[low] + elapsed * (value + slope * elapsed / 2.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_is_the_integral_over_time() {
        let curve = Curve::from_samples([(0, 0.0), (1_000_000, 2.0), (3_000_000, 2.0)]);
        assert_eq!(curve.value(500_000), 1.0);
        assert!((curve.mean(0, 1_000_000) - 1.0).abs() < 1e-12);
        assert!((curve.mean(500_000, 2_000_000) - (0.75 + 2.0) / 1.5).abs() < 1e-12);
        assert!((curve.mean(2_000_000, 5_000_000) - 2.0).abs() < 1e-12, "the last value goes on");
        assert_eq!((curve.age(1_200_000), Curve::default().age(1)), (Some(200_000), None));
    }
}
