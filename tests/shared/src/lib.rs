//! Shared code of the test binaries: the shipped scenarios, run in the twin; and the promises of every parser.

pub mod parsers;

use std::path::{Path, PathBuf};

use evidence::trial::Outcome;
use scenario::{Scenario, Setup};
use topology::needs_rendering;
use twin::trial::{Run, conclude, start};

/// The workspace.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("the workspace is there")
}

/// A variation of a shipped scenario, ready to run.
pub struct Ready {
    /// Its cell, for scenarios that have cells.
    pub cell: Option<String>,
    /// The scenario.
    pub scenario: Scenario,
    /// Policy, bounds, platform.
    pub setup: Setup,
}

impl Ready {
    /// Runs it in the twin.
    pub fn run(&self, seed: u64) -> Run {
        let (topology, twin) = start(&self.scenario, &self.setup, seed, false).expect("a shipped scenario starts");
        conclude(topology, twin, &self.setup)
    }

    /// Runs it over `seeds` and demands an expected class each time; gives the runs.
    pub fn expect(&self, seeds: std::ops::Range<u64>) -> Vec<Run> {
        let expected: Vec<Outcome> = self.scenario.expected.iter().copied().collect();
        let runs = seeds.map(|seed| (seed, self.run(seed)));
        runs.map(|(seed, run)| {
            let name = self.scenario.name.as_str();
            let outcome = run.verdict.outcome;
            assert!(
                expected.contains(&outcome),
                "{name} {:?} seed {seed}: {outcome:?}, expected {expected:?}; findings {:?}; transitions {:?}",
                self.cell,
                run.verdict.findings,
                run.verdict.transitions,
            );
            run
        })
        .collect()
    }
}

/// Every variation of the shipped scenario `name`, unrendered.
pub fn variations(name: &str) -> Vec<Ready> {
    let root = root();
    let file = scenario::find(&root, name).expect("a shipped scenario");
    let scenario = scenario::load(&file).expect("a shipped scenario loads");
    scenario
        .variations(None)
        .into_iter()
        .map(|v| {
            let rendered = needs_rendering(&v.scenario).is_some();
            let setup = Setup::load(&root, &v.scenario, None, rendered).expect("its policy and platform load");
            Ready { cell: v.cell, scenario: v.scenario, setup }
        })
        .collect()
}

/// The one variation of a scenario without cells.
pub fn shipped(name: &str) -> Ready {
    variations(name).into_iter().next().expect("at least one variation")
}

/// The one variation of a scenario without cells, with rendered sensors and the shipped detector, as live.
pub fn rendered(name: &str) -> Ready {
    let mut ready = shipped(name);
    ready.setup = Setup::load(&root(), &ready.scenario, None, true).expect("its policy and platform load");
    ready
}

/// The scenario in a file of any place, under the policy that it names.
pub fn file(path: &Path) -> Ready {
    let scenario = scenario::load(path).expect("the scenario loads");
    let setup = Setup::load(&root(), &scenario, None, false).expect("its policy and platform load");
    Ready { cell: None, scenario, setup }
}

/// The scenario under another shipped policy, with no class expected.
pub fn with_policy(name: &str, policy: &str) -> Ready {
    let root = root();
    let mut ready = shipped(name);
    let file = root.join("policies").join(format!("{policy}.toml"));
    ready.setup = Setup::load(&root, &ready.scenario, Some(&file), false).expect("its policy and platform load");
    ready
}

/// Every variation of the shipped scenario `name` on another shipped platform, with the classes that it states there.
pub fn on_platform(name: &str, platform: &str) -> Vec<Ready> {
    let root = root();
    let file = scenario::find(&root, name).expect("a shipped scenario");
    let platform = root.join("platforms").join(format!("{platform}.toml"));
    let platform = scenario::load_platform(&platform).expect("a shipped platform loads");
    let scenario = scenario::load(&file).expect("a shipped scenario loads").on_platform(&platform);
    let ready = |v: scenario::Variation| {
        let setup = Setup::load(&root, &v.scenario, None, false).expect("its policy and platform load");
        Ready { cell: v.cell, scenario: v.scenario, setup }
    };
    scenario.variations(None).into_iter().map(ready).collect()
}
