//! One tried sequence: its trial, judged, and the values that a search keeps of it.

use std::sync::Arc;

use super::coverage::{self, Coverage};
use super::error::SearchError;
use super::sequence::{Action, AttackSequence};
use evidence::trial::{Outcome, Trial};
use oracle::{Approaches, Breach, Property, Verdict, judged};
use scenario::{AttackSpace, Scenario, SettingsError, Setup};
use serde::{Deserialize, Serialize};
use twin::part::baseline::Baseline;
use twin::trial::{baseline, conclude, start, start_following};

/// Longest run that is kept as a baseline, seconds. All its messages are in memory: a few megabytes a second where it
/// is rendered.
const LONGEST_BASELINE_S: f64 = 60.0;

/// Configuration of a search: a scenario and its setup, one seed, and the attack space.
#[derive(Clone)]
pub struct SearchConfig {
    /// The scenario without any sequence.
    pub scenario: Scenario,
    /// Its setup.
    pub setup: Setup,
    /// The seed of every trial: trials differ by their sequence alone.
    pub seed: u64,
    /// The attack space.
    pub space: AttackSpace,
    /// The baseline run without an attack: parts that a sequence does not reach are not computed again. `None` for a run
    /// that is too long to keep.
    baseline: Option<Arc<Baseline>>,
}

/// Cause of a finding: shrinking keeps it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Cause {
    /// The class that the oracle gave.
    pub outcome: Outcome,
    /// The broken property, by its name.
    pub broken: String,
}

/// Test of a trial: the cause where it is a finding.
pub type Test<'a> = &'a (dyn Fn(&Tried) -> Option<Cause> + Sync);

/// A trial is a finding when it ends in one of these classes.
pub fn ends_in(classes: &[Outcome]) -> impl Fn(&Tried) -> Option<Cause> + Sync + '_ {
    move |tried| {
        let broken = || tried.broken.map_or_else(|| "nothing".to_owned(), |property| format!("{property:?}"));
        let outcome = tried.trial.outcome;
        classes.contains(&outcome).then(|| Cause { outcome, broken: broken() })
    }
}

/// A sequence and its outcome.
#[derive(Clone, Debug)]
pub struct Tried {
    /// The sequence.
    pub sequence: AttackSequence,
    /// The judged trial.
    pub trial: Trial,
    /// The first property that was found broken, where one was.
    pub broken: Option<Property>,
    /// Its coverage.
    pub coverage: Coverage,
    /// Its approach to each limit.
    pub approaches: Approaches,
    /// Times at which the unit under test changed mode, milliseconds.
    pub changes_ms: Vec<u32>,
}

/// A tried sequence as the result of a search counts it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Counted {
    /// Class of its trial.
    pub outcome: Outcome,
    /// Its cause, if it is a finding.
    pub cause: Option<Cause>,
    /// Its coverage.
    pub covered: Coverage,
    /// Its approach to each limit; none if its attack did not arrive.
    pub approaches: Approaches,
    /// CPU time of the trial, seconds.
    pub cpu_seconds: f64,
}

impl Counted {
    pub(super) fn new(tried: &Tried, test: Test<'_>) -> Self {
        Self {
            outcome: tried.trial.outcome,
            cause: test(tried),
            covered: tried.coverage.clone(),
            approaches: tried.brought_near(),
            cpu_seconds: tried.trial.cpu_seconds,
        }
    }
}

impl Tried {
    /// Approach to each limit that the sequence caused: empty where its attack did not arrive.
    pub(super) fn brought_near(&self) -> Approaches {
        if self.trial.outcome == Outcome::Invalid { Approaches::new() } else { self.approaches.clone() }
    }
}

impl SearchConfig {
    /// Configuration for `scenario`, which is run once without any sequence.
    ///
    /// # Errors
    /// A scenario that cannot be run.
    pub fn new(scenario: Scenario, setup: Setup, seed: u64, space: AttackSpace) -> Result<Self, SearchError> {
        let empty_scenario = AttackSequence::default().in_scenario(&space, &scenario)?;
        let is_short = empty_scenario.duration_s.get() <= LONGEST_BASELINE_S;
        let baseline = is_short.then(|| baseline(&empty_scenario, &setup, seed).map(Arc::new)).transpose()?;
        Ok(Self { scenario, setup, seed, space, baseline })
    }

