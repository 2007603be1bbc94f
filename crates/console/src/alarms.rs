//! Life of the alarms' groups: raised, acknowledged, over, put aside, back again (after ISA-18.2).
//!
//! A group is one cause that stands, as `causes` finds it, with its consequences. It leaves once it is over *and*
//! acknowledged; one that is not urgent clears itself [`CLEARS_AFTER`] it is over. One that returns within
//! [`RETURNS_WITHIN`] opens its group again and is counted there, so that chatter is one alarm. A past event (an order,
//! a lost session) stands until it is acknowledged. Its sound is `sound`'s.

use std::collections::BTreeMap;

use wire::id::{Boot, TrackId, UnitId};
use wire::person::{Alarm, Shelf};
use wire::time::{Instant, Span};

use crate::alarm::{LedTo, MAX_LED_TO, Priority, ShownGroup};
use crate::causes::Causes;
use crate::finding::Finding;
use crate::history::{History, Incident};
use crate::shown::Shown;
use crate::sound::{Rate, Silence};

/// Groups that are kept. There is room for every unit with every lost track, every link and every command at once.
pub const MAX_ALARMS: usize = 320;
/// Time after which a group that is over and not urgent clears itself.
pub const CLEARS_AFTER: Span = Span::s(30);
/// Time within which a cause that returns opens its group again.
pub const RETURNS_WITHIN: Span = Span::s(60);

#[derive(Clone, Debug)]
struct Group {
    shown: ShownGroup,
    /// True if it stood when it was looked at last.
    stood: bool,
    /// Time at which it was over, until it is raised again.
    over: Option<Instant>,
    /// True while an event of it has not been acknowledged.
    open: bool,
    /// Consequences of the last look.
    told: Vec<(Instant, LedTo)>,
}

impl Group {
    fn new(now: Instant, finding: &Finding) -> Self {
        let shown = ShownGroup {
            cause: finding.cause,
            suite: finding.suite,
            priority: finding.priority,
            first: now,
            since: now,
            times: 1,
            standing: true,
            acknowledged: false,
            hold_stands: false,
            led_to: Vec::new(),
            led_more: 0,
            shelved_until: None,
        };
        let mut group = Self { shown, stood: false, over: None, open: finding.event.is_some(), told: Vec::new() };
        group.stand(now, finding);
        group
    }

    fn listed(&self) -> bool {
        self.shown.standing || !self.shown.acknowledged
    }

    /// True if it stands or did a short while ago: one that returns now is the same alarm.
    fn recent(&self, now: Instant) -> bool {
        self.shown.standing || self.stood || self.over.is_some_and(|over| now.since(over) < RETURNS_WITHIN)
    }

    /// Stands by a finding of its cause. A more urgent one than before asks for an act again.
    fn stand(&mut self, now: Instant, finding: &Finding) {
        let asks = self.lead_to(&finding.led_to);
        let shown = &mut self.shown;
        let worse = finding.priority < shown.priority;
        (shown.standing, shown.hold_stands, self.over) = (true, finding.hold_stands, None);
        shown.priority = shown.priority.min(finding.priority);
        if worse || (asks && shown.acknowledged) {
            (shown.acknowledged, shown.since) = (false, now);
        }
        shown.shelved_until = shown.shelved_until.filter(|_| !finding.hold_stands);
    }

    /// Opens again after it was over: one more of its times, unless it was the same event.
    fn again(&mut self, now: Instant, finding: &Finding, counts: bool) {
        let ShownGroup { first, times, shelved_until, .. } = self.shown;
        *self = Self::new(now, finding);
        (self.shown.first, self.shown.times) = (first, times.saturating_add(u32::from(counts)));
        self.shown.shelved_until = shelved_until.filter(|_| !finding.hold_stands);
    }

