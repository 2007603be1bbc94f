//! The one file that says which checks, guards and display rules stand: each is `required` or `waived`.
//!
//! Length, schema, minting and accounting are not listed because they cannot be waived. A run with anything waived is
//! an ablation: it needs the scenario loader's token before authority is minted, and every artefact reports it.

use std::collections::BTreeMap;

use minicbor::{Decode, Encode};
use strum::{EnumCount, IntoStaticStr, VariantArray};

use crate::mode::{Guard, Guards};

/// A check of the trust boundary that a policy can waive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[derive(EnumCount, VariantArray, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Check {
    /// Age below the limit.
    Freshness,
    /// The session's peer is the record's origin.
    Origin,
    /// The origin's signature.
    Signature,
    /// The receiver's session nonce.
    Session,
    /// Boot and sequence.
    Sequence,
    /// A product made by live sensors.
    Product,
    /// The keyed tag of a shared-memory message.
    Tag,
    /// The peer or signer may do this at all.
    Role,
    /// A command younger than the nonce it repeats.
    Late,
    /// A command not seen before.
    Duplicate,
    /// The second signed step of a command away from safe.
    Confirmation,
    /// A certificate may publish or subscribe there at all (`broker::acl`).
    Rights,
    /// The peer or signer is neither revoked nor past its time.
    #[serde(rename = "standing")]
    #[strum(serialize = "standing")]
    Revocation,
    /// A command no further ahead than an operator can have come.
    Jump,
    /// No more commands in a short time than there can be need for.
    Rate,
    /// Values that are legal one by one are safe together.
    Joint,
    /// A classified object has the size of its class, by depth.
    Extent,
    /// A classified object is no wider than its class, by LiDAR.
    Cluster,
    /// A classified object is as warm as its class.
    Warmth,
    /// A sensor's content is not that of earlier frames.
    Content,
    /// The network over all cameras shares a detection of the colour detector.
    Fusion,
    /// An arming and its confirmation name the unit's report that the operator was shown, and the track is still where
    /// it said.
    Shown,
    /// No vehicle is warm within a minute where a claimed one was cold for a second.
    Steady,
}

impl Check {
    /// Every check, in order.
    pub const ALL: [Check; Check::COUNT] = *Check::VARIANTS.first_chunk().expect("as many variants as it counts");

    /// Name in policy files and events.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// A rule of the display.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[derive(EnumCount, VariantArray, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum DisplayRule {
    /// Values age by the console's own clock, and are marked late, stale or lost.
    AgeOut,
    /// A report is shown only under its unit's signature.
    Signature,
    /// A report's age is bounded by the display's own challenge, and not by the gateway's word alone.
    Watch,
}

impl DisplayRule {
    /// Every rule, in order.
    pub const ALL: [DisplayRule; DisplayRule::COUNT] =
        *DisplayRule::VARIANTS.first_chunk().expect("as many variants as it counts");

    /// Name in policy files.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// State of a check.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Requirement {
    /// The check is made.
    #[default]
    Required,
    /// The check is passed over, and the record is marked so.
    Waived,
}

/// A set of waived checks, as events carry it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Encode, Decode, serde::Serialize)]
#[cbor(transparent)]
pub struct Waived(#[n(0)] pub u32);

impl Waived {
    /// The set with one check more.
    #[must_use]
    pub fn with_check(self, check: Check) -> Waived {
        Waived(self.0 | 1 << check as u16)
    }

    /// Union of both sets.
    #[must_use]
    pub fn union(self, other: Waived) -> Waived {
        Waived(self.0 | other.0)
    }

    /// True if no check is waived: the evidence is full.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The members, in order.
    pub fn iter(self) -> impl Iterator<Item = Check> {
        Check::ALL.into_iter().filter(move |c| self.0 & (1 << *c as u16) != 0)
    }
}

/// A policy as its file states it. A check that a table leaves out is required.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Policy {
    /// Name in reports.
    #[serde(default)]
    pub name: String,
    /// Checks of the trust boundary.
    #[serde(default)]
    pub boundary: BTreeMap<Check, Requirement>,
    /// Guards of the state machine.
    #[serde(default)]
    pub guards: BTreeMap<Guard, Requirement>,
    /// Rules of the display.
    #[serde(default)]
    pub display: BTreeMap<DisplayRule, Requirement>,
    /// The record filter in front of a secure session (`link::guard`).
    #[serde(default)]
    pub record_guard: Requirement,
    /// Protection of messages in shared memory, live.
    #[serde(default)]
    pub bus: BusProtection,
}

/// Protection of messages on a host's inner bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BusProtection {
    /// Tags say who made a message; every process of the host can read it.
    #[default]
    Integrity,
    /// Messages are encrypted too, under a key for each channel.
    Confidential,
}

/// Policy by which a display judges reports: the display's own rule on signatures replaces the boundary's. A report is
/// attributed by its signature alone under no other policy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DisplayPolicy(Policy);

impl DisplayPolicy {
    /// The checks.
    pub fn checks(&self) -> &Policy {
        &self.0
    }
}

impl Policy {
    /// Policy by which a display under this policy judges reports.
    pub fn of_display(&self) -> DisplayPolicy {
        let mut display = self.clone();
        display.boundary.insert(Check::Signature, self.display(DisplayRule::Signature));
        DisplayPolicy(display)
    }

    /// State of `check`.
    pub fn check(&self, check: Check) -> Requirement {
        self.boundary.get(&check).copied().unwrap_or_default()
    }

    /// State of `rule`.
    pub fn display(&self, rule: DisplayRule) -> Requirement {
        self.display.get(&rule).copied().unwrap_or_default()
    }

    /// The waived guards.
    pub fn waived_guards(&self) -> Guards {
        let waived = self.guards.iter().filter(|(_, r)| **r == Requirement::Waived);
        waived.fold(Guards::default(), |set, (g, _)| set.with_guard(*g))
    }

    /// True if every check, guard and rule stands.
    pub fn is_full(&self) -> bool {
        let is_required = |r: &Requirement| *r == Requirement::Required;
        self.boundary.values().all(is_required)
            && self.guards.values().all(is_required)
            && self.display.values().all(is_required)
            && is_required(&self.record_guard)
    }
}
