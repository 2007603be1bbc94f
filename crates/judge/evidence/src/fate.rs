//! Fate of each planned injection: it arrived, and was noticed or not; it was provably kept from arriving; or neither is proven.
//!
//! *Delivered* is `receipt`'s to say and *masked* `masked`'s, each from two witnesses. *Noticed* is the question of a trial's class,
//! asked from this injection on (`outcome`): a change of mode, a refusal, an alarm. Where several are delivered, an answer after all of
//! them counts for each.

use ground_truth::{FaultKind, Sensor};
use serde::{Deserialize, Serialize};
use wire::id::NodeId;

use super::{Micros, Plan};

/// Obstacle that kept an injection from arriving.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mask {
    /// A process that it needs did not live or did not run: the launcher says so, and the process left no mark.
    Gone(NodeId),
    /// Another fault of the same sensor, which did arrive: the reading would be the same without this one.
    Hidden(Sensor, FaultKind),
    /// The relay dropped its target message, which was missing at the guard, and none has come through since.
    Dropped,
    /// No session stood yet: until its end neither guard had seen a record of the link.
    NoSession,
    /// Its sender had published no message for it to take hold of.
    NothingPublished,
    /// The operator had made no request for it to take hold of.
    NothingAsked,
    /// The gateway had accepted no report that it was to take hold of.
    NoReport,
    /// By the plan of contacts there was no link, and no message came to either end of it.
    OutOfContact,
}

/// Fate of one injection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It arrived then, by its receipt.
    Delivered {
        /// Time of arrival.
        at: Micros,
        /// True if there was a response from then on.
        noticed: bool,
    },
    /// This kept it from arriving.
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

/// The same as it stands in results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InjectionRow {
    /// The plan, as in the log's first line.
    pub what: serde_json::Value,
    /// From, at the earliest, milliseconds of the run.
    pub from_ms: u64,
    /// Its fate.
    pub fate: FateName,
    /// Time of its arrival.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_ms: Option<f64>,
    /// Obstacle that kept it from arriving.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by: Option<serde_json::Value>,
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
    /// In words.
    pub fn told(self) -> &'static str {
        match self {
            FateName::Noticed => "noticed",
            FateName::Delivered => "delivered and not noticed",
            FateName::Masked => "masked",
            FateName::NotProven => "not proven",
        }
    }
}

impl InjectionRow {
    /// In words, of one that did not arrive: plan, time, and the obstacle if one is proven.
    pub fn undelivered(&self) -> Option<String> {
        let by = |by: &serde_json::Value| by.to_string().replace(['"', '{', '}'], "").replace(['_', ':'], " ");
        let why = match self.fate {
            FateName::Noticed | FateName::Delivered => return None,
            FateName::Masked => {
                self.by.as_ref().map_or_else(|| "masked".to_owned(), |of| format!("masked: {}", by(of)))
            }
            FateName::NotProven => "not proven to have arrived, nor what kept it".to_owned(),
        };
        Some(format!("injection {} from {} ms: {why}", by(&self.what), self.from_ms))
    }
}

impl From<&Injection> for InjectionRow {
    fn from(injection: &Injection) -> Self {
        let Injection { plan, fate } = injection;
        let (name, at_ms, by) = match fate {
            Fate::Delivered { at, noticed: true } => (FateName::Noticed, Some(*at), None),
            Fate::Delivered { at, noticed: false } => (FateName::Delivered, Some(*at), None),
            Fate::Masked(mask) => (FateName::Masked, None, serde_json::to_value(mask).ok()),
            Fate::NotProven => (FateName::NotProven, None, None),
        };
        let at_ms = at_ms.map(|at| at as f64 / 1000.0);
        let what = serde_json::to_value(plan.what).unwrap_or_default();
        InjectionRow { what, from_ms: plan.from / 1000, fate: name, at_ms, by }
    }
}
