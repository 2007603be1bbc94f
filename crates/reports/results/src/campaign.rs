//! Plan of a large campaign: variations and trials of each, each trial's own draws, and the claims.
//!
//! A [`Plan`] holds everything that the outcome of its trials depends on, so two that are equal are the same campaign,
//! wherever and in however many parts it runs. A trial has a number: trial i of variation v is v * trials + i. Running them is
//! the business of the verb `campaign`, folding them `report`'s.

pub mod claim;
pub mod draw;
pub mod example;
pub mod partition;
pub mod row;

use std::collections::BTreeMap;

use evidence::log::hex;
use evidence::trial::Outcome;
use scenario::Settings;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::mode::Mode;
use claim::{Claim, ClaimVerdict, LOOK, Tally};
use draw::Distribution;

/// Version of the plan's form.
pub const PLAN_VERSION: u32 = 1;
/// Most variations of a campaign.
pub const MAX_VARIATIONS: usize = 10_000;
/// Most trials of a campaign, all variations together.
pub const MAX_TRIALS: u64 = 10_000_000;

/// A whole campaign before any of it has run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Terms shared by all its trials.
    pub terms: Terms,
    /// Its variations, in order.
    pub variations: Vec<PlanVariation>,
}

/// Terms shared by all trials of a campaign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Terms {
    /// Version of the plan's form.
    pub plan_version: u32,
    /// SHA-256 over the sources of the program.
    pub program: String,
    /// The campaign's seed; trial i of each variation has seed + i.
    pub seed: u64,
    /// Trials of each variation; the most there may be where the campaign is sequential.
    pub trials: u64,
    /// True if sensors are rendered and the detector runs.
    pub rendered: bool,
    /// Policy that replaces the scenarios' own.
    pub policy: Option<String>,
    /// Options of the command line that name the guest, which replaces the unit's mission and navigation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub guest: Option<String>,
    /// Claim on each variation.
    pub claim: Option<Claim>,
    /// True if a variation ends at the first look at which its claim is decided.
    pub sequential: bool,
    /// Each trial's own draws, by path in the scenario.
    pub draws: BTreeMap<String, Distribution>,
}

/// One variation of a campaign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanVariation {
    /// Scenario.
    pub scenario: String,
    /// Cell, where it has any.
    pub cell: Option<String>,
    /// Settings of the grid in it.
    pub set: Settings,
    /// Name of its policy.
    pub policy: String,
    /// Reason for which this is an ablation, where it is one.
    pub watermark: Option<String>,
    /// Mode of its trials.
    pub mode: Mode,
    /// True if the scenario's mechanism really runs there; where not, n is no evidence of it.
    pub counts: bool,
    /// The classes that are expected; any where none is named.
    pub expected: Vec<Outcome>,
    /// Its content.
    pub content: InputDigest,
}

/// SHA-256 over the inputs of a trial's outcome beside program, mode and seed, hexadecimal.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputDigest {
    /// The scenario with its scene, its cell and the grid in force.
    pub scenario: String,
    /// The policy.
    pub policy: String,
    /// Platform, bounds, and whether sensors are rendered.
    pub platform: String,
}

/// First difference of two plans.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what}: expected {expected}, got {got}")]
pub struct Difference {
    /// The differing part.
    pub what: String,
    /// The first plan's.
    pub expected: String,
    /// The other's.
    pub got: String,
}

