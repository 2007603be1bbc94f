//! The system: the real cores in the twin, one seed, a word at a time; and a failure as something to act on.

use evidence::trial::Outcome;
use parallel::progress::{Progress, Stop, Talk};
use scenario::Name;
use search::{Action, AttackSequence, Cause, Found, Moments, RunResult, SearchConfig, Tried};

use super::assertions::{self, Assertion, Facts};
use super::deeds::Deeds;
use super::reference::{Change, Reference};
use super::transitions::Transitions;
use super::witness::Witness;

/// By how many ticks every silence of a word is made longer.
const LONGER: u32 = 50;

pub(super) struct System {
    ground: SearchConfig,
    reference: Reference,
    moments: Moments,
}

impl System {
    /// Ready for every sequence of `transitions`.
    pub(super) fn new(transitions: &Transitions) -> Self {
        let Transitions { mission, setup, alphabet, .. } = transitions;
        let ground = SearchConfig::new(mission.clone(), setup.clone(), 1, alphabet.clone()).expect("the mission runs");
        let nominal = ground.try_word(&AttackSequence::default()).expect("the mission runs");
        let moments = Moments::of(&nominal, alphabet, &setup.bounds);
        Self { reference: Reference::of(&nominal, &setup.bounds), ground, moments }
    }

    /// The first failure among the words of `transitions`, shrunk, in words; none where there is none.
    pub(super) fn first_failure(&self, transitions: &Transitions) -> Option<String> {
        let test = |tried: &Tried| self.broken(tried, assertions::all());
        let hunted = self.search(transitions, &test);
        hunted.found.iter().next().map(|(cause, found)| self.failure(cause, found, &test))
    }

    /// True if any of the words of `transitions` breaks this one assertion.
    pub(super) fn breaks(&self, transitions: &Transitions, assertion: &'static Assertion) -> bool {
        let test = |tried: &Tried| self.broken(tried, std::iter::once(assertion));
        !self.search(transitions, &test).found.is_empty()
    }

    fn search(&self, transitions: &Transitions, test: &(dyn Fn(&Tried) -> Option<Cause> + Sync)) -> RunResult {
        let budget = transitions.quest.budget;
        let (progress, stop) = (Progress::new("fuzzing", budget as usize, Talk::Quiet), Stop::default());
        let hunted = self.ground.search(transitions.quest, test, parallel::cores(), &progress, &stop);
        let hunted = hunted.expect("every word fits the mission");
        let all = hunted.trials == budget;
        assert!(all || !hunted.found.is_empty(), "{} words were tried", hunted.trials);
        hunted
    }

    fn broken(&self, tried: &Tried, mut of: impl Iterator<Item = &'static Assertion>) -> Option<Cause> {
        let facts = self.facts(tried);
        let broken = of.find(|assertion| (assertion.holds)(&facts).is_err())?;
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
            longer: self.longer(&tried.word),
            deeds: Deeds::of(&self.ground, &tried.word),
            witness: Witness::of(&self.ground, &tried.word),
            limits: self.reference.limits,
            duration_ms: trial.sim_seconds * 1000.0,
        }
    }

    /// The changes of mode when every silence lasts longer; `None` for a sequence with any other action.
    fn longer(&self, word: &AttackSequence) -> Option<Vec<Change>> {
        let silent = Deeds::of(&self.ground, word).only("path", &["cut", "cut-up", "cut-down"]);
        let longer = |letter: &Action| {
            let places = letter.places.iter().map(|place| place + LONGER).collect();
            Action { places, ..letter.clone() }
        };
        let longer = AttackSequence::new(word.letters().iter().map(longer).collect());
        silent.then(|| changes(&self.ground.try_word(&longer).expect("it fits as the shorter one does")))
    }

    fn failure(&self, cause: &Cause, found: &Found, test: &(dyn Fn(&Tried) -> Option<Cause> + Sync)) -> String {
        let shrunk = self.ground.shrink(&found.tried.word, test, cause, &self.moments).expect("its subwords fit too");
        let tried = self.ground.try_word(&shrunk.word).expect("it was run before");
        let assertion = assertions::all().find(|a| a.name == cause.broken).expect("one of them");
        let why = (assertion.holds)(&self.facts(&tried)).err().unwrap_or_default();
        let name = format!("fuzzed-{}", self.ground.alphabet.name.as_str());
        let found = [Outcome::Unsafe, Outcome::Late, cause.outcome];
        let scenario = self.ground.as_regression(&shrunk.word, &found, &why).expect("it fits");
        let text = scenario.to_file(&Name::new(&name).expect("a name")).expect("TOML");
        let file = std::env::temp_dir().join(format!("{name}.toml"));
        let kept = match std::fs::write(&file, &text) {
            Ok(()) => format!("{} (move it into tests/regressions/)", file.display()),
            Err(error) => format!("could not be kept: {error}\n{text}"),
        };
        format!(
            "{}: {why}\nword, shrunk: {}\n{:?} {:?}\nscenario: {kept}\nreproduce: holdsafe run {} --trials 1 --seed 1",
            assertion.name,
            shrunk.word.told(&self.ground.alphabet),
            tried.trial.outcome,
            tried.trial.findings,
            file.display(),
        )
    }
}

fn changes(tried: &Tried) -> Vec<Change> {
    tried.trial.transitions.iter().map(Change::of).collect()
}
