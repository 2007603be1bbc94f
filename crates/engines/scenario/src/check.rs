//! Checks of the parts of a scenario against each other: names, times, units, polygon, script, cells.
//!
//! Ranges of single values are held by their types (`scenario::value`); this file looks at values side by side. Each
//! finding names its place and its remedy.

use super::shared::on_control;
use ground_truth::{FaultKind, Sensor};
use std::collections::BTreeSet;
use wire::core::Topic;

use evidence::mission::Stage;
use wire::id::{NodeId, UnitId};

use super::accepted;
use super::attack::Act;
use super::check_steps;
use super::finding::{Finding, finding, unknown};
use super::footprint::Footprint;
use super::scene::{Object, Point};
use super::stack::{Certificate, Hand, Link, Observed, Stand};
use super::timed::Windowed;
use super::{Ending, Evidence, Located, Name, Outcome, Process, Role, Scenario, Scene, ThirdUnit, Under};

/// Every mistake in a scenario with a file named `stem`; its scene is looked at by [`scene`].
pub(super) fn scenario(s: &Scenario, stem: &str) -> Vec<Finding> {
    let mut found = Vec::new();
    if s.name.as_str() != stem {
        found.push(finding(&s.name, format!("the file is named `{stem}`"), "make name and file name the same"));
    }
    if s.threats.is_empty() {
        found.push(finding(&s.threats, "no threat named", "name at least one row of docs/reference/threats.md, or N0"));
    }
    found.extend(classes(&s.expected));
    found.extend(accepted::check(s));
    // A scenario may say that it has no class on another platform.
    let stated = s.under.iter().filter(|exception| exception.platform.is_none() || !exception.expected.is_empty());
    found.extend(stated.flat_map(|exception| classes(&exception.expected)));
    found.extend(s.under.iter().filter_map(neither));
    found.extend(phase(s));
    found.extend(times(s));
    found.extend(faults(s));
    found.extend(units(s));
    found.extend(operator(s));
    found.extend(s.attacks().into_iter().flat_map(|attack| attack.check(s)));
    found.extend(shared(s));
    found.extend(s.mandate.iter().filter_map(|mandate| unknown(&mandate.who)));
    found.extend(conditions(s));
    found.extend(stacks(s));
    found.extend(check_steps::steps(s));
    found.extend(kills(s));
    // Cells and curve are variations of the scenario: each would repeat its mistakes.
    if found.is_empty() {
        found.extend(cells(s));
        found.extend(curve(s));
    }
    found
}

/// Finding for an exception without condition: it has to name a policy, a platform or both.
fn neither(exception: &Under) -> Option<Finding> {
    let unconditional = exception.policy.is_none() && exception.platform.is_none();
    unconditional.then(|| {
        finding(
            &exception.expected,
            "neither a policy nor a platform",
            "name one; the scenario's own classes are its `expected`",
        )
    })
}

/// Mistakes in the keys of a process fault; each ending takes its own.
fn kills(s: &Scenario) -> Vec<Finding> {
    let mut found = Vec::new();
    for kill in &s.kill {
        let lasts = kill.duration_s.get() > 0.0;
        match kill.ending {
            Ending::Kill if lasts => {
                found.push(finding(&kill.at_s, "a kill has no duration", "take `duration_s` out, or say hang or slow"));
            }
            Ending::Hang | Ending::Slow | Ending::Full if !lasts => {
                found.push(finding(&kill.at_s, "this ends again, and nothing says when", "add `duration_s`"));
            }
            Ending::Full if kill.process != Process::Recorder => {
                found.push(finding(&kill.at_s, "only the recorder has a disk", "say `process = \"recorder\"`"));
            }
            Ending::Kill | Ending::Hang | Ending::Slow | Ending::Full => {}
        }
        match (&kill.quota, kill.ending) {
            (None, Ending::Slow) => {
                found.push(finding(&kill.at_s, "a slow process needs a quota", "add `quota`, such as 0.5"));
            }
            (Some(quota), Ending::Slow) if quota.get() <= 0.0 || quota.get() >= 1.0 => {
                found.push(finding(quota, "not a share of the time", "use a number above 0 and below 1"));
            }
            (Some(quota), Ending::Kill | Ending::Hang | Ending::Full) => {
                found.push(finding(quota, "a quota is for a slow process", "take it out, or say `ending = \"slow\"`"));
            }
            (Some(_), Ending::Slow) | (None, Ending::Kill | Ending::Hang | Ending::Full) => {}
        }
        if let Some(restart) = &kill.restart_after_s
            && (kill.ending != Ending::Kill || kill.process != Process::Autonomy)
        {
            found.push(finding(restart, "only autonomy is started again, and only after its end", "take it out"));
        }
    }
    found
}

