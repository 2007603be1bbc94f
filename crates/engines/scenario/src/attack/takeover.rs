//! `[[takeover]]`: a thief holds a copy of a service's certificate and takes its session at the broker.

use adversary::plan;
use evidence::Planned;
use wire::id::PeerId;

use super::{Act, Attack, Injection};
use crate::finding::{Finding, finding};
use crate::timed::timed;
use crate::{Located, Name, Scenario, Seconds, Windowed};

timed! {
    /// A thief holds a copy of a service's certificate and takes that one's session at the broker. All tables of a scenario are
    /// one thief's.
    Takeover lasts duration_s needs Insider {
        /// Time for which it has the session, or fights for it with the owner.
        duration_s: Seconds,
        /// Identity of the certificate: the unit under test or the gateway.
        certificate: Located<Name>,
    }
}

impl Attack for Takeover {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Takeover(plan::Takeover {
            at_ms: self.start_ms(phase_ms),
            duration_ms: self.length_ms(),
            step: self.actor_step(),
        }))
    }

    fn injection(&self) -> Option<Injection> {
        PeerId::from_name(self.certificate.as_str()).map(|peer| Injection::new(Planned::Takeover(peer)))
    }

    /// One thief: one certificate, of one who has a session at the broker, and no other process in the impostor's part.
    fn check(&self, whole: &Scenario) -> Vec<Finding> {
        let mut found = Vec::new();
        if !["unit-a", "gateway"].contains(&self.certificate.as_str()) {
            found.push(finding(&self.certificate, "no session to be taken", "name `unit-a` or `gateway`"));
        }
        if self.duration_s.get() <= 0.0 {
            found.push(finding(&self.at_s, "it ends when it begins", "give a longer `duration_s`"));
        }
        let Some(first) = whole.takeover.first() else { return found };
        if *self.certificate != *first.certificate {
            found.push(finding(&self.certificate, "another certificate", "a scenario has one thief"));
        }
        let impostor = whole.attacks().into_iter().any(|attack| matches!(attack.act(0), Some(Act::Rogue { .. })));
        if impostor && std::ptr::eq(self, first) {
            let remedy = "put what is done on shared memory into a scenario of its own";
            found.push(finding(&self.at_s, "two impostors", remedy));
        }
        found
    }
}
