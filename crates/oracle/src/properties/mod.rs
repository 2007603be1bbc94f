//! P1 to P4 and P8 to P12, one function each, as far as they are not in files of their own (`mod` says which). Every one has been seen to fail on a log in which it is broken
//! (`tests/properties/oracle`).

pub(crate) mod p1_authority;
pub(crate) mod p5_content;
pub(crate) mod p6_conservation;
pub(crate) mod p7_display;
pub(crate) mod p8_commands;
pub mod process_fault;
pub(crate) mod speed;

use std::collections::{BTreeMap, BTreeSet};

use evidence::{Evidence, Finding, Micros, Plan, Planned, Property};
use instrument::{Any, FaultKind, Note, Sensor};
use wire::command::CommandKind;
use wire::event::Event;
use wire::id::ObjectId;
use wire::mode::{Cause, Mode};
use wire::sensor::Class;

use crate::arrived::{Befallen, Receipt};
use crate::motion::STANDING;
use crate::speed;
use crate::timeline::{Change, Kept, Timeline};
use crate::{SLACK, content, display, effect, finding, guards, link, planes, process_fault};

/// Checks every property but conservation.
pub(crate) fn check(evidence: &Evidence, line: &Timeline, receipt: &Receipt) -> Vec<Finding> {
    let mut found = Vec::new();
    found.extend(acts(evidence, line));
    found.extend(authority(evidence, line));
    found.extend(subsystem_loss(evidence, line, receipt));
    found.extend(lost_place(evidence, line, receipt));
    found.extend(link::trust(evidence, line, receipt));
    found.extend(speed::check(evidence, line));
    found.extend(effect::check(evidence, line));
    found.extend(guards::check(evidence, line, receipt));
    found.extend(geofence(line));
    found.extend(collision(line));
    found.extend(reserves(line));
    found.extend(content::check(evidence, line));
    found.extend(display::check(evidence, line));
    found.extend(planes::commands_shown(evidence, line));
    found.extend(planes::operators_hold(evidence, line));
    found.extend(commands(evidence, line));
    found.extend(recovery(evidence, line));
    found.extend(log(evidence));
    found
}

/// Checks the properties of a bare guest's run that truth supports: they need none of the guards and modes that it does not have.
pub(crate) fn of_bare_guest(evidence: &Evidence, line: &Timeline) -> Vec<Finding> {
    let objects = acts(evidence, line).into_iter().chain(authority(evidence, line));
    let mut found: Vec<Finding> = objects.filter(|finding| finding.property == Property::P11).collect();
    found.extend(speed::check(evidence, line));
    found.extend(geofence(line));
    found.extend(collision(line));
    found.extend(reserves(line));
    found.extend(commands(evidence, line));
    found.extend(log(evidence));
    found
}

/// P10: the log, and the cores that wrote it.
fn log(evidence: &Evidence) -> impl Iterator<Item = Finding> {
    let flaws = evidence.log_flaws.iter().map(ToString::to_string);
    let others = evidence.differences.iter().chain(&evidence.broken_log).cloned();
    flaws.chain(others).map(|what| finding(Property::P10, evidence.duration, what))
}

/// P1 and P11, from the plant's own record of the act.
fn acts(evidence: &Evidence, line: &Timeline) -> Vec<Finding> {
    let mut found = Vec::new();
    let acted: BTreeMap<u32, bool> = evidence
        .entries
        .iter()
        .filter_map(|w| match w.entry.event {
            Any::Service(Event::Acted { authority, failing, .. }) => Some((authority, failing.is_empty())),
            _ => None,
        })
        .collect();
    let mut used = BTreeSet::new();
    for w in &evidence.entries {
        let Any::Instrument(Note::PlantAct { authority, command, class, distance_mm, .. }) = w.entry.event else {
            continue;
        };
        let minted = line.minted.iter().any(|(at, serial, _)| *serial == authority && *at <= w.at);
        let revoked = line.revoked.iter().any(|(at, serial)| *serial == authority && *at <= w.at);
        if !minted || revoked || !used.insert(authority) {
            found.push(finding(
                Property::P1,
                w.at,
                format!("act under authority {authority}: minted {minted}, revoked {revoked}"),
            ));
        }
        if acted.get(&authority) != Some(&true) {
            found.push(finding(Property::P1, w.at, "act with a failing guard, or none recorded"));
        }
        let limit = evidence.bounds.command_limit_ms * 1000 + SLACK;
        let confirmed = line.intended.iter().any(|(at, id, kind)| {
            *id == command && matches!(kind, CommandKind::Confirm(_)) && *at <= w.at && w.at - *at <= limit
        });
        if !confirmed {
            found.push(finding(Property::P1, w.at, format!("act on {command}, which no operator confirmed in time")));
        }
        if class != Some(Class::Vehicle) || distance_mm > evidence.bounds.designation_mm {
            let what = format!(
                "act on {class:?} at {distance_mm} mm, vehicle within {} mm expected",
                evidence.bounds.designation_mm
            );
            found.push(finding(Property::P11, w.at, what));
        }
    }
    found
}

