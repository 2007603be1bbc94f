//! Forking: the one place where a core becomes two.
//!
//! Authority is not to be copied, yet a world of the twin may be, with all that is in it. The [`Fork`] of a new world
//! can only be made here, and its one use is [`Autonomy::fork`]; authority copied by it carries the new world's id.

use wire::id::WorldId;

use crate::Autonomy;

/// The right to copy a core into one new world.
#[derive(Debug)]
pub struct Fork {
    world: WorldId,
}

impl Fork {
    /// The new world.
    pub fn world(&self) -> WorldId {
        self.world
    }
}

impl Autonomy {
    /// Copy of the core for world `world`; from here on the two share no state.
    #[must_use]
    pub fn fork(&self, world: WorldId) -> Autonomy {
        self.copy(&Fork { world })
    }
}
