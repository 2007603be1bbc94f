//! False fixes: the kinds of injection, and the change that each makes to a true fix.

use wire::time::{Instant, Span};

use crate::fix::Place;
use crate::map::Inject;

/// Kind and strength of an injection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Injection {
    /// The position stays; stamps and the receiver's time go on.
    Freeze,
    /// Position and stamp stay: no new fix.
    FrozenStamp,
    /// The position moves away at a constant speed, metres a second.
    Drift(f64),
    /// The position is a given number of metres off at once.
    Jump(f64),
    /// Position and receiver's time are a given number of seconds late, under stamps of their arrival.
    Delay(f64),
    /// Position, heading and deviation are as old as the given number of seconds; stamps and the receiver's time go on.
    Replay(f64),
}

impl Injection {
    /// Injections that a map asks for.
    pub(crate) fn from_map(map: &Inject) -> Vec<Self> {
        let each = |list: &toml::Spanned<Vec<f64>>, make: fn(f64) -> Self| {
            list.as_ref().iter().map(|strength| make(*strength)).collect::<Vec<_>>()
        };
        [
            vec![Injection::Freeze, Injection::FrozenStamp],
            each(&map.drift_m_s, Injection::Drift),
            each(&map.jump_m, Injection::Jump),
            each(&map.delay_s, Injection::Delay),
            each(&map.replay_s, Injection::Replay),
        ]
        .concat()
    }

    /// Name with strength and unit.
    pub fn name(self) -> String {
        match self {
            Injection::Freeze => "freeze of the position".to_owned(),
            Injection::FrozenStamp => "freeze of position and stamp".to_owned(),
            Injection::Drift(v) => format!("drift, {v} m/s"),
            Injection::Jump(m) => format!("jump, {m} m"),
            Injection::Delay(s) => format!("delay, {s} s"),
            Injection::Replay(s) => format!("replay from {s} s before"),
        }
    }

    /// Time before the moment from which fixes are needed, seconds.
    pub(crate) fn past_s(self) -> f64 {
        match self {
            Injection::Delay(s) | Injection::Replay(s) => s,
            Injection::Freeze | Injection::FrozenStamp | Injection::Drift(_) | Injection::Jump(_) => 0.0,
        }
    }
}

/// An injection at a moment.
pub(crate) struct Placed<'a> {
    pub(crate) injection: Injection,
    /// Time from which on fixes are false.
    pub(crate) from: Instant,
    /// Direction of a drift or a jump, as a unit vector.
    pub(crate) towards: (f64, f64),
    /// True fixes, by time.
    pub(crate) fixes: &'a [(Instant, Place)],
}

impl Placed<'_> {
    /// The fix in place of the true one; none where it does not come.
    pub(crate) fn alter(&self, stamp: Instant, fix: Place) -> Option<Place> {
        if stamp < self.from {
            return Some(fix);
        }
        let off = |metres: f64| Place {
            east: fix.east + metres * self.towards.0,
            north: fix.north + metres * self.towards.1,
            ..fix
        };
        match self.injection {
            Injection::Freeze => {
                let held = self.newest(self.from)?;
                Some(Place { east: held.east, north: held.north, ..fix })
            }
            Injection::FrozenStamp => None,
            Injection::Drift(speed) => Some(off(speed * stamp.since(self.from).0 as f64 / 1e6)),
            Injection::Jump(metres) => Some(off(metres)),
            Injection::Delay(seconds) => {
                let late = self.newest(stamp - span(seconds))?;
                Some(Place { east: late.east, north: late.north, time: late.time, ..fix })
            }
            Injection::Replay(seconds) => Some(Place { time: fix.time, ..self.newest(stamp - span(seconds))? }),
        }
    }

    /// The newest true fix at or before a time.
    fn newest(&self, time: Instant) -> Option<Place> {
        let next = self.fixes.partition_point(|(stamp, _)| *stamp <= time);
        Some(self.fixes[next.checked_sub(1)?].1)
    }
}

/// Seconds as a span, to the microsecond.
pub(crate) fn span(seconds: f64) -> Span {
    Span(libm::round(seconds * 1e6) as u64)
}
