//! Ground truth of the actions in a run, in words, from the actors: for a later reader of the recording. No service knew it.
//!
//! [`on_console_clock`] has times of the console's clock, for its window; [`lasting`] has times of the run, with durations. Judging is
//! left to the oracle.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use std::collections::BTreeMap;

use ground_truth::{Any, Note, Suspension};
use wire::id::NodeId;

use crate::{Micros, Witnessed};

/// Most actions that are listed of a run.
pub const MAX_MOMENTS: usize = 256;
/// Longest gap between equal actions that count as one, microseconds.
const SAME_WITHIN: Micros = 1_000_000;

/// An action in words.
struct NamedAction {
    name: String,
    phase: Phase,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    Once,
    Begins,
    Ends,
}

impl NamedAction {
    fn describe(self) -> String {
        match self.phase {
            Phase::Once => self.name,
            Phase::Begins => format!("{} begins", self.name),
            Phase::Ends => format!("{} ends", self.name),
        }
    }
}

/// An action at a time of the console's clock.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Happened {
    /// Time, microseconds.
    pub at_us: u64,
    /// Action, in words.
    pub action: String,
}

/// Actions in the log of a run, in order of trace time; at most [`MAX_MOMENTS`]. None without a console in it.
pub fn on_console_clock(entries: &[Witnessed]) -> Vec<Happened> {
    let mut last: BTreeMap<String, Micros> = BTreeMap::new();
    let mut happened = Vec::new();
    // The console's clock may drift against trace time, so each of its entries sets the offset again.
    let first = entries.iter().find(|w| w.entry.node == NodeId::CONSOLE);
    let Some(mut clock) = first.map(|w| (w.at, w.entry.at.0)) else { return happened };
    for w in entries {
        if w.entry.node == NodeId::CONSOLE {
            clock = (w.at, w.entry.at.0);
        }
        let Some(action) = named_action(w).map(NamedAction::describe) else { continue };
        let goes_on = last.insert(action.clone(), w.at).is_some_and(|before| w.at.saturating_sub(before) < SAME_WITHIN);
        if !goes_on && happened.len() < MAX_MOMENTS {
            happened.push(Happened { at_us: (clock.1 + w.at).saturating_sub(clock.0), action });
        }
    }
    happened
}

/// An action with its duration, trace time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lasted {
    /// Action, in words.
    pub action: String,
    /// Beginning.
    pub from: Micros,
    /// End; the end of the log where the action did not end before.
    pub to: Micros,
}

/// Actions and their durations, by their beginning; at most [`MAX_MOMENTS`].
pub fn lasting(entries: &[Witnessed]) -> Vec<Lasted> {
    let end = entries.iter().map(|w| w.at).max().unwrap_or_default();
    let mut all: Vec<Lasted> = Vec::new();
    // Index in `all` of the last action of a name.
    let mut last: BTreeMap<String, usize> = BTreeMap::new();
    for w in entries {
        let Some(NamedAction { name, phase }) = named_action(w) else { continue };
        let goes_on = |before: &Lasted| match phase {
            Phase::Once => w.at.saturating_sub(before.to) < SAME_WITHIN,
            Phase::Begins => false,
            Phase::Ends => true,
        };
        if let Some(before) = last.get(&name).and_then(|&i| all.get_mut(i)).filter(|before| goes_on(before)) {
            before.to = w.at;
        } else if all.len() < MAX_MOMENTS {
            last.insert(name.clone(), all.len());
            let to = if phase == Phase::Begins { end } else { w.at };
            all.push(Lasted { action: name, from: w.at, to });
        }
    }
    all
}

