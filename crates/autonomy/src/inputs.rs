//! Meaning of each input to the core: every one goes through the trust boundary first, gets one verdict there, and only
//! then reaches the module that keeps its content.

use std::sync::Arc;

use wire::audit::Seal;
use wire::core::{Subject, Topic};
use wire::event::{Event, Interface};
use wire::id::{CommandId, PeerId, RecordId, SessionId};
use wire::policy::{Check, Requirement};
use wire::refusal::{Reason, Refusal};
use wire::sensor::Navigation;
use wire::session::{SessionBody, Teammate};
use wire::time::{Age, Instant, Span};
use wire::track::Tracks;
use wire::trust::{Evidence, SessionRecord};

use crate::command::{Claimed, Ordered};
use crate::intake::{self, Session};
use crate::{Autonomy, command};

/// Rate at which a fix is logged: every fourth.
const LOCATED_PERIOD: Span = Span::ms(190);

impl Autonomy {
    /// A message on a shared-memory channel.
    pub(crate) fn bus(&mut self, now: Instant, topic: Topic, bytes: &[u8]) {
        let result = match topic {
            Topic::Navigation => self.navigation(now, bytes),
            Topic::Tracks => self.tracks(now, bytes),
            Topic::Seals => self.seal(now, bytes),
            // Channels that no launcher connects to autonomy.
            Topic::Frames | Topic::Candidates | Topic::Drive | Topic::Act | Topic::Feed | Topic::Intents => {
                Err(Refusal::Channel)
            }
        };
        match result {
            Ok(()) => self.logged.accounts.accepted(Interface::Bus(topic)),
            Err(refusal) => self.refuse(now, Interface::Bus(topic), None, &refusal),
        }
        if topic != Topic::Seals {
            self.judge(now);
        }
    }

    fn navigation(&mut self, now: Instant, bytes: &[u8]) -> Result<(), Refusal> {
        let accepted = self.links.gates.navigation.admit::<Navigation>(&self.identity.policy, now, bytes)?;
        let (reading, evidence) = accepted.into_parts();
        self.view.localisation.take(&reading, evidence.waived);
        if let Some(pilot) = &mut self.driving.pilot {
            pilot.read(&reading);
        }
        let present = (reading.fix.is_some(), reading.odometry.is_some() && self.view.localisation.hears_odometry());
        if self.logged.present.replace(present) != Some(present) {
            self.write(now, Event::NavigationSeen { fix: present.0, odometry: present.1 });
        }
        self.witness(now, &reading);
        Ok(())
    }

    /// Logs a fix and its judgement: a few times a second, and at each change of trust in fixes.
    fn witness(&mut self, now: Instant, reading: &Navigation) {
        let (Some(fix), Some((pose, _))) = (reading.fix, self.view.localisation.reported(now)) else { return };
        let distrusted = self.view.localisation.distrusted();
        let due = |(last, before)| now.since(last) >= LOCATED_PERIOD || before != distrusted;
        if self.logged.located.is_none_or(due) {
            self.logged.located = Some((now, distrusted));
            let event = Event::Located {
                stamp: reading.stamp,
                x_mm: fix.pose.x_mm,
                y_mm: fix.pose.y_mm,
                time: fix.time,
                pose_x_mm: pose.x_mm,
                pose_y_mm: pose.y_mm,
                distrusted,
            };
            self.write(now, event);
        }
    }

    fn tracks(&mut self, now: Instant, bytes: &[u8]) -> Result<(), Refusal> {
        let accepted = self.links.gates.tracks.admit::<Tracks>(&self.identity.policy, now, bytes)?;
        let (tracks, evidence) = accepted.into_parts();
        self.view.bearings.note(&tracks, self.placed(now).map(|motion| motion.at), &self.bounds);
        self.view.crops.take(&tracks);
        self.view.picture.take(tracks, evidence.waived);
        Ok(())
    }

    fn seal(&mut self, now: Instant, bytes: &[u8]) -> Result<(), Refusal> {
        let (seal, _) = self.links.gates.seals.admit::<Seal>(&self.identity.policy, now, bytes)?.into_parts();
        self.links.seals.take(now, &seal);
        Ok(())
    }

