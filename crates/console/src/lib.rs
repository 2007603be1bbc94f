//! The supervisory console: messages accepted by the gateway, shown with their present age, and the operator's signed
//! intents.
//!
//! [`Console`] is a deterministic core: feed → [`intake`] → [`model`] → [`shown::Shown`], which is drawn ([`text`]),
//! reported to the oracle ([`display`]) and seen by the scripted [`operator`] and by a person, whose acts arrive as
//! inputs ([`act`], [`hand`]). The orders of both are signed in [`intent`]. It knows no transport, and cannot send a
//! command: it asks the gateway to.

pub mod act;
pub mod age;
pub mod alarm;
pub mod alarms;
mod aloft;
pub mod banner;
pub mod causes;
pub mod display;
pub mod ended;
pub mod eye;
mod finding;
#[cfg(feature = "gui")]
pub mod gui;
pub mod hand;
pub mod history;
pub mod host;
pub mod images;
pub mod intake;
pub mod intent;
pub mod interlock;
pub mod life;
pub mod model;
#[cfg(feature = "process")]
pub mod moment;
pub mod operator;
mod orders;
pub mod page;
mod picture;
#[cfg(feature = "process")]
pub mod process;
mod retrace;
pub mod shown;
pub mod sidecar;
pub mod silence;
pub mod site;
pub mod skew;
pub mod sound;
#[cfg(feature = "process")]
pub mod source;
pub mod text;
pub mod trace;
pub mod watch;
pub mod wording;

use std::collections::VecDeque;

use config::setup::{NoChannel, Setup};
use serde::{Deserialize, Serialize};
use wire::account::Accounts;
use wire::audit::Journal;
use wire::bus::Sender;
use wire::command::Request;
use wire::core::{Core, Input, Output, Topic};
use wire::event::{Event, Interface};
use wire::feed::{AcceptedReport, Feed};
use wire::id::{NodeId, PeerId, UnitId};
use wire::person::Role;
use wire::refusal::Refusal;
use wire::roster::RosterError;
use wire::sign::Secret;
use wire::time::{Instant, Span};

use crate::display::{REPEAT, Witness};
use crate::eye::Eye;
use crate::intake::Intake;
use crate::intent::Issuer;
use crate::model::{Model, Station};
use crate::operator::{MAX_STEPS, Operator, ScriptStep};
use crate::shown::{Marks, Shown};
use crate::watch::ChallengeClock;

/// Least time between two pictures in words: with each report that comes there is one.
const DRAWN: Span = Span::ms(50);

/// Configuration of a console.
#[derive(Clone, Debug, Serialize, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct ConsoleConfig {
    /// Units that are displayed once something of theirs is accepted, in this order.
    pub units: Vec<UnitId>,
    /// Participating units: one from which no report was ever accepted is shown as silent.
    pub awaited: Vec<UnitId>,
    /// The operator.
    pub operator: NodeId,
    /// The operator's Ed25519 secret.
    pub operator_secret: Secret,
    /// Permissions of the person at the window. The script has the operator's own permissions and needs only an issuer:
    /// a viewer's console has none.
    #[serde(default)]
    pub role: Role,
    /// The operator's script, at most [`MAX_STEPS`] steps.
    #[serde(default)]
    pub script: Vec<ScriptStep>,
    /// Eye of the script's operator; without it the script uses the machine.
    #[serde(default)]
    pub eye: Option<Eye>,
    /// Revocations that the authority signed in advance, by the revoked node.
    #[serde(default)]
    pub revocations: Vec<(NodeId, Vec<u8>)>,
    /// True to give the display as text.
    #[serde(default)]
    pub text: bool,
}

