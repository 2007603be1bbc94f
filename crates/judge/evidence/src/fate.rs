//! Fate of each planned injection: it arrived, and was noticed or not; it was provably kept from arriving; or neither is proven.
//!
//! The oracle's `receipts` decide *delivered* and their `masked` decides *masked*, each from two witnesses. *Noticed* is the criterion of a
//! trial's class, from this injection on (`outcome`): a change of mode, a refusal, an alarm. Where several are delivered, a response
//! after all of them counts for each.

use ground_truth::{FaultKind, Sensor};
use serde::{Deserialize, Serialize};
use wire::id::NodeId;

use super::{Micros, Plan};

/// Obstacle that kept an injection from arriving.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mask {
    /// A process that it needs was dead or stopped, by the launcher's notes and by the lack of any entry of the process.
    Gone(NodeId),
    /// Another fault of the same sensor, which did arrive: the reading would be the same without this one.
    Hidden(Sensor, FaultKind),
    /// The relay dropped its target message, which was missing at the guard, and none has come through since.
    Dropped,
    /// There was no session yet: until its end neither guard had seen a record of the link.
    NoSession,
    /// Its sender had published no message that it could act on.
    NothingPublished,
    /// The operator had made no request that it could act on.
    NothingAsked,
    /// The gateway had accepted no report that it could act on.
    NoReport,
    /// The plan of contacts had no link, and no message arrived at either end of it.
    OutOfContact,
}

/// Fate of one injection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It arrived, by its receipt.
    Delivered {
        /// Time of arrival.
        at: Micros,
        /// True if there was a response from then on.
        noticed: bool,
    },
    /// This obstacle kept it from arriving.
    Masked(Mask),
    /// Neither is proven.
    NotProven,
}

/// A planned injection and its fate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Injection {
    /// The plan.
    pub plan: Plan,
    /// Its fate.
    pub fate: Fate,
}

/// A planned injection and its fate as a row of results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InjectionRow {
    /// The plan, as in the log's first line.
    pub what: serde_json::Value,
    /// Earliest time, milliseconds of the run.
    pub from_ms: u64,
    /// Its fate.
    pub fate: FateName,
    /// Time of its arrival.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_ms: Option<f64>,
    /// Obstacle that kept it from arriving.
    #[serde(default, rename = "by", skip_serializing_if = "Option::is_none")]
    pub mask: Option<serde_json::Value>,
}

/// Fate of an injection, in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FateName {
    /// It arrived and was answered.
    Noticed,
    /// It arrived and had no response.
    Delivered,
    /// Something kept it from arriving.
    Masked,
    /// Neither is proven.
    NotProven,
}

impl FateName {
    /// The fate in words.
    pub fn describe(self) -> &'static str {
        match self {
            FateName::Noticed => "noticed",
            FateName::Delivered => "delivered and not noticed",
            FateName::Masked => "masked",
            FateName::NotProven => "not proven",
        }
    }
}

impl InjectionRow {
    /// Description of an injection that did not arrive: plan, time, and the obstacle if one is proven.
    pub fn undelivered(&self) -> Option<String> {
        let plain = |json: &serde_json::Value| json.to_string().replace(['"', '{', '}'], "").replace(['_', ':'], " ");
        let reason = match self.fate {
            FateName::Noticed | FateName::Delivered => return None,
            FateName::Masked => {
                self.mask.as_ref().map_or_else(|| "masked".to_owned(), |mask| format!("masked: {}", plain(mask)))
            }
            FateName::NotProven => "not proven to have arrived, nor what kept it".to_owned(),
        };
        Some(format!("injection {} from {} ms: {reason}", plain(&self.what), self.from_ms))
    }
}

impl From<&Injection> for InjectionRow {
    fn from(injection: &Injection) -> Self {
        let Injection { plan, fate } = injection;
        let (name, arrived_at, mask) = match fate {
            Fate::Delivered { at, noticed: true } => (FateName::Noticed, Some(*at), None),
            Fate::Delivered { at, noticed: false } => (FateName::Delivered, Some(*at), None),
            Fate::Masked(mask) => (FateName::Masked, None, serde_json::to_value(mask).ok()),
            Fate::NotProven => (FateName::NotProven, None, None),
        };
        InjectionRow {
            what: serde_json::to_value(plan.what).unwrap_or_default(),
            from_ms: plan.from / 1000,
            fate: name,
            at_ms: arrived_at.map(|time| time as f64 / 1000.0),
            mask,
        }
    }
}
