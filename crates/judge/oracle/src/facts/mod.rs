//! Facts: the statements of the logs about a run, sorted and joined for the judge. Nothing is judged here.
//!
//! No module of this folder reads `properties` or `receipts`.
//!
//! | module | facts |
//! |---|---|
//! | `timeline` | the events by subject; the modes of the unit |
//! | `motion`, `braking` | the true motion of the plant; the times within which it obeys and brakes |
//! | `place`, `progress` | the stated place against the true one; progress along the route |
//! | `link`, `contact` | records of the telemetry link, and its silences; the planned contacts |
//! | `relay`, `stream`, `core_input` | datagrams that the relay took or made; bytes at the ingresses; messages at the inputs of cores |
//! | `process`, `sensor_fault` | processes that died or did not run; sensor faults that provably arrived |
//! | `guest`, `peers` | the guest that drives; the reports of a teammate in bad faith |

pub(crate) mod braking;
pub(crate) mod contact;
pub(crate) mod core_input;
pub(crate) mod guest;
pub(crate) mod link;
pub(crate) mod motion;
pub mod peers;
pub(crate) mod place;
pub(crate) mod process;
pub(crate) mod progress;
pub(crate) mod relay;
pub(crate) mod sensor_fault;
pub(crate) mod stream;
pub(crate) mod timeline;

use evidence::{Evidence, Micros};
use wire::bounds::Bounds;

use relay::RelayedDatagrams;
use sensor_fault::SensorFault;
use timeline::Timeline;

/// Stretch of time: its begin, and its end.
pub(crate) type Span = (Micros, Micros);

/// Time that one trip through the live host may add between an event and its trace time, and between a command leaving the
/// operator and reaching the unit.
pub(crate) const SLACK: Micros = 50_000;

/// A navigation period and a step of the plant with its actuators, milliseconds: the simulation's, on every platform.
const READING_AND_PLANT_MS: u64 = 100;

/// Time from a decision to the brakes, milliseconds, whatever allowance the unit's own fence guard makes for it
/// (`docs/reference/bounds.md`).
pub(crate) fn reaction_ms(bounds: &Bounds) -> u64 {
    READING_AND_PLANT_MS + bounds.control_period_ms
}

/// Evidence of a run, and the facts that several parts of the judge read from it.
pub(crate) struct Facts<'a> {
    /// The evidence.
    pub evidence: &'a Evidence,
    /// Its events by subject.
    pub timeline: Timeline,
    /// Sensor faults that provably arrived.
    pub sensor_faults: Vec<SensorFault>,
    /// Datagrams that the relay says it took or made.
    pub relayed: RelayedDatagrams,
}

impl<'a> Facts<'a> {
    /// Reads the facts from the evidence.
    pub(crate) fn new(evidence: &'a Evidence) -> Self {
        Facts {
            evidence,
            timeline: Timeline::new(evidence),
            sensor_faults: sensor_fault::arrived(evidence),
            relayed: RelayedDatagrams::new(evidence),
        }
    }
}
