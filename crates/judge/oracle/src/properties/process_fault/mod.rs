//! Responses required of the platform when one of its processes is killed, hangs, is slow or finds its disk full (`response`, stated
//! before any run), and those that a log shows: parts of P2 and P3. Where a log does not allow a conclusion it is no evidence (P10).
//!
//! A process that dies writes no more, so each row is read from the others: the mode from the unit's own log, and
//! where the unit itself is dead, from the ground truth of the plant. Bounds are the platform's (`docs/reference/bounds.md`). A
//! process that does not run for a time requires the response to a dead one, as far as its bounds end within that time; and a unit
//! that did not run for as long as its lease holds as soon as it runs again.

mod response;

use evidence::{Evidence, Micros};
use ground_truth::{Any, Note, Suspension};
use wire::bounds::Bounds;
use wire::command::CommandKind;
use wire::id::NodeId;
use wire::mode::{Cause, Mode};

use super::{Finding, Property, finding};
use crate::facts::timeline::{Change, Timeline, is_nominal, is_resting};
use crate::facts::{Facts, SLACK, process};

use evidence::process_fault::{From, PlantResponse, ProcessFault, Response};
pub use response::{REQUIRED_RESPONSES, RequiredResponse, required_response};

/// Time between two samples of the plant's truth.
const TRUTH_PERIOD: Micros = 100_000;

/// A process fault under judgement.
struct JudgedFault<'a> {
    node: NodeId,
    required: &'static RequiredResponse,
    fate: ProcessFault,
    killed: Micros,
    /// Time at which it ran again after its longest stop; never for one that is dead.
    runs_again: Micros,
    /// Begin of the bounds: the kill, or the HOLD after it if there was one.
    zero: Option<Micros>,
    evidence: &'a Evidence,
    timeline: &'a Timeline,
}

/// Findings against one property.
pub(super) fn findings(facts: &Facts, property: Property) -> Vec<Finding> {
    let all = judged_faults(facts).into_iter().flat_map(|fault| fault.findings());
    all.filter(|finding| finding.property == property).collect()
}

/// Response to every process fault of the log.
pub(crate) fn responses(facts: &Facts) -> Vec<Response> {
    let faults = judged_faults(facts).into_iter();
    faults.map(|fault| Response { in_time: fault.findings().is_empty(), ..fault.response() }).collect()
}

fn judged_faults<'a>(facts: &'a Facts<'a>) -> Vec<JudgedFault<'a>> {
    let (evidence, timeline) = (facts.evidence, &facts.timeline);
    let mut faults = Vec::new();
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
        let Some(required) = required_response(evidence.under, node) else { continue };
        if matches!(w.entry.event, Any::Instrument(Note::Suspended { .. })) && process::is_dead(evidence, node, w.at) {
            continue; // A process that has ended is not stopped: its end requires the response.
        }
        let runs_again = process::runs_again(evidence, w);
        let while_stopped = |time: Micros| time >= w.at && time < runs_again;
        let hold_given = || {
            let mut holds = timeline.intended.iter().filter(|(.., kind)| *kind == CommandKind::Hold);
            holds.find(|(given_at, ..)| while_stopped(*given_at)).map(|(given_at, ..)| *given_at)
        };
        let zero = if required.from == From::Kill { Some(w.at) } else { hold_given() };
        faults.push(JudgedFault { node, required, fate, killed: w.at, runs_again, zero, evidence, timeline });
    }
    faults
}

