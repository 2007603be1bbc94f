//! Measurements by which a unit's guards are judged: for each a value, in its own unit, and its bound.
//!
//! A unit reports both the failing guards (`mode::Guards`) and these values. Some guards fail for a reason without a
//! number, or until a value has come back further than it had to go: the failing guards are never worked out from here.

use minicbor::{Decode, Encode};

use crate::bounds::Bounds;
use crate::event::Inconsistency;
use crate::id::UnitId;
use crate::mode::Guard;
use crate::time::Span;

/// The sum of excesses at which fixes are taken to drift, millimetre seconds: half a second of one deviation.
pub const DRIFT_MM_S: i32 = 20;
/// Difference between the receiver's time and the host's clock at which the two disagree, microseconds: ten times the
/// share of delivery and of the stamping of a reading.
pub const OFFSET_US: i32 = 5_000;

/// The values, as they were when a report was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Encode, Decode)]
pub struct Measured {
    /// Values by guard, in the unit of its [`Limit`]; none where there is no measurement, or no number expresses it.
    #[n(0)]
    values: [Option<i32>; Guard::ALL.len()],
    /// The teammate with claims that cannot all be true, and the reason.
    #[n(1)]
    teammate: Option<(UnitId, Inconsistency)>,
}

impl Measured {
    /// Sets the value of `guard`, in the unit of its limit.
    #[must_use]
    pub fn with_value(mut self, guard: Guard, value: Option<i32>) -> Self {
        self.values[guard as usize] = value;
        self
    }

    /// Sets an age, rounded up to milliseconds: an age above its limit never appears within the limit.
    #[must_use]
    pub fn aged(self, guard: Guard, age: Option<Span>) -> Self {
        self.with_value(guard, age.map(|age| i32::try_from(age.0.div_ceil(1000)).unwrap_or(i32::MAX)))
    }

    /// Sets the finding about teammates' claims.
    #[must_use]
    pub fn claimed(self, teammate: Option<(UnitId, Inconsistency)>) -> Self {
        Measured { teammate, ..self }
    }

    /// The teammate with claims that cannot all be true, and the reason.
    pub fn teammate(&self) -> Option<(UnitId, Inconsistency)> {
        self.teammate
    }

    /// The value of `guard`.
    pub fn value(&self, guard: Guard) -> Option<i32> {
        self.values[guard as usize]
    }
}

/// Limit that a value is held against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// An age, milliseconds: at most.
    Age(i32),
    /// Way to spare before the margin of the fence, millimetres: at least.
    Spare(i32),
    /// A sum of excesses, millimetre seconds: at most; then not again before it is 0.
    Drift(i32),
    /// A difference of two clocks, microseconds: at most; then not again above half of it.
    Offset(i32),
}

impl Limit {
    /// The limit of `guard` on a platform of these bounds; none where no number expresses its judgement.
    pub fn for_guard(guard: Guard, bounds: &Bounds) -> Option<Limit> {
        let age = |ms: u64| Some(Limit::Age(i32::try_from(ms).unwrap_or(i32::MAX)));
        match guard {
            Guard::Rgb | Guard::Depth | Guard::Thermal | Guard::Lidar | Guard::Tracks | Guard::Localisation => {
                age(bounds.product_limit_ms)
            }
            Guard::Lease => age(bounds.lease_ms),
            Guard::SealedLog => age(bounds.seal_limit_ms),
            Guard::Geofence => Some(Limit::Spare(0)),
            Guard::Drift => Some(Limit::Drift(DRIFT_MM_S)),
            Guard::TimeBase => Some(Limit::Offset(OFFSET_US)),
            Guard::Teammates | Guard::Designation => None,
        }
    }

    /// True if `value` is beyond it.
    pub fn exceeded(self, value: i32) -> bool {
        match self {
            Limit::Age(most) | Limit::Drift(most) => value > most,
            Limit::Offset(most) => value.unsigned_abs() > most.unsigned_abs(),
            Limit::Spare(least) => value < least,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn age_one_microsecond_over_shows_over_limit() {
        let measured = Measured::default().aged(Guard::Rgb, Some(Span(300_001)));
        assert_eq!(measured.value(Guard::Rgb), Some(301));
        assert!(Limit::Age(300).exceeded(301) && !Limit::Age(300).exceeded(300));
        assert_eq!(Measured::default().aged(Guard::Rgb, Some(Span(u64::MAX))).value(Guard::Rgb), Some(i32::MAX));
    }
}
