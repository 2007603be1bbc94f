//! The display as text lines, for a terminal: state, cause, since, ages, tracks, links, refusals, commands.
//!
//! A view: it decides and computes no age. Every value stands beside its label. No control characters but newlines.

use std::fmt::Write;

use config::suite::Suite;
use wire::bounds::Bounds;
use wire::event::Freshness;
use wire::report::ReportedTrack;
use wire::sensor::{Modalities, Modality};
use wire::time::{Instant, Span};

use crate::act::Answer;
use crate::age::Labelled;
use crate::alarm::ShownGroup;
use crate::aloft;
use crate::life::{Life, ShownCommand};
use crate::shown::{Shown, ShownLink, ShownRefusals, ShownUnit};
use crate::sound::LIMIT_AN_HOUR;

/// The text of `shown`.
pub fn lines(shown: &Shown) -> String {
    let mut text = String::with_capacity(1024);
    if shown.marks.replay {
        line(&mut text, format_args!("REPLAY of a recording: nothing here is live, and nothing can be commanded"));
    }
    if let Some(reason) = &shown.marks.invalid {
        line(&mut text, format_args!("INVALID, evidence of nothing: {reason}"));
    }
    if let Some(mark) = &shown.marks.ablation {
        let waived = &shown.marks.waived;
        line(&mut text, format_args!("ABLATION, not a result of the full policy: {mark} ({waived})"));
    }
    if let Some(wait) = shown.marks.host_wait {
        line(
            &mut text,
            format_args!("HOST BUSY  a service waited {} ms for a core: what it does comes late", wait.0 / 1000),
        );
    }
    line(&mut text, format_args!("SIMULATION  {} · {}", shown.operator, shown.role.name()));
    for unit in &shown.units {
        unit_lines(&mut text, shown.at, &shown.bounds, unit);
    }
    for unit in &shown.silent {
        line(&mut text, format_args!("{:<8} nothing received", unit.name()));
    }
    line(&mut text, format_args!("links    {}", joined(shown.links.iter().map(link))));
    line(&mut text, format_args!("refused  {}", joined(shown.refusals.iter().map(refusals))));
    for (peer, n) in &shown.losses {
        let name = "cut, or taken by another connection; orders away from safe that were under way are void";
        line(&mut text, format_args!("ALARM    {peer} LOST its command session {n} times: {name}"));
    }
    alarm_lines(&mut text, shown);
    shown.commands.iter().for_each(|command| command_line(&mut text, shown.at, command));
    if let Some(prepared) = &shown.prepared {
        let left = prepared.until.since(shown.at).0 / 1_000_000;
        line(&mut text, format_args!("prepared {}, to be confirmed within {left} s", prepared.order.name()));
    }
    if let Some(Answer { act: Some(_), at, outcome: Err(error), .. }) = shown.answers.last() {
        let ago = ago(shown.at.since(*at));
        line(&mut text, format_args!("not done {}, {ago:.1} s ago", error.message()));
    }
    text
}

/// The alarms with their consequences, and how many there were. In a flood, those that are not urgent are only counted.
fn alarm_lines(text: &mut String, shown: &Shown) {
    let (open, folded): (Vec<_>, Vec<_>) = shown.alarms.iter().partition(|group| group.unfolded(shown.alarm_flood));
    open.iter().for_each(|group| alarm_line(text, shown.at, group));
    if !folded.is_empty() {
        line(text, format_args!("alarm    and {} less urgent, folded away in a flood of alarms", folded.len()));
    }
    if shown.alarms_more > 0 {
        line(text, format_args!("alarm    and {} more, for which there was no room", shown.alarms_more));
    }
    let shelved = shown.alarms.iter().filter(|group| group.shelved_until.is_some()).count();
    let silenced = shown
        .sound
        .silenced_until
        .map_or(String::new(), |until| format!(", sound silenced for {} s", until.since(shown.at).0 / 1_000_000));
    let raised = shown.alarms_in_hour;
    line(text, format_args!("alarms   {raised} in this hour, limit {LIMIT_AN_HOUR}, {shelved} shelved{silenced}"));
}

fn alarm_line(text: &mut String, time: Instant, group: &ShownGroup) {
    let since = ago(time.since(group.first));
    let suffix = if group.standing { "" } else { ", over" };
    let noted = if group.acknowledged { ", acknowledged" } else { "" };
    let times = if group.times > 1 { format!(", {} times", group.times) } else { String::new() };
    let shelved = group
        .shelved_until
        .map_or(String::new(), |until| format!(", shelved for {} s", until.since(time).0 / 1_000_000));
    let (priority, words) = (group.priority.name(), group.words());
    line(text, format_args!("alarm    {priority:<6} {words}, {since:.1} s ago{times}{suffix}{noted}{shelved}"));
    for (at, led_to) in &group.led_to {
        line(text, format_args!("                {}, {:.1} s ago", led_to.line(), ago(time.since(*at))));
    }
    if group.led_more > 0 {
        line(text, format_args!("                led to: {} more", group.led_more));
    }
}

fn link(link: &ShownLink) -> String {
    let (open, freshness) = link.open.get();
    let last_known = if freshness == Freshness::Fresh { String::new() } else { format!(" ({})", word(freshness)) };
    let heard = link.heard.map_or("no report".to_owned(), |heard| format!("report {} ago", age(heard)));
    format!("{} {}{last_known}, {heard}", link.peer, if *open { "up" } else { "DOWN" })
}

fn refusals(refusals: &ShownRefusals) -> String {
    let whence = match (refusals.here, refusals.peer) {
        (true, _) => " here".to_owned(),
        (false, Some(peer)) => format!(" from {peer}"),
        (false, None) => String::new(),
    };
    format!("{} {}{whence}", refusals.reason.name(), refusals.n)
}

