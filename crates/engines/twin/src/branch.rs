//! Branches from a moment by other chances: the seed's variations are drawn again, and everything else stays.
//!
//! A branch is no run and cannot pass for one: it has its own world, and its log begins at the branch, so that every
//! chain in it lacks its beginning. The draws made once, before a trial starts (clocks, places, phases), are part of
//! the state that is copied. Nonces go on as they were: no outcome lies in their values.

use autonomy::Autonomy;
use scenario::Varies;
use sim::Sim;
use wire::id::{NodeId, WorldId};
use wire::time::Instant;

use super::Twin;
use super::part::Part;
use super::queue::Micros;

/// Set in the world of every branch: worlds of forks are counted from 1.
const BRANCHED: u64 = 1 << 63;

impl Twin {
    /// Copy of the state, from which losses, delays and noise go on as `seed` has them, as far as the scenario `varies`
    /// them.
    #[must_use]
    pub fn branch(&self, seed: u64, varies: &Varies) -> Twin {
        let mut branch = self.copy(WorldId(seed | BRANCHED));
        branch.delays.reseed(branch_seed(seed, 0));
        for (i, node) in (1..).zip(&mut branch.nodes) {
            node.part.reseed(branch_seed(seed, i), varies.noise);
        }
        branch
    }

    /// Runs to `end`, or until `reached` holds of the twin as it is now or after anything that happens; says whether it
    /// does.
    pub fn run_until_reached(&mut self, end: Micros, reached: impl Fn(&Twin) -> bool) -> bool {
        while !reached(self) {
            if !self.step(end) {
                self.now = end;
                return false;
            }
        }
        true
    }

    /// The core of the unit under test, and the time on its host.
    pub fn unit(&self) -> Option<(&Autonomy, Instant)> {
        let index = self.index(NodeId::UNIT_A)?;
        let Part::Autonomy(core) = &self.nodes[usize::from(index)].part else { return None };
        Some((core, self.local(index)))
    }

    /// The world of the unit under test.
    pub fn sim(&self) -> Option<&Sim> {
        let Part::Sim(core) = &self.nodes[usize::from(self.index(NodeId::SIM)?)].part else { return None };
        Some(core)
    }
}

/// The seed of one source of chance after a branch.
fn branch_seed(seed: u64, source: u64) -> u64 {
    let key = blake3::derive_key("holdsafe twin branch v1", &[seed.to_le_bytes(), source.to_le_bytes()].concat());
    key.first_chunk().map_or(seed, |bytes| u64::from_le_bytes(*bytes))
}
