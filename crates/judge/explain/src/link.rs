//! A supervision lease that lapsed: the way of the telemetry link that failed first, or the reason that the gateway granted none.
//!
//! The gateway grants while it hears the unit and while no HOLD is unacknowledged. So a lapse is distinguished by the records that each
//! end went on accepting: after the uplink fails grants stop *Tf* later, after a HOLD at once, and after the downlink fails
//! the gateway still hears the unit.

use evidence::Micros;
use ground_truth::Any;
use wire::command::CommandKind;
use wire::event::{Account, Event, Interface};
use wire::feed::CommandStage;
use wire::id::{CommandId, NodeId, PeerId, RecordId};
use wire::mode::Because;

use super::chain::from;
use super::log::stages;
use super::{Change, FaultSite, LinkStage, Log, Origin};

/// Greatest difference between the times at which two ends note one failure: a period and a record's delay. Less than
/// *Tf*, so that it does not hide the order of failures.
const SLACK: Micros = 150_000;
/// Greatest time between records that arrive at once.
const AT_ONCE: Micros = 5_000;
/// Longest pause in the log of a console that runs: it logs its display several times a second.
const CONSOLE_SPEAKS: Micros = 1_000_000;
/// Longest time until the loser of a session takes it back: the longest pause of a client is 0.8 s.
const IN_TURNS: Micros = 1_500_000;
/// Longest time until the loser of a session logs the loss.
const LOST_WITHIN: Micros = 200_000;
/// Statement of the unit on a link that is silent both ways.
const PASSES_NOTHING: &str = "nothing passes between unit and gateway, either way";

/// Origin of a lapsed lease.
pub(super) fn lease(log: &Log, change: &Change) -> Origin {
    // The last accepted grant.
    let granted = if let Because::Silence(stamp) = change.because { change.on_trace(stamp) } else { 0 };
    if let Some(origin) = held(log, change, granted) {
        return origin;
    }
    let period = log.bounds.telemetry_period_ms * 1000;
    let freshness = log.bounds.freshness_ms * 1000;
    let heard = log.accepted(NodeId::GATEWAY, Interface::Uplink, PeerId::UNIT_A, 0, change.at);
    let last_heard = heard.last().copied().unwrap_or(0);
    let late_up = refused_up(log, last_heard.saturating_sub(SLACK), change.at);
    let late_down = refused_down(log, granted, change.at);
    if last_heard + freshness <= granted + SLACK {
        // Grants stopped because nothing of the unit had been accepted for *Tf*.
        return uplink(log, change, last_heard, &late_up).refusing(NodeId::UNIT_A, &late_down);
    }
    // The gateway heard the unit after its last grant, or both ends still refused records: the way down failed.
    if last_heard > granted + period + SLACK || !late_up.is_empty() && !late_down.is_empty() {
        return downlink(granted, &late_down).refusing(NodeId::GATEWAY, &late_up);
    }
    let silent = || silent(log, change, last_heard.max(granted));
    if let Some(origin) = (late_up.is_empty() && late_down.is_empty()).then(silent).flatten() {
        return origin;
    }
    let lasted = (change.at - granted.min(change.at)) / 1000;
    let name = match lasted + period / 1000 < log.bounds.lease_ms {
        true => format!("grants come so late that the last one lasts {lasted} ms"),
        false => PASSES_NOTHING.to_owned(),
    };
    let origin = from(NodeId::UNIT_A, FaultSite::Telemetry, granted, name);
    origin.refusing(NodeId::UNIT_A, &late_down).refusing(NodeId::GATEWAY, &late_up)
}

fn uplink(log: &Log, change: &Change, since: Micros, refused: &[(Micros, String)]) -> Origin {
    let name = match refused.is_empty() {
        true => "the gateway hears nothing of the unit",
        false => "the gateway accepts nothing of the unit",
    };
    let limit = log.bounds.freshness_ms;
    let stopped = (since + limit * 1000).min(change.at);
    from(NodeId::GATEWAY, FaultSite::Uplink, since, name).refusing(NodeId::GATEWAY, refused).with_link(
        LinkStage::Health,
        stopped,
        NodeId::GATEWAY,
        format!("no grant to a unit of which nothing newer than {limit} ms was accepted"),
    )
}

fn downlink(granted: Micros, refused: &[(Micros, String)]) -> Origin {
    let name = match refused.is_empty() {
        true => "the unit hears no grant, while the gateway hears the unit",
        false => "the unit accepts no grant, while the gateway hears the unit",
    };
    from(NodeId::UNIT_A, FaultSite::Downlink, granted, name).refusing(NodeId::UNIT_A, refused)
}

