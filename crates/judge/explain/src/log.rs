//! Input of an explanation: the services' own entries, in order of time.

use evidence::{Micros, Witnessed};
use ground_truth::{Any, Note};
use wire::bounds::Bounds;
use wire::event::{Event, Interface};
use wire::feed::CommandStage;
use wire::id::{CommandId, NodeId, PeerId};
use wire::time::Instant;

use super::Change;

/// Services of the platform under test and its control. Teammates are others' platforms: of them count only their messages to
/// these.
const SERVICES: [NodeId; 7] = [
    NodeId::UNIT_A,
    NodeId::PERCEPTION,
    NodeId::GATEWAY,
    NodeId::BROKER,
    NodeId::CONSOLE,
    NodeId::RECORDER,
    NodeId::SIM,
];

/// The services' log.
#[derive(Clone, Debug)]
pub struct Log {
    entries: Vec<Witnessed>,
    /// Bounds in force: how old is too old.
    pub(super) bounds: Bounds,
}

impl Log {
    /// Entries among `entries` that the services wrote.
    pub fn from_entries(entries: &[Witnessed], bounds: Bounds) -> Log {
        let mut entries: Vec<Witnessed> = entries.iter().filter(|w| is_of_a_service(w)).copied().collect();
        entries.sort_by_key(|w| (w.at, w.entry.node, w.entry.boot, w.entry.counter));
        Log { entries, bounds }
    }

    /// Its entries.
    pub fn entries(&self) -> &[Witnessed] {
        &self.entries
    }

    /// Changes of mode of the unit under test.
    pub(super) fn changes(&self) -> Vec<Change> {
        let of_unit = self.entries_by(NodeId::UNIT_A);
        of_unit
            .filter_map(|w| match w.entry.event {
                Any::Service(Event::Transition { from, to, cause, because, failing }) => {
                    let local = i128::from(w.entry.at.0) - i128::from(w.at);
                    Some(Change { at: w.at, local, from, to, cause, because, failing })
                }
                _ => None,
            })
            .collect()
    }

    /// The entries of one service.
    pub(super) fn entries_by(&self, node: NodeId) -> impl DoubleEndedIterator<Item = &Witnessed> {
        self.entries.iter().filter(move |w| w.entry.node == node)
    }

    /// The last entry of `node` at or before `time` that `wanted` picks.
    pub(super) fn last<T>(
        &self,
        node: NodeId,
        time: Micros,
        wanted: impl Fn(&Any) -> Option<T>,
    ) -> Option<(Micros, T)> {
        let mut before = self.entries_by(node).rev().skip_while(|w| w.at > time);
        before.find_map(|w| Some((w.at, wanted(&w.entry.event)?)))
    }

    /// The first entry of `node` from `time` on that `wanted` picks.
    pub(super) fn first<T>(
        &self,
        node: NodeId,
        time: Micros,
        wanted: impl Fn(&Any) -> Option<T>,
    ) -> Option<(Micros, T)> {
        let mut after = self.entries_by(node).skip_while(|w| w.at < time);
        after.find_map(|w| Some((w.at, wanted(&w.entry.event)?)))
    }

    /// Times at which `node` accepted records of `peer` at `interface`, within (`from`, `to`].
    pub(super) fn accepted(
        &self,
        node: NodeId,
        interface: Interface,
        peer: PeerId,
        from: Micros,
        to: Micros,
    ) -> Vec<Micros> {
        self.entries_by(node)
            .filter(|w| w.at > from && w.at <= to)
            .filter(|w| {
                matches!(
                    w.entry.event,
                    Any::Service(Event::Accepted { at, peer: p, .. }) if at == interface && p == peer
                )
            })
            .map(|w| w.at)
            .collect()
    }

    /// Refusals of `node` at interfaces that `wanted` picks, within (`from`, `to`]: times and words.
    pub(super) fn refused(
        &self,
        node: NodeId,
        wanted: impl Fn(Interface, Option<PeerId>) -> bool,
        from: Micros,
        to: Micros,
    ) -> Vec<(Micros, String)> {
        self.entries_by(node)
            .filter(|w| w.at > from && w.at <= to)
            .filter_map(|w| match w.entry.event {
                Any::Service(Event::Refused { at, peer, detail, .. }) if wanted(at, peer) => {
                    Some((w.at, detail.as_str().to_owned()))
                }
                _ => None,
            })
            .collect()
    }
}

impl Change {
    /// A stamp of the unit's host as trace time.
    pub(super) fn on_trace(&self, stamp: Instant) -> Micros {
        Micros::try_from(i128::from(stamp.0) - self.local).unwrap_or(0)
    }
}

/// True for an entry of a service. Of the sim only the actions of its plant and its refusals count: its knowledge and
/// its faults are ground truth.
fn is_of_a_service(w: &Witnessed) -> bool {
    let plant = matches!(
        w.entry.event,
        Any::Instrument(Note::Truth { .. } | Note::PlantAct { .. }) | Any::Service(Event::Refused { .. })
    );
    SERVICES.contains(&w.entry.node) && (w.entry.node != NodeId::SIM || plant)
}

/// Stages of a command at the gateway up to `until`, with their times.
pub(super) fn stages(log: &Log, id: CommandId, until: Micros) -> Vec<(Micros, CommandStage)> {
    log.entries_by(NodeId::GATEWAY)
        .filter(|w| w.at <= until)
        .filter_map(|w| match w.entry.event {
            Any::Service(Event::Staged { command, stage }) if command == id => Some((w.at, stage)),
            _ => None,
        })
        .collect()
}
