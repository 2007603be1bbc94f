//! The object of `holdsafe campaign`: a row a variation, counts, exact bounds, latencies and the verdict on the claim.
//!
//! A bound for a fixed number of trials, or a claim on it, is given of a complete campaign only. In a sequential one the bounds are
//! those that hold at every look, so each variation has them from its first complete look on, with trials missing too. Variations share
//! their seeds, so they are not independent and n is never added over them.

mod table;

use std::collections::{BTreeMap, BTreeSet};

use evidence::SCHEMA_VERSION;
use evidence::trial::{Outcome, Outcomes};
use scenario::Evidence;
use serde::{Deserialize, Serialize};
use stats::{LEVEL, Share, rate_upper, simultaneous_level};

use super::run::LatencySummary;
use crate::campaign::claim::{ClaimVerdict, JudgedClaim, LOOK, Tally};
use crate::campaign::row::TrialRow;
use crate::campaign::{Plan, PlanVariation, Terms};
pub use table::campaign_table;

/// A campaign's result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CampaignObject {
    /// Version of this object.
    pub schema_version: u32,
    /// SHA-256 over the plan and, by variation and seed, each trial's draws and outcome.
    pub hash: String,
    /// True if every trial that belongs to it is in it.
    pub complete: bool,
    /// Trials in it.
    pub trials: u64,
    /// Trials that belong to it.
    pub planned: u64,
    /// SHA-256 over the plan.
    pub plan: String,
    /// Terms shared by all trials.
    pub terms: Terms,
    /// Variations by verdict on the claim; `None` without a claim or where trials are missing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub claim: Option<ClaimVerdicts>,
    /// A row a variation.
    pub rows: Vec<CampaignRow>,
}

/// Verdicts on a claim over all variations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ClaimVerdicts {
    /// Variations for which the claim is shown.
    pub shown: usize,
    /// Variations for which the claim is refuted.
    pub refuted: usize,
    /// Variations for which the claim is undecided.
    pub open: usize,
    /// True if it is shown for all of them together (Bonferroni).
    pub shown_together: bool,
}

/// One variation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CampaignRow {
    /// Its number, from 0.
    pub variation: usize,
    /// Scenario.
    pub scenario: String,
    /// Cell, where it has any.
    pub cell: Option<String>,
    /// Settings of the grid.
    pub set: scenario::Settings,
    /// Policy.
    pub policy: String,
    /// Reason for which this is an ablation, where it is one.
    pub watermark: Option<String>,
    /// Origin of its evidence.
    pub evidence: Evidence,
    /// True if the scenario's mechanism really runs there.
    pub counts: bool,
    /// The classes that were expected.
    pub expected: Vec<Outcome>,
    /// Trials in it.
    pub n: u64,
    /// Trials that belong to it.
    pub planned: u64,
    /// Count of each class.
    pub outcomes: Outcomes,
    /// Trials outside the expected classes.
    pub unexpected: u64,
    /// The line that runs the first of these again.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reproduce: Option<String>,
    /// Bounds for a fixed number of trials.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bounds: Option<RateBounds>,
    /// Verdict on the claim.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub claim: Option<ClaimRow>,
    /// Latencies.
    pub latency_ms: LatencySummary,
    /// Different decision hashes.
    pub distinct_decisions: usize,
    /// Records accepted, all its trials together.
    pub accepted: u64,
    /// Records refused.
    pub refused: u64,
    /// False trips.
    pub false_trips: u64,
    /// Simulated seconds.
    pub sim_seconds: f64,
}

/// Exact bounds on rates, for a number of trials that was fixed beforehand.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RateBounds {
    /// Share of every class that came out, with its two-sided 95 % interval; INVALID stays in n.
    pub shares: BTreeMap<Outcome, Share>,
    /// One-sided upper 95 % bound on the unsafe rate, over the valid trials.
    pub unsafe_upper_95: f64,
    /// The bound with INVALID counted as unsafe.
    pub unsafe_upper_95_invalid_counted: f64,
    /// The first bound, widened so that it holds jointly with those of all other variations (Bonferroni).
    pub unsafe_upper_95_simultaneous: f64,
}

