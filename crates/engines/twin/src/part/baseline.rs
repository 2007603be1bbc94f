//! A known run, and cores that follow it for as long as they are fed the same inputs.
//!
//! A core is a function of its inputs (`tests/properties/journals.rs`). While a core of another run, made from the same
//! setup, is fed the inputs of the known run, byte for byte and at the same time, its outputs and next deadline are
//! those of the known run: without physics, inference or signatures. At the first difference the core is forked from
//! the last snapshot of the known run, is fed the inputs since, and runs by itself from then on. Its outputs are the
//! same either way (`tests/properties/trunk.rs`). The baseline of a search is the run without an attack.

use std::sync::Arc;

use topology::{Member, Topology};
use wire::core::{Core, Input, Output};
use wire::id::WorldId;
use wire::time::Instant;

use super::Part;
use super::make::{AssemblyError, part};
use crate::verified::Verified;
use crate::{JournalEntry, Twin};

/// Snapshots of each core, evenly over the run: the part computed again when a core leaves the baseline is less than
/// one of them.
const SNAPSHOTS: u64 = 64;

/// A known run.
pub struct Baseline {
    tracks: Vec<Track>,
    verified: Verified,
}

/// Inputs and outputs of one core, and its state now and then.
struct Track {
    member: Member,
    /// Outputs of the core before its first input, and its first deadline.
    start: (Vec<Output>, Option<Instant>),
    journal: Vec<JournalEntry>,
    /// State of the core after a number of journal entries, in order; the first after none.
    snapshots: Vec<(usize, Part)>,
}

impl Baseline {
    /// Runs `twin`, which has just been made from `topology` and keeps its input journals, to its end.
    ///
    /// # Errors
    /// Which core cannot be made a second time.
    pub fn record(topology: &Topology, mut twin: Twin, grace: u64) -> Result<Self, AssemblyError> {
        let mut tracks = Vec::new();
        for (member, node) in topology.members.iter().zip(twin.nodes()) {
            // The cores of `twin` have given their first outputs already, so a fresh core tells them.
            let mut fresh = part(member, twin.local_start(node.host))?;
            let outputs = std::iter::from_fn(|| fresh.output()).collect();
            let start = (outputs, fresh.deadline());
            let snapshots = vec![(0, node.part.fork(twin.world))];
            tracks.push(Track { member: member.clone(), start, journal: Vec::new(), snapshots });
        }
        for n in 1..=SNAPSHOTS {
            twin.run_until(topology.duration * n / SNAPSHOTS);
            let journals = twin.journals().unwrap_or_default();
            for ((track, node), journal) in tracks.iter_mut().zip(twin.nodes()).zip(journals) {
                track.snapshots.push((journal.len(), node.part.fork(twin.world)));
            }
        }
        twin.finish(grace);
        let verified = twin.verified().detached();
        for (track, journal) in tracks.iter_mut().zip(twin.into_journals()) {
            track.journal = journal;
        }
        Ok(Self { tracks, verified })
    }

    /// A core of `member` that follows the baseline; none where the baseline has no core made from the same setup.
    pub fn follow(self: &Arc<Self>, member: &Member, world: WorldId) -> Option<Following> {
        let same = |track: &Track| track.member.setup == member.setup && track.member.role == member.role;
        let track = self.tracks.iter().position(same)?;
        Some(Following { baseline: Arc::clone(self), track, world, fed: 0, said: 0, left: None })
    }

    /// Signatures that the cores of the baseline know to be good, in a separate memory.
    pub fn verified(&self) -> Verified {
        self.verified.detached()
    }
}

/// A core that follows a baseline, or has left it.
pub struct Following {
    baseline: Arc<Baseline>,
    track: usize,
    world: WorldId,
    /// Number of journal entries followed.
    fed: usize,
    /// Number of outputs given of the last of these entries.
    said: usize,
    left: Option<Part>,
}

impl Following {
    /// Copy for a forked world.
    #[must_use]
    pub fn fork(&self, world: WorldId) -> Following {
        let left = self.left.as_ref().map(|part| part.fork(world));
        Following { baseline: Arc::clone(&self.baseline), world, left, ..*self }
    }

    /// The core once it runs by itself, or one of the same kind.
    pub fn like(&self) -> &Part {
        self.left.as_ref().unwrap_or(&self.track().snapshots[0].1)
    }

    /// True while the core follows the baseline.
    pub fn follows(&self) -> bool {
        self.left.is_none()
    }

    /// Makes the core run by itself from now on.
    pub fn leave_for_good(&mut self) -> &mut Part {
        let part = self.left.take().unwrap_or_else(|| self.leave());
        self.left.insert(part)
    }

    fn track(&self) -> &Track {
        &self.baseline.tracks[self.track]
    }

    /// The core in its state after the inputs so far.
    fn leave(&self) -> Part {
        let Track { journal, snapshots, .. } = self.track();
        let last = snapshots.partition_point(|(fed, _)| *fed <= self.fed) - 1;
        let (from, snapshot) = &snapshots[last];
        let mut part = snapshot.fork(self.world);
        for JournalEntry { now, input, .. } in &journal[*from..self.fed] {
            part.handle(*now, input);
            // The baseline's journal has given these outputs already.
            while part.output().is_some() {}
        }
        part
    }
}

impl Core for Following {
    fn handle(&mut self, now: Instant, input: &Input) {
        if let Some(part) = &mut self.left {
            return part.handle(now, input);
        }
        let known = self.track().journal.get(self.fed).is_some_and(|known| known.now == now && known.input == *input);
        if known {
            (self.fed, self.said) = (self.fed + 1, 0);
        } else {
            self.leave_for_good().handle(now, input);
        }
    }

    fn deadline(&self) -> Option<Instant> {
        match (&self.left, self.fed.checked_sub(1)) {
            (Some(part), _) => part.deadline(),
            (None, None) => self.track().start.1,
            (None, Some(last)) => self.track().journal[last].deadline,
        }
    }

    fn output(&mut self) -> Option<Output> {
        if let Some(part) = &mut self.left {
            return part.output();
        }
        let track = self.track();
        let all = self.fed.checked_sub(1).map_or(&track.start.0, |last| &track.journal[last].outputs);
        let output = all.get(self.said).cloned();
        self.said += usize::from(output.is_some());
        output
    }
}
