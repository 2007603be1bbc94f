//! Responses owed by the platform when one of its processes is killed, hangs, is slow or finds its disk full, stated
//! before any run, and those that a log shows.
//!
//! A process that dies writes no more, so each row is read from the others: the mode from the unit's own log, and
//! where the unit itself is dead, from the ground truth of the plant. Bounds are the platform's (`docs/reference/bounds.md`). A
//! process that does not run for a time owes what a dead one does, as far as its bounds end within that time; and a unit
//! that did not run for as long as its lease holds as soon as it runs again.

mod owed;

use evidence::{Evidence, Finding, Micros, Property, Witnessed};
use instrument::{Any, Note, Suspension};
use wire::bounds::Bounds;
use wire::command::CommandKind;
use wire::id::NodeId;
use wire::mode::{Cause, Mode};

use crate::SLACK;
use crate::timeline::{Timeline, Truth};
use crate::{finding, life};

use evidence::process_fault::{From, PlantResponse, ProcessFault, Response};
pub use owed::{OWED, Owed, owed};

/// From the end of a stop to the first entry that is written after it, beyond the period of judging.
const RESUME_SLACK: Micros = 50_000;
/// Between two samples of the plant's truth.
const TRUTH_PERIOD: Micros = 100_000;

/// A process's fate under judgement.
struct Death<'a> {
    node: NodeId,
    owed: &'static Owed,
    fate: ProcessFault,
    killed: Micros,
    /// Time at which it ran again after its longest stop; never for one that is dead.
    runs: Micros,
    /// From when bounds count: the kill, or the HOLD after it if there was one.
    zero: Option<Micros>,
    evidence: &'a Evidence,
    line: &'a Timeline,
}

/// The response to every kill of the log, and the responses that were owed and did not come.
pub(crate) fn judge(evidence: &Evidence, line: &Timeline) -> (Vec<Response>, Vec<Finding>) {
    let (mut responses, mut findings) = (Vec::new(), Vec::new());
    for w in &evidence.entries {
        let (node, fate) = match w.entry.event {
            Any::Instrument(Note::Ended { node, killed: true, .. }) => (node, ProcessFault::Kill),
            Any::Instrument(Note::Suspended { node, how: Suspension::Hang, on: true }) => (node, ProcessFault::Hang),
            Any::Instrument(Note::Suspended { node, how: Suspension::Slow { .. }, on: true }) => {
                (node, ProcessFault::Slow)
            }
            Any::Instrument(Note::DiskFull { node, on: true }) => (node, ProcessFault::Full),
            _ => continue,
        };
        let Some(owed) = owed(evidence.under, node) else { continue };
        if matches!(w.entry.event, Any::Instrument(Note::Suspended { .. })) && life::is_dead(evidence, node, w.at) {
            continue; // What has ended is not stopped: its end owes the response.
        }
        let runs = runs_again(evidence, w);
        let given = |at: Micros| at >= w.at && at < runs;
        let hold = || {
            line.intended.iter().find(|(at, _, kind)| given(*at) && *kind == CommandKind::Hold).map(|(at, _, _)| *at)
        };
        let zero = if owed.from == From::Kill { Some(w.at) } else { hold() };
        let death = Death { node, owed, fate, killed: w.at, runs, zero, evidence, line };
        let broken = death.findings();
        responses.push(Response { kept: broken.is_empty(), ..death.response() });
        findings.extend(broken);
    }
    (responses, findings)
}

/// Time at which the process that `w` says was stopped or ended runs again, at the latest after one of its stops.
fn runs_again(evidence: &Evidence, w: &Witnessed) -> Micros {
    let mut later = evidence.entries.iter().filter(|l| l.at >= w.at);
    match w.entry.event {
        Any::Instrument(Note::Suspended { node, how, .. }) => {
            let over = |l: &&Witnessed| {
                matches!(
                    l.entry.event,
                    Any::Instrument(Note::Suspended { node: n, on: false, .. }) if n == node
                )
            };
            // At the end of a run everybody is let go on, to close its account.
            let end = later.find(over).map_or(evidence.duration, |l| l.at.min(evidence.duration));
            match how {
                Suspension::Hang => end,
                Suspension::Slow { quota, period } => {
                    end.min(w.at + period.0 * u64::from(1000_u16.saturating_sub(quota)) / 1000)
                }
            }
        }
        Any::Instrument(Note::Ended { node, .. }) => {
            let again =
                |l: &&Witnessed| matches!(l.entry.event, Any::Instrument(Note::Restarted { node: n, .. }) if n == node);
            later.find(again).map_or(Micros::MAX, |l| l.at)
        }
        Any::Instrument(Note::DiskFull { node, .. }) => {
            let room = |l: &&Witnessed| {
                matches!(
                    l.entry.event,
                    Any::Instrument(Note::DiskFull { node: n, on: false }) if n == node
                )
            };
            later.find(room).map_or(Micros::MAX, |l| l.at)
        }
        _ => w.at,
    }
}

