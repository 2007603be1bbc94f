//! Multilevel splitting with fixed effort, over any process that can be copied and continues from the copy by other random
//! draws.
//!
//! To come to the last level a run has to pass the others. Each stage tries as many times as every other to get from one level
//! to the next, from states in which the level was first reached, drawn evenly; the product of the shares that got there is the
//! estimate. It is unbiased for any fixed levels and any effort (the argument is that of Amrein and Künsch 2011; fixed effort is
//! Garvels 2000), so the mean of independent repetitions is, too. Levels placed adaptively (Cérou and Guyader 2007) are not
//! offered: where the level jumps, as a lease's age does with each loss, they mislead (Walter 2015).
//!
//! - M. J. J. Garvels, The splitting method in rare event simulation, thesis, University of Twente, 2000.
//! - F. Cérou, A. Guyader, Adaptive multilevel splitting for rare event analysis, Stochastic Analysis and Applications 25, 2007.
//! - M. Amrein, H. R. Künsch, A variant of importance splitting for rare event estimation: fixed number of successes, ACM
//!   Transactions on Modeling and Computer Simulation 21, 2011.
//! - C. Walter, Rare event simulation and splitting for discontinuous random variables, arXiv:1507.00919, 2015.
//!
//! All chance comes from (seed, repetition, stage, number of the trial), so threads have no effect.

use link::clock::thread_cpu_us;
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use serde::{Deserialize, Serialize};

/// Most stages.
pub const MAX_LEVELS: usize = 64;
/// States kept of a stage for the next to begin from, at most. They belong to the first trials that got there: their
/// selection is independent of the states, so the estimate stays unbiased, and memory is bounded.
const KEPT: usize = 256;
/// Trials with results that are waited for together.
const ROUND: usize = 128;

/// A process with a future that depends on its state and on chance alone.
pub trait Process: Send + Sync {
    /// Continues until the process is at `level` or beyond, which it may be already; false where it ended before.
    fn reach(&mut self, level: f64) -> bool;

    /// A copy that continues with the random numbers of `seed`.
    #[must_use]
    fn branch(&self, seed: u64) -> Self;

    /// Progress since it began or was branched off, in its own unit.
    fn spent(&self) -> u64;
}

/// Levels, and number of trials.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The level that each stage is to reach, rising; the last is the event.
    pub levels: Vec<f64>,
    /// Trials of each stage.
    pub trials: u64,
    /// Independent repetitions.
    pub repetitions: u64,
    /// Seed of all of it.
    pub seed: u64,
}

/// Result of one stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StageResult {
    /// Trials.
    pub tried: u64,
    /// Number of trials that got to the stage's level.
    pub reached: u64,
    /// Their total cost.
    pub spent: u64,
    /// CPU time, microseconds.
    pub cpu_us: u64,
}

/// One estimate: all stages once. Stages after one that no trial passed are left out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Repetition {
    /// The stages that were tried.
    pub stages: Vec<StageResult>,
}

impl Repetition {
    /// True if it has the form of a repetition with this number of stages and trials of each.
    pub fn is_of(&self, stages: usize, trials: u64) -> bool {
        let Some((last, before)) = self.stages.split_last() else { return false };
        let sound = |stage: &StageResult| stage.tried == trials && stage.reached <= trials;
        let ended = self.stages.len() == stages || last.reached == 0;
        self.stages.len() <= stages
            && ended
            && sound(last)
            && before.iter().all(|stage| sound(stage) && stage.reached > 0)
    }

    /// The estimated probability.
    pub fn estimate(&self) -> f64 {
        self.stages.iter().map(|stage| stage.reached as f64 / stage.tried.max(1) as f64).product()
    }
}

/// Carries out one repetition of `plan` on the processes that `begin` makes of seeds; `tried` receives each trial. The result depends on the plan
/// and the number of the repetition alone.
///
/// # Errors
///
/// The first error of `begin` or `tried`.
pub fn split<P: Process, E: Send>(
    plan: &Plan,
    repetition: u64,
    threads: usize,
    begin: impl Fn(u64) -> Result<P, E> + Sync,
    tried: impl Fn() -> Result<(), E> + Sync,
) -> Result<Repetition, E> {
    let (mut from, mut stages) = (Vec::new(), Vec::new());
    for (stage, level) in plan.levels.iter().enumerate() {
        let climb = Climb { plan, place: (repetition, stage as u64), level: *level, from: &from };
        let (row, arrivals) = climb.all(threads, &begin, &tried)?;
        stages.push(row);
        if arrivals.is_empty() {
            break;
        }
        from = arrivals;
    }
    Ok(Repetition { stages })
}

