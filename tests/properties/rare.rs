//! Probability of rare events: splitting in the twin agrees with plain Monte Carlo where that can still be measured. The
//! comparison with an exactly known probability stands beside the splitting, with a process of a few lines
//! (`search::rare`).

use ground_truth::{Any, Note};
use holdsafe_tests::shipped;
use parallel::progress::{Progress, Stop, Talk};
use recording::log::read_log;
use search::rare::{Event, Plan, Question, Repetition};
use stats::Share;
use stats::mean::Mean;
use twin::Twin;
use twin::trial::start;

/// The estimates of a given number of repetitions, and the trials of the first stage that got to its end.
fn ask(question: &Question, levels: &[f64], trials: u64, repetitions: u64) -> (Vec<f64>, u64) {
    let levels = question.event.ladder(levels).expect("levels that rise");
    let plan = Plan { levels, trials, repetitions, seed: 1 };
    let progress = Progress::new("", 0, Talk::Quiet);
    let one = |number| question.repeat(&plan, number, 2, &progress, &Stop::default()).expect("a shipped scenario runs");
    let all: Vec<Repetition> = (0..plan.repetitions).map(one).collect();
    let reached = all.iter().map(|one| one.stages[0].reached).sum();
    (all.iter().map(Repetition::estimate).collect(), reached)
}

fn false_hold() -> Question {
    let nominal = shipped("nominal");
    Question { scenario: nominal.scenario.soak(9.0, 0.25), setup: nominal.setup, event: Event::HoldSafe }
}

/// The event is a false hold on a lossy link.
#[test]
#[ignore = "long: thousands of trials"]
fn splitting_agrees_with_monte_carlo_on_holds() {
    let question = false_hold();
    let (_, hits) = ask(&question, &[], 100, 3);
    let plain = Share::new(hits, 300);
    let (estimates, _) = ask(&question, &[250.0, 350.0, 450.0], 60, 6);
    let [from, to] = Mean::from_values(&estimates).interval_95.expect("it happens");
    assert!(hits > 10, "too few to compare: {hits}");
    assert!(from < plain.upper_95 && plain.lower_95 < to, "{from} to {to}, plain {plain:?}");
}

fn flown(name: &str, until_s: u64) -> Twin {
    let ready = shipped(name);
    let (_, mut twin) = start(&ready.scenario, &ready.setup, 1, false).expect("a shipped scenario starts");
    twin.run_until(until_s * 1_000_000);
    twin
}

#[test]
fn lease_age_is_the_level_until_hold() {
    let (quiet, black) = (flown("nominal", 4), flown("loss", 8));
    assert!(Event::Lease.level(&quiet) < 200.0, "grants come every 100 ms: {}", Event::Lease.level(&quiet));
    assert_eq!(Event::HoldSafe.level(&quiet), Event::Lease.level(&quiet));
    assert!(Event::Lease.level(&black) > 2_000.0, "black since 5 s at the latest: {}", Event::Lease.level(&black));
    assert_eq!(Event::HoldSafe.level(&black), f64::INFINITY);
}

#[test]
fn distance_to_the_fence_is_the_true_one() {
    let twin = flown("nominal", 3);
    let margin = read_log(twin.log()).0.into_iter().rev().find_map(|witnessed| {
        if let Any::Instrument(Note::Truth { fence_mm, .. }) = witnessed.entry.event {
            Some(f64::from(fence_mm))
        } else {
            None
        }
    });
    let margin = margin.expect("the sim tells the truth ten times a second");
    // Between two entries it drives a third of a metre at most.
    assert!((Event::Fence.level(&twin) + margin).abs() < 350.0, "{margin} and {}", Event::Fence.level(&twin));
}