/// A HOLD that the unit did not carry out: the gateway grants no lease until it does.
fn held(log: &Log, change: &Change, granted: Micros) -> Option<Origin> {
    let near = |time: Micros| time + SLACK >= granted && time <= granted + SLACK;
    let (sent, id) =
        log.entries_by(NodeId::CONSOLE).filter(|w| w.at <= change.at).find_map(|w| match w.entry.event {
            Any::Service(Event::Intended { command, kind: CommandKind::Hold, .. }) => {
                let sent =
                    stages(log, command, change.at).into_iter().find(|(_, stage)| *stage == CommandStage::Sent)?;
                near(sent.0).then_some((sent.0, command))
            }
            _ => None,
        })?;
    let origin = match late_console(log, sent) {
        Some((since, until)) => {
            let name = format!(
                "the console itself wrote nothing for {} ms, and gave its orders after that",
                (until - since) / 1000
            );
            let unheeded = format!("HOLD {id} was sent and is not carried out");
            from(NodeId::CONSOLE, FaultSite::Console, since, name).with_link(
                LinkStage::Health,
                sent,
                NodeId::GATEWAY,
                unheeded,
            )
        }
        None => {
            from(NodeId::GATEWAY, FaultSite::CommandPlane, sent, format!("HOLD {id} was sent and is not carried out"))
        }
    };
    let origin = match session_taken(log, sent) {
        Some((since, peer)) if origin.place == FaultSite::CommandPlane => {
            let name = format!("the broker gave the session of {peer} to somebody else who came under its identity");
            let unheeded = format!("HOLD {id} was sent and is not carried out");
            from(NodeId::BROKER, FaultSite::CommandPlane, since, name).with_link(
                LinkStage::Health,
                sent,
                NodeId::GATEWAY,
                unheeded,
            )
        }
        Some(_) | None => origin,
    };
    let requested = log.last(NodeId::CONSOLE, sent, |event| has_command(event, id));
    let origin = match requested {
        Some((at, ())) => {
            origin.with_link(LinkStage::Cause, at, NodeId::CONSOLE, format!("{} asked for a HOLD", id.operator))
        }
        None => origin,
    };
    Some(origin.with_link(LinkStage::Health, sent, NodeId::GATEWAY, "no grant while a HOLD is unacknowledged"))
}

/// Time since which another party and the owner (the unit or the gateway) took a session from each other in turns, and
/// that owner; none unless the other party held the session when a command went out at `sent`.
fn session_taken(log: &Log, sent: Micros) -> Option<(Micros, PeerId)> {
    let owners = [(PeerId::UNIT_A, NodeId::UNIT_A), (PeerId::GATEWAY, NodeId::GATEWAY)];
    owners.into_iter().find_map(|(owner, node)| {
        let inputs =
            log.entries_by(NodeId::BROKER).rev().filter(|w| w.at <= sent).filter_map(|w| match w.entry.event {
                Any::Service(Event::TakenOver { peer }) if peer == owner => Some(w.at),
                _ => None,
            });
        let mut inputs = inputs.peekable();
        // Owner and thief both take the session over. Only the takeover after which the owner logs a loss is the
        // thief's.
        let last = *inputs.peek().filter(|time| **time + IN_TURNS >= sent)?;
        let lost =
            log.first(node, last, |event| matches!(event, Any::Service(Event::SessionLost { .. })).then_some(()));
        lost.filter(|(time, ())| *time <= last + LOST_WITHIN)?;
        let mut since = last;
        for at in inputs {
            if at + IN_TURNS < since {
                break;
            }
            since = at;
        }
        Some((since, owner))
    })
}

/// A pause of the console's that ends right before a command went out at `sent`: an order given then was given late.
fn late_console(log: &Log, sent: Micros) -> Option<(Micros, Micros)> {
    let written: Vec<Micros> = log.entries_by(NodeId::CONSOLE).map(|w| w.at).take_while(|time| *time <= sent).collect();
    let pause = written.windows(2).rev().find(|pair| pair[1] - pair[0] > CONSOLE_SPEAKS)?;
    (pause[1] + SLACK >= sent).then_some((pause[0], pause[1]))
}

fn has_command(event: &Any, id: CommandId) -> Option<()> {
    matches!(event, Any::Service(Event::Intended { command, .. }) if *command == id).then_some(())
}

