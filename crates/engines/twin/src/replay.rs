//! Replay of the inputs of a run to fresh cores.
//!
//! Under the same policy every byte has to come out again: a core is a function of its inputs. Under another policy the
//! first decision that differs is the one that the policy would have changed. The inputs after it are still those of
//! the recorded run, and not those that would have followed under the other policy. So later differences say at which
//! boundary the policy matters; to learn how a run goes under the policy, run the scenario under it.

use std::collections::BTreeMap;

use evidence::Micros;
use evidence::log::{decision, kind_of};
use ground_truth::{Any, Entry};
use recording::messages::Message;
use scenario::{Scenario, Setup};
use topology::{Member, Topology};
use wire::core::{Core, Output};
use wire::id::NodeId;

use crate::clock::HostClock;
use crate::part::make::{AssemblyError, part};
use crate::trial::{GRACE, start};
use crate::{JournalEntry, Twin};

/// A run with the known inputs and outputs of each core.
pub struct Journalled {
    topology: Topology,
    journals: Vec<Vec<JournalEntry>>,
}

/// Runs the scenario and keeps the inputs and outputs of every core.
///
/// # Errors
/// When a core cannot be made.
pub fn journalled(scenario: &Scenario, setup: &Setup, seed: u64) -> Result<Journalled, AssemblyError> {
    let (topology, mut twin): (Topology, Twin) = start(scenario, setup, seed, true)?;
    twin.run_until(topology.duration);
    twin.finish(GRACE);
    Ok(Journalled { topology, journals: twin.into_journals() })
}

/// Part that has to be the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Same {
    /// Every byte of the outputs.
    Bytes,
    /// The decisions, under any waiver.
    Decisions,
}

/// Result of replaying to one core.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReplayedCore {
    /// Node of the core.
    pub node: NodeId,
    /// Inputs fed; where bytes are compared, up to the first difference.
    pub inputs: u64,
    /// Outputs compared and found equal.
    pub outputs: u64,
    /// The first difference.
    pub parted: Option<Parted>,
    /// Inputs on which it decided otherwise, by the decisions then and now.
    pub otherwise: BTreeMap<(String, String), u64>,
}

/// Place at which a core acted otherwise than in the run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parted {
    /// Time of the run.
    pub at: Micros,
    /// The input, from 0.
    pub input: u64,
    /// Outputs of the core in the run.
    pub then: Vec<Output>,
    /// Outputs of the fresh core.
    pub now: Vec<Output>,
}

impl Journalled {
    /// Feeds every core of `topology`, which has the members of the run: its own, or that of another policy.
    ///
    /// A core with a process that ended meanwhile had several lives and one input journal; it is left out.
    ///
    /// # Errors
    /// When a core cannot be made.
    pub fn replay_cores(&self, topology: &Topology, same: Same) -> Result<Vec<ReplayedCore>, AssemblyError> {
        let lived_once = |member: &Member| topology.process_faults.iter().all(|o| o.node != member.node());
        let each = topology.members.iter().zip(&self.journals).filter(|(member, _)| lived_once(member));
        each.map(|(member, journal)| one(topology, member, journal, same)).collect()
    }

    /// The journals of these cores alone.
    #[must_use]
    pub fn only(mut self, wanted: impl Fn(NodeId) -> bool) -> Journalled {
        let wanted_cores = self.topology.members.iter().map(|m| wanted(m.node())).collect::<Vec<_>>();
        let mut keep = wanted_cores.iter();
        self.journals.retain(|_| keep.next().copied().unwrap_or(false));
        self.topology.members.retain(|m| wanted(m.node()));
        self
    }

    /// Messages between the services, in order of time.
    pub fn messages(&self) -> Vec<Message> {
        let each = self.topology.members.iter().zip(&self.journals).flat_map(|(member, journal)| {
            let (node, clock) = (member.node(), HostClock::from(self.topology.clocks[member.host as usize]));
            journal.iter().filter_map(move |entry| Message::from_input(node, clock.true_time(entry.now), &entry.input))
        });
        let mut messages: Vec<Message> = each.collect();
        messages.sort_by_key(|message| message.at);
        messages
    }

    /// The topology of the run.
    pub fn topology(&self) -> &Topology {
        &self.topology
    }
}

fn one(
    topology: &Topology,
    member: &Member,
    journal: &[JournalEntry],
    same: Same,
) -> Result<ReplayedCore, AssemblyError> {
    let clock = HostClock::from(topology.clocks[member.host as usize]);
    let mut core = part(member, clock.read(0))?;
    // What a core says when it is made went into the run's log before its input journal began.
    while core.output().is_some() {}
    let mut replayed =
        ReplayedCore { node: member.node(), inputs: 0, outputs: 0, parted: None, otherwise: BTreeMap::new() };
    for entry in journal {
        core.handle(entry.now, &entry.input);
        let now: Vec<Output> = std::iter::from_fn(|| core.output()).collect();
        let equal = match same {
            Same::Bytes => now == entry.outputs,
            Same::Decisions => decisions(&now) == decisions(&entry.outputs),
        };
        if equal {
            replayed.outputs += now.len() as u64;
        } else {
            let kinds = |outputs: &[Output]| decisions(outputs).iter().map(kind_of).collect::<Vec<_>>().join(", ");
            *replayed.otherwise.entry((kinds(&entry.outputs), kinds(&now))).or_default() += 1;
            let (at, input) = (clock.true_time(entry.now), replayed.inputs);
            replayed.parted.get_or_insert_with(|| Parted { at, input, then: entry.outputs.clone(), now });
            if same == Same::Bytes {
                break;
            }
        }
        replayed.inputs += 1;
    }
    Ok(replayed)
}

/// The decisions among the outputs of a core.
pub fn decisions(outputs: &[Output]) -> Vec<Any> {
    let events = outputs.iter().filter_map(|output| {
        let Output::Audit { bytes } = output else { return None };
        Entry::decode(bytes).ok().map(|entry| entry.event)
    });
    events.filter_map(decision).collect()
}
