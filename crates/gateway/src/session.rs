//! A session with a unit: nonces and challenges of gateway and peer, the bound on the peer's ages, and the
//! table of all sessions.
//!
//! A session keeps only values that the *gateway* issued or measured, and those that the peer asked to have repeated to
//! itself. Judging records is left to `admit`; deciding about sending, to `lib`.

use std::collections::{BTreeMap, VecDeque};

use wire::bounds::Bounds;
use wire::codec;
use wire::core::Output;
use wire::id::{Boot, Nonce, PeerId, Sequence, SessionId, UnitId};
use wire::refusal::Refusal;
use wire::session::{SESSION_VERSION, SessionBody, SessionMessage};
use wire::time::{AgeBound, Echo, Instant, Span};
use wire::trust::{Exchange, Window};

/// Sessions that are remembered as barred.
const MAX_BARRED: usize = 64;

/// A session with one unit, seen from the gateway.
#[derive(Clone, Debug)]
pub struct Session {
    id: SessionId,
    peer: PeerId,
    unit: UnitId,
    /// The nonce that records of this session have to carry.
    pub(crate) nonce: Nonce,
    /// Bound on the age of the peer's stamps.
    pub(crate) ages: AgeBound,
    /// Session records seen so far.
    pub(crate) window: Window,
    challenge_period: Span,
    sequence: Sequence,
    theirs: Option<Nonce>,
    echo: Option<Echo>,
    echoed_before: Option<Nonce>,
    established: bool,
    sent: Option<Instant>,
    telemetry: Option<(Instant, Span)>,
    /// The display's challenge that the peer last received.
    watch: Option<Nonce>,
    /// Number of revocations in the newest notice to the peer, and its time.
    told: Option<(usize, Instant)>,
}

impl Session {
    /// A session that has just opened; `nonce` is the one to announce.
    pub fn new(id: SessionId, peer: PeerId, unit: UnitId, nonce: Nonce, bounds: &Bounds) -> Self {
        Self {
            id,
            peer,
            unit,
            nonce,
            ages: AgeBound::new(bounds.echo_limit()),
            window: Window::new(bounds.replay_window, bounds.sequence_jump),
            challenge_period: Span::ms(bounds.challenge_period_ms),
            sequence: Sequence(0),
            theirs: None,
            echo: None,
            echoed_before: None,
            established: false,
            sent: None,
            telemetry: None,
            watch: None,
            told: None,
        }
    }

    /// Local handle of the session.
    pub fn id(&self) -> SessionId {
        self.id
    }

    /// Peer that the handshake authenticated.
    pub fn peer(&self) -> PeerId {
        self.peer
    }

    /// Unit of that certificate.
    pub fn unit(&self) -> UnitId {
        self.unit
    }

    /// True once the peer has used the session nonce that the gateway announced.
    pub fn established(&self) -> bool {
        self.established
    }

    /// True once the peer has announced its own session nonce: without it the peer refuses every record but Hello.
    pub fn listens(&self) -> bool {
        self.theirs.is_some()
    }

    /// Time of the last record sent to the peer.
    pub fn sent(&self) -> Option<Instant> {
        self.sent
    }

    /// Notes the values that the peer asks to have repeated. They change only the records to this peer.
    pub(crate) fn exchange(&mut self, now: Instant, exchange: Exchange) {
        self.theirs = exchange.hello.or(self.theirs);
        let current = self.echo.map(|echo| echo.nonce);
        // First sight counts: a challenge that is repeated, or overtaken by its successor, keeps its stamp.
        if current != Some(exchange.challenge) && self.echoed_before != Some(exchange.challenge) {
            self.echoed_before = current;
            self.echo = Some(Echo { nonce: exchange.challenge, seen: now.stamp() });
        }
    }

    /// A record passed the session gate: the peer knows the gateway's nonce.
    pub(crate) fn establish(&mut self) {
        self.established = true;
    }

    /// The display's challenge, if the peer listens and has not received this one yet.
    pub(crate) fn take_challenge(&mut self, watch: Option<Nonce>) -> Option<Nonce> {
        let nonce = watch.filter(|_| self.listens() && self.watch != watch);
        self.watch = nonce.or(self.watch);
        nonce
    }

    /// True if the peer is due to receive the `n` revocations now: there are more than in the last notice, or that
    /// notice is a challenge period old. Notes the notice.
    pub(crate) fn is_owed_revocations(&mut self, now: Instant, n: usize) -> bool {
        let repeat = |(known, time): (usize, Instant)| known < n || now.since(time) >= self.challenge_period;
        let expected = self.established && n > 0 && self.told.is_none_or(repeat);
        if expected {
            self.told = Some((n, now));
        }
        expected
    }

    /// Notes the unit's own report, accepted at `received` and at most `age` old then. A report that a younger one
    /// overtook has no effect.
    pub(crate) fn heard(&mut self, received: Instant, age: Span) {
        if self.telemetry_age(received).is_none_or(|known| age < known) {
            self.telemetry = Some((received, age));
        }
    }

    /// Upper bound of the age of the unit's youngest accepted report; absent before the first.
    pub fn telemetry_age(&self, now: Instant) -> Option<Span> {
        self.telemetry.map(|(received, age)| now.since(received) + age)
    }

