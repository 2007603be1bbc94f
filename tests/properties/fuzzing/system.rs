//! The system: the real cores in the twin, one seed, a word at a time; and a failure as something to act on.

use campaign::parallel;
use campaign::progress::{Progress, Stop, Talk};
use campaign::scenario::Name;
use campaign::search::{Cause, Found, Ground, Moments, Tried, Word};
use campaign::trial::Outcome;

use super::assertions::{ASSERTIONS, Case};
use super::reference::Reference;
use super::transitions::Transitions;

pub(super) struct System {
    ground: Ground,
    reference: Reference,
    moments: Moments,
}

impl System {
    /// Ready for what `transitions` allow.
    pub(super) fn new(transitions: &Transitions) -> Self {
        let Transitions { mission, setup, alphabet, .. } = transitions;
        let ground = Ground::new(mission.clone(), setup.clone(), 1, alphabet.clone()).expect("the mission runs");
        let nominal = ground.try_word(&Word::default()).expect("the mission runs");
        let moments = Moments::of(&nominal, alphabet, &setup.bounds);
        Self { reference: Reference::of(&nominal, &setup.bounds), ground, moments }
    }

    /// The first failure among the words of `transitions`, shrunk, in words; none where there is none.
    pub(super) fn first_failure(&self, transitions: &Transitions) -> Option<String> {
        let test = |tried: &Tried| self.broken(tried);
        let (progress, stop) =
            (Progress::new("fuzzing", transitions.quest.budget as usize, Talk::Quiet), Stop::default());
        let hunted = self.ground.hunt(transitions.quest, &test, parallel::cores(), &progress, &stop);
        let hunted = hunted.expect("every word fits the mission");
        let all = hunted.trials == transitions.quest.budget;
        assert!(all || !hunted.found.is_empty(), "{} words were tried", hunted.trials);
        hunted.found.iter().next().map(|(cause, found)| self.failure(cause, found, &test))
    }

    fn broken(&self, tried: &Tried) -> Option<Cause> {
        let case = Case { ground: &self.ground, reference: &self.reference, tried };
        let broken = ASSERTIONS.iter().find(|assertion| (assertion.holds)(&case.facts()).is_err())?;
        Some(Cause { outcome: tried.trial.outcome, broken: broken.name.to_owned() })
    }

    fn failure(&self, cause: &Cause, found: &Found, test: &(dyn Fn(&Tried) -> Option<Cause> + Sync)) -> String {
        let shrunk = self.ground.shrink(&found.tried.word, test, cause, &self.moments).expect("its subwords fit too");
        let tried = self.ground.try_word(&shrunk.word).expect("it was run before");
        let case = Case { ground: &self.ground, reference: &self.reference, tried: &tried };
        let assertion = ASSERTIONS.iter().find(|a| a.name == cause.broken).expect("one of them");
        let why = (assertion.holds)(&case.facts()).err().unwrap_or_default();
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
