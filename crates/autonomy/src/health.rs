//! Health: every guard judged from work product, and the proof that no required guard fails.
//!
//! A stage is alive while its products are fresh and carry the right identity; no heartbeat is read anywhere. The
//! inputs of each guard are described in the module that judges the guard (`picture`, `localisation`, `geofence`,
//! `lease`, `consistency`, `seals`). This module gathers the findings, applies the policy's waivers and sorts losses by
//! their consequence:
//!
//! - a *trust* guard (geofence, lease, teammates): the unit stops;
//! - a *subsystem* guard (all others): no authority, reduced speed, and a stop if driving depends on the guard for too
//!   long.
//!
//! [`Guard::Designation`] is no part of health: that guard is judged for one track, and only authority depends on it.
//!
//! ```compile_fail,E0451
//! let healthy = autonomy::health::Healthy { waived: Default::default() };
//! ```

use wire::mode::{Because, Guard, Guards};
use wire::policy::Waived;

use crate::fork::Fork;

/// Guards whose loss is a loss of trust, most telling first.
pub const TRUST: [Guard; 3] = [Guard::Geofence, Guard::Lease, Guard::Teammates];

/// Guards whose loss is a loss of a subsystem, most telling first.
pub const SUBSYSTEM: [Guard; 9] = [
    Guard::Localisation,
    Guard::Drift,
    Guard::TimeBase,
    Guard::Tracks,
    Guard::Thermal,
    Guard::Rgb,
    Guard::Depth,
    Guard::Lidar,
    Guard::SealedLog,
];

/// Guards without which the unit does not know where it is.
const PLACE: [Guard; 3] = [Guard::Localisation, Guard::Drift, Guard::TimeBase];

/// Reason for which each guard fails; absent while the guard holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Findings([Option<Because>; Guard::ALL.len()]);

impl Findings {
    /// Notes the finding on `guard`.
    #[must_use]
    pub fn with_finding(mut self, guard: Guard, finding: Option<Because>) -> Findings {
        self.0[guard as usize] = finding;
        self
    }

    /// Reason that `guard` fails, if it does.
    pub fn finding(&self, guard: Guard) -> Option<Because> {
        self.0[guard as usize]
    }

    fn failing(&self) -> Guards {
        let failing = Guard::ALL.into_iter().filter(|g| self.finding(*g).is_some());
        failing.fold(Guards::default(), Guards::with_guard)
    }
}

/// The guards as judged at one moment.
#[derive(Clone, Debug)]
pub struct Health {
    findings: Findings,
    failing: Guards,
    waived: Guards,
    evidence: Waived,
}

/// Verdict of health.
#[derive(Debug)]
pub enum Condition {
    /// No required guard fails.
    Healthy(Healthy),
    /// A subsystem is lost, and no trust.
    Subsystem(SubsystemLoss),
    /// Trust is lost.
    Trust(TrustLoss),
}

/// Proof that no required guard failed when it was made. Only [`Health::verdict`] makes one.
#[derive(Debug)]
pub struct Healthy {
    waived: Waived,
}

/// Proof that a subsystem guard fails.
#[derive(Debug)]
pub struct SubsystemLoss {
    guard: Guard,
    because: Because,
    blinding: Option<Guard>,
}

/// Proof that a trust guard fails.
#[derive(Debug)]
pub struct TrustLoss {
    guard: Guard,
    because: Because,
}

impl Health {
    /// Judges `findings` under the policy's waivers; `evidence` says which checks were waived on the way to them.
    pub(crate) fn judge(findings: Findings, waived: Guards, evidence: Waived) -> Health {
        Health { failing: findings.failing(), findings, waived, evidence }
    }

    /// All guards that fail, waived ones too: a waiver changes the consequence, not the fact.
    pub fn failing(&self) -> Guards {
        self.failing
    }

    /// Verdict that the findings give.
    pub fn verdict(&self) -> Condition {
        if let Some((guard, because)) = self.first(&TRUST) {
            return Condition::Trust(TrustLoss { guard, because });
        }
        match self.first(&SUBSYSTEM) {
            Some((guard, because)) => Condition::Subsystem(SubsystemLoss { guard, because, blinding: self.blinding() }),
            None => Condition::Healthy(Healthy { waived: self.evidence }),
        }
    }

    /// The required guard whose loss leaves the unit without a place, if one fails.
    pub(crate) fn unplaced(&self) -> Option<Guard> {
        PLACE.into_iter().find(|guard| self.lacks(*guard))
    }

    fn lacks(&self, guard: Guard) -> bool {
        self.failing.contains(guard) && !self.waived.contains(guard)
    }

    fn first(&self, guards: &[Guard]) -> Option<(Guard, Because)> {
        let guard = guards.iter().copied().find(|g| self.lacks(*g))?;
        self.findings.finding(guard).map(|reason| (guard, reason))
    }

    /// The loss that leaves driving without its basis: the unit's place, or any measured range around it.
    fn blinding(&self) -> Option<Guard> {
        if let Some(guard) = self.unplaced() {
            Some(guard)
        } else if self.lacks(Guard::Lidar) && self.lacks(Guard::Tracks) {
            Some(Guard::Tracks)
        } else if self.lacks(Guard::Lidar) && self.lacks(Guard::Depth) {
            Some(Guard::Lidar)
        } else {
            None
        }
    }
}

impl Healthy {
    /// Checks that were waived in the evidence behind it.
    pub fn waived(&self) -> Waived {
        self.waived
    }

    /// The proof of the same machine in a forked world.
    pub(crate) fn fork(&self, _fork: &Fork) -> Healthy {
        Healthy { waived: self.waived }
    }
}

impl SubsystemLoss {
    /// The most telling guard lost.
    pub fn guard(&self) -> Guard {
        self.guard
    }

    /// Reason that it fails.
    pub fn reason(&self) -> Because {
        self.because
    }

    /// The guard whose loss leaves driving blind, if one does.
    pub fn blinding(&self) -> Option<Guard> {
        self.blinding
    }
}

impl TrustLoss {
    /// The most telling guard lost.
    pub fn guard(&self) -> Guard {
        self.guard
    }

    /// Reason that it fails.
    pub fn reason(&self) -> Because {
        self.because
    }
}
