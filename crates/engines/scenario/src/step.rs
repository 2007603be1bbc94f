//! Steps: the events that an attack waits for beside its time, and the knowledge of its adversary.
//!
//! Every attack, insider, fault and kill may name its step and wait for an event (`when`); so several tables compose in time,
//! each beginning by an earlier one's progress. A level of knowledge limits the events that may be waited for and the information
//! that may be used. `check_steps` refuses a scenario that does not keep to its level.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::mode::Mode;

use super::Scenario;
use evidence::trial::Knowledge;

use super::value::{Located, Millis, Name, Whole};

/// The event that a step waits for: exactly one of `enters`, `begun`, `ended`, `datagrams`, `silence_ms` and `hears`. Events
/// before the step's `at_s` do not count, but for a step that has begun or ended by then.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct When {
    /// The unit under test changes to this mode. White-box.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub enters: Option<Mode>,
    /// With `enters`: from this mode only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from: Option<Mode>,
    /// With `enters`: index of the change among such changes, from 1; by default 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nth: Option<Whole<1, 100>>,
    /// The step of this name has begun.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub begun: Option<Name>,
    /// The step of this name has ended.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ended: Option<Name>,
    /// A given number of datagrams (or pieces of the stream) have passed the relay in the table's direction. On-path.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub datagrams: Option<Whole<1, 100_000>>,
    /// No datagram (or piece of the stream) has passed the relay in the table's direction for this time. On-path.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub silence_ms: Option<Whole<1, 60_000>>,
    /// The unit under test reports this mode to its team. Insider.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hears: Option<Mode>,
    /// Further wait after it.
    pub after_ms: Millis,
}

/// One condition of a [`When`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trigger<'a> {
    /// A change of mode of the unit under test.
    Enters {
        /// New mode.
        mode: Mode,
        /// Previous mode, where that matters.
        from: Option<Mode>,
        /// Index among such changes, from 1.
        nth: u32,
    },
    /// A step has begun.
    Begun(&'a Name),
    /// A step has ended.
    Ended(&'a Name),
    /// A given number of datagrams or pieces have passed.
    Passes(u32),
    /// No datagram or piece has passed for a given number of milliseconds.
    Silence(u64),
    /// A mode is reported to the team.
    Hears(Mode),
}

impl Trigger<'_> {
    /// The least that an adversary has to know to wait for it.
    pub fn needs(self) -> Knowledge {
        match self {
            Trigger::Begun(_) | Trigger::Ended(_) => Knowledge::Blind,
            Trigger::Passes(_) | Trigger::Silence(_) => Knowledge::OnPath,
            Trigger::Hears(_) => Knowledge::Insider,
            Trigger::Enters { .. } => Knowledge::WhiteBox,
        }
    }
}

impl When {
    /// Every condition that is there; a checked one has exactly one.
    pub fn triggers(&self) -> Vec<Trigger<'_>> {
        let nth = self.nth.map_or(1, |n| n.unsigned() as u32);
        let enters = self.enters.map(|mode| Trigger::Enters { mode, from: self.from, nth });
        let all = [
            enters,
            self.begun.as_ref().map(Trigger::Begun),
            self.ended.as_ref().map(Trigger::Ended),
            self.datagrams.map(|n| Trigger::Passes(n.unsigned() as u32)),
            self.silence_ms.map(|ms| Trigger::Silence(ms.unsigned())),
            self.hears.map(Trigger::Hears),
        ];
        all.into_iter().flatten().collect()
    }

    /// The one condition.
    pub fn trigger(&self) -> Option<Trigger<'_>> {
        self.triggers().into_iter().next()
    }
}

/// The step of a table.
#[derive(Clone, Copy, Debug, Default)]
pub struct Timing<'a> {
    /// Its step's name.
    pub step: Option<&'a Located<Name>>,
    /// Event that it waits for.
    pub when: Option<&'a Located<When>>,
    /// Level of its adversary's knowledge, where that is less than the scenario's.
    pub knowledge: Option<&'a Located<Knowledge>>,
}

impl Scenario {
    /// The level of knowledge: as declared, or else the one that the tables' kinds need by themselves.
    pub fn level(&self) -> Knowledge {
        let needed = || self.windows().iter().map(|w| w.needs()).max().unwrap_or_default();
        self.knowledge.as_ref().map_or_else(needed, |declared| **declared)
    }
}
