//! Words and numbers as the window writes them. A view never counts an age; it writes one that it is given.

use wire::command::CommandKind;
use wire::person::Order;
use wire::time::{Instant, Span};

use super::sign::Tone;
use crate::life::{Life, ShownCommand};
use crate::shown::Origin;

/// Longest name that is written whole, characters.
const MAX_NAME: usize = 48;

/// A span in seconds, as wide as the eye expects: two decimals below ten seconds.
pub(super) fn seconds(span: Span) -> String {
    let s = span.as_ms() / 1000.0;
    match s {
        _ if span == Span(u64::MAX) => "unknown".to_owned(),
        s if s < 10.0 => format!("{s:.2} s"),
        s if s < 100.0 => format!("{s:.1} s"),
        s if s < 6000.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.0} h", s / 3600.0),
    }
}

/// How long ago something was.
pub(super) fn ago(span: Span) -> String {
    format!("{} ago", seconds(span))
}

/// Millimetres as metres.
pub(super) fn metres(mm: i32) -> f64 {
    f64::from(mm) / 1000.0
}

/// A name from outside: one line, no longer than [`MAX_NAME`], of characters that read the way they are written.
pub(super) fn tame(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_graphic() || c == ' ' { c } else { '?' };
    let mut tame: String = name.chars().map(plain).take(MAX_NAME).collect();
    if name.chars().nth(MAX_NAME).is_some() {
        tame.push_str("...");
    }
    tame
}

/// Where something comes from, and how far from normal that is.
pub(super) fn origin(origin: Origin) -> (Tone, String) {
    let tone = match origin {
        Origin::Direct => Tone::Normal,
        Origin::Relayed(_) => Tone::Advice,
        Origin::Unverified | Origin::NotLive(_) => Tone::Caution,
    };
    (tone, origin.words())
}

/// How far a command has come.
pub(super) fn life(life: Life) -> String {
    match life {
        Life::Requested => "asked of the gateway".to_owned(),
        Life::Staged => "staged at the gateway".to_owned(),
        Life::Released => "confirmed".to_owned(),
        Life::Sent => "sent to the unit".to_owned(),
        Life::Executed => "executed".to_owned(),
        Life::RefusedByUnit(reason) => format!("REFUSED by the unit: {}", reason.name()),
        Life::RefusedByGateway(Some(reason)) => format!("REFUSED by the gateway: {}", reason.name()),
        Life::RefusedByGateway(None) => "REFUSED by the gateway: it lost its session".to_owned(),
        Life::Expired => "EXPIRED, never confirmed".to_owned(),
        Life::NotAcknowledged => "NOT ACKNOWLEDGED".to_owned(),
    }
}

/// When a command came to each stage, from when it was given.
pub(super) fn stages(command: &ShownCommand) -> String {
    let times = &command.times;
    let stages = [
        ("staged", times.staged),
        ("confirmed", times.released),
        ("sent", times.sent),
        ("answered", times.answered),
        ("effect", times.effect),
    ];
    let stage = |(name, at): (&str, Option<Instant>)| {
        at.map(|at| format!("{name} +{:.0} ms", at.since(times.requested).as_ms()))
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

/// What will have come of it, spelt out before it is confirmed.
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