    /// Adds consequences that were not there at the last look. True if one of them asks for an act.
    fn lead_to(&mut self, led_to: &[(Instant, LedTo)]) -> bool {
        let before = core::mem::replace(&mut self.told, led_to.to_vec());
        let known = |(at, what): &&(Instant, LedTo)| {
            before.iter().any(|(then, before)| before.same(what) && (then == at || !what.dated()))
        };
        let mut asks = false;
        for new in led_to.iter().filter(|led| !known(led)) {
            asks |= new.1.asks();
            if self.shown.led_to.len() < MAX_LED_TO {
                self.shown.led_to.push(*new);
            } else {
                self.shown.led_more = self.shown.led_more.saturating_add(1);
            }
        }
        self.shown.led_to.sort_by_key(|(at, _)| *at);
        asks
    }

    /// Notes that it no longer stands, and clears one that is not urgent after a while.
    fn end(&mut self, now: Instant, history: &mut History) {
        let shown = &mut self.shown;
        if self.stood && !shown.standing {
            self.over = Some(now);
            if !is_event(&shown.cause) {
                history.note(now, Incident::Over(shown.cause, shown.suite));
            }
        }
        if shown.priority != Priority::High && self.over.is_some_and(|over| now.since(over) >= CLEARS_AFTER) {
            shown.acknowledged = true;
        }
    }

    /// Time at which it changes next by time alone.
    fn changes(&self) -> Option<Instant> {
        let clears = self.over.filter(|_| self.shown.priority != Priority::High && !self.shown.acknowledged);
        [self.shown.shelved_until, clears.map(|over| over + CLEARS_AFTER)].into_iter().flatten().min()
    }
}

/// True if the cause is a past event, and no present condition.
fn is_event(cause: &Alarm) -> bool {
    matches!(cause, Alarm::SessionLost(_) | Alarm::NotAcknowledged(_) | Alarm::CommandRefused(_))
}

/// The alarms of one display, at most [`MAX_ALARMS`] groups.
#[derive(Clone, Debug, Default)]
pub struct Alarms {
    groups: Vec<Group>,
    more: u32,
    causes: Causes,
    /// Occurrences of past events that were raised, while their subjects are shown.
    events: BTreeMap<Alarm, u64>,
    rate: Rate,
    silence: Silence,
}

impl Alarms {
    /// Updates the alarms from the shown values, and records events and the alarms' lives in `history`.
    pub fn fold(&mut self, shown: &Shown, history: &mut History) {
        let now = shown.at;
        self.return_shelved(now, history);
        self.rate.prune(now);
        let groups = &self.groups;
        let recent = |cause: &Alarm| groups.iter().any(|group| group.shown.cause == *cause && group.recent(now));
        let findings = self.causes.look(shown, history, recent);
        for group in &mut self.groups {
            group.stood = core::mem::take(&mut group.shown.standing);
            group.shown.hold_stands = false;
        }
        for finding in &findings {
            finding.absorbs.iter().filter(|cause| **cause != finding.cause).for_each(|cause| self.absorb(cause));
            if self.take(now, finding) {
                history.note(now, Incident::Raised(finding.cause, finding.suite, finding.priority));
            }
        }
        let shown = |cause: &Alarm, found: &Finding| {
            (found.cause == *cause && found.event.is_some()) || found.absorbs.contains(cause)
        };
        self.events.retain(|cause, _| findings.iter().any(|found| shown(cause, found)));
        self.groups.iter_mut().for_each(|group| group.end(now, history));
        self.groups.retain(|group| group.listed() || group.recent(now));
    }

    /// Takes one finding into its group. True if the alarm was raised, or raised again.
    fn take(&mut self, now: Instant, finding: &Finding) -> bool {
        let cause = finding.cause;
        let new_event = finding.event.is_some_and(|nth| self.events.insert(cause, nth) != Some(nth));
        let stands = finding.stands || new_event;
        let Some(group) = self.groups.iter_mut().find(|group| group.shown.cause == cause) else {
            return stands && self.raise(now, Group::new(now, finding));
        };
        match (stands || group.open, group.stood && !new_event) {
            // An event that was acknowledged is over.
            (false, _) => return false,
            (true, true) => {
                group.stand(now, finding);
                return false;
            }
            (true, false) if group.recent(now) => group.again(now, finding, new_event || finding.event.is_none()),
            (true, false) => {
                *group = Group::new(now, finding);
                self.rate.note(now);
            }
        }
        true
    }

