//! Tampering with the evidence by an insider in control of the recorder.

use adversary::plan::Tampering;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A change to the recording between the run and the judge. A trial carries out one of them, in turn by its seed, at a
/// place that the seed draws.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tamper {
    /// The change.
    pub does: Tampering,
}
