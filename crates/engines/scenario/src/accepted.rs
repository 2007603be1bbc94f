//! A class outside the expected ones that is accepted below a stated rate.

use evidence::trial::Outcome;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Scenario;
use super::finding::{Finding, finding};
use super::value::{Located, Real};

/// A class outside the expected ones, accepted below a rate that is stated before the run. Trials refute it where they show a rate of at
/// least that much, by an exact test; until then a trial of the class is no unexpected one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Accepted {
    /// The class.
    pub class: Located<Outcome>,
    /// Its rate is below this much, percent of the trials.
    pub below_percent: Real<10, 10_000>,
}

/// Mistakes in the accepted classes: one is there twice, or is never accepted.
pub(super) fn check(s: &Scenario) -> Vec<Finding> {
    let each = s.accepted.iter().enumerate().filter_map(|(n, accepted)| {
        let class = *accepted.class;
        let wrong = |message: &str, remedy: &str| Some(finding(&accepted.class, message, remedy));
        if s.accepted[..n].iter().any(|before| *before.class == class) {
            wrong("accepted twice", "keep one")
        } else if class == Outcome::Unsafe {
            wrong("no rate of UNSAFE is accepted", "take it out; `--claim` tests a rate")
        } else {
            None
        }
    });
    each.collect()
}
