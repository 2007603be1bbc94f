//! Words and numbers as the window writes them. A view never counts an age; it writes one that it is given.

use wire::command::CommandKind;
use wire::person::Order;
use wire::time::{Instant, MAX_DRIFT_PPM, Span};

use super::marks::Tone;
use crate::life::{Life, ShownCommand};
use crate::shown::{Origin, Shown};
use crate::skew::Rate;

/// Longest name that is written whole, characters.
const MAX_NAME: usize = 48;

/// An age in seconds, as wide as the eye expects: two decimals below ten seconds. It is rounded up, for it is an age at
/// most.
pub(super) fn seconds(span: Span) -> String {
    if span == Span(u64::MAX) { "unknown".to_owned() } else { written(span, u64::div_ceil) }
}

/// Time left: rounded down.
pub(super) fn left(span: Span) -> String {
    written(span, |us, unit| us / unit)
}

fn written(span: Span, whole: fn(u64, u64) -> u64) -> String {
    const S: u64 = 1_000_000;
    match span.0 {
        us if us < 10 * S => format!("{:.2} s", whole(us, S / 100) as f64 / 100.0),
        us if us < 100 * S => format!("{:.1} s", whole(us, S / 10) as f64 / 10.0),
        us if us < 6_000 * S => format!("{} min", whole(us, 60 * S)),
        us => format!("{} h", whole(us, 3_600 * S)),
    }
}

/// Time of an event: relative, or in a recording the run's time, for a recording has no present.
pub(super) fn event_time(shown: &Shown, time: Instant) -> String {
    match shown.marks.began {
        Some(began) => format!("at {}", on_run(i128::from(time.0) - i128::from(began.0))),
        None => format!("{} ago", seconds(shown.at.since(time))),
    }
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

/// A name from outside: one line, no longer than [`MAX_NAME`], of characters that read the way they are written.
pub(super) fn tame(name: &str) -> String {
    tame_to(name, MAX_NAME)
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

/// An order in a few words.
pub(super) fn order(order: &Order) -> String {
    match order {
        Order::Revoke(who) => format!("strike {who} from the roll"),
        Order::Command(unit, kind) => match kind {
            CommandKind::Hold => format!("hold {unit}"),
            CommandKind::Disarm => format!("disarm {unit}"),
            CommandKind::Enable => format!("enable {unit}"),
            CommandKind::Resume => format!("resume {unit}"),
            CommandKind::Arm(track) => format!("arm {unit} on track {}", track.0),
            CommandKind::Confirm(track) => format!("act with {unit} on track {}", track.0),
            CommandKind::Configure(_) => format!("configure {unit}"),
        },
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_ages_round_up_and_time_left_down() {
        let ages = [(1, "0.01 s", "0.00 s"), (299_999, "0.30 s", "0.29 s"), (10_000_001, "10.1 s", "10.0 s")];
        let long = [(149_000_000, "3 min", "2 min"), (6_000_000_001, "2 h", "1 h"), (1_420_000, "1.42 s", "1.42 s")];
        for (us, age, rest) in ages.into_iter().chain(long) {
            assert_eq!((seconds(Span(us)).as_str(), left(Span(us)).as_str()), (age, rest), "{us} us");
        }
        assert_eq!(seconds(Span(u64::MAX)), "unknown");
    }
}
