//! The chain from a cause to the place where it began, put together link by link.

use evidence::Micros;
use wire::id::NodeId;

use super::{Origin, Place, Stage, Step};

/// A cause with its first link, by the unit's own word.
pub(super) fn of_unit(place: Place, since: Micros, what: impl Into<String>) -> Origin {
    from(NodeId::UNIT_A, place, since, what)
}

/// The same by the word of `by`.
pub(super) fn from(by: NodeId, place: Place, since: Micros, what: impl Into<String>) -> Origin {
    let what = what.into();
    let first = Step { stage: Stage::Cause, at_us: since, by, what: what.clone() };
    Origin { place, or: Vec::new(), since_us: since, what, steps: vec![first] }
}

impl Origin {
    /// One that the log cannot tell from `place`.
    pub(super) fn or(mut self, place: Place) -> Origin {
        self.or.push(place);
        self
    }

    /// With another link.
    pub(super) fn with(mut self, stage: Stage, at_us: Micros, by: NodeId, what: impl Into<String>) -> Origin {
        self.steps.push(Step { stage, at_us, by, what: what.into() });
        self
    }

    /// With the refusals, as one link: their number, their beginning, and the first in its own words.
    pub(super) fn refusing(self, by: NodeId, refused: &[(Micros, String)]) -> Origin {
        let Some((since, first)) = refused.first() else { return self };
        let what = match refused.len() {
            1 => format!("refused one: {first}"),
            n => format!("refused {n}, the first: {first}"),
        };
        self.with(Stage::Refusals, *since, by, what)
    }
}