impl Plan {
    /// Checks that the plan has no more variations and trials than a campaign may have, and no variation twice.
    ///
    /// # Errors
    ///
    /// The excess or the repeated variation, in words.
    pub fn bounded(&self) -> Result<(), String> {
        let (variations, trials) = (self.variations.len(), self.terms.trials);
        if variations > MAX_VARIATIONS {
            return Err(format!("{variations} variations, at most {MAX_VARIATIONS} are taken"));
        }
        match trials.checked_mul(variations as u64) {
            Some(1..=MAX_TRIALS) => {}
            Some(0) => return Err("a campaign without a trial".to_owned()),
            Some(_) | None => {
                let product = format!("{trials} trials of each of {variations} variations");
                return Err(format!("{product}, at most {MAX_TRIALS} trials are taken together"));
            }
        }
        let mut names: Vec<String> = self.variations.iter().map(PlanVariation::name).collect();
        names.sort();
        match names.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => Err(format!("`{}` is there twice; name each scenario and value once", pair[0])),
            None => Ok(()),
        }
    }

    /// Trials of all variations together.
    pub fn total(&self) -> u64 {
        self.terms.trials * self.variations.len() as u64
    }

    /// The number of trial `i` of variation `v`.
    pub fn number(&self, v: usize, i: u64) -> u64 {
        v as u64 * self.terms.trials + i
    }

    /// Variation, and trial of it, with this number.
    pub fn place(&self, number: u64) -> (usize, u64) {
        let trials = self.terms.trials.max(1);
        ((number / trials) as usize, number % trials)
    }

    /// The seed of trial `i`.
    pub fn seed(&self, i: u64) -> u64 {
        self.terms.seed.wrapping_add(i)
    }

    /// Draws of trial `i` of variation `v`: keyed by the campaign's seed, the variation's name, the trial's seed and the path.
    pub fn drawn(&self, v: usize, i: u64) -> Settings {
        let name = self.variations.get(v).map(PlanVariation::name).unwrap_or_default();
        let (seed, trial) = (self.terms.seed.to_le_bytes(), self.seed(i).to_le_bytes());
        let draw = |(path, distribution): (&String, &Distribution)| {
            (path.clone(), distribution.draw(&[&seed, name.as_bytes(), &trial, path.as_bytes()]))
        };
        self.terms.draws.iter().map(draw).collect()
    }

    /// The line that runs trial `i` of variation `v` by itself, but for its seed.
    pub fn command(&self, v: usize, i: u64) -> String {
        let Some(variation) = self.variations.get(v) else { return String::new() };
        let mut line = format!("holdsafe campaign run {}", variation.scenario);
        if let Some(cell) = &variation.cell {
            line.push_str(&format!(" --cell {cell}"));
        }
        let drawn = self.drawn(v, i);
        for (path, value) in variation.set.iter().chain(drawn.iter()) {
            line.push_str(&format!(" --grid '{path}={value}'"));
        }
        if let Some(policy) = &self.terms.policy {
            line.push_str(&format!(" --policy policies/{policy}.toml"));
        }
        let rendered = if self.terms.rendered { " --rendered" } else { "" };
        let guest = self.terms.guest.as_deref().unwrap_or_default();
        format!("{line}{rendered}{guest} --trials 1")
    }

    /// The line that runs trial `i` of variation `v` by itself.
    pub fn reproduce(&self, v: usize, i: u64) -> String {
        format!("{} --seed {}", self.command(v, i), self.seed(i))
    }

    /// Number of trials of variation `v` that count: all, or in a sequential campaign those up to the look at which the
    /// claim is decided, or up to the first look for which one is still missing. Looks are in the order of seeds,
    /// independent of partition.
    pub fn wanted(&self, v: usize, outcome: impl Fn(u64) -> Option<Outcome>) -> u64 {
        let all = self.terms.trials;
        let Some(claim) = self.terms.claim.as_ref().filter(|_| self.terms.sequential) else { return all };
        let mut tally = Tally::default();
        for i in 0..all {
            let Some(outcome) = outcome(self.number(v, i)) else { return (i / LOOK + 1).saturating_mul(LOOK).min(all) };
            claim.count(&mut tally, outcome);
            // A variation ends by its own verdict. The joint verdict is judged on the trials that there are then.
            if (i + 1).is_multiple_of(LOOK) && claim.at_look(tally, 1) != ClaimVerdict::Open {
                return i + 1;
            }
        }
        all
    }

    /// Number of trials of variation `v` that a round of partitions runs up to: those that count, and where their claim is still open, as many
    /// more as are finished. So rounds are few, and at most as many trials run in vain as count.
    pub fn wanted_in_round(&self, v: usize, outcome: impl Fn(u64) -> Option<Outcome>) -> u64 {
        let wanted = self.wanted(v, &outcome);
        let missing = (0..wanted).any(|i| outcome(self.number(v, i)).is_none());
        let finished = wanted.saturating_sub(LOOK);
        if missing { wanted.max(2 * finished).min(self.terms.trials) } else { wanted }
    }

    /// SHA-256 over the plan, but for the program.
    pub fn digest(&self) -> String {
        let terms = Terms { program: String::new(), ..self.terms.clone() };
        let mut digest = Sha256::new_with_prefix("holdsafe plan");
        for text in std::iter::once(json(&terms)).chain(self.variations.iter().map(json)) {
            digest.update(format!("{}\n{text}\n", text.len()));
        }
        hex(&digest.finalize())
    }

    /// First difference of the other plan from this one.
    pub fn difference(&self, other: &Plan) -> Option<Difference> {
        let differs = |((what, expected), (_, got)): ((String, String), (String, String))| {
            (expected != got).then_some(Difference { what, expected, got })
        };
        self.facts().into_iter().zip(other.facts()).find_map(differs)
    }

    fn facts(&self) -> Vec<(String, String)> {
        let (terms, none) = (&self.terms, || "none".to_owned());
        let draws: Vec<String> =
            terms.draws.iter().map(|(path, distribution)| format!("{path}={distribution}")).collect();
        let mut facts = vec![
            ("version of the plan".to_owned(), terms.plan_version.to_string()),
            ("program (SHA-256 of its sources)".to_owned(), terms.program.clone()),
            ("seed".to_owned(), terms.seed.to_string()),
            ("trials".to_owned(), terms.trials.to_string()),
            ("rendered".to_owned(), terms.rendered.to_string()),
            ("policy".to_owned(), terms.policy.clone().unwrap_or_else(none)),
            ("claim".to_owned(), terms.claim.as_ref().map_or_else(none, Claim::to_string)),
            ("sequential".to_owned(), terms.sequential.to_string()),
            ("draws".to_owned(), if draws.is_empty() { none() } else { draws.join(", ") }),
            ("number of variations".to_owned(), self.variations.len().to_string()),
        ];
        for (v, variation) in self.variations.iter().enumerate() {
            let (name, content) = (variation.name(), &variation.content);
            facts.push((format!("variation {v}"), name.clone()));
            facts.push((format!("scenario text of `{name}`"), content.scenario.clone()));
            facts.push((format!("policy of `{name}`"), format!("{} {}", variation.policy, content.policy)));
            facts.push((format!("platform or bounds of `{name}`"), content.platform.clone()));
            facts.push((format!("the rest of `{name}`"), json(variation)));
        }
        facts
    }
}

impl PlanVariation {
    /// Scenario, cell and settings: unique within a campaign.
    pub fn name(&self) -> String {
        let cell = self.cell.as_ref().map(|cell| format!(" {cell}")).unwrap_or_default();
        let set: Vec<String> = self.set.iter().map(|(path, value)| format!("{path}={value}")).collect();
        let set = if set.is_empty() { String::new() } else { format!(" @ {}", set.join(", ")) };
        format!("{}{cell}{set}", self.scenario)
    }
}

/// JSON of a plain value; these have no map with other keys than text, so it cannot fail.
fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}

#[cfg(test)]
mod tests;
