//! Cells: one scenario, several variations, each with its settings, its policy and its own expected classes.

use evidence::mission::Verb;
use evidence::trial::Outcome;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::mode::Mode;

use super::fault::{Ending, Fault, Kill, Process};
use super::operator::Step;
use super::set::{Settings, SettingsError};
use super::step::When;
use super::under::Under;
use super::value::{Label, List, Located, Name, Real, Whole};
use super::{Platform, Scenario, check};

/// Earliest time at which a process is killed, seconds: authority is held by then, also where arming took a second try.
const KILL_AT_S: f64 = 3.6;
/// Range of the phase added to it, seconds: kills fall before and after the act, and while the unit still drives.
const KILL_PHASE_S: [f64; 2] = [0.0, 2.4];
/// Time at which the operator asks for a HOLD through a dead broker, seconds: after the latest kill, while the unit still drives.
const HOLD_AT_S: f64 = 6.2;
/// Length of a kill's trial, seconds: unused authority has expired and the plant stands.
const KILL_DURATION_S: f64 = 10.5;

/// Time for which a process hangs or is slow at a change of mode, seconds: longer than every bound.
const SUSPENDED_S: f64 = 3.0;
/// Share of the time for which a slow process runs.
const SLOW_QUOTA: f64 = 0.25;
/// Its period. The operator acts on a grid of 100 ms and the change of mode follows at once: a quota's own 100 ms would put every
/// later order just behind a stop, and a slow broker would delay none of them.
const SLOW_PERIOD_MS: i64 = 110;
/// Time at which the operator asks for a HOLD through a broker that is dead, hung or slow, seconds: after every change of mode.
const LATE_HOLD_S: f64 = 7.4;

/// Classes of trials in which nothing was lost.
const SAFE: [Outcome; 6] = [
    Outcome::Nominal,
    Outcome::Rejected,
    Outcome::Degraded,
    Outcome::HoldSafe,
    Outcome::FalseTrip,
    Outcome::Undetected,
];

/// Classes on a platform without stated ones: those that are no failure.
const UNSTATED: [Outcome; 5] =
    [Outcome::Nominal, Outcome::Rejected, Outcome::Degraded, Outcome::HoldSafe, Outcome::Undetected];

/// One variation of a scenario: its settings, its policy and its expected classes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// Name: parts joined by `/`.
    pub name: Located<Label>,
    /// Values that replace the scenario's, by their path in the file: `"delay.0.by_ms" = 40`.
    #[serde(default)]
    pub set: Settings,
    /// Replaces the scenario's policy.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub policy: Option<Name>,
    /// Replaces the scenario's expected classes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected: Option<Located<List<Outcome, 9>>>,
}

/// A scenario with one cell's settings in force.
#[derive(Clone, Debug)]
pub struct Variation {
    /// The cell's name, or `None` where the scenario has no cells.
    pub cell: Option<String>,
    /// The scenario as it is to be run; its policy and expected classes are the cell's, and it has no cells.
    pub scenario: Scenario,
}

impl Scenario {
    /// Every variation, in the order of the file. With `policy` given, only those under it: the cells that name it, and all that
    /// name none with the classes that `[[under]]` expects (none where none are declared, so that no class counts as unexpected).
    pub fn variations(&self, policy: Option<&str>) -> Vec<Variation> {
        if self.is_of_stacks() {
            let one = |(cell, scenario)| Variation { cell: Some(cell), scenario };
            return self.stack_cells().into_iter().map(one).collect();
        }
        if self.cell.is_empty() {
            return vec![Variation { cell: None, scenario: self.under_policy(policy) }];
        }
        let is_own =
            |cell: &Cell, policy: &str| cell.policy.as_ref().is_none_or(|own_name| own_name.as_str() == policy);
        let wanted = self.cell.iter().filter(|cell| policy.is_none_or(|policy| is_own(cell, policy)));
        let combined = |cell: &Located<Cell>| {
            let scenario = self.with_cell(cell).expect("invariant: loading has tried every cell");
            let scenario = if cell.policy.is_some() { scenario } else { scenario.under_policy(policy) };
            Variation { cell: Some(cell.name.as_str().to_owned()), scenario }
        };
        wanted.map(combined).collect()
    }

