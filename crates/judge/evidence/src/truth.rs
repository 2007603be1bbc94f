//! Ground truth of the actions in a run, in words, from the actors: for a later reader of the recording. No service knew.
//!
//! [`of`] tells it on the console's clock, for its window; [`lasted`] on the run's, with the duration of each. Judging is the oracle's.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use std::collections::BTreeMap;

use ground_truth::{Any, Note, Suspension};
use wire::id::NodeId;

use crate::{Micros, Witnessed};

/// The most that is told of a run.
pub const MAX_MOMENTS: usize = 256;
/// The same said again within this is one thing that goes on.
const AGAIN: Micros = 1_000_000;

/// Something that was done.
struct ToldAction {
    what: String,
    phase: Phase,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    Once,
    Begins,
    Ends,
}

impl ToldAction {
    fn words(self) -> String {
        match self.phase {
            Phase::Once => self.what,
            Phase::Begins => format!("{} begins", self.what),
            Phase::Ends => format!("{} ends", self.what),
        }
    }
}

/// Something that was done, by the console's clock.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Happened {
    /// Time, microseconds.
    pub at_us: u64,
    /// Action, in words.
    pub what: String,
}

/// Of the log of a run, in order of trace time; at most [`MAX_MOMENTS`]. None without a console in it.
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
        let Some(what) = deed(w).map(ToldAction::words) else { continue };
        let goes_on = told.insert(what.clone(), w.at).is_some_and(|before| w.at.saturating_sub(before) < AGAIN);
        if !goes_on && happened.len() < MAX_MOMENTS {
            happened.push(Happened { at_us: (clock.1 + w.at).saturating_sub(clock.0), what });
        }
    }
    happened
}

/// Something that was done for a while, trace time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lasted {
    /// Action, in words.
    pub what: String,
    /// From.
    pub from: Micros,
    /// To; the end of the log where it did not end before.
    pub to: Micros,
}

/// Actions and their durations, by their beginning; at most [`MAX_MOMENTS`].
pub fn lasted(entries: &[Witnessed]) -> Vec<Lasted> {
    let end = entries.iter().map(|w| w.at).max().unwrap_or_default();
    let mut all: Vec<Lasted> = Vec::new();
    // Where in `all` the last of a name stands.
    let mut last: BTreeMap<String, usize> = BTreeMap::new();
    for w in entries {
        let Some(ToldAction { what, phase }) = deed(w) else { continue };
        let goes_on = |before: &Lasted| match phase {
            Phase::Once => w.at.saturating_sub(before.to) < AGAIN,
            Phase::Begins => false,
            Phase::Ends => true,
        };
        if let Some(before) = last.get(&what).and_then(|&i| all.get_mut(i)).filter(|before| goes_on(before)) {
            before.to = w.at;
        } else if all.len() < MAX_MOMENTS {
            last.insert(what.clone(), all.len());
            let to = if phase == Phase::Begins { end } else { w.at };
            all.push(Lasted { what, from: w.at, to });
        }
    }
    all
}

fn deed(w: &Witnessed) -> Option<ToldAction> {
    let node = w.entry.node;
    let phase = |begins: bool| if begins { Phase::Begins } else { Phase::Ends };
    let (what, phase) = match w.entry.event {
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
    Some(ToldAction { what, phase })
}

#[cfg(test)]
mod tests {
    use ground_truth::{Action, Entry, FaultKind, Sensor};
    use wire::core::Side;
    use wire::event::Event;
    use wire::id::{Boot, FrameId};
    use wire::time::{Instant, Span};

    use super::*;

    fn seen(at: Micros, node: NodeId, local: u64, event: impl Into<Any>) -> Witnessed {
        let event = event.into();
        let entry = Entry { node, boot: Boot(1), counter: 1, at: Instant(local), event, previous: [0; 32] };
        Witnessed { at, entry }
    }

    #[test]
    fn events_use_console_clock_lasting_ones_once() {
        let attack = |at| {
            let event =
                Note::Attack { action: Action::Drop, side: Side::Server, length: 9, hash: 1, delay: Span::ZERO };
            seen(at, NodeId::RELAY_TELEMETRY, 0, event)
        };
        let fault = Note::Fault { sensor: Sensor::Thermal, kind: FaultKind::Dropout, active: true, frame: FrameId(1) };
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

    #[test]
    fn actions_last_until_their_or_the_logs_end() {
        let fault = |active| Note::Fault { sensor: Sensor::Rgb, kind: FaultKind::Freeze, active, frame: FrameId(1) };
        let hang = |on| Note::Suspended { node: NodeId::GATEWAY, how: Suspension::Hang, on };
        let attack = Note::Attack { action: Action::Drop, side: Side::Server, length: 9, hash: 1, delay: Span::ZERO };
        let log = [
            seen(100, NodeId::SIM, 0, fault(true)),
            seen(200, NodeId::RELAY_TELEMETRY, 0, attack),
            seen(300, NodeId::SIM, 0, fault(false)),
            seen(900_000, NodeId::RELAY_TELEMETRY, 0, attack),
            seen(3_000_000, NodeId::RELAY_TELEMETRY, 0, attack),
            seen(4_000_000, NodeId::CAMPAIGN, 0, hang(true)),
            seen(9_000_000, NodeId::SIM, 0, Event::Started),
        ];
        let told: Vec<(String, u64, u64)> = lasted(&log).into_iter().map(|l| (l.what, l.from, l.to)).collect();
        let expected = [
            ("fault of Rgb: Freeze", 100, 300),
            ("relay-telemetry: Drop", 200, 900_000),
            ("relay-telemetry: Drop", 3_000_000, 3_000_000),
            ("hang of gateway", 4_000_000, 9_000_000),
        ];
        assert_eq!(told, expected.map(|(what, from, to)| (what.to_owned(), from, to)));
    }
}
