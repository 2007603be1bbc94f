//! Event history of this display: events that ask for no act (modes, orders, tracks, links), and the lives of alarms.
//!
//! It is bounded; the recording holds the rest. Alarms still to be acknowledged are `alarms`'s; jump targets in a
//! recording are `moment`'s, which compares two pictures.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use config::suite::Suite;
use wire::bounds::Bounds;
use wire::id::{PeerId, TrackId, UnitId};
use wire::mode::{Cause, Mode};
use wire::person::{Alarm, Order, Shelf};
use wire::sensor::Class;
use wire::time::Instant;

use crate::alarm::{self, Priority};
use crate::life::Giver;
use crate::wording;

/// The most that is kept.
pub const MAX_PAST: usize = 256;

/// An event at the display.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Incident {
    /// A unit reported a change of mode: the unit, its new mode, the cause, and its sensors.
    Mode(UnitId, Mode, Cause, Suite),
    /// An order was given here, by this source.
    Ordered(Order, Giver),
    /// A unit no longer reports a track: the unit, the track and its class.
    TrackEnded(UnitId, TrackId, Class),
    /// The picture of a unit became stale, or is so no more.
    Stale(UnitId, bool),
    /// A session at the gateway opened or ended.
    Link(PeerId, bool),
    /// An alarm was raised, with this priority. Every alarm has the sensors of its unit beside it, which word it.
    Raised(Alarm, Suite, Priority),
    /// The alarm's cause is over.
    Over(Alarm, Suite),
    /// The alarm was acknowledged here.
    Acknowledged(Alarm, Suite),
    /// The alarm was put aside here.
    Shelved(Alarm, Suite, Shelf),
    /// The alarm that was put aside is back.
    Returned(Alarm, Suite),
    /// The sound was silenced here.
    Silenced,
}

impl Incident {
    /// Priority, if the event is a raised alarm.
    pub fn priority(&self) -> Option<Priority> {
        if let Incident::Raised(_, _, priority) = self { Some(*priority) } else { None }
    }

    /// Text of the event on a platform with these bounds.
    pub fn words(&self, bounds: &Bounds) -> String {
        let was = |alarm: &Alarm, suite: &Suite| alarm::words(alarm, *suite, false);
        let is = |alarm: &Alarm, suite: &Suite| alarm::words(alarm, *suite, true);
        match self {
            Incident::Mode(unit, mode, cause, suite) => {
                let [why, _] = wording::cause((*cause, *mode), *suite, None, bounds);
                format!("{unit} went to {}: {why}", mode.name())
            }
            Incident::Ordered(Order::Command(unit, kind), by) => {
                format!("{} to {unit}, given by {}", kind.name(), by.words())
            }
            Incident::Ordered(Order::Revoke(who), by) => format!("revoke {who}, given by {}", by.words()),
            Incident::TrackEnded(unit, track, class) => alarm::ended_words(*unit, *track, *class),
            Incident::Stale(unit, true) => format!("what is shown of {unit} is stale"),
            Incident::Stale(unit, false) => format!("{unit} was stale, over"),
            Incident::Link(peer, true) => format!("{peer} has a session at the gateway"),
            Incident::Link(peer, false) => format!("{peer} has no session at the gateway any more"),
            Incident::Raised(alarm, suite, _) => is(alarm, suite),
            Incident::Over(alarm, suite) => format!("over: {}", was(alarm, suite)),
            Incident::Acknowledged(alarm, suite) => format!("acknowledged: {}", is(alarm, suite)),
            Incident::Shelved(alarm, suite, shelf) => {
                format!("shelved for {} min: {}", shelf.minutes(), is(alarm, suite))
            }
            Incident::Returned(alarm, suite) => format!("back from the shelf: {}", is(alarm, suite)),
            Incident::Silenced => "sound silenced for 2 min".to_owned(),
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
            Incident::Mode(unit, ..) | Incident::TrackEnded(unit, ..) | Incident::Stale(unit, _) => {
                Subject::Unit(*unit)
            }
            Incident::Link(peer, _) => Subject::Peer(*peer),
            Incident::Ordered(..) | Incident::Silenced => Subject::Orders,
            Incident::Raised(alarm, ..)
            | Incident::Over(alarm, _)
            | Incident::Acknowledged(alarm, _)
            | Incident::Shelved(alarm, ..)
            | Incident::Returned(alarm, _) => subject_of(alarm),
        }
    }
}

fn subject_of(alarm: &Alarm) -> Subject {
    match alarm {
        Alarm::HoldSafe(unit)
        | Alarm::HeldElsewhere(unit)
        | Alarm::Degraded(unit)
        | Alarm::GuardLost(unit, _)
        | Alarm::Contradicts(unit)
        | Alarm::Claims(unit)
        | Alarm::Stale(unit)
        | Alarm::Silent(unit)
        | Alarm::ContactDue(unit)
        | Alarm::TrackLost(unit, ..)
        | Alarm::TracksLost(unit)
        | Alarm::ClockRuns(unit) => Subject::Unit(*unit),
        Alarm::LinkDown(peer) | Alarm::SessionLost(peer) => Subject::Peer(*peer),
        Alarm::GatewaySilent => Subject::Peer(PeerId::GATEWAY),
        Alarm::NotAcknowledged(_) | Alarm::CommandRefused(_) => Subject::Orders,
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
