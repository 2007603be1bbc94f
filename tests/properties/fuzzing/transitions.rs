//! All that the adversary and the world can do: the words over a shipped alphabet, during a mission.

use evidence::ablation::Switch;
use scenario::{Alphabet, Scenario, Setup};
use search::{RunConfig, Strategy};

/// Sequences of each attack space by default.
const CASES: u64 = 48;

/// A mission and its possible attacks.
pub(super) struct Transitions {
    pub(super) mission: Scenario,
    pub(super) setup: Setup,
    pub(super) alphabet: Alphabet,
    pub(super) quest: RunConfig,
}

impl Transitions {
    /// Of the shipped alphabet of that name, during the null attack, under every check.
    pub(super) fn of(alphabet: &str) -> Self {
        let file = holdsafe_tests::root().join("scenarios/alphabets").join(format!("{alphabet}.toml"));
        let alphabet = Alphabet::load(&file).expect("a shipped alphabet");
        let ready = holdsafe_tests::shipped("nominal");
        let budget = std::env::var("HOLDSAFE_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(CASES);
        let quest = RunConfig { strategy: Strategy::Guided, seed: 1, budget, first: true };
        Self { mission: ready.scenario, setup: ready.setup, alphabet, quest }
    }

    /// The same under every check but this one, and for much longer: it ends with the first finding, and a finding that takes
    /// two matching action types of twenty comes late.
    pub(super) fn without(mut self, check: &str) -> Self {
        self.quest.budget *= 40;
        let switch = Switch::all().into_iter().find(|switch| switch.name() == check).expect("a check of a policy");
        switch.waive(&mut self.setup.policy);
        self
    }
}
