//! Trust anchors of a recorded run, held outside its recorder: public keys, heads of chains, clocks, digests of files. No secret.
//!
//! `held.json` in the folder of a run has these types. Reading and writing that file, and verifying a log against its anchors, are left
//! to `recording`.

use std::collections::BTreeMap;

use ground_truth::Entry;
use serde::{Deserialize, Serialize};
use wire::audit::Head;
use wire::id::{Boot, NodeId};

use crate::log::hex;

/// Trust anchors outside the recorder: the object in `held.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrustAnchors {
    /// The public key of each service that writes, hexadecimal.
    pub keys: BTreeMap<NodeId, String>,
    /// Head of each life's chain, as its service reported it.
    pub heads: Vec<HeadAnchor>,
    /// Lives that were ended on purpose: neither a last signature nor a closing account is required of them.
    pub killed: Vec<Life>,
    /// The clock of each service's host.
    pub clocks: BTreeMap<NodeId, ClockAnchor>,
    /// Times for which the launcher kept a service's process from running, as the launcher recorded them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stops: Vec<ProcessStop>,
    /// The start of the run by the recording's clock: entries that a service writes during its setup have that time.
    pub start_us: u64,
    /// True if the recorder was dead or its disk full when the run ended: its recording then lacks its end.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub cut_short: bool,
    /// Every file of the run directory but the one that this is in, by its path; none in directories of programs that did not
    /// write it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub files: Option<BTreeMap<String, FileDigest>>,
}

impl TrustAnchors {
    /// True if guards and launcher sign their observations and actions: they do not in directories of programs before that.
    pub fn knows_witnesses(&self) -> bool {
        self.keys.contains_key(&NodeId::CAMPAIGN)
    }
}

/// A file as it was when the run was over.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileDigest {
    /// Its length.
    pub bytes: u64,
    /// SHA-256 of all of them, hexadecimal.
    pub sha256: String,
}

/// A time for which the launcher kept a process from running. An entry begun before is handed over after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProcessStop {
    /// Node of the process.
    pub node: NodeId,
    /// Start of the stop, microseconds of the recording's clock.
    pub from_us: u64,
    /// End of the stop; `u64::MAX` where the process did not resume before the end of the run.
    pub until_us: u64,
}

/// A service from one start to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Life {
    /// Node of the service.
    pub node: NodeId,
    /// Number of the start.
    pub boot: Boot,
}

impl Life {
    /// The life that wrote `entry`.
    pub fn from_entry(entry: &Entry) -> Life {
        Life { node: entry.node, boot: entry.boot }
    }
}

impl core::fmt::Display for Life {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}, boot {}", self.node, self.boot.0)
    }
}

/// A head that is held outside the recorder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeadAnchor {
    /// Node that writes the chain.
    pub node: NodeId,
    /// Number of the start that wrote the chain.
    pub boot: Boot,
    /// Number of the chain's last entry, counted from 1.
    pub counter: u64,
    /// SHA-256 of that entry, hexadecimal.
    pub hash: String,
}

impl HeadAnchor {
    /// Life that it belongs to.
    pub fn life(&self) -> Life {
        Life { node: self.node, boot: self.boot }
    }
}

impl From<Head> for HeadAnchor {
    fn from(head: Head) -> Self {
        HeadAnchor { node: head.node, boot: head.boot, counter: head.counter, hash: hex(&head.hash) }
    }
}

/// Reading of a service's clock at a time of the recording, and the longest delay of an entry from there. By default the
/// recording's own clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClockAnchor {
    /// Reading at zero of the recording's clock, microseconds.
    pub zero_us: u64,
    /// Rate at which it runs faster than that clock, parts per million.
    pub drift_ppm: i64,
    /// Longest time from an entry to the time under which it was handed over, microseconds.
    pub late_us: u64,
}
