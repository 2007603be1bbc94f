//! `[[guest_bus]]`: an attacker on the bus by which a guest's own programs talk to each other, such as a ROS 2 graph or a MAVLink link.
//!
//! The guest's adapter carries it out, step by step, and its witness counts arrivals at the attacked end. A run needs a guest whose file
//! offers the attack.

use evidence::Planned;
use ground_truth::BusAttack;

use super::{Act, Attack, Injection};
use crate::finding::{Finding, finding};
use crate::timed::timed;
use crate::value::Real;
use crate::{Scenario, Seconds, Whole, Windowed};

/// Most tables that can be open at once.
const MOST_OPEN: usize = guest::bus::MAX_ORDERS;

timed! {
    /// An attack on the guest's own bus.
    GuestBus lasts duration_s needs OnPath {
        /// Length of the window.
        duration_s: Seconds,
        /// The attack, one that the guest's file offers.
        attack: BusAttack,
        /// Messages of the attacker a second.
        #[serde(default = "as_often_as_steps")]
        rate_hz: Whole<1, 2_000>,
        /// Size of the falsehood, in the unit of the attack: m, m/s or s.
        #[serde(default)]
        amount: Real<-1_000_000, 1_000_000>,
    }
}

/// One message for each control step of the shipped platforms.
fn as_often_as_steps() -> Whole<1, 2_000> {
    Whole::constant(20)
}

impl Attack for GuestBus {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::GuestBus(BusWindow {
            start_ms: self.start_ms(phase_ms),
            duration_ms: self.length_ms(),
            attack: self.attack,
            rate_hz: self.rate_hz.unsigned() as u32,
            amount: self.amount.get(),
        }))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::GuestBus(self.attack)))
    }

    fn check(&self, whole: &Scenario) -> Vec<Finding> {
        let mut found = Vec::new();
        if self.duration_s.get() <= 0.0 {
            found.push(finding(&self.at_s, "it ends when it begins", "give a longer `duration_s`"));
        }
        if let Some(when) = &self.when {
            let remedy = "give its time by `at_s`: the adapter sees no events of the run";
            found.push(finding(when, "an attack on a guest's bus waits for no event", remedy));
        }
        if whole.guest_bus.len() > MOST_OPEN {
            found.push(finding(&self.at_s, "more than four attacks on a guest's bus", "leave some out"));
        }
        found
    }
}

/// An attack on a guest's bus with its window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BusWindow {
    /// Start, milliseconds of the run.
    pub start_ms: u64,
    /// Length, milliseconds.
    pub duration_ms: u64,
    /// The attack.
    pub attack: BusAttack,
    /// Messages of the attacker a second.
    pub rate_hz: u32,
    /// Size of the falsehood, in the unit of the attack.
    pub amount: f64,
}
