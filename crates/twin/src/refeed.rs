//! Replay of the inputs of a run in the twin to fresh cores.
//!
//! Under the same policy every byte has to come out again: a core is a function of its inputs. Under another policy the first
//! decision that differs is the one that the policy would have changed. All inputs after it are still those of the run, which would have gone
//! on otherwise too: the difference of the verdicts on them speaks of a boundary, and not of the way on under the policy. For that,
//! run the scenario under it.

use std::collections::BTreeMap;

use evidence::Micros;
use evidence::log::{decision, kind_of};
use evidence::passed::{Passed, kept};
use instrument::{Any, Entry};
use scenario::{Scenario, Setup};
use topology::{Cast, Member};
use wire::core::{Core, Output};
use wire::id::NodeId;

use crate::clock::HostClock;
use crate::part::make::{AssemblyError, part};
use crate::trial::{GRACE, start};
use crate::{JournalEntry, Twin};

/// A run with the known inputs and outputs of each core.
pub struct Fed {
    cast: Cast,
    mouths: Vec<Vec<JournalEntry>>,
}

/// Runs the scenario and keeps the inputs and outputs of every core.
///
/// # Errors
/// When a core cannot be made.
pub fn fed(scenario: &Scenario, setup: &Setup, seed: u64) -> Result<Fed, AssemblyError> {
    let (cast, mut twin): (Cast, Twin) = start(scenario, setup, seed, true)?;
    twin.run_until(cast.duration);
    twin.finish(GRACE);
    Ok(Fed { cast, mouths: twin.into_mouths() })
}

/// Part that has to be the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Same {
    /// Every byte.
    Bytes,
    /// The decisions, under any waiver.
    Decisions,
}

/// Result of replaying to one core.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refed {
    /// Which.
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
    /// Its outputs in the run.
    pub then: Vec<Output>,
    /// Its outputs now.
    pub now: Vec<Output>,
}

impl Fed {
    /// Feeds every core of `cast`, which has the members of the run: its own topology, or that of another policy.
    ///
    /// A core with a process that ended meanwhile had several lives and one input journal; it is left out.
    ///
    /// # Errors
    /// When a core cannot be made.
    pub fn again(&self, cast: &Cast, same: Same) -> Result<Vec<Refed>, AssemblyError> {
        let lived_once = |member: &Member| cast.process_faults.iter().all(|o| o.node != member.node());
        let each = cast.members.iter().zip(&self.mouths).filter(|(member, _)| lived_once(member));
        each.map(|(member, mouth)| one(cast, member, mouth, same)).collect()
    }

    /// The same of these cores alone.
    #[must_use]
    pub fn only(mut self, wanted: impl Fn(NodeId) -> bool) -> Fed {
        let kept = self.cast.members.iter().map(|m| wanted(m.node())).collect::<Vec<_>>();
        let mut keep = kept.iter();
        self.mouths.retain(|_| keep.next().copied().unwrap_or(false));
        self.cast.members.retain(|m| wanted(m.node()));
        self
    }

    /// Messages between the services, in order of time.
    pub fn passed(&self) -> Vec<Passed> {
        let each = self.cast.members.iter().zip(&self.mouths).flat_map(|(member, mouth)| {
            let (node, clock) = (member.node(), HostClock::from(self.cast.clocks[member.host as usize]));
            mouth.iter().filter_map(move |of| kept(node, clock.when(of.now), &of.input))
        });
        let mut passed: Vec<Passed> = each.collect();
        passed.sort_by_key(|of| of.at);
        passed
    }

    /// The topology of the run.
    pub fn cast(&self) -> &Cast {
        &self.cast
    }
}

fn one(cast: &Cast, member: &Member, mouth: &[JournalEntry], same: Same) -> Result<Refed, AssemblyError> {
    let clock = HostClock::from(cast.clocks[member.host as usize]);
    let mut core = part(member, clock.read(0))?;
    // What a core says when it is made went into the run's log before its mouth opened.
    while core.output().is_some() {}
    let mut refed = Refed { node: member.node(), inputs: 0, outputs: 0, parted: None, otherwise: BTreeMap::new() };
    for mouthful in mouth {
        core.handle(mouthful.now, &mouthful.input);
        let now: Vec<Output> = std::iter::from_fn(|| core.output()).collect();
        let equal = match same {
            Same::Bytes => now == mouthful.outputs,
            Same::Decisions => decisions(&now) == decisions(&mouthful.outputs),
        };
        if equal {
            refed.outputs += now.len() as u64;
        } else {
            let kinds = |outputs: &[Output]| decisions(outputs).iter().map(kind_of).collect::<Vec<_>>().join(", ");
            *refed.otherwise.entry((kinds(&mouthful.outputs), kinds(&now))).or_default() += 1;
            let (at, input) = (clock.when(mouthful.now), refed.inputs);
            refed.parted.get_or_insert_with(|| Parted { at, input, then: mouthful.outputs.clone(), now });
            if same == Same::Bytes {
                break;
            }
        }
        refed.inputs += 1;
    }
    Ok(refed)
}

/// The decisions among the outputs of a core.
pub fn decisions(outputs: &[Output]) -> Vec<Any> {
    let events = outputs.iter().filter_map(|output| {
        let Output::Audit { bytes } = output else { return None };
        Entry::decode(bytes).ok().map(|entry| entry.event)
    });
    events.filter_map(decision).collect()
}
