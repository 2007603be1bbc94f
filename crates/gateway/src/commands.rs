//! The command side of the core: requests of the console in, orders out, acknowledgements back.
//!
//! Judging intents, confirmations and acknowledgements is left to `stage`, passing the display's challenge on to `telemetry`.

use wire::command::{CommandKind, Request};
use wire::core::{Output, Subject, Topic};
use wire::event::{Event, Interface};
use wire::feed::{CommandStage, Feed};
use wire::id::CommandId;
use wire::time::Instant;
use wire::trust::Accepted;

use crate::Gateway;
use crate::stage::{Dispatch, Progress, Rejected};

impl Gateway {
    pub(crate) fn requested(&mut self, now: Instant, topic: Topic, bytes: &[u8]) {
        if topic != Topic::Intents {
            return;
        }
        let at = Interface::Bus(topic);
        match self.requests.admit::<Request<'_>>(&self.policy, now, bytes) {
            Err(refusal) => self.refuse(now, at, None, &refusal),
            Ok(accepted) => {
                self.accounts.accepted(at);
                self.request(now, &accepted);
            }
        }
    }

    fn request(&mut self, now: Instant, accepted: &Accepted<Request<'_>>) {
        let verdict = match accepted.message() {
            Request::Stage(intent) => self.staging.stage(now, accepted.evidence().age, intent),
            Request::Release(confirmation) => self.staging.release(now, confirmation),
            Request::Watch(challenge) => return self.watch(now, *challenge),
        };
        match verdict {
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
