//! Search from the cause that the unit names to the place where it began.

use evidence::Micros;
use ground_truth::Any;
use wire::event::{Event, Inconsistency, Interface};
use wire::feed::CommandStage;
use wire::id::{NodeId, UnitId};
use wire::mode::{Because, Cause, Guard};
use wire::refusal::Reason;

use super::chain::{from, of_unit};
use super::log::stages;
use super::{ChainStep, Change, FaultSite, LinkStage, Log, Origin, link, sensing};

/// Longest pause in the log of a unit that runs: it logs fixes a few times a second, and records ten times.
const UNIT_SPEAKS: Micros = 450_000;
/// Time within which a unit that stood still takes in the messages that waited for it.
const AT_ONCE: Micros = 5_000;
/// Least pause of a unit that is behind with everything that it reads.
const BEHIND: Micros = 250_000;

/// Origin of `change`.
pub(super) fn find(log: &Log, change: &Change) -> Origin {
    match change.cause {
        Cause::Operator => ordered(log, change),
        Cause::Lost(guard) | Cause::Unrecovered(guard) => {
            let mut origin = lost(log, change, guard);
            let label = format!("{} fails", guard.name());
            let also: Vec<&str> = change.failing.iter().filter(|g| *g != guard).map(Guard::name).collect();
            let what = if also.is_empty() { label } else { format!("{label}, and with it {}", also.join(", ")) };
            origin.steps.push(ChainStep { stage: LinkStage::Guard, at_us: change.at, by: NodeId::UNIT_A, what });
            origin
        }
        Cause::Start => itself(change, "the unit started"),
        Cause::Recovered => itself(change, "every guard has held for the hysteresis time"),
        Cause::Acted => itself(change, "the authority was used"),
        Cause::Expired => itself(change, "the authority was not used in time"),
    }
}

fn lost(log: &Log, change: &Change, guard: Guard) -> Origin {
    if let Some(origin) = stood_still(log, change) {
        return origin;
    }
    match guard {
        Guard::Rgb | Guard::Depth | Guard::Thermal | Guard::Lidar | Guard::Tracks => {
            sensing::product(log, change, guard)
        }
        Guard::Localisation | Guard::Drift | Guard::TimeBase => sensing::place(log, change, guard),
        Guard::Designation => sensing::designation(log, change),
        Guard::Geofence => of_unit(FaultSite::Course, change.at, "the unit came to its fence's margin"),
        Guard::Lease => link::lease(log, change),
        Guard::Teammates => claimed(log, change),
        Guard::SealedLog => unsealed(log, change),
    }
}

fn itself(change: &Change, name: &str) -> Origin {
    of_unit(FaultSite::Machine, change.at, name)
}

/// An order: who gave it, and the way that it took.
fn ordered(log: &Log, change: &Change) -> Origin {
    let Because::Command(id) = change.because else {
        return of_unit(FaultSite::Operator, change.at, "an order that the unit does not name");
    };
    let order = log.last(NodeId::CONSOLE, change.at, |event| match event {
        Any::Service(Event::Intended { command, kind, .. }) if *command == id => Some(*kind),
        _ => None,
    });
    let mut origin = match order {
        Some((since, kind)) => {
            from(NodeId::CONSOLE, FaultSite::Operator, since, format!("{} asked for {}", id.operator, kind.name()))
        }
        None => of_unit(FaultSite::Operator, change.at, format!("{id}, which no operator gave at this console")),
    };
    for (at_us, stage) in stages(log, id, change.at) {
        let name = format!("{id} is {}", stage_name(stage));
        origin = origin.with_link(LinkStage::Health, at_us, NodeId::GATEWAY, name);
    }
    origin
}

fn stage_name(stage: CommandStage) -> &'static str {
    match stage {
        CommandStage::Staged => "staged",
        CommandStage::Sent => "sent to the unit",
        CommandStage::Refused => "refused by the gateway",
        CommandStage::Expired => "expired at the gateway",
    }
}