    /// Adds a group. Where there is no room, the least urgent and oldest one makes it, or the new one is not listed.
    fn raise(&mut self, now: Instant, new: Group) -> bool {
        self.rate.note(now);
        if self.groups.len() < MAX_ALARMS {
            self.groups.push(new);
            return true;
        }
        self.more = self.more.saturating_add(1);
        let rank = |group: &&mut Group| (!group.listed(), group.shown.priority, core::cmp::Reverse(group.shown.since));
        let least = self.groups.iter_mut().max_by_key(rank);
        let least = least.filter(|least| !least.listed() || least.shown.priority > new.shown.priority);
        least.map(|least| *least = new).is_some()
    }

    /// Takes away a group that turned out to be a consequence, unless a person has dealt with it.
    fn absorb(&mut self, cause: &Alarm) {
        let consequence = |group: &Group| group.shown.cause == *cause && group.shown.open();
        if let Some(at) = self.groups.iter().position(consequence) {
            self.rate.take_back(self.groups.remove(at).shown.first);
            self.events.remove(cause);
        }
    }

    /// Lets alarms that were put aside return, when their time is over. One that stands asks for an act again.
    fn return_shelved(&mut self, now: Instant, history: &mut History) {
        for Group { shown, .. } in &mut self.groups {
            if shown.shelved_until.take_if(|until| now >= *until).is_some() && shown.standing {
                (shown.acknowledged, shown.since) = (false, now);
                history.note(now, Incident::Returned(shown.cause, shown.suite));
            }
        }
    }

    /// Acknowledges the alarm of this cause and time. The group as it was, where there is one to acknowledge.
    pub fn acknowledge(&mut self, cause: &Alarm, since: Instant) -> Option<ShownGroup> {
        let group = self.listed_mut(cause, since).filter(|group| !group.shown.acknowledged)?;
        (group.shown.acknowledged, group.open) = (true, false);
        Some(group.shown.clone())
    }

    /// Puts the alarm of this cause and time aside. False where there is none. Whether it may be is `hand`'s to judge.
    pub fn shelve(&mut self, now: Instant, cause: &Alarm, since: Instant, shelf: Shelf) -> bool {
        let group = self.listed_mut(cause, since);
        group.map(|group| group.shown.shelved_until = Some(now + shelf.span())).is_some()
    }

    /// Silences the sound of the alarms raised so far.
    pub fn silence(&mut self, now: Instant) {
        self.silence.begin(now);
    }

    /// Tracks that this cause is about: none of them is lost any more once it is acknowledged.
    pub fn tracks(&self, cause: &Alarm) -> Vec<(UnitId, Boot, TrackId)> {
        self.causes.tracks(cause)
    }

    fn listed_mut(&mut self, cause: &Alarm, since: Instant) -> Option<&mut Group> {
        let wanted = |group: &&mut Group| group.shown.cause == *cause && group.shown.since == since && group.listed();
        self.groups.iter_mut().find(wanted)
    }

    /// Adds the alarms to a picture: those put aside last, the most urgent first, and of these the oldest.
    pub fn show(&self, shown: &mut Shown) {
        let listed = self.groups.iter().filter(|group| group.listed());
        shown.alarms = listed.map(|group| group.shown.clone()).collect();
        shown.alarms.sort_by_key(|group| {
            (group.shelved_until.is_some(), group.priority, group.acknowledged, group.first, group.cause)
        });
        shown.alarms_more = self.more;
        shown.alarms_in_hour = self.rate.in_hour();
        shown.alarm_flood = self.rate.flood(shown.at);
        shown.sound = self.silence.sound(shown.at, shown.alarm_flood, shown.alarms.iter());
    }

    /// Time at which the alarms change next after `now` by time alone.
    pub fn changes(&self, now: Instant) -> Option<Instant> {
        let groups = self.groups.iter().filter_map(Group::changes);
        let others = [self.rate.changes(now), self.silence.until(now), self.causes.changes()];
        groups.chain(others.into_iter().flatten()).filter(|time| *time > now).min()
    }
}
