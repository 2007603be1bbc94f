//! The headless operator: follows a script and sees only what is displayed.
//!
//! A step becomes due at its time, or when the step before it is done; then it waits for its conditions, at most for
//! its patience, and acts. Away from safe it confirms once the display says that the command is staged. A step is done
//! when its command is executed, or stored by the unit until its time. A command that is not acknowledged in time, or
//! refused for a condition that may pass, is tried once more under a new id; no id is ever asked for or confirmed
//! twice. Signing is left to `intent`.

use serde::{Deserialize, Serialize};
use wire::command::{CommandKind, IntentHash, TimeTag};
use wire::id::{NodeId, TrackId, UnitId};
use wire::mode::Mode;
use wire::refusal::Reason;
use wire::report::ReportedTrack;
use wire::sensor::Class;
use wire::settings::Settings;
use wire::time::{Instant, Span};

use crate::eye::Eye;
use crate::intent::Basis;
use crate::life::{Giver, Life};
use crate::shown::{Shown, ShownUnit, basis_for};

/// Steps a script may have.
pub const MAX_STEPS: usize = 32;
/// Most attempts at a step.
const MAX_TRIES: u8 = 2;
/// Time between two tries.
const BETWEEN_TRIES: Span = Span::ms(500);

/// A step of the script.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScriptStep {
    /// Earliest time, in milliseconds from the console's start; absent: when the step before is done.
    #[serde(default)]
    pub at_ms: Option<u64>,
    /// Unit that the step is about.
    pub unit: UnitId,
    /// Display conditions of the step.
    #[serde(default)]
    pub when: When,
    /// The operator's action.
    #[serde(rename = "do")]
    pub action: Action,
    /// Reason; required away from safe.
    #[serde(default)]
    pub reason: String,
    /// Time limit for the conditions, in milliseconds.
    pub within_ms: u64,
    /// Time at which the unit is to carry it out; absent: at once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tag: Option<TimeTag>,
}

/// Conditions on the displayed values. A condition holds only on values displayed as fresh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct When {
    /// Mode of the unit.
    #[serde(default)]
    pub mode: Option<Mode>,
    /// A track of this kind.
    #[serde(default)]
    pub track: Option<TrackCondition>,
}

/// A track that has to be displayed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrackCondition {
    /// Class of the track.
    pub class: Class,
    /// Least confidence, permille.
    pub confidence: u16,
}

/// An action of the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Action {
    /// Stop the unit: HOLD_SAFE.
    Hold,
    /// Give authority up.
    Disarm,
    /// IDLE to READY.
    Enable,
    /// HOLD_SAFE to READY.
    Resume,
    /// Authority on the most confident fresh track of this class.
    Arm(Class),
    /// Use the authority that is displayed.
    Confirm,
    /// Revoke this identity.
    Revoke(NodeId),
    /// Set these values.
    Configure(Settings),
}

/// A request of the operator, to be carried out now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wish {
    /// Give an intent; its hash is reported to the requester ([`Operator::link_intent`], `hand::Hand::link_intent`).
    Intend {
        /// Step of the script; none where a person wishes it.
        step: Option<usize>,
        /// Unit that the intent is for.
        unit: UnitId,
        /// Kind of the command.
        kind: CommandKind,
        /// Time of its execution; none: at once.
        tag: Option<TimeTag>,
        /// Displayed values that it repeats.
        basis: Basis,
        /// Reason for the command.
        reason: String,
    },
    /// Confirm a staged command.
    Release(IntentHash),
    /// Request the revocation of an identity.
    Revoke(NodeId, Giver),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Progress {
    /// Waits for its time and conditions; `tries` lie behind it.
    Waiting { not_before: Instant, tries: u8 },
    /// A command has been given.
    Given { intent: IntentHash, released: bool, tries: u8 },
    /// Complete since then.
    Done(Instant),
}

/// The operator with the script.
#[derive(Clone, Debug)]
pub struct Operator {
    start: Instant,
    steps: Vec<(ScriptStep, Progress)>,
    confidence: u16,
    eye: Option<Eye>,
}

