//! The insider who holds teammate B's certificate and signing key: the paper's central finding.
//!
//! It reports B's own state like an honest teammate. It hears C's reports through the gateway's fan-out or, where C has
//! been drawn away, from C itself, which it then supervises so that C drives on. From a set time it sends C's telemetry
//! up B's session, verbatim, relabelled or re-signed. Who accepts that is up to the receivers.
//!
//! Its setup names the insider's own node (the owner of this audit chain) and B's secret.

use std::collections::BTreeMap;

use config::setup::Setup;
use ground_truth::{Action, Note};
use rand_chacha::ChaCha8Rng;
use rand_core::RngCore;
use wire::bounds::Bounds;
use wire::codec;
use wire::core::{Core, Input, Output, Side};
use wire::event::{Account, Event};
use wire::id::{Boot, Nonce, PeerId, RecordId, SessionId};
use wire::session::SessionBody;
use wire::sign::Purpose;
use wire::time::{Echo, Instant, Span};

use super::end::End;
use super::false_statement;
use super::flaw;
use super::forwarding::Forwarding;
use super::tape::{Tape, Taped};
use super::voice::{self, Voice};
use crate::opening::Opening;
use crate::outbox::Outbox;
use crate::plan::{InsiderTeammateConfig, Malformed, PlanError};
use crate::schedule::stream;

/// Most sessions at once: one up to the gateway, one down to C, and as many again while they change over.
const MAX_SESSIONS: usize = 4;

/// An insider with teammate B's credentials.
#[derive(Clone, Debug)]
pub struct InsiderTeammate {
    origin: Instant,
    config: InsiderTeammateConfig,
    forwardings: Vec<Forwarding>,
    boot: Boot,
    bounds: Bounds,
    voice: Voice,
    rng: ChaCha8Rng,
    ends: BTreeMap<SessionId, End>,
    runs: Vec<Run>,
    tape: Option<Tape>,
    next_report: Instant,
    next_grant: Instant,
    sent: u64,
    outbox: Outbox,
}

/// A run of broken records.
#[derive(Clone, Debug)]
struct Run {
    plan: Malformed,
    opening: Opening,
    taken: usize,
}

impl InsiderTeammate {
    /// An insider that starts at `now`.
    ///
    /// # Errors
    /// A magnitude of the plan outside its bounds.
    pub fn new(setup: Setup, config: InsiderTeammateConfig, now: Instant) -> Result<Self, PlanError> {
        config.check()?;
        let runs = config.malformed.iter().map(|run| {
            let opening = Opening::counted(run.step, now, run.at_ms, (run.count, run.every_ms));
            Run { plan: run.clone(), opening, taken: 0 }
        });
        Ok(Self {
            origin: now,
            forwardings: config.forwards.iter().map(|plan| Forwarding::new(plan, now)).collect(),
            boot: setup.boot,
            bounds: setup.bounds,
            voice: Voice::new(setup.key(), setup.boot, config.place, now),
            rng: stream(setup.seed, 0),
            ends: BTreeMap::new(),
            runs: runs.collect(),
            tape: config.resend.map(|plan| Tape::new(plan, now)),
            config,
            next_report: now,
            next_grant: now,
            sent: 0,
            outbox: Outbox::new(&setup, now),
        })
    }

    /// Draws from `seed` from now on.
    pub(crate) fn reseed(&mut self, seed: u64) {
        self.rng = stream(seed, 0);
    }

    fn open(&mut self, now: Instant, session: SessionId, peer: PeerId) {
        if self.ends.len() >= MAX_SESSIONS {
            return;
        }
        let period = Span::ms(self.bounds.challenge_period_ms);
        let end = End::new(peer, self.boot, period, now, &mut self.rng);
        self.ends.insert(session, end);
        self.outbox.write(now, Event::Session { peer, open: true });
        if !self.outbox.is_quiet() {
            self.hello(now, session);
        }
    }

    fn close(&mut self, now: Instant, session: SessionId) {
        if let Some(end) = self.ends.remove(&session) {
            self.outbox.write(now, Event::Session { peer: end.peer, open: false });
        }
    }

    fn hear(&mut self, now: Instant, session: SessionId, bytes: &[u8]) {
        let Some(end) = self.ends.get_mut(&session) else { return };
        let Some(body) = end.hear(now, bytes) else { return };
        if let SessionBody::Teammate(teammate) = &body
            && teammate.via == PeerId::UNIT_A
            && let Some(mode) = voice::mode_in(teammate.report)
        {
            openings(&mut self.forwardings, &mut self.runs).for_each(|opening| opening.hears(now, mode));
        }
        let report: &[u8] = match body {
            SessionBody::Report(report) if end.peer == PeerId::UNIT_C => report,
            SessionBody::Teammate(teammate) if teammate.via == PeerId::UNIT_C => teammate.report,
            SessionBody::Watch(challenge) if end.peer == PeerId::GATEWAY => return self.pass_watch(now, challenge),
            SessionBody::Report(_)
            | SessionBody::Teammate(_)
            | SessionBody::Hello(_)
            | SessionBody::Grant(_)
            | SessionBody::Watch(_)
            | SessionBody::Crop(_)
            | SessionBody::Revoked(_) => {
                return;
            }
        };
        self.forwardings.iter_mut().for_each(|forwarding| forwarding.hear(now, report));
    }