/// Origin of a silence in which no record passes: the gateway or the link. A gateway that is gone closes no account,
/// and the broker loses it. The next record of a gateway that stood still has the number at which it stopped. A gateway
/// that runs goes on writing to a unit that does not hear it. Where the unit hears none, the gateway's closing account
/// decides, if the gateway served no other unit. A gateway that served others too is recognised by their records: the
/// unit's link does not hold them up.
fn silent(log: &Log, change: &Change, last: Micros) -> Option<Origin> {
    let ends = log.entries().iter().find(|w| closes(&w.entry.event)).map_or(Micros::MAX, |w| w.at);
    let closed = log.entries_by(NodeId::GATEWAY).any(|w| closes(&w.entry.event));
    let lost = log.first(NodeId::BROKER, last, |event| match event {
        Any::Service(Event::Session { peer: PeerId::GATEWAY, open: false }) => Some(()),
        _ => None,
    });
    let gateway = |name: &str| from(NodeId::GATEWAY, FaultSite::Gateway, last, name);
    let wrote_on = log.entries_by(NodeId::GATEWAY).next_back().is_some_and(|w| w.at > change.at);
    if !closed && !wrote_on && ends < Micros::MAX {
        return Some(gateway("the gateway wrote nothing more, and closed no account"));
    }
    if lost.is_some_and(|(time, ())| time <= change.at && time < ends) {
        return Some(gateway("the broker lost the gateway, and the unit hears nothing of it"));
    }
    match heard_others(log, change, last) {
        Some(true) if !started_anew(log, change) => return None,
        // If the links of all units failed at once, the gateway went on writing.
        Some(false) if !wrote_on_regularly(log, change, last) => {
            return Some(gateway("the gateway took in nothing of anybody, the unit or others"));
        }
        Some(_) | None => {}
    }
    match written_unheard(log, change).or_else(|| written_in_all(log, change)) {
        // A gateway that stood still receives everything that waited for it at once.
        Some(0) if one_by_one(log, last) => None,
        Some(0) => {
            Some(gateway("the gateway wrote nothing: its records to the unit continue, or end, where they had stopped"))
        }
        Some(_) => None,
        None => {
            let name = format!("{PASSES_NOTHING}, or the gateway itself stood still: the unit heard no more of it");
            Some(from(NodeId::UNIT_A, FaultSite::Telemetry, last, name).or(FaultSite::Gateway))
        }
    }
}

/// True if the gateway went on hearing others after it had last heard the unit. None where it had not heard them as
/// often before, or where it wrote only of other things meanwhile.
fn heard_others(log: &Log, change: &Change, last: Micros) -> Option<bool> {
    let of_another = |event: &Any| {
        matches!(
            event,
            Any::Service(Event::Accepted { at: Interface::Uplink, peer, .. }) if *peer != PeerId::UNIT_A
        )
    };
    let count_between = |from: Micros, to: Micros, wanted: &dyn Fn(&Any) -> bool| {
        log.entries_by(NodeId::GATEWAY).filter(|w| w.at > from && w.at <= to && wanted(&w.entry.event)).count()
    };
    // A record that arrived before the gateway stood still may be taken in up to a period later.
    let after = last + log.bounds.telemetry_period_ms * 1000 + SLACK;
    let before = last.saturating_sub(change.at.saturating_sub(after));
    let heard = count_between(after, change.at, &of_another) > 0;
    let known = heard || count_between(after, change.at, &|_| true) == 0;
    (known && count_between(before, last, &of_another) > 1).then_some(heard)
}

/// True if the gateway was started between its records that the unit accepted before the change and after.
fn started_anew(log: &Log, change: &Change) -> bool {
    let before = log.last(NodeId::UNIT_A, change.at, heard);
    let after = log.first(NodeId::UNIT_A, change.at + 1, heard);
    before.zip(after).is_some_and(|((_, before), (_, after))| before.boot != after.boot)
}

/// True if the gateway wrote to the unit about as often as it does while the unit did not hear it.
fn wrote_on_regularly(log: &Log, change: &Change, last: Micros) -> bool {
    let until = log.first(NodeId::UNIT_A, change.at + 1, heard).map_or(last, |(time, _)| time);
    let due = until.saturating_sub(last) / (log.bounds.telemetry_period_ms * 1000);
    due > 0 && written_unheard(log, change).is_some_and(|written| written * 2 >= due)
}

