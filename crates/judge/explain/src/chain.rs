//! The chain from a cause to the place where it began, put together link by link.

use evidence::Micros;
use wire::id::NodeId;

use super::{ChainStep, FaultSite, LinkStage, Origin};

/// Origin with its first link, by the unit's log.
pub(super) fn of_unit(place: FaultSite, since: Micros, name: impl Into<String>) -> Origin {
    from(NodeId::UNIT_A, place, since, name)
}

/// Origin with its first link, by the log of `by`.
pub(super) fn from(by: NodeId, place: FaultSite, since: Micros, name: impl Into<String>) -> Origin {
    let what = name.into();
    let first = ChainStep { stage: LinkStage::Cause, at_us: since, by, what: what.clone() };
    Origin { place, or: Vec::new(), since_us: since, what, steps: vec![first] }
}

impl Origin {
    /// The origin with `place` as another possible site, which the log cannot tell apart.
    pub(super) fn or(mut self, place: FaultSite) -> Origin {
        self.or.push(place);
        self
    }

    /// The origin with another link.
    pub(super) fn with_link(mut self, stage: LinkStage, at_us: Micros, by: NodeId, name: impl Into<String>) -> Origin {
        self.steps.push(ChainStep { stage, at_us, by, what: name.into() });
        self
    }

    /// The origin with the refusals as one link: their number, their beginning, and the words of the first.
    pub(super) fn refusing(self, author: NodeId, refused: &[(Micros, String)]) -> Origin {
        let Some((since, first)) = refused.first() else { return self };
        let name = match refused.len() {
            1 => format!("refused one: {first}"),
            n => format!("refused {n}, the first: {first}"),
        };
        self.with_link(LinkStage::Refusals, *since, author, name)
    }
}
