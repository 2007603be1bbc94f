//! The life of a command as the display knows it, from request to acknowledgement.
//!
//! The unit's signature outweighs the gateway's statement, and an executed command stays executed. A command that the
//! unit does not answer in time is shown so, regardless of the gateway. Verifying acknowledgements is left to `intake`.

use std::collections::VecDeque;

use wire::command::{Ack, CommandKind, IntentHash, TimeTag};
use wire::event::ShownAs;
use wire::feed::CommandStage;
use wire::id::{CommandId, UnitId};
use wire::mode::{Cause, Mode};
use wire::refusal::Reason;
use wire::report::Report;
use wire::time::{Instant, Span};

use crate::intent::Issued;

/// Most commands with tracked progress; beyond this number the oldest is no longer shown.
pub const MAX_COMMANDS: usize = 16;
/// Time limit for an answer before a command is shown as not acknowledged: a person is to learn it within a second of
/// the act.
pub const ACK_WITHIN: Span = Span::ms(900);

/// The source of an order. Both use the operator's name and key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Giver {
    /// The scenario's script.
    Script,
    /// The person at the console.
    Person,
}

impl Giver {
    /// Name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Giver::Script => "script",
            Giver::Person => "person",
        }
    }

    /// Words for a sentence.
    pub fn words(self) -> &'static str {
        match self {
            Giver::Script => "the script",
            Giver::Person => "a person",
        }
    }
}

/// Progress of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Life {
    /// Requested of the gateway.
    Requested,
    /// Waits at the gateway for its confirmation.
    Staged,
    /// The operator has confirmed the command.
    Released,
    /// On its way to the unit.
    Sent,
    /// The unit keeps it until then.
    Stored(Instant),
    /// The unit executed it.
    Executed,
    /// The unit refused it.
    RefusedByUnit(Reason),
    /// The gateway refused it, with the reason; `None` where the gateway lost its session, which voids waiting
    /// commands.
    RefusedByGateway(Option<Reason>),
    /// The command waited too long for its confirmation.
    Expired,
    /// No answer came in time.
    NotAcknowledged,
}

impl Life {
    /// True if an answer from another party is pending. A staged command away from safe waits for the operator; one
    /// towards safe never has to.
    fn pending(self, kind: CommandKind) -> bool {
        match self {
            Life::Requested | Life::Released | Life::Sent => true,
            Life::Staged => kind.towards_safe(),
            Life::Stored(_)
            | Life::Executed
            | Life::RefusedByUnit(_)
            | Life::RefusedByGateway(_)
            | Life::Expired
            | Life::NotAcknowledged => false,
        }
    }

    /// Order of the states: only a higher rank may follow. So the gateway moves a command along and never back, clears
    /// no alarm, and is outweighed by the unit's signature; an execution outweighs the refusal of a repetition.
    fn rank(self) -> u8 {
        match self {
            Life::Requested => 0,
            Life::Staged => 1,
            Life::Released => 2,
            Life::Sent => 3,
            Life::NotAcknowledged => 4,
            Life::RefusedByGateway(_) | Life::Expired => 5,
            Life::Stored(_) => 6,
            Life::RefusedByUnit(_) => 7,
            Life::Executed => 8,
        }
    }

    /// Form for the instrument plane.
    pub fn shown_as(self) -> ShownAs {
        match self {
            Life::Requested => ShownAs::Requested,
            Life::Staged => ShownAs::Staged,
            Life::Released => ShownAs::Released,
            Life::Sent => ShownAs::Sent,
            Life::Stored(_) => ShownAs::Stored,
            Life::Executed => ShownAs::Executed,
            Life::RefusedByUnit(_) => ShownAs::Refused,
            Life::RefusedByGateway(_) | Life::Expired => ShownAs::Void,
            Life::NotAcknowledged => ShownAs::NotAcknowledged,
        }
    }
}

/// A command as drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShownCommand {
    /// Id of the command.
    pub id: CommandId,
    /// Hash of the signed intent, which every later message names.
    pub intent: IntentHash,
    /// Unit that the command is for.
    pub unit: UnitId,
    /// Kind of the command.
    pub kind: CommandKind,
    /// Time of its execution; none: at once.
    pub tag: Option<TimeTag>,
    /// Source of the order.
    pub by: Giver,
    /// Progress of the command.
    pub life: Life,
    /// Beginning of the present progress.
    pub since: Instant,
    /// Time of each stage.
    pub times: Times,
}

impl ShownCommand {
    /// True if an answer to it is being waited for: another of its kind would be the same again.
    pub fn under_way(&self) -> bool {
        self.life.pending(self.kind)
    }

    /// True if it can have been carried out: a time tag counts from before the request.
    fn due(&self, now: Instant) -> bool {
        now >= self.times.requested + self.tag.map_or(Span::ZERO, |tag| tag.after)
    }
}

/// Time of each stage of a command, on the console's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Times {
    /// Asked of the gateway.
    pub requested: Instant,
    /// Time from which the command waited at the gateway.
    pub staged: Option<Instant>,
    /// Time of the operator's confirmation.
    pub released: Option<Instant>,
    /// On its way to the unit.
    pub sent: Option<Instant>,
    /// Stored by the unit until its time.
    pub stored: Option<Instant>,
    /// Answered: executed, refused or void.
    pub answered: Option<Instant>,
    /// The intended effect was seen in a report by which the unit has heard the command.
    pub effect: Option<Instant>,
}

impl Times {
    fn reached(&mut self, now: Instant, life: Life) {
        let stage = match life {
            Life::Requested | Life::NotAcknowledged => return,
            Life::Staged => &mut self.staged,
            Life::Released => &mut self.released,
            Life::Sent => &mut self.sent,
            Life::Stored(_) => &mut self.stored,
            Life::Executed | Life::RefusedByUnit(_) | Life::RefusedByGateway(_) | Life::Expired => &mut self.answered,
        };
        stage.get_or_insert(now);
    }
}