/// P1 and P11 of authority that is not used: it is held on the track that was ordered, and for no longer than it may live. A
/// unit that is kept from running cannot end it in time, nor use it.
fn authority(evidence: &Evidence, line: &Timeline) -> Vec<Finding> {
    let mut found = Vec::new();
    for w in &evidence.entries {
        let Any::Service(Event::Minted { track, command, .. }) = w.entry.event else { continue };
        let ordered = line.executed.iter().any(|(_, id, kind)| *id == command && *kind == CommandKind::Arm(track));
        if w.entry.node == evidence.under.node() && !ordered {
            found.push(finding(
                Property::P11,
                w.at,
                format!("authority on track {}, which {command} is not about", track.0),
            ));
        }
    }
    let kept = |plan: &Plan| matches!(plan.what, Planned::Suspend(node) | Planned::Kill(node) if node == evidence.under.node());
    if evidence.planned.iter().any(kept) {
        return found;
    }
    let limit = (evidence.bounds.authority_ms + evidence.bounds.control_period_ms) * 1000 + SLACK;
    let ends = line.changes.iter().skip(1).map(|c| c.at).chain([evidence.duration]);
    let held = line.changes.iter().zip(ends).filter(|(c, _)| c.to == Mode::PrepareToAct);
    let long = held.filter(|(c, until)| until.saturating_sub(c.at) > limit);
    found.extend(long.map(|(c, _)| {
        let what = format!("authority is held for longer than {} ms", evidence.bounds.authority_ms);
        finding(Property::P1, c.at + limit, what)
    }));
    found
}

/// P2: after a sensor is lost for good, or shows only the past, no authority and no nominal mode beyond *Td*.
fn subsystem_loss(evidence: &Evidence, line: &Timeline, receipt: &Receipt) -> Vec<Finding> {
    let td = evidence.bounds.to_degraded_ms * 1000;
    let lost = receipt.faults.iter().filter(|f| f.is_loss());
    let owed = lost.filter(|f| f.end.saturating_sub(f.start) > td && f.start + td <= evidence.duration);
    let late = owed.filter(|f| matches!(line.mode_at(f.start + td), Mode::Ready | Mode::PrepareToAct));
    late.map(|Befallen { sensor, start, .. }| {
        let mode = line.mode_at(start + td).name();
        finding(Property::P2, start + td, format!("{sensor:?} lost for {} ms and still {mode}", td / 1000))
    })
    .collect()
}

/// P3: after localisation is lost for good, which driving depends on, the unit holds within *Th*.
fn lost_place(evidence: &Evidence, line: &Timeline, receipt: &Receipt) -> Vec<Finding> {
    let th = evidence.bounds.to_hold_safe_ms * 1000;
    let owed = receipt.faults.iter().filter(|f| {
        let lost = f.kind == FaultKind::Dropout && f.sensor == Sensor::Localisation;
        lost && f.end.saturating_sub(f.start) > th && f.start + th <= evidence.duration
    });
    owed.filter_map(|f| {
        let mode = line.mode_at(process_fault::can_judge(evidence, evidence.under.node(), f.start + th));
        let what = format!("localisation lost for {} ms and still {}", th / 1000, mode.name());
        (!matches!(mode, Mode::HoldSafe | Mode::Idle)).then(|| finding(Property::P3, f.start + th, what))
    })
    .collect()
}

/// P4, from the true pose: outside is outside, whether the unit moves there or not.
fn geofence(line: &Timeline) -> Option<Finding> {
    let outside = line.truth.iter().find(|t| t.fence < 0)?;
    Some(finding(Property::P4, outside.at, format!("{} mm outside the fence", -outside.fence)))
}

/// Time after a touch in which one more, with the unit on its way off, is the object's pushing: a body that is pushed hops.
const PUSHES: Micros = 2_000_000;

/// P4: drives into nothing. The unit's own speed along the contact counts, in either sense: an object that runs into a standing unit or
/// into its side is no collision of the unit's, one that catches up with a driving unit is. One that pushes on is not: it has touched before.
fn collision(line: &Timeline) -> Option<Finding> {
    let pushes = |(at, object, speed): &(Micros, ObjectId, i32)| {
        let before = line.collisions.iter().filter(|(first, other, _)| other == object && first < at);
        *speed < 0 && before.map(|(first, ..)| at - first).min().is_some_and(|since| since <= PUSHES)
    };
    let counts = |touch: &&(Micros, ObjectId, i32)| touch.2.abs() > STANDING && !pushes(touch);
    let (at, object, speed) = line.collisions.iter().find(counts)?;
    Some(finding(Property::P4, *at, format!("drives into object {} at {speed} mm/s", object.0)))
}

