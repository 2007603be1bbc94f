//! The picture as one JSON object, for programs: `holdsafe watch RUN --json`.
//!
//! A view, as [`text`](crate::text) is: it decides and computes no age. Each value that ages is in an object with its
//! freshness and its age. The lists come from [`Shown`], with its bounds.

use config::suite::Suite;
use serde_json::{Value, json};
use wire::report::ReportedTrack;
use wire::time::{Instant, Span};

use crate::age::{AgeLimits, Labelled};
use crate::alarm::ShownGroup;
use crate::shown::{Shown, ShownUnit};
use crate::skew::Rate;
use crate::sound::LIMIT_AN_HOUR;
use crate::text::{life, names, word};

/// Raised when a field changes its meaning or goes.
const VERSION: u32 = 1;

/// The object, in one line.
pub(crate) fn line(shown: &Shown) -> String {
    let ago = |time: Instant| ms(shown.at.since(time));
    json!({
        "version": VERSION,
        "at_us": shown.at.0,
        "operator": shown.operator,
        "role": shown.role.name(),
        "replay": shown.marks.replay,
        "ablation": shown.marks.ablation,
        "waived": shown.marks.waived,
        "invalid": shown.marks.invalid,
        "worst_first": shown.worst_first().iter().map(|(unit, sign)| json!({ "unit": unit.name(), "sign": sign }))
            .collect::<Value>(),
        "host_wait_ms": shown.marks.host_wait.map(ms),
        "limits_ms": limits(&shown.limits),
        "max_speed_mm_s": shown.bounds.max_speed_mm_s,
        "units": shown.units.iter().map(|state| unit(shown, state)).collect::<Value>(),
        "silent": shown.silent.iter().map(|unit| unit.name()).collect::<Value>(),
        "unheard": shown.silent.iter().map(|unit| json!({ "unit": unit.name(), "banner": shown.banner(*unit) }))
            .collect::<Value>(),
        "links": shown.links.iter().map(|link| json!({
            "peer": link.peer,
            "open": labelled(&link.open, json!(link.open.get().0)),
            "heard_ms": link.heard.map(ms),
        })).collect::<Value>(),
        "refusals": shown.refusals.iter().map(|refusal| json!({
            "reason": refusal.reason.name(),
            "peer": refusal.peer,
            "by": if refusal.here { "console" } else { "gateway" },
            "times": refusal.n,
            "last_ms": ago(refusal.last),
        })).collect::<Value>(),
        "sessions_lost": shown.losses.iter().map(|(peer, times)| json!({ "peer": peer, "times": times }))
            .collect::<Value>(),
        "commands": shown.commands.iter().map(|command| json!({
            "id": command.id.to_string(),
            "unit": command.unit.name(),
            "kind": command.kind.name(),
            "by": command.by.name(),
            "life": life(command.life, shown.at),
            "since_ms": ago(command.since),
            "asked_ms": ago(command.times.requested),
            "answered_ms": command.times.answered.map(ago),
            "effect_ms": command.times.effect.map(ago),
        })).collect::<Value>(),
        "alarms": shown.alarms.iter().map(|of| alarm(shown.at, of)).collect::<Value>(),
        "alarms_more": shown.alarms_more,
        "alarms_in_hour": shown.alarms_in_hour,
        "alarms_limit": LIMIT_AN_HOUR,
        "alarm_flood": shown.alarm_flood,
        "sound": {
            "motif": shown.sound.motif.map(|(priority, _)| priority.name()),
            "silenced_ms": shown.sound.silenced_until.map(|until| left(until.since(shown.at))),
        },
        "prepared": shown.prepared.map(|order| json!({
            "order": order.order.name(),
            "left_ms": left(order.until.since(shown.at)),
        })),
    })
    .to_string()
}

/// An alarm with its consequences. One that is over is in the past tense.
fn alarm(now: Instant, of: &ShownGroup) -> Value {
    let ago = |time: Instant| ms(now.since(time));
    json!({
        "priority": of.priority.name(),
        "says": of.words(),
        "first_ms": ago(of.first),
        "since_ms": ago(of.since),
        "times": of.times,
        "standing": of.standing,
        "acknowledged": of.acknowledged,
        "hold_stands": of.hold_stands,
        "shelved_ms": of.shelved_until.map(|until| left(until.since(now))),
        "led_to": of.led_to.iter().map(|(at, what)| json!({ "says": what.words(), "since_ms": ago(*at) }))
            .collect::<Value>(),
        "led_more": of.led_more,
    })
}

