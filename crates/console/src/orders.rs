//! Path from wishes to signed requests: the one way for the script and for a person.
//!
//! `hand` judges a person's acts, `operator` decides the script's; signing is left to `intent`.

use wire::codec;
use wire::command::Request;
use wire::core::{Output, Topic};
use wire::event::Event;
use wire::id::{CommandId, NodeId};
use wire::person::{Order, Unable};
use wire::time::Instant;

use crate::Console;
use crate::act::Answer;
use crate::hand::Consequence;
use crate::life::Giver;
use crate::operator::Wish;
use crate::shown::Shown;

impl Console {
    /// Lets the operator look, and carries out the wishes. True if there was any.
    pub(crate) fn wishes(&mut self, now: Instant, shown: &Shown) -> bool {
        if self.quiet {
            return false;
        }
        let mut wishes = self.operator.look(shown);
        wishes.extend(std::iter::from_fn(|| self.model.hand().release(shown)));
        let any = !wishes.is_empty();
        for wish in wishes {
            self.carry_out(now, wish);
        }
        any
    }

    /// An act of a person: judged once, answered, and reported to the instrument plane with any result.
    pub(crate) fn act(&mut self, now: Instant, bytes: &[u8]) {
        let by = self.model.shown(now).operator;
        let read = self.model.hand().read(bytes);
        let (serial, act) = read.map_or((0, None), |numbered| (numbered.serial, Some(numbered.act)));
        let outcome = match read {
            Ok(_) if self.quiet => Err(Unable::Over),
            Ok(numbered) => {
                let shown = self.model.shown(now);
                self.model.hand().judge(&numbered, &shown)
            }
            Err(unable) => Err(unable),
        };
        let outcome = outcome.map(|deed| match deed {
            Consequence::Nothing => None,
            Consequence::Wish(wish) => self.carry_out(now, wish),
            Consequence::Note(alarm, since) => {
                self.model.acknowledge(now, &alarm, since);
                None
            }
            Consequence::Shelve(group, shelf) => {
                self.model.shelve(now, &group, shelf);
                None
            }
            Consequence::Silence => {
                self.model.silence(now);
                None
            }
        });
        self.model.hand().answer(Answer { serial, at: now, act, outcome });
        let (command, refused) = (outcome.ok().flatten(), outcome.err());
        self.note(now, Event::Act { by, serial, act, command, refused });
    }

    /// The one way from a wish, of the script or of a person, to a request to the gateway. Returns the command, if the
    /// wish was for one. A replay has no issuer, and of a person's wish only the history is kept here: the requests
    /// come from the recording (`retrace`).
    fn carry_out(&mut self, now: Instant, wish: Wish) -> Option<CommandId> {
        match wish {
            Wish::Intend { step, unit, kind, tag, basis, reason } => {
                let giver = if step.is_some() { Giver::Script } else { Giver::Person };
                if self.issuer.is_some() || giver == Giver::Person {
                    self.model.ordered(now, Order::Command(unit, kind), giver);
                }
                let issued = self.issuer.as_mut()?.intent(unit, basis, (kind, tag), &reason);
                match step {
                    Some(step) => self.operator.link_intent(step, issued.intent),
                    None if kind.towards_safe() => {}
                    None => self.model.hand().link_intent(issued.intent),
                }
                self.model.commands_mut().requested(now, &issued, giver);
                self.note(now, Event::Intended { command: issued.id, kind, tag });
                self.request(now, &Request::Stage(issued.bytes.as_slice().into()));
                return Some(issued.id);
            }
            Wish::Release(intent) => {
                let (id, _) = self.model.commands().find_by_intent(&intent)?;
                let confirmation = self.issuer.as_ref()?.confirmation(id, intent);
                self.model.commands_mut().released(now, &intent);
                self.request(now, &Request::Release(confirmation.as_slice().into()));
            }
            Wish::Revoke(who, by) => {
                if self.issuer.is_some() || by == Giver::Person {
                    self.model.revoked(now, who, by);
                }
                // The revocation is the authority's; asking for it is an operator's, who has a pen.
                self.issuer.as_ref()?;
                self.revoked.push(who);
                self.revoke(now, who);
            }
        }
        None
    }

    /// Requests the revocation of `node`; revocations are not acknowledged, so the request is repeated with each
    /// challenge.
    pub(crate) fn revoke(&mut self, now: Instant, node: NodeId) {
        if let Some((_, signed)) = self.revocations.iter().find(|(owner, _)| *owner == node).cloned() {
            self.request(now, &Request::Revoke(signed.as_slice().into()));
        }
    }

    pub(crate) fn request(&mut self, now: Instant, request: &Request<'_>) {
        let bytes = self.requests.seal(now, &codec::encode(request));
        self.out.push_back(Output::Bus { topic: Topic::Intents, bytes });
    }
}
