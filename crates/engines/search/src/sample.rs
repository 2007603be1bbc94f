//! Sequences drawn at random, for comparing live runs with the twin: findings away from their edge, harmless sequences, and
//! sequences next to an edge.
//!
//! The sequence for a seed depends on ground, stratum and seed alone. Every draw is *uniform*: the other strategies look for
//! unknown situations, and would draw one sequence because of another. Running them live is left to the caller.

use evidence::trial::Outcome;
use parallel::progress::{Progress, Stop, Talk};
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use scenario::{Scenario, Setup};
use serde::{Deserialize, Serialize};

use super::draw::Strategy;
use super::error::SearchError;
use super::moments::Moments;
use super::run::RunConfig;
use super::sequence::{Action, AttackSequence, move_of};
use super::tried::{Cause, SearchConfig, Test, Tried};

/// Distance from an edge that still is next to it, milliseconds.
const NEXT_MS: i64 = 20;
/// Number of searches for a sequence, and bound of the tries in each.
const RUNS: u32 = 4;
const SEQUENCES: u64 = 500;

/// Kind of sequences to draw from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stratum {
    /// Sequences that are findings in the twin, and stay so with everything a little stronger, earlier and later
    /// ([`SearchConfig::inside`]).
    Finding,
    /// Sequences that arrive in the twin and are no findings.
    Safe,
    /// Shrunk findings with one length of time moved by up to 20 ms, to either side of its edge.
    Edge,
}

impl Stratum {
    /// Every stratum.
    pub const ALL: [Stratum; 3] = [Stratum::Finding, Stratum::Safe, Stratum::Edge];

    /// Its name in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Stratum::Finding => "finding",
            Stratum::Safe => "safe",
            Stratum::Edge => "edge",
        }
    }
}

/// A sequence that was drawn, as the scenario that it makes.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// The scenario; it expects the class that the twin gave.
    pub scenario: Scenario,
    /// The sequence, for people.
    pub sequence: String,
    /// The class that the twin gave.
    pub outcome: Outcome,
}

impl SearchConfig {
    /// Draws a sequence; `found` defines a finding. `None` where none was met: there is no such sequence, or it is rare.
    ///
    /// # Errors
    ///
    /// Reason for which a sequence cannot be run, or the user's request to stop.
    pub fn sample(
        &self,
        stratum: Stratum,
        found: Test<'_>,
        seed: u64,
        stop: &Stop,
    ) -> Result<Option<Drawn>, SearchError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let safe = |tried: &Tried| safe(tried, found);
        for _ in 0..RUNS {
            let drawn = match stratum {
                Stratum::Safe => self.first(&safe, rng.next_u64(), stop)?.map(|(_, sequence)| (self.clone(), sequence)),
                Stratum::Finding => match self.first(found, rng.next_u64(), stop)? {
                    Some((cause, sequence)) => {
                        self.inside(&sequence, found, &cause)?.map(|sequence| (self.clone(), sequence))
                    }
                    None => None,
                },
                Stratum::Edge => self.next_to_edge(found, &mut rng, stop)?,
            };
            let Some((config, sequence)) = drawn else { continue };
            let drawn = config.drawn(&sequence)?;
            // A sequence that did not arrive in the twin gives no class for a live run to agree with.
            if drawn.outcome != Outcome::Invalid {
                return Ok(Some(drawn));
            }
        }
        Ok(None)
    }

    /// The first of the sequences drawn with this seed that `test` finds.
    fn first(&self, test: Test<'_>, seed: u64, stop: &Stop) -> Result<Option<(Cause, AttackSequence)>, SearchError> {
        let run = RunConfig { strategy: Strategy::Uniform, seed, budget: SEQUENCES, first: true };
        let result = self.search(run, None, test, 1, &Progress::new("", 0, Talk::Quiet), stop)?;
        Ok(result.found.into_iter().next().map(|(cause, found)| (cause, found.sequence)))
    }

    fn drawn(&self, sequence: &AttackSequence) -> Result<Drawn, SearchError> {
        let outcome = self.try_sequence(sequence)?.trial.outcome;
        let mut scenario = sequence.in_scenario(&self.space, &self.scenario)?;
        let sequence = sequence.describe(&self.space);
        scenario.expect([outcome]);
        let space = self.space.name.as_str();
        scenario.describe(
            &format!("Drawn: {sequence}"),
            &format!("Drawn over attack space {space} to hold a live run against the twin: {sequence}."),
        );
        Ok(Drawn { scenario, sequence, outcome })
    }

    /// A shrunk finding with one of its lengths of time moved from its edge, over the same attack space in milliseconds. It is
    /// found and shrunk unrendered, which is faster; the edge is that of this ground. `None` where none has one.
    fn next_to_edge(
        &self,
        found: Test<'_>,
        rng: &mut ChaCha8Rng,
        stop: &Stop,
    ) -> Result<Option<(SearchConfig, AttackSequence)>, SearchError> {
        let plain = Setup { rendered: false, ..self.setup.clone() };
        let plain = SearchConfig::new(self.scenario.clone(), plain, self.seed, self.space.in_milliseconds())?;
        let Some((cause, sequence)) = plain.first(found, rng.next_u64(), stop)? else { return Ok(None) };
        let nominal = plain.try_sequence(&AttackSequence::default())?;
        let moments = Moments::from_run(&nominal, &plain.space, &plain.setup.bounds);
        let shrunk = plain.shrink(&sequence, found, &cause, &moments)?.sequence;
        let (Some(length), steps) = (pick(&plain.lengths(&shrunk), rng).cloned(), offset(rng)) else { return Ok(None) };
        let mut finer = self.clone();
        finer.space = plain.space;
        let holds = |place: u32| Ok(found(&finer.try_sequence(&length.sequence_at(place))?).as_ref() == Some(&cause));
        let edge = length.edge(holds)?;
        let moved = edge.and_then(|edge| u32::try_from(i64::from(edge) + steps).ok());
        Ok(moved.filter(|place| *place <= length.last).map(|place| (finer, length.sequence_at(place))))
    }

    /// The lengths of time of a shrunk sequence that have an edge, which the weakest of its range has not.
    fn lengths(&self, sequence: &AttackSequence) -> Vec<Length> {
        let mut lengths = Vec::new();
        for (action, of) in sequence.actions().iter().enumerate() {
            let action_type = move_of(&self.space, of);
            let times = action_type.ranges().enumerate().filter(|(number, _)| action_type.counts_time(*number));
            lengths.extend(times.map(|(number, range)| Length {
                actions: sequence.actions().to_vec(),
                action,
                number,
                last: range.last(),
            }));
        }
        lengths.retain(|length| length.place() > 0);
        lengths
    }
}

