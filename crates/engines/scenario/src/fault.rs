//! Faults that need no adversary: sensors that fail, processes that end, hang or get too little of the processor.

use ground_truth::{FaultKind, Sensor};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::timed::timed;
use super::value::{List, Located, Real, Seconds, Share, Whole};

timed! {
    /// A fault of one sensor.
    Fault lasts duration_s {
        /// The sensor.
        sensor: Sensor,
        /// Kind of the failure.
        kind: FaultKind,
        /// A further uniform shift of the start, this fault's own.
        #[serde(default)]
        jitter_s: Real<0, 10_000>,
        /// Length.
        duration_s: Seconds,
        /// Size, in the unit of the kind (see [`FaultKind`]).
        #[serde(default)]
        magnitude: Option<Located<Magnitude>>,
    }
}

/// One number, or east and north.
pub type Magnitude = List<Real<-100_000, 100_000>, 2>;

/// Least and greatest error of odometry: of its speed (m/s), its way (m), its factor. No platform goes faster than such an error of speed.
pub(super) fn odometry_range(kind: FaultKind) -> Option<(f64, f64)> {
    match kind {
        FaultKind::Drift => Some((-3.0, 3.0)),
        FaultKind::Jump => Some((-100.0, 100.0)),
        FaultKind::Scale => Some((0.0, 10.0)),
        FaultKind::Dropout | FaultKind::Freeze | FaultKind::Noise | FaultKind::Occlusion => None,
        FaultKind::Skew | FaultKind::Chaff | FaultKind::Perturbation => None,
        FaultKind::TimeStep | FaultKind::TimeDrift | FaultKind::Wander => None,
    }
}

timed! {
    /// A process that ends, hangs, is slow or finds its disk full.
    Kill lasts duration_s {
        /// The process.
        process: Process,
        /// Kind of the fault.
        #[serde(default)]
        ending: Ending,
        /// Time for which it hangs, is slow, or has no room on its disk.
        #[serde(default)]
        duration_s: Seconds,
        /// For a slow one: the share of each period for which it runs. For the rest it is stopped unconditionally.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        quota: Option<Located<Share>>,
        /// For a slow one: the period. 100 ms are the kernel's own for processor quotas.
        #[serde(default = "quota_period")]
        period_ms: Whole<10, 10_000>,
        /// For a killed one: time from its end to its restart with a new boot. Autonomy only.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        restart_after_s: Option<Located<Seconds>>,
    }
}

impl Kill {
    /// A fault of `process` at once and for no time; the rest is to be filled in.
    pub(super) fn new(process: Process, ending: Ending) -> Self {
        Self {
            process,
            ending,
            duration_s: Seconds::default(),
            quota: None,
            period_ms: quota_period(),
            restart_after_s: None,
            at_s: Located::default(),
            step: None,
            when: None,
            knowledge: None,
        }
    }
}

/// A process of the twin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Process {
    /// World and sensors.
    Sim,
    /// Detector, corroboration, tracker.
    Perception,
    /// State machine of the platform under test.
    Autonomy,
    /// Admission on the control side.
    Gateway,
    /// Command broker.
    Broker,
    /// Supervisory console.
    Console,
    /// The relays.
    Adversary,
    /// Evidence recorder.
    Recorder,
}

/// Kind of fault of a process.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Ending {
    /// At once, without a last word.
    #[default]
    Kill,
    /// It stays and does no work for a time; messages to it wait, as far as there is room.
    Hang,
    /// It runs for a share of the time.
    Slow,
    /// It runs, and its disk takes no more for a time. The recorder only.
    Full,
}

fn quota_period() -> Whole<10, 10_000> {
    Whole::new(100).expect("invariant: within its range")
}