/// Time at which `wanted` could next judge or act: `at`, or one judgement after it runs again where it hung then.
pub(crate) fn can_judge(evidence: &Evidence, wanted: NodeId, at: Micros) -> Micros {
    let hung = evidence.entries.iter().filter(|w| {
        matches!(
            w.entry.event,
            Any::Instrument(Note::Suspended { node, how: Suspension::Hang, on: true }) if node == wanted
        ) && w.at <= at
    });
    let judges = hung.map(|w| runs_again(evidence, w)).max().map(|runs| runs + judgement(evidence));
    at.max(judges.unwrap_or(0))
}

/// One judgement of the guards after a unit runs again, with the messages under way.
fn judgement(evidence: &Evidence) -> Micros {
    evidence.bounds.control_period_ms * 1000 + RESUME_SLACK
}

/// True if the unit under test was killed and its plant stands without a lease.
pub(crate) fn stopped_without_its_unit(evidence: &Evidence, line: &Timeline) -> bool {
    evidence.killed.contains(&evidence.under.node()) && stands(line)
}

/// True if the last sample of the plant shows it standing without a lease.
fn stands(line: &Timeline) -> bool {
    line.truth.last().is_some_and(|t| !t.leased && t.safe)
}

/// The first sample from `from` on after which `test` holds for good.
pub(crate) fn for_good(line: &Timeline, from: Micros, test: impl Fn(&Truth) -> bool) -> Option<Micros> {
    let after = line.truth.iter().rev().take_while(|t| t.at >= from);
    after.take_while(|t| test(t)).last().map(|t| t.at)
}

