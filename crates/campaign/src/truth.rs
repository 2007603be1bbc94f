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

#[cfg(test)]
mod tests {
    use wire::audit::Entry;
    use wire::core::Side;
    use wire::event::{Action, FaultKind, Sensor};
    use wire::id::{Boot, FrameId};
    use wire::time::{Instant, Span};

    use super::*;

    fn seen(at: Micros, node: NodeId, local: u64, event: Event) -> Witnessed {
        let entry = Entry { node, boot: Boot(1), counter: 1, at: Instant(local), event, previous: [0; 32] };
        Witnessed { at, entry }
    }

    #[test]
    fn what_happened_is_told_on_the_consoles_clock_and_what_goes_on_is_told_once() {
        let attack = |at| {
            let event =
                Event::Attack { action: Action::Drop, side: Side::Server, length: 9, hash: 1, delay: Span::ZERO };
            seen(at, NodeId::RELAY_TELEMETRY, 0, event)
        };
        let fault = Event::Fault { sensor: Sensor::Thermal, kind: FaultKind::Dropout, active: true, frame: FrameId(1) };
        let log = [
            seen(1_000_000, NodeId::CONSOLE, 71_000_000, Event::Started),
            attack(1_200_000),
            attack(1_900_000),
            attack(2_800_000),
            // The console's clock is slower than the trace's.
            seen(3_000_000, NodeId::CONSOLE, 72_900_000, Event::Started),
            seen(3_100_000, NodeId::SIM, 0, fault),
            attack(5_000_000),
        ];
        let told: Vec<(u64, String)> = of(&log).into_iter().map(|of| (of.at_us, of.what)).collect();
        let dropped = "relay-telemetry: Drop".to_owned();
        let failed = "fault of Thermal: Dropout begins".to_owned();
        assert_eq!(told, [(71_200_000, dropped.clone()), (73_000_000, failed), (74_900_000, dropped)]);
        assert_eq!(of(&log[1..2]), []);
    }
}
