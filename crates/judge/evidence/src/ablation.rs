//! Value of every check: the switches that a policy has, and the progress of an attack with one of them off.
//!
//! A *switch* is one entry of a policy: a check of the boundary, a guard, a rule of the display, the record guard. An
//! attack *gets through* when its trial ends in a class that is worse than every class that was expected of it, by
//! [`severity`]; and it *lets in* records when the telemetry link accepts what the full policy refused. Both are judged
//! in pairs, the same seed with and without the switch. Running the trials is left to the verb `ablate`.

use wire::mode::Guard;
use wire::policy::{Check, DisplayRule, Policy, Requirement};

use crate::trial::{Outcome, Trial};

/// One entry of a policy that can be waived; in a file its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Deserialize)]
#[serde(try_from = "String")]
pub enum Switch {
    /// A check of the trust boundary.
    Boundary(Check),
    /// A guard of the state machine.
    Guard(Guard),
    /// A rule of the display.
    Display(DisplayRule),
    /// The record filter in front of a secure session.
    RecordGuard,
}

impl Switch {
    /// Every switch, in the order of a policy file.
    pub fn all() -> Vec<Switch> {
        let boundary = Check::ALL.into_iter().map(Switch::Boundary);
        let guards = Guard::ALL.into_iter().map(Switch::Guard);
        let display = DisplayRule::ALL.into_iter().map(Switch::Display);
        boundary.chain(guards).chain(display).chain([Switch::RecordGuard]).collect()
    }

    /// The switch of that name.
    ///
    /// # Errors
    /// When no switch has the name; the message lists all names.
    pub fn from_name(name: &str) -> Result<Switch, String> {
        let all = Switch::all();
        all.iter().find(|switch| switch.name() == name).copied().ok_or_else(|| {
            let names: Vec<String> = all.iter().map(|switch| switch.name()).collect();
            format!("no check `{name}`; there are: {}", names.join(", "))
        })
    }

    /// Its place in a policy file: `boundary.freshness`.
    pub fn name(self) -> String {
        match self {
            Switch::Boundary(check) => format!("boundary.{}", check.name()),
            Switch::Guard(guard) => format!("guards.{}", guard.name()),
            Switch::Display(rule) => format!("display.{}", rule.name()),
            Switch::RecordGuard => "record_guard".to_owned(),
        }
    }

    /// True if `policy` waives it.
    pub fn is_waived(self, policy: &Policy) -> bool {
        let requirement = match self {
            Switch::Boundary(check) => policy.check(check),
            Switch::Guard(guard) => policy.guards.get(&guard).copied().unwrap_or_default(),
            Switch::Display(rule) => policy.display(rule),
            Switch::RecordGuard => policy.record_guard,
        };
        requirement == Requirement::Waived
    }

    /// Waives it.
    pub fn waive(self, policy: &mut Policy) {
        self.put(policy, Requirement::Waived);
    }

    /// Requires it.
    pub fn require(self, policy: &mut Policy) {
        self.put(policy, Requirement::Required);
    }

    fn put(self, policy: &mut Policy, requirement: Requirement) {
        match self {
            Switch::Boundary(check) => drop(policy.boundary.insert(check, requirement)),
            Switch::Guard(guard) => drop(policy.guards.insert(guard, requirement)),
            Switch::Display(rule) => drop(policy.display.insert(rule, requirement)),
            Switch::RecordGuard => policy.record_guard = requirement,
        }
    }
}

impl TryFrom<String> for Switch {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        Switch::from_name(&name)
    }
}

/// Progress of an attack, from none to harm; none for a trial whose evidence does not hold.
///
/// A refused attack did less than one that cost authority, and that less than one that cost the mission; an unnoticed one is
/// worse than a stop, however costly; a response that came too late is worse than a response that was not due; and harm is worst.
pub fn severity(outcome: Outcome) -> Option<u8> {
    match outcome {
        // A guest that failed showed nothing about the attack.
        Outcome::Invalid | Outcome::GuestFailed => None,
        Outcome::Nominal => Some(0),
        Outcome::Rejected => Some(1),
        Outcome::Degraded => Some(2),
        Outcome::HoldSafe | Outcome::FalseTrip | Outcome::Stuck => Some(3),
        Outcome::Undetected => Some(4),
        Outcome::Late => Some(5),
        Outcome::Unsafe => Some(6),
    }
}