    /// The scenario `duration_s` long, on a link that loses a share of `loss` of its datagrams all along: a soak that shows the
    /// cost of the protection. It measures false trips, so they are expected. Values out of range are cut to it.
    pub fn soak(&self, duration_s: f64, loss: f64) -> Scenario {
        let mut scenario = self.clone();
        scenario.duration_s = Located::nowhere(Real::nearest(duration_s));
        scenario.conditions.loss = Located::nowhere(Real::nearest(loss));
        scenario.expected = Located::nowhere(List::from_first([Outcome::Nominal, Outcome::FalseTrip]));
        scenario
    }

    /// The scenario longer by `by_s`, in which operator and faults begin by as much later. Attacks on the links keep their
    /// times.
    pub fn later(&self, by_s: f64) -> Scenario {
        let mut scenario = self.clone();
        scenario.duration_s = Located::nowhere(Real::nearest(self.duration_s.get() + by_s));
        let steps = self.operator.step.iter().cloned();
        scenario.operator.step = List::from_first(
            steps.map(|step| Step { at_s: Located::nowhere(Real::nearest(step.at_s.get() + by_s)), ..step }),
        );
        let faults = self.fault.iter().cloned();
        scenario.fault = List::from_first(
            faults.map(|fault| Fault { at_s: Located::nowhere(Real::nearest(fault.at_s.get() + by_s)), ..fault }),
        );
        scenario
    }

    /// The scenario with `process` killed at a moment that the seed draws, while the platform is READY or holds authority.
    /// Where that is the broker, on which only commands depend, the operator then asks for a HOLD.
    pub fn killing(&self, process: Process, expected: &[Outcome]) -> Scenario {
        let mut scenario = self.clone();
        let located = |seconds: f64| Located::nowhere(Real::nearest(seconds));
        scenario.name = Located::nowhere(Name::constant("kill"));
        scenario.duration_s = Located::nowhere(Real::nearest(KILL_DURATION_S));
        scenario.varies.injection_phase_s = Located::nowhere(List::from_first(KILL_PHASE_S.map(Real::nearest)));
        scenario.kill =
            List::from_first([Kill { process, at_s: located(KILL_AT_S), ..Kill::new(process, Ending::Kill) }]);
        let hold = (process == Process::Broker).then(|| hold_at(HOLD_AT_S));
        scenario.operator.step = List::from_first(self.operator.step.iter().cloned().chain(hold));
        scenario.expected = Located::nowhere(List::from_first(expected.iter().copied()));
        scenario
    }

    /// The scenario with `process` stopped for `seconds` at a moment that the seed draws, as of a kill.
    pub fn hanging(&self, process: Process, seconds: f64) -> Scenario {
        let mut scenario = self.killing(process, &SAFE);
        let lasts = Kill { duration_s: Real::nearest(seconds), ending: Ending::Hang, ..scenario.kill[0].clone() };
        scenario.duration_s = Located::nowhere(Real::nearest(KILL_DURATION_S + seconds));
        scenario.kill = List::from_first([lasts]);
        scenario
    }

    /// The scenario with the broker killed within 50 ms before or after an operator's HOLD, at a moment that the seed draws.
    pub fn killing_broker_at_hold(&self) -> Scenario {
        let mut scenario = self.killing(Process::Broker, &SAFE);
        scenario.varies.injection_phase_s = Located::nowhere(List::from_first([0.0, 0.1].map(Real::nearest)));
        let at_s = Located::nowhere(Real::nearest(HOLD_AT_S - 0.05));
        scenario.kill = List::from_first([Kill { at_s, ..scenario.kill[0].clone() }]);
        scenario
    }