/// A console cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConsoleError {
    /// The setup lacks a channel.
    #[error(transparent)]
    NoChannel(#[from] NoChannel),
    /// The run's identities are no table, or a unit is not in it.
    #[error(transparent)]
    Roster(#[from] RosterError),
    /// The script is too long.
    #[error("a script of at most {MAX_STEPS} steps expected, got {0}")]
    Script(usize),
}

/// The console's core.
#[derive(Clone, Debug)]
pub struct Console {
    intake: Intake,
    /// Absent where a recording is followed: then the challenges are those that were made.
    watch: Option<ChallengeClock>,
    model: Model,
    witness: Witness,
    operator: Operator,
    /// Absent for a viewer and in a replay, where no signing is possible.
    issuer: Option<Issuer>,
    requests: Sender,
    /// Revocations that the operator may use, and the nodes already revoked.
    revocations: Vec<(NodeId, Vec<u8>)>,
    revoked: Vec<NodeId>,
    accounts: Accounts,
    journal: Journal,
    text: bool,
    drawn: Option<Instant>,
    next: Instant,
    /// Time at which the last shown picture changes without input.
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
        let keys = setup.keyring()?;
        keys.cast("units", config.units.iter().map(|unit| unit.node()))?;
        let gate = setup.gate(Topic::Feed, setup.bounds.freshness())?;
        let ablation = (!setup.policy.is_full()).then(|| setup.policy.name.clone());
        let station = Station {
            started: now,
            operator: config.operator,
            role: config.role,
            marks: Marks { ablation, waived: wording::waived(&setup.policy), ..Marks::default() },
            bounds: setup.bounds,
            revocable: config.revocations.iter().map(|(node, _)| (*node, false)).collect(),
            awaited: config.awaited,
        };
        let issuer = || Issuer::new(setup.key_of(&config.operator_secret), config.operator, setup.boot);
        let operator = Operator::new(config.script, config.eye, setup.bounds.designation_confidence, now);
        let mut console = Self {
            intake: Intake::new(setup.policy.clone(), setup.bounds, keys, gate, &config.units),
            watch: Some(ChallengeClock::new(setup.secret.clone(), setup.boot, &setup.bounds, now)),
            model: Model::new(&config.units, station, &setup.policy),
            witness: Witness::default(),
            look: operator.deadline(now),
            operator,
            issuer: (config.role > Role::View).then(issuer),
            requests: setup.sender(Topic::Intents)?,
            revocations: config.revocations,
            revoked: Vec::new(),
            accounts: Accounts::default(),
            journal: Journal::new(setup.node, setup.boot, Some(setup.key())),
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

    /// The picture at `now`.
    pub fn shown(&self, now: Instant) -> Shown {
        self.model.shown(now)
    }

    /// The unit that is displayed first.
    pub fn first(&self) -> UnitId {
        self.model.first()
    }

    /// The counters so far.
    pub fn accounts(&self) -> &Accounts {
        &self.accounts
    }

    fn feed(&mut self, now: Instant, bytes: &[u8]) {
        let interface = Interface::Bus(Topic::Feed);
        let message = match self.intake.feed(now, bytes) {
            Ok(accepted) => *accepted.message(),
            Err(refusal) => return self.refuse(now, interface, &refusal),
        };
        self.model.fed(now);
        match message {
            Feed::Accepted(report) => return self.report(now, interface, &report),
            Feed::Refused(reason, peer, counted) => self.model.refused_there(now, reason, peer, counted),
            Feed::Session(peer, open) => self.model.session(now, peer, open),
            Feed::Command(intent, stage, why) => self.model.commands_mut().staged(now, &intent, stage, why),
            Feed::Acknowledged(ack) => self.acknowledged(now, ack),
            Feed::SessionsLost(counted) => self.model.sessions_lost(PeerId::GATEWAY, None, counted),
            Feed::Crop(unit, crop) => {
                if let Err(refusal) = self.model.crop(unit, crop) {
                    return self.refuse(now, interface, &refusal);
                }
            }
        }
        self.accounts.accepted(interface);
    }

    /// A message that carries a report gets one verdict for both.
    fn report(&mut self, now: Instant, interface: Interface, message: &AcceptedReport<'_>) {
        match self.intake.report(now, message) {
            Ok(accepted) => {
                let watched = accepted.message().report.watched;
                let seen = watched.and_then(|echo| Some((self.intake.sent(message.unit, echo.nonce)?, echo.seen)));
                self.model.report(&accepted, message.via, message.waived, seen);
                if let Some((heard, _)) = accepted.message().report.last_command
                    && let Some(issuer) = &mut self.issuer
                {
                    // Only from an accepted report: a counter that anyone could state would lead the next ids beyond
                    // the step that the unit accepts.
                    issuer.skip_past(message.unit, heard);
                }
                self.accounts.accepted(interface);
            }
            Err(refusal) => {
                self.refuse(now, interface, &refusal);
            }
        }
    }

    fn acknowledged(&mut self, now: Instant, bytes: &[u8]) {
        match self.intake.acknowledgement(now, bytes, |intent| self.model.commands().find_by_intent(intent)) {
            Ok(accepted) => {
                self.accounts.accepted(Interface::Acks);
                let ack = *accepted.message();
                if self.model.commands_mut().acknowledged(now, &ack) {
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
        if let Some(challenge) = self.watch.as_mut().and_then(|watch| watch.due(now)).filter(|_| !self.quiet) {
            self.intake.challenge(challenge, now);
            self.request(now, &Request::Watch(challenge));
            for at in 0..self.revoked.len() {
                self.revoke(now, self.revoked[at]);
            }
        }
        self.model.commands_mut().tick(now);
        let mut shown = self.model.shown(now);
        self.model.watch(&mut shown);
        if let Some((order, why)) = self.model.hand().lapse(&shown) {
            self.note(now, Event::Lapsed { by: shown.operator, order, why });
            shown = self.model.shown(now);
        }
        if self.wishes(now, &shown) {
            shown = self.model.shown(now);
        }
        for event in self.witness.events_due(&shown) {
            self.note(now, event);
        }
        self.draw(&shown);
        self.changes = self.model.changes(now);
        self.look = self.operator.deadline(now);
    }

    fn draw(&mut self, shown: &Shown) {
        if self.text && self.drawn.is_none_or(|time| shown.at.since(time) >= DRAWN) {
            self.drawn = Some(shown.at);
            self.out.push_back(Output::Text { text: text::lines(shown), picture: picture::line(shown) });
        }
    }

    fn finish(&mut self, now: Instant) {
        self.accounts.close(now, &mut self.journal, &mut self.out);
        self.journal.sign(now, &mut self.out);
    }

    fn refuse(&mut self, now: Instant, interface: Interface, refusal: &Refusal) {
        self.model.refused_here(now, refusal.reason());
        if let Some(event) = self.accounts.refused(interface, None, refusal) {
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
            Input::Act { bytes } => self.act(now, bytes),
            Input::HostWait { wait } => self.model.host_waited(now, *wait),
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
            | Input::Guest { .. }
            | Input::Cue { .. } => return,
        }
        self.refresh(now);
    }

    fn deadline(&self) -> Option<Instant> {
        [Some(self.next), self.watch.as_ref().map(ChallengeClock::next), self.changes, self.look]
            .into_iter()
            .flatten()
            .min()
    }

    fn output(&mut self) -> Option<Output> {
        self.out.pop_front()
    }
}