/// Findings for a condition and an attack of the same kind: a receipt could not tell them apart.
fn conditions(s: &Scenario) -> Vec<Finding> {
    let lost = s.conditions.loss.get() > 0.0 && !(s.loss.is_empty() && s.burst_loss.is_empty());
    let held = s.conditions.jitter_ms.get() > 0 && !(s.delay.is_empty() && s.jitter.is_empty());
    let both = "a condition of the link and an attack of the same kind";
    let lost = lost.then(|| finding(&s.conditions.loss, both, "keep the condition or the attack"));
    let held = held.then(|| finding(&s.conditions.jitter_ms, both, "keep the condition or the attack"));
    lost.into_iter().chain(held).collect()
}

/// Mistakes in the tables of the real stacks: each cell once, and no action that its end cannot do.
fn stacks(s: &Scenario) -> Vec<Finding> {
    let mut found = Vec::new();
    if s.is_of_stacks() != (s.evidence == Evidence::Stack) {
        let remedy = "set `evidence = \"stack\"` where there are impostor, downgrade, handle, storm or observe tables, and nowhere else";
        found.push(finding(&s.name, "evidence and tables do not fit", remedy));
    }
    let mut seen = BTreeSet::new();
    for (cell, scenario) in s.stack_cells() {
        found.extend(classes(&scenario.expected));
        if !seen.insert(cell.clone()) {
            found.push(finding(&scenario.expected, format!("cell {cell} is there twice"), "take one out"));
        }
    }
    for one in &s.impostor {
        let listens = *one.end == Hand::Listens;
        if *one.end == Hand::Relays || (listens && *one.certificate == Certificate::Missing) {
            let remedy = "an impostor dials or listens, and a listener always has a certificate";
            found.push(finding(&one.end, "no such impostor", remedy));
        }
        if (*one.certificate == Certificate::OtherName && !listens)
            || (*one.certificate == Certificate::RevokedLater && (listens || one.link == Link::Command))
        {
            let remedy = "`other-name` is for who is dialled, `revoked-later` for who dials the telemetry link";
            found.push(finding(&one.certificate, "no such impostor", remedy));
        }
    }
    for one in s.observe.iter().filter(|one| *one.at == Stand::Late && one.link != Observed::Bus) {
        found.push(finding(&one.at, "no such observer", "rights on a channel are those of a bus"));
    }
    for one in &s.downgrade {
        if !crate::stack::can_be_lowered(one.link, *one.by, *one.to) {
            found.push(finding(&one.to, "no such downgrade", "docs/reference/scenarios.md lists those there are"));
        }
    }
    found
}

fn classes(expected: &Located<super::List<Outcome, 9>>) -> Option<Finding> {
    let distinct: BTreeSet<Outcome> = expected.iter().copied().collect();
    if expected.is_empty() {
        Some(finding(expected, "no expected class", "name the outcome classes that may come of it"))
    } else if distinct.len() != expected.len() {
        Some(finding(expected, "a class is named twice", "name each class once"))
    } else {
        None
    }
}

fn phase(s: &Scenario) -> Option<Finding> {
    let phase = &s.varies.injection_phase_s;
    match &phase[..] {
        [] => None,
        [from, to] if from <= to => None,
        [_, _] => Some(finding(phase, "the phase ends before it begins", "write it as [from, to]")),
        [_] | [_, _, ..] => Some(finding(phase, "a phase has two numbers", "write it as [from, to], or [] for none")),
    }
}

/// Everything with a time on the trial's clock.
pub(super) fn windows(s: &Scenario) -> Vec<&dyn Windowed> {
    let attacks = s.attacks().into_iter().map(|attack| attack as &dyn Windowed);
    let faults = s.fault.iter().map(|fault| fault as &dyn Windowed);
    attacks.chain(faults).chain(s.kill.iter().map(|kill| kill as &dyn Windowed)).collect()
}

fn times(s: &Scenario) -> Vec<Finding> {
    let (_, latest) = s.varies.phase_s();
    let end = s.duration_s.get();
    let late = s.windows().into_iter().filter(|w| w.at_s().get() + latest >= end);
    late.map(|w| {
        let message =
            format!("starts at {} s, up to {latest} s later by its phase; the trial ends at {end} s", w.at_s().get());
        finding(w.at_s(), message, "start it earlier or make the trial longer")
    })
    .collect()
}

