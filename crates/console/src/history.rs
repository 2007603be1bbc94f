//! Event history of this display: reported modes, given orders, and alarms raised, ended and acknowledged.
//!
//! It is bounded; the recording holds the rest. Alarms still to be acknowledged are `alarms`'s; jump targets in a
//! recording are `moment`'s, which compares two pictures.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use config::suite::Suite;
use wire::id::{PeerId, UnitId};
use wire::mode::{Cause, Mode};
use wire::person::{Alarm, Order};
use wire::time::Instant;

use crate::alarm::{self, Priority};
use crate::life::Giver;

/// The most that is kept.
pub const MAX_PAST: usize = 256;

/// An event at the display.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Incident {
    /// A unit reported a change of mode: the unit, its new mode, the cause, and its sensors.
    Mode(UnitId, Mode, Cause, Suite),
    /// An order was given here, by this source.
    Ordered(Order, Giver),
    /// An alarm was raised.
    Raised(Alarm),
    /// The alarm's condition is over.
    Over(Alarm),
    /// The alarm was acknowledged here.
    Acknowledged(Alarm),
}

impl Incident {
    /// Priority, if the event is a raised alarm.
    pub fn priority(&self) -> Option<Priority> {
        match self {
            Incident::Raised(alarm) => Some(Priority::from_alarm(alarm)),
            Incident::Mode(..) | Incident::Ordered(..) | Incident::Over(_) | Incident::Acknowledged(_) => None,
        }
    }

    /// Text of the event.
    pub fn words(&self) -> String {
        match self {
            Incident::Mode(unit, mode, cause, suite) => {
                format!("{unit} went to {}, cause {}", mode.name(), suite.cause(*cause))
            }
            Incident::Ordered(Order::Command(unit, kind), by) => {
                format!("{} to {unit}, given by {}", kind.name(), by.words())
            }
            Incident::Ordered(Order::Revoke(who), by) => format!("revoke {who}, given by {}", by.words()),
            Incident::Raised(alarm) => alarm::words(alarm),
            Incident::Over(alarm) => format!("over: {}", alarm::words(alarm)),
            Incident::Acknowledged(alarm) => format!("acknowledged: {}", alarm::words(alarm)),
        }
    }
}

/// Whom something was about: of each as much is kept as of any other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Subject {
    Unit(UnitId),
    Peer(PeerId),
    /// The orders that were given here.
    Orders,
}

impl Incident {
    fn subject(&self) -> Subject {
        match self {
            Incident::Mode(unit, ..) => Subject::Unit(*unit),
            Incident::Ordered(..) => Subject::Orders,
            Incident::Raised(alarm) | Incident::Over(alarm) | Incident::Acknowledged(alarm) => match alarm {
                Alarm::HoldSafe(unit)
                | Alarm::Degraded(unit)
                | Alarm::Stale(unit)
                | Alarm::Silent(unit)
                | Alarm::TrackLost(unit, ..)
                | Alarm::ClockRuns(unit) => Subject::Unit(*unit),
                Alarm::LinkDown(peer) | Alarm::SessionLost(peer) => Subject::Peer(*peer),
                Alarm::NotAcknowledged(_) | Alarm::CommandRefused(_) => Subject::Orders,
            },
        }
    }
}

/// An event and its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Past {
    /// On the console's clock.
    pub at: Instant,
    /// Content of the event.
    pub what: Incident,
}

/// Events, at most [`MAX_PAST`]: the newest, shared evenly between units and links.
#[derive(Clone, Debug, Default)]
pub struct History {
    /// Shared with the pictures that show it, which are many for each entry.
    kept: Arc<VecDeque<Past>>,
    more: u32,
}

impl History {
    /// Keeps one more event. Where there is no room, the oldest event of the unit or link with the most is dropped: a
    /// busy one displaces only its own events.
    pub fn note(&mut self, at: Instant, what: Incident) {
        let pasts = Arc::make_mut(&mut self.kept);
        pasts.push_back(Past { at, what });
        if pasts.len() > MAX_PAST {
            let mut map = BTreeMap::<_, usize>::new();
            pasts.iter().for_each(|past| *map.entry(past.what.subject()).or_default() += 1);
            let oldest = (0..pasts.len()).rev().max_by_key(|n| map.get(&pasts[*n].what.subject()));
            oldest.and_then(|oldest| pasts.remove(oldest));
            self.more = self.more.saturating_add(1);
        }
    }

    /// Events as drawn, oldest first, and the number of events no longer kept.
    pub fn shown(&self) -> (Arc<VecDeque<Past>>, u32) {
        (Arc::clone(&self.kept), self.more)
    }
}