impl Death<'_> {
    fn unit_dead(&self) -> bool {
        self.node == self.evidence.under.node()
    }

    fn after(&self) -> Mode {
        let last = self.line.mode_at(Micros::MAX);
        if self.unit_dead() && self.runs == Micros::MAX && stands(self.line) { Mode::HoldSafe } else { last }
    }

    fn unleased(&self) -> Option<Micros> {
        if self.runs < Micros::MAX {
            let mut stopped = self.line.truth.iter().filter(|t| t.at >= self.killed && t.at < self.runs);
            return stopped.find(|t| !t.leased).map(|t| t.at);
        }
        for_good(self.line, self.zero?, |t| !t.leased)
    }

    fn standing(&self) -> Option<Micros> {
        for_good(self.line, self.zero?, |t| t.safe)
    }

    fn response(&self) -> Response {
        let ms = |at: Option<Micros>| Some(at?.saturating_sub(self.zero?) as f64 / 1000.0);
        let change = |test: &dyn Fn(Mode) -> bool| {
            let mine = |c: &crate::timeline::Change| test(c.to) && c.cause != Cause::Operator;
            self.line.first_change(self.zero?, mine).map(|c| c.at)
        };
        let after = self.after();
        let speed = self.line.truth.iter().rev().find(|t| t.at <= self.killed).map_or(0, |t| t.speed);
        let (restricted, settled, cause) = if self.unit_dead() {
            (self.unleased(), self.unleased(), self.unleased().map(|_| "set-point lease".to_owned()))
        } else {
            let own = self.line.changes.iter().rev().find(|c| c.at >= self.killed && c.cause != Cause::Operator);
            let restricted = change(&|to| matches!(to, Mode::Degraded | Mode::HoldSafe));
            (restricted, change(&|to| to == after), own.map(|c| c.cause.label()))
        };
        let plant = PlantResponse {
            speed_mm_s: speed,
            lease_ended_ms: ms(self.unleased()),
            standing_ms: ms(self.standing().filter(|_| after == Mode::HoldSafe)),
        };
        Response {
            process: self.node.name().to_owned(),
            fate: self.fate,
            killed_ms: self.killed as f64 / 1000.0,
            before: self.line.mode_at(self.killed),
            after,
            cause,
            from: self.owed.from,
            restricted_ms: ms(restricted),
            settled_ms: ms(settled),
            plant: (self.node != self.evidence.under.sim).then_some(plant),
            owed: self.owes(),
            kept: true,
        }
    }

    /// Responses that were owed and did not come. Of a platform that was not in nominal control when the process died
    /// no conclusion can be drawn: that is no evidence, never a pass.
    fn findings(&self) -> Vec<Finding> {
        let before = self.line.mode_at(self.killed);
        // A kill that is a named step was put where it is on purpose.
        if !nominal(before) && !self.on_purpose() {
            let what = format!("the unit was {} when {} was killed", before.name(), self.node);
            return vec![finding(Property::P10, self.killed, what)];
        }
        let Some(zero) = self.zero else {
            if self.fate != ProcessFault::Kill {
                return Vec::new();
            }
            let what = format!("no HOLD was given after {} was killed", self.node);
            return vec![finding(Property::P10, self.killed, what)];
        };
        let mut found = Vec::new();
        if self.unit_dead() {
            found.extend(self.plant_stops(zero));
            found.extend(self.holds_when_it_runs_again());
        } else {
            found.extend(self.mode_changes(zero));
            let holds = self.owed.ends_in == Mode::HoldSafe && self.node != self.evidence.under.sim;
            found.extend(if holds { self.stands_in_time(zero) } else { None });
        }
        found.extend(if self.fate == ProcessFault::Full { self.held_up() } else { None });
        found
    }

    /// A log that cannot be written holds up no other part: reports go on coming, and the plant is driven under its lease.
    fn held_up(&self) -> Option<Finding> {
        let (from, to) = (self.killed, self.runs.min(self.evidence.duration));
        let limit = self.evidence.bounds.freshness_ms * 1000;
        let mine = self.line.accepted.iter().filter(|(_, record)| record.node == self.evidence.under.node());
        let reports = mine.map(|(at, _)| *at).filter(|at| (from..to).contains(at));
        let marks: Vec<Micros> = std::iter::once(from).chain(reports).chain([to]).collect();
        let silent = marks.windows(2).find(|pair| pair[1] - pair[0] > limit);
        let let_go = || self.line.truth.iter().find(|t| (from..to).contains(&t.at) && !t.leased && self.drives(t.at));
        let what = |at: Micros, what: &str| finding(Property::P2, at, format!("{what} while no log could be written"));
        silent.map(|pair| what(pair[1], "no report")).or_else(|| let_go().map(|t| what(t.at, "no set-point")))
    }

    fn drives(&self, at: Micros) -> bool {
        matches!(self.line.mode_at(at), Mode::Ready | Mode::PrepareToAct | Mode::Degraded)
    }

    /// End of a bound that counts from `zero`, if the process does not run again before.
    fn due(&self, zero: Micros, bound: Option<fn(&Bounds) -> u64>) -> Option<Micros> {
        Some(zero + bound?(&self.evidence.bounds) * 1000).filter(|at| *at <= self.runs)
    }

    /// True if there was a cause for a response.
    fn owes(&self) -> bool {
        let Some(zero) = self.zero else { return false };
        if self.fate == ProcessFault::Full {
            return true;
        }
        if self.unit_dead() {
            return self.due(zero, Some(owed::th)).is_some() || self.lapsed();
        }
        self.due(zero, self.owed.restricted).is_some() || self.due(zero, self.owed.settled).is_some()
    }

    /// True if the unit did not run for as long as its supervision lease, and runs again.
    fn lapsed(&self) -> bool {
        let b = &self.evidence.bounds;
        self.runs < self.evidence.duration && self.runs - self.killed > (b.lease_ms + b.control_period_ms) * 1000
    }

    fn mode_changes(&self, zero: Micros) -> Vec<Finding> {
        let due = |bound: Option<fn(&Bounds) -> u64>| self.due(zero, bound);
        let mut found = Vec::new();
        if let Some(at) =
            due(self.owed.restricted).max(due(self.owed.settled)).filter(|at| *at > self.evidence.duration)
        {
            let what = format!("the run ends before what {}'s death owes at {} ms is due", self.node, at / 1000);
            return vec![finding(Property::P10, self.evidence.duration, what)];
        }
        let mut late = |property: Property, at: Micros, mode: Mode| {
            let after = (at - zero) / 1000;
            let what = format!("{after} ms after {} was killed still {}", self.node, mode.name());
            found.push(finding(property, at, what));
        };
        if let Some(at) = due(self.owed.restricted).and_then(|at| self.judged(at))
            && nominal(self.line.mode_at(at))
        {
            late(Property::P2, at, self.line.mode_at(at));
        }
        if let Some(at) = due(self.owed.settled).and_then(|at| self.judged(at))
            && self.owed.ends_in == Mode::HoldSafe
            && !matches!(self.line.mode_at(at), Mode::HoldSafe | Mode::Idle)
        {
            late(Property::P3, at, self.line.mode_at(at));
        }
        found
    }

    /// Time at which the unit's mode shows the result of a bound that ends at `at`: where it hung then, once it runs again; never of a
    /// unit that is dead itself: the plant is looked at for that.
    fn judged(&self, at: Micros) -> Option<Micros> {
        let dead = life::is_dead(self.evidence, self.evidence.under.node(), at);
        let judges = can_judge(self.evidence, self.evidence.under.node(), at);
        (!dead && judges <= self.evidence.duration).then_some(judges)
    }

    /// True if it was a step of its own.
    fn on_purpose(&self) -> bool {
        let near = self.evidence.entries.iter().filter(|w| w.at <= self.killed && self.killed - w.at < TRUTH_PERIOD);
        near.filter(|w| w.entry.node == NodeId::CAMPAIGN)
            .any(|w| matches!(w.entry.event, Any::Instrument(Note::Step { begun: true, .. })))
    }

    /// A unit that did not run for as long as its supervision lease holds at its first judgement; one that was started
    /// again is idle.
    fn holds_when_it_runs_again(&self) -> Option<Finding> {
        let at = self.runs.checked_add(judgement(self.evidence)).filter(|at| *at <= self.evidence.duration)?;
        let mode = self.line.mode_at(at);
        let loose = self.lapsed() && !matches!(mode, Mode::HoldSafe | Mode::Idle);
        let what = || format!("{} after {} ms in which it did not run", mode.name(), (self.runs - self.killed) / 1000);
        loose.then(|| finding(Property::P3, at, what()))
    }

    /// The plant under a dead unit: no lease beyond that of its last set-point nor beyond *Th*, and at rest when the brakes have
    /// had their time.
    fn plant_stops(&self, zero: Micros) -> Vec<Finding> {
        let due = zero + self.evidence.bounds.to_hold_safe_ms * 1000;
        let due = due + self.world_stood_still(zero, due);
        let leased = self.leased_beyond(zero);
        let mut found = Vec::from_iter(leased.clone());
        if due > self.runs {
            return found;
        }
        if !self.line.truth.iter().any(|t| t.at >= due) {
            found.push(finding(Property::P10, due, "no ground truth of the plant after its unit was killed"));
        }
        let driven = self.line.truth.iter().find(|t| t.at > due && t.at < self.runs && (t.leased || t.set_speed != 0));
        found.extend(driven.filter(|_| leased.is_none()).map(|t| {
            let what = format!("the plant still follows {} mm/s after its unit was killed", t.set_speed);
            finding(Property::P3, t.at, what)
        }));
        found.extend(self.stands_in_time(zero));
        found
    }

    /// No set-point has a longer lease than the platform gives one, at whatever speed; so the last one's ends by then.
    fn leased_beyond(&self, zero: Micros) -> Option<Finding> {
        let lease = self.evidence.bounds.set_point_lease_ms;
        let due = zero + lease * 1000 + SLACK;
        let due = due + self.world_stood_still(zero, due);
        let held = self.line.truth.iter().find(|t| t.at > due && t.at < self.runs && t.leased)?;
        let after = (held.at - zero) / 1000;
        let what = format!("the plant is still leased {after} ms after its unit was killed, {lease} ms expected");
        Some(finding(Property::P3, held.at, what))
    }

    fn stands_in_time(&self, zero: Micros) -> Option<Finding> {
        let b = &self.evidence.bounds;
        let braking = u64::from(b.max_speed_mm_s) * 1_000_000 / u64::from(b.braking_mm_s2).max(1);
        let due = zero + b.to_hold_safe_ms * 1000 + braking + TRUTH_PERIOD;
        let due = due + self.world_stood_still(zero, due);
        let moving = self.line.truth.iter().find(|t| t.at > due && t.at < self.runs && !t.safe)?;
        let what = format!("{} mm/s {} ms after {} was killed", moving.speed, (moving.at - zero) / 1000, self.node);
        Some(finding(Property::P3, moving.at, what))
    }
}

impl Death<'_> {
    /// Time from `from` on for which the plant's world did not go on, of stops that began until `to`: no plant brakes in it meanwhile.
    fn world_stood_still(&self, from: Micros, to: Micros) -> Micros {
        let began = self.evidence.entries.iter().filter(|w| {
            matches!(w.entry.event, Any::Instrument(Note::Suspended { node, on: true, .. }) if node == self.evidence.under.sim)
                && w.at <= to
        });
        began.map(|w| runs_again(self.evidence, w).saturating_sub(w.at.max(from))).sum()
    }
}

fn nominal(mode: Mode) -> bool {
    matches!(mode, Mode::Ready | Mode::PrepareToAct)
}
