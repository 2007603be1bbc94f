//! The four answers that an operator looks for first, for one unit: its mode, why and since when, the next step, and
//! whether the picture is true.
//!
//! They follow from the shown values alone, and are the same in the window, on the page and on the terminal. Names and
//! readings are [`wording`]'s, drawing is left to the views.

use serde::Serialize;
use wire::event::Freshness;
use wire::id::UnitId;
use wire::mode::{Guard, Mode};
use wire::person::Order;
use wire::time::Span;

use crate::shown::{Origin, Shown, ShownUnit};
use crate::silence::Plan;
use crate::skew::Rate;
use crate::wording::{self, at_most, lasting};

/// A sign beside words. Views give each a shape and a colour of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Sign {
    /// As it should be.
    Normal,
    /// Quiet as planned, or not in use.
    Quiet,
    /// Holds authority.
    Authority,
    /// Not current: a recording, or a little late.
    Past,
    /// Abnormal and known, or not verified.
    Caution,
    /// Stands in HOLD_SAFE.
    Held,
    /// Not known any more.
    Lost,
}

/// One of the answers: a headline, and the lines below it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Answer {
    /// Sign of the headline.
    pub sign: Sign,
    /// The answer in a few words.
    pub headline: String,
    /// Lines below it, each with its sign.
    pub details: Vec<(Sign, String)>,
}

impl Answer {
    fn new(sign: Sign, headline: impl Into<String>) -> Self {
        Self { sign, headline: headline.into(), details: Vec::new() }
    }

    fn with(mut self, sign: Sign, detail: impl Into<String>) -> Self {
        let detail = detail.into();
        if !detail.is_empty() {
            self.details.push((sign, detail));
        }
        self
    }

    /// Headline and details as one sentence.
    pub fn sentence(&self) -> String {
        let parts = self.details.iter().map(|(_, detail)| detail.as_str());
        std::iter::once(self.headline.as_str()).chain(parts).collect::<Vec<_>>().join(", ")
    }
}

/// The four answers for one unit.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Banner {
    /// The unit.
    #[serde(skip)]
    pub unit: UnitId,
    /// Mode, with speed and authority.
    pub mode: Answer,
    /// Why it is in that mode.
    pub why: Answer,
    /// How long it has been so.
    pub since: Answer,
    /// The next step for the person here.
    pub next: Answer,
    /// Whether the picture is true: fresh, of the unit's own making, checked.
    pub truth: Answer,
}

impl ShownUnit {
    /// Sign of its state.
    pub fn sign(&self) -> Sign {
        let (state, freshness) = self.state.get();
        match (freshness, state.mode) {
            (Freshness::Fresh, Mode::Ready) => Sign::Normal,
            (Freshness::Fresh, Mode::Idle) => Sign::Quiet,
            (Freshness::Fresh, Mode::PrepareToAct) => Sign::Authority,
            (Freshness::Fresh, Mode::Degraded) => Sign::Caution,
            (Freshness::Fresh, Mode::HoldSafe) => Sign::Held,
            _ if self.is_out_of_contact() => Sign::Quiet,
            (Freshness::Late, _) => Sign::Past,
            (Freshness::Stale, _) => Sign::Caution,
            (Freshness::Lost, _) => Sign::Lost,
        }
    }
}

impl Shown {
    /// The units with their signs, the worst first, and of equals in their own order.
    pub fn worst_first(&self) -> Vec<(UnitId, Sign)> {
        let heard = self.units.iter().map(|unit| (unit.unit, unit.sign()));
        let mut all: Vec<_> = heard.chain(self.silent.iter().map(|unit| (*unit, Sign::Lost))).collect();
        all.sort_by_key(|(_, sign)| std::cmp::Reverse(*sign));
        all
    }

    /// The four answers for `unit`.
    pub fn banner(&self, unit: UnitId) -> Banner {
        let Some(shown) = self.unit(unit) else { return self.unheard(unit) };
        Banner {
            unit,
            mode: mode(shown),
            why: self.why(shown),
            since: self.since(shown),
            next: self.next(shown),
            truth: self.truth(shown),
        }
    }

