//! The thief of a session: it holds a copy of another's certificate, and connects to the broker under it.
//!
//! A broker has one session for one identity, so the newcomer takes it: publications to that identity reach the
//! thief, until the owner has dialled again and takes it back, and so on in turns. Its certificate signs no message:
//! it can keep publications from their receiver, and read them. Dialling again is the link's business.

use config::setup::Setup;
use ground_truth::Note;
use wire::core::{Core, Input, Output};
use wire::id::PeerId;
use wire::time::{Instant, Span};

use crate::opening::Opening;
use crate::outbox::Outbox;
use crate::plan::{Direction, PlanError, SessionThiefConfig, Takeover};

/// A thief of a session at the broker.
#[derive(Clone, Debug)]
pub struct SessionThief {
    certificate: PeerId,
    takeovers: Vec<Opening>,
    /// True if it is after the session now.
    joined: bool,
    /// Time at which it first wants to be asked, until it was: its claims are heard only then.
    first: Option<Instant>,
    outbox: Outbox,
}

impl SessionThief {
    /// A thief that starts at `now`.
    ///
    /// # Errors
    /// A magnitude of the plan outside its bounds.
    pub fn new(setup: &Setup, config: &SessionThiefConfig, now: Instant) -> Result<Self, PlanError> {
        config.check()?;
        let opening = |t: &Takeover| Opening::new(t.step, Direction::Both, now, t.at_ms, Span::ms(t.duration_ms));
        let takeovers = config.takeovers.iter().map(opening).collect();
        let outbox = Outbox::new(setup, now);
        Ok(Self { certificate: config.certificate, takeovers, joined: false, first: Some(now), outbox })
    }

    /// Joins or leaves the broker at its time.
    fn act(&mut self, now: Instant) {
        let wanted = !self.outbox.is_quiet() && self.takeovers.iter().any(|takeover| takeover.is_open(now));
        match (std::mem::replace(&mut self.joined, wanted), wanted) {
            (false, true) => {
                self.outbox.write(now, Note::Joins { certificate: self.certificate });
                self.outbox.put(Output::Join);
            }
            (true, false) => self.outbox.put(Output::Leave),
            (true, true) | (false, false) => {}
        }
        self.takeovers.retain(|takeover| takeover.closes().is_none_or(|closes| now < closes));
    }
}

impl Core for SessionThief {
    fn handle(&mut self, now: Instant, input: &Input) {
        self.first = None;
        let ended = self.outbox.heed(now, input);
        if !ended {
            self.outbox.notice(&mut self.takeovers, now, input, None);
            self.act(now);
        }
    }

    fn deadline(&self) -> Option<Instant> {
        let edge = |takeover: &Opening| if self.joined { takeover.closes() } else { takeover.opens() };
        let times = self.takeovers.iter().filter_map(Opening::due);
        times.chain(self.takeovers.iter().filter_map(edge)).chain(self.first).min().filter(|_| !self.outbox.is_quiet())
    }

    fn output(&mut self) -> Option<Output> {
        self.outbox.next()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{at_ms, setup, turn};
    use ground_truth::Any;
    use wire::id::NodeId;

    /// Once the run is over, the thief takes no session.
    #[test]
    fn thief_joins_and_leaves_at_its_times() {
        let takeover = |at_ms| Takeover { at_ms, duration_ms: 500, step: None };
        let config = SessionThiefConfig { certificate: PeerId::UNIT_A, takeovers: [1000, 3000].map(takeover).to_vec() };
        let mut thief = SessionThief::new(&setup(NodeId::IMPOSTOR, 7), &config, at_ms(0)).unwrap();
        let (mut events, mut did) = (Vec::new(), Vec::new());
        while let Some(due) = thief.deadline().filter(|due| *due < at_ms(3200)) {
            did.extend(turn(&mut thief, due, &Input::Timeout, &mut events).into_iter().map(|output| (due, output)));
        }
        let expected = [(at_ms(1000), Output::Join), (at_ms(1500), Output::Leave), (at_ms(3000), Output::Join)];
        assert_eq!(did, expected);
        assert_eq!(turn(&mut thief, at_ms(3200), &Input::Quiesce, &mut events), [Output::Leave]);
        assert_eq!(thief.deadline(), None);
        assert_eq!(
            events.iter().filter(|e| matches!(e, Any::Instrument(Note::Joins { certificate: PeerId::UNIT_A }))).count(),
            2
        );
    }
}
