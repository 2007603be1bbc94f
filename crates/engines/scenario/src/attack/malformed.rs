//! `[[malformed]]`: an admitted teammate sends records that are authenticated and broken.

use adversary::plan::{self, Flaw};
use evidence::Planned;

use super::{Act, Attack, Deceit, Injection};
use crate::timed::timed;
use crate::{Count, List, Located, Millis, Windowed};

timed! {
    /// An admitted teammate sends records that are authenticated and broken.
    Malformed needs Insider sees Insider {
        /// The flaws, taken in turn.
        flaws: Located<List<Flaw, 8>>,
        /// Count of the records.
        count: Count,
        /// Time between them.
        every_ms: Millis,
    }
}

impl Attack for Malformed {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Teammate(Deceit::Malformed(plan::Malformed {
            at_ms: self.start_ms(phase_ms),
            flaws: self.flaws.to_vec(),
            count: self.count.unsigned() as u32,
            every_ms: self.every_ms.unsigned(),
            step: self.actor_step(),
        })))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Malformed).longer_by(self.count.unsigned() * self.every_ms.unsigned()))
    }
}