/// A command of this console.
#[derive(Clone, Copy, Debug)]
struct Given {
    shown: ShownCommand,
    /// Time of the operator's last act on the command; the answer is due from then on, whatever the gateway says.
    asked: Instant,
}

impl Given {
    fn pending(&self) -> bool {
        self.shown.life.pending(self.shown.kind)
    }
}

/// True if the unit's counter has come to the command.
fn reached(heard: CommandId, id: CommandId) -> bool {
    heard.operator == id.operator && (heard.boot, heard.sequence) >= (id.boot, id.sequence)
}

/// True if a unit that reports this is as a command of this kind leaves it.
fn brought_about(kind: CommandKind, report: &Report) -> bool {
    match kind {
        CommandKind::Hold => report.mode == Mode::HoldSafe,
        CommandKind::Disarm => report.authority.is_none(),
        CommandKind::Enable | CommandKind::Resume => report.mode == Mode::Ready,
        CommandKind::Arm(track) => report.authority.is_some_and(|held| held.track == track),
        CommandKind::Confirm(_) => report.authority.is_none() && report.cause == Cause::Acted,
        CommandKind::Configure(values) => report.settings == Some(values),
    }
}

/// The commands of this console, oldest first, at most [`MAX_COMMANDS`].
#[derive(Clone, Debug, Default)]
pub struct Commands(VecDeque<Given>);

impl Commands {
    /// Adds a command that was requested of the gateway; `by` is its source.
    pub fn requested(&mut self, now: Instant, issued: &Issued, by: Giver) {
        if self.0.len() >= MAX_COMMANDS {
            self.0.pop_front();
        }
        let Issued { id, unit, kind, tag, intent, .. } = *issued;
        let none = None;
        let times = Times {
            requested: now,
            staged: none,
            released: none,
            sent: none,
            stored: none,
            answered: none,
            effect: none,
        };
        let shown = ShownCommand { id, intent, unit, kind, tag, by, life: Life::Requested, since: now, times };
        self.0.push_back(Given { shown, asked: now });
    }

    /// Notes that a person gave this command.
    pub fn by_person(&mut self, id: CommandId) {
        self.0.iter_mut().filter(|command| command.shown.id == id).for_each(|command| command.shown.by = Giver::Person);
    }

    /// Notes the confirmation of a staged command.
    pub fn released(&mut self, now: Instant, intent: &IntentHash) {
        if self.progress(now, intent, Life::Released)
            && let Some(pending) = self.0.iter_mut().find(|command| command.shown.intent == *intent)
        {
            pending.asked = now;
        }
    }

    /// Takes the gateway's statement on the progress of a command.
    pub fn staged(&mut self, now: Instant, intent: &IntentHash, stage: CommandStage, reason: Option<Reason>) {
        let life = match stage {
            CommandStage::Staged => Life::Staged,
            CommandStage::Sent => Life::Sent,
            CommandStage::Refused => Life::RefusedByGateway(reason),
            CommandStage::Expired => Life::Expired,
        };
        self.progress(now, intent, life);
    }

    /// Id and unit of the command with this intent.
    pub fn find_by_intent(&self, intent: &IntentHash) -> Option<(CommandId, UnitId)> {
        let pending = self.0.iter().find(|command| command.shown.intent == *intent)?;
        Some((pending.shown.id, pending.shown.unit))
    }

    /// Takes a verified acknowledgement. False if it adds no information.
    pub fn acknowledged(&mut self, now: Instant, ack: &Ack) -> bool {
        let life = match (ack.refused, ack.due) {
            (Some(reason), _) => Life::RefusedByUnit(reason),
            (None, Some(due)) => Life::Stored(now + due),
            (None, None) => Life::Executed,
        };
        self.progress(now, &ack.intent, life)
    }

    /// Marks the commands left unanswered beyond the limit.
    pub fn tick(&mut self, now: Instant) {
        let overdue = |command: &&mut Given| command.pending() && now.since(command.asked) >= ACK_WITHIN;
        for given in self.0.iter_mut().filter(overdue) {
            given.shown.life = Life::NotAcknowledged;
            given.shown.since = now;
        }
    }

    /// Time at which one will next be overdue.
    pub fn changes(&self) -> Option<Instant> {
        self.0.iter().filter(|command| command.pending()).map(|command| command.asked + ACK_WITHIN).min()
    }

    /// All of them, as drawn.
    pub fn shown(&self) -> Vec<ShownCommand> {
        self.0.iter().map(|command| command.shown).collect()
    }

    fn progress(&mut self, now: Instant, intent: &IntentHash, to: Life) -> bool {
        let Some(pending) = self.0.iter_mut().find(|command| command.shown.intent == *intent) else { return false };
        if to.rank() <= pending.shown.life.rank() {
            return false;
        }
        pending.shown.life = to;
        pending.shown.since = now;
        pending.shown.times.reached(now, to);
        true
    }

    /// A report of `unit` was accepted: does it show a command's intended effect?
    pub fn reported(&mut self, now: Instant, unit: UnitId, report: &Report) {
        let Some((heard, None)) = report.last_command else { return };
        let of_unit = self.0.iter_mut().map(|command| &mut command.shown).filter(|shown| shown.unit == unit);
        let done =
            |shown: &&mut ShownCommand| shown.due(now) && reached(heard, shown.id) && brought_about(shown.kind, report);
        for shown in of_unit.filter(done) {
            if !matches!(shown.life, Life::RefusedByUnit(_) | Life::RefusedByGateway(_)) {
                shown.times.effect.get_or_insert(now);
            }
        }
    }
}
