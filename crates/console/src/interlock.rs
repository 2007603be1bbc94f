//! Interlocks: the conditions of an order, and those behind a unit's mode, each with its value and its limit.
//!
//! The same list greys a control out, is named beside it, and is judged when the act comes. It follows from the shown
//! values alone. It spares the operator an order that would be refused; refusing it is left to unit and gateway.

use config::suite::Suite;
use wire::bounds::Bounds;
use wire::command::CommandKind;
use wire::id::{TrackId, UnitId};
use wire::measured::{Limit, Measured};
use wire::mode::{Guard, Mode};
use wire::person::{Order, Role, Unable};
use wire::sensor::{Modalities, Modality};
use wire::time::Span;

use crate::shown::{Shown, ShownUnit, State};
use crate::{text, wording};

/// A condition with its value and its limit, as displayed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Predicate {
    /// Name of the condition, for programs.
    pub name: &'static str,
    /// Name of the condition, for persons.
    pub title: &'static str,
    /// Present value, as displayed.
    pub value: String,
    /// Required value; empty where the name says it.
    pub limit: String,
    /// Value beside its limit, for persons; empty where `value` says it.
    pub reading: String,
    /// True if it holds.
    pub holds: bool,
    /// True if it was judged at all: an unknown value does not fail.
    pub judged: bool,
    /// The refusal of an act when this condition fails.
    pub unable: Unable,
}

impl Predicate {
    fn new(name: &'static str, holds: bool, value: impl Into<String>, limit: impl Into<String>) -> Self {
        Self {
            name,
            title: name,
            value: value.into(),
            limit: limit.into(),
            reading: String::new(),
            holds,
            judged: true,
            unable: Unable::Interlock,
        }
    }

    /// Present and required value; empty where neither is known.
    pub fn measured(&self) -> String {
        let Predicate { value, limit, reading, .. } = self;
        if !reading.is_empty() {
            return reading.clone();
        }
        if value.is_empty() || limit.is_empty() { value.clone() } else { format!("{value}, limit {limit}") }
    }

    /// Name, value and limit of the condition.
    pub fn describe(&self) -> String {
        if self.value.is_empty() { self.title.to_owned() } else { format!("{} ({})", self.title, self.measured()) }
    }

    fn or(self, unable: Unable) -> Self {
        Self { unable, ..self }
    }
}

impl Shown {
    /// Conditions of an order, which may be given when all hold. A HOLD asks for no more than a role that may give one,
    /// a live console, and that no other HOLD is under way: whatever is shown, however old.
    pub fn interlocks(&self, order: &Order) -> Vec<Predicate> {
        let needed = needed(order);
        let mut all = vec![
            Predicate::new("role", self.role >= needed, self.role.name(), needed.name()).or(Unable::Role),
            Predicate::new("live", !self.marks.replay, if self.marks.replay { "replay" } else { "live" }, "")
                .or(Unable::Role),
        ];
        match order {
            Order::Command(unit, kind) => {
                all.push(self.none_under_way(*unit, *kind));
                if !kind.towards_safe() {
                    all.extend(self.away_from_safe(*unit, *kind));
                }
            }
            Order::Revoke(who) => {
                let known = self.revocable.iter().find(|(node, _)| node == who);
                all.push(Predicate::new(
                    "revocation",
                    known.is_some(),
                    if known.is_some() { "at hand" } else { "none" },
                    "",
                ));
                let requested = known.is_some_and(|(_, requested)| *requested);
                all.push(
                    Predicate::new("not yet asked for", !requested, if requested { "asked" } else { "no" }, "")
                        .or(Unable::Pending),
                );
            }
        }
        all
    }

    /// The first condition of the order that does not hold, as a refusal.
    pub fn unable(&self, order: &Order) -> Option<Unable> {
        self.interlocks(order).into_iter().find(|predicate| !predicate.holds).map(|predicate| predicate.unable)
    }

    fn none_under_way(&self, unit: UnitId, kind: CommandKind) -> Predicate {
        let same =
            self.commands.iter().find(|command| command.unit == unit && command.kind == kind && command.under_way());
        let value = same.map_or("none".to_owned(), |command| command.id.to_string());
        Predicate::new("same order under way", same.is_none(), value, "none").or(Unable::Pending)
    }