    /// The scenario with two processes killed, the second a given number of seconds after the first, from a moment that the seed draws.
    pub fn killing_both(&self, first: Process, second: Process, apart_s: f64) -> Scenario {
        let mut scenario = self.killing(first, &SAFE);
        let of_first = scenario.kill[0].clone();
        let at_s = Located::nowhere(Real::nearest(KILL_AT_S + apart_s));
        let second = Kill { process: second, at_s, ..of_first.clone() };
        scenario.kill = List::from_first([of_first, second]);
        scenario
    }

    /// The scenario on a link that loses a share of its datagrams and delays each by up to `jitter_ms`, all along; none for a
    /// jitter beyond a minute.
    pub fn on_a_bad_link(&self, loss: f64, jitter_ms: i64) -> Option<Scenario> {
        let mut scenario = self.clone();
        scenario.conditions.loss = Located::nowhere(Real::nearest(loss));
        scenario.conditions.jitter_ms = Located::nowhere(Whole::new(jitter_ms)?);
        scenario.expected = Located::nowhere(List::from_first(SAFE));
        Some(scenario)
    }

    /// Sets the expected classes.
    pub fn expect(&mut self, classes: impl IntoIterator<Item = Outcome>) {
        self.expected = Located::nowhere(List::from_first(classes));
    }

    /// The scenario expected INVALID: none of its evidence is believed.
    pub fn sabotaged(&self) -> Scenario {
        let mut scenario = self.clone();
        scenario.expected = Located::nowhere(List::from_first([Outcome::Invalid]));
        scenario
    }

    /// The scenario with `process` ended, hung or slowed when the unit under test changes from one mode to another. The
    /// scenario's faults are kept only where they cause that change, so that each planned one can arrive. Where the process is
    /// the broker, the operator then asks for a HOLD through it.
    pub fn ending_at(&self, process: Process, ending: Ending, (from, to): (Mode, Mode)) -> Scenario {
        let mut scenario = self.clone();
        let suspends = ending != Ending::Kill;
        let trigger = When { enters: Some(to), from: Some(from), ..When::default() };
        scenario.name = Located::nowhere(Name::constant("kill"));
        scenario.kill = List::from_first([Kill {
            duration_s: Real::nearest(if suspends { SUSPENDED_S } else { 0.0 }),
            quota: (ending == Ending::Slow).then(|| Located::nowhere(Real::nearest(SLOW_QUOTA))),
            period_ms: Whole::new(SLOW_PERIOD_MS).expect("invariant: within its range"),
            step: Some(Located::nowhere(Name::constant("end"))),
            when: Some(Located::nowhere(trigger)),
            ..Kill::new(process, ending)
        }]);
        // A change to or from DEGRADED has the scenario's faults as its cause; no other change has.
        if ![from, to].contains(&Mode::Degraded) {
            scenario.fault = List::default();
        }
        let hold = (process == Process::Broker).then(|| hold_at(LATE_HOLD_S));
        scenario.operator.step = List::from_first(self.operator.step.iter().cloned().chain(hold));
        let broken = [Outcome::Unsafe, Outcome::GuestFailed, Outcome::Invalid, Outcome::Late];
        scenario.expected =
            Located::nowhere(List::from_first(Outcome::ALL.into_iter().filter(|o| !broken.contains(o))));
        scenario
    }

    /// The scenario on another platform, in every cell with the classes that `[[under]]` expects there under the cell's policy. Where none are
    /// declared: the scenario's own if the platform owes those of the scenario's, else all but those of a failure ([`UNSTATED`]).
    #[must_use]
    pub fn on_platform(&self, platform: &Platform) -> Scenario {
        let mut scenario = self.clone();
        if *platform.name == *self.platform {
            return scenario;
        }
        scenario.platform = Located::nowhere(Name::clone(&platform.name));
        let exceptions = self.stated_on(platform);
        if exceptions.is_empty() && self.is_owed_by(platform) {
            return scenario;
        }
        let declared =
            |policy: Option<&Name>| exceptions.iter().find(|exception| exception.policy.as_deref() == policy);
        let none = || Located::nowhere(List::from_first(UNSTATED));
        scenario.expected = declared(None).map_or_else(none, |exception| exception.expected.clone());
        scenario.cell = List::from_first(self.cell.iter().map(|cell| {
            let mut cell = cell.clone();
            // A cell under its own policy expects what is declared for both, or nothing.
            cell.expected = cell
                .policy
                .clone()
                .map(|own_name| declared(Some(&own_name)).map_or_else(none, |exception| exception.expected.clone()));
            cell
        }));
        scenario.under = List::from_first(exceptions);
        scenario
    }

