//! The supervisory console: what the gateway accepted, as it may be believed by now, and the operator's signed intents.
//!
//! [`Console`] is a deterministic core: feed → [`intake`] → [`model`] → [`model::Shown`], which is drawn ([`text`]), told to the
//! oracle ([`display`]) and seen by the scripted [`operator`], whose intents are signed in [`intent`]. It knows nothing
//! of how anything is transported, and cannot send a command: it asks the gateway to.

pub mod age;
pub mod display;
pub mod intake;
pub mod intent;
pub mod life;
pub mod model;
pub mod operator;
#[cfg(feature = "process")]
pub mod process;
pub mod text;
pub mod watch;

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use wire::account::Accounts;
use wire::audit::Journal;
use wire::bus::Sender;
use wire::codec;
use wire::command::Request;
use wire::core::{Core, Input, Output, Topic};
use wire::event::{Event, Interface};
use wire::feed::{AcceptedReport, Feed};
use wire::id::{NodeId, PeerId, UnitId, WorldId};
use wire::refusal::Refusal;
use wire::setup::{NoChannel, Secret, Setup};
use wire::sign::Key;
use wire::time::Instant;

use crate::display::{REPEAT, Witness};
use crate::intake::Intake;
use crate::intent::Issuer;
use crate::model::{Model, Shown};
use crate::operator::{MAX_STEPS, Operator, Step, Wish};
use crate::watch::Watch;

/// What a console is for.
#[derive(Clone, Debug, Serialize, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct ConsoleConfig {
    /// Units that are displayed, in this order.
    pub units: Vec<UnitId>,
    /// The operator.
    pub operator: NodeId,
    /// The operator's Ed25519 secret.
    pub operator_secret: Secret,
    /// What the operator does, at most [`MAX_STEPS`] steps.
    #[serde(default)]
    pub script: Vec<Step>,
    /// Revocations that the authority signed in advance, by whose standing they end.
    #[serde(default)]
    pub revocations: Vec<(NodeId, Vec<u8>)>,
    /// Whether to give the display as text.
    #[serde(default)]
    pub text: bool,
}

/// A console cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConsoleError {
    /// The setup lacks a channel.
    #[error(transparent)]
    NoChannel(#[from] NoChannel),
    /// The script is too long.
    #[error("a script of at most {MAX_STEPS} steps expected, got {0}")]
    Script(usize),
}

/// The console's core.
#[derive(Debug)]
pub struct Console {
    intake: Intake,
    watch: Watch,
    model: Model,
    witness: Witness,
    operator: Operator,
    issuer: Issuer,
    requests: Sender,
    /// Revocations that the operator may use, and whose were used.
    revocations: Vec<(NodeId, Vec<u8>)>,
    revoked: Vec<NodeId>,
    accounts: Accounts,
    journal: Journal,
    /// The mark of a run whose policy waives something.
    ablation: Option<String>,
    text: bool,
    drawn: Option<Instant>,
    next: Instant,
    /// What was shown last changes by itself then.
    changes: Option<Instant>,
    look: Option<Instant>,
    quiet: bool,
    out: VecDeque<Output>,
}

impl Console {
    /// A console that starts at `now`; the script's times count from there.
    pub fn new(setup: Setup, config: ConsoleConfig, now: Instant) -> Result<Self, ConsoleError> {
        if config.script.len() > MAX_STEPS {
            return Err(ConsoleError::Script(config.script.len()));
        }
        let gate = setup.gate(Topic::Feed, setup.bounds.freshness())?;
        let ablation = (!setup.policy.is_full()).then(|| setup.policy.name.clone());
        let operator = Operator::new(config.script, setup.bounds.designation_confidence, now);
        let mut console = Self {
            intake: Intake::new(setup.policy.clone(), setup.bounds, setup.keyring(), gate, &config.units),
            watch: Watch::new(setup.secret.clone(), setup.boot, &setup.bounds, now),
            model: Model::new(&config.units, &setup.bounds, &setup.policy),
            witness: Witness::default(),
            look: operator.deadline(now),
            operator,
            issuer: Issuer::new(Key::from_bytes(&config.operator_secret.0), config.operator, setup.boot),
            requests: setup.sender(Topic::Intents)?,
            revocations: config.revocations,
            revoked: Vec::new(),
            accounts: Accounts::default(),
            journal: Journal::new(setup.node, setup.boot, Some(setup.key())),
            ablation,
            text: config.text,
            drawn: None,
            next: now + REPEAT,
            changes: None,
            quiet: false,
            out: VecDeque::new(),
        };
        console.note(now, Event::Started);
        Ok(console)
    }