    /// Echo of the display's challenge in B's reports.
    fn watched(&self) -> Option<Echo> {
        self.ends.values().filter(|end| end.peer == PeerId::GATEWAY).filter_map(|end| end.watched).next_back()
    }

    /// C gets the display's challenge from its supervisor, so that its reports can be displayed at all.
    fn pass_watch(&mut self, now: Instant, challenge: Nonce) {
        self.sessions(PeerId::UNIT_C)
            .into_iter()
            .for_each(|session| self.say(now, session, SessionBody::Watch(challenge)));
    }

    /// Forwards the reports that have waited long enough.
    fn forward(&mut self, now: Instant) {
        for i in 0..self.forwardings.len() {
            while let Some(their_bytes) = self.forwardings[i].take(now) {
                let (form, lag) = (self.forwardings[i].form(), self.forwardings[i].lag());
                let Some(report) = self.voice.in_form(now, form, &their_bytes, self.watched()) else { continue };
                let claimed = voice::id(&report);
                for session in self.sessions(PeerId::GATEWAY) {
                    let Some(end) = self.ends.get_mut(&session) else { continue };
                    let record = end.say(now, SessionBody::Report(report.as_slice().into()), &mut self.rng);
                    self.outbox.attack(now, Action::Forward, Side::Server, &record, lag);
                    if let Some(record) = claimed {
                        self.outbox.write(now, Note::Claimed { record, off_mm: 0 });
                    }
                    self.send(session, record);
                }
            }
        }
    }

    /// Sends one period's telemetry up to the gateway.
    fn report(&mut self, now: Instant) {
        let is_first = !self.forwardings.iter().any(|forwarding| forwarding.replaces(now));
        for session in self.open_to(PeerId::GATEWAY) {
            self.hello(now, session);
        }
        let up = self.sessions(PeerId::GATEWAY);
        if is_first && !up.is_empty() {
            let mut report = self.voice.own_report(now, Nonce(self.rng.next_u64()), self.watched());
            let falsified = false_statement::falsify(&self.config, now.since(self.origin), &mut report);
            let signed = self.voice.key.sign(Purpose::Report, &codec::encode(&report));
            for session in up {
                let Some(end) = self.ends.get_mut(&session) else { continue };
                let whole = end.say(now, SessionBody::Report(signed.as_slice().into()), &mut self.rng);
                if let Some(action) = falsified.action {
                    self.own_up(now, action, (report.id(), falsified.off_mm), &whole, Span::ZERO);
                }
                if let Some(tape) = &mut self.tape {
                    tape.note(Taped { at: now, id: report.id(), whole: whole.clone(), report: signed.clone() });
                }
                self.send(session, whole);
            }
        }
    }

    /// Logs the report about to be sent, and its identity.
    fn own_up(&mut self, now: Instant, action: Action, (record, off_mm): (RecordId, u32), bytes: &[u8], delay: Span) {
        self.outbox.attack(now, action, Side::Server, bytes, delay);
        self.outbox.write(now, Note::Claimed { record, off_mm });
    }

    /// Ends the session when that is due, and repeats its records in the next.
    fn resend(&mut self, now: Instant) {
        if self.tape.as_mut().is_some_and(|tape| tape.hangs_up(now)) {
            let up: Vec<SessionId> =
                self.ends.iter().filter(|(_, end)| end.peer == PeerId::GATEWAY).map(|(session, _)| *session).collect();
            for session in up {
                self.close(now, session);
                self.outbox.put(Output::Close { session });
            }
            if self.tape.as_ref().is_some_and(Tape::restarts) {
                self.boot = Boot(self.boot.0 + 1);
                self.voice.restart(self.boot);
            }
        }
        let Some(session) = self.sessions(PeerId::GATEWAY).first().copied() else { return };
        while let Some((taped, whole)) = self.tape.as_mut().and_then(|tape| tape.take(now)) {
            let delay = now.since(taped.at);
            let Some(end) = self.ends.get_mut(&session) else { return };
            let body = SessionBody::Report(taped.report.as_slice().into());
            let record = if whole { taped.whole } else { end.say(now, body, &mut self.rng) };
            self.own_up(now, Action::Resend, (taped.id, 0), &record, delay);
            self.send(session, record);
        }
    }

    /// Sends one period's supervision down to C.
    fn grant(&mut self, now: Instant) {
        for session in self.open_to(PeerId::UNIT_C) {
            self.hello(now, session);
        }
        let lease = Span::ms(self.bounds.lease_ms);
        self.sessions(PeerId::UNIT_C).into_iter().for_each(|session| self.say(now, session, SessionBody::Grant(lease)));
    }

