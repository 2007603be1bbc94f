//! The command plane and the display, judged: receipts of a hostile broker's actions on publications, the display's
//! duties to the operator about commands (P7), and that an operator's HOLD takes hold (P3).
//!
//! A receipt is the broker's entry against the publication that the ingress of the receiving client saw come out of its
//! stream, by the hash of the payload. For one that was not passed on, its sender must have sent it, and that ingress must
//! have seen others but not this one.

use std::collections::BTreeMap;

use evidence::{Evidence, Finding, Micros, Property, Witnessed};
use instrument::{Action, Any, Note, Sight};
use wire::command::CommandKind;
use wire::core::Side;
use wire::event::{Event, ShownAs};
use wire::feed::CommandStage;
use wire::id::{CommandId, NodeId};
use wire::mode::Mode;

use crate::SLACK;
use crate::timeline::Timeline;
use crate::window::Window;
use crate::{finding, life};

/// The longest that a command may be shown as under way after the operator last did something about it.
const ANSWER_WITHIN: Micros = 1_000_000;

/// By how much of a delay the broker's clock may have run ahead of the trace's, as a divisor.
const DRIFT: u64 = 1_000;
/// Longest time from a sender's own entry to the broker's.
const ON_THE_WAY: Micros = 1_000_000;

/// The first entry of `wanted` within `window` that the client's ingress confirms.
pub(crate) fn broker(evidence: &Evidence, wanted: Action, window: Window) -> Option<Micros> {
    let told = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Attack { action, side, hash, delay, .. })
            if action == wanted && w.entry.node == NodeId::INSIDER_BROKER && window.has(w.at) =>
        {
            Some((w.at, side, hash, delay.0))
        }
        _ => None,
    });
    told.into_iter()
        .find(|(at, side, hash, delay)| {
            let seen: Vec<Micros> = delivered(evidence, *side, Some(*hash)).collect();
            match wanted {
                Action::Drop => {
                    let others = delivered(evidence, *side, None).next().is_some();
                    others && seen.is_empty() && sent(evidence, *side, *at)
                }
                Action::Delay => seen.iter().any(|s| s + delay / DRIFT >= at + delay),
                Action::Duplicate | Action::Replay => seen.len() > 1 && seen.iter().any(|s| s >= at),
                _ => seen.iter().any(|s| s >= at),
            }
        })
        .map(|(at, ..)| at)
}

/// Times at which the ingress of the client on `side` saw this payload, or any, come out of its stream.
fn delivered(evidence: &Evidence, side: Side, wanted: Option<u64>) -> impl Iterator<Item = Micros> {
    let client = match side {
        Side::Client => evidence.under.guard(),
        Side::Server => NodeId::GATEWAY.guard(),
    };
    evidence.entries.iter().filter(move |w| Some(w.entry.node) == client).filter_map(move |w| match w.entry.event {
        Any::Instrument(Note::StreamSaw { sight: Sight::Delivered, hash, .. })
            if wanted.is_none_or(|wanted| wanted == hash) =>
        {
            Some(w.at)
        }
        _ => None,
    })
}

/// True if the publisher towards `side` says that it had a message to publish just before. It may say so after
/// the broker, by as much as an entry lags behind its event.
fn sent(evidence: &Evidence, side: Side, at: Micros) -> bool {
    let before = |w: &&Witnessed| w.at <= at + SLACK && at <= w.at + ON_THE_WAY;
    evidence.entries.iter().filter(before).any(|w| match (side, w.entry.event) {
        (Side::Client, Any::Service(Event::Staged { stage: CommandStage::Sent, .. })) => {
            w.entry.node == NodeId::GATEWAY
        }
        (Side::Server, Any::Service(Event::Executed { .. } | Event::Stored { .. })) => {
            w.entry.node == evidence.under.node()
        }
        _ => false,
    })
}

/// P7 for commands, from the display's own record: none is shown as executed that the unit did not execute, and none is
/// shown as under way for longer than [`ANSWER_WITHIN`].
pub(crate) fn commands_shown(evidence: &Evidence, line: &Timeline) -> Vec<Finding> {
    let mut found = Vec::new();
    let mut due: BTreeMap<CommandId, Micros> = BTreeMap::new();
    let within = ANSWER_WITHIN + SLACK;
    for w in evidence.entries.iter().filter(|w| w.entry.node == NodeId::CONSOLE) {
        let Any::Service(Event::CommandShown { command, shown }) = w.entry.event else { continue };
        let one_step = line.intended.iter().any(|(_, id, kind)| *id == command && kind.towards_safe());
        match shown {
            ShownAs::Requested | ShownAs::Released => {
                due.insert(command, w.at + within);
            }
            ShownAs::Sent => {}
            ShownAs::Staged if one_step => {}
            // It waits for the operator, who is in no hurry; or it is answered, or shown as not answered.
            ShownAs::Staged
            | ShownAs::Stored
            | ShownAs::Executed
            | ShownAs::Refused
            | ShownAs::Void
            | ShownAs::NotAcknowledged => {
                if let Some(until) = due.remove(&command).filter(|until| *until < w.at) {
                    found.push(under_way(command, until));
                }
            }
        }
        let executed = || line.executed.iter().any(|(at, id, _)| *id == command && *at <= w.at + SLACK);
        if shown == ShownAs::Executed && !executed() {
            let what = format!("{command} is shown as executed and the unit did not execute it");
            found.push(finding(Property::P7, w.at, what));
        }
    }
    let end = evidence.duration;
    let alive = !evidence.killed.contains(&NodeId::CONSOLE);
    let left = due.into_iter().filter(|(_, until)| alive && *until < end);
    found.extend(left.map(|(command, until)| under_way(command, until)));
    found
}

fn under_way(command: CommandId, until: Micros) -> Finding {
    let ms = ANSWER_WITHIN / 1000;
    finding(Property::P7, until, format!("{command} is shown as under way for more than {ms} ms"))
}

/// P3 for the operator: *Th* after a HOLD was given, or was due by its time tag, the unit holds, by the order or by its lease. One that did not live all
/// that time is `process_fault`'s to judge.
pub(crate) fn operators_hold(evidence: &Evidence, line: &Timeline) -> Vec<Finding> {
    let dead = life::dead(evidence, evidence.under.node());
    let lived = |from: Micros, to: Micros| dead.iter().all(|(died, again)| to < *died || from > *again);
    let th = evidence.bounds.to_hold_safe_ms * 1000 + SLACK;
    let holds = line.intended.iter().filter(|(.., kind)| *kind == CommandKind::Hold);
    let due = holds.map(|(given, id, _)| (line.due(*id, *given), id));
    let due = due.filter(|(at, _)| at + th <= evidence.duration && lived(*at, at + th));
    let late =
        due.filter(|(at, _)| !line.was_in(Mode::HoldSafe, *at, at + th) && !line.was_in(Mode::Idle, *at, at + th));
    late.map(|(at, id)| {
        let what = format!("{id}, a hold, was due and {} ms later the unit had not held", th / 1000);
        finding(Property::P3, at + th, what)
    })
    .collect()
}