fn unit_lines(text: &mut String, time: Instant, bounds: &Bounds, unit: &ShownUnit) {
    let (state, freshness) = unit.state.get();
    let mark = match freshness {
        Freshness::Fresh => "",
        Freshness::Late | Freshness::Stale | Freshness::Lost => " (last known)",
    };
    line(
        text,
        format_args!(
            "{:<8} {}{mark}  since {:.1} s  cause {}  {} {}",
            unit.unit.name(),
            state.mode.name(),
            ago(time.since(unit.since)),
            state.cause(),
            word(freshness),
            age(unit.state.age()),
        ),
    );
    let authority = state.authority.map_or("none".to_owned(), |a| format!("track {} for {}", a.track.0, age(a.left)));
    let failing = joined(unit.guards(bounds).iter().filter(|guard| !guard.holds).map(|guard| guard.describe()));
    line(
        text,
        format_args!("         authority {authority}  failing {failing}  speed {}", aloft::speed(state.speed_mm_s)),
    );
    let mut aloft = aloft::motion(state);
    aloft.extend(aloft::contact(unit.plan()));
    if !aloft.is_empty() {
        line(text, format_args!("         {}", aloft.join("  ")));
    }
    let (pose, pose_freshness) = unit.pose.get();
    line(
        text,
        format_args!(
            "         at ({:.1}, {:.1}) m  {} {}  via {}  {}  {}",
            metres(pose.x_mm),
            metres(pose.y_mm),
            word(pose_freshness),
            age(unit.pose.age()),
            unit.via,
            unit.origin.words(),
            unit.clock.map_or("clock not known yet".to_owned(), |rate| format!(
                "{} ({})",
                rate.consequence(),
                rate.words()
            )),
        ),
    );
    unit.tracks.iter().for_each(|track| track_line(text, state.suite(), track));
    unit.lost.iter().for_each(|lost| track_line(text, state.suite(), &lost.track));
    if unit.lost_more > 0 {
        line(text, format_args!("         and {} more tracks LOST", unit.lost_more));
    }
}

fn track_line(text: &mut String, suite: Suite, labelled: &Labelled<ReportedTrack>) {
    let (track, freshness) = labelled.get();
    let (x, y) = (metres(track.x_mm), metres(track.y_mm));
    let confidence = f64::from(track.confidence) / 1000.0;
    let class = track.class.name();
    let (word, age) = (word(freshness), age(labelled.age()));
    line(
        text,
        format_args!(
            "         track {:<3} {class:<8} {confidence:.2}  ({x:.1}, {y:.1}) m  {word} {age}  by {}{}",
            track.id.0,
            joined(names(suite, track.supported).map(str::to_owned)),
            contradicting(suite, track),
        ),
    );
}

/// The modalities that contradict a track, if any.
fn contradicting(suite: Suite, track: &ReportedTrack) -> String {
    let by = joined(names(suite, track.contradicted).map(str::to_owned));
    if track.contradicted.count() == 0 { String::new() } else { format!(", CONTRADICTED by {by}") }
}

/// Sensors by name.
pub(crate) fn names(suite: Suite, modalities: Modalities) -> impl Iterator<Item = &'static str> {
    Modality::ALL
        .into_iter()
        .filter(move |modality| modalities.contains(*modality))
        .map(move |modality| suite.sensor(modality))
}

fn command_line(text: &mut String, time: Instant, command: &ShownCommand) {
    let life = life(command.life, time);
    let ago = ago(time.since(command.since));
    let (kind, giver) = (command.kind.name(), command.by.words());
    line(text, format_args!("command  {} {kind} to {} by {giver}: {life}, {ago:.1} s ago", command.id, command.unit));
}

pub(crate) fn life(life: Life, now: Instant) -> String {
    match life {
        Life::Requested => "requested".to_owned(),
        Life::Staged => "staged".to_owned(),
        Life::Released => "confirmed".to_owned(),
        Life::Sent => "sent".to_owned(),
        Life::Stored(due) if now < due => format!("stored, due in {:.1} s", due.since(now).as_ms() / 1000.0),
        Life::Stored(due) => format!("stored, due {:.1} s ago", now.since(due).as_ms() / 1000.0),
        Life::Executed => "executed".to_owned(),
        Life::RefusedByUnit(reason) => format!("REFUSED by the unit: {}", reason.name()),
        Life::RefusedByGateway(Some(reason)) => format!("REFUSED by the gateway: {}", reason.name()),
        Life::RefusedByGateway(None) => "REFUSED by the gateway: it lost its session".to_owned(),
        Life::Expired => "EXPIRED".to_owned(),
        Life::NotAcknowledged => "NOT ACKNOWLEDGED".to_owned(),
    }
}

fn line(text: &mut String, content: core::fmt::Arguments<'_>) {
    writeln!(text, "{content}").expect("writing to a String cannot fail");
}

fn joined(items: impl Iterator<Item = String>) -> String {
    let items: Vec<String> = items.collect();
    if items.is_empty() { "none".to_owned() } else { items.join(", ") }
}

fn metres(mm: i32) -> f64 {
    f64::from(mm) / 1000.0
}

/// Tenths of a second, begun ones too.
fn ago(span: Span) -> f64 {
    span.0.div_ceil(100_000) as f64 / 10.0
}

fn age(span: Span) -> String {
    if span == Span(u64::MAX) { "of unknown age".to_owned() } else { format!("{} ms", span.0.div_ceil(1000)) }
}

pub(crate) fn word(freshness: Freshness) -> &'static str {
    match freshness {
        Freshness::Fresh => "fresh",
        Freshness::Late => "LATE",
        Freshness::Stale => "STALE",
        Freshness::Lost => "LOST",
    }
}