impl Operator {
    /// An operator who starts at `start`; where a step names no confidence, arming asks for this much. One with an eye
    /// gives no order on a track that it sees through.
    pub fn new(script: Vec<ScriptStep>, eye: Option<Eye>, confidence: u16, start: Instant) -> Self {
        let waiting = Progress::Waiting { not_before: start, tries: 0 };
        Self { start, steps: script.into_iter().map(|step| (step, waiting)).collect(), confidence, eye }
    }

    /// Reads the display and returns the requests.
    pub fn look(&mut self, shown: &Shown) -> Vec<Wish> {
        (0..self.steps.len()).filter_map(|index| self.step(index, shown)).collect()
    }

    /// Links the wish of `step` to this signed intent.
    pub fn link_intent(&mut self, step: usize, intent: IntentHash) {
        if let Some((_, progress)) = self.steps.get_mut(step)
            && let Progress::Waiting { tries, .. } = *progress
        {
            *progress = Progress::Given { intent, released: false, tries: tries + 1 };
        }
    }

    /// Time of the operator's next look without further input.
    pub fn deadline(&self, now: Instant) -> Option<Instant> {
        let due = (0..self.steps.len()).filter_map(|index| match self.steps[index].1 {
            Progress::Waiting { not_before, .. } => self.due(index).map(|due| Instant(due.0.max(not_before.0))),
            Progress::Given { .. } | Progress::Done(_) => None,
        });
        due.filter(|due| *due > now).min()
    }

    /// Time at which the step is due; `None` while the one it follows is not done.
    fn due(&self, at: usize) -> Option<Instant> {
        match (self.steps[at].0.at_ms, at.checked_sub(1)) {
            (Some(ms), _) => Some(self.start + Span::ms(ms)),
            (None, None) => Some(self.start),
            (None, Some(before)) => match self.steps[before].1 {
                Progress::Done(since) => Some(since),
                Progress::Waiting { .. } | Progress::Given { .. } => None,
            },
        }
    }

    fn step(&mut self, at: usize, shown: &Shown) -> Option<Wish> {
        let now = shown.at;
        let due = self.due(at).filter(|due| now >= *due)?;
        let judgement = Judgement { confidence: self.confidence, eye: self.eye.as_ref() };
        let (step, progress) = &mut self.steps[at];
        match *progress {
            Progress::Done(_) => None,
            Progress::Waiting { not_before, .. } if now < not_before => None,
            Progress::Waiting { tries, .. } => {
                let impatient = now.since(due) > Span::ms(step.within_ms);
                if let Action::Revoke(who) = step.action {
                    let holds = step.when.holds(shown.unit(step.unit));
                    if holds || impatient {
                        *progress = Progress::Done(now);
                    }
                    return holds.then_some(Wish::Revoke(who, Giver::Script));
                }
                let wish = if impatient && tries == 0 { None } else { step.wish(at, shown, judgement) };
                if impatient && wish.is_none() {
                    *progress = Progress::Done(now);
                }
                wish
            }
            Progress::Given { intent, released, tries } => {
                let life = shown.command(&intent).map(|command| command.life);
                if life == Some(Life::Staged) {
                    *progress = Progress::Given { intent, released: true, tries };
                    return (!released).then_some(Wish::Release(intent));
                }
                *progress = next_progress(life, now, tries).unwrap_or(*progress);
                None
            }
        }
    }
}

/// The next progress, from the state of the command; `None`: it is still under way. A command no longer displayed is
/// complete.
fn next_progress(life: Option<Life>, now: Instant, tries: u8) -> Option<Progress> {
    let Some(life) = life else { return Some(Progress::Done(now)) };
    let repeated = match life {
        Life::Requested | Life::Staged | Life::Released | Life::Sent => return None,
        // The result of a stored command at its time is no reason to ask for it again.
        Life::Stored(_) => false,
        Life::Executed | Life::RefusedByGateway(_) | Life::Expired => false,
        // These two may pass by themselves: a guard recovers, and a new intent repeats a newer nonce.
        Life::RefusedByUnit(reason) => matches!(reason, Reason::Interlock | Reason::Late),
        Life::NotAcknowledged => true,
    };
    let waiting = Progress::Waiting { not_before: now + BETWEEN_TRIES, tries };
    Some(if repeated && tries < MAX_TRIES { waiting } else { Progress::Done(now) })
}