/// Ages at which one freshness label gives way to the next; null where values do not age, which is no result of the
/// full policy.
fn limits(limits: &AgeLimits) -> Value {
    let AgeLimits { fresh, late, stale, age_out } = *limits;
    if age_out { json!({ "fresh": ms(fresh), "late": ms(late), "stale": ms(stale) }) } else { Value::Null }
}

/// A unit, with each guard and its measured value.
fn unit(shown: &Shown, of: &ShownUnit) -> Value {
    let ((state, _), (pose, _)) = (of.state.get(), of.pose.get());
    json!({
        "unit": of.unit.name(),
        "banner": shown.banner(of.unit),
        "via": of.via,
        "origin": of.origin.words(),
        "checks_waived": !of.waived.is_empty(),
        "since_ms": ms(shown.at.since(of.since)),
        "state": labelled(&of.state, json!({
            "mode": state.mode.name(),
            "cause": state.cause(),
            "failing": state.failing.iter().map(|guard| guard.name()).collect::<Value>(),
            "guards": of.guards(&shown.bounds).iter().map(|guard| json!({
                "name": guard.name, "title": guard.title, "holds": guard.holds, "value": guard.value, "limit": guard.limit,
                "reading": guard.measured(),
            })).collect::<Value>(),
            "authority": state.authority.map(|held| json!({ "track": held.track.0, "left_ms": left(held.left) })),
            "settings": of.settings(&shown.bounds),
            "speed_mm_s": state.speed_mm_s,
            "progress_permille": state.progress,
            "motion": state.motion.map(|motion| json!({
                "up_mm": motion.up_mm, "left_up_mm_s": motion.left_up_mm_s, "charge_permille": motion.charge,
                "attitude": motion.attitude.map(|attitude| attitude.parts()), "sunlit": motion.sunlit,
            })),
            "contact": state.contact.map(|contact| json!({ "left_ms": left(contact.left), "next_ms": contact.next.map(left) })),
        })),
        "place": labelled(&of.pose, json!({ "x_mm": pose.x_mm, "y_mm": pose.y_mm, "yaw_mrad": pose.yaw_mrad })),
        "tracks": of.tracks.iter().map(|of| track(of, true))
            .chain(of.lost.iter().map(|lost| track(&lost.track, false))).collect::<Value>(),
        "lost_more": of.lost_more,
        "clock": of.clock.map(Rate::consequence),
        "clock_ppm": of.clock.map(|rate| [rate.low_ppm, rate.high_ppm]),
    })
}

fn track(of: &Labelled<ReportedTrack>, reported: bool) -> Value {
    let (track, _) = of.get();
    labelled(
        of,
        json!({
            "id": track.id.0,
            "reported": reported,
            "class": track.class.name(),
            "x_mm": track.x_mm,
            "y_mm": track.y_mm,
            "confidence_permille": track.confidence,
            "modalities": names(Suite::Scene, track.supported).collect::<Value>(),
            "contradicted": names(Suite::Scene, track.contradicted).collect::<Value>(),
            "bearings_mrad": track.bearings_mrad,
            "across_px": track.across_px,
        }),
    )
}

/// A value with its freshness and its age.
fn labelled<T>(of: &Labelled<T>, value: Value) -> Value {
    json!({ "freshness": word(of.freshness()), "age_ms": ms(of.age()), "value": value })
}

/// Whole milliseconds left: rounded down.
fn left(span: Span) -> u64 {
    span.0 / 1000
}

/// Whole milliseconds of an age, begun ones too; null where there is no bound.
fn ms(span: Span) -> Option<u64> {
    (span != Span(u64::MAX)).then_some(span.0.div_ceil(1000))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ages_round_up_and_time_left_down() {
        assert_eq!((ms(Span(299_001)), left(Span(299_999))), (Some(300), 299));
        assert_eq!(ms(Span(u64::MAX)), None);
    }
}