impl JudgedFault<'_> {
    fn is_of_unit(&self) -> bool {
        self.node == self.evidence.under.node()
    }

    /// Mode at the end of the run; of a dead unit only its plant can be believed.
    fn mode_after(&self) -> Mode {
        let last = self.timeline.mode_at(Micros::MAX);
        if self.is_of_unit() && self.runs_again == Micros::MAX && self.timeline.ends_at_rest_unleased() {
            Mode::HoldSafe
        } else {
            last
        }
    }

    fn lease_ended(&self) -> Option<Micros> {
        if self.runs_again < Micros::MAX {
            // A unit that runs again gives its plant leases again: only the samples of its stop count.
            let mut stopped = self.timeline.truth.iter().filter(|t| t.at >= self.killed && t.at < self.runs_again);
            return stopped.find(|t| !t.leased).map(|t| t.at);
        }
        self.timeline.truth_for_good(self.zero?, |t| !t.leased)
    }

    fn stands_from(&self) -> Option<Micros> {
        self.timeline.truth_for_good(self.zero?, |t| t.safe)
    }

    fn response(&self) -> Response {
        let ms = |time: Option<Micros>| Some(time?.saturating_sub(self.zero?) as f64 / 1000.0);
        let change = |test: &dyn Fn(Mode) -> bool| {
            let by_platform = |c: &Change| test(c.to) && c.cause != Cause::Operator;
            self.timeline.first_change(self.zero?, by_platform).map(|c| c.at)
        };
        let after = self.mode_after();
        let speed = self.timeline.truth.iter().rev().find(|t| t.at <= self.killed).map_or(0, |t| t.speed);
        let (restricted, settled, cause) = if self.is_of_unit() {
            (self.lease_ended(), self.lease_ended(), self.lease_ended().map(|_| "set-point lease".to_owned()))
        } else {
            let last_change =
                self.timeline.changes.iter().rev().find(|c| c.at >= self.killed && c.cause != Cause::Operator);
            let restricted = change(&|to| matches!(to, Mode::Degraded | Mode::HoldSafe));
            (restricted, change(&|to| to == after), last_change.map(|c| c.cause.label()))
        };
        let plant = PlantResponse {
            speed_mm_s: speed,
            lease_ended_ms: ms(self.lease_ended()),
            standing_ms: ms(self.stands_from().filter(|_| after == Mode::HoldSafe)),
        };
        Response {
            process: self.node.name().to_owned(),
            fate: self.fate,
            killed_ms: self.killed as f64 / 1000.0,
            before: self.timeline.mode_at(self.killed),
            after,
            cause,
            from: self.required.from,
            restricted_ms: ms(restricted),
            settled_ms: ms(settled),
            plant: (self.node != self.evidence.under.sim).then_some(plant),
            required: self.is_response_due(),
            in_time: true,
        }
    }

    /// Required responses that did not come. Of a platform that was not in nominal control when the process died
    /// no conclusion can be drawn: that is no evidence, never a pass.
    fn findings(&self) -> Vec<Finding> {
        let before = self.timeline.mode_at(self.killed);
        // A kill that is a named step was put where it is on purpose.
        if !is_nominal(before) && !self.is_named_step() {
            let message = format!("the unit was {} when {} was killed", before.name(), self.node);
            return vec![finding(Property::P10, self.killed, message)];
        }
        // A kill after which its bound never began shows nothing; a stop without a HOLD requires nothing.
        let Some(zero) = self.zero else {
            if self.fate != ProcessFault::Kill {
                return Vec::new();
            }
            let message = format!("no HOLD was given after {} was killed", self.node);
            return vec![finding(Property::P10, self.killed, message)];
        };
        let mut found = Vec::new();
        if self.is_of_unit() {
            found.extend(self.plant_goes_on(zero));
            found.extend(self.goes_on_after_lapse());
        } else {
            found.extend(self.late_modes(zero));
            let holds = self.required.ends_in == Mode::HoldSafe && self.node != self.evidence.under.sim;
            found.extend(if holds { self.moves_too_long(zero) } else { None });
        }
        found.extend(if self.fate == ProcessFault::Full { self.holds_up_others() } else { None });
        found
    }

    /// Finding for a part that a log without disk space holds up: reports must still come, and the plant must still be
    /// driven under its lease.
    fn holds_up_others(&self) -> Option<Finding> {
        let (from, to) = (self.killed, self.runs_again.min(self.evidence.duration));
        let limit = self.evidence.bounds.freshness_ms * 1000;
        let by_unit = self.timeline.accepted.iter().filter(|(_, record)| record.node == self.evidence.under.node());
        let reports =
            by_unit.map(|(accepted_at, _)| *accepted_at).filter(|accepted_at| (from..to).contains(accepted_at));
        let marks: Vec<Micros> = std::iter::once(from).chain(reports).chain([to]).collect();
        let silent = marks.windows(2).find(|pair| pair[1] - pair[0] > limit);
        let unleased =
            || self.timeline.truth.iter().find(|t| (from..to).contains(&t.at) && !t.leased && self.drives(t.at));
        let missing = |missed_at: Micros, part: &str| {
            finding(Property::P2, missed_at, format!("{part} while no log could be written"))
        };
        silent.map(|pair| missing(pair[1], "no report")).or_else(|| unleased().map(|t| missing(t.at, "no set-point")))
    }

    fn drives(&self, time: Micros) -> bool {
        matches!(self.timeline.mode_at(time), Mode::Ready | Mode::PrepareToAct | Mode::Degraded)
    }

    /// End of a bound that counts from `zero`, if the process does not run again before.
    fn due(&self, zero: Micros, bound: Option<fn(&Bounds) -> u64>) -> Option<Micros> {
        Some(zero + bound?(&self.evidence.bounds) * 1000).filter(|end| *end <= self.runs_again)
    }

    /// True if there was a cause for a response.
    fn is_response_due(&self) -> bool {
        let Some(zero) = self.zero else { return false };
        if self.fate == ProcessFault::Full {
            return true;
        }
        if self.is_of_unit() {
            return self.due(zero, Some(response::th)).is_some() || self.supervision_lapsed();
        }
        self.due(zero, self.required.restricted).is_some() || self.due(zero, self.required.settled).is_some()
    }

    /// True if the unit runs again after a stop longer than its supervision lease.
    fn supervision_lapsed(&self) -> bool {
        let b = &self.evidence.bounds;
        self.runs_again < self.evidence.duration
            && self.runs_again - self.killed > (b.lease_ms + b.control_period_ms) * 1000
    }

    fn late_modes(&self, zero: Micros) -> Vec<Finding> {
        let due = |bound: Option<fn(&Bounds) -> u64>| self.due(zero, bound);
        let mut found = Vec::new();
        // A run that ends before the bound shows neither that it was kept nor that it was missed.
        if let Some(end) =
            due(self.required.restricted).max(due(self.required.settled)).filter(|end| *end > self.evidence.duration)
        {
            let message = format!("the run ends before what {}'s death owes at {} ms is due", self.node, end / 1000);
            return vec![finding(Property::P10, self.evidence.duration, message)];
        }
        let mut late = |property: Property, time: Micros, mode: Mode| {
            let after = (time - zero) / 1000;
            let message = format!("{after} ms after {} was killed still {}", self.node, mode.name());
            found.push(finding(property, time, message));
        };
        if let Some(shown_at) = due(self.required.restricted).and_then(|shown_at| self.mode_shows_at(shown_at))
            && is_nominal(self.timeline.mode_at(shown_at))
        {
            late(Property::P2, shown_at, self.timeline.mode_at(shown_at));
        }
        if let Some(shown_at) = due(self.required.settled).and_then(|shown_at| self.mode_shows_at(shown_at))
            && self.required.ends_in == Mode::HoldSafe
            && !is_resting(self.timeline.mode_at(shown_at))
        {
            late(Property::P3, shown_at, self.timeline.mode_at(shown_at));
        }
        found
    }

    /// Time at which the unit's mode shows the result of a bound that ends at `time`: where it hung then, once it runs again; never of a
    /// unit that is dead itself: the plant is looked at for that.
    fn mode_shows_at(&self, time: Micros) -> Option<Micros> {
        let dead = process::is_dead(self.evidence, self.evidence.under.node(), time);
        let judges_from = process::can_judge(self.evidence, self.evidence.under.node(), time);
        (!dead && judges_from <= self.evidence.duration).then_some(judges_from)
    }

    /// True if the kill was a named step of the attack.
    fn is_named_step(&self) -> bool {
        let near = self.evidence.entries.iter().filter(|w| w.at <= self.killed && self.killed - w.at < TRUTH_PERIOD);
        near.filter(|w| w.entry.node == NodeId::CAMPAIGN)
            .any(|w| matches!(w.entry.event, Any::Instrument(Note::Step { begun: true, .. })))
    }

    /// Finding for a unit that runs again after a stop longer than its supervision lease, and does not hold at its
    /// first judgement. A unit that was started again is idle.
    fn goes_on_after_lapse(&self) -> Option<Finding> {
        let judged_at = self
            .runs_again
            .checked_add(process::judgement_after_stop(self.evidence))
            .filter(|judged_at| *judged_at <= self.evidence.duration)?;
        let mode = self.timeline.mode_at(judged_at);
        let goes_on = self.supervision_lapsed() && !is_resting(mode);
        let message =
            || format!("{} after {} ms in which it did not run", mode.name(), (self.runs_again - self.killed) / 1000);
        goes_on.then(|| finding(Property::P3, judged_at, message()))
    }

    /// Plant that goes on under a dead unit. It has no lease beyond that of its last set-point nor beyond *Th*, and is at rest when the brakes have
    /// had their time.
    fn plant_goes_on(&self, zero: Micros) -> Vec<Finding> {
        let due = zero + self.evidence.bounds.to_hold_safe_ms * 1000;
        // While its world hung no plant braked and no lease ended in it: that time is in the bound.
        let due = due + self.world_stood_still(zero, due);
        let leased = self.leased_beyond(zero);
        let mut found = Vec::from_iter(leased.clone());
        if due > self.runs_again {
            return found;
        }
        if !self.timeline.truth.iter().any(|t| t.at >= due) {
            found.push(finding(Property::P10, due, "no ground truth of the plant after its unit was killed"));
        }
        let driven =
            self.timeline.truth.iter().find(|t| t.at > due && t.at < self.runs_again && (t.leased || t.set_speed != 0));
        found.extend(driven.filter(|_| leased.is_none()).map(|t| {
            let message = format!("the plant still follows {} mm/s after its unit was killed", t.set_speed);
            finding(Property::P3, t.at, message)
        }));
        found.extend(self.moves_too_long(zero));
        found
    }

    /// Lease that is longer than the platform gives a set-point, at whatever speed: that of the last one has ended by then.
    fn leased_beyond(&self, zero: Micros) -> Option<Finding> {
        let lease = self.evidence.bounds.set_point_lease_ms;
        let due = zero + lease * 1000 + SLACK;
        let due = due + self.world_stood_still(zero, due);
        let held = self.timeline.truth.iter().find(|t| t.at > due && t.at < self.runs_again && t.leased)?;
        let after = (held.at - zero) / 1000;
        let message = format!("the plant is still leased {after} ms after its unit was killed, {lease} ms expected");
        Some(finding(Property::P3, held.at, message))
    }

    fn moves_too_long(&self, zero: Micros) -> Option<Finding> {
        let b = &self.evidence.bounds;
        let braking = u64::from(b.max_speed_mm_s) * 1_000_000 / u64::from(b.braking_mm_s2).max(1);
        let due = zero + b.to_hold_safe_ms * 1000 + braking + TRUTH_PERIOD;
        let due = due + self.world_stood_still(zero, due);
        let moving = self.timeline.truth.iter().find(|t| t.at > due && t.at < self.runs_again && !t.safe)?;
        let message = format!("{} mm/s {} ms after {} was killed", moving.speed, (moving.at - zero) / 1000, self.node);
        Some(finding(Property::P3, moving.at, message))
    }

    /// Time from `from` on for which the plant's world did not go on, of stops that began until `to`: no plant brakes in it meanwhile.
    fn world_stood_still(&self, from: Micros, to: Micros) -> Micros {
        let began = self.evidence.entries.iter().filter(|w| {
            matches!(w.entry.event, Any::Instrument(Note::Suspended { node, on: true, .. }) if node == self.evidence.under.sim)
                && w.at <= to
        });
        began.map(|w| process::runs_again(self.evidence, w).saturating_sub(w.at.max(from))).sum()
    }
}