    fn unheard(&self, unit: UnitId) -> Banner {
        Banner {
            unit,
            mode: Answer::new(Sign::Lost, "NOTHING RECEIVED").with(Sign::Lost, "its mode is not known"),
            why: Answer::new(Sign::Lost, "No report was ever accepted").with(Sign::Lost, self.session(unit)),
            since: Answer::new(Sign::Normal, "the start"),
            next: Answer::new(Sign::Normal, "Hold by other means").with(Sign::Normal, "HOLD withholds its permission"),
            truth: Answer::new(Sign::Lost, "Nothing is known of it"),
        }
    }

    /// The session of a unit at the gateway, in words.
    fn session(&self, unit: UnitId) -> String {
        let link = self.links.iter().find(|link| link.peer == unit.peer());
        match link.map(|link| (link, *link.open.get().0)) {
            None => "the gateway has had no session with it".to_owned(),
            Some((link, false)) => format!("its session ended {} ago", lasting(self.at.since(link.since))),
            Some((_, true)) => "its session is open".to_owned(),
        }
    }

    fn why(&self, unit: &ShownUnit) -> Answer {
        let (state, freshness) = unit.state.get();
        let sign = unit.sign();
        if unit.is_out_of_contact() {
            return Answer::new(sign, "Between contacts, as planned");
        }
        if freshness > Freshness::Late {
            let headline = format!("No report for {}", lasting(unit.state.age()));
            let others: Vec<&str> =
                self.units.iter().filter(|of| of.state.fresh().is_some()).map(|of| of.unit.name()).collect();
            let heard = if others.is_empty() { String::new() } else { format!("heard: {}", others.join(", ")) };
            return Answer::new(sign, headline).with(sign, self.session(unit.unit)).with(Sign::Normal, heard);
        }
        let [headline, detail] = state.why(&self.bounds);
        Answer::new(sign, headline).with(sign, detail)
    }

    fn since(&self, unit: &ShownUnit) -> Answer {
        if let (true, Plan::Silence(Some(next))) = (unit.is_out_of_contact(), unit.plan()) {
            return Answer::new(Sign::Quiet, format!("{} to contact", lasting(next)));
        }
        if unit.state.freshness() > Freshness::Late {
            return Answer::new(Sign::Normal, "not known").with(Sign::Normal, "for it is not heard");
        }
        let answer = Answer::new(Sign::Normal, lasting(self.at.since(unit.since)));
        answer.with(Sign::Normal, format!("at {}", clock(unit.since.since(self.epoch()))))
    }

    /// The next step: one imperative, and its first unmet condition.
    fn next(&self, unit: &ShownUnit) -> Answer {
        let name = unit.unit.name();
        if self.marks.replay {
            return Answer::new(Sign::Past, "Nothing: this has happened")
                .with(Sign::Past, "a recording takes no orders");
        }
        if let Some(prepared) = self.prepared {
            let left = prepared.until.since(self.at);
            let headline = format!("Confirm or withdraw: {}", ordered(&prepared.order));
            return Answer::new(Sign::Authority, headline)
                .with(Sign::Authority, format!("{} left", wording::left(left)));
        }
        if unit.is_out_of_contact() {
            let hold = match unit.plan() {
                Plan::Silence(Some(next)) => format!("HOLD goes out in {}", lasting(next)),
                Plan::Silence(None) | Plan::None | Plan::Contact(_) | Plan::Due(_) => String::new(),
            };
            return Answer::new(Sign::Normal, "Nothing yet").with(Sign::Quiet, hold);
        }
        let (state, freshness) = unit.state.get();
        if freshness > Freshness::Late {
            let by_itself = format!(
                "if it hears nothing either, it holds by itself within {} s",
                wording::tenths(self.bounds.lease_ms as f64 / 1000.0)
            );
            let headline = if state.motion.is_some() { "Keep people clear of it" } else { "Stay away from it" };
            return Answer::new(Sign::Lost, headline)
                .with(Sign::Normal, if state.contact.is_none() { by_itself } else { String::new() })
                .with(Sign::Normal, "HOLD withholds its permission");
        }
        let failing: Vec<Guard> = state.failing.iter().filter(|guard| *guard != Guard::Designation).collect();
        let waits = |what: &str| {
            let first = failing.first().map(|guard| wording::guard(state.suite(), *guard));
            first.map_or(String::new(), |guard| format!("{what} waits: {guard} fails"))
        };
        let hysteresis = wording::tenths(self.bounds.hysteresis_ms as f64 / 1000.0);
        match (state.mode, failing.first()) {
            (Mode::Ready, _) => Answer::new(Sign::Normal, "Nothing is asked of you"),
            (Mode::PrepareToAct, _) => match state.authority {
                Some(held) => Answer::new(Sign::Authority, format!("Act on track {}, or let it end", held.track.0))
                    .with(Sign::Authority, format!("authority ends in {}", wording::left(held.left))),
                None => Answer::new(Sign::Authority, "Act, or let it end"),
            },
            (Mode::HoldSafe, Some(guard)) => {
                Answer::new(Sign::Normal, format!("{}, then Resume", remedy(unit, *guard)))
                    .with(Sign::Caution, waits("Resume"))
            }
            (Mode::HoldSafe, None) => Answer::new(Sign::Normal, format!("Resume {name} to let it go on")),
            (Mode::Degraded, Some(guard)) => {
                Answer::new(Sign::Normal, remedy(unit, *guard)).with(Sign::Caution, waits("READY"))
            }
            (Mode::Degraded, None) => {
                Answer::new(Sign::Normal, "Wait").with(Sign::Quiet, format!("READY after {hysteresis} s of all guards"))
            }
            (Mode::Idle, Some(guard)) => Answer::new(Sign::Normal, format!("{}, then Enable", remedy(unit, *guard)))
                .with(Sign::Caution, waits("Enable")),
            (Mode::Idle, None) => Answer::new(Sign::Normal, format!("Enable {name} to start it")),
        }
    }