/// True if `outcome` is worse than all that was `expected`; none where the evidence does not hold.
///
/// Any valid outcome is worse than INVALID where that alone was expected: the attack on the evidence went unnoticed.
pub fn gets_through(outcome: Outcome, expected: &[Outcome]) -> Option<bool> {
    if expected.contains(&outcome) {
        return Some(false);
    }
    let reached = severity(outcome)?;
    Some(expected.iter().filter_map(|e| severity(*e)).max().is_none_or(|worst| reached > worst))
}

/// Gain of one attack by the waiver, over pairs of trials of the same seed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Gain {
    /// Pairs of which both trials are valid.
    pub n: u64,
    /// Pairs left out, one of them INVALID where that was not expected.
    pub invalid: u64,
    /// The attack gets through with the waiver only.
    pub through: u64,
    /// It gets through without the waiver only.
    pub back: u64,
    /// Any decision differs.
    pub changed: u64,
    /// With the waiver only, the outcome lies outside the expected classes: the campaign notices.
    pub noticed: u64,
}

impl Gain {
    /// Gain over pairs of `base` trials, without the waiver, and `waived` trials, with it; both in the order of the same seeds.
    pub fn from_pairs(base: &[&Trial], waived: &[&Trial], expected: &[Outcome]) -> Gain {
        let mut gain = Gain::default();
        for (base, waived) in base.iter().zip(waived) {
            let decisions = |t: &Trial| (t.decision_hash.clone(), t.outcome, t.findings.len());
            gain.changed += u64::from(decisions(base) != decisions(waived));
            gain.noticed += u64::from(expected.contains(&base.outcome) && !expected.contains(&waived.outcome));
            match (gets_through(base.outcome, expected), gets_through(waived.outcome, expected)) {
                (Some(before), Some(after)) => {
                    gain.n += 1;
                    gain.through += u64::from(after && !before);
                    gain.back += u64::from(before && !after);
                }
                (None, _) | (_, None) => gain.invalid += 1,
            }
        }
        gain
    }

    /// True if the waiver lets the attack through in any pair.
    pub fn lets_through(&self) -> bool {
        self.through > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_switch_waives_itself_and_nothing_else() {
        let all = Switch::all();
        for switch in &all {
            let mut policy = Policy::default();
            switch.waive(&mut policy);
            let waived: Vec<&Switch> = all.iter().filter(|s| s.is_waived(&policy)).collect();
            assert_eq!((waived, Switch::from_name(&switch.name())), (vec![switch], Ok(*switch)));
            assert!(!policy.is_full());
            switch.require(&mut policy);
            assert!(policy.is_full());
        }
    }

    #[test]
    fn attack_gets_through_when_worse_than_expected() {
        use Outcome::{Degraded, HoldSafe, Invalid, Rejected, Undetected};
        assert_eq!(gets_through(HoldSafe, &[Rejected]), Some(true));
        assert_eq!(gets_through(Degraded, &[HoldSafe]), Some(false));
        assert_eq!(gets_through(Undetected, &[HoldSafe, Undetected]), Some(false));
        assert_eq!(gets_through(Invalid, &[Rejected]), None);
        assert_eq!(gets_through(Rejected, &[Invalid]), Some(true), "tampering that nobody noticed");
    }

    #[test]
    fn gain_is_counted_over_pairs() {
        let base: Vec<Trial> = (0..4).map(|seed| Trial::example(seed, Outcome::Rejected)).collect();
        let mut waived = base.clone();
        waived[0].outcome = Outcome::Undetected;
        waived[1].outcome = Outcome::Invalid;
        let (base, waived): (Vec<_>, Vec<_>) = (base.iter().collect(), waived.iter().collect());
        let gain = Gain::from_pairs(&base, &waived, &[Outcome::Rejected]);
        let expected = Gain { n: 3, invalid: 1, through: 1, back: 0, changed: 2, noticed: 2 };
        assert_eq!(gain, expected);
    }
}