    /// The same console in a forked world. No part of its state is bound to a world.
    #[must_use]
    pub fn fork(&self, _world: WorldId) -> Self {
        Self {
            intake: self.intake.clone(),
            watch: self.watch.clone(),
            model: self.model.clone(),
            witness: self.witness.clone(),
            operator: self.operator.clone(),
            issuer: self.issuer.fork(),
            requests: self.requests.clone(),
            revocations: self.revocations.clone(),
            revoked: self.revoked.clone(),
            accounts: self.accounts.clone(),
            journal: self.journal.fork(),
            ablation: self.ablation.clone(),
            text: self.text,
            drawn: self.drawn,
            next: self.next,
            changes: self.changes,
            look: self.look,
            quiet: self.quiet,
            out: self.out.clone(),
        }
    }

    /// What is drawn at `now`.
    pub fn shown(&self, now: Instant) -> Shown {
        self.model.shown(now)
    }

    /// What has been counted so far.
    pub fn accounts(&self) -> &Accounts {
        &self.accounts
    }

    fn feed(&mut self, now: Instant, bytes: &[u8]) {
        let at = Interface::Bus(Topic::Feed);
        let message = match self.intake.feed(now, bytes) {
            Ok(accepted) => *accepted.message(),
            Err(refusal) => return self.refuse(now, at, &refusal),
        };
        match message {
            Feed::Accepted(report) => return self.report(now, at, &report),
            Feed::Refused(reason, _) => self.model.refused(reason),
            Feed::Session(peer, open) => self.model.session(peer, open),
            Feed::Command(intent, stage) => self.model.commands_mut().staged(now, &intent, stage),
            Feed::Acknowledged(ack) => self.acknowledged(now, ack),
            Feed::SessionsLost(counted) => self.model.sessions_lost(PeerId::GATEWAY, None, counted),
        }
        self.accounts.accepted(at);
    }

    /// A message that carries a report gets one verdict for both.
    fn report(&mut self, now: Instant, at: Interface, message: &AcceptedReport<'_>) {
        match self.intake.report(now, message) {
            Ok(accepted) => {
                self.model.report(&accepted, message.via, message.waived);
                if let Some((heard, _)) = accepted.message().report.last_command {
                    self.issuer.after(message.unit, heard);
                }
                self.accounts.accepted(at);
            }
            Err(refusal) => {
                self.model.refused(refusal.reason());
                self.refuse(now, at, &refusal);
            }
        }
    }

    fn acknowledged(&mut self, now: Instant, bytes: &[u8]) {
        match self.intake.acknowledgement(now, bytes, |intent| self.model.commands().given(intent)) {
            Ok(accepted) => {
                self.accounts.accepted(Interface::Acks);
                let ack = *accepted.message();
                if self.model.commands_mut().acknowledged(now, &ack.intent, ack.refused) {
                    self.note(now, Event::Acknowledged { command: ack.id, refused: ack.refused });
                }
            }
            Err(refusal) => self.refuse(now, Interface::Acks, &refusal),
        }
    }