    /// Whether the picture of the unit is true.
    fn truth(&self, unit: &ShownUnit) -> Answer {
        let oldest = unit
            .tracks
            .iter()
            .map(|track| track.age())
            .chain([unit.state.age(), unit.pose.age()])
            .max()
            .unwrap_or(Span(u64::MAX));
        let freshness = unit.state.freshness();
        let verified = matches!(unit.origin, Origin::Direct | Origin::Relayed(_)) && self.marks.ablation.is_none();
        let runs = unit.clock.is_some_and(Rate::exceeds_drift);
        let planned = unit.is_out_of_contact();
        let (sign, headline) = match freshness {
            _ if self.marks.invalid.is_some() => (Sign::Lost, "No: evidence of nothing"),
            _ if planned => (Sign::Quiet, "Old, as planned"),
            Freshness::Lost => (Sign::Lost, "No: it is old"),
            Freshness::Stale => (Sign::Caution, "No: it is stale"),
            _ if runs => (Sign::Caution, "Its ages are not sure"),
            Freshness::Late => (Sign::Past, "Late"),
            Freshness::Fresh if self.marks.replay && verified => (Sign::Past, "It was, then"),
            Freshness::Fresh if verified => (Sign::Normal, "Fresh and verified"),
            Freshness::Fresh => (Sign::Caution, "Fresh, but not verified"),
        };
        let age = if oldest == Span(u64::MAX) {
            "of unknown age".to_owned()
        } else {
            format!("oldest value {}", at_most(oldest))
        };
        let age_sign = if planned { Sign::Quiet } else { aged(freshness) };
        let mut answer = Answer::new(sign, headline).with(age_sign, age);
        let (origin_sign, origin) = origin(unit);
        answer = answer.with(origin_sign, origin);
        if runs {
            answer = answer.with(Sign::Caution, "its clock runs away");
        }
        answer
    }
}

/// Sign of a freshness.
pub fn aged(freshness: Freshness) -> Sign {
    match freshness {
        Freshness::Fresh => Sign::Normal,
        Freshness::Late => Sign::Past,
        Freshness::Stale => Sign::Caution,
        Freshness::Lost => Sign::Lost,
    }
}

/// The checks that a report has passed, where they are not all of them.
fn origin(unit: &ShownUnit) -> (Sign, String) {
    match unit.origin {
        Origin::Direct => (Sign::Normal, String::new()),
        Origin::Relayed(via) => (Sign::Past, format!("relayed by {via}")),
        Origin::Unverified => {
            let checks: Vec<&str> = unit.waived.iter().map(wording::check).collect();
            let more = if checks.len() > 1 { format!(" and {} more", checks.len() - 1) } else { String::new() };
            (Sign::Caution, format!("{}{more} not checked", checks.first().unwrap_or(&"its origin")))
        }
        Origin::NotLive(_) => (Sign::Caution, format!("{} content", unit.origin.words().to_lowercase())),
    }
}

