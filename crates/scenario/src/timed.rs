//! What every table of a scenario has that happens at a time: its start, its length, its step, and what it takes to do it.

use adversary::plan::{On, Step, Wait};
use evidence::trial::Knowledge;
use wire::step::StepName;

use super::step::{Timing, Trigger};
use super::value::{Located, Seconds};

/// Anything with a start on the trial's clock and a length.
pub trait Windowed {
    /// Start, before the trial's phase.
    fn at_s(&self) -> &Located<Seconds>;
    /// Length; zero for what happens once.
    fn duration_s(&self) -> Seconds;
    /// Its step and what that waits for.
    fn timing(&self) -> Timing<'_> {
        Timing::default()
    }
    /// The least that has to be known to do it at all.
    fn needs(&self) -> Knowledge {
        Knowledge::Blind
    }
    /// What can be waited for from the place where it is done, beside other steps and what the instrument plane tells:
    /// the traffic on a path, or what a teammate hears.
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
    /// Its step, as its actor is told of it.
    fn actor_step(&self) -> Option<Step> {
        let wait = self.timing().when.and_then(|when| {
            let on = match when.trigger()? {
                Trigger::Enters { .. } | Trigger::Begun(_) | Trigger::Ended(_) => On::Cue,
                Trigger::Passes(count) => On::Passes(count),
                Trigger::Silence(ms) => On::Silence(ms),
                Trigger::Hears(state) => On::Hears(state.mode()),
            };
            Some(Wait { on, after_ms: when.after_ms.unsigned() })
        });
        Some(Step { name: self.step_name()?, wait })
    }
}

/// Declares tables of what happens at a time: its start, and the step that it is a part of, stand beside its own fields.
/// `lasts` names the field with its length; without one it happens once. `needs` is the least that has to be known to do
/// it at all, nothing by default; `sees` what can be waited for from where it is done.
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
            /// What it waits for; `at_s` is then the earliest.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub when: Option<crate::Located<crate::When>>,
            /// What may be known here, where that is less than the scenario's level.
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