/// True if the records of the unit that the gateway next hears after `last` come singly, as sent, though late.
fn one_by_one(log: &Log, last: Micros) -> bool {
    let entries = log.entries_by(NodeId::GATEWAY).filter(|w| w.at > last).filter(|w| match w.entry.event {
        Any::Service(Event::Accepted { at: Interface::Uplink, peer, .. }) => peer == PeerId::UNIT_A,
        Any::Service(Event::Refused { at: Interface::Uplink, peer, .. }) => peer == Some(PeerId::UNIT_A),
        _ => false,
    });
    let times: Vec<Micros> = entries.map(|w| w.at).take(2).collect();
    matches!(times[..], [first, second] if second - first > AT_ONCE)
}

/// Number of records that the gateway wrote to the unit between the last that was accepted before the change and the
/// first after it, by their record numbers. None without such a first record, or where it belongs to another session,
/// in which numbers begin again. A record that arrived alone and was refused does not count: it was written when
/// traffic passed again. Records that a link held back arrive at once.
fn written_unheard(log: &Log, change: &Change) -> Option<u64> {
    let (since, before) = log.last(NodeId::UNIT_A, change.at, heard)?;
    let (until, after) = log.first(NodeId::UNIT_A, change.at + 1, heard)?;
    // A gateway that was started again wrote nothing in between.
    if started_anew(log, change) {
        return Some(0);
    }
    if log.first(NodeId::UNIT_A, since, opened).is_some_and(|(time, ())| time <= until) {
        return None;
    }
    let isolated = by_themselves(log, change, until);
    Some(after.sequence.0.saturating_sub(before.sequence.0 + 1).saturating_sub(isolated))
}

/// Number of the gateway's records that came after the change, up to `until`, and were refused, with no other beside them.
fn by_themselves(log: &Log, change: &Change, until: Micros) -> u64 {
    let mut times: Vec<Micros> = refused_down(log, change.at, until).iter().map(|(time, _)| *time).collect();
    let refused = times.len();
    times.push(until);
    let is_isolated =
        |i: &usize| times.iter().enumerate().all(|(k, time)| k == *i || time.abs_diff(times[*i]) > AT_ONCE);
    (0..refused).filter(is_isolated).count() as u64
}

/// Records that the gateway wrote in the whole run and the unit never accepted, by the gateway's closing account and
/// the unit's progress in each session. None where the gateway served others as well.
fn written_in_all(log: &Log, change: &Change) -> Option<u64> {
    let (_, before) = log.last(NodeId::UNIT_A, change.at, heard)?;
    let gateway = || log.entries_by(NodeId::GATEWAY).filter(|w| w.entry.boot == before.boot).map(|w| w.entry.event);
    if gateway().any(|e| matches!(e, Any::Service(Event::Session { peer, open: true }) if peer != PeerId::UNIT_A)) {
        return None;
    }
    let sent = gateway().find_map(|event| match event {
        Any::Service(Event::Count { account: Account::Sent, n }) => Some(n),
        _ => None,
    })?;
    Some(sent.saturating_sub(heard_in_all(log)).saturating_sub(by_themselves(log, change, Micros::MAX)))
}

/// The newest number of the gateway's that the unit accepted in each of its sessions, added up.
fn heard_in_all(log: &Log) -> u64 {
    let (mut all, mut newest) = (0, 0);
    for w in log.entries_by(NodeId::UNIT_A) {
        if opened(&w.entry.event).is_some() {
            all += std::mem::take(&mut newest);
        } else if let Some(record) = heard(&w.entry.event) {
            newest = newest.max(record.sequence.0);
        }
    }
    all + newest
}

/// A session of the unit's with the gateway.
fn opened(event: &Any) -> Option<()> {
    matches!(event, Any::Service(Event::Session { peer: PeerId::GATEWAY, open: true })).then_some(())
}

/// The gateway's own record that the unit accepted.
fn heard(event: &Any) -> Option<RecordId> {
    match *event {
        Any::Service(Event::Accepted { at: Interface::Downlink, record, .. }) if record.node == NodeId::GATEWAY => {
            Some(record)
        }
        _ => None,
    }
}

fn closes(event: &Any) -> bool {
    matches!(event, Any::Service(Event::Count { .. }))
}

fn refused_up(log: &Log, from: Micros, to: Micros) -> Vec<(Micros, String)> {
    log.refused(
        NodeId::GATEWAY,
        |interface, peer| interface == Interface::Uplink && peer == Some(PeerId::UNIT_A),
        from,
        to,
    )
}

fn refused_down(log: &Log, from: Micros, to: Micros) -> Vec<(Micros, String)> {
    log.refused(
        NodeId::UNIT_A,
        |interface, peer| interface == Interface::Downlink && peer == Some(PeerId::GATEWAY),
        from,
        to,
    )
}
