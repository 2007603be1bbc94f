//! Plans, their parts and their draws.

use serde_json::Value;

use super::example::plan;
use super::*;

#[test]
fn draws_depend_on_trial_and_variation_only() {
    let (one, more) = (plan(10), plan(1_000));
    assert_eq!(one.drawn(0, 3), more.drawn(0, 3));
    assert_ne!(one.drawn(0, 3), one.drawn(1, 3));
    assert_ne!(one.drawn(0, 3), one.drawn(0, 4));
    let mut other = plan(10);
    other.terms.seed = 6;
    // Seeds of one trial differ between campaigns of other seeds.
    assert_eq!(other.seed(4), one.seed(3));
    assert_ne!(other.drawn(0, 4), one.drawn(0, 3));
    // One more draw leaves the others as they were.
    let mut more = plan(10);
    more.terms.draws.insert("loss.0.share".into(), Distribution::Uniform(0.0, 1.0));
    assert_eq!(more.drawn(0, 3).iter().next(), one.drawn(0, 3).iter().next());
}

#[test]
fn differing_plans_name_expected_and_got() {
    let error_text = |change: &dyn Fn(&mut Plan)| {
        let mut other = plan(10);
        change(&mut other);
        plan(10).difference(&other).map(|difference| difference.to_string())
    };
    assert_eq!(error_text(&|_| {}), None);
    assert_eq!(error_text(&|p| p.terms.seed = 8).unwrap(), "seed: expected 7, got 8");
    assert_eq!(error_text(&|p| p.terms.trials = 11).unwrap(), "trials: expected 10, got 11");
    let program = error_text(&|p| p.terms.program = "other".into()).unwrap();
    assert!(program.starts_with("program (SHA-256 of its sources): expected ") && program.ends_with(", got other"));
    let scenario = error_text(&|p| p.variations[1].content.scenario = "z".into()).unwrap();
    assert_eq!(scenario, "scenario text of `loss @ loss.0.share=1.0`: expected a, got z");
    let policy = error_text(&|p| p.variations[0].content.policy = "z".into()).unwrap();
    assert_eq!(policy, "policy of `loss @ loss.0.share=0.5`: expected default b, got default z");
    assert!(
        error_text(&|p| p.variations[0].content.platform = "z".into()).unwrap().starts_with("platform or bounds of")
    );
    assert!(error_text(&|p| p.variations[0].expected.clear()).unwrap().starts_with("the rest of"));
    assert_eq!(error_text(&|p| p.variations.truncate(1)).unwrap(), "number of variations: expected 2, got 1");
    let claim = error_text(&|p| p.terms.claim = "unsafe<1%@95".parse().ok()).unwrap();
    assert_eq!(claim, "claim: expected none, got unsafe<1%@95");
    let draws = error_text(&|p| p.terms.draws.clear()).unwrap();
    assert_eq!(draws, "draws: expected loss.0.at_s=uniform:3:5, got none");
}

#[test]
fn digest_covers_all_but_the_program() {
    let digest = |change: &dyn Fn(&mut Plan)| {
        let mut plan = plan(10);
        change(&mut plan);
        plan.digest()
    };
    let same = digest(&|_| {});
    assert_eq!(digest(&|p| p.terms.program = "other".into()), same);
    assert_ne!(digest(&|p| p.terms.sequential = true), same);
    assert_ne!(digest(&|p| p.variations[1].content.platform = "z".into()), same);
    let mut odd = plan(10);
    odd.variations[0].set = Settings::one("loss.0.share", Value::from(0.1 + 0.2));
    let repeated: Plan = serde_json::from_str(&serde_json::to_string(&odd).unwrap()).unwrap();
    assert_eq!((repeated.digest(), repeated), (odd.digest(), odd));
}

#[test]
fn sequential_variation_ends_at_the_deciding_look() {
    let mut plan = plan(1_000);
    (plan.terms.claim, plan.terms.sequential) = ("unsafe<10%@95".parse().ok(), true);
    let clean = |_| Some(Outcome::HoldSafe);
    assert_eq!(plan.wanted(0, clean), LOOK, "35 clean trials would do, the next look is at 50");
    let broken = |n| Some(if n % 2 == 0 { Outcome::Unsafe } else { Outcome::HoldSafe });
    assert_eq!(plan.wanted(1, broken), LOOK);
    let near = |n| Some(if n % 10 == 0 { Outcome::Unsafe } else { Outcome::HoldSafe });
    assert_eq!(plan.wanted(0, near), 1_000, "never decided");
    let some = |n| (n < 60).then_some(if n % 10 == 0 { Outcome::Unsafe } else { Outcome::HoldSafe });
    assert_eq!(plan.wanted(0, some), 2 * LOOK, "the trials of the next look are wanted");
    plan.terms.sequential = false;
    assert_eq!(plan.wanted(0, clean), 1_000);
}