/// Frames by which a camera may be late: fewer than the least are no older than a product may be.
const SKEW: (u8, u8) = (perception::content::REPEATS, ground_truth::MAX_SKEW);
// Fewer weak detections may be there anyway; a list has no room for more.
const CHAFF: (u8, u8) = (perception::CROWD as u8, ground_truth::MAX_CHAFF);

/// Range of a change to a byte, of 255.
const STRENGTH: (u8, u8) = (0, ground_truth::MAX_STRENGTH);

/// True if `number` is whole and within the range.
fn counts(number: f64, (least, most): (u8, u8)) -> bool {
    number.fract() == 0.0 && (f64::from(least)..=f64::from(most)).contains(&number)
}

/// A fault of odometry beyond its range.
fn check_magnitude(fault: &super::Fault, magnitude: &Located<super::Magnitude>) -> Option<Finding> {
    let range = super::fault::odometry_range(fault.kind).filter(|_| fault.sensor == Sensor::Odometry);
    let (least, most) = range?;
    let outside = magnitude.iter().any(|number| !(least..=most).contains(&number.get()));
    outside.then(|| finding(magnitude, "no error that odometry can be given", format!("use {least} to {most}")))
}

fn faults(s: &Scenario) -> Vec<Finding> {
    let mut found = Vec::new();
    for fault in &s.fault {
        if !fault.kind.fits(fault.sensor) {
            let message = format!("{:?} has no fault of kind {:?}", fault.sensor, fault.kind).to_lowercase();
            found.push(finding(
                &fault.at_s,
                message,
                "drift and jump are for localisation, height and odometry, scale is for odometry, time and wander are for localisation, occlusion for images, skew for colour and thermal, chaff and perturbation for colour",
            ));
            continue;
        }
        let needs = fault.kind.numbers(fault.sensor);
        match &fault.magnitude {
            Some(at) if at.len() != needs => {
                found.push(finding(at, format!("this kind takes {needs} numbers"), "see `holdsafe scenario schema`"));
            }
            Some(at) if fault.kind == FaultKind::Noise && at[0].get() < 1.0 => {
                found.push(finding(at, "noise is not made less", "use a factor of at least 1"));
            }
            Some(at) if fault.kind == FaultKind::Skew && !counts(at[0].get(), SKEW) => {
                let (least, most) = SKEW;
                found.push(finding(
                    at,
                    "no number of frames that can be told",
                    format!("use {least} to {most}: what is younger is no older than a product may be"),
                ));
            }
            Some(at) if fault.kind == FaultKind::Chaff && !counts(at[0].get(), CHAFF) => {
                let (least, most) = CHAFF;
                found.push(finding(
                    at,
                    "no number of detections that can be told",
                    format!("use {least} to {most}: fewer may be there anyway, and a list has no more room"),
                ));
            }
            Some(at) if fault.kind == FaultKind::Wander && !(0.0..=100.0).contains(&at[0].get()) => {
                found.push(finding(at, "no deviation that a receiver has", "use metres, 0 to 100"));
            }
            Some(at) if fault.kind == FaultKind::Occlusion && !(0.0..=1.0).contains(&at[0].get()) => {
                found.push(finding(at, "not a share", "use a number from 0 to 1"));
            }
            Some(at) if fault.kind == FaultKind::Perturbation && !counts(at[0].get(), STRENGTH) => {
                let (least, most) = STRENGTH;
                found.push(finding(
                    at,
                    "no strength of a perturbation",
                    format!("use a whole number, {least} to {most} of 255"),
                ));
            }
            Some(at)
                if fault.kind == FaultKind::Perturbation
                    && s.scene.iter().all(|scene| scene.perturbation.is_none()) =>
            {
                found.push(finding(
                    at,
                    "the scene has no perturbation",
                    "add `[perturbation]` to the scene, with `aims_at` and `rows`",
                ));
            }
            None if needs > 0 => {
                found.push(finding(&fault.at_s, "this kind needs a magnitude", "add `magnitude = [...]`"))
            }
            Some(_) | None => {}
        }
        found.extend(fault.magnitude.as_ref().and_then(|located| check_magnitude(fault, located)));
    }
    found
}

