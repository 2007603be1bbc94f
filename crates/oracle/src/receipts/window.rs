//! Windows of planned actions.

use evidence::{Evidence, Micros, Plan};
use instrument::{Any, Note};

/// Time by which an actor's clock and the host may put its action before or behind its window.
const EARLY: Micros = 5_000;
const LATE: Micros = 100_000;

/// Window of a planned action.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window {
    from: Micros,
    until: Micros,
}

impl Window {
    /// Of a plan; none where its step never began.
    pub(crate) fn of(evidence: &Evidence, plan: &Plan) -> Option<Window> {
        let Some(wanted) = plan.step else { return Some(Window { from: plan.from, until: plan.until }) };
        let told = |begins: bool| {
            evidence.entries.iter().filter(move |w| {
                matches!(
                    w.entry.event,
                    Any::Instrument(Note::Step { step, begun }) if step == wanted && begun == begins
                )
            })
        };
        let from = told(true).next()?.at;
        Some(Window { from, until: told(false).next_back().map_or(Micros::MAX, |w| w.at) })
    }

    /// From then to then.
    pub(crate) fn between((from, until): (Micros, Micros)) -> Window {
        Window { from, until }
    }

    /// From, to, within a run of this length.
    pub(crate) fn span(self, duration: Micros) -> (Micros, Micros) {
        (self.from, self.until.min(duration).max(self.from))
    }

    /// True if an action at `at` is within it.
    pub(crate) fn has(self, at: Micros) -> bool {
        at.saturating_add(EARLY) >= self.from && at <= self.until.saturating_add(LATE)
    }
}
