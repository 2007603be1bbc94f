//! Windows of planned actions.

use evidence::{Evidence, Micros, Plan};
use ground_truth::{Any, Note};

use crate::facts::Span;

/// Tolerance before and after a window, for an actor's clock and the host.
const EARLY: Micros = 5_000;
const LATE: Micros = 100_000;

/// Window of a planned action.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window {
    from: Micros,
    until: Micros,
}

impl Window {
    /// Window of a plan; none where its step never began.
    pub(crate) fn from_plan(evidence: &Evidence, plan: &Plan) -> Option<Window> {
        let Some(wanted) = plan.step else { return Some(Window { from: plan.from, until: plan.until }) };
        let step_entries = |begins: bool| {
            evidence.entries.iter().filter(move |w| {
                matches!(
                    w.entry.event,
                    Any::Instrument(Note::Step { step, begun }) if step == wanted && begun == begins
                )
            })
        };
        let from = step_entries(true).next()?.at;
        Some(Window { from, until: step_entries(false).next_back().map_or(Micros::MAX, |w| w.at) })
    }

    /// Window over a span.
    pub(crate) fn from_span((from, until): Span) -> Window {
        Window { from, until }
    }

    /// Span of the window within a run of this length.
    pub(crate) fn span(self, duration: Micros) -> Span {
        (self.from, self.until.min(duration).max(self.from))
    }

    /// True if an action at `time` is within it.
    pub(crate) fn contains(self, time: Micros) -> bool {
        time.saturating_add(EARLY) >= self.from && time <= self.until.saturating_add(LATE)
    }
}
