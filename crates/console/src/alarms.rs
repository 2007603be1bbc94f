//! Alarms: conditions that the operator has to acknowledge, each listed until it is over *and* acknowledged.
//!
//! An alarm's condition follows from the shown values alone. An alarm that ends by itself stays listed until it is
//! acknowledged, and one that begins again has to be acknowledged again. An alarm about a past event (an order, a lost
//! session) does not end by itself: acknowledging it ends it.

use wire::event::Freshness;
use wire::mode::Mode;
use wire::person::Alarm;
use wire::time::Instant;

use crate::alarm::{Priority, ShownAlarm};
use crate::history::{History, Incident};
use crate::life::Life;
use crate::shown::{Shown, ShownUnit};
use crate::skew::Rate;

/// Alarms that are kept. There is room for every unit with every lost track, every link and every command at once.
pub const MAX_ALARMS: usize = 320;

/// True if the alarm is about a past event, and not about a present condition.
fn is_event(alarm: &Alarm) -> bool {
    match alarm {
        Alarm::SessionLost(_) | Alarm::NotAcknowledged(_) | Alarm::CommandRefused(_) => true,
        Alarm::HoldSafe(_)
        | Alarm::Silent(_)
        | Alarm::Degraded(_)
        | Alarm::Stale(_)
        | Alarm::LinkDown(_)
        | Alarm::TrackLost(..)
        | Alarm::ClockRuns(_) => false,
    }
}

/// A condition that stands, and which of its occurrences.
type Condition = (Alarm, u64);

#[derive(Clone, Copy, Debug)]
struct Raised {
    shown: ShownAlarm,
    occurrence: u64,
    /// True if its condition stood when it was looked at last.
    stood: bool,
}

impl Raised {
    /// True if the alarm can be removed. It is kept while its subject is shown, so that it is not raised again.
    fn done(&self) -> bool {
        self.shown.acknowledged && is_event(&self.shown.alarm)
    }
}

/// The alarms of one display, at most [`MAX_ALARMS`].
#[derive(Clone, Debug, Default)]
pub struct Alarms {
    raised: Vec<Raised>,
    more: u32,
}

impl Alarms {
    /// Updates the alarms from the shown values, and records begun and ended ones in `history`.
    pub fn fold(&mut self, shown: &Shown, history: &mut History) {
        for raised in &mut self.raised {
            raised.stood = core::mem::take(&mut raised.shown.standing);
        }
        for condition in conditions(shown) {
            if self.raise(shown.at, condition) {
                history.note(shown.at, Incident::Raised(condition.0));
            }
        }
        let raiseds = self.raised.iter().filter(|r| r.stood && !r.shown.standing && !is_event(&r.shown.alarm));
        raiseds.for_each(|r| history.note(shown.at, Incident::Over(r.shown.alarm)));
        self.raised.retain(|raised| raised.shown.standing || !raised.shown.acknowledged);
    }

    /// Raises an alarm. True if its condition began or began again.
    fn raise(&mut self, now: Instant, (alarm, occurrence): Condition) -> bool {
        let shown = ShownAlarm {
            alarm,
            priority: Priority::from_alarm(&alarm),
            since: now,
            standing: true,
            acknowledged: false,
        };
        let new = Raised { shown, occurrence, stood: false };
        let room = self.raised.len() < MAX_ALARMS;
        match self.raised.iter_mut().find(|raised| raised.shown.alarm == alarm) {
            Some(raised) if raised.occurrence == occurrence => {
                raised.shown.standing = true;
                return !raised.stood;
            }
            Some(raised) => *raised = new,
            None if room => self.raised.push(new),
            None => return self.crowd_out(new),
        }
        true
    }

    /// Replaces the least urgent, oldest alarm of a full list by a more urgent one. Either way one more alarm is not
    /// listed. True if the new one is.
    fn crowd_out(&mut self, new: Raised) -> bool {
        self.more = self.more.saturating_add(1);
        let least = self.raised.iter_mut().max_by_key(|r| (r.shown.priority, core::cmp::Reverse(r.shown.since)));
        let least = least.filter(|least| least.shown.priority > new.shown.priority);
        least.map(|least| *least = new).is_some()
    }

    /// Acknowledges the alarm raised at `since`. False where there is none.
    pub fn acknowledge(&mut self, alarm: &Alarm, since: Instant) -> bool {
        let raised = self.raised.iter_mut().find(|r| r.shown.alarm == *alarm && r.shown.since == since);
        let Some(raised) = raised.filter(|r| !r.shown.acknowledged) else { return false };
        raised.shown.acknowledged = true;
        true
    }

    /// Alarms as drawn, the most urgent first and of these the newest; and the number of alarms without room.
    pub fn shown(&self) -> (Vec<ShownAlarm>, u32) {
        let listed = self.raised.iter().filter(|raised| !raised.done());
        let mut shown: Vec<ShownAlarm> = listed.map(|raised| raised.shown).collect();
        shown.sort_by_key(|alarm| (alarm.priority, core::cmp::Reverse(alarm.since)));
        (shown, self.more)
    }
}

fn conditions(shown: &Shown) -> Vec<Condition> {
    let mut standing = Vec::new();
    for unit in &shown.units {
        of_unit(unit, &mut standing);
    }
    let down = shown.links.iter().filter(|link| !*link.open.get().0);
    standing.extend(down.map(|link| (Alarm::LinkDown(link.peer), link.since.0)));
    standing.extend(shown.losses.iter().map(|(peer, times)| (Alarm::SessionLost(*peer), u64::from(*times))));
    for command in &shown.commands {
        match command.life {
            Life::NotAcknowledged => standing.push((Alarm::NotAcknowledged(command.id), command.since.0)),
            // Who is refused by the gateway and then by the unit is refused once.
            Life::RefusedByUnit(_) | Life::RefusedByGateway(_) => {
                let first = command.times.answered.unwrap_or(command.since);
                standing.push((Alarm::CommandRefused(command.id), first.0));
            }
            Life::Requested
            | Life::Staged
            | Life::Released
            | Life::Sent
            | Life::Stored(_)
            | Life::Executed
            | Life::Expired => {}
        }
    }
    standing
}

fn of_unit(unit: &ShownUnit, standing: &mut Vec<Condition>) {
    let (state, freshness) = unit.state.get();
    match state.mode {
        Mode::HoldSafe => standing.push((Alarm::HoldSafe(unit.unit), unit.since.0)),
        Mode::Degraded => standing.push((Alarm::Degraded(unit.unit), unit.since.0)),
        Mode::Idle | Mode::Ready | Mode::PrepareToAct => {}
    }
    match freshness {
        Freshness::Stale => standing.push((Alarm::Stale(unit.unit), 0)),
        Freshness::Lost => standing.push((Alarm::Silent(unit.unit), 0)),
        Freshness::Fresh | Freshness::Late => {}
    }
    if unit.clock.is_some_and(Rate::exceeds_drift) {
        standing.push((Alarm::ClockRuns(unit.unit), 0));
    }
    standing.extend(unit.lost.iter().map(|lost| {
        let (track, _) = lost.track.get();
        (Alarm::TrackLost(unit.unit, lost.boot, track.id), lost.since.0)
    }));
}
