//! Responses of the platform to a process fault: one of its processes was killed, hung, was slow or found its disk full.

use serde::{Deserialize, Serialize};
use wire::mode::Mode;

/// Moment from which a bound counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum From {
    /// The kill.
    Kill,
    /// The operator's next HOLD: the death alone requires no response.
    Hold,
}

/// Fault of the process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ProcessFault {
    /// It ended.
    Kill,
    /// It did not run for a time.
    Hang,
    /// It ran for a share of the time.
    Slow,
    /// Its disk took no more bytes for a time.
    Full,
}

/// Response to it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Response {
    /// The process.
    pub process: String,
    /// Fault that the process had.
    pub fate: ProcessFault,
    /// Time, milliseconds of the run.
    pub killed_ms: f64,
    /// The unit's mode at that moment.
    pub before: Mode,
    /// The mode at the end of the run; of a dead unit, HOLD_SAFE where its plant stands without a lease.
    pub after: Mode,
    /// The unit's own cause for the last change that no operator asked for; `set-point lease` where the plant stopped.
    pub cause: Option<String>,
    /// Moment from which the times below count.
    pub from: From,
    /// Time to the first restriction: DEGRADED or HOLD_SAFE, or the end of the plant's lease under a dead unit; ms.
    pub restricted_ms: Option<f64>,
    /// Time to the mode of the end, ms.
    pub settled_ms: Option<f64>,
    /// The plant; `None` where its world died with it.
    pub plant: Option<PlantResponse>,
    /// True if a response was required: no bound ends within a stop that is shorter, and a broker without an order has no response to make.
    #[serde(rename = "owed")]
    pub required: bool,
    /// True if every required response came in time.
    #[serde(rename = "kept")]
    pub in_time: bool,
}

/// Ground truth of the plant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlantResponse {
    /// True speed at the kill, mm/s.
    pub speed_mm_s: i32,
    /// Time from the kill (or HOLD) to the end of the last set-point's lease, ms.
    pub lease_ended_ms: Option<f64>,
    /// Time from the kill (or HOLD) to the final standstill, ms; rocking back on its springs is no standstill. Present only where the
    /// run ended in HOLD_SAFE: elsewhere the vehicle stands because its way has ended.
    pub standing_ms: Option<f64>,
}