    fn away_from_safe(&self, unit: UnitId, kind: CommandKind) -> Vec<Predicate> {
        let Some(shown) = self.unit(unit) else {
            return vec![Predicate::new("unit heard", false, "never", "")];
        };
        let (state, _) = shown.state.get();
        let fresh = shown.state.fresh().is_some();
        let mut all = vec![
            Predicate::new("state fresh", fresh, ms(shown.state.age()), ms(self.bounds.freshness())),
            in_mode(state.mode, mode_for(kind)),
        ];
        match kind {
            CommandKind::Enable | CommandKind::Resume => all.push(guards_hold(state)),
            CommandKind::Arm(track) => {
                all.push(guards_hold(state));
                all.extend(designates(shown, track, &self.bounds));
            }
            CommandKind::Confirm(track) => {
                all.push(guards_hold(state));
                let held = state.authority.is_some_and(|held| held.track == track);
                let value = state.authority.map_or("none".to_owned(), |held| format!("track {}", held.track.0));
                all.push(Predicate::new("authority", held, value, format!("track {}", track.0)));
            }
            CommandKind::Configure(_) | CommandKind::Hold | CommandKind::Disarm => {}
        }
        all
    }
}

impl ShownUnit {
    /// The guards of READY, each with its measured value and its limit.
    pub fn guards(&self, bounds: &Bounds) -> Vec<Predicate> {
        let (state, _) = self.state.get();
        let suite = state.suite();
        let guard = |guard: Guard| {
            let holds = !state.failing.contains(guard);
            let measured = state.measured.value(guard);
            let (known, (value, limit)) = match Limit::for_guard(guard, bounds) {
                Some(limit) => (measured.is_some(), judged(measured, limit)),
                None if guard == Guard::Teammates => (true, (claims(holds, &state.measured), String::new())),
                None => (state.authority.is_some(), self.designation(bounds)),
            };
            let reading = Limit::for_guard(guard, bounds).zip(measured).map_or(String::new(), |(limit, value)| {
                wording::reading(value, limit) + &awaited((guard, suite), holds, value, limit)
            });
            Predicate {
                title: wording::guard(suite, guard),
                reading,
                judged: known || !holds,
                ..Predicate::new(suite.guard(guard), holds, value, limit)
            }
        };
        Guard::ALL.into_iter().map(guard).collect()
    }

    /// The obstacle to READY when no guard fails.
    pub fn waits_for(&self, bounds: &Bounds) -> Option<String> {
        let (state, _) = self.state.get();
        let failing = state.failing.iter().any(|guard| guard != Guard::Designation);
        match state.mode {
            Mode::Ready | Mode::PrepareToAct => None,
            Mode::Idle if failing => Some("the guards that fail, and then an operator who enables it".to_owned()),
            Mode::Idle => Some("an operator who enables it".to_owned()),
            Mode::HoldSafe if failing => Some("the guards that fail, and then an operator who resumes it".to_owned()),
            Mode::HoldSafe => Some("an operator who resumes it".to_owned()),
            Mode::Degraded => Some(format!("every guard to hold for {}", ms(Span::ms(bounds.hysteresis_ms)))),
        }
    }

    /// Measure of the designated track that fails, else its confidence, with the limit.
    fn designation(&self, bounds: &Bounds) -> (String, String) {
        let (designated, suite) = (self.state.get().0.authority.map(|held| held.track), self.state.get().0.suite());
        let track = self.tracks.iter().map(|track| track.get().0).find(|track| Some(track.id) == designated);
        let missing_text = if designated.is_none() { "nothing is designated" } else { "its track is not reported" };
        let Some(track) = track else { return (missing_text.to_owned(), String::new()) };
        let least = bounds.designation_bearings_mrad;
        if track.contradicted.count() > 0 {
            (format!("contradicted by {}", modalities(suite, track.contradicted)), "none".to_owned())
        } else if u32::from(track.bearings_mrad) < least {
            (degrees(track.bearings_mrad.into()), degrees(least))
        } else {
            (permille(track.confidence), permille(self.settings(bounds).keep_permille))
        }
    }
}

/// The least role that may give the order.
fn needed(order: &Order) -> Role {
    match order {
        Order::Command(_, kind) => match kind {
            CommandKind::Hold | CommandKind::Disarm | CommandKind::Enable | CommandKind::Resume => Role::Operate,
            CommandKind::Arm(_) | CommandKind::Confirm(_) | CommandKind::Configure(_) => Role::Supervise,
        },
        Order::Revoke(_) => Role::Supervise,
    }
}

/// The mode from which the unit takes the command; a table of `autonomy/docs/state-machine.md`, any for the others.
fn mode_for(kind: CommandKind) -> Option<Mode> {
    match kind {
        CommandKind::Hold | CommandKind::Disarm => None,
        CommandKind::Enable | CommandKind::Configure(_) => Some(Mode::Idle),
        CommandKind::Resume => Some(Mode::HoldSafe),
        CommandKind::Arm(_) => Some(Mode::Ready),
        CommandKind::Confirm(_) => Some(Mode::PrepareToAct),
    }
}