    /// True if this is another platform than the scenario's, which does not owe its classes, and of which the scenario states none.
    pub fn states_no_class_on(&self, platform: &Platform) -> bool {
        *platform.name != *self.platform && !self.is_owed_by(platform) && self.stated_on(platform).is_empty()
    }

    fn is_owed_by(&self, platform: &Platform) -> bool {
        platform.owes.as_ref().is_some_and(|name| **name == *self.platform)
    }

    /// Classes that `[[under]]` states of a platform.
    fn stated_on(&self, platform: &Platform) -> Vec<Under> {
        let applies = |exception: &&Under| exception.platform.as_ref().is_some_and(|name| **name == *platform.name);
        self.under.iter().filter(applies).map(|exception| Under { platform: None, ..exception.clone() }).collect()
    }

    fn under_policy(&self, policy: Option<&str>) -> Scenario {
        let mut scenario = self.clone();
        if let Some(policy) = policy.filter(|p| *p != self.policy.as_str()) {
            let applying = self.under.iter().filter(|exception| exception.platform.is_none());
            let declared =
                applying.into_iter().find(|exception| exception.policy.as_ref().is_some_and(|p| p.as_str() == policy));
            scenario.expected = match declared {
                Some(under) => under.expected.clone(),
                None => Located::nowhere(List::default()),
            };
            if let Ok(name) = Name::new(policy) {
                scenario.policy = Located::nowhere(name);
            }
        }
        scenario
    }

    /// The scenario with a cell's settings, policy and expected classes in force.
    ///
    /// # Errors
    /// The setting that does not fit, in words.
    pub(super) fn with_cell(&self, cell: &Cell) -> Result<Scenario, SettingsError> {
        let mut scenario = cell.set.applied_to(self)?;
        if let Some(policy) = &cell.policy {
            scenario.policy = Located::nowhere(policy.clone());
        }
        if let Some(expected) = &cell.expected {
            scenario.expected = expected.clone();
        }
        Ok(scenario)
    }
}

impl Variation {
    /// Its scenario with `settings` in force, checked as a cell of the file is.
    ///
    /// # Errors
    /// A path that leads nowhere, a value that does not fit there, or parts that no longer fit together, in words.
    pub fn with_settings(&self, settings: &Settings) -> Result<Scenario, SettingsError> {
        settings.applied_to(&self.scenario)?.fitting()
    }
}

impl Scenario {
    /// Itself, where it fits together as its own file would have to.
    ///
    /// # Errors
    /// The first mistake, in words.
    pub(super) fn fitting(self) -> Result<Scenario, SettingsError> {
        let mut as_file = self.clone();
        if as_file.expected.is_empty() {
            // A file has to expect a class; a scenario expects none under a policy that declares none.
            as_file.expect([Outcome::Nominal]);
        }
        match check::varied(&as_file).into_iter().next() {
            Some(finding) => Err(SettingsError::Unfit { message: finding.message }),
            None => Ok(self),
        }
    }
}

/// The operator asks for a HOLD then, in any displayed state.
fn hold_at(seconds: f64) -> Step {
    Step {
        at_s: Located::nowhere(Real::nearest(seconds)),
        within_s: Real::nearest(1.0),
        when_state: None,
        when_track: None,
        verb: Located::nowhere(Verb::Hold),
        values: None,
        who: None,
        after_s: None,
        window_s: Real::nearest(1.0),
        reason: None,
    }
}