/// One number of a sequence, which counts time in milliseconds.
#[derive(Clone, Debug)]
struct Length {
    actions: Vec<Action>,
    action: usize,
    number: usize,
    last: u32,
}

impl Length {
    fn place(&self) -> u32 {
        self.actions[self.action].places[self.number]
    }

    /// The sequence with the number there.
    fn sequence_at(&self, place: u32) -> AttackSequence {
        let mut actions = self.actions.clone();
        actions[self.action].places[self.number] = place;
        AttackSequence::new(actions)
    }

    /// The least place at which the finding holds, up to [`NEXT_MS`] beyond its present one. None where it holds at 0,
    /// or not at the highest.
    fn edge(&self, holds: impl Fn(u32) -> Result<bool, SearchError>) -> Result<Option<u32>, SearchError> {
        let (mut low, mut high) = (0, (self.place() + NEXT_MS.unsigned_abs() as u32).min(self.last));
        if holds(low)? || !holds(high)? {
            return Ok(None);
        }
        while high > low + 1 {
            let middle = low + (high - low) / 2;
            *(if holds(middle)? { &mut high } else { &mut low }) = middle;
        }
        Ok(Some(high))
    }
}

/// Cause of a trial without a finding in which the attack arrived.
fn safe(tried: &Tried, found: Test<'_>) -> Option<Cause> {
    let outcome = tried.trial.outcome;
    let holds = tried.trial.receipt && outcome != Outcome::Invalid && found(tried).is_none();
    holds.then(|| Cause { outcome, broken: "nothing".to_owned() })
}

fn pick<'a, T>(choices: &'a [T], rng: &mut ChaCha8Rng) -> Option<&'a T> {
    choices.get(uniform_below(choices.len() as u64, rng) as usize)
}

/// A number from -20 to 20, each as likely as any other.
fn offset(rng: &mut ChaCha8Rng) -> i64 {
    uniform_below(2 * NEXT_MS.unsigned_abs() + 1, rng) as i64 - NEXT_MS
}

/// Even below `n`, to within 2^-32; 0 where `n` is 0.
fn uniform_below(n: u64, rng: &mut ChaCha8Rng) -> u64 {
    (u64::from(rng.next_u32()) * n) >> 32
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::ends_in;
    use scenario::{AttackSpace, find_root, load};

    fn config() -> SearchConfig {
        let root = find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
        let scenario = load(&root.join("scenarios/control/nominal.toml")).unwrap();
        let setup = Setup::load(&root, &scenario, None, false).unwrap();
        let space = AttackSpace::load(&root.join("scenarios/spaces/path.toml")).unwrap();
        SearchConfig::new(scenario, setup, 1, space).unwrap()
    }

    #[test]
    fn seed_gives_one_sequence_of_its_stratum() {
        let (config, found) = (config(), [Outcome::HoldSafe]);
        let sample = |stratum: Stratum, seed| config.sample(stratum, &ends_in(&found), seed, &Stop::default()).unwrap();
        let safe = sample(Stratum::Safe, 1).unwrap();
        assert!(!found.contains(&safe.outcome) && safe.outcome != Outcome::Invalid, "{safe:?}");
        assert_eq!(sample(Stratum::Finding, 1).unwrap().outcome, Outcome::HoldSafe);
        let [drawn, repeated] = [0; 2].map(|_| sample(Stratum::Edge, 1).unwrap());
        assert_eq!((&drawn.sequence, &drawn.scenario), (&repeated.sequence, &repeated.scenario));
        assert_ne!(drawn.sequence, sample(Stratum::Edge, 2).unwrap().sequence);
    }

    #[test]
    fn edge_of_a_length_is_its_first_millisecond() {
        let mut config = config();
        config.space = config.space.in_milliseconds();
        let kind = config.space.moves.iter().position(|action_type| action_type.name.as_str() == "shake").unwrap();
        let sequence = AttackSequence::new(vec![Action { begins: 100, kind, places: vec![300, 0] }]);
        let lengths = config.lengths(&sequence);
        assert_eq!(lengths.len(), 1, "the weakest of a range has no edge");
        let edge = |least: u32| lengths[0].edge(|place| Ok(place >= least)).unwrap();
        assert_eq!([1, 287, 320, 321, 0].map(edge), [Some(1), Some(287), Some(320), None, None]);
        assert_eq!(lengths[0].sequence_at(283).describe(&config.space), "shake at 1.00 s for 0.333 s (up_to_ms = 10)");
    }

    #[test]
    fn offsets_reach_both_ends_and_none_is_beyond() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let drawn: std::collections::BTreeSet<i64> = (0..2_000).map(|_| offset(&mut rng)).collect();
        assert_eq!((drawn.first(), drawn.last(), drawn.len()), (Some(&-20), Some(&20), 41));
    }
}