/// One stage under way.
struct Climb<'a, P> {
    plan: &'a Plan,
    /// Repetition and stage.
    place: (u64, u64),
    level: f64,
    /// Start states of its trials; empty in the first stage.
    from: &'a [P],
}

impl<P: Process> Climb<'_, P> {
    fn all<E: Send>(
        &self,
        threads: usize,
        begin: &(impl Fn(u64) -> Result<P, E> + Sync),
        tried: &(impl Fn() -> Result<(), E> + Sync),
    ) -> Result<(StageResult, Vec<P>), E> {
        let (mut row, mut arrivals) = (StageResult::default(), Vec::new());
        let numbers: Vec<u64> = (0..self.plan.trials).collect();
        for round in numbers.chunks(ROUND) {
            let results = parallel::map(threads, round, |number| {
                let one = self.one(*number, begin)?;
                tried().map(|()| one)
            })?;
            for (spent, cpu_us, process) in results {
                row.tried += 1;
                row.reached += u64::from(process.is_some());
                row.spent += spent;
                row.cpu_us += cpu_us;
                if let Some(process) = process.filter(|_| arrivals.len() < KEPT) {
                    arrivals.push(process);
                }
            }
        }
        Ok((row, arrivals))
    }

    /// One trial: its cost, its CPU time, and its state where it reached the level.
    fn one<E>(&self, number: u64, begin: &impl Fn(u64) -> Result<P, E>) -> Result<(u64, u64, Option<P>), E> {
        let before = thread_cpu_us();
        let mut draw = self.draw(number);
        let mut process = match self.from.len() as u64 {
            0 => begin(draw.next_u64())?,
            n => self.from[uniform_below(&mut draw, n) as usize].branch(draw.next_u64()),
        };
        let reached = process.reach(self.level);
        Ok((process.spent(), thread_cpu_us().saturating_sub(before), reached.then_some(process)))
    }

    fn draw(&self, number: u64) -> ChaCha8Rng {
        let key = [self.plan.seed, self.place.0, self.place.1, number].map(u64::to_le_bytes).concat();
        ChaCha8Rng::from_seed(blake3::derive_key("holdsafe splitting v1", &key))
    }
}