fn units(s: &Scenario) -> Vec<Finding> {
    let mut found = doubles(s.unit.iter().map(|u| &u.name));
    let team = [UnitId::B, UnitId::C];
    for unit in &s.unit {
        if UnitId::from_name(unit.name.as_str()).is_none_or(|id| !team.contains(&id)) {
            found.push(finding(&unit.name, "no such teammate", "a teammate is `unit-b` or `unit-c`"));
        }
    }
    let has_unit = |name: &str, role: Role| s.unit.iter().any(|u| u.name.as_str() == name && u.role == role);
    let forwards = s.teammate.first().map(|t| &t.at_s);
    let deceit = s.attacks().into_iter().find(|attack| matches!(attack.act(0), Some(Act::Teammate(_))));
    if let Some(deceit) = deceit
        && !has_unit("unit-b", Role::Insider)
    {
        found.push(finding(
            deceit.at_s(),
            "an insider acts and there is none",
            "add `[[unit]]` unit-b with role \"insider\"",
        ));
    }
    let needs_c = s.teammate.iter().any(|t| matches!(t.c, ThirdUnit::Present | ThirdUnit::Silent));
    if let Some(located) = forwards.filter(|_| needs_c)
        && !has_unit("unit-c", Role::Honest)
    {
        found.push(finding(located, "there is no unit C to forward", "add `[[unit]]` unit-c with role \"honest\""));
    }
    found
}

/// Findings for tables that differ in host or holder: one rogue process carries all of them out, on one host and with
/// the keys of one service or of none.
fn shared(s: &Scenario) -> Vec<Finding> {
    let mut found = Vec::new();
    let all: Vec<_> = s
        .attacks()
        .into_iter()
        .filter_map(|attack| match attack.act(0) {
            Some(Act::Rogue { channel, holder, .. }) => Some((attack.at_s(), channel, holder)),
            Some(_) | None => None,
        })
        .collect();
    let host = |topic: Topic| if on_control(topic) { "the control host" } else { "the vehicle's host" };
    for (at, topic, holder) in &all {
        if host(*topic) != host(all[0].1) {
            found.push(finding(at, "channels of two hosts", "put each host's into a scenario of its own"));
        }
        if *holder != all[0].2 {
            found.push(finding(at, "keys of two holders", "one process acts: give all tables the same `holder`"));
        }
        if holder.is_some_and(|holder| holder.on_control() != on_control(*topic)) {
            found.push(finding(at, "the holder is on another host", "name a service of the channel's host"));
        }
    }
    found
}

fn operator(s: &Scenario) -> Vec<Finding> {
    let mut found = Vec::new();
    for step in &s.operator.step {
        if step.verb.leads_away_from_safe() && step.reason.is_none() {
            found.push(finding(&step.verb, "a step away from safe needs a reason", "add `reason`"));
        }
        if *step.verb == evidence::mission::Verb::Revoke
            && step.who.as_ref().and_then(|n| NodeId::from_name(n.as_str())).is_none()
        {
            found.push(finding(&step.verb, "nobody is named to be revoked", "add `who`, such as \"operator-2\""));
        }
        if *step.verb == evidence::mission::Verb::Configure && step.values.is_none() {
            found.push(finding(&step.verb, "no values to set", "add `values`"));
        }
        if *step.verb == evidence::mission::Verb::Arm && step.when_track.is_none() {
            found.push(finding(&step.verb, "arming needs a track", "add `when_track` with the class"));
        }
        if step.at_s.get() >= s.duration_s.get() {
            found.push(finding(&step.at_s, "the trial is over by then", "do it earlier or make the trial longer"));
        }
        let Some(after) = &step.after_s else { continue };
        if *step.verb == evidence::mission::Verb::Revoke {
            found.push(finding(after, "a revocation is no command of the unit's", "leave `after_s` out"));
        }
        if step.at_s.get() + after.get() >= s.duration_s.get() {
            found.push(finding(after, "the trial is over by then", "make it shorter or the trial longer"));
        }
    }
    found.extend(s.mission.as_ref().filter(|stated| !leads_to(s, ***stated)).map(|stated| {
        let message = format!("no step of the operator leads to `{}`", stated.name());
        finding(stated, message, "add the step, or say how far the steps do lead")
    }));
    for pair in s.operator.step.windows(2) {
        if pair[1].at_s.get() < pair[0].at_s.get() {
            found.push(finding(&pair[1].at_s, "earlier than the step before", "put the steps in order of time"));
        }
    }
    found
}

/// True if the operator's steps can bring the mission to `stage`.
fn leads_to(s: &Scenario, stage: Stage) -> bool {
    stage == Stage::None || s.operator.step.iter().any(|step| Stage::from_verb(*step.verb) >= stage)
}

fn cells(s: &Scenario) -> Vec<Finding> {
    let mut seen = BTreeSet::new();
    let mut found = Vec::new();
    for cell in &s.cell {
        let name = cell.name.as_str();
        if !seen.insert(name) {
            found.push(finding(&cell.name, format!("cell {name} is there twice"), "give each cell its own name"));
        }
        found.extend(cell.expected.as_ref().and_then(classes));
        let finding_at =
            |message: String, remedy: &str| finding(&cell.name, format!("in cell {name}: {message}"), remedy);
        match s.with_cell(cell) {
            Ok(with) => found.extend(varied(&with).into_iter().map(|f| finding_at(f.message, &f.remedy))),
            Err(error) => found.push(finding_at(
                error.to_string(),
                "`set` takes paths of this file and values that could stand there",
            )),
        }
    }
    found
}

