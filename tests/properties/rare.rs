//! The probability of what is rare: splitting in the twin agrees with plain Monte Carlo where that can still be measured.
//! Against an exactly known probability it is held where the splitting is, with a process of a few lines (`campaign::rare`).

use campaign::progress::{Progress, Stop, Talk};
use campaign::rare::{Event, Plan, Question, Repetition};
use campaign::stats::{Share, mean::Mean};
use holdsafe_tests::shipped;

/// The estimates of so many repetitions, and the trials of the first stage that got to its end.
fn ask(question: &Question, levels: &[f64], trials: u64, repetitions: u64) -> (Vec<f64>, u64) {
    let levels = question.event.ladder(levels).expect("levels that rise");
    let plan = Plan { levels, trials, repetitions, seed: 1 };
    let progress = Progress::new("", 0, Talk::Quiet);
    let all = question.ask(&plan, 2, &progress, &Stop::default()).expect("a shipped scenario runs");
    let reached = all.iter().map(|one| one.stages[0].reached).sum();
    (all.iter().map(Repetition::estimate).collect(), reached)
}

fn false_hold() -> Question {
    let nominal = shipped("nominal");
    Question { scenario: nominal.scenario.soak(9.0, 0.25), setup: nominal.setup, event: Event::HoldSafe }
}

#[test]
fn splitting_and_plain_monte_carlo_agree_on_false_holds_on_a_lossy_link() {
    let question = false_hold();
    let (_, hits) = ask(&question, &[], 100, 3);
    let plain = Share::of(hits, 300);
    let (estimates, _) = ask(&question, &[250.0, 350.0, 450.0], 60, 6);
    let [from, to] = Mean::of(&estimates).interval_95.expect("it happens");
    assert!(hits > 10, "too few to compare: {hits}");
    assert!(from < plain.upper_95 && plain.lower_95 < to, "{from} to {to}, plain {plain:?}");
}
