//! The telemetry side of the core: sessions open, bring records and are kept going; accepted reports are passed on.
//!
//! Judging records is left to `admit`; the right to a lease, to `lease`; the receivers of reports, to `fanout`.

use rand_chacha::ChaCha8Rng;
use rand_core::RngCore;
use wire::core::Output;
use wire::event::{Account, Event, Interface};
use wire::feed::{AcceptedReport, Feed};
use wire::id::{NodeId, Nonce, PeerId, SessionId};
use wire::policy::{Check, Policy, Requirement, Waived};
use wire::refusal::Refusal;
use wire::session::SessionBody;
use wire::time::{Instant, Span};
use wire::trust::{Accepted, Bearer, RevocationList, SignedReport, unit_of};

use crate::Gateway;
use crate::admit::{Admitted, RecordContent};
use crate::fanout::Envelope;
use crate::session::Session;

/// A session without a grant still says Hello so often, so that challenges and echoes go on.
const IDLE_HELLO: Span = Span::ms(250);

impl Gateway {
    pub(crate) fn opened(&mut self, now: Instant, id: SessionId, peer: PeerId) {
        let unit = unit_of(peer).filter(|unit| self.config.units.contains(unit));
        let Some(unit) = unit else {
            self.sessions.bar(id, peer);
            return self.out.push_back(Output::Close { session: id });
        };
        let nonce = fresh_nonce(&mut self.nonces);
        // What is heard no longer is ended: one credential must not fill the listener with sessions.
        let superseded = self.sessions.open(Session::new(id, peer, unit, nonce, &self.bounds));
        self.out.extend(superseded.map(|session| Output::Close { session }));
        self.note(now, Event::Session { peer, open: true });
        self.send_feed(now, &Feed::Session(peer, true));
        if self.tick.is_none() {
            self.tick = Some(now + Span::ms(self.bounds.grant_period_ms));
        }
        self.keep_up(now, Some(id));
    }

    pub(crate) fn closed(&mut self, now: Instant, id: SessionId) {
        let Some(peer) = self.sessions.close(id) else { return };
        self.note(now, Event::Session { peer, open: false });
        self.send_feed(now, &Feed::Session(peer, false));
    }

    /// Gives one record its verdict.
    pub(crate) fn record(&mut self, now: Instant, id: SessionId, bytes: &[u8]) {
        let session = match self.sessions.get_mut(id) {
            Ok(session) => session,
            Err((peer, refusal)) => return self.refuse(now, Interface::Uplink, peer, &refusal),
        };
        let peer = session.peer();
        if let Some(refusal) = revocation_of(&self.revoked, &self.policy, session.unit().node(), now) {
            return self.refuse(now, Interface::Uplink, Some(peer), &refusal);
        }
        match self.boundary.admit(session, now, bytes) {
            Err(refusal) => self.refuse(now, Interface::Uplink, Some(peer), &refusal),
            Ok(admitted) => self.admitted(now, id, peer, admitted),
        }
    }

    /// Tells every unit of the revocations that hold: as soon as its session stands or there is a new one, and again
    /// each challenge period, because a record may be lost and a unit start again.
    pub(crate) fn pass_on_revocations(&mut self, now: Instant) {
        let (revoked, policy) = (&self.revoked, &self.policy);
        let heard = |session: &&mut Session| may_receive(revoked, policy, session, now);
        for session in self.sessions.iter_mut().filter(|_| !self.quiet).filter(heard) {
            if !session.is_owed_revocations(now, self.revocations.len()) {
                continue;
            }
            for revocation in &self.revocations {
                let body = SessionBody::Revoked(revocation.as_slice().into());
                self.out.push_back(session.seal(now, self.boot, body));
                self.accounts.count(Account::Sent);
            }
        }
    }

    fn admitted(&mut self, now: Instant, id: SessionId, peer: PeerId, admitted: Admitted<'_>) {
        self.accounts.accepted(Interface::Uplink);
        let age = admitted.evidence().age.map(|age| age.upper());
        let (record, mut waived) = (admitted.record(), admitted.waived());
        if self.policy.check(Check::Revocation) == Requirement::Waived {
            waived = waived.with_check(Check::Revocation);
        }
        self.note(now, Event::Accepted { at: Interface::Uplink, record, peer, age, waived });
        match &admitted.content {
            // A unit that has just started again knows of no revocation.
            RecordContent::Exchange(_) => self.pass_on_revocations(now),
            RecordContent::Report(report) => self.report(now, id, report, waived),
            RecordContent::Crop(_, crop) => self.crop(now, peer, crop),
        }
    }