/// Verdict on the claim in one variation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClaimRow {
    /// Number of trials up to the last complete look of a sequential campaign with missing trials, on which the bounds rest. The verdict
    /// there is that the claim is open, or no trial would be missing. Absent where they rest on all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub looked_at: Option<u64>,
    /// Trials of the classes that it names.
    pub hits: u64,
    /// Trials without evidence. They count as hits where the claim is to be shown, and not where it is to be refuted.
    pub invalid: u64,
    /// Verdict on this variation alone, without correction for the others.
    pub alone: JudgedClaim,
    /// Together with all other variations.
    pub together: JudgedClaim,
}

/// The trials of one variation as they come in.
#[derive(Debug, Default)]
pub struct Fold {
    n: u64,
    outcomes: Outcomes,
    unexpected: u64,
    first_unexpected: Option<u64>,
    tally: Tally,
    /// Tally at the last look before which no trial is missing.
    look: Option<Tally>,
    latencies: [Vec<f64>; 3],
    /// First halves of the decision hashes: 128 bits tell any number of trials apart.
    decisions: BTreeSet<u128>,
    accepted: u64,
    refused: u64,
    false_trips: u64,
    sim_us: u64,
}

/// Trials of one variation as a claim sees them.
#[derive(Clone, Copy, Debug)]
pub struct Tallies {
    all: Tally,
    look: Option<Tally>,
}

impl Fold {
    /// Takes trial `i` of the plan's variation in.
    pub fn take(&mut self, plan: &Plan, variation: &PlanVariation, i: u64, row: TrialRow) {
        self.n += 1;
        *self.outcomes.entry(row.outcome).or_insert(0) += 1;
        if row.outcome.is_unexpected(&variation.expected) {
            self.unexpected += 1;
            self.first_unexpected.get_or_insert(i);
        }
        if let Some(claim) = &plan.terms.claim {
            claim.count(&mut self.tally, row.outcome);
        }
        // Rows come in the order of `i`: an equal count means that none is missing before this one.
        if self.n == i + 1 && self.n.is_multiple_of(LOOK) {
            self.look = Some(self.tally);
        }
        for (all, us) in self.latencies.iter_mut().zip(row.latency_us) {
            all.extend(us.map(|us| us as f64 / 1e3));
        }
        let half = row.decision_hash.get(..32).and_then(|hex| u128::from_str_radix(hex, 16).ok());
        self.decisions.extend(half);
        self.accepted += row.accepted;
        self.refused += row.refused;
        self.false_trips += u64::from(row.false_trips);
        self.sim_us += row.sim_us;
    }

    /// The row of variation `v`, to which `planned` trials belong. Bounds and claim are left to [`CampaignObject::new`].
    pub fn row(self, plan: &Plan, v: usize, variation: &PlanVariation, planned: u64) -> (CampaignRow, Tallies) {
        let row = CampaignRow {
            variation: v,
            scenario: variation.scenario.clone(),
            cell: variation.cell.clone(),
            set: variation.set.clone(),
            policy: variation.policy.clone(),
            watermark: variation.watermark.clone(),
            evidence: variation.mode.evidence(),
            counts: variation.counts,
            expected: variation.expected.clone(),
            n: self.n,
            planned,
            outcomes: self.outcomes,
            unexpected: self.unexpected,
            reproduce: self.first_unexpected.map(|i| plan.reproduce(v, i)),
            bounds: None,
            claim: None,
            latency_ms: LatencySummary::of_values(self.latencies),
            distinct_decisions: self.decisions.len(),
            accepted: self.accepted,
            refused: self.refused,
            false_trips: self.false_trips,
            sim_seconds: self.sim_us as f64 / 1e6,
        };
        (row, Tallies { all: self.tally, look: self.look })
    }
}