/// P12: the stored energy takes the unit to safety at any time, and it keeps its distance to the surface below. Of a platform that leaves the ground.
fn reserves(line: &Timeline) -> Vec<Finding> {
    let first = |test: &dyn Fn(&Kept) -> bool, what: &str| {
        let broken = line.truth.iter().find(|t| t.kept.as_ref().is_some_and(test))?;
        Some(finding(Property::P12, broken.at, what))
    };
    let energy = first(&|kept| kept.energy < 0, "less energy than the way to safety takes");
    let clearance = first(&|kept| kept.clearance < 0, "nearer than the least distance to the surface below");
    energy.into_iter().chain(clearance).collect()
}

/// P8: at most once, never late, and none with a time tag outside its window.
fn commands(evidence: &Evidence, line: &Timeline) -> Vec<Finding> {
    let limit = evidence.bounds.command_limit_ms * 1000 + SLACK;
    let mut once = BTreeSet::new();
    let mut found = Vec::new();
    for (at, id, kind) in &line.executed {
        if !once.insert(*id) {
            found.push(finding(Property::P8, *at, format!("{} {id} executed again", kind.name())));
        }
        let given = line.intended.iter().find(|(_, command, _)| command == id).map(|(given, _, _)| *given);
        let Some(given) = given else { continue };
        let due = line.due(*id, given);
        // A time tag counts from a nonce that may have been issued earlier than the order was given, by the limit at most.
        let within = line.tags.get(id).map_or(limit, |(_, within)| within.saturating_add(SLACK));
        // A stored order to stop is made up for, and P3 judges its delay.
        let within = if line.stored.contains_key(id) && kind.towards_safe() { Micros::MAX } else { within };
        if at.saturating_sub(due) > within {
            let what = format!("{} {id} executed more than {} ms late", kind.name(), within / 1000);
            found.push(finding(Property::P8, *at, what));
        }
        let mut since = line.stored.get(id).into_iter().filter(|_| !kind.towards_safe());
        let held = line.executed.iter().filter(|(.., kind)| *kind == CommandKind::Hold).map(|(at, ..)| *at);
        let voided: Vec<Micros> = line.changes.iter().map(|c| c.at).chain(held).collect();
        if since.any(|stored| voided.iter().any(|change| change > stored && change + SLACK < *at)) {
            let what = format!("{} {id} executed though the mode has changed or a hold has come since", kind.name());
            found.push(finding(Property::P8, *at, what));
        }
        if at.saturating_add(limit) < due {
            let what = format!("{} {id} executed {} ms before it was due", kind.name(), (due - at) / 1000);
            found.push(finding(Property::P8, *at, what));
        }
    }
    found
}

/// P9: HOLD_SAFE ends by an operator's Resume only; PREPARE_TO_ACT begins by a new Arm only. That the unit executed one is
/// half of it; the other is that an operator gave one of that kind.
fn recovery(evidence: &Evidence, line: &Timeline) -> Vec<Finding> {
    let by = |wanted: fn(&CommandKind) -> bool, from: Micros, to: Micros| {
        let mut near = line.executed.iter().filter(|(at, ..)| *at + SLACK >= from && *at <= to + SLACK);
        near.any(|(at, id, kind)| wanted(kind) && line.gave(*id, *kind, *at))
    };
    let resume = |kind: &CommandKind| matches!(kind, CommandKind::Resume);
    let enable = |kind: &CommandKind| matches!(kind, CommandKind::Enable);
    let arm = |kind: &CommandKind| matches!(kind, CommandKind::Arm(_));
    let mut found = Vec::new();
    for change in &line.changes {
        let near = change.at.saturating_sub(SLACK);
        let left_hold = change.from == Mode::HoldSafe && change.to != Mode::HoldSafe && change.cause != Cause::Start;
        if left_hold && !(change.cause == Cause::Operator && by(resume, near, change.at)) {
            found.push(finding(Property::P9, change.at, "HOLD_SAFE left without an operator's resume"));
        }
        let least = (evidence.bounds.hysteresis_ms * 1000).saturating_sub(SLACK);
        let degraded = |c: &&Change| c.to == Mode::Degraded && c.at <= change.at;
        let since = line.changes.iter().rev().find(degraded).map_or(0, |c| c.at);
        if change.cause == Cause::Recovered && change.at - since < least {
            let what = format!("DEGRADED left after less than {} ms", evidence.bounds.hysteresis_ms);
            found.push(finding(Property::P9, change.at, what));
        }
        // A stop is safe from any mode.
        let left_idle = change.from == Mode::Idle && !matches!(change.to, Mode::Idle | Mode::HoldSafe);
        if left_idle && !(change.cause == Cause::Operator && by(enable, near, change.at)) {
            found.push(finding(Property::P9, change.at, "IDLE left without an operator's enable"));
        }
        if change.to == Mode::PrepareToAct && !(change.cause == Cause::Operator && by(arm, near, change.at)) {
            found.push(finding(Property::P9, change.at, "PREPARE_TO_ACT entered without an operator's arm"));
        }
    }
    found
}