impl ScriptStep {
    /// The intent, if all that it rests on is displayed as fresh.
    fn wish(&self, step: usize, shown: &Shown, judgement: Judgement<'_>) -> Option<Wish> {
        let unit = shown.unit(self.unit);
        if !self.when.holds(unit) {
            return None;
        }
        let kind = self.kind(unit, judgement)?;
        let basis = basis_for(kind, unit)?;
        Some(Wish::Intend {
            step: Some(step),
            unit: self.unit,
            kind,
            tag: self.tag,
            basis,
            reason: self.reason.clone(),
        })
    }

    fn kind(&self, unit: Option<&ShownUnit>, judgement: Judgement<'_>) -> Option<CommandKind> {
        match self.action {
            Action::Hold => Some(CommandKind::Hold),
            Action::Disarm => Some(CommandKind::Disarm),
            Action::Enable => Some(CommandKind::Enable),
            Action::Resume => Some(CommandKind::Resume),
            Action::Arm(class) => {
                let confidence = self.when.track.map_or(judgement.confidence, |track| track.confidence);
                let unit = unit?;
                let believed = |track: &ReportedTrack| !judgement.sees_through(unit, track);
                best(unit, TrackCondition { class, confidence }, believed).map(CommandKind::Arm)
            }
            Action::Confirm => {
                let unit = unit?;
                let held = unit.state.fresh()?.authority?.track;
                let seen_through = |track: &ReportedTrack| track.id == held && judgement.sees_through(unit, track);
                let doubted = unit.tracks.iter().any(|track| seen_through(track.get().0));
                (!doubted).then_some(CommandKind::Confirm(held))
            }
            // No command: what is asked for is the authority's own statement.
            Action::Revoke(_) => None,
            Action::Configure(settings) => Some(CommandKind::Configure(settings)),
        }
    }
}

impl When {
    /// True if all of it is displayed as fresh.
    fn holds(&self, unit: Option<&ShownUnit>) -> bool {
        let mode = unit.and_then(|unit| unit.state.fresh()).map(|state| state.mode);
        let in_mode = self.mode.is_none_or(|wanted| mode == Some(wanted));
        let seen = |wanted| unit.and_then(|unit| best(unit, wanted, |_| true)).is_some();
        in_mode && self.track.is_none_or(seen)
    }
}

/// Confidence asked for, and the eye.
#[derive(Clone, Copy)]
struct Judgement<'a> {
    confidence: u16,
    eye: Option<&'a Eye>,
}

impl Judgement<'_> {
    /// Visible in the newest image of the track; where sensors are not rendered, as if by the camera's own.
    fn sees_through(&self, unit: &ShownUnit, track: &ReportedTrack) -> bool {
        let image = unit.images.iter().map(|images| images.get().0).find(|images| images.track == track.id);
        self.eye.is_some_and(|eye| eye.sees_through(track, image.map_or(1, |image| image.scale)))
    }
}

/// The most confident track of this kind that is believed and displayed as fresh; of equals the oldest.
fn best(unit: &ShownUnit, wanted: TrackCondition, believed: impl Fn(&ReportedTrack) -> bool) -> Option<TrackId> {
    let of_kind = |track: &ReportedTrack| track.class == wanted.class && track.confidence >= wanted.confidence;
    let fits = |track: &&ReportedTrack| of_kind(track) && believed(track);
    let fresh = unit.tracks.iter().filter_map(|track| track.fresh()).filter(fits);
    fresh.max_by_key(|track| (track.confidence, core::cmp::Reverse(track.id))).map(|track| track.id)
}
