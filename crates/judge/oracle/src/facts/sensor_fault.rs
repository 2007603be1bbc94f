//! Sensor faults with both witnesses: the sim applied them, and the other side took in, to the last byte, a message that would
//! read otherwise without them. Their effect is not asked for here.

use evidence::{Evidence, Micros};
use ground_truth::{Any, FaultKind, Note, Sensor};
use wire::id::NodeId;

use super::core_input::core_took;

/// A sensor fault that provably arrived.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SensorFault {
    /// The sensor.
    pub sensor: Sensor,
    /// Kind of the fault.
    pub kind: FaultKind,
    /// Begin of the fault.
    pub start: Micros,
    /// End of the fault.
    pub end: Micros,
}

impl SensorFault {
    /// True if the unit is without the sensor: it gives no reading, or shows the past under fresh stamps. No judgement rests on
    /// odometry alone while fixes come, and the consequences of a frozen fix show in the stated place (P3, P5).
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

/// Sensor faults that the sim applied and with readings that the other side took in.
pub(super) fn arrived(evidence: &Evidence) -> Vec<SensorFault> {
    let mut arrived = Vec::new();
    for (i, w) in evidence.entries.iter().enumerate() {
        let Any::Instrument(Note::Fault { sensor, kind, active: true, .. }) = w.entry.event else { continue };
        // A fault of another unit's sensor is no injection into the unit under test.
        if w.entry.node != evidence.under.sim {
            continue;
        }
        let rest = &evidence.entries[i..];
        let end = rest.iter().find_map(|e| match e.entry.event {
            Any::Instrument(Note::Fault { sensor: s, kind: k, active: false, .. })
                if (s, k) == (sensor, kind) && e.entry.node == evidence.under.sim =>
            {
                Some(e.at)
            }
            _ => None,
        });
        let end = end.unwrap_or(evidence.duration);
        // A changed reading is logged while the fault lasts, and may come in a little later.
        let mut changed = rest.iter().take_while(|e| e.at <= end).filter_map(|e| match e.entry.event {
            Any::Instrument(Note::Altered { sensor: s, kind: k, hash })
                if (s, k) == (sensor, kind) && e.entry.node == evidence.under.sim =>
            {
                Some((e.at, hash))
            }
            _ => None,
        });
        if changed.any(|(taken_at, hash)| core_took(evidence, consumer(evidence, sensor), hash, taken_at)) {
            arrived.push(SensorFault { sensor, kind, start: w.at, end });
        }
    }
    arrived
}

/// Receiver of the readings of `sensor`.
fn consumer(evidence: &Evidence, sensor: Sensor) -> NodeId {
    match sensor {
        Sensor::Rgb | Sensor::Depth | Sensor::Thermal | Sensor::Lidar => evidence.under.perception,
        Sensor::Odometry | Sensor::Localisation | Sensor::Height => evidence.under.node(),
    }
}
