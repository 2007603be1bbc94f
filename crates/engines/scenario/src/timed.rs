//! Common parts of every table of a scenario that has a time: its start, its length, its step, and the knowledge that it needs.

use adversary::plan::{On, PlanStep, Wait};
use evidence::trial::Knowledge;
use ground_truth::StepName;

use super::step::{Timing, Trigger};
use super::value::{Located, Seconds};

/// Anything with a start on the trial's clock and a length.
pub trait Windowed {
    /// Start, before the trial's phase.
    fn at_s(&self) -> &Located<Seconds>;
    /// Length; zero for a table that happens once.
    fn duration_s(&self) -> Seconds;
    /// Its step and the event that the step waits for.
    fn timing(&self) -> Timing<'_> {
        Timing::default()
    }
    /// The least that has to be known to do it at all.
    fn needs(&self) -> Knowledge {
        Knowledge::Blind
    }
    /// Knowledge that the place where it is done gives, beside other steps and the events of the instrument plane, to wait by:
    /// the traffic on a path, or the reports that a teammate hears.
    fn sees(&self) -> Option<Knowledge> {
        None
    }
    /// The earliest beginning in a trial of this phase, milliseconds of the run.
    fn start_ms(&self, phase_ms: u64) -> u64 {
        (self.at_s().get() * 1000.0) as u64 + phase_ms
    }
    /// The length in milliseconds.
    fn length_ms(&self) -> u64 {
        (self.duration_s().get() * 1000.0) as u64
    }
    /// The name of its step.
    fn step_name(&self) -> Option<StepName> {
        self.timing().step.and_then(|name| StepName::new(name.as_str()))
    }
    /// Its step, as its actor gets it.
    fn actor_step(&self) -> Option<PlanStep> {
        let wait = self.timing().when.and_then(|trigger| {
            let on = match trigger.trigger()? {
                Trigger::Enters { .. } | Trigger::Begun(_) | Trigger::Ended(_) => On::Cue,
                Trigger::Passes(count) => On::Passes(count),
                Trigger::Silence(ms) => On::Silence(ms),
                Trigger::Hears(state) => On::Hears(state),
            };
            Some(Wait { on, after_ms: trigger.after_ms.unsigned() })
        });
        Some(PlanStep { name: self.step_name()?, wait })
    }
}

/// Declares tables with a time: their start, and the step that they are a part of, stand beside their own fields. `lasts` names
/// the field with the length; without one a table happens once. `needs` is the least that has to be known to do it at all, blind
/// by default; `sees` the knowledge to wait by that its place gives.
macro_rules! timed {
    ($(
        $(#[$doc:meta])* $name:ident $(lasts $length:ident)? $(needs $level:ident)? $(sees $sight:ident)? {
            $( $(#[$field_doc:meta])* $field:ident : $kind:ty ),* $(,)?
        }
    )+) => {$(
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, ::serde::Serialize, ::serde::Deserialize, ::schemars::JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            /// Start on the trial's clock; the trial's phase is added.
            pub at_s: crate::Located<crate::Seconds>,
            $( $(#[$field_doc])* pub $field: $kind, )*
            /// Name of the step that this is a part of.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub step: Option<crate::Located<crate::Name>>,
            /// The event that it waits for; `at_s` is then the earliest.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub when: Option<crate::Located<crate::When>>,
            /// Level of knowledge here, where that is less than the scenario's.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub knowledge: Option<crate::Located<evidence::trial::Knowledge>>,
        }

        impl crate::Windowed for $name {
            fn at_s(&self) -> &crate::Located<crate::Seconds> {
                &self.at_s
            }
            fn duration_s(&self) -> crate::Seconds {
                [$(self.$length,)? crate::Seconds::default()][0]
            }
            fn timing(&self) -> crate::Timing<'_> {
                crate::Timing {
                    step: self.step.as_ref(),
                    when: self.when.as_ref(),
                    knowledge: self.knowledge.as_ref(),
                }
            }
            fn needs(&self) -> evidence::trial::Knowledge {
                [$(evidence::trial::Knowledge::$level,)? evidence::trial::Knowledge::Blind][0]
            }
            fn sees(&self) -> Option<evidence::trial::Knowledge> {
                [$(Some(evidence::trial::Knowledge::$sight),)? None][0]
            }
        }
    )+};
}
pub(super) use timed;