/// Origin of a loss that a unit finds after a pause: the unit itself stood still, and did not see the loss happen.
fn stood_still(log: &Log, change: &Change) -> Option<Origin> {
    let before = log.entries_by(NodeId::UNIT_A).rev().find(|w| w.at < change.at)?.at;
    let gap = change.at - before;
    // A unit without navigation and without a link writes nothing either; it judges all the same, and finds both lost.
    let blind = change.failing.contains(Guard::Localisation) && change.failing.contains(Guard::Lease);
    let waited = log.first(NodeId::UNIT_A, change.at, |event| {
        matches!(event, Any::Service(Event::Accepted { .. } | Event::Refused { .. })).then_some(())
    });
    let lagged = waited.is_some_and(|(time, ())| time - change.at < 50_000);
    let was_still = gap > UNIT_SPEAKS && (lagged || !blind) || gap > BEHIND && behind_everywhere(log, change);
    was_still.then(|| {
        let name = format!("the unit itself wrote nothing for {} ms", gap / 1000);
        of_unit(FaultSite::Unit, before, name)
    })
}

/// True if with its verdict the unit takes in messages that had waited, from its own host and from the gateway. These
/// two have only the unit in common.
fn behind_everywhere(log: &Log, change: &Change) -> bool {
    let took_in = |wanted: &dyn Fn(&Any) -> bool| {
        let found = log.first(NodeId::UNIT_A, change.at, |event| wanted(event).then_some(()));
        found.is_some_and(|(time, ())| time - change.at < AT_ONCE)
    };
    let late = |event: &Any| {
        matches!(event, Any::Service(Event::Refused { at: Interface::Bus(_), reason: Reason::Stale, .. }))
    };
    let heard = |event: &Any| {
        matches!(
            event,
            Any::Service(
                Event::Refused { at: Interface::Downlink, .. } | Event::Accepted { at: Interface::Downlink, .. }
            )
        )
    };
    took_in(&late) && took_in(&heard)
}

/// A teammate's claim that contradicts something.
fn claimed(log: &Log, change: &Change) -> Origin {
    let found = log.last(NodeId::UNIT_A, change.at, |event| match *event {
        Any::Service(Event::Inconsistent { unit, finding, record }) => Some((unit, finding, record)),
        _ => None,
    });
    let Some((since, (unit, finding, record))) = found else {
        let unit = if let Because::Claim(unit) = change.because { unit } else { UnitId::B };
        return of_unit(FaultSite::Teammate(unit), change.at, "teammates' claims contradict each other");
    };
    let name = format!("{record} claims of {unit} what {}", contradiction(finding));
    of_unit(FaultSite::Teammate(unit), since, name)
}

fn contradiction(finding: Inconsistency) -> &'static str {
    match finding {
        Inconsistency::Kinematics => "no unit can do: it moved faster than it can",
        Inconsistency::Exclusion => "cannot be: two units at one place",
        Inconsistency::TimeBase => "runs against its own sequence or time",
        Inconsistency::Residual => "does not lead where its speed and heading do",
    }
}

/// The recorder's seals stopped coming, or were not accepted.
fn unsealed(log: &Log, change: &Change) -> Origin {
    let sealed = log
        .last(NodeId::RECORDER, change.at, |event| matches!(event, Any::Service(Event::Sealed { .. })).then_some(()));
    // The time by the unit, where it states one: a seal that was made but did not reach the unit does not count.
    let heard = if let Because::Silence(stamp) = change.because { change.on_trace(stamp) } else { change.at };
    let since = sealed.map_or(0, |(time, ())| time).min(heard);
    let refused = sensing::refused_on(log, change, since, &[wire::core::Topic::Seals]);
    from(NodeId::RECORDER, FaultSite::Recorder, since, "no seal over the unit's log since then")
        .refusing(NodeId::UNIT_A, &refused)
}
