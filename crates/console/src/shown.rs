//! The picture of one instant: all that views, the operator and the oracle see of the model.
//!
//! A value that ages is here only as a [`Labelled`] one. Making it is left to `model`.

use std::collections::VecDeque;
use std::sync::Arc;

use config::suite::Suite;
use wire::bounds::Bounds;
use wire::command::{CommandKind, IntentHash, ReportHash};
use wire::event::Freshness;
use wire::id::{Boot, NodeId, Nonce, PeerId, RecordId, UnitId};
use wire::measured::Measured;
use wire::mode::{Cause, Guards, Mode};
use wire::motion::ReportedMotion;
use wire::person::{Alarm, Role};
use wire::policy::Waived;
use wire::refusal::Reason;
use wire::report::{ReportedAuthority, ReportedContact, ReportedTrack};
use wire::sensor::{Pose, ProductMode};
use wire::settings::Settings;
use wire::time::{Instant, Span};

use crate::act::{Answer, Prepared};
use crate::age::{AgeLimits, Labelled};
use crate::alarm::{LedTo, ShownGroup};
use crate::history::Past;
use crate::images::Images;
use crate::intent::Basis;
use crate::life::ShownCommand;
use crate::skew::Rate;
use crate::sound::Sound;
use crate::trace::Trace;
use crate::wording;

/// State that a unit reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct State {
    /// Mode of its machine.
    pub mode: Mode,
    /// Cause of the last transition.
    pub cause: Cause,
    /// Guards that failed.
    pub failing: Guards,
    /// Measured values of the guards.
    pub measured: Measured,
    /// Settings by an operator, where they replace the platform's own values.
    pub settings: Option<Settings>,
    /// Authority, while it was held.
    pub authority: Option<ReportedAuthority>,
    /// Forward speed, mm/s.
    pub speed_mm_s: i32,
    /// Nonce that an intent has to repeat.
    pub nonce: Nonce,
    /// Share of the route driven, permille.
    pub progress: u16,
    /// Height, velocity, charge and attitude of a unit that leaves the ground.
    pub motion: Option<ReportedMotion>,
    /// Contact by the unit's plan, where the link has one.
    pub contact: Option<ReportedContact>,
}

impl State {
    /// Sensors of the unit.
    pub fn suite(&self) -> Suite {
        Suite::from_motion(self.motion.as_ref())
    }

    /// Reason for its mode: a sentence, and a detail that may be empty.
    pub fn why(&self, bounds: &Bounds) -> [String; 2] {
        wording::cause((self.cause, self.mode), self.suite(), self.measured.teammate(), bounds)
    }

    /// Cause of the last transition, as logs name it.
    pub fn cause(&self) -> String {
        self.suite().cause(self.cause)
    }
}

/// Origin of a report, apart from its age.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The unit's own session brought it, and every check was made.
    Direct,
    /// Another peer's session brought it.
    Relayed(PeerId),
    /// A check was waived on its way.
    Unverified,
    /// The content was not made now by the platform's sensors.
    NotLive(ProductMode),
}

impl Origin {
    /// Words for it; none of them is about how old it is.
    pub fn words(self) -> String {
        match self {
            Origin::Direct => "DIRECT".to_owned(),
            Origin::Relayed(via) => format!("VIA {via}"),
            Origin::Unverified => "UNVERIFIED".to_owned(),
            Origin::NotLive(ProductMode::Synthetic) => "SYNTHETIC".to_owned(),
            Origin::NotLive(ProductMode::Replay) => "RECORDED".to_owned(),
            Origin::NotLive(ProductMode::Live) => "NOT LIVE".to_owned(),
        }
    }
}

/// A track that the unit no longer reports, as it was reported last.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LostTrack {
    /// Boot of the unit in which it got its number.
    pub boot: Boot,
    /// Track as last reported; labelled lost, however young.
    pub track: Labelled<ReportedTrack>,
    /// Time at which it was first missing.
    pub since: Instant,
}