fn mode(unit: &ShownUnit) -> Answer {
    let (state, freshness) = unit.state.get();
    let (sign, name) = (unit.sign(), state.mode.name());
    if unit.is_out_of_contact() {
        return Answer::new(sign, "OUT OF CONTACT").with(sign, format!("was {name} {} ago", lasting(unit.state.age())));
    }
    match freshness {
        Freshness::Lost => Answer::new(sign, "LINK LOST").with(sign, format!("was {name}")),
        Freshness::Stale => Answer::new(sign, format!("was {name}")).with(sign, "stale"),
        Freshness::Late => Answer::new(sign, name).with(sign, "late"),
        Freshness::Fresh => {
            let moves = if state.speed_mm_s.unsigned_abs() < 50 {
                "stands".to_owned()
            } else {
                format!("{} m/s", wording::tenths(f64::from(state.speed_mm_s) / 1000.0))
            };
            let held = state.authority.map_or(String::new(), |held| format!("authority on track {}", held.track.0));
            Answer::new(sign, name).with(sign, moves).with(Sign::Authority, held)
        }
    }
}

/// The remedy for a guard that fails.
fn remedy(unit: &ShownUnit, guard: Guard) -> String {
    let state = unit.state.get().0;
    let name = wording::guard(state.suite(), guard);
    match guard {
        Guard::Teammates => match state.measured.teammate() {
            Some((teammate, _)) => format!("Check {teammate}"),
            None => "Check the teammates".to_owned(),
        },
        Guard::Geofence => "Move it away from the fence".to_owned(),
        Guard::Lease => "Check its link".to_owned(),
        Guard::SealedLog => "Check its recorder".to_owned(),
        Guard::Rgb | Guard::Depth | Guard::Thermal | Guard::Lidar => format!("Check its {}", lower(name)),
        Guard::Tracks => "Check its perception".to_owned(),
        Guard::Localisation | Guard::Drift => "Check where it really is".to_owned(),
        Guard::TimeBase => "Check its receiver".to_owned(),
        Guard::Designation => "Look at the track".to_owned(),
    }
}

/// A name within a sentence; one that is no plain word keeps its capitals.
fn lower(name: &str) -> String {
    if name == "LiDAR" { name.to_owned() } else { name.to_lowercase() }
}

/// An order in a few words.
pub fn ordered(order: &Order) -> String {
    use wire::command::CommandKind;
    match order {
        Order::Revoke(who) => format!("revoke {who}"),
        Order::Command(unit, kind) => match kind {
            CommandKind::Hold => format!("hold {unit}"),
            CommandKind::Disarm => format!("disarm {unit}"),
            CommandKind::Enable => format!("enable {unit}"),
            CommandKind::Resume => format!("resume {unit}"),
            CommandKind::Arm(track) => format!("arm {unit} on track {}", track.0),
            CommandKind::Confirm(track) => format!("act with {unit} on track {}", track.0),
            CommandKind::Configure(_) => format!("configure {unit}"),
        },
    }
}

/// Time of a run: minutes and seconds with tenths, and hours where there are any.
pub fn clock(span: Span) -> String {
    let tenths = span.0 / 100_000;
    let (hours, minutes, seconds) = (tenths / 36_000, tenths / 600 % 60, tenths % 600);
    let hours = if hours > 0 { format!("{hours}:") } else { String::new() };
    format!("{hours}{minutes:02}:{:02}.{}", seconds / 10, seconds % 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_of_a_run_is_written_with_tenths() {
        let written = [(0, "00:00.0"), (76_449, "01:16.4"), (3_600_000, "1:00:00.0")];
        written.iter().for_each(|(ms, words)| assert_eq!(clock(Span::ms(*ms)), *words));
    }

    #[test]
    fn a_worse_sign_is_greater() {
        assert!(Sign::Lost > Sign::Held && Sign::Held > Sign::Caution && Sign::Caution > Sign::Past);
        assert!(Sign::Past > Sign::Authority && Sign::Authority > Sign::Quiet && Sign::Quiet > Sign::Normal);
    }
}
