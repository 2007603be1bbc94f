//! The object of `lab live`: live runs of the paper's losses, and quiet runs live and in the twin.

use serde::{Deserialize, Serialize};

use super::reference::LiveLatency;
use super::run::RunObject;

/// Latencies of live losses beside the paper's, and the cost of protection in quiet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BenchLive {
    /// Version of this object.
    pub schema_version: u32,
    /// The base seed.
    pub seed: u64,
    /// Live runs of each loss.
    pub losses: Vec<RunObject>,
    /// Their latencies beside the paper's.
    pub live_latency_ms: Vec<LiveLatency>,
    /// The relay in the path without an attack, live.
    pub live_null_attack: Option<RunObject>,
    /// Hours in the twin, at 2 % loss.
    pub twin_null_attack_at_2_percent_loss: Option<RunObject>,
}

impl BenchLive {
    /// Every run of it.
    pub fn runs(&self) -> impl Iterator<Item = &RunObject> {
        self.losses.iter().chain(&self.live_null_attack).chain(&self.twin_null_attack_at_2_percent_loss)
    }
}
