//! The trust boundary of the telemetry link: every record that a session delivers is judged here, once, top to bottom.
//!
//! DTLS has proved the identity of the *peer* and that the bytes are unchanged. It has not proved that the record is
//! young, that it is seen for the first time in this session's life, or that its content is the peer's to say. In
//! order:
//!
//! | check | of the session record | of the report in it |
//! |---|---|---|
//! | length, schema, version | [`SessionGate`] | [`SignedReport::decode`] |
//! | direction | a unit sends Hello, Report and Crop | only a unit reports |
//! | freshness | bound by the peer's echo of our challenge | the same, by the report's own stamp |
//! | attribution | the session's peer, by the handshake | origin = peer, and the origin's signature |
//! | order | our session nonce, boot, sequence | boot and sequence of (peer, origin) |
//! | provenance | – | live product |
//!
//! Each delivered record gets one verdict: [`Admitted`], or exactly one [`Refusal`]. So, by count,
//! delivered = accepted + Σ refused. A refused record leaves only its count and the content of its
//! [`Exchange`](wire::trust::Exchange). The effect of an admitted record is left to the services behind.
//!
//! # The gap between peer and origin
//!
//! A challenge binds the clock of the peer that echoes it, no other. If a report claims another origin than the peer,
//! its stamp is of a clock that we have not bound, so the only age to judge is that of the *record that carried it*:
//! how long the peer had held the report before is unknown. Under a policy that requires origin = peer this never
//! matters, because the report is refused next. Where the policy waives it, a report of any age crosses as fresh,
//! inside an authenticated session: that is the finding this project reproduces, and the reason why the waiver is named
//! in the record's evidence from here on. And no check here can tell a report that the peer re-signed as its own from
//! the truth; that is left to consistency at the receiving unit.

use wire::bounds::Bounds;
use wire::codec;
use wire::crop::{Crop, MAX_CROP};
use wire::id::{RecordId, Sequence};
use wire::policy::{Policy, Waived};
use wire::refusal::Refusal;
use wire::session::SessionBody;
use wire::sign::Keyring;
use wire::time::Instant;
use wire::trust::{Accepted, Evidence, SessionGate, SessionRecord, SignedReport, Windows};

use crate::session::Session;

/// The boundary's rules and its memory across sessions.
#[derive(Clone, Debug)]
pub struct Boundary {
    policy: Policy,
    bounds: Bounds,
    keys: Keyring,
    /// Reports seen so far, by (peer, origin). The windows outlive a session: a reconnect must not admit an old report
    /// again.
    reports: Windows,
}

/// A record that passed the boundary.
#[derive(Debug)]
pub struct Admitted<'b> {
    /// Facts established about the session record.
    pub outer: Evidence,
    /// Content of the record.
    pub content: RecordContent<'b>,
}

/// Content of an admitted record.
#[derive(Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "it lives on the stack for one call; a box would be one allocation a record"
)]
pub enum RecordContent<'b> {
    /// A Hello: it keeps the session going and carries no word on any unit.
    Exchange(RecordId),
    /// A report of a unit, under its origin's signature.
    Report(Accepted<SignedReport<'b>>),
    /// A crop with its bytes. Images go to the display alone, which believes a crop only where a report names its hash.
    Crop(RecordId, &'b [u8]),
}

impl Admitted<'_> {
    /// Identity of the record: that of the report; of a record without a report, sequence 0 of the peer.
    pub fn record(&self) -> RecordId {
        match &self.content {
            RecordContent::Exchange(record) | RecordContent::Crop(record, _) => *record,
            RecordContent::Report(report) => report.message().report.id(),
        }
    }

    /// Facts established about the content. For a record without a report these are the facts about the session record.
    pub fn evidence(&self) -> Evidence {
        match &self.content {
            RecordContent::Exchange(_) | RecordContent::Crop(..) => self.outer,
            RecordContent::Report(report) => report.evidence(),
        }
    }

    /// All checks that were passed over on the way.
    pub fn waived(&self) -> Waived {
        self.outer.waived.union(self.evidence().waived)
    }
}

impl Boundary {
    /// A boundary under this policy.
    pub fn new(policy: Policy, bounds: Bounds, keys: Keyring) -> Self {
        let reports = Windows::new(bounds.replay_window, bounds.sequence_jump);
        Self { policy, bounds, keys, reports }
    }

    /// Judges one record that `session` delivered at `now`.
    pub fn admit<'b>(&mut self, session: &mut Session, now: Instant, bytes: &'b [u8]) -> Result<Admitted<'b>, Refusal> {
        let (record, evidence) = self.session_record(session, now, bytes)?.into_parts();
        let content = match record.outer.body {
            // Reports count from 1, so 0 is never one of theirs.
            SessionBody::Hello(_) => RecordContent::Exchange(RecordId { sequence: Sequence(0), ..record.id() }),
            SessionBody::Crop(bytes) => {
                codec::decode::<Crop>(bytes, MAX_CROP)?;
                RecordContent::Crop(RecordId { sequence: Sequence(0), ..record.id() }, bytes)
            }
            SessionBody::Report(report) => RecordContent::Report(self.report(session, evidence, report)?),
            // Supervision, teammates' reports, the display's challenges and revocations are the gateway's to give, not
            // a unit's.
            SessionBody::Grant(_) | SessionBody::Teammate(_) | SessionBody::Watch(_) | SessionBody::Revoked(_) => {
                return Err(Refusal::Peer { got: session.peer() });
            }
        };
        Ok(Admitted { outer: evidence, content })
    }

    /// The session record: length, schema, freshness, session, sequence.
    fn session_record<'b>(
        &self,
        session: &mut Session,
        now: Instant,
        bytes: &'b [u8],
    ) -> Result<Accepted<SessionRecord<'b>>, Refusal> {
        let mut gate = SessionGate {
            policy: &self.policy,
            peer: session.peer(),
            session: session.nonce,
            ages: &mut session.ages,
            window: &mut session.window,
            freshness: self.bounds.freshness(),
            echo_limit: self.bounds.echo_limit(),
        };
        let (exchange, verdict) = gate.admit(now, bytes);
        if let Some(exchange) = exchange {
            session.exchange(now, exchange);
        }
        let record = verdict?;
        session.establish();
        Ok(record)
    }

    /// The report in an accepted session record: length, schema, freshness, origin, signature, sequence, provenance.
    fn report<'b>(
        &mut self,
        session: &Session,
        outer: Evidence,
        bytes: &'b [u8],
    ) -> Result<Accepted<SignedReport<'b>>, Refusal> {
        let (policy, peer) = (&self.policy, session.peer());
        let decoded = SignedReport::decode(outer.received, bytes)?;
        let age = decoded.age(peer, &session.ages, outer)?;
        decoded
            .fresh(policy, age, self.bounds.freshness(), self.bounds.echo_limit())?
            .by_origin(policy, peer, &self.keys)?
            .from_origin(policy, peer, &mut self.reports)?
            .accept(policy)
    }
}
