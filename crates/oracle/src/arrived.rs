//! What was established about the injections of a trial: which provably arrived, and what kept the others from it.

use std::collections::BTreeMap;

use evidence::{Mask, Micros, Plan};
use wire::event::{FaultKind, Sensor};

/// What was established about the injections.
#[derive(Clone, Debug, Default)]
pub(super) struct Receipt {
    /// One planned injection at least has both witnesses, and of each other it is known what kept it from arriving.
    pub whole: bool,
    /// When each planned injection arrived, or what kept it from arriving; nothing where neither is proven.
    pub plans: Vec<(Plan, Option<Result<Micros, Mask>>)>,
    /// The actor's first entry that has a second witness.
    pub zero: Option<Micros>,
    /// Sensor faults with receipts.
    pub faults: Vec<Befallen>,
    /// When the relay took a datagram off its way, by its hash: to send it later, or never.
    pub taken: BTreeMap<u64, Micros>,
    /// Hashes that the adversary made or changed: never timely traffic.
    pub forged: BTreeMap<u64, Micros>,
}

/// A sensor fault that provably arrived.
#[derive(Clone, Copy, Debug)]
pub(super) struct Befallen {
    /// Which sensor.
    pub sensor: Sensor,
    /// What befell it.
    pub kind: FaultKind,
    /// From.
    pub start: Micros,
    /// To.
    pub end: Micros,
}

impl Befallen {
    /// Whether the unit is without the sensor: it gives nothing, or shows the past under fresh stamps. Nothing rests on
    /// odometry alone while fixes come, and what a frozen fix comes to is `place`'s.
    pub(super) fn is_loss(&self) -> bool {
        match self.kind {
            FaultKind::Dropout => self.sensor != Sensor::Odometry,
            FaultKind::Freeze | FaultKind::Skew => !matches!(self.sensor, Sensor::Odometry | Sensor::Localisation),
            FaultKind::Noise | FaultKind::Occlusion | FaultKind::Drift | FaultKind::Jump => false,
            FaultKind::TimeStep | FaultKind::TimeDrift | FaultKind::Chaff | FaultKind::Perturbation => false,
        }
    }
}