fn in_mode(mode: Mode, wanted: Option<Mode>) -> Predicate {
    let holds = wanted.is_none_or(|wanted| wanted == mode);
    Predicate::new("mode", holds, mode.name(), wanted.map_or("any", Mode::name))
}

/// Every guard but the one over a designation, which only a unit with authority needs.
fn guards_hold(state: &State) -> Predicate {
    let failing: Vec<&str> =
        state.failing.iter().filter(|g| *g != Guard::Designation).map(|g| wording::guard(state.suite(), g)).collect();
    let value = if failing.is_empty() { "none".to_owned() } else { failing.join(", ") };
    Predicate::new("guards failing", failing.is_empty(), value, "none")
}

/// The evidence on which authority over a track would rest.
fn designates(unit: &ShownUnit, track: TrackId, bounds: &Bounds) -> Vec<Predicate> {
    let found = unit.tracks.iter().find(|shown| shown.get().0.id == track);
    let Some(found) = found else { return vec![Predicate::new("track fresh", false, "not reported", "")] };
    let (track, least) = (found.get().0, unit.settings(bounds).arm_permille);
    let (sure, borne_out) = (permille(track.confidence), track.supported.designate());
    let suite = unit.state.get().0.suite();
    let wanted = format!("{} and one more", suite.sensor(Modality::Thermal));
    let mut all = vec![
        Predicate::new("track fresh", found.fresh().is_some(), ms(found.age()), ""),
        Predicate::new("track confidence", track.confidence >= least, sure, permille(least)),
        Predicate::new("supported by", borne_out, modalities(suite, track.supported), wanted),
        Predicate::new(
            "contradicted by",
            track.contradicted.count() == 0,
            modalities(suite, track.contradicted),
            "none",
        ),
    ];
    let wide = bounds.designation_bearings_mrad;
    if wide > 0 {
        let enough = u32::from(track.bearings_mrad) >= wide;
        let value = degrees(track.bearings_mrad.into());
        let value = if enough { value } else { format!("{value}, the unit drives around it first") };
        // An order for a track that is not yet borne out is what makes the unit look at it.
        all.push(Predicate { judged: enough, ..Predicate::new("bearings", true, value, degrees(wide)) });
    }
    all
}

/// A guard's value and its limit, each with its unit.
fn judged(value: Option<i32>, limit: Limit) -> (String, String) {
    let words = |value: i32| match limit {
        Limit::Age(_) if value == i32::MAX => "unknown".to_owned(),
        Limit::Age(_) => format!("{value} ms"),
        Limit::Spare(_) => format!("{:.3} m", f64::from(value) / 1000.0),
        Limit::Drift(_) => format!("{value} mm s"),
        Limit::Offset(_) => format!("{value} us"),
    };
    let bound = match limit {
        Limit::Spare(bound) => format!("{} m", f64::from(bound) / 1000.0),
        Limit::Age(bound) | Limit::Drift(bound) | Limit::Offset(bound) => words(bound),
    };
    (value.map_or("not known".to_owned(), words), bound)
}

/// The condition that a guard waits for if it fails within its limit.
fn awaited((guard, suite): (Guard, Suite), holds: bool, value: i32, limit: Limit) -> String {
    match limit {
        _ if holds || limit.exceeded(value) => String::new(),
        Limit::Age(_) if guard == Guard::Localisation => format!(", but against its {}", suite.reckoning()),
        Limit::Drift(_) => ", until it is 0".to_owned(),
        Limit::Offset(most) => format!(", until it is {}", f64::from(most) / 2000.0),
        Limit::Age(_) | Limit::Spare(_) => String::new(),
    }
}

/// Result of the checks of teammates' claims.
fn claims(holds: bool, measured: &Measured) -> String {
    match measured.teammate() {
        Some((unit, found)) => format!("{unit}: {}", wording::inconsistency(found)),
        None if holds => "consistent".to_owned(),
        None => "not said whose".to_owned(),
    }
}

fn ms(span: Span) -> String {
    if span == Span(u64::MAX) { "unknown".to_owned() } else { format!("{} ms", span.0.div_ceil(1000)) }
}

fn modalities(suite: Suite, of: Modalities) -> String {
    if of.count() == 0 { "none".to_owned() } else { text::names(suite, of).collect::<Vec<_>>().join(", ") }
}

fn degrees(mrad: u32) -> String {
    format!("{:.0}°", (f64::from(mrad) / 1000.0).to_degrees())
}

fn permille(share: u16) -> String {
    format!("{:.2}", f64::from(share) / 1000.0)
}
