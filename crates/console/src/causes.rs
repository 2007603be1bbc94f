//! Causes: the shown values that ask for an act of a person, and their consequences.
//!
//! They follow from the shown values alone, and name the actor that these know and no other. An order of the operator or the
//! script ordered is none, nor is silence by a unit's plan; the rest is an event in `history`. Raising a group and
//! ending it is left to `alarms`, ended tracks to `ended`, plans of contact to `silence`.

use std::collections::BTreeMap;

use config::suite::Suite;
use wire::command::CommandKind;
use wire::event::{Freshness, Inconsistency};
use wire::id::{PeerId, TrackId, UnitId};
use wire::mode::{Cause, Guard, Mode};
use wire::person::Alarm;
use wire::time::{Instant, Span};

use crate::alarm::{LedTo, Priority};
use crate::ended::Ended;
use crate::finding::{Finding, Findings};
use crate::history::{History, Incident};
use crate::life::{Life, ShownCommand};
use crate::shown::{Shown, ShownUnit};
use crate::silence::{CONTACT_LATE, Plan, gateway_silent, revoked};
use crate::skew::Rate;

/// Memory of a unit between two looks.
#[derive(Clone, Debug, Default)]
struct Known {
    /// The mode and its beginning.
    mode: Option<(Mode, Instant)>,
    /// The cause of that mode, if it asks for an act.
    cause: Option<Alarm>,
    /// The contradiction behind it.
    found: Option<Inconsistency>,
    /// Authority that ended with the mode before.
    revoked: Option<TrackId>,
    authority: Option<TrackId>,
    /// The cause of its silence, while that asks for an act.
    silent: Option<Alarm>,
    /// True while the picture of it is stale, and was fresh before.
    stale: bool,
    ended: Ended,
}

/// Memory behind the causes: one entry a unit and a link.
#[derive(Clone, Debug, Default)]
pub(crate) struct Causes {
    units: BTreeMap<UnitId, Known>,
    links: BTreeMap<PeerId, bool>,
    /// Time at which a contact that is not kept will next be an alarm.
    due: Option<Instant>,
}

impl Causes {
    /// The causes that stand now. Events are noted in `history`. `recent` tells whether a group of this cause stands or
    /// did within the last minute.
    pub(crate) fn look(
        &mut self,
        shown: &Shown,
        history: &mut History,
        recent: impl Fn(&Alarm) -> bool,
    ) -> Vec<Finding> {
        self.due = None;
        self.links(shown, history);
        let mut found = Findings::default();
        let gateway_silent = gateway_silent(shown);
        for unit in &shown.units {
            if revoked(shown, unit.unit.peer()) {
                self.units.remove(&unit.unit);
                continue;
            }
            let known = self.units.entry(unit.unit).or_default();
            known.silence(shown, unit, gateway_silent, &mut found, history);
            let wait = known.silent.map_or_else(|| unit.plan().alarm_in(), |_| None);
            self.due = [self.due, wait.map(|wait| shown.at + wait)].into_iter().flatten().min();
            let authority = known.authority;
            let changed = known.mode(shown, unit, &recent);
            known.found_mode(unit, &mut found);
            let sensors = known.cause.filter(is_about_sensors);
            known.ended.look(shown, unit, authority, (sensors, changed), &mut found, history);
            if unit.clock.is_some_and(Rate::exceeds_drift) {
                found.of(Alarm::ClockRuns(unit.unit), Suite::Scene);
            }
        }
        self.events(shown, &mut found);
        found.0
    }

    /// Time at which a cause arises next by time alone, beside those that the labels tell.
    pub(crate) fn changes(&self) -> Option<Instant> {
        self.due
    }

    /// Tracks of a unit that its group is about.
    pub(crate) fn tracks(&self, cause: &Alarm) -> Vec<(UnitId, wire::id::Boot, TrackId)> {
        let of_unit = |(unit, known): (&UnitId, &Known)| {
            let unit = *unit;
            known.ended.of(cause).map(move |(boot, track)| (unit, boot, track)).collect::<Vec<_>>()
        };
        self.units.iter().flat_map(of_unit).collect()
    }

