//! `[[malformed]]`: an admitted teammate sends records that are authenticated and broken.

use adversary::plan;
use evidence::Planned;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
            flaws: self.flaws.iter().copied().map(flaw).collect(),
            count: self.count.unsigned() as u32,
            every_ms: self.every_ms.unsigned(),
            step: self.actor_step(),
        })))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Malformed).longer_by(self.count.unsigned() * self.every_ms.unsigned()))
    }
}

/// Flaw of a malformed record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Flaw {
    /// Longer than any record may be.
    Length,
    /// Not the schema.
    Schema,
    /// Not the one canonical encoding.
    NonCanonical,
    /// A value outside its range.
    Range,
    /// A list that claims more elements than there are bytes.
    Count,
    /// Random bytes.
    Noise,
    /// Sound except for its stated session.
    Session,
    /// Sound, but of another version of the session layer.
    Version,
    /// Sound, its sequence far ahead of the one before; the sender goes on from there.
    Jump,
    /// Sound, around a report whose stated identity is no vehicle.
    Origin,
}

fn flaw(flaw: Flaw) -> plan::Flaw {
    match flaw {
        Flaw::Length => plan::Flaw::Length,
        Flaw::Schema => plan::Flaw::Schema,
        Flaw::NonCanonical => plan::Flaw::NonCanonical,
        Flaw::Range => plan::Flaw::Range,
        Flaw::Count => plan::Flaw::Count,
        Flaw::Noise => plan::Flaw::Noise,
        Flaw::Session => plan::Flaw::Session,
        Flaw::Version => plan::Flaw::Version,
        Flaw::Jump => plan::Flaw::Jump,
        Flaw::Origin => plan::Flaw::Origin,
    }
}
