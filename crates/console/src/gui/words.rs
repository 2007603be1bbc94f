//! Words and numbers as the window writes them. A view never counts an age; it writes one that it is given.

use wire::command::CommandKind;
use wire::person::Order;
use wire::time::{Instant, MAX_DRIFT_PPM};

use super::marks::Tone;
pub(super) use crate::banner::{clock as clock_at, ordered as order};
use crate::life::{Life, ShownCommand};
use crate::shown::{Origin, Shown};
use crate::skew::Rate;
pub(super) use crate::wording::{at_most, left, seconds};

/// Time of an event, as the run's.
pub(super) fn event_time(shown: &Shown, time: Instant) -> String {
    clock_at(time.since(shown.epoch()))
}

/// A time of the run, microseconds: in seconds, which an hour has too, so that any two are distinguished by number
/// alone.
pub(super) fn on_run(us: i128) -> String {
    format!("{:.2} s", us.div_euclid(10_000) as f64 / 100.0)
}

/// Rate of a unit's clock against this console's, for the tooltip.
pub(super) fn clock(clock: Option<Rate>) -> String {
    clock.map_or("No rate of its clock is known yet: that takes some seconds of reports.".to_owned(), |rate| {
        let seconds = rate.over.0 / 1_000_000;
        format!("Its {} over {seconds} s against this console's; ages allow for {MAX_DRIFT_PPM} ppm.", rate.words())
    })
}

/// Millimetres as metres.
pub(super) fn metres(mm: i32) -> f64 {
    f64::from(mm) / 1000.0
}

/// Words without control characters, at most this many characters.
pub(super) fn tame_to(words: &str, most: usize) -> String {
    let plain = |c: char| if c.is_ascii_graphic() || c == ' ' { c } else { '?' };
    let mut tame: String = words.chars().map(plain).take(most).collect();
    if words.chars().nth(most).is_some() {
        tame.push_str("...");
    }
    tame
}

/// Origin of a value, and how far from normal that is.
pub(super) fn origin(origin: Origin) -> (Tone, String) {
    let tone = match origin {
        Origin::Direct => Tone::Normal,
        Origin::Relayed(_) => Tone::Advice,
        Origin::Unverified | Origin::NotLive(_) => Tone::Caution,
    };
    (tone, origin.words())
}

/// Progress of a command.
pub(super) fn life(life: Life, now: Instant) -> String {
    match life {
        Life::Requested => "asked of the gateway".to_owned(),
        Life::Staged => "staged at the gateway".to_owned(),
        Life::Released => "confirmed".to_owned(),
        Life::Sent => "sent to the unit".to_owned(),
        Life::Stored(due) if now < due => format!("stored, due in {:.1} s", due.since(now).as_ms() / 1000.0),
        Life::Stored(due) => format!("stored, due {:.1} s ago", now.since(due).as_ms() / 1000.0),
        Life::Executed => "executed".to_owned(),
        Life::RefusedByUnit(reason) => format!("REFUSED by the unit: {}", reason.name()),
        Life::RefusedByGateway(Some(reason)) => format!("REFUSED by the gateway: {}", reason.name()),
        Life::RefusedByGateway(None) => "REFUSED by the gateway: it lost its session".to_owned(),
        Life::Expired => "EXPIRED, never confirmed".to_owned(),
        Life::NotAcknowledged => "NOT ACKNOWLEDGED".to_owned(),
    }
}

/// Time of each stage of a command, from the order on.
pub(super) fn stages(command: &ShownCommand) -> String {
    let times = &command.times;
    let stages = [
        ("staged", times.staged),
        ("confirmed", times.released),
        ("sent", times.sent),
        ("stored", times.stored),
        ("answered", times.answered),
        ("effect", times.effect),
    ];
    let stage = |(name, at): (&str, Option<Instant>)| {
        at.map(|time| format!("{name} +{:.0} ms", time.since(times.requested).as_ms()))
    };
    stages.into_iter().filter_map(stage).collect::<Vec<_>>().join("  ")
}

/// Consequence of an order, spelt out before it is confirmed.
pub(super) fn consequence(order: &Order) -> String {
    match order {
        Order::Revoke(who) => {
            format!("{who} is admitted nowhere any more, for the rest of this run. It cannot be undone.")
        }
        Order::Command(unit, kind) => match kind {
            CommandKind::Hold => format!("{unit} stops and stays stopped until you resume it."),
            CommandKind::Disarm => format!("{unit} gives its authority up and goes on with its mission."),
            CommandKind::Enable => format!("{unit} leaves IDLE, is READY and starts to DRIVE its route by itself."),
            CommandKind::Resume => format!("{unit} leaves HOLD_SAFE, is READY and DRIVES ON by itself."),
            CommandKind::Arm(track) => {
                format!("{unit} holds authority on track {} for a few seconds: one act may follow.", track.0)
            }
            CommandKind::Confirm(track) => format!("{unit} ACTS on track {}, once. It cannot be undone.", track.0),
            CommandKind::Configure(settings) => format!(
                "{unit} drives at most {} m/s, {} m from the fence; arms from {}, keeps from {} confidence.",
                f64::from(settings.speed_mm_s) / 1000.0,
                f64::from(settings.margin_mm) / 1000.0,
                f64::from(settings.arm_permille) / 1000.0,
                f64::from(settings.keep_permille) / 1000.0,
            ),
        },
    }
}

/// A phrase with its first letter in capitals.
pub(super) fn capital(phrase: &str) -> String {
    let mut letters = phrase.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}
