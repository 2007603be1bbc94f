//! An alarm as it is drawn: one group for a cause, with its consequences. `causes` finds the causes, `alarms` decides when
//! a group is raised and when it is over, `sound` when it is to be heard.

use config::suite::Suite;
use wire::event::Inconsistency;
use wire::id::{CommandId, PeerId, TrackId, UnitId};
use wire::mode::{Guard, Mode};
use wire::person::Alarm;
use wire::sensor::{Class, Modality};
use wire::time::Instant;

/// Consequences of one cause that are kept.
pub const MAX_LED_TO: usize = 12;

/// Urgency of an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Priority {
    /// Act now.
    High,
    /// Act soon.
    Medium,
    /// Know it. No alarm has it by default.
    Low,
}

impl Priority {
    /// Priority of this cause by itself. Its consequences can make it more urgent.
    pub fn from_alarm(alarm: &Alarm) -> Self {
        match alarm {
            Alarm::HoldSafe(_)
            | Alarm::HeldElsewhere(_)
            | Alarm::Silent(_)
            | Alarm::ContactDue(_)
            | Alarm::GatewaySilent
            | Alarm::SessionLost(_)
            | Alarm::NotAcknowledged(_) => Priority::High,
            Alarm::Degraded(_)
            | Alarm::GuardLost(..)
            | Alarm::Contradicts(_)
            | Alarm::Claims(_)
            | Alarm::CommandRefused(_)
            | Alarm::TrackLost(..)
            | Alarm::TracksLost(_)
            | Alarm::ClockRuns(_) => Priority::Medium,
            // Events: they raise no alarm by themselves.
            Alarm::Stale(_) | Alarm::LinkDown(_) => Priority::Low,
        }
    }

    /// Name as displayed.
    pub fn name(self) -> &'static str {
        match self {
            Priority::High => "HIGH",
            Priority::Medium => "MEDIUM",
            Priority::Low => "LOW",
        }
    }
}

/// A consequence of a cause. It is not counted, and goes with its cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LedTo {
    /// The unit found this contradiction.
    Found(UnitId, Inconsistency),
    /// The unit changed its mode.
    Mode(UnitId, Mode),
    /// The unit's authority on a track was revoked.
    Revoked(UnitId, TrackId),
    /// The unit is not heard.
    Silent(UnitId),
    /// The gateway has no session with the peer.
    LinkDown(PeerId),
    /// So many tracks are lost with the unit that reported them.
    TracksLost(UnitId, u8),
    /// The unit no longer reports this track.
    TrackEnded(UnitId, TrackId, Class),
    /// A command was not acknowledged.
    NotAcknowledged(CommandId),
}

impl LedTo {
    /// Text of the consequence.
    pub fn words(&self) -> String {
        match self {
            LedTo::Found(unit, found) => format!("{unit} found that {}", found_words(*found)),
            LedTo::Mode(unit, mode) => format!("{unit} {}", mode.name()),
            LedTo::Revoked(unit, track) => format!("{unit} authority on track {} revoked", track.0),
            LedTo::Silent(unit) => format!("{unit} not heard"),
            LedTo::LinkDown(peer) => format!("no session of {peer} at the gateway"),
            LedTo::TracksLost(unit, 1) => format!("1 track of {unit} LOST"),
            LedTo::TracksLost(unit, n) => format!("{n} tracks of {unit} LOST"),
            LedTo::TrackEnded(unit, track, class) => ended_words(*unit, *track, *class),
            LedTo::NotAcknowledged(command) => format!("command {command} not acknowledged"),
        }
    }

    /// The consequence as a line below its cause; the sign of the cause itself comes first.
    pub fn line(&self) -> String {
        let begins = if matches!(self, LedTo::Found(..)) { "first" } else { "led to" };
        format!("{begins}: {}", self.words())
    }

    /// True if it asks for an act by itself: then a group that was acknowledged asks again.
    pub(crate) fn asks(&self) -> bool {
        matches!(self, LedTo::Mode(_, Mode::HoldSafe) | LedTo::NotAcknowledged(_))
    }

    /// True if it happens at a time of its own; false if it lasts as long as its cause.
    pub(crate) fn dated(&self) -> bool {
        !matches!(self, LedTo::Silent(_) | LedTo::TracksLost(..))
    }

    /// True if it is the same consequence, whatever its number.
    pub(crate) fn same(&self, other: &LedTo) -> bool {
        match (self, other) {
            (LedTo::TracksLost(unit, _), LedTo::TracksLost(other, _)) => unit == other,
            (one, other) => one == other,
        }
    }
}

/// An alarm as drawn: a cause, and its consequences.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShownGroup {
    /// The cause.
    pub cause: Alarm,
    /// Sensors of the unit that the cause is about, by which it is worded.
    pub suite: Suite,
    /// Urgency: the cause's own, or of the worst that it led to.
    pub priority: Priority,
    /// Time at which it was raised first.
    pub first: Instant,
    /// Time at which it last began to ask for an act; an acknowledgement names it.
    pub since: Instant,
    /// Number of times that it was raised, each within a minute of the last.
    pub times: u32,
    /// True if the cause or a mode that it led to still stands.
    pub standing: bool,
    /// True if it was taken note of.
    pub acknowledged: bool,
    /// True while a HOLD_SAFE stands that was not ordered here: it cannot be shelved.
    pub hold_stands: bool,
    /// Consequences of the cause, in the order of events; at most [`MAX_LED_TO`].
    pub led_to: Vec<(Instant, LedTo)>,
    /// Consequences for which there was no room.
    pub led_more: u32,
    /// Time at which it returns, if it was put aside.
    pub shelved_until: Option<Instant>,
}