    /// Issues `fresh()` as the new challenge when the last one has served its period. The issue is at the moment of
    /// sending: a challenge that waits after its issue makes every age look larger.
    pub fn renew(&mut self, now: Instant, fresh: impl FnOnce() -> Nonce) {
        if self.ages.issued_at().is_none_or(|time| now.since(time) >= self.challenge_period) {
            self.ages.issue(fresh(), now);
        }
    }

    /// The next record of this session.
    pub(crate) fn seal(&mut self, now: Instant, boot: Boot, body: SessionBody<'_>) -> Output {
        self.sequence = self.sequence.next();
        self.sent = Some(now);
        let outer = SessionMessage {
            version: SESSION_VERSION,
            session: self.theirs.unwrap_or(Nonce::NONE),
            boot,
            sequence: self.sequence,
            stamp: now.stamp(),
            challenge: self.ages.current().unwrap_or(Nonce::NONE),
            echo: self.echo,
            body,
        };
        Output::Record { session: self.id, bytes: codec::encode(&outer) }
    }
}

/// The open sessions, in order of their handles: at most one for each of the gateway's units.
#[derive(Clone, Debug, Default)]
pub struct Sessions {
    open: Vec<Session>,
    /// Session of each unit that has one.
    of_unit: BTreeMap<UnitId, SessionId>,
    /// Sessions whose records are refused: superseded by a newer one of the same peer, or of a peer that may have none.
    barred: VecDeque<(SessionId, PeerId)>,
}

impl Sessions {
    /// Adds a session; one that the same peer had before is barred, and given back to be ended.
    pub fn open(&mut self, session: Session) -> Option<SessionId> {
        let old = self.open.iter().position(|old| old.peer == session.peer || old.id == session.id);
        let old = old.map(|index| self.open.remove(index));
        if let Some(old) = &old {
            self.bar(old.id, old.peer);
        }
        if let Some(old) = &old {
            self.of_unit.remove(&old.unit);
        }
        let index = self.open.partition_point(|old| old.id < session.id);
        self.of_unit.insert(session.unit, session.id);
        self.open.insert(index, session);
        old.map(|old| old.id)
    }

    /// Notes a session that is not to be heard.
    pub fn bar(&mut self, id: SessionId, peer: PeerId) {
        if self.barred.len() >= MAX_BARRED {
            self.barred.pop_front();
        }
        self.barred.push_back((id, peer));
    }

    /// Removes a session; gives its peer when it still stood.
    pub fn close(&mut self, id: SessionId) -> Option<PeerId> {
        self.barred.retain(|(barred, _)| *barred != id);
        let session = self.open.remove(self.position(id)?);
        self.of_unit.remove(&session.unit);
        Some(session.peer)
    }

    /// The session with this handle, if it stands; else its peer, if known, and the reason that it is not heard.
    pub fn get_mut(&mut self, id: SessionId) -> Result<&mut Session, (Option<PeerId>, Refusal)> {
        let Some(index) = self.position(id) else { return Err(self.why_not(id)) };
        Ok(&mut self.open[index])
    }

    /// Handles of the sessions that these units have, in order.
    pub fn of_units(&self, units: &[UnitId]) -> Vec<SessionId> {
        let mut sessions: Vec<SessionId> = units.iter().filter_map(|unit| self.of_unit.get(unit).copied()).collect();
        sessions.sort_unstable();
        sessions
    }

    fn position(&self, id: SessionId) -> Option<usize> {
        self.open.binary_search_by_key(&id, |session| session.id).ok()
    }

    /// Open sessions, in order of their handles.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut Session> {
        self.open.iter_mut()
    }

    /// True if there is none.
    pub fn is_empty(&self) -> bool {
        self.open.is_empty()
    }

    fn why_not(&self, id: SessionId) -> (Option<PeerId>, Refusal) {
        let barred = self.barred.iter().find(|(barred, _)| *barred == id);
        // A session that its own peer superseded is reported as no session; one of a peer that may have none, under the
        // peer's name.
        let peer = barred.map(|(_, peer)| *peer);
        let superseded = self.open.iter().any(|session| Some(session.peer) == peer);
        let refusal = match peer.filter(|_| !superseded) {
            Some(got) => Refusal::Peer { got },
            None => Refusal::NoSession,
        };
        (peer, refusal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Peers are known for as many sessions as there is room for.
    #[test]
    fn barred_sessions_keep_peers_oldest_forgotten_first() {
        let mut sessions = Sessions::default();
        let known =
            |sessions: &mut Sessions, n: usize| sessions.get_mut(SessionId(n as u32)).err().and_then(|(peer, _)| peer);
        for n in 0..MAX_BARRED as u32 {
            sessions.bar(SessionId(n), PeerId::UNIT_B);
        }
        assert_eq!(known(&mut sessions, 0), Some(PeerId::UNIT_B));
        sessions.bar(SessionId(MAX_BARRED as u32), PeerId::UNIT_B);
        assert_eq!((known(&mut sessions, 0), known(&mut sessions, 1)), (None, Some(PeerId::UNIT_B)));
        assert_eq!(sessions.barred.len(), MAX_BARRED);
    }
}
