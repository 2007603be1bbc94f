//! The command side of the core: requests of the console in, orders out, acknowledgements back.
//!
//! Judging intents, confirmations and acknowledgements is left to `stage`, passing the display's challenge on to
//! `telemetry`.

use wire::bus;
use wire::command::{CommandKind, Request};
use wire::core::{Output, Subject, Topic};
use wire::event::{Event, Interface};
use wire::feed::{CommandStage, Feed};
use wire::id::{NodeId, PeerId};
use wire::refusal::{Reason, Refusal};
use wire::time::{Instant, Span};
use wire::trust::Accepted;
use wire::trust::rate::RateClass;

use crate::stage::{Command, Dispatch, Progress, Rejected};
use crate::telemetry::revocation_of;
use crate::{DISPLAY, Gateway};

impl Gateway {
    pub(crate) fn requested(&mut self, now: Instant, topic: Topic, bytes: &[u8]) {
        if topic != Topic::Intents {
            return;
        }
        let interface = Interface::Bus(topic);
        // Whose channel it says it is decides which gate it has to pass; the tag decides whether it is.
        let producer = bus::claimed_producer(bytes);
        // A producer without a gate is judged, and refused for its tag, by the first: no message goes uncounted.
        let gate = self.requests.iter().position(|gate| Some(gate.producer.index()) == producer).unwrap_or(0);
        let gate = &mut self.requests[gate];
        let station = gate.producer;
        match gate.admit::<Request<'_>>(&self.policy, now, bytes) {
            Err(refusal) => self.refuse(now, interface, None, &refusal),
            Ok(accepted) => {
                self.accounts.accepted(interface);
                self.request(now, station, &accepted);
            }
        }
    }

    fn request(&mut self, now: Instant, station: NodeId, accepted: &Accepted<Request<'_>>) {
        let verdict = match accepted.message() {
            Request::Watch(challenge) => match self.watched(now, station) {
                Ok(()) => return self.watch(now, *challenge),
                Err(refusal) => Err(refusal.into()),
            },
            Request::Stage(intent) => {
                self.staging.stage(now, (station, accepted.evidence().age), &self.revoked, intent)
            }
            Request::Release(confirmation) => self.staging.release(now, station, confirmation),
            Request::Revoke(revocation) => match self.staging.needed(now, station, RateClass::Withdraw) {
                Ok(()) => return self.revoke(now, revocation),
                Err(refusal) => Err(refusal.into()),
            },
        };
        match verdict {
            Ok(progress) => {
                self.accounts.accepted(Interface::Requests);
                match progress {
                    Progress::Staged(command) => self.staged(now, command, CommandStage::Staged),
                    Progress::Send(dispatch) => self.send(now, dispatch),
                }
            }
            Err(Rejected { command, refusal }) => {
                // The display's own are few, but for a flood; nobody else's may keep them from being reported.
                let is_own = station == DISPLAY && !matches!(refusal, Refusal::Rate { .. });
                let reported = self.reject(now, Interface::Requests, is_own, &refusal);
                let Some(command) = command.filter(|_| reported) else { return };
                self.note(now, Event::Staged { command: command.id, stage: CommandStage::Refused });
                // What another station asks for in vain is no command of the display's, whatever it claims to be.
                if station == DISPLAY {
                    self.send_feed(now, &Feed::Command(command.intent, CommandStage::Refused, Some(refusal.reason())));
                }
            }
        }
    }

    /// Counts a refusal, and reports it where it is `expected` or the rate leaves room: a flood must not make the
    /// gateway write at the rate of the flood.
    fn reject(&mut self, now: Instant, interface: Interface, expected: bool, refusal: &Refusal) -> bool {
        let reported = expected || self.staging.should_report(now);
        if reported {
            self.refuse(now, interface, None, refusal);
        } else {
            self.accounts.refused(interface, None, refusal);
            self.feed.count(now, refusal.reason(), None);
        }
        reported
    }

    /// Takes a revocation: it holds here at once, and is sent to the units until the end of the run.
    fn revoke(&mut self, now: Instant, bytes: &[u8]) {
        match self.revoked.revoke(&self.keys, now, bytes) {
            Err(refusal) => return self.refuse(now, Interface::Requests, None, &refusal),
            Ok(None) => {}
            Ok(Some(who)) => {
                self.note(now, Event::Struck { who });
                for command in self.staging.drop_revoked(who) {
                    self.moved(now, command, CommandStage::Refused, Some(Reason::Revoked));
                }
                self.revocations.push(bytes.to_vec());
                self.pass_on_revocations(now);
            }
        }
        self.accounts.accepted(Interface::Requests);
    }

    fn send(&mut self, now: Instant, dispatch: Dispatch) {
        let Dispatch { command, unit, kind, after, order } = dispatch;
        if kind == CommandKind::Hold {
            self.leases.hold(unit, command.intent, now + after);
        }
        if self.quiet {
            return;
        }
        self.out.push_back(Output::Publish { subject: Subject::Command(unit), bytes: order });
        self.staged(now, command, CommandStage::Sent);
    }

    pub(crate) fn published(&mut self, now: Instant, subject: Subject, bytes: &[u8]) {
        let unit = match subject {
            Subject::Ack(unit) => unit,
            // The broker's table of rights lets the gateway subscribe to acknowledgements alone.
            Subject::Command(_) => return,
        };
        if let Some(refusal) = revocation_of(&self.revoked, &self.policy, unit.node(), now) {
            self.reject(now, Interface::Acks, false, &refusal);
            return;
        }
        match self.staging.acknowledged(now, unit, bytes) {
            Err(refusal) => {
                self.reject(now, Interface::Acks, false, &refusal);
            }
            Ok(None) => self.accounts.accepted(Interface::Acks),
            Ok(Some(ack)) => {
                self.accounts.accepted(Interface::Acks);
                let ack = ack.message();
                if ack.refused.is_none() && ack.due.is_none() {
                    self.leases.executed(unit, ack.intent);
                }
                self.send_feed(now, &Feed::Acknowledged(bytes.into()));
            }
        }
    }

    /// The gateway's session at the broker was cut, or another party had it. Intents that wait for their confirmation
    /// are void. The display is informed now, and again with each of its challenges.
    pub(crate) fn session_lost(&mut self, now: Instant) {
        self.note(now, Event::SessionLost { peer: PeerId::GATEWAY });
        self.sessions_lost = self.sessions_lost.saturating_add(1);
        for command in self.staging.void() {
            self.staged(now, command, CommandStage::Refused);
        }
        self.tell_of_losses(now);
    }

    pub(crate) fn tell_of_losses(&mut self, now: Instant) {
        if self.sessions_lost > 0 {
            self.send_feed(now, &Feed::SessionsLost(self.sessions_lost));
        }
    }

    pub(crate) fn staged(&mut self, now: Instant, command: Command, stage: CommandStage) {
        self.moved(now, command, stage, None);
    }

    fn moved(&mut self, now: Instant, command: Command, stage: CommandStage, reason: Option<Reason>) {
        self.note(now, Event::Staged { command: command.id, stage });
        self.send_feed(now, &Feed::Command(command.intent, stage, reason));
    }

    /// Checks that a challenge comes from the display, and no more often than twice a period: each challenge is sent to
    /// every unit.
    fn watched(&mut self, now: Instant, station: NodeId) -> Result<(), Refusal> {
        if station != DISPLAY {
            return Err(Refusal::Role { got: station });
        }
        let least = Span::ms(self.bounds.challenge_period_ms / 2);
        if self.watch.is_some_and(|(_, since)| now.since(since) < least) {
            return Err(Refusal::Rate {
                burst: 1,
                per_s: (2_000 / self.bounds.challenge_period_ms.max(1)) as u32,
                got: station,
            });
        }
        Ok(())
    }
}