    fn links(&mut self, shown: &Shown, history: &mut History) {
        for link in &shown.links {
            let open = *link.open.get().0;
            if self.links.insert(link.peer, open).is_some_and(|before| before != open) {
                history.note(shown.at, Incident::Link(link.peer, open));
            }
        }
    }

    /// Past events: orders and sessions.
    fn events(&self, shown: &Shown, found: &mut Findings) {
        for (peer, times) in shown.losses.iter().filter(|(peer, _)| !revoked(shown, *peer)) {
            found.event(Alarm::SessionLost(*peer), u64::from(*times));
        }
        for command in &shown.commands {
            match command.life {
                Life::NotAcknowledged => {
                    let cause = Alarm::NotAcknowledged(command.id);
                    if let Some(silence) = self.units.get(&command.unit).and_then(|known| known.silent) {
                        let finding = found.of(silence, Suite::Scene);
                        finding.led_to.push((command.since, LedTo::NotAcknowledged(command.id)));
                        finding.absorbs.push(cause);
                    } else {
                        found.event(cause, command.since.0);
                    }
                }
                // Who is refused by the gateway and then by the unit is refused once.
                Life::RefusedByUnit(_) | Life::RefusedByGateway(_) => {
                    let first = command.times.answered.unwrap_or(command.since);
                    found.event(Alarm::CommandRefused(command.id), first.0);
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
    }
}

impl Known {
    /// Silence that no plan foresees, and the losses with the unit. It stands until the unit is heard.
    fn silence(
        &mut self,
        shown: &Shown,
        unit: &ShownUnit,
        gateway_silent: bool,
        found: &mut Findings,
        history: &mut History,
    ) {
        let (id, plan) = (unit.unit, unit.plan());
        let stale = unit.state.freshness() == Freshness::Stale && plan.asks_for_reports();
        if self.stale != stale && unit.state.freshness() != Freshness::Lost {
            history.note(shown.at, Incident::Stale(id, stale));
        }
        self.stale = stale;
        if unit.state.freshness() != Freshness::Lost {
            self.silent = None;
            return;
        }
        let heard = || shown.links.iter().any(|link| link.open.freshness() <= Freshness::Late);
        if self.silent == Some(Alarm::GatewaySilent) && heard() {
            self.silent = None;
        }
        let cause = match plan {
            Plan::None | Plan::Contact(_) => Some(Alarm::Silent(id)),
            Plan::Due(late) if late > CONTACT_LATE => Some(Alarm::ContactDue(id)),
            Plan::Due(_) | Plan::Silence(_) => None,
        };
        let cause = cause.map(|cause| if gateway_silent { Alarm::GatewaySilent } else { cause });
        self.silent = self.silent.or(cause);
        let Some(cause) = self.silent else { return };
        let finding = found.of(cause, Suite::Scene);
        if cause == Alarm::GatewaySilent {
            finding.led_to.push((shown.at, LedTo::Silent(id)));
        }
        let down = shown.links.iter().find(|link| link.peer == id.peer() && !*link.open.get().0);
        finding.led_to.extend(down.map(|link| (link.since, LedTo::LinkDown(link.peer))));
        if !unit.tracks.is_empty() {
            finding.led_to.push((shown.at, LedTo::TracksLost(id, unit.tracks.len() as u8)));
        }
    }

    /// Notes a change of mode and finds its cause. True if there was one.
    fn mode(&mut self, shown: &Shown, unit: &ShownUnit, recent: impl Fn(&Alarm) -> bool) -> bool {
        let (state, _) = unit.state.get();
        let authority = state.authority.map(|held| held.track);
        let (mode, first) = ((state.mode, unit.since), self.mode.is_none());
        let changed = self.mode != Some(mode);
        if changed {
            self.mode = Some(mode);
            self.revoked = self.authority.filter(|_| authority.is_none());
            self.found = state.measured.teammate().map(|(_, found)| found);
            self.cause = match state.mode {
                Mode::HoldSafe | Mode::Degraded => cause_of(shown, unit, first, recent),
                Mode::Idle | Mode::Ready | Mode::PrepareToAct => None,
            };
        }
        self.authority = authority;
        changed
    }

    /// The cause of the unit's mode, with the mode as its consequence.
    fn found_mode(&self, unit: &ShownUnit, found: &mut Findings) {
        let Some(cause) = self.cause else { return };
        let (state, _) = unit.state.get();
        let (id, since) = (unit.unit, unit.since);
        let finding = found.of(cause, state.suite());
        if state.mode == Mode::HoldSafe {
            (finding.priority, finding.hold_stands) = (Priority::High, true);
        }
        if let (Alarm::Contradicts(_) | Alarm::Claims(_), Some(inconsistency)) = (cause, self.found) {
            finding.led_to.push((since, LedTo::Found(id, inconsistency)));
        }
        if !matches!(cause, Alarm::HoldSafe(_) | Alarm::Degraded(_) | Alarm::HeldElsewhere(_)) {
            finding.led_to.push((since, LedTo::Mode(id, state.mode)));
        }
        finding.led_to.extend(self.revoked.map(|track| (since, LedTo::Revoked(id, track))));
    }
}

/// The cause of a unit's HOLD_SAFE or DEGRADED; none if it was ordered here. A unit that is heard for the first time
/// may have been held before this console began.
fn cause_of(shown: &Shown, unit: &ShownUnit, first: bool, recent: impl Fn(&Alarm) -> bool) -> Option<Alarm> {
    let ((state, _), id) = (unit.state.get(), unit.unit);
    let guard = match state.cause {
        Cause::Operator if first || held_here(shown, unit) => return None,
        Cause::Operator => return Some(Alarm::HeldElsewhere(id)),
        Cause::Lost(guard) | Cause::Unrecovered(guard) => guard,
        Cause::Start | Cause::Recovered | Cause::Acted | Cause::Expired => {
            return Some(if state.mode == Mode::HoldSafe { Alarm::HoldSafe(id) } else { Alarm::Degraded(id) });
        }
    };
    match (guard, state.measured.teammate()) {
        // A HOLD that the unit finds too old still ends its permission to drive.
        (Guard::Lease, _) if held_here(shown, unit) => None,
        (Guard::Lease, _) => {
            let silences = [Alarm::Silent(id), Alarm::GatewaySilent, Alarm::ContactDue(id)];
            let sessions = [Alarm::SessionLost(id.peer()), Alarm::SessionLost(PeerId::GATEWAY)];
            let known = silences.into_iter().chain(sessions).find(|cause| recent(cause));
            Some(known.unwrap_or(Alarm::GuardLost(id, guard)))
        }
        (Guard::Teammates, Some((teammate, Inconsistency::Exclusion))) => Some(Alarm::Claims(teammate)),
        (Guard::Teammates, Some((teammate, _))) => Some(Alarm::Contradicts(teammate)),
        (guard, _) => Some(Alarm::GuardLost(id, guard)),
    }
}

/// True if the last order to the unit that lets it drive or stop was a HOLD of this console, the script's or a
/// person's, that was due before the unit stopped.
fn held_here(shown: &Shown, unit: &ShownUnit) -> bool {
    let lets = |kind: CommandKind| matches!(kind, CommandKind::Hold | CommandKind::Enable | CommandKind::Resume);
    let due = |command: &&ShownCommand| command.times.requested + command.tag.map_or(Span::ZERO, |tag| tag.after);
    let given = shown.commands.iter().filter(|command| command.unit == unit.unit && lets(command.kind));
    let last = given.filter(|command| due(command) <= unit.since).max_by_key(due);
    last.is_some_and(|command| command.kind == CommandKind::Hold)
}

fn is_about_sensors(cause: &Alarm) -> bool {
    let sensor = |guard| matches!(guard, Guard::Rgb | Guard::Depth | Guard::Thermal | Guard::Lidar | Guard::Tracks);
    matches!(cause, Alarm::GuardLost(_, guard) if sensor(*guard))
}