    /// A crop, to the display of the unit in whose session it came.
    fn crop(&mut self, now: Instant, peer: PeerId, crop: &[u8]) {
        if let Some(unit) = unit_of(peer) {
            self.send_feed(now, &Feed::Crop(unit, crop.into()));
        }
    }

    /// An accepted report: supervision of its unit, display, teammates.
    fn report(&mut self, now: Instant, id: SessionId, report: &Accepted<SignedReport<'_>>, waived: Waived) {
        let (signed, evidence) = (report.message(), report.evidence());
        let age = evidence.age.map(|age| age.upper());
        let Some(unit) = signed.report.origin.unit() else { return };
        let Ok(session) = self.sessions.get_mut(id) else { return };
        if let Some(age) = age
            && signed.bearer(session.peer()) == Bearer::Origin
        {
            // A report that another peer carried, which a waiver admits, does not supervise its unit: its age is only
            // that of the carrying record (see `admit`).
            session.heard(evidence.received, age);
        }
        let envelope = Envelope::new(session, unit, report, now);
        let (via, received, report) = (session.peer(), evidence.received, signed.bytes.into());
        self.send_feed(now, &Feed::Accepted(AcceptedReport { via, unit, received, age, waived, report }));
        self.fan_out(now, &envelope);
    }

    fn fan_out(&mut self, now: Instant, envelope: &Envelope<'_>) {
        if self.quiet {
            return;
        }
        for id in self.sessions.of_units(&envelope.addressees(&self.hearers)) {
            let Ok(session) = self.sessions.get_mut(id) else { continue };
            if !may_receive(&self.revoked, &self.policy, session, now) {
                continue;
            }
            if let Some(body) = envelope.record_for(session) {
                session.renew(now, || fresh_nonce(&mut self.nonces));
                self.out.push_back(session.seal(now, self.boot, body));
                self.accounts.count(Account::Sent);
            }
        }
    }

    /// The display has a new challenge: the units are informed at once, for waiting here makes every age look larger.
    pub(crate) fn watch(&mut self, now: Instant, challenge: Nonce) {
        self.accounts.accepted(Interface::Requests);
        self.watch = Some((challenge, now));
        self.pass_watch(now);
        self.tell_of_losses(now);
    }

    /// Tells each session the display's challenge that has not received it yet.
    fn pass_watch(&mut self, now: Instant) {
        let (revoked, policy) = (&self.revoked, &self.policy);
        let heard = |session: &&mut Session| may_receive(revoked, policy, session, now);
        let watch = self.watch.map(|(challenge, _)| challenge);
        for session in self.sessions.iter_mut().filter(|_| !self.quiet).filter(heard) {
            if let Some(challenge) = session.take_challenge(watch) {
                session.renew(now, || fresh_nonce(&mut self.nonces));
                self.out.push_back(session.seal(now, self.boot, SessionBody::Watch(challenge)));
                self.accounts.count(Account::Sent);
            }
        }
    }

    /// Keeps sessions going (all, or just one): a grant where one is due and deserved, else a Hello where one is due.
    pub(crate) fn keep_up(&mut self, now: Instant, only: Option<SessionId>) {
        self.pass_watch(now);
        self.pass_on_revocations(now);
        let (revoked, policy) = (&self.revoked, &self.policy);
        let due = |session: &&mut Session| {
            only.is_none_or(|id| id == session.id()) && may_receive(revoked, policy, session, now)
        };
        for session in self.sessions.iter_mut().filter(|_| !self.quiet).filter(due) {
            let idle = session.sent().is_none_or(|time| now.since(time) >= IDLE_HELLO);
            let hello = || (!session.established() || idle).then_some(SessionBody::Hello(session.nonce));
            let Some(body) = self.leases.grant(session, now).or_else(hello) else { continue };
            session.renew(now, || fresh_nonce(&mut self.nonces));
            self.out.push_back(session.seal(now, self.boot, body));
            self.accounts.count(Account::Sent);
        }
    }
}

/// True if the peer of a session still receives records. A revoked peer receives none: reports of others would help the
/// holder of its credential.
fn may_receive(revoked: &RevocationList, policy: &Policy, session: &Session, now: Instant) -> bool {
    revocation_of(revoked, policy, session.unit().node(), now).is_none()
}

/// Reason for which `node` is no longer admitted, if it is not. Asked before any content of a record is read.
pub(crate) fn revocation_of(revoked: &RevocationList, policy: &Policy, node: NodeId, now: Instant) -> Option<Refusal> {
    let required = policy.check(Check::Revocation) == Requirement::Required;
    revoked.check_admitted(node, now).err().filter(|_| required)
}

/// An unguessable number other than zero, which represents "none yet".
fn fresh_nonce(nonces: &mut ChaCha8Rng) -> Nonce {
    Nonce(nonces.next_u64().max(1))
}
