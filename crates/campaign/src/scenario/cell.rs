//! Cells: one scenario, several variations, each with its policy and its own expected classes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Scenario;
use super::fault::{Ending, Kill, Process};
use super::insider::{Forwarding, ThirdUnit};
use super::operator::{Step, Verb};
use super::value::{List, Located, Name, Real};
use crate::trial::Outcome;

/// When a process is killed at the earliest, seconds: authority is held by then, also where arming took a second try.
const KILL_AT_S: f64 = 3.6;
/// By how much later at most: before and after the act, and while the unit still drives.
const KILL_PHASE_S: [f64; 2] = [0.0, 2.4];
/// When the operator asks for a HOLD through a dead broker, seconds: after the latest kill, while the unit still drives.
const HOLD_AT_S: f64 = 6.2;
/// Length of a kill's trial, seconds: unused authority has expired and the plant stands.
const KILL_DURATION_S: f64 = 10.5;

/// One cell of the teammate table: what the forwarding is set to, under which policy, and what must come of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// Replaces `form` of the scenario's `[[teammate]]`.
    pub form: Forwarding,
    /// Replaces `c` of the scenario's `[[teammate]]`.
    pub c: ThirdUnit,
    /// Replaces the scenario's policy.
    pub policy: Name,
    /// Replaces the scenario's expected classes.
    pub expected: Located<List<Outcome, 9>>,
}

/// Expected classes under another policy than the scenario's own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Under {
    /// The policy.
    pub policy: Located<Name>,
    /// What must come of it.
    pub expected: Located<List<Outcome, 9>>,
}

/// A scenario with one cell's settings in force.
#[derive(Clone, Debug)]
pub struct Variation {
    /// `verbatim/present/session-only`, or nothing where the scenario has no cells.
    pub cell: Option<String>,
    /// The scenario as it is to be run; its policy and expected classes are the cell's.
    pub scenario: Scenario,
}

impl Scenario {
    /// Every variation, in the order of the file. With `policy` given, only those under it: the cells that name it,
    /// or the one plain variation with the classes that `[[under]]` expects (none where nothing is declared, so that
    /// no class counts as unexpected).
    pub fn variations(&self, policy: Option<&str>) -> Vec<Variation> {
        if self.cell.is_empty() {
            return vec![Variation { cell: None, scenario: self.under(policy) }];
        }
        let wanted = |cell: &&Located<Cell>| policy.is_none_or(|p| cell.policy.as_str() == p);
        self.cell.iter().filter(wanted).map(|cell| self.with(cell)).collect()
    }

    /// The same scenario, `duration_s` long, on a link that loses a share of `loss` of its datagrams all along: a soak that
    /// shows what the protection costs. False trips are what it measures, so they are expected. Values out of range are
    /// cut to it.
    pub fn soak(&self, duration_s: f64, loss: f64) -> Scenario {
        let mut scenario = self.clone();
        scenario.duration_s = Located::nowhere(Real::nearest(duration_s));
        scenario.conditions.loss = Located::nowhere(Real::nearest(loss));
        scenario.expected = Located::nowhere(List::of([Outcome::Nominal, Outcome::FalseTrip]));
        scenario
    }

    /// The same scenario with `process` killed at a moment that the seed draws, while the platform is READY or holds
    /// authority. Where that is the broker, which nothing but commands depends on, the operator then asks for a HOLD.
    pub fn killing(&self, process: Process, expected: &[Outcome]) -> Scenario {
        let mut scenario = self.clone();
        let at = |seconds: f64| Located::nowhere(Real::nearest(seconds));
        scenario.name = Located::nowhere(Name::constant("kill"));
        scenario.duration_s = Located::nowhere(Real::nearest(KILL_DURATION_S));
        scenario.varies.injection_phase_s = Located::nowhere(List::of(KILL_PHASE_S.map(Real::nearest)));
        scenario.kill = List::of([Kill { process, ending: Ending::Kill, at_s: at(KILL_AT_S) }]);
        let hold = Step {
            at_s: at(HOLD_AT_S),
            within_s: Real::nearest(1.0),
            when_state: None,
            when_track: None,
            verb: Located::nowhere(Verb::Hold),
            reason: None,
        };
        let hold = (process == Process::Broker).then_some(hold);
        scenario.operator.step = List::of(self.operator.step.iter().cloned().chain(hold));
        scenario.expected = Located::nowhere(List::of(expected.iter().copied()));
        scenario
    }

    fn under(&self, policy: Option<&str>) -> Scenario {
        let mut scenario = self.clone();
        if let Some(policy) = policy.filter(|p| *p != self.policy.as_str()) {
            let declared = self.under.iter().find(|under| under.policy.as_str() == policy);
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

    fn with(&self, cell: &Cell) -> Variation {
        let mut scenario = self.clone();
        scenario.teammate.set_each(|teammate| {
            teammate.form = cell.form;
            teammate.c = cell.c;
        });
        scenario.policy = Located::nowhere(cell.policy.clone());
        scenario.expected = cell.expected.clone();
        Variation { cell: Some(cell.label()), scenario }
    }
}

impl Cell {
    /// `verbatim/present/session-only`.
    pub fn label(&self) -> String {
        let form = match self.form {
            Forwarding::Verbatim => "verbatim",
            Forwarding::Relabelled => "relabelled",
            Forwarding::ReSigned => "re-signed",
        };
        let c = match self.c {
            ThirdUnit::Present => "present",
            ThirdUnit::Silent => "silent",
        };
        format!("{form}/{c}/{}", self.policy)
    }
}
