//! A second run of the same sequence, in another way: forked half way, with the input journals kept; and its orders,
//! reports, display, plant and accounts from the log, for the assertions.
//!
//! It judges none of them.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use std::collections::BTreeMap;

use evidence::log::hashes;
use ground_truth::{Any, Entry, Note};
use search::{AttackSequence, SearchConfig};
use twin::trial::{conclude, start};
use wire::command::CommandKind;
use wire::event::{Account, Event, Freshness, Interface};
use wire::id::{CommandId, NodeId, PeerId, RecordId, UnitId, WorldId};
use wire::refusal::Reason;

/// Observations, times in milliseconds.
#[derive(Clone, Debug, Default)]
pub(super) struct Witness {
    /// Digest of every decision.
    pub(super) decisions: String,
    /// Orders as they were given.
    pub(super) given: Vec<Given>,
    /// Orders as the unit under test took them.
    pub(super) taken: Vec<Taken>,
    /// Time at which the unit under test learned that the second operator was revoked.
    pub(super) struck_ms: Option<f64>,
    /// Reports that the gateway accepted, with the peers of their sessions.
    pub(super) accepted: Vec<(PeerId, RecordId)>,
    /// Displays of the unit under test.
    pub(super) shown: Vec<Shown>,
    /// Times at which it gained authority (true) and lost or used it.
    pub(super) authority: Vec<(f64, bool)>,
    /// Its true speed, mm/s.
    pub(super) speed: Vec<(f64, i32)>,
    /// Acts at the plant.
    pub(super) acts: usize,
    /// Time at which it first found a teammate's claims inconsistent.
    pub(super) disputed_ms: Option<f64>,
    /// Closing accounts.
    pub(super) accounts: BTreeMap<(NodeId, Account), u64>,
}

/// An order, by the sequence of who gave it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Given {
    pub(super) at_ms: f64,
    pub(super) id: CommandId,
    pub(super) kind: CommandKind,
    /// Owner of the signing key.
    pub(super) key: NodeId,
}

/// An order that reached the unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Taken {
    pub(super) at_ms: f64,
    pub(super) id: CommandId,
    pub(super) kind: CommandKind,
    pub(super) refused: Option<Reason>,
}

/// A picture on the display.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shown {
    pub(super) at_ms: f64,
    pub(super) fresh: bool,
    pub(super) authority: bool,
    pub(super) report: RecordId,
}

impl Witness {
    /// Witness of a sequence, run again.
    pub(super) fn from_sequence(config: &SearchConfig, sequence: &AttackSequence) -> Self {
        let scenario = sequence.in_scenario(&config.space, &config.scenario).expect("it was run before");
        let (topology, mut twin) = start(&scenario, &config.setup, config.seed, true).expect("it was run before");
        twin.run_until(topology.duration / 2);
        let fork = twin.fork(WorldId(1));
        drop(twin);
        let run = conclude(topology, fork, &config.setup);
        let mut witness = Self { decisions: hashes(&run.evidence.entries).1, ..Self::default() };
        run.evidence.entries.iter().for_each(|w| witness.take(w.at as f64 / 1000.0, &w.entry));
        witness
    }

    fn take(&mut self, at_ms: f64, entry: &Entry) {
        let unit_a = entry.node == NodeId::UNIT_A;
        match entry.event {
            Any::Service(Event::Intended { command: id, kind, .. }) if entry.node == NodeId::CONSOLE => {
                self.given.push(Given { at_ms, id, kind, key: NodeId::OPERATOR });
            }
            Any::Instrument(Note::Rogue { command: id, kind, key, .. }) => {
                self.given.push(Given { at_ms, id, kind, key })
            }
            Any::Service(Event::Executed { command: id, kind, refused }) if unit_a => {
                self.taken.push(Taken { at_ms, id, kind, refused });
            }
            Any::Service(Event::Struck { who: NodeId::OPERATOR_2 }) if unit_a => {
                self.struck_ms.get_or_insert(at_ms);
            }
            Any::Service(Event::Accepted { at: Interface::Uplink, peer, record, .. }) => {
                self.accepted.push((peer, record))
            }
            Any::Service(Event::Displayed { unit: UnitId::A, authority, freshness, report, .. }) => {
                self.shown.push(Shown {
                    at_ms,
                    fresh: freshness == Freshness::Fresh,
                    authority: authority.is_some(),
                    report,
                });
            }
            Any::Service(Event::Minted { .. }) if unit_a => self.authority.push((at_ms, true)),
            Any::Service(Event::Revoked { .. } | Event::Acted { .. }) if unit_a => self.authority.push((at_ms, false)),
            Any::Instrument(Note::Truth { unit: UnitId::A, speed_mm_s, .. }) => self.speed.push((at_ms, speed_mm_s)),
            Any::Instrument(Note::PlantAct { .. }) => self.acts += 1,
            Any::Service(Event::Inconsistent { .. }) if unit_a => {
                self.disputed_ms.get_or_insert(at_ms);
            }
            Any::Service(Event::Count { account, n }) => {
                self.accounts.insert((entry.node, account), n);
            }
            _ => {}
        }
    }
}