impl CampaignObject {
    /// Joins the rows, and for a complete campaign draws the conclusion.
    pub fn new(plan: &Plan, hash: String, rows: Vec<(CampaignRow, Tallies)>) -> Self {
        let (trials, planned): (u64, u64) =
            (rows.iter().map(|(r, _)| r.n).sum(), rows.iter().map(|(r, _)| r.planned).sum());
        let (complete, together) = (trials == planned, rows.len());
        let settle = |(mut row, tallies): (CampaignRow, Tallies)| {
            let look = tallies.look.filter(|_| plan.terms.sequential && row.n < row.planned);
            if complete {
                // A sequential campaign chose its n by its results: bounds for a fixed n do not hold for it.
                row.bounds =
                    (!plan.terms.sequential).then(|| RateBounds::from_outcomes(&row.outcomes, row.n, together));
            }
            row.claim = match complete || (plan.terms.sequential && row.n == row.planned) {
                true => ClaimRow::from_tally(plan, tallies.all, together),
                false => look.and_then(|look| ClaimRow::from_tally(plan, look, together)),
            };
            row.claim = row.claim.map(|claim| ClaimRow { looked_at: look.map(|look| look.n), ..claim });
            row
        };
        let rows: Vec<CampaignRow> = rows.into_iter().map(settle).collect();
        Self {
            schema_version: SCHEMA_VERSION,
            hash,
            complete,
            trials,
            planned,
            plan: plan.digest(),
            terms: plan.terms.clone(),
            claim: (complete && plan.terms.claim.is_some()).then(|| ClaimVerdicts::from_rows(&rows)),
            rows,
        }
    }
}

impl RateBounds {
    fn from_outcomes(outcomes: &Outcomes, n: u64, together: usize) -> Self {
        let count = |class| outcomes.get(&class).copied().unwrap_or(0);
        let (broken, invalid) = (count(Outcome::Unsafe), count(Outcome::Invalid));
        Self {
            shares: outcomes.iter().map(|(class, hits)| (*class, Share::new(*hits, n))).collect(),
            unsafe_upper_95: rate_upper(broken, n - invalid, LEVEL),
            unsafe_upper_95_invalid_counted: rate_upper(broken + invalid, n, LEVEL),
            unsafe_upper_95_simultaneous: rate_upper(broken, n - invalid, simultaneous_level(together, LEVEL)),
        }
    }
}

impl ClaimRow {
    fn from_tally(plan: &Plan, tally: Tally, together: usize) -> Option<Self> {
        let claim = plan.terms.claim.as_ref()?;
        let judge =
            |together| if plan.terms.sequential { claim.look(tally, together) } else { claim.judge(tally, together) };
        Some(Self {
            looked_at: None,
            hits: tally.hits,
            invalid: tally.invalid,
            alone: judge(1),
            together: judge(together),
        })
    }
}

