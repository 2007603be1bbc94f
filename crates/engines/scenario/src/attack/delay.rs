//! `[[delay]]`: the relay without a key holds telemetry datagrams back.

use adversary::plan::DatagramAction;
use evidence::{Planned, Takes};
use ground_truth::Action;

use super::{Act, Attack, Injection, attacks, during};
use crate::{Millis, Real};

attacks! {
    /// Holds datagrams back by a time that may grow.
    Delay {
        /// Delay at the start of the window.
        by_ms: Millis,
        /// Growth of the delay.
        #[serde(default)]
        growth_ms_per_s: Real<0, 1_000_000>,
    }
}

impl Attack for Delay {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let growth_us_per_s = (self.growth_ms_per_s.get() * 1000.0) as u64;
        let action = DatagramAction::Delay { ms: self.by_ms.unsigned(), growth_us_per_s };
        Some(Act::Datagram(during(self, self.direction, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Action(Action::Delay)).taking(Takes::Records(self.direction.side())))
    }
}