impl ShownGroup {
    /// Text of the cause: as of now, or as it was.
    pub fn words(&self) -> String {
        words(&self.cause, self.suite, self.standing)
    }

    /// True if it asks for an act: neither acknowledged nor put aside.
    pub fn open(&self) -> bool {
        !self.acknowledged && self.shelved_until.is_none()
    }

    /// True if it is not folded away: in a flood only the most urgent are open.
    pub fn unfolded(&self, flood: bool) -> bool {
        !flood || self.priority == Priority::High
    }
}

/// Text of a cause that stands, or that did.
pub fn words(alarm: &Alarm, suite: Suite, stands: bool) -> String {
    let verb = |now: &'static str, then: &'static str| if stands { now } else { then };
    let (is, has) = (verb("is", "was"), verb("has", "had"));
    match alarm {
        Alarm::HoldSafe(unit) => format!("{unit} {is} in HOLD_SAFE"),
        Alarm::HeldElsewhere(unit) => format!("{unit} {is} in HOLD_SAFE by an order that was not given here"),
        Alarm::Degraded(unit) => format!("{unit} {is} DEGRADED"),
        Alarm::Stale(unit) => format!("what is shown of {unit} {is} stale"),
        Alarm::Silent(unit) => format!("{unit} {}", verb("is no longer heard", "was not heard")),
        Alarm::ContactDue(unit) => format!("contact with {unit} {is} due, and nothing {is} heard"),
        Alarm::GatewaySilent => format!("nothing {is} heard from the gateway"),
        Alarm::TrackLost(unit, _, track) => format!("track {} of {unit} ended, designated or in its way", track.0),
        Alarm::TracksLost(unit) => format!("tracks of {unit} ended together"),
        Alarm::LinkDown(peer) => format!("the gateway {has} no session with {peer}"),
        Alarm::SessionLost(peer) => format!("{peer} lost its command session: cut, or taken by another connection"),
        Alarm::NotAcknowledged(command) => format!("command {command} {is} not acknowledged"),
        Alarm::ClockRuns(unit) => {
            format!("the clock of {unit} {} beyond what its ages allow for", verb("runs", "ran"))
        }
        Alarm::CommandRefused(command) => format!("command {command} was refused"),
        Alarm::Contradicts(unit) => format!("{unit} {} itself", verb("contradicts", "contradicted")),
        Alarm::Claims(unit) => format!("{unit} {} the place of another unit", verb("claims", "claimed")),
        Alarm::GuardLost(unit, guard) => guard_words(*unit, *guard, suite, stands),
    }
}

/// Text of a guard's failure.
fn guard_words(unit: UnitId, guard: Guard, suite: Suite, stands: bool) -> String {
    let verb = |now: &'static str, then: &'static str| if stands { now } else { then };
    let (is, has) = (verb("is", "was"), verb("has", "had"));
    match guard {
        Guard::Rgb | Guard::Depth | Guard::Thermal | Guard::Lidar => {
            format!("{} of {unit} {} nothing", sensor_name(suite, guard), verb("gives", "gave"))
        }
        Guard::Tracks => format!("{unit} {has} no tracks"),
        Guard::Localisation => format!("{unit} {} not know its place", verb("does", "did")),
        Guard::Geofence => format!("{unit} {is} too near to its fence"),
        Guard::Lease => format!("{unit} {has} no permission to drive"),
        Guard::Teammates => format!("{unit} {} claims of its teammates that cannot be true", verb("hears", "heard")),
        Guard::SealedLog => format!("the log of {unit} {is} not sealed in time"),
        Guard::Designation => format!("the designation of {unit} {is} not sound"),
        Guard::Drift => format!("the position of {unit} {}", verb("drifts", "drifted")),
        Guard::TimeBase => format!("the receiver time of {unit} {is} off"),
    }
}

/// Name of the sensor that a guard watches over, as a sentence begins.
fn sensor_name(suite: Suite, guard: Guard) -> String {
    let modality = Modality::ALL.into_iter().find(|place| Guard::from_modality(*place) == guard);
    match (suite, modality) {
        (Suite::Scene, Some(Modality::Rgb)) => "colour camera".to_owned(),
        (Suite::Scene, Some(Modality::Depth)) => "depth camera".to_owned(),
        (Suite::Scene, Some(Modality::Thermal)) => "thermal camera".to_owned(),
        (Suite::Scene, Some(Modality::Lidar)) => "LiDAR".to_owned(),
        (Suite::Sky, Some(place)) => suite.sensor(place).to_owned(),
        (_, None) => guard.name().to_owned(),
    }
}

/// Text of an ended track.
pub(crate) fn ended_words(unit: UnitId, track: TrackId, class: Class) -> String {
    format!("track {} {} of {unit} out of view", track.0, class.name())
}

fn found_words(found: Inconsistency) -> &'static str {
    match found {
        Inconsistency::Kinematics => "it moves faster than it can",
        Inconsistency::Exclusion => "two units claim one place",
        Inconsistency::TimeBase => "its reports run against their own sequence or time",
        Inconsistency::Residual => "it does not go where its speed and heading lead",
    }
}
