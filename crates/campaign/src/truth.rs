//! What really happened in a run, in words and on the console's clock: for whoever looks at the recording of a console.
//!
//! It is taken from the words of those who did it, as the oracle has them. Judging is the oracle's.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use std::collections::BTreeMap;

use console::moment::{Happened, MAX_MOMENTS};
use wire::event::Event;
use wire::id::NodeId;

use crate::oracle::{Micros, Witnessed};

/// The same said again within this is one thing that goes on.
const AGAIN: Micros = 1_000_000;

/// Of the log of a run, in order of trace time; at most [`MAX_MOMENTS`]. Nothing without a console in it.
pub fn of(entries: &[Witnessed]) -> Vec<Happened> {
    let mut told: BTreeMap<String, Micros> = BTreeMap::new();
    let mut happened = Vec::new();
    // An entry of the console's, by which its clock is read.
    let first = entries.iter().find(|w| w.entry.node == NodeId::CONSOLE);
    let Some(mut clock) = first.map(|w| (w.at, w.entry.at.0)) else { return happened };
    for w in entries {
        if w.entry.node == NodeId::CONSOLE {
            clock = (w.at, w.entry.at.0);
        }
        let Some(what) = words(w) else { continue };
        let goes_on = told.insert(what.clone(), w.at).is_some_and(|before| w.at.saturating_sub(before) < AGAIN);
        if !goes_on && happened.len() < MAX_MOMENTS {
            happened.push(Happened { at_us: (clock.1 + w.at).saturating_sub(clock.0), what });
        }
    }
    happened
}

fn words(w: &Witnessed) -> Option<String> {
    let (node, begins) = (w.entry.node, |begins: bool| if begins { "begins" } else { "ends" });
    Some(match w.entry.event {
        Event::Fault { sensor, kind, active, .. } => format!("fault of {sensor:?}: {kind:?} {}", begins(active)),
        Event::Attack { action, .. } => format!("{node}: {action:?}"),
        Event::Tampered { deed, .. } => format!("{node}: {deed:?} on a byte stream"),
        Event::Rogue { kind, key, .. } => format!("{node}: orders {} with the key of {key}", kind.name()),
        Event::Claimed { record, .. } => format!("{node}: sends a report of {} that is a lie", record.node),
        Event::Withheld { record } => format!("{node}: keeps a report of {} from the display", record.node),
        Event::Swallowed { command } => format!("{node}: swallows {command}"),
        Event::Joins { certificate } => format!("{node}: takes a command session of {certificate}"),
        Event::Step { step, begun } => format!("step {step} {}", begins(begun)),
        Event::Ended { node, killed: true } => format!("{node} is killed"),
        Event::Restarted { node, .. } => format!("{node} is started again"),
        Event::Suspended { node, on, .. } => format!("{node} is kept from running: {}", begins(on)),
        Event::DiskFull { node, on } => format!("the disk of {node} is full: {}", begins(on)),
        _ => return None,
    })
}
