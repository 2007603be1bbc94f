//! An alarm as it is drawn: priority, start time and text. `alarms` decides when one is raised and when it is over.

use wire::person::Alarm;
use wire::time::Instant;

/// Urgency of an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Priority {
    /// Act now.
    High,
    /// Act soon.
    Medium,
    /// Know it.
    Low,
}

impl Priority {
    /// Priority of this alarm.
    pub fn from_alarm(alarm: &Alarm) -> Self {
        match alarm {
            Alarm::HoldSafe(_) | Alarm::Silent(_) | Alarm::SessionLost(_) | Alarm::NotAcknowledged(_) => Priority::High,
            Alarm::Degraded(_)
            | Alarm::Stale(_)
            | Alarm::LinkDown(_)
            | Alarm::CommandRefused(_)
            | Alarm::ClockRuns(_) => Priority::Medium,
            Alarm::TrackLost(..) => Priority::Low,
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

/// An alarm as drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShownAlarm {
    /// The alarm itself.
    pub alarm: Alarm,
    /// Urgency of the alarm.
    pub priority: Priority,
    /// Time at which it was raised.
    pub since: Instant,
    /// True if its condition still stands.
    pub standing: bool,
    /// True if it was taken note of.
    pub acknowledged: bool,
}

/// Text of the alarm.
pub fn words(alarm: &Alarm) -> String {
    match alarm {
        Alarm::HoldSafe(unit) => format!("{unit} is in HOLD_SAFE"),
        Alarm::Degraded(unit) => format!("{unit} is DEGRADED"),
        Alarm::Stale(unit) => format!("what is shown of {unit} is stale"),
        Alarm::Silent(unit) => format!("{unit} is no longer heard"),
        Alarm::TrackLost(unit, _, track) => format!("{unit} no longer reports track {}", track.0),
        Alarm::LinkDown(peer) => format!("the gateway has no session with {peer}"),
        Alarm::SessionLost(peer) => format!("{peer} lost its command session: cut, or taken by another connection"),
        Alarm::NotAcknowledged(command) => format!("command {command} is not acknowledged"),
        Alarm::ClockRuns(unit) => {
            format!("the clock of {unit} runs beyond what ages allow for: its ages are not to be relied on")
        }
        Alarm::CommandRefused(command) => format!("command {command} was refused"),
    }
}