fn named_action(w: &Witnessed) -> Option<NamedAction> {
    let node = w.entry.node;
    let phase = |begins: bool| if begins { Phase::Begins } else { Phase::Ends };
    let (name, phase) = match w.entry.event {
        Any::Instrument(Note::Fault { sensor, kind, active, .. }) => {
            (format!("fault of {sensor:?}: {kind:?}"), phase(active))
        }
        Any::Instrument(Note::Attack { action, .. }) => (format!("{node}: {action:?}"), Phase::Once),
        Any::Instrument(Note::Tampered { deed, .. }) => (format!("{node}: {deed:?} on a byte stream"), Phase::Once),
        Any::Instrument(Note::Rogue { kind, key, .. }) => {
            (format!("{node}: orders {} with the key of {key}", kind.name()), Phase::Once)
        }
        Any::Instrument(Note::Claimed { record, .. }) => {
            (format!("{node}: sends a report of {} that is a lie", record.node), Phase::Once)
        }
        Any::Instrument(Note::Withheld { record }) => {
            (format!("{node}: keeps a report of {} from the display", record.node), Phase::Once)
        }
        Any::Instrument(Note::Swallowed { command }) => (format!("{node}: swallows {command}"), Phase::Once),
        Any::Instrument(Note::Joins { certificate }) => {
            (format!("{node}: takes a command session of {certificate}"), Phase::Once)
        }
        Any::Instrument(Note::Step { step, begun }) => (format!("step {step}"), phase(begun)),
        Any::Instrument(Note::Ended { node, killed: true, .. }) => (format!("kill of {node}"), Phase::Once),
        Any::Instrument(Note::Restarted { node, .. }) => (format!("start of {node} again"), Phase::Once),
        Any::Instrument(Note::Suspended { node, how: Suspension::Hang, on }) => (format!("hang of {node}"), phase(on)),
        Any::Instrument(Note::Suspended { node, how: Suspension::Slow { .. }, on }) => {
            (format!("slowing of {node}"), phase(on))
        }
        Any::Instrument(Note::DiskFull { node, on }) => (format!("full disk of {node}"), phase(on)),
        _ => return None,
    };
    Some(NamedAction { name, phase })
}

#[cfg(test)]
mod tests {
    use ground_truth::{Action, Entry, FaultKind, Sensor};
    use wire::core::Side;
    use wire::event::Event;
    use wire::id::{Boot, FrameId};
    use wire::time::{Instant, Span};

    use super::*;

    fn witnessed(time: Micros, node: NodeId, local: u64, event: impl Into<Any>) -> Witnessed {
        let event = event.into();
        let entry = Entry { node, boot: Boot(1), counter: 1, at: Instant(local), event, previous: [0; 32] };
        Witnessed { at: time, entry }
    }

    #[test]
    fn events_use_console_clock_lasting_ones_once() {
        let attack = |time| {
            let event =
                Note::Attack { action: Action::Drop, side: Side::Server, length: 9, hash: 1, delay: Span::ZERO };
            witnessed(time, NodeId::RELAY_TELEMETRY, 0, event)
        };
        let fault = Note::Fault { sensor: Sensor::Thermal, kind: FaultKind::Dropout, active: true, frame: FrameId(1) };
        let log = [
            witnessed(1_000_000, NodeId::CONSOLE, 71_000_000, Event::Started),
            attack(1_200_000),
            attack(1_900_000),
            attack(2_800_000),
            // The console's clock is slower than the trace's.
            witnessed(3_000_000, NodeId::CONSOLE, 72_900_000, Event::Started),
            witnessed(3_100_000, NodeId::SIM, 0, fault),
            attack(5_000_000),
        ];
        let times: Vec<(u64, String)> = on_console_clock(&log).into_iter().map(|h| (h.at_us, h.action)).collect();
        let dropped = "relay-telemetry: Drop".to_owned();
        let failed = "fault of Thermal: Dropout begins".to_owned();
        assert_eq!(times, [(71_200_000, dropped.clone()), (73_000_000, failed), (74_900_000, dropped)]);
        assert_eq!(on_console_clock(&log[1..2]), []);
    }

    #[test]
    fn actions_last_until_their_or_the_logs_end() {
        let fault = |active| Note::Fault { sensor: Sensor::Rgb, kind: FaultKind::Freeze, active, frame: FrameId(1) };
        let hang = |on| Note::Suspended { node: NodeId::GATEWAY, how: Suspension::Hang, on };
        let attack = Note::Attack { action: Action::Drop, side: Side::Server, length: 9, hash: 1, delay: Span::ZERO };
        let log = [
            witnessed(100, NodeId::SIM, 0, fault(true)),
            witnessed(200, NodeId::RELAY_TELEMETRY, 0, attack),
            witnessed(300, NodeId::SIM, 0, fault(false)),
            witnessed(900_000, NodeId::RELAY_TELEMETRY, 0, attack),
            witnessed(3_000_000, NodeId::RELAY_TELEMETRY, 0, attack),
            witnessed(4_000_000, NodeId::CAMPAIGN, 0, hang(true)),
            witnessed(9_000_000, NodeId::SIM, 0, Event::Started),
        ];
        let durations: Vec<(String, u64, u64)> = lasting(&log).into_iter().map(|l| (l.action, l.from, l.to)).collect();
        let expected = [
            ("fault of Rgb: Freeze", 100, 300),
            ("relay-telemetry: Drop", 200, 900_000),
            ("relay-telemetry: Drop", 3_000_000, 3_000_000),
            ("hang of gateway", 4_000_000, 9_000_000),
        ];
        assert_eq!(durations, expected.map(|(name, from, to)| (name.to_owned(), from, to)));
    }
}