    /// A session opened. Only the supervisor's is kept; a new one takes the place of the one before.
    pub(crate) fn opened(&mut self, now: Instant, id: SessionId, peer: PeerId) {
        self.write(now, Event::Session { peer, open: true });
        // A peer with valid credentials may open a session. Only the supervisor's may displace the present one: any
        // other would end supervision by connecting.
        if peer != self.identity.supervisor {
            return;
        }
        if let Some(before) = self.links.session.take() {
            self.write(now, Event::Session { peer: before.peer(), open: false });
        }
        let mut session = Session::new(id, peer, self.nonce(), &self.identity.bounds);
        session.challenge(self.nonce(), now);
        self.links.session = Some(session);
        self.introduce(now);
    }

    /// A session ended.
    pub(crate) fn closed(&mut self, now: Instant, id: SessionId) {
        if let Some(session) = self.links.session.take_if(|session| session.id() == id) {
            self.write(now, Event::Session { peer: session.peer(), open: false });
        }
    }

    /// Admits one record of a session.
    pub(crate) fn record(&mut self, now: Instant, id: SessionId, bytes: &[u8]) {
        let identity = Arc::clone(&self.identity);
        let Some(session) = self.links.session.as_mut().filter(|session| session.id() == id) else {
            return self.refuse(now, Interface::Downlink, None, &Refusal::NoSession);
        };
        let peer = session.peer();
        match session.admit(&identity.policy, &identity.bounds, now, bytes) {
            Ok(accepted) => {
                let (record, evidence) = accepted.into_parts();
                self.session_record(now, peer, &record, evidence);
            }
            Err(refusal) => self.refuse(now, Interface::Downlink, Some(peer), &refusal),
        }
    }

    fn session_record(&mut self, now: Instant, peer: PeerId, record: &SessionRecord<'_>, evidence: Evidence) {
        match &record.outer.body {
            SessionBody::Grant(length) => {
                let usual = Span::ms(self.identity.bounds.lease_ms);
                self.links.lease.grant(*length, usual, evidence.received, evidence.age);
                self.status.lease_waived = evidence.waived;
            }
            SessionBody::Teammate(envelope) => return self.teammate(now, envelope, evidence),
            SessionBody::Watch(challenge) => {
                if let Some(session) = &mut self.links.session {
                    session.watch(*challenge, evidence.received);
                }
            }
            SessionBody::Revoked(revocation) => {
                if let Err(refusal) = self.take_revocation(now, revocation) {
                    return self.refuse(now, Interface::Downlink, Some(peer), &refusal);
                }
            }
            // A supervisor reports nothing to a unit, and shows it nothing; if it does, nothing follows from it.
            SessionBody::Hello(_) | SessionBody::Report(_) | SessionBody::Crop(_) => {}
        }
        self.accept(now, peer, record.id(), &evidence);
    }

    /// A revocation in a record that was accepted: the supervisor brings it, the authority's signature makes it good.
    fn take_revocation(&mut self, now: Instant, bytes: &[u8]) -> Result<(), Refusal> {
        if let Some(who) = self.revoked.revoke(&self.identity.keys, now, bytes)? {
            self.write(now, Event::Struck { who });
        }
        Ok(())
    }

    /// A teammate's report in a record that was accepted: the verdict over the report is the verdict over the record.
    fn teammate(&mut self, now: Instant, envelope: &Teammate<'_>, outer: Evidence) {
        let identity = Arc::clone(&self.identity);
        let peer = envelope.via;
        let since_gateway = (outer.received, outer.age);
        let verdict = intake::teammate(
            &identity.policy,
            &identity.keys,
            &mut self.links.windows,
            &identity.bounds,
            envelope,
            since_gateway,
        );
        let (signed, inner) = match verdict {
            Ok(accepted) => accepted.into_parts(),
            Err(refusal) => return self.refuse(now, Interface::Downlink, Some(peer), &refusal),
        };
        let report = &signed.report;
        let Some(unit) = report.origin.unit().filter(|unit| identity.teammates.contains(unit)) else {
            return self.refuse(now, Interface::Downlink, Some(peer), &Refusal::Role { got: report.origin });
        };
        let refused = self.revoked.check_admitted(report.origin, now).err();
        let refused = refused.filter(|_| identity.policy.check(Check::Revocation) == Requirement::Required);
        if let Some(refusal) = refused {
            return self.refuse(now, Interface::Downlink, Some(peer), &refusal);
        }
        let waived = inner.waived.union(outer.waived);
        self.accept(now, peer, report.id(), &Evidence { waived, ..inner });
        let age = inner.age.map_or(Span::ZERO, Age::upper);
        let own_motion = self.view.localisation.motion();
        let stood = self.links.teammates.finding();
        if let Some(finding) = self.links.teammates.take((unit, peer), report, age, now, own_motion, &identity.bounds) {
            if stood != Some((unit, finding)) {
                self.write(now, Event::Inconsistent { unit, finding, record: report.id() });
            }
            self.judge(now);
        }
    }

