//! Attacks on the bus of a guest's own programs, as orders to the guest's adapter with their times.

use evidence::Micros;
use guest::BusOrder;
use scenario::{Act, Scenario};

use crate::attack::acts;

/// An order to a guest's adapter, and the time in which it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedOrder {
    /// Begin, microseconds of the run.
    pub from: Micros,
    /// End.
    pub until: Micros,
    /// The order.
    pub order: BusOrder,
}

/// The orders of a scenario, numbered from 1 in the order of its tables.
pub(super) fn orders(s: &Scenario, phase: u64) -> Vec<TimedOrder> {
    let windows = acts(s, phase).filter_map(|act| if let Act::GuestBus(window) = act { Some(window) } else { None });
    let timed = windows.enumerate().map(|(i, window)| TimedOrder {
        from: window.start_ms * 1000,
        until: (window.start_ms + window.duration_ms) * 1000,
        order: BusOrder {
            id: i as u8 + 1,
            attack: window.attack,
            rate_hz: f64::from(window.rate_hz),
            amount: window.amount,
        },
    });
    timed.collect()
}
