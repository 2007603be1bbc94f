//! Finding and shrinking beside proptest: the same weaknesses, sequences of the same attack spaces, the same trials.
//!
//! Run with `cargo bench --bench search`. Proptest draws every action evenly (move, moment and numbers), as uniform drawing does,
//! and shrinks what failed in its own way; `holdsafe` searches with guided drawing and shrinks to the canonical sequence. Seeds
//! alternate, so that both see the same machine. Shown are medians over the seeds, and how many different answers there were.

#![expect(clippy::disallowed_methods, reason = "a bench measures wall time")]

use std::cell::Cell;
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Instant;

use parallel::progress::{Progress, Stop, Talk};
use proptest::collection::vec;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestError, TestRng, TestRunner};
use scenario::{AttackSpace, Setup, Weakness, Weaknesses};
use search::{Action, AttackSequence, Cause, Moments, RunConfig, SearchConfig, Strategy, Test, ends_in};

/// Weaknesses of the shipped lists: one action at any time, one at a certain time, two actions.
const WEAKNESSES: [&str; 3] = ["freshness-path", "late-path", "jump-stations"];
const SEEDS: u64 = 20;
/// Most trials until the first failure, and most to shrink it.
const BUDGET: u32 = 2_000;

fn main() {
    let root = scenario::find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).expect("the workspace");
    println!(
        "median trials to find / to shrink / milliseconds of both; letters of the answers; different answers; not found"
    );
    for name in WEAKNESSES {
        let weakness = listed(&root, name);
        let config = config(&root, &weakness);
        let (mut direct, mut external) = (Vec::new(), Vec::new());
        for seed in 1..=SEEDS {
            direct.push(timed(|| holdsafe(&config, &weakness, seed)));
            external.push(timed(|| proptest(&config, &weakness, seed)));
        }
        println!(
            "{name:16} holdsafe {}\n{:16} proptest {}",
            report_text(&config, &direct),
            "",
            report_text(&config, &external)
        );
    }
}

/// What one seed came to.
struct Answer {
    sequence: AttackSequence,
    found: u64,
    shrunk: u64,
}

type Timed = (Option<Answer>, f64);

fn timed(run: impl FnOnce() -> Option<Answer>) -> Timed {
    let before = Instant::now();
    let answer = run();
    (answer, before.elapsed().as_secs_f64() * 1e3)
}

fn listed(root: &Path, name: &str) -> Weakness {
    let list = Weaknesses::load(&root.join("scenarios/weaknesses/checks.toml")).expect("a valid list");
    list.weakness.iter().find(|weakness| weakness.name.as_str() == name).expect("it is listed").clone()
}

fn config(root: &Path, weakness: &Weakness) -> SearchConfig {
    let file = scenario::find(root, weakness.scenario.as_str()).expect("a shipped scenario");
    let scenario = scenario::load(&file).expect("a valid scenario");
    let mut setup = Setup::load(root, &scenario, None, false).expect("its setup");
    weakness.waive.iter().for_each(|check| check.waive(&mut setup.policy));
    let space = AttackSpace::load(&root.join(format!("scenarios/spaces/{}.toml", weakness.space.as_str())))
        .expect("a valid attack space");
    SearchConfig::new(scenario, setup, 1, space).expect("it runs")
}

fn holdsafe(config: &SearchConfig, weakness: &Weakness, seed: u64) -> Option<Answer> {
    let test = ends_in(&weakness.find);
    let run = RunConfig { strategy: Strategy::Guided, seed, budget: u64::from(BUDGET), first: true };
    let result =
        config.search(run, None, &test, 1, &Progress::new("", 0, Talk::Quiet), &Stop::default()).expect("it runs");
    let nominal = config.try_sequence(&AttackSequence::default()).expect("it runs");
    let moments = Moments::from_run(&nominal, &config.space, &config.setup.bounds);
    let (cause, found) = result.found.into_iter().next()?;
    let shrunk = config.shrink(&found.sequence, &test, &cause, &moments).expect("it runs");
    Some(Answer { sequence: shrunk.sequence, found: found.trial, shrunk: shrunk.executions })
}

fn proptest(config: &SearchConfig, weakness: &Weakness, seed: u64) -> Option<Answer> {
    let space = &config.space;
    let (first, last) = space.begins();
    // A number is a share of its range, so that one strategy serves every move and shrinks each number towards its weakest.
    let action = (first..=last, 0..space.moves.len(), proptest::array::uniform3(0..=u16::MAX));
    let sequences = vec(action, 1..=space.longest.unsigned() as usize);
    let sequence = |drawn: Vec<(u32, usize, [u16; 3])>| {
        let action = |(begins, kind, shares): (u32, usize, [u16; 3])| {
            let ranges = space.moves[kind].ranges().zip(shares);
            let place = |(range, share): (&scenario::Range, u16)| {
                ((u64::from(share) * u64::from(range.last() + 1)) >> 16) as u32
            };
            Action { begins, kind, places: ranges.map(place).collect() }
        };
        AttackSequence::new(drawn.into_iter().map(action).collect())
    };
    let (tried, failed, test) = (Cell::new(0), Cell::new(0), ends_in(&weakness.find));
    let test: Test<'_> = &test;
    let cause: Cell<Option<Cause>> = Cell::new(None);
    let limits = Config { cases: BUDGET, max_shrink_iters: BUDGET, failure_persistence: None, ..Config::default() };
    let mut bytes = [0; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    let mut runner = TestRunner::new_with_rng(limits, TestRng::from_seed(RngAlgorithm::ChaCha, &bytes));
    let outcome = runner.run(&sequences, |drawn| {
        tried.set(tried.get() + 1);
        let seen = test(&config.try_sequence(&sequence(drawn)).expect("it runs"));
        let first = cause.take();
        // As ours: what is shrunk keeps the cause that was found.
        let holds = seen.is_some() && (first.is_none() || first == seen);
        if failed.get() == 0 && holds {
            failed.set(tried.get());
        }
        cause.set(first.or(seen));
        if holds { Err(TestCaseError::fail("found")) } else { Ok(()) }
    });
    match outcome {
        Err(TestError::Fail(_, drawn)) => {
            Some(Answer { sequence: sequence(drawn), found: failed.get(), shrunk: tried.get() - failed.get() })
        }
        Ok(()) | Err(TestError::Abort(_)) => None,
    }
}

fn report_text(config: &SearchConfig, all: &[Timed]) -> String {
    let answers: Vec<(&Answer, f64)> = all.iter().filter_map(|(answer, ms)| Some((answer.as_ref()?, *ms))).collect();
    let median = |value_of: &dyn Fn(&(&Answer, f64)) -> f64| {
        let mut values: Vec<f64> = answers.iter().map(value_of).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
    };
    let different: BTreeSet<String> =
        answers.iter().map(|(answer, _)| answer.sequence.describe(&config.space)).collect();
    let actions: BTreeSet<usize> = answers.iter().map(|(answer, _)| answer.sequence.actions().len()).collect();
    format!(
        "{:5.0} / {:4.0} / {:6.0} ms; {actions:?} actions; {} different of {}; {} not found",
        median(&|(answer, _)| answer.found as f64),
        median(&|(answer, _)| answer.shrunk as f64),
        median(&|(_, ms)| *ms),
        different.len(),
        answers.len(),
        all.len() - answers.len(),
    )
}