impl ClaimVerdicts {
    /// Counts over the variations with a verdict.
    pub(super) fn from_rows(rows: &[CampaignRow]) -> Self {
        let all = || rows.iter().filter_map(|row| row.claim);
        let count = |verdict| all().filter(|claim| claim.alone.verdict == verdict).count();
        Self {
            shown: count(ClaimVerdict::Shown),
            refuted: count(ClaimVerdict::Refuted),
            open: count(ClaimVerdict::Open),
            shown_together: all().all(|claim| claim.together.verdict == ClaimVerdict::Shown),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::example::plan;
    use evidence::trial::Trial;

    /// The plan's campaign where trial i of both variations comes to `outcome(i)`.
    fn campaign(plan: &Plan, n: u64, outcome: impl Fn(u64) -> Outcome) -> CampaignObject {
        let row = |v: usize| {
            let (variation, mut fold) = (&plan.variations[v], Fold::default());
            for i in 0..n {
                let number = plan.number(v, i);
                fold.take(plan, variation, i, TrialRow::from_trial(number, &Trial::example(plan.seed(i), outcome(i))));
            }
            fold.row(plan, v, variation, plan.terms.trials)
        };
        CampaignObject::new(plan, "f".repeat(64), (0..plan.variations.len()).map(row).collect())
    }

    fn claiming(text: &str, sequential: bool) -> Plan {
        let mut plan = plan(299);
        (plan.terms.claim, plan.terms.sequential) = (text.parse().ok(), sequential);
        plan
    }

    #[test]
    fn single_claim_needs_fewer_trials_than_joint() {
        let object = campaign(&claiming("unsafe<1%@95", false), 299, |_| Outcome::HoldSafe);
        let claims = ClaimVerdicts { shown: 2, refuted: 0, open: 0, shown_together: false };
        assert_eq!((object.complete, object.claim), (true, Some(claims)));
        let bounds = object.rows[0].bounds.as_ref().unwrap();
        assert!(bounds.unsafe_upper_95 < 0.01 && bounds.unsafe_upper_95_simultaneous > 0.01);
        assert!(campaign_table(&object).contains("shown for 2 of 2 variations"));
    }

    #[test]
    fn incomplete_campaign_has_neither_bound_nor_claim() {
        let object = campaign(&claiming("unsafe<1%@95", false), 298, |_| Outcome::HoldSafe);
        assert_eq!((object.complete, object.claim, object.trials, object.planned), (false, None, 596, 598));
        assert!(object.rows.iter().all(|row| row.bounds.is_none() && row.claim.is_none()));
        assert!(campaign_table(&object).contains("INCOMPLETE: 596 of 598 trials"));
    }

    /// Before that a variation has no verdict, and the campaign has none until it is complete.
    #[test]
    fn incomplete_sequential_campaign_is_judged_at_its_last_look() {
        let plan = claiming("unsafe<5%@95", true);
        let outcome = |i| if i == 60 { Outcome::Unsafe } else { Outcome::HoldSafe };
        assert!(campaign(&plan, 49, outcome).rows.iter().all(|row| row.claim.is_none()));
        let object = campaign(&plan, 130, outcome);
        let claim = object.rows[0].claim.unwrap();
        assert_eq!((object.complete, object.claim, claim.looked_at, claim.hits), (false, None, Some(100), 1));
        let tally = Tally { hits: 1, invalid: 0, n: 100 };
        assert_eq!(claim.alone, plan.terms.claim.as_ref().unwrap().look(tally, 1));
        let table = campaign_table(&object);
        assert!(table.contains("of 2 variations: shown for 0, refuted for 0, open at the last look for 2"), "{table}");
        let gap = |i: u64| if i < 70 { i } else { i + 1 };
        let (variation, mut fold) = (&plan.variations[0], Fold::default());
        for i in (0..130).map(gap) {
            fold.take(&plan, variation, i, TrialRow::from_trial(i, &Trial::example(plan.seed(i), outcome(i))));
        }
        assert_eq!(fold.look.map(|look| look.n), Some(50), "trial 70 is missing");
    }

    #[test]
    fn invalid_trial_is_counted_and_blocks_the_claim() {
        let outcome = |i| if i == 0 { Outcome::Invalid } else { Outcome::HoldSafe };
        let object = campaign(&claiming("unsafe<1%@95", false), 299, outcome);
        assert_eq!(object.claim.map(|claims| (claims.shown, claims.open)), Some((0, 2)));
        let row = &object.rows[0];
        assert_eq!((row.outcomes[&Outcome::Invalid], row.unexpected), (1, 1));
        assert!(row.reproduce.as_ref().unwrap().ends_with("--trials 1 --seed 7"), "{:?}", row.reproduce);
    }

    #[test]
    fn fixed_bounds_are_omitted_for_adaptive_numbers() {
        let object = campaign(&claiming("unsafe<5%@95", true), 299, |_| Outcome::HoldSafe);
        assert!(object.rows[0].bounds.is_none());
        let claim = object.rows[0].claim.unwrap();
        assert_eq!((claim.alone.verdict, claim.hits), (ClaimVerdict::Shown, 0));
        assert!(claim.alone.upper > rate_upper(0, 299, 0.95), "looking often has its price");
    }

    #[test]
    fn campaign_object_has_the_documented_keys() {
        let object =
            campaign(
                &claiming("unsafe<1%@95", false),
                299,
                |i| {
                    if i == 0 { Outcome::Unsafe } else { Outcome::HoldSafe }
                },
            );
        let object = serde_json::to_value(object).unwrap();
        let doc = include_str!("../../../../../docs/researcher/campaigns.md");
        let keys = |value: &serde_json::Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
        let row = &object["rows"][0];
        let parts =
            [&object, &object["terms"], &object["claim"], row, &row["bounds"], &row["claim"], &row["claim"]["alone"]];
        for key in parts.into_iter().flat_map(keys) {
            assert!(doc.contains(&format!("`{key}`")), "docs/researcher/campaigns.md does not tell of `{key}`");
        }
        assert_eq!((&object["schema_version"], &row["outcomes"]["UNSAFE"]), (&1.into(), &1.into()));
    }
}