    /// Sends the malformed records that are due.
    fn misspeak(&mut self, now: Instant) {
        for i in 0..self.runs.len() {
            while self.runs[i].opening.take(now) {
                let run = &mut self.runs[i];
                let flaw = run.plan.flaws[run.taken % run.plan.flaws.len()];
                run.taken += 1;
                let report = codec::encode(&self.voice.own_report(now, Nonce(self.rng.next_u64()), self.watched()));
                for session in self.sessions(PeerId::GATEWAY) {
                    let Some(end) = self.ends.get_mut(&session) else { continue };
                    let bytes = flaw::record(flaw, now, end, &self.voice.key, &report, &mut self.rng);
                    self.outbox.attack(now, Action::Inject, Side::Server, &bytes, Span::ZERO);
                    self.send(session, bytes);
                }
            }
        }
    }

    /// Sessions with `peer` in which something can be said.
    fn sessions(&self, peer: PeerId) -> Vec<SessionId> {
        let ready = self.ends.iter().filter(|(_, end)| end.peer == peer && end.ready());
        ready.map(|(session, _)| *session).collect()
    }

    /// Sessions with `peer` that have not used the insider's session nonce yet.
    fn open_to(&self, peer: PeerId) -> Vec<SessionId> {
        let wanting = self.ends.iter().filter(|(_, end)| end.peer == peer && end.wants_hello());
        wanting.map(|(session, _)| *session).collect()
    }

    fn hello(&mut self, now: Instant, session: SessionId) {
        let Some(end) = self.ends.get_mut(&session) else { return };
        let bytes = end.hello(now, &mut self.rng);
        self.send(session, bytes);
    }

    fn say(&mut self, now: Instant, session: SessionId, body: SessionBody<'_>) {
        let Some(end) = self.ends.get_mut(&session) else { return };
        let bytes = end.say(now, body, &mut self.rng);
        self.send(session, bytes);
    }

    fn send(&mut self, session: SessionId, bytes: Vec<u8>) {
        self.sent += 1;
        self.outbox.put(Output::Record { session, bytes });
    }

    fn act(&mut self, now: Instant) {
        self.forward(now);
        if now >= self.next_report {
            self.report(now);
            self.next_report = next(self.next_report, self.bounds.telemetry_period_ms, now);
        }
        if now >= self.next_grant {
            self.grant(now);
            self.next_grant = next(self.next_grant, self.bounds.grant_period_ms, now);
        }
        self.misspeak(now);
        self.resend(now);
    }
}

/// Openings of everything that is planned.
fn openings<'a>(forwardings: &'a mut [Forwarding], runs: &'a mut [Run]) -> impl Iterator<Item = &'a mut Opening> {
    forwardings.iter_mut().map(|forwarding| &mut forwarding.opening).chain(runs.iter_mut().map(|run| &mut run.opening))
}

/// The next tick after `now` of a period that started at `tick`; missed ones are passed over.
fn next(tick: Instant, period_ms: u64, now: Instant) -> Instant {
    let period = Span::ms(period_ms.max(1));
    let missed = now.since(tick).0 / period.0;
    tick + Span(period.0 * (missed + 1))
}

impl Core for InsiderTeammate {
    fn handle(&mut self, now: Instant, input: &Input) {
        if let Input::Opened { session, peer } = input {
            self.open(now, *session, *peer);
        }
        if let Input::Record { session, bytes } = input {
            self.hear(now, *session, bytes);
        }
        if let Input::Closed { session } = input {
            self.close(now, *session);
        }
        if let Input::Cue { step } = input {
            openings(&mut self.forwardings, &mut self.runs).for_each(|opening| opening.cue(now, step.as_str()));
        }
        if matches!(input, Input::Finish) {
            self.outbox.write(now, Event::Count { account: Account::Sent, n: self.sent });
        }
        if !self.outbox.heed(now, input) && !self.outbox.is_quiet() {
            self.outbox.settle(openings(&mut self.forwardings, &mut self.runs), now);
            self.act(now);
        }
    }

    fn deadline(&self) -> Option<Instant> {
        if self.outbox.is_quiet() {
            return None;
        }
        let waiting = self.forwardings.iter().filter_map(Forwarding::due);
        let forwardings = self.forwardings.iter().map(|forwarding| &forwarding.opening);
        let openings = forwardings.chain(self.runs.iter().map(|run| &run.opening));
        let begins = openings.filter_map(Opening::due);
        let ready = self.ends.values().any(|end| end.peer == PeerId::GATEWAY && end.ready());
        let tape = self.tape.as_ref().and_then(|tape| tape.due(ready));
        [self.next_report, self.next_grant].into_iter().chain(waiting).chain(begins).chain(tape).min()
    }

    fn output(&mut self) -> Option<Output> {
        self.outbox.next()
    }
}
