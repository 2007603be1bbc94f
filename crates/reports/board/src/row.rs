//! Row of the leaderboard: the trials of one guest, in one conduct, under one attack, in its own scene or in drawn worlds of one family.
//!
//! A row has counts and digests alone: no share, no interval and no number with a fraction, so that it has one canonical text. Limits of its
//! fields are in `bounds`, its signature in `signed`.

use std::collections::BTreeMap;

use evidence::trial::{Outcome, Outcomes, Trial};
use guest::Conduct;
use serde::{Deserialize, Serialize};
use stats::Share;

/// Trials of a guest, with everything that they depend on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardRow {
    /// Guest that drove.
    pub guest: GuestIdentity,
    /// Bare, or inside the platform's guards.
    pub conduct: Conduct,
    /// Name of the scenario, which is the attack.
    pub scenario: String,
    /// Cell of the scenario, where it has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cell: Option<String>,
    /// Name of the platform.
    pub platform: String,
    /// Family of the drawn worlds; none for the scenario's own scene. Trial i is in the world of seed `seed` + i.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub world: Option<String>,
    /// Digests of the inputs.
    pub inputs: Inputs,
    /// Seed of the first trial; trial i has `seed` + i.
    pub seed: u64,
    /// Count of each class, as the trials below have them.
    pub outcomes: Outcomes,
    /// Work that the guest did.
    pub availability: Availability,
    /// Trials, in the order of their seeds.
    pub trials: Vec<BoardTrial>,
    /// False where the first trial, run twice, gave two logs.
    pub repeatable: bool,
    /// Name of the policy, where it waives a check.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub waived: Option<String>,
    /// Program that ran and judged the trials.
    pub program: ProgramIdentity,
    /// Machine that it ran on.
    pub host: Host,
    /// Author of the row.
    pub contributor: Contributor,
}

/// Guest by its files.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GuestIdentity {
    /// Name in its file.
    pub name: String,
    /// SHA-256 of its file (the empty name), its pinned files and the files that its command names, by path from its folder; `../NAME` for a
    /// file outside of it. None for a guest that is built into the program.
    pub files: BTreeMap<String, String>,
}

/// SHA-256 of the inputs of the trials beside guest, program and seeds.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inputs {
    /// Scenario with its scene and cell. In drawn worlds: of the lines of digests of each world's scenario.
    pub scenario: String,
    /// Policy.
    pub policy: String,
    /// Platform, bounds and sensing.
    pub platform: String,
}

/// Work of a guest over all trials of a row.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Availability {
    /// Trials with a route.
    pub routed: u64,
    /// Way points of these trials that were passed, by the plant's truth.
    pub passed: u64,
    /// Way points of these trials.
    pub points: u64,
    /// Trials of these in which the vehicle was stuck.
    pub stuck: u64,
    /// Distance driven in all trials, mm.
    pub driven_mm: u64,
    /// Losses of authority or freedom without a fault.
    pub false_trips: u64,
    /// Steps that the guest answered.
    pub steps: u64,
    /// Set-points of these that the guards limited.
    pub limited: u64,
}

/// One trial of a row.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardTrial {
    /// Class that the oracle gave.
    pub class: Outcome,
    /// SHA-256 over the canonical events of its log.
    pub log: String,
}

/// Program that ran the trials.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProgramIdentity {
    /// Version.
    pub version: String,
    /// Commit that it was built of, with a plus where files were changed since; `not recorded` in a debug build.
    pub commit: String,
    /// SHA-256 over its sources, the same for every build of them.
    pub sources: String,
}

/// Machine that ran the trials.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Host {
    /// Architecture and system, such as `x86_64-linux`.
    pub target: String,
    /// `debug` or `release`.
    pub build: String,
    /// True if the guest's processes were kept apart from the machine's.
    pub confined: bool,
}

/// Author of a row.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contributor {
    /// Name, as the author states it: nothing but the key proves who signed.
    pub name: String,
    /// Ed25519 public key, hexadecimal.
    pub key: String,
}

/// Place of a row in the canonical order. Two rows of one place are duplicates, whatever their results.
type Place<'a> = (
    &'a str,
    &'a str,
    Option<&'a str>,
    &'a str,
    Option<&'a str>,
    u64,
    &'a str,
    Conduct,
    &'a BTreeMap<String, String>,
    &'a Inputs,
    &'a str,
);

impl BoardRow {
    /// Place in the canonical order.
    pub(crate) fn place(&self) -> Place<'_> {
        (
            &self.guest.name,
            &self.scenario,
            self.cell.as_deref(),
            &self.platform,
            self.world.as_deref(),
            self.seed,
            &self.contributor.key,
            self.conduct,
            &self.guest.files,
            &self.inputs,
            &self.program.sources,
        )
    }

    /// The row in words, for messages.
    pub fn title(&self) -> String {
        let cell = self.cell.as_ref().map(|cell| format!(" {cell}")).unwrap_or_default();
        let world = self.world.as_deref().unwrap_or("own scene");
        format!("{} {}, {}{cell}, {world}, seed {}", self.guest.name, self.conduct.name(), self.scenario, self.seed)
    }

    /// Number of trials of a class.
    pub fn count(&self, class: Outcome) -> u64 {
        self.outcomes.get(&class).copied().unwrap_or_default()
    }

    /// Share of UNSAFE and LATE among the trials with evidence, which are neither INVALID nor GUEST_FAILED, with its exact 95 % interval.
    pub fn harm(&self) -> Share {
        let unjudged = self.count(Outcome::Invalid).saturating_add(self.count(Outcome::GuestFailed));
        let n = (self.trials.len() as u64).saturating_sub(unjudged);
        Share::new(self.count(Outcome::Unsafe).saturating_add(self.count(Outcome::Late)), n)
    }

    /// Classes of `trials` by name and count.
    pub fn counted(trials: &[BoardTrial]) -> Outcomes {
        let mut outcomes = Outcomes::new();
        trials.iter().for_each(|trial| *outcomes.entry(trial.class).or_default() += 1);
        outcomes
    }
}

impl From<&Trial> for BoardTrial {
    fn from(trial: &Trial) -> Self {
        Self { class: trial.outcome, log: trial.log_hash.clone() }
    }
}

impl Availability {
    /// Sums over `trials`.
    pub fn from_trials(trials: &[Trial]) -> Self {
        let mut sums = Self::default();
        for trial in trials {
            sums.false_trips += u64::from(trial.false_trips);
            if let Some(mission) = &trial.mission {
                // A cast of a float saturates.
                sums.driven_mm = sums.driven_mm.saturating_add((mission.driven_m * 1000.0).round() as u64);
                if let Some(progress) = &mission.progress {
                    sums.routed += 1;
                    sums.passed += u64::from(progress.passed);
                    sums.points += u64::from(progress.total);
                    sums.stuck += u64::from(progress.is_stuck());
                }
            }
            if let Some(guest) = &trial.guest {
                sums.steps += u64::from(guest.steps);
                sums.limited += u64::from(guest.limited);
            }
        }
        sums
    }

    /// Share of the way points that were passed, 0 to 1; none without a route.
    pub fn completed(&self) -> Option<f64> {
        (self.points > 0).then(|| self.passed as f64 / self.points as f64)
    }
}
