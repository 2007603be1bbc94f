//! Obstacles to a mode at some moment, from the services' logs up to then.
//!
//! Guards are logged when the mode changes. A failure between two changes is distinguished from the newest sign of each: a missing
//! modality or fix, a lease without grants, seals without news. A guard without its own sign is reported as it was last.

use evidence::Micros;
use ground_truth::Any;
use serde::Serialize;
use wire::event::{Event, Interface};
use wire::id::{NodeId, PeerId};
use wire::mode::{Cause, Guard, Mode};
use wire::sensor::Modality;

use super::{Change, Log};

/// Obstacles between the unit and a mode.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct WhyNot {
    /// The mode asked about.
    pub wanted: Mode,
    /// Time, trace time.
    pub at_us: Micros,
    /// The mode it was in.
    pub mode: Mode,
    /// Since when.
    pub since_us: Micros,
    /// Requirements that were not met, in words. Empty where it was in the mode.
    pub blocks: Vec<String>,
}

/// Reason that the unit is not in `wanted` at `time`.
pub fn why_not(log: &Log, wanted: Mode, time: Micros) -> WhyNot {
    let change = log.changes().into_iter().rev().find(|c| c.at <= time);
    let (mode, since) = change.map_or((Mode::Idle, 0), |c| (c.to, c.at));
    let mut blocks = Vec::new();
    if mode != wanted {
        blocks.push(way(mode, wanted));
        blocks.extend(needed(mode, wanted).map(|kind| order(log, kind, since, time)));
        blocks.extend(lacking(log, change.as_ref(), time));
    }
    WhyNot { wanted, at_us: time, mode, since_us: since, blocks }
}

/// The rule for getting there.
fn way(mode: Mode, wanted: Mode) -> String {
    let rule = match (mode, wanted) {
        (_, Mode::Idle) => "IDLE is where a started unit is, and nothing leads back to it",
        (_, Mode::HoldSafe) => "HOLD_SAFE takes an operator's HOLD or a loss of trust, and neither came",
        (_, Mode::Degraded) => "DEGRADED takes the loss of a subsystem in READY or PREPARE_TO_ACT",
        (Mode::Idle, _) => "IDLE is left by an operator's enable alone, with every guard holding",
        (Mode::HoldSafe, _) => "HOLD_SAFE is left by an operator's resume alone, with every guard holding",
        (Mode::Degraded, _) => "DEGRADED is left once every guard has held for the hysteresis time",
        (Mode::Ready, _) => "PREPARE_TO_ACT takes an operator's arm on a good track, with every guard holding",
        (Mode::PrepareToAct, _) => "authority stands: it ends by a disarm, an act, its time or a loss",
    };
    rule.to_owned()
}

/// The order that it takes first, if one.
fn needed(mode: Mode, wanted: Mode) -> Option<&'static str> {
    match (mode, wanted) {
        (Mode::Idle, Mode::Ready | Mode::PrepareToAct) => Some("enable"),
        (Mode::HoldSafe, Mode::Ready | Mode::PrepareToAct) => Some("resume"),
        (Mode::Ready, Mode::PrepareToAct) => Some("arm"),
        (_, Mode::HoldSafe) => Some("hold"),
        _ => None,
    }
}

/// Result of the newest order of this kind since then.
fn order(log: &Log, kind: &str, since: Micros, time: Micros) -> String {
    let mut orders =
        log.entries_by(NodeId::CONSOLE).filter(|w| w.at >= since && w.at <= time).filter_map(|w| match w.entry.event {
            Any::Service(Event::Intended { command, kind: k, .. }) if k.name() == kind => Some((w.at, command)),
            _ => None,
        });
    let Some((requested, id)) = orders.next_back() else {
        return format!("no operator asked for {kind} since {} ms", since / 1000);
    };
    let judged = log.first(NodeId::UNIT_A, requested, |event| match *event {
        Any::Service(Event::Executed { command, refused, .. }) if command == id => Some(refused),
        _ => None,
    });
    let requested = format!("{kind} was asked for at {} ms", requested / 1000);
    match judged.filter(|(judged, _)| *judged <= time) {
        Some((judged, Some(reason))) => format!("{requested}, and refused at {} ms: {}", judged / 1000, reason.name()),
        Some((judged, None)) => format!("{requested}, and carried out at {} ms", judged / 1000),
        None => format!("{requested}, and the unit has not judged it"),
    }
}

/// Failures at `time`, by the newest sign of each.
fn lacking(log: &Log, change: Option<&Change>, time: Micros) -> Vec<String> {
    let mut found = Vec::new();
    let seen = log.last(NodeId::PERCEPTION, time, |event| match *event {
        Any::Service(Event::FrameSeen { present, .. }) => Some(present),
        _ => None,
    });
    let is_absent = |m: &Modality| seen.is_some_and(|(_, present)| !present.contains(*m));
    found.extend(Modality::ALL.into_iter().filter(is_absent).map(|m| format!("frames come without {}", m.name())));
    let navigation = log.last(NodeId::UNIT_A, time, |event| match *event {
        Any::Service(Event::NavigationSeen { fix, odometry }) => Some((fix, odometry)),
        _ => None,
    });
    if let Some((_, (fix, odometry))) = navigation {
        found.extend((!fix).then(|| "navigation comes without a fix".to_owned()));
        found.extend((!odometry).then(|| "navigation comes without odometry".to_owned()));
    }
    let lease = log.bounds.lease_ms * 1000;
    let granted = log.accepted(NodeId::UNIT_A, Interface::Downlink, PeerId::GATEWAY, time.saturating_sub(lease), time);
    found.extend(granted.is_empty().then(|| format!("nothing of the gateway was accepted for {} ms", lease / 1000)));
    let limit = log.bounds.seal_limit_ms * 1000;
    let sealed =
        log.last(NodeId::RECORDER, time, |event| matches!(event, Any::Service(Event::Sealed { .. })).then_some(()));
    let stale = sealed.is_none_or(|(sealed, ())| time - sealed > limit);
    found.extend(stale.then(|| format!("no seal for {} ms", limit / 1000)));
    if let Some(Change { at, cause: Cause::Lost(guard) | Cause::Unrecovered(guard), .. }) = change
        && !tells_itself(*guard)
    {
        found.push(format!("{} failed at {} ms, and nothing says that it holds again", guard.name(), at / 1000));
    }
    found
}

/// True if the log shows the guard's state by other entries than the change of mode.
fn tells_itself(guard: Guard) -> bool {
    match guard {
        Guard::Rgb | Guard::Depth | Guard::Thermal | Guard::Lidar | Guard::Lease | Guard::SealedLog => true,
        Guard::Tracks | Guard::Localisation | Guard::Geofence | Guard::Teammates | Guard::Designation => false,
        Guard::Drift | Guard::TimeBase => false,
    }
}