/// Uniform below `n` (by multiplication; the bias is below 2⁻⁵⁰ for the sizes drawn here).
fn uniform_below(rng: &mut ChaCha8Rng, n: u64) -> u64 {
    ((u128::from(rng.next_u64()) * u128::from(n)) >> 64) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use stats::mean::Mean;
    use stats::rate_upper;

    /// Messages of which each is lost by itself; the level is how many were lost in a row.
    struct Losses {
        rate: f64,
        left: u32,
        row: u32,
        spent: u64,
        chance: ChaCha8Rng,
    }

    impl Process for Losses {
        fn reach(&mut self, level: f64) -> bool {
            while f64::from(self.row) < level {
                if self.left == 0 {
                    return false;
                }
                let lost = ((self.chance.next_u64() >> 11) as f64) < self.rate * 2f64.powi(53);
                (self.left, self.row, self.spent) =
                    (self.left - 1, if lost { self.row + 1 } else { 0 }, self.spent + 1);
            }
            true
        }

        fn branch(&self, seed: u64) -> Self {
            Self { chance: ChaCha8Rng::seed_from_u64(seed), spent: 0, ..*self }
        }

        fn spent(&self) -> u64 {
            self.spent
        }
    }

    const RATE: f64 = 0.2;
    const MESSAGES: u32 = 60;
    const ROW: usize = 6;

    /// The probability of `row` losses in a row among `n` messages, from that of being at each length after each message.
    fn exactly(rate: f64, n: u32, row: usize) -> f64 {
        let mut weights = vec![0.0; row + 1];
        weights[0] = 1.0;
        for _ in 0..n {
            let open: f64 = weights[..row].iter().sum();
            let next_weight = weights[row] + weights[row - 1] * rate;
            let longer: Vec<f64> = weights[..row - 1].iter().map(|p| p * rate).collect();
            weights = [vec![open * (1.0 - rate)], longer, vec![next_weight]].concat();
        }
        weights[row]
    }

    fn plan(levels: &[f64], trials: u64, seed: u64) -> Plan {
        Plan { levels: levels.to_vec(), trials, repetitions: 10, seed }
    }

    fn estimates(plan: &Plan, threads: usize) -> Vec<Repetition> {
        let begin = |seed| {
            let chance = ChaCha8Rng::seed_from_u64(seed);
            Ok::<_, ()>(Losses { rate: RATE, left: MESSAGES, row: 0, spent: 0, chance })
        };
        let one = |repetition| split(plan, repetition, threads, begin, || Ok(())).expect("nothing fails");
        (0..plan.repetitions).map(one).collect()
    }

    fn means(levels: &[f64], trials: u64, seeds: std::ops::Range<u64>) -> Vec<Mean> {
        let estimates_of =
            |seed| estimates(&plan(levels, trials, seed), 1).iter().map(Repetition::estimate).collect::<Vec<_>>();
        seeds.map(|seed| Mean::from_values(&estimates_of(seed))).collect()
    }

    #[test]
    fn exact_answer_matches_hand_counting() {
        // Two in a row among three: llx, xll, and lll is one of the first.
        assert!((exactly(0.5, 3, 2) - 3.0 / 8.0).abs() < 1e-15);
        assert!((exactly(0.1, 4, 4) - 1e-4).abs() < 1e-15);
    }

    /// Seeds were fixed before the first run. 400 intervals of 10 repetitions of 100 trials a stage.
    #[test]
    fn interval_covers_a_known_probability_as_stated() {
        let levels: Vec<f64> = (1..=ROW).map(|row| row as f64).collect();
        let (exact, seeds) = (exactly(RATE, MESSAGES, ROW), 400);
        let means = means(&levels, 100, 0..seeds);
        let covers = |mean: &&Mean| mean.interval_95.is_some_and(|[from, to]| (from..=to).contains(&exact));
        let covered = means.iter().filter(covers).count() as u64;
        assert!(rate_upper(covered, seeds, 0.995) >= 0.95, "{covered} of {seeds} intervals hold {exact}");
        assert!(covered < seeds, "an interval that always holds is too wide");
        let all = Mean::from_values(&means.iter().map(|mean| mean.mean).collect::<Vec<_>>());
        let off = (all.mean - exact).abs() / all.standard_error;
        assert!(off < 3.0, "the mean of all is {off} standard errors off: {} in place of {exact}", all.mean);
    }

    #[test]
    fn leaping_over_levels_is_free_and_unbiased() {
        let exact = exactly(RATE, MESSAGES, 3);
        let means = means(&[0.5, 0.9, 1.0, 1.5, 3.0], 100, 1_000..1_050);
        let all = Mean::from_values(&means.iter().map(|mean| mean.mean).collect::<Vec<_>>());
        assert!((all.mean - exact).abs() < 3.0 * all.standard_error, "{} in place of {exact}", all.mean);
    }

    #[test]
    fn result_is_thread_independent_and_differs_by_seed() {
        let levels = [1.0, 3.0, 5.0];
        let rows = |seed, threads| -> Vec<(u64, u64, u64)> {
            let all = estimates(&plan(&levels, 300, seed), threads);
            all.iter().flat_map(|one| &one.stages).map(|s| (s.tried, s.reached, s.spent)).collect()
        };
        assert_eq!(rows(7, 1), rows(7, 3));
        assert_ne!(rows(7, 1), rows(8, 1));
    }

    #[test]
    fn impossible_repetition_is_told() {
        let estimate = |reached: &[u64]| {
            let stage = |reached: &u64| StageResult { tried: 8, reached: *reached, ..StageResult::default() };
            Repetition { stages: reached.iter().map(stage).collect() }
        };
        assert!(estimate(&[8, 3, 1]).is_of(3, 8) && estimate(&[8, 0]).is_of(3, 8) && estimate(&[8, 3, 0]).is_of(3, 8));
        for wrong in [&[][..], &[8, 3], &[9, 3, 1], &[8, 0, 1], &[1, 1, 1, 1]] {
            assert!(!estimate(wrong).is_of(3, 8), "{wrong:?}");
        }
        assert!(!estimate(&[8, 3, 1]).is_of(3, 9));
    }

    #[test]
    fn unreached_level_gives_an_estimate_of_zero() {
        let all = estimates(&plan(&[1.0, f64::INFINITY, f64::INFINITY], 20, 1), 1);
        assert!(all.iter().all(|one| one.stages.len() == 2 && one.estimate() == 0.0), "{all:?}");
    }
}
