//! The system: the real cores in the twin, one seed, a sequence at a time; and a failure as something to act on.

use evidence::trial::Outcome;
use parallel::progress::{Progress, Stop, Talk};
use scenario::Name;
use search::{Action, AttackSequence, Cause, FoundSequence, Moments, RunResult, SearchConfig, Tried};

use super::assertions::{self, Assertion, Facts};
use super::deeds::Deeds;
use super::reference::{Change, Reference};
use super::transitions::Transitions;
use super::witness::Witness;

/// Ticks by which every silence of a sequence is made longer.
const LONGER: u32 = 50;

pub(super) struct System {
    config: SearchConfig,
    reference: Reference,
    moments: Moments,
}

impl System {
    /// Ready for every sequence of `transitions`.
    pub(super) fn new(transitions: &Transitions) -> Self {
        let Transitions { mission, setup, space, .. } = transitions;
        let config = SearchConfig::new(mission.clone(), setup.clone(), 1, space.clone()).expect("the mission runs");
        let nominal = config.try_sequence(&AttackSequence::default()).expect("the mission runs");
        let moments = Moments::from_run(&nominal, space, &setup.bounds);
        Self { reference: Reference::from_nominal(&nominal, &setup.bounds), config, moments }
    }

    /// Description of the first failure among the sequences of `transitions`, shrunk; `None` if all hold.
    pub(super) fn first_failure(&self, transitions: &Transitions) -> Option<String> {
        let test = |tried: &Tried| self.broken(tried, assertions::all());
        let result = self.search(transitions, &test);
        result.found.iter().next().map(|(cause, found)| self.failure(cause, found, &test))
    }

    /// True if any of the sequences of `transitions` breaks this one assertion.
    pub(super) fn breaks(&self, transitions: &Transitions, assertion: &'static Assertion) -> bool {
        let test = |tried: &Tried| self.broken(tried, std::iter::once(assertion));
        !self.search(transitions, &test).found.is_empty()
    }

    fn search(&self, transitions: &Transitions, test: &(dyn Fn(&Tried) -> Option<Cause> + Sync)) -> RunResult {
        let budget = transitions.run.budget;
        let (progress, stop) = (Progress::new("fuzzing", budget as usize, Talk::Quiet), Stop::default());
        let result = self.config.search(transitions.run, None, test, parallel::cores(), &progress, &stop);
        let result = result.expect("every sequence fits the mission");
        let all = result.trials == budget;
        assert!(all || !result.found.is_empty(), "{} sequences were tried", result.trials);
        result
    }

    fn broken(&self, tried: &Tried, mut assertions: impl Iterator<Item = &'static Assertion>) -> Option<Cause> {
        let facts = self.facts(tried);
        let broken = assertions.find(|assertion| (assertion.holds)(&facts).is_err())?;
        Some(Cause { outcome: tried.trial.outcome, broken: broken.name.to_owned() })
    }

    /// Input of the assertions.
    fn facts(&self, tried: &Tried) -> Facts {
        let trial = &tried.trial;
        Facts {
            findings: trial.findings.clone(),
            decisions: trial.decision_hash.clone(),
            changes: changes(tried),
            mission: self.reference.changes.clone(),
            longer: self.longer(&tried.sequence),
            deeds: Deeds::from_sequence(&self.config, &tried.sequence),
            witness: Witness::from_sequence(&self.config, &tried.sequence),
            limits: self.reference.limits,
            duration_ms: trial.sim_seconds * 1000.0,
        }
    }

    /// The changes of mode when every silence lasts longer; `None` for a sequence with any other action.
    fn longer(&self, sequence: &AttackSequence) -> Option<Vec<Change>> {
        let silent = Deeds::from_sequence(&self.config, sequence).only("path", &["cut", "cut-up", "cut-down"]);
        let longer = |action: &Action| {
            let places = action.places.iter().map(|place| place + LONGER).collect();
            Action { places, ..action.clone() }
        };
        let longer = AttackSequence::new(sequence.actions().iter().map(longer).collect());
        silent.then(|| changes(&self.config.try_sequence(&longer).expect("it fits as the shorter one does")))
    }

    fn failure(&self, cause: &Cause, found: &FoundSequence, test: &(dyn Fn(&Tried) -> Option<Cause> + Sync)) -> String {
        let shrunk = self.config.shrink(&found.sequence, test, cause, &self.moments).expect("its subsequences fit too");
        let tried = self.config.try_sequence(&shrunk.sequence).expect("it was run before");
        let assertion = assertions::all().find(|a| a.name == cause.broken).expect("one of them");
        let reason = (assertion.holds)(&self.facts(&tried)).err().unwrap_or_default();
        let name = format!("fuzzed-{}", self.config.space.name.as_str());
        let found = [Outcome::Unsafe, Outcome::Late, cause.outcome];
        let scenario = self.config.as_regression(&shrunk.sequence, &found, &reason).expect("it fits");
        let text = scenario.to_file(&Name::new(&name).expect("a name")).expect("TOML");
        let file = std::env::temp_dir().join(format!("{name}.toml"));
        let saved = match std::fs::write(&file, &text) {
            Ok(()) => format!("{} (move it into tests/regressions/)", file.display()),
            Err(error) => format!("could not be kept: {error}\n{text}"),
        };
        format!(
            "{}: {reason}\nword, shrunk: {}\n{:?} {:?}\nscenario: {saved}\nreproduce: holdsafe run {} --trials 1 --seed 1",
            assertion.name,
            shrunk.sequence.describe(&self.config.space),
            tried.trial.outcome,
            tried.trial.findings,
            file.display(),
        )
    }
}

fn changes(tried: &Tried) -> Vec<Change> {
    tried.trial.transitions.iter().map(Change::from_row).collect()
}