fn curve(s: &Scenario) -> Vec<Finding> {
    let Some(curve) = &s.curve else { return Vec::new() };
    let mut found = Vec::new();
    if curve.values.len() < 2 || curve.values.windows(2).any(|pair| pair[0] >= pair[1]) {
        found.push(finding(&curve.values, "no range", "give at least two values, each greater than the one before"));
    }
    found.extend(curve.expected.as_ref().and_then(classes));
    // The first point that does not fit represents all: they differ in one number.
    let wrong = s.points().into_iter().find_map(|point| match point {
        Ok(point) => varied(&point).into_iter().next().map(|f| (f.message, f.remedy)),
        Err(error) => Some((
            error.to_string(),
            "`set` takes the path of a number in this file, `values` what could stand there".into(),
        )),
    });
    found.extend(wrong.map(|(message, remedy)| finding(&curve.set, format!("on the curve: {message}"), remedy)));
    found
}

/// Every mistake in a scenario that differs from its file, and in its scene.
pub(super) fn varied(s: &Scenario) -> Vec<Finding> {
    scenario(s, s.name.as_str()).into_iter().chain(s.scene.iter().flat_map(scene)).collect()
}

/// Every mistake in a scene.
pub(super) fn scene(scene: &Scene) -> Vec<Finding> {
    let mut found = doubles(scene.object.iter().map(|o| &o.name));
    for object in &scene.object {
        if object.path_m.is_empty() {
            found.push(finding(&object.path_m, "the object is nowhere", "give at least one point"));
        }
        if let Some(times) = object.heated_s.as_ref().filter(|times| times[0].get() > times[1].get()) {
            found.push(finding(times, "its heating ends before it begins", "give the beginning, then the end"));
        }
    }
    let fence: Vec<(f64, f64)> = scene.geofence.iter().map(|[x, y]| (x.get(), y.get())).collect();
    if fence.len() < 3 {
        found.push(finding(&scene.geofence, "a geofence has at least three corners", "add corners, in order"));
        return found;
    }
    if !inside(&fence, (scene.start.at_m[0].get(), scene.start.at_m[1].get())) {
        found.push(finding(&scene.start, "the platform starts outside its geofence", "move the start or the fence"));
    }
    for object in scene.object.iter().filter(|object| covers(object, &scene.start.at_m)) {
        let message = format!("the platform starts inside `{}`", object.name.as_str());
        found.push(finding(&scene.start, message, "move the start or the object"));
    }
    for point in scene.route.iter() {
        if !inside(&fence, (point[0].get(), point[1].get())) {
            found.push(finding(point, "a way point lies outside the geofence", "move the point or the fence"));
        }
    }
    found
}

/// True if the footprint of an object, where it stands first, holds this point.
fn covers(object: &Object, at_m: &Point) -> bool {
    let Some(place) = object.path_m.first() else { return false };
    // An object that moves faces the way it goes.
    let heading = match object.path_m.get(1) {
        Some(next) if object.speed_m_s.get() > 0.0 => {
            libm::atan2(next[1].get() - place[1].get(), next[0].get() - place[0].get())
        }
        Some(_) | None => object.heading_rad.get(),
    };
    let [length, width, _] = object.size_m.map(|edge| edge.get());
    let footprint = Footprint { at: place.map(|along| along.get()), heading, size: [length, width] };
    footprint.distance(at_m.map(|along| along.get())) == 0.0
}

fn doubles<'a>(names: impl Iterator<Item = &'a Located<Name>>) -> Vec<Finding> {
    let mut seen = BTreeSet::new();
    names
        .filter(|name| !seen.insert(name.as_str()))
        .map(|name| finding(name, format!("`{}` is there twice", name.as_str()), "give each its own name"))
        .collect()
}

/// True if a point lies inside a polygon, by counting crossings.
fn inside(fence: &[(f64, f64)], (x, y): (f64, f64)) -> bool {
    let mut odd = false;
    for (i, &(x1, y1)) in fence.iter().enumerate() {
        let (x0, y0) = fence[(i + fence.len() - 1) % fence.len()];
        if (y1 > y) != (y0 > y) && x < (x0 - x1) * (y - y1) / (y0 - y1) + x1 {
            odd = !odd;
        }
    }
    odd
}