/// A unit as drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShownUnit {
    /// Number of the unit.
    pub unit: UnitId,
    /// The report behind it.
    pub report: RecordId,
    /// Hash of its signed bytes.
    pub hash: ReportHash,
    /// Peer of the session that brought it.
    pub via: PeerId,
    /// Checks that were waived on its way.
    pub waived: Waived,
    /// Origin of the report.
    pub origin: Origin,
    /// Time at which the shown mode was first shown.
    pub since: Instant,
    /// State by the report.
    pub state: Labelled<State>,
    /// Place; older than the state by the age of its localisation.
    pub pose: Labelled<Pose>,
    /// Tracks; each older than the state by its own age.
    pub tracks: Vec<Labelled<ReportedTrack>>,
    /// Images of its tracks.
    pub images: Vec<Labelled<Images>>,
    /// Tracks that it no longer reports, oldest first, until they are taken note of or reported again.
    pub lost: Vec<LostTrack>,
    /// Lost tracks for which there was no room.
    pub lost_more: u32,
    /// Rate of its clock against the console's, where known: ages rest on it.
    pub clock: Option<Rate>,
    /// Its reports over time.
    pub trace: Trace,
}

impl ShownUnit {
    /// The settings in force: an operator's, else the platform's own.
    pub fn settings(&self, bounds: &Bounds) -> Settings {
        self.state.get().0.settings.unwrap_or(Settings::from_bounds(bounds))
    }

    /// Number of tracks with one of these labels.
    pub fn tracks_labelled(&self, labels: &[Freshness]) -> u8 {
        self.tracks.iter().filter(|t| labels.contains(&t.freshness())).count() as u8
    }
}

/// A session at the gateway as drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShownLink {
    /// Peer of the session.
    pub peer: PeerId,
    /// True if it stands, by the last message of the gateway and as old as that.
    pub open: Labelled<bool>,
    /// Time of the last change.
    pub since: Instant,
    /// Time since a report that it brought was accepted.
    pub heard: Option<Span>,
}

/// Refusals for one reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShownRefusals {
    /// Reason of the refusals.
    pub reason: Reason,
    /// Peer of the session that brought them, where known.
    pub peer: Option<PeerId>,
    /// Refused by the console itself, not by the gateway.
    pub here: bool,
    /// Number of refusals.
    pub n: u64,
    /// The last one.
    pub last: Instant,
}

/// Marks that every picture must carry unless it is one of a live run under the full policy. (That it is a simulation
/// need not be said here: there is no other platform.)
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Marks {
    /// A replay: no commands are possible.
    pub replay: bool,
    /// Start of the run's time on the console's clock, in a recording. Times are then given as times of the run.
    pub began: Option<Instant>,
    /// The name of a policy that waives something.
    pub ablation: Option<String>,
    /// The checks that it waives, in words.
    pub waived: String,
    /// Longest wait of a service for a core in the last ten seconds, where it is worth showing.
    pub host_wait: Option<Span>,
    /// Reason for which the shown recording is no evidence; never set on a live picture.
    pub invalid: Option<String>,
}

