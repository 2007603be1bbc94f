//! All that the adversary and the world can do: the sequences over a shipped attack space, during a mission.

use evidence::ablation::Switch;
use scenario::{AttackSpace, Scenario, Setup};
use search::{RunConfig, Strategy};

/// Sequences of each attack space by default.
const CASES: u64 = 12;

/// A mission and its possible attacks.
pub(super) struct Transitions {
    pub(super) mission: Scenario,
    pub(super) setup: Setup,
    pub(super) space: AttackSpace,
    pub(super) run: RunConfig,
}

impl Transitions {
    /// Transitions of the shipped attack space of that name, during the null attack, under every check.
    pub(super) fn for_space(space: &str) -> Self {
        let file = holdsafe_tests::root().join("scenarios/spaces").join(format!("{space}.toml"));
        let space = AttackSpace::load(&file).expect("a shipped attack space");
        let ready = holdsafe_tests::shipped("nominal");
        let budget = std::env::var("HOLDSAFE_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(CASES);
        let run = RunConfig { strategy: Strategy::Guided, seed: 1, budget, first: true };
        Self { mission: ready.scenario, setup: ready.setup, space, run }
    }

    /// Transitions under every check but this one, and for much longer: it ends with the first finding, and a finding that
    /// takes two matching action types of twenty comes late.
    pub(super) fn without_check(mut self, check: &str) -> Self {
        self.run.budget *= 40;
        let switch = Switch::all().into_iter().find(|switch| switch.name() == check).expect("a check of a policy");
        switch.waive(&mut self.setup.policy);
        self
    }
}
