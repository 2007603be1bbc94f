//! Facts established about the injections of a trial: those that provably arrived, and the obstacles of the others.

use std::collections::BTreeMap;

use evidence::{Mask, Micros, Plan};
use instrument::{FaultKind, Sensor};

/// Facts established about the injections.
#[derive(Clone, Debug, Default)]
pub(crate) struct Receipt {
    /// One planned injection at least has both witnesses, and of each other the obstacle is known that kept it from arriving.
    pub whole: bool,
    /// Arrival of each planned injection, or the obstacle that kept it from arriving; none where neither is proven.
    pub plans: Vec<(Plan, Option<Result<Micros, Mask>>)>,
    /// The actor's first entry that has a second witness.
    pub zero: Option<Micros>,
    /// Sensor faults with receipts.
    pub faults: Vec<Befallen>,
    /// Time at which the relay took a datagram off its way, by its hash: to send it later, or never.
    pub taken: BTreeMap<u64, Micros>,
    /// Hashes that the adversary made or changed: never timely traffic.
    pub forged: BTreeMap<u64, Micros>,
}

/// A sensor fault that provably arrived.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Befallen {
    /// Which sensor.
    pub sensor: Sensor,
    /// Kind of the fault.
    pub kind: FaultKind,
    /// From.
    pub start: Micros,
    /// To.
    pub end: Micros,
}

impl Befallen {
    /// True if the unit is without the sensor: it gives no reading, or shows the past under fresh stamps. No judgement rests on
    /// odometry alone while fixes come, and the consequences of a frozen fix are `place`'s.
    pub(crate) fn is_loss(&self) -> bool {
        match self.kind {
            FaultKind::Dropout => self.sensor != Sensor::Odometry,
            FaultKind::Freeze | FaultKind::Skew => {
                !matches!(self.sensor, Sensor::Odometry | Sensor::Localisation | Sensor::Height)
            }
            FaultKind::Noise | FaultKind::Occlusion | FaultKind::Drift | FaultKind::Jump => false,
            FaultKind::TimeStep | FaultKind::TimeDrift | FaultKind::Scale | FaultKind::Wander => false,
            FaultKind::Chaff | FaultKind::Perturbation => false,
        }
    }
}