    /// A publication on the command plane.
    pub(crate) fn published(&mut self, now: Instant, subject: Subject, bytes: &[u8]) {
        if subject != Subject::Command(self.identity.unit) {
            return self.reject(now, None, &Refusal::Channel);
        }
        let identity = Arc::clone(&self.identity);
        match self.commands.admit(&identity.policy, &identity.keys, &self.revoked, now, bytes) {
            Ok(order) => self.ordered(now, order),
            Err(rejected) => self.reject(now, rejected.claimed, &rejected.refusal),
        }
    }

    /// The session at the broker was lost. Messages to this unit meanwhile are lost, or another party has them: no
    /// trusted source says whether the session was cut or taken over. Orders given until now that lead away from safe
    /// are therefore void, and reports tell the operator of the loss.
    pub(crate) fn session_lost(&mut self, now: Instant) {
        self.write(now, Event::SessionLost { peer: self.identity.unit.peer() });
        self.status.sessions_lost = self.status.sessions_lost.saturating_add(1);
        self.commands.void();
        self.void_stored(now);
        let nonce = self.nonce();
        self.commands.issue(nonce, now);
    }

    /// Refuses a message that no participant's signature vouches for. Each refusal is counted; only some are logged and
    /// answered, since a flood must not make the unit sign and write at the rate of the flood.
    fn reject(&mut self, now: Instant, claimed: Option<Claimed>, refusal: &Refusal) {
        let event = self.logged.accounts.refused(Interface::Commands, None, refusal);
        if !self.commands.should_report(now) {
            return;
        }
        if let Some(event) = event {
            self.write(now, event);
        }
        if let Some(claimed) = claimed {
            self.answer(now, &claimed, Some(refusal));
        }
    }

    /// An order proved to be the operator's is answered each time: its own rate bounds that.
    fn ordered(&mut self, now: Instant, order: Ordered) {
        if let Some(window) = order.window() {
            return self.store(now, window, order);
        }
        let refused = self.obey(now, &order);
        self.concluded(now, &order.claimed(), order.moved(), refused);
    }

    /// An order was carried out as it came, or refused; `moved` is the value to which it moved its operator's counter.
    pub(crate) fn concluded(
        &mut self,
        now: Instant,
        claimed: &Claimed,
        moved: Option<CommandId>,
        refused: Option<Refusal>,
    ) {
        match &refused {
            None => self.logged.accounts.accepted(Interface::Commands),
            Some(refusal) => self.refuse(now, Interface::Commands, None, refusal),
        }
        self.heard(moved, refused.as_ref().map(Refusal::reason));
        self.answer(now, claimed, refused.as_ref());
    }

    /// Notes the operator's counter for the report: the console continues above the reported value. Only an order that
    /// moved the counter is noted. A HOLD from far ahead would lead the console to values that the unit refuses, and so
    /// would an old order.
    pub(crate) fn heard(&mut self, moved: Option<CommandId>, refused: Option<Reason>) {
        if let Some(newest) = moved {
            self.status.last_command = Some((newest, refused));
        }
    }

    pub(crate) fn answer(&mut self, now: Instant, claimed: &Claimed, refused: Option<&Refusal>) {
        let refused = refused.map(Refusal::reason);
        self.write(now, Event::Executed { command: claimed.id, kind: claimed.kind, refused });
        self.acknowledge(claimed, refused, None);
    }

    pub(crate) fn acknowledge(&mut self, claimed: &Claimed, refused: Option<Reason>, due: Option<Span>) {
        let ack = command::acknowledge(&self.identity.key, claimed, refused, self.mode(), due);
        self.publish(Subject::Ack(self.identity.unit), ack);
    }

    fn accept(&mut self, now: Instant, peer: PeerId, record: RecordId, evidence: &Evidence) {
        self.logged.accounts.accepted(Interface::Downlink);
        let (age, waived) = (evidence.age.map(Age::upper), evidence.waived);
        self.write(now, Event::Accepted { at: Interface::Downlink, record, peer, age, waived });
    }

    fn refuse(&mut self, now: Instant, interface: Interface, peer: Option<PeerId>, refusal: &Refusal) {
        if let Some(event) = self.logged.accounts.refused(interface, peer, refusal) {
            self.write(now, event);
        }
    }
}