    /// After every input: draw, tell, and let the operator look.
    fn refresh(&mut self, now: Instant) {
        if now >= self.next {
            self.next = now + REPEAT;
        }
        if let Some(challenge) = self.watch.due(now).filter(|_| !self.quiet) {
            self.intake.challenge(challenge, now);
            self.request(now, &Request::Watch(challenge));
            for at in 0..self.revoked.len() {
                self.revoke(now, self.revoked[at]);
            }
        }
        self.model.commands_mut().tick(now);
        let shown = self.model.shown(now);
        if !self.quiet {
            for wish in self.operator.look(&shown) {
                self.carry_out(now, wish);
            }
        }
        for event in self.witness.tell(&self.model.shown(now)) {
            self.note(now, event);
        }
        self.draw(&shown);
        self.changes = self.model.changes(now);
        self.look = self.operator.deadline(now);
    }

    fn carry_out(&mut self, now: Instant, wish: Wish) {
        match wish {
            Wish::Intend { step, unit, kind, nonce, reason } => {
                let issued = self.issuer.intent(unit, nonce, kind, &reason);
                self.operator.given(step, issued.intent);
                self.model.commands_mut().requested(now, &issued);
                self.note(now, Event::Intended { command: issued.id, kind });
                self.request(now, &Request::Stage(issued.bytes.as_slice().into()));
            }
            Wish::Release(intent) => {
                let Some((id, _)) = self.model.commands().given(&intent) else { return };
                let confirmation = self.issuer.confirmation(id, intent);
                self.model.commands_mut().released(now, &intent);
                self.request(now, &Request::Release(confirmation.as_slice().into()));
            }
            Wish::Revoke(who) => {
                self.revoked.push(who);
                self.revoke(now, who);
            }
        }
    }

    /// Asks for `who` to be struck; that is answered by nobody, so it is asked for again with each challenge.
    fn revoke(&mut self, now: Instant, who: NodeId) {
        if let Some((_, signed)) = self.revocations.iter().find(|(of, _)| *of == who).cloned() {
            self.request(now, &Request::Revoke(signed.as_slice().into()));
        }
    }

    fn request(&mut self, now: Instant, request: &Request<'_>) {
        let bytes = self.requests.seal(now, &codec::encode(request));
        self.out.push_back(Output::Bus { topic: Topic::Intents, bytes });
    }

    fn draw(&mut self, shown: &Shown) {
        if self.text && self.drawn.is_none_or(|at| shown.at.since(at) >= REPEAT) {
            self.drawn = Some(shown.at);
            self.out.push_back(Output::Text { text: text::lines(shown, self.ablation.as_deref()) });
        }
    }

    fn finish(&mut self, now: Instant) {
        self.accounts.close(now, &mut self.journal, &mut self.out);
        self.journal.sign(now, &mut self.out);
    }

    fn refuse(&mut self, now: Instant, at: Interface, refusal: &Refusal) {
        if let Some(event) = self.accounts.refused(at, None, refusal) {
            self.note(now, event);
        }
    }

    fn note(&mut self, now: Instant, event: Event) {
        self.journal.write(now, event, &mut self.out);
    }
}

impl Core for Console {
    fn handle(&mut self, now: Instant, input: &Input) {
        match input {
            Input::Bus { topic: Topic::Feed, bytes } => self.feed(now, bytes),
            Input::Timeout => {}
            Input::Quiesce => self.quiet = true,
            Input::Finish => return self.finish(now),
            Input::Bus { .. }
            | Input::Opened { .. }
            | Input::Record { .. }
            | Input::Closed { .. }
            | Input::Published { .. }
            | Input::SessionLost
            | Input::Datagram { .. }
            | Input::Stream { .. }
            | Input::Audit { .. }
            | Input::Cue { .. } => return,
        }
        self.refresh(now);
    }

    fn deadline(&self) -> Option<Instant> {
        [Some(self.next), Some(self.watch.next()), self.changes, self.look].into_iter().flatten().min()
    }

    fn output(&mut self) -> Option<Output> {
        self.out.pop_front()
    }
}
