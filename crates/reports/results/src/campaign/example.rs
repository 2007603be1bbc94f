//! A plan with invented terms, for tests of plan consumers.

use std::collections::BTreeMap;

use evidence::trial::Outcome;
use scenario::Settings;
use serde_json::Value;

use super::draw::Distribution;
use super::{InputDigest, PLAN_VERSION, Plan, PlanVariation, Terms};
use crate::mode::Mode;

/// Two variations of `trials` each, with one draw and no claim.
pub fn plan(trials: u64) -> Plan {
    let content = InputDigest { scenario: "a".into(), policy: "b".into(), platform: "c".into() };
    let variation = |share: f64| PlanVariation {
        scenario: "loss".into(),
        cell: None,
        set: Settings::one("loss.0.share", Value::from(share)),
        policy: "default".into(),
        watermark: None,
        mode: Mode::Twin,
        counts: true,
        expected: vec![Outcome::HoldSafe],
        content: content.clone(),
    };
    let terms = Terms {
        plan_version: PLAN_VERSION,
        program: "0".repeat(64),
        seed: 7,
        trials,
        rendered: false,
        policy: None,
        guest: None,
        claim: None,
        sequential: false,
        draws: BTreeMap::from([("loss.0.at_s".into(), Distribution::Uniform(3.0, 5.0))]),
    };
    Plan { terms, variations: vec![variation(0.5), variation(1.0)] }
}
