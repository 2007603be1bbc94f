//! Information about the unit's mode in lengths and times on the links.
//!
//! A *piece* is a datagram of the telemetry link, or a burst of the command plane's byte stream, as the relay in the
//! path saw it: direction, length, time, never a byte of it. Seconds of a run are distinguished by simple features of
//! their pieces, and a classifier (`guess`) that has learned from other runs names the unit's mode. `measure` gives its
//! accuracy, against chance. This code knows neither the platform nor a key.

pub mod guess;
pub mod measure;

use evidence::log::Logged;
use ground_truth::{Any, Entry};
use topology::Topology;
use twin::Twin;
use twin::clock::HostClock;
use wire::core::{Input, Side};
use wire::event::Event;
use wire::id::NodeId;
use wire::mode::Mode;

/// Length of a window, microseconds.
const WINDOW_US: u64 = 1_000_000;
/// Windows at the beginning of a run that are left out: connections are set up there, which is no sign of a mode.
const OPENING: u64 = 1;
/// Features of one direction: number of pieces, bytes together, mean length, mean gap.
const OF_DIRECTION: usize = 4;
/// Features of one link.
const OF_LINK: usize = 2 * OF_DIRECTION;
/// Features of both links.
pub const FEATURES: usize = 2 * OF_LINK;

/// Links that an observer sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sees {
    /// Sizes of the telemetry link.
    Telemetry,
    /// Sizes of the unit's connection to the broker.
    Command,
    /// All of them.
    Both,
}

impl Sees {
    /// Every observer.
    pub const ALL: [Sees; 3] = [Sees::Telemetry, Sees::Command, Sees::Both];

    /// Its features.
    pub fn features(self) -> std::ops::Range<usize> {
        match self {
            Sees::Telemetry => 0..OF_LINK,
            Sees::Command => OF_LINK..FEATURES,
            Sees::Both => 0..FEATURES,
        }
    }

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Sees::Telemetry => "telemetry link",
            Sees::Command => "command plane",
            Sees::Both => "both links",
        }
    }
}

/// One second of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// The mode in its middle.
    pub mode: Mode,
    /// The observer's features of it.
    pub features: [f64; FEATURES],
}

/// A run, second by second, under its seed.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The seed that it was run with.
    pub seed: u64,
    /// Its seconds, in order.
    pub windows: Vec<Window>,
}

/// One piece on a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Piece {
    at: u64,
    /// Telemetry from client and server, then command from client and server.
    direction: usize,
    length: usize,
}

impl Run {
    /// Run of a twin that kept its input journals.
    pub fn of_twin(seed: u64, topology: &Topology, twin: &Twin) -> Self {
        let mut pieces = Vec::new();
        for (node, journal) in twin.nodes().iter().zip(twin.journals().unwrap_or_default()) {
            if ![NodeId::RELAY_TELEMETRY, NodeId::RELAY_COMMAND].contains(&node.id) {
                continue;
            }
            let clock = HostClock::from(topology.clocks[usize::from(node.host)]);
            pieces.extend(journal.iter().filter_map(|fed| piece(clock.true_time(fed.now), &fed.input)));
        }
        Self { seed, windows: windows(&pieces, &changes(twin.log()), topology.duration) }
    }
}

fn piece(at: u64, input: &Input) -> Option<Piece> {
    let (link, side, bytes) = match input {
        Input::Datagram { side, bytes } => (0, side, bytes),
        Input::Stream { side, bytes, .. } if !bytes.is_empty() => (2, side, bytes),
        Input::Stream { .. }
        | Input::Timeout
        | Input::Bus { .. }
        | Input::Opened { .. }
        | Input::Record { .. }
        | Input::Closed { .. }
        | Input::Published { .. }
        | Input::SessionLost
        | Input::Guest { .. }
        | Input::Act { .. }
        | Input::Audit { .. }
        | Input::Quiesce
        | Input::Finish
        | Input::HostWait { .. }
        | Input::Cue { .. } => return None,
    };
    let side = if *side == Side::Client { 0 } else { 1 };
    Some(Piece { at, direction: link + side, length: bytes.len() })
}

/// Changes of the unit under test, each with its time and the new mode.
fn changes(log: &[Logged]) -> Vec<(u64, Mode)> {
    let of_unit = log.iter().filter(|logged| logged.node == NodeId::UNIT_A);
    let change = |logged: &Logged| match Entry::decode(&logged.bytes) {
        Ok(Entry { event: Any::Service(Event::Transition { to, .. }), .. }) => Some((logged.at, to)),
        Ok(_) | Err(_) => None,
    };
    of_unit.filter_map(change).collect()
}

/// The whole windows of a run of `duration` after its opening.
fn windows(pieces: &[Piece], changes: &[(u64, Mode)], duration: u64) -> Vec<Window> {
    let mode = |at: u64| changes.iter().rev().find(|(when, _)| *when <= at).map_or(Mode::Idle, |(_, mode)| *mode);
    let window = |n: u64| {
        let (from, to) = (n * WINDOW_US, (n + 1) * WINDOW_US);
        let within: Vec<Piece> = pieces.iter().filter(|piece| (from..to).contains(&piece.at)).copied().collect();
        Window { mode: mode(from + WINDOW_US / 2), features: features(&within) }
    };
    (OPENING..duration / WINDOW_US).map(window).collect()
}

fn features(pieces: &[Piece]) -> [f64; FEATURES] {
    let mut features = [0.0; FEATURES];
    for (direction, of_direction) in features.chunks_mut(OF_DIRECTION).enumerate() {
        let mut seen: Vec<&Piece> = pieces.iter().filter(|piece| piece.direction == direction).collect();
        seen.sort_unstable_by_key(|piece| piece.at);
        let (n, bytes) = (seen.len() as f64, seen.iter().map(|piece| piece.length).sum::<usize>() as f64);
        let span = seen.last().zip(seen.first()).map_or(0, |(last, first)| last.at - first.at);
        // The gap of fewer than two pieces is as long as the window.
        let gap = if seen.len() > 1 { span as f64 / (n - 1.0) } else { WINDOW_US as f64 };
        of_direction.copy_from_slice(&[n, bytes, bytes / n.max(1.0), gap]);
    }
    features
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Its mode is that in its middle; each direction is counted by itself.
    #[test]
    fn window_has_its_middle_mode_and_separate_directions() {
        let piece = |at, direction, length| Piece { at, direction, length };
        let pieces = [
            piece(500_000, 0, 999),
            piece(1_100_000, 0, 100),
            piece(1_300_000, 0, 300),
            piece(1_500_000, 3, 50),
            piece(2_000_000, 0, 1),
        ];
        let windows = windows(&pieces, &[(1_400_000, Mode::Ready), (2_600_000, Mode::HoldSafe)], 3_900_000);
        assert_eq!(windows.iter().map(|w| w.mode).collect::<Vec<_>>(), [Mode::Ready, Mode::Ready]);
        assert_eq!(windows[0].features[..4], [2.0, 400.0, 200.0, 200_000.0]);
        assert_eq!(windows[0].features[4..8], [0.0, 0.0, 0.0, 1_000_000.0]);
        assert_eq!(windows[0].features[12..], [1.0, 50.0, 50.0, 1_000_000.0]);
        assert_eq!(windows[1].features[..4], [1.0, 1.0, 1.0, 1_000_000.0]);
    }
}
