//! The command side of the core: requests of the console in, orders out, acknowledgements back.
//!
//! Judging intents, confirmations and acknowledgements is left to `stage`, passing the display's challenge on to `telemetry`.

use wire::bus;
use wire::command::{CommandKind, Request};
use wire::core::{Output, Subject, Topic};
use wire::event::{Event, Interface};
use wire::feed::{CommandStage, Feed};
use wire::id::{CommandId, NodeId};
use wire::refusal::Refusal;
use wire::time::Instant;
use wire::trust::Accepted;
use wire::trust::rate::Lane;

use crate::Gateway;
use crate::stage::{Dispatch, Progress, Rejected};

impl Gateway {
    pub(crate) fn requested(&mut self, now: Instant, topic: Topic, bytes: &[u8]) {
        if topic != Topic::Intents {
            return;
        }
        let at = Interface::Bus(topic);
        // Whose channel it says it is decides which gate it has to pass; the tag decides whether it is.
        let says = bus::claimed_producer(bytes);
        let gate = self.requests.iter().position(|gate| Some(gate.producer.index()) == says).unwrap_or(0);
        let gate = &mut self.requests[gate];
        let station = gate.producer;
        match gate.admit::<Request<'_>>(&self.policy, now, bytes) {
            Err(refusal) => self.refuse(now, at, None, &refusal),
            Ok(accepted) => {
                self.accounts.accepted(at);
                self.request(now, station, &accepted);
            }
        }
    }

    fn request(&mut self, now: Instant, station: NodeId, accepted: &Accepted<Request<'_>>) {
        let verdict = match accepted.message() {
            Request::Watch(challenge) => return self.watch(now, *challenge),
            Request::Stage(intent) => self.staging.stage(now, (station, accepted.evidence().age), &self.roll, intent),
            Request::Release(confirmation) => self.staging.release(now, station, confirmation),
            Request::Revoke(revocation) => match self.staging.needed(now, station, Lane::Withdraw) {
                Ok(()) => return self.revoke(now, revocation),
                Err(refusal) => Err(refusal.into()),
            },
        };
        match verdict {
            // Counted, and not told one by one: a flood must not make us write as fast as it asks.
            Err(Rejected { refusal: refusal @ Refusal::Rate { .. }, .. }) if !self.staging.tell(now) => {
                self.accounts.refused(Interface::Requests, None, &refusal);
            }
            Ok(progress) => {
                self.accounts.accepted(Interface::Requests);
                match progress {
                    Progress::Staged(id) => self.staged(now, id, CommandStage::Staged),
                    Progress::Send(dispatch) => self.send(now, dispatch),
                }
            }
            Err(Rejected { command, refusal }) => {
                self.refuse(now, Interface::Requests, None, &refusal);
                if let Some(id) = command {
                    self.staged(now, id, CommandStage::Refused);
                }
            }
        }
    }

    /// A revocation: it holds here at once, and units are told of it until they are gone.
    fn revoke(&mut self, now: Instant, bytes: &[u8]) {
        match self.roll.revoke(&self.keys, now, bytes) {
            Err(refusal) => return self.refuse(now, Interface::Requests, None, &refusal),
            Ok(None) => {}
            Ok(Some(who)) => {
                self.note(now, Event::Struck { who });
                for command in self.staging.strike(who) {
                    self.staged(now, command, CommandStage::Refused);
                }
                self.revocations.push(bytes.to_vec());
                self.pass_on_revocations(now);
            }
        }
        self.accounts.accepted(Interface::Requests);
    }

    fn send(&mut self, now: Instant, dispatch: Dispatch) {
        let Dispatch { id, unit, kind, order } = dispatch;
        if kind == CommandKind::Hold {
            self.leases.hold(unit, id);
        }
        if self.quiet {
            return;
        }
        self.out.push_back(Output::Publish { subject: Subject::Command(unit), bytes: order });
        self.staged(now, id, CommandStage::Sent);
    }

    pub(crate) fn published(&mut self, now: Instant, subject: Subject, bytes: &[u8]) {
        let unit = match subject {
            Subject::Ack(unit) => unit,
            Subject::Command(_) => return,
        };
        match self.staging.acknowledged(now, unit, bytes) {
            Err(refusal) => self.refuse(now, Interface::Acks, None, &refusal),
            Ok(ack) => {
                self.accounts.accepted(Interface::Acks);
                let ack = ack.message();
                if ack.refused.is_none() {
                    self.leases.executed(unit, ack.id);
                }
                self.tell(now, &Feed::Acknowledged(bytes.into()));
            }
        }
    }

    pub(crate) fn staged(&mut self, now: Instant, command: CommandId, stage: CommandStage) {
        self.note(now, Event::Staged { command, stage });
        self.tell(now, &Feed::Command(command, stage));
    }
}
