//! `[[corrupt]]`: the relay without a key changes telemetry datagrams on the way.

use adversary::plan::{self, DatagramAction};
use evidence::{Planned, Takes};
use instrument::Action;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Act, Attack, Injection, attacks, during};
use crate::Share;

attacks! {
    /// Changes datagrams on the way.
    Corrupt {
        /// Probability for each datagram.
        share: Share,
        /// The change.
        damage: Damage,
    }
}

impl Attack for Corrupt {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let damage = match self.damage {
            Damage::Flip => plan::Damage::Flip,
            Damage::Truncate => plan::Damage::Truncate,
            Damage::Extend => plan::Damage::Extend,
            Damage::Splice => plan::Damage::Splice,
        };
        let action = DatagramAction::Corrupt { permille: self.share.permille(), damage };
        Some(Act::Datagram(during(self, self.direction, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Action(Action::Corrupt)).taking(Takes::Records(self.direction.side())))
    }
}

/// Change to a datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Damage {
    /// One random bit flipped.
    Flip,
    /// Cut short at a random length.
    Truncate,
    /// Random bytes added.
    Extend,
    /// Head of this one, tail of the one before.
    Splice,
}
