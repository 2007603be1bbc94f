//! Cues: events that the instrument plane reports during a run, and the steps of the attack that then begin.
//!
//! The twin passes every audit entry on as it is written; live, the recorder's process sends the launcher the entries
//! that may be cues. Both go through one [`Watch`], so a step begins by the same rule in both. Delivering the call, with
//! its delay, is left to the engines.

use ground_truth::{Any, Note, StepName};
use wire::event::Event;
use wire::id::NodeId;
use wire::mode::Mode;

/// A step that waits for something on the instrument plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cue {
    /// The step that begins.
    pub step: StepName,
    /// Event that begins it.
    pub on: Watched,
    /// Changes of mode before this time do not count, microseconds.
    pub from: u64,
}

/// Watched event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Watched {
    /// The unit under test changes its mode.
    Enters {
        /// Mode after the change.
        to: Mode,
        /// Mode before the change; none where any counts.
        from: Option<Mode>,
        /// Number of the change among such changes, from 1.
        nth: u32,
    },
    /// A step has begun, or ended.
    Step {
        /// The step.
        step: StepName,
        /// True for its beginning, false for its end.
        begun: bool,
    },
}

/// Watches a run for its cues.
#[derive(Clone, Debug, Default)]
pub struct Watch {
    /// Each cue with the number of its changes so far; `None` once it was called.
    cues: Vec<(Cue, Option<u32>)>,
}

impl Watch {
    /// A watch for `cues`.
    pub fn new(cues: &[Cue]) -> Self {
        Self { cues: cues.iter().map(|cue| (*cue, Some(0))).collect() }
    }

    /// True if any cue is still to come.
    pub fn is_waiting(&self) -> bool {
        self.cues.iter().any(|(_, seen)| seen.is_some())
    }

    /// Takes an event that `node` wrote at `time`; returns the steps that now begin, each once.
    pub fn take(&mut self, time: u64, node: NodeId, event: &Any) -> Vec<StepName> {
        let mut called = Vec::new();
        for (cue, seen) in &mut self.cues {
            let Some(count) = seen else { continue };
            let is_due = match (cue.on, event) {
                (Watched::Enters { to, from, nth }, Any::Service(Event::Transition { from: was, to: is, .. })) => {
                    let fits = node == NodeId::UNIT_A && *is == to && from.is_none_or(|mode| mode == *was);
                    *count += u32::from(fits && time >= cue.from);
                    fits && time >= cue.from && *count == nth
                }
                (Watched::Step { step, begun }, Any::Instrument(Note::Step { step: noted, begun: noted_begun })) => {
                    step == *noted && begun == *noted_begun
                }
                (Watched::Enters { .. } | Watched::Step { .. }, _) => false,
            };
            if is_due {
                *seen = None;
                if !called.contains(&cue.step) {
                    called.push(cue.step);
                }
            }
        }
        called
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::mode::{Because, Cause, Guards};

    fn change(from: Mode, to: Mode) -> Any {
        let failing = Guards::default();
        Any::Service(Event::Transition { from, to, cause: Cause::Operator, because: Because::Itself, failing })
    }

    fn step(name: &str) -> StepName {
        StepName::new(name).unwrap()
    }

    /// Only the unit under test counts.
    #[test]
    fn mode_change_counts_by_time_number_and_unit() {
        let on = Watched::Enters { to: Mode::Ready, from: Some(Mode::Degraded), nth: 2 };
        let mut watch = Watch::new(&[Cue { step: step("cut"), on, from: 100 }]);
        let back = change(Mode::Degraded, Mode::Ready);
        let called = [
            watch.take(99, NodeId::UNIT_A, &back),
            watch.take(100, NodeId::UNIT_C, &back),
            watch.take(101, NodeId::UNIT_A, &change(Mode::Idle, Mode::Ready)),
            watch.take(102, NodeId::UNIT_A, &back),
        ];
        assert!(called.iter().all(Vec::is_empty) && watch.is_waiting());
        assert_eq!(watch.take(103, NodeId::UNIT_A, &back), [step("cut")]);
        assert!(watch.take(104, NodeId::UNIT_A, &back).is_empty() && !watch.is_waiting());
    }

    #[test]
    fn two_tables_of_one_step_called_once() {
        let cue = |from| Cue { step: step("b"), on: Watched::Step { step: step("a"), begun: false }, from };
        let mut watch = Watch::new(&[cue(0), cue(5_000)]);
        let note = |begun| Any::Instrument(Note::Step { step: step("a"), begun });
        assert!(watch.take(10, NodeId::RELAY_TELEMETRY, &note(true)).is_empty());
        assert_eq!(watch.take(20, NodeId::RELAY_TELEMETRY, &note(false)), [step("b")]);
        assert!(!watch.is_waiting());
    }
}
