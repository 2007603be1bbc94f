//! Manipulations of a recording by an insider who controls the recorder.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Change to a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Tampering {
    /// A bit of one entry is flipped.
    Edit,
    /// Two entries that came one after the other change places.
    Swap,
    /// An entry is taken out.
    Delete,
    /// Everything from some entry on is taken away.
    Truncate,
    /// An entry is left out and every chain and seal written again around the gap.
    Omit,
    /// An entry says another time and every chain and seal is written again.
    Rechain,
    /// The recording ends at a seal, closed as if the run had ended there.
    CutAtSeal,
    /// A service is given an earlier life that never was, and every seal is rewritten.
    Feign,
    /// An entry is kept under another time than that at which it came.
    Retime,
}
