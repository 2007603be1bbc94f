//! Cells: one scenario, several variations, each with its policy and its own expected classes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Scenario;
use super::insider::{Forwarding, ThirdUnit};
use super::value::{List, Located, Name, Real};
use crate::trial::Outcome;

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