    /// Checks that each move of the attack space fits the scenario by itself, at its weakest and its strongest, as
    /// early as it may begin.
    ///
    /// # Errors
    /// The first move that does not fit, and the reason.
    pub fn fits(&self) -> Result<(), SearchError> {
        let (begins, _) = self.space.begins();
        for (kind, action_type) in self.space.moves.iter().enumerate() {
            for places in [vec![0; action_type.ranges().count()], action_type.strongest()] {
                let sequence = AttackSequence::new(vec![Action { begins, kind, places }]);
                sequence.in_scenario(&self.space, &self.scenario).map_err(|error| SearchError::ActionType {
                    kind: action_type.name.as_str().to_owned(),
                    space: self.space.name.as_str().to_owned(),
                    scenario: self.scenario.name.as_str().to_owned(),
                    error: Box::new(error),
                })?;
            }
        }
        Ok(())
    }

    /// The scenario of a found sequence, to be run until it no longer ends in one of the classes `found`; INVALID and
    /// UNSAFE are never fine. `reason` describes the finding.
    ///
    /// # Errors
    ///
    /// The action that does not fit.
    pub fn as_regression(
        &self,
        sequence: &AttackSequence,
        found: &[Outcome],
        reason: &str,
    ) -> Result<Scenario, SettingsError> {
        let mut scenario = sequence.in_scenario(&self.space, &self.scenario)?;
        let is_never =
            |outcome: &Outcome| found.contains(outcome) || matches!(outcome, Outcome::Invalid | Outcome::Unsafe);
        scenario.expect(Outcome::ALL.into_iter().filter(|outcome| !is_never(outcome)));
        let sequence = sequence.describe(&self.space);
        scenario.describe(
            &format!("Found: {sequence}"),
            &format!("Found by a search over attack space {}: {sequence}. {reason}", self.space.name.as_str()),
        );
        Ok(scenario)
    }

    /// Tries a sequence.
    ///
    /// # Errors
    /// An action that does not fit the scenario, or a scenario that cannot be run.
    pub fn try_sequence(&self, sequence: &AttackSequence) -> Result<Tried, SearchError> {
        let scenario = sequence.in_scenario(&self.space, &self.scenario)?;
        let before = link::clock::thread_cpu_us();
        let started = match &self.baseline {
            Some(baseline) => start_following(&scenario, &self.setup, self.seed, baseline),
            None => start(&scenario, &self.setup, self.seed, false),
        };
        let (topology, twin) = started?;
        let run = conclude(topology, twin, &self.setup);
        let mut trial = judged::trial(self.seed, scenario.level(), &run.evidence, &run.verdict);
        let approaches = oracle::approaches(&run.evidence);
        let coverage = coverage::measure(&run.evidence, &approaches);
        trial.cpu_seconds = link::clock::thread_cpu_us().saturating_sub(before) as f64 / 1e6;
        let changes_ms = trial.transitions.iter().map(|row| row.t_ms as u32).collect();
        Ok(Tried {
            sequence: sequence.clone(),
            trial,
            broken: first_broken(&run.verdict),
            coverage,
            approaches,
            changes_ms,
        })
    }
}

fn first_broken(verdict: &Verdict) -> Option<Property> {
    // A lack of evidence is no break by the platform.
    let breaks = |property: &Property| property.row().breach != Breach::NoEvidence;
    verdict.findings.iter().map(|finding| finding.property).find(breaks)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use scenario::{find_root, load};

    #[test]
    fn long_run_has_no_trunk_and_still_runs() {
        let root = find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
        let scenario = load(&root.join("scenarios/control/nominal.toml")).unwrap();
        let setup = Setup::load(&root, &scenario, None, false).unwrap();
        let space = AttackSpace::load(&root.join("scenarios/spaces/path.toml")).unwrap();
        let interval =
            |seconds: f64| SearchConfig::new(scenario.soak(seconds, 0.0), setup.clone(), 1, space.clone()).unwrap();
        let (short, long) = (interval(LONGEST_BASELINE_S), interval(LONGEST_BASELINE_S + 1.0));
        assert!(short.baseline.is_some() && long.baseline.is_none());
        assert_eq!(long.try_sequence(&AttackSequence::default()).unwrap().trial.outcome, Outcome::Nominal);
    }
}