/// Everything that is drawn at one instant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shown {
    /// Time, on the console's clock.
    pub at: Instant,
    /// Time at which the console started.
    pub started: Instant,
    /// The node that issues the commands.
    pub operator: NodeId,
    /// Permissions of the person here.
    pub role: Role,
    /// Marks of the picture as a whole.
    pub marks: Marks,
    /// The platform's bounds.
    pub bounds: Bounds,
    /// Age limits behind the labels.
    pub limits: AgeLimits,
    /// Units that have been heard, in the configured order.
    pub units: Vec<ShownUnit>,
    /// Units that have not.
    pub silent: Vec<UnitId>,
    /// Sessions at the gateway.
    pub links: Vec<ShownLink>,
    /// Refusals by reason and peer. The gateway tells of some at once and of how many there were with each, so in a
    /// flood the numbers are at most a second or two behind, and exact after it.
    pub refusals: Vec<ShownRefusals>,
    /// Peers with cut or taken-over sessions at the broker, with counts: an alarm.
    pub losses: Vec<(PeerId, u32)>,
    /// Commands of this console, oldest first.
    pub commands: Vec<ShownCommand>,
    /// Identities that the operator can have revoked, and whether that was requested.
    pub revocable: Vec<(NodeId, bool)>,
    /// Alarms, one group a cause: those put aside last, the most urgent first.
    pub alarms: Vec<ShownGroup>,
    /// Alarms for which there was no room.
    pub alarms_more: u32,
    /// Alarms raised in the last hour; the limit is [`crate::sound::LIMIT_AN_HOUR`].
    pub alarms_in_hour: u32,
    /// True if more alarms come than a person can read: then only the most urgent are open.
    pub alarm_flood: bool,
    /// Their sound.
    pub sound: Sound,
    /// Events at this display, oldest first.
    pub past: Arc<VecDeque<Past>>,
    /// Number of events no longer kept.
    pub past_more: u32,
    /// The order that waits to be confirmed.
    pub prepared: Option<Prepared>,
    /// Results of the last acts, oldest first.
    pub answers: Vec<Answer>,
}

impl Shown {
    /// The picture `delay` later, with no input in between: the one a view draws after holding it for so long.
    #[must_use]
    pub fn older(mut self, delay: Span) -> Self {
        let limits = self.limits;
        for unit in &mut self.units {
            unit.state = unit.state.older(delay, &limits);
            unit.pose = unit.pose.older(delay, &limits);
            unit.tracks.iter_mut().for_each(|track| *track = (*track).older(delay, &limits));
            unit.lost.iter_mut().for_each(|lost| lost.track = lost.track.older(delay, &limits));
        }
        for link in &mut self.links {
            link.open = link.open.older(delay, &limits);
            link.heard = link.heard.map(|heard| heard + delay);
        }
        self.at += delay;
        self
    }

    /// Time from which times are written: the run's start, where a recording knows it, else the console's own.
    pub fn epoch(&self) -> Instant {
        self.marks.began.unwrap_or(self.started)
    }

    /// The unit, if it has been heard.
    pub fn unit(&self, unit: UnitId) -> Option<&ShownUnit> {
        self.units.iter().find(|shown| shown.unit == unit)
    }

    /// True if an alarm is about this track that its unit no longer reports; if not, that it ended is an event.
    pub fn asks_about(&self, unit: UnitId, track: &LostTrack) -> bool {
        let id = track.track.get().0.id;
        let about = |led: &LedTo| matches!(led, LedTo::TrackEnded(of, ended, _) if (*of, *ended) == (unit, id));
        self.alarms.iter().any(|group| {
            group.cause == Alarm::TrackLost(unit, track.boot, id)
                || group.led_to.iter().any(|(at, led)| *at == track.since && about(led))
        })
    }

    /// The command, if it is still kept.
    pub fn command(&self, intent: &IntentHash) -> Option<&ShownCommand> {
        self.commands.iter().find(|shown| shown.intent == *intent)
    }
}

/// The values that an intent of this kind repeats. Away from safe only intents of a state that is displayed as fresh.
/// Towards safe any, even none: a HOLD is never kept back because the display is stale, for the gateway withholds the
/// lease even if the unit finds the nonce too old.
pub fn basis_for(kind: CommandKind, shown: Option<&ShownUnit>) -> Option<Basis> {
    if kind.towards_safe() {
        return Some(Basis { nonce: shown.map_or(Nonce::NONE, |unit| unit.state.get().0.nonce), report: None });
    }
    let unit = shown?;
    let report = kind.rests_on_display().map(|_| unit.hash);
    unit.state.fresh().map(|state| Basis { nonce: state.nonce, report })
}
