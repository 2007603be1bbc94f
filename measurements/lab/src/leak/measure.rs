//! Accuracy of guesses, against chance.
//!
//! Half of the seeds are learned from and the other half guessed, so that no run is on both sides. Seconds of one run
//! are much alike, so intervals are over runs: the seed draws one second of each guessed run (for a mode's own share,
//! one of its seconds), and those are independent. Shares over all seconds are given without an interval.

use std::collections::BTreeMap;

use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use serde::Serialize;
use stats::paired::Paired;
use stats::{LEVEL, Share, rate_lower, rate_upper, simultaneous_level};
use wire::mode::Mode;

use super::guess::{Before, Guess};
use super::{Run, Sees, Window};

/// Guesses for the seconds of a mode.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The mode.
    pub mode: Mode,
    /// Number of guesses by guessed mode, all modes being as likely before, in all its seconds.
    pub guessed: BTreeMap<&'static str, u64>,
    /// One second of it in each run that has it: the share guessed right.
    pub by_run: Share,
}

/// Accuracy of an observer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Leak {
    /// Links that it sees.
    pub sees: Sees,
    /// Runs learned from, and runs guessed.
    pub runs: [usize; 2],
    /// Seconds learned from, and seconds guessed.
    pub seconds: [usize; 2],
    /// Share of all guessed seconds that were right.
    pub accuracy: f64,
    /// The commonest mode in the training runs.
    pub commonest: Mode,
    /// Share of all guessed seconds in that mode: chance, for an observer that knows the frequency of each mode.
    pub majority: f64,
    /// One second of each guessed run: the share that was right.
    pub by_run: Share,
    /// Comparison over equal seconds, beside always guessing the commonest.
    pub over_majority: Paired,
    /// Mean over modes of the share of its seconds that were guessed, all modes being as likely before.
    pub balanced: f64,
    /// Balanced share over one second of each mode in each run, and an interval that holds with at least 95 % (the exact intervals
    /// of the modes, simultaneous after Bonferroni, and the mean of their ends).
    pub balanced_by_run: [f64; 3],
    /// Chance, for that: one in the number of modes.
    pub chance: f64,
    /// Mode by mode.
    pub rows: Vec<Row>,
}

/// Measures over `runs`; runs of even seeds are learned from. `None` when either half is empty.
pub fn measure(runs: &[Run], sees: Sees, seed: u64) -> Option<Leak> {
    let (learned, guessed): (Vec<&Run>, Vec<&Run>) = runs.iter().partition(|run| run.seed.is_multiple_of(2));
    let windows = |runs: &[&Run]| runs.iter().map(|run| run.windows.len()).sum::<usize>();
    let seconds = [windows(&learned), windows(&guessed)];
    if seconds.contains(&0) {
        return None;
    }
    let guess = Guess::learn(&learned.iter().flat_map(|run| &run.windows).collect::<Vec<_>>(), sees.features());
    let all: Vec<&Window> = guessed.iter().flat_map(|run| &run.windows).collect();
    let share = |right: &dyn Fn(&Window) -> bool| all.iter().filter(|w| right(w)).count() as f64 / all.len() as f64;
    let right = |window: &Window| guess.mode(window, Before::Share) == window.mode;
    let common = |window: &Window| guess.commonest() == window.mode;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let drawn: Vec<&Window> =
        guessed.iter().filter_map(|run| draw(&run.windows.iter().collect::<Vec<_>>(), &mut rng)).collect();
    let count = |of: &dyn Fn(&Window) -> bool| drawn.iter().filter(|window| of(window)).count() as u64;
    let rows = rows(&guess, &guessed, &mut rng);
    let [more, less] = [count(&|w| right(w) && !common(w)), count(&|w| !right(w) && common(w))];
    Some(Leak {
        sees,
        runs: [learned.len(), guessed.len()],
        seconds,
        accuracy: share(&right),
        commonest: guess.commonest(),
        majority: share(&common),
        by_run: Share::new(count(&right), drawn.len() as u64),
        over_majority: Paired::from_counts(drawn.len() as u64, more, less),
        balanced: mean(rows.iter().map(recall)),
        balanced_by_run: balanced(&rows),
        chance: 1.0 / rows.len().max(1) as f64,
        rows,
    })
}

/// One of `windows`, if there are any.
fn draw<'a>(windows: &[&'a Window], rng: &mut ChaCha8Rng) -> Option<&'a Window> {
    let drawn = rng.next_u64();
    windows.get(usize::try_from(drawn % windows.len().max(1) as u64).ok()?).copied()
}

fn rows(guess: &Guess, runs: &[&Run], rng: &mut ChaCha8Rng) -> Vec<Row> {
    let mut rows = Vec::new();
    for mode in Mode::ALL {
        let (mut guessed, mut hits, mut n) = (BTreeMap::new(), 0, 0);
        for run in runs {
            let of_mode: Vec<&Window> = run.windows.iter().filter(|window| window.mode == mode).collect();
            for window in &of_mode {
                *guessed.entry(guess.mode(window, Before::Equal).name()).or_default() += 1;
            }
            if let Some(window) = draw(&of_mode, rng) {
                n += 1;
                hits += u64::from(guess.mode(window, Before::Equal) == mode);
            }
        }
        if n > 0 {
            rows.push(Row { mode, guessed, by_run: Share::new(hits, n) });
        }
    }
    rows
}

/// Share of a mode's seconds that were guessed right.
fn recall(row: &Row) -> f64 {
    let hits = row.guessed.get(row.mode.name()).copied().unwrap_or_default();
    hits as f64 / row.guessed.values().sum::<u64>().max(1) as f64
}

/// Mean of the modes' shares over runs, and of the ends of intervals that hold together.
fn balanced(rows: &[Row]) -> [f64; 3] {
    let each_side = 0.5 * (1.0 + simultaneous_level(rows.len(), LEVEL));
    let of = |end: &dyn Fn(u64, u64) -> f64| mean(rows.iter().map(|row| end(row.by_run.hits, row.by_run.n)));
    [
        of(&|hits, n| hits as f64 / n as f64),
        of(&|hits, n| rate_lower(hits, n, each_side)),
        of(&|hits, n| rate_upper(hits, n, each_side)),
    ]
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len().max(1) as f64;
    values.sum::<f64>() / n
}

#[cfg(test)]
mod tests {
    use super::super::FEATURES;
    use super::*;

    const MODES: [Mode; 3] = [Mode::Ready, Mode::Degraded, Mode::HoldSafe];

    /// Runs whose modes change, in which the length of a piece is the mode's own, or independent of it.
    fn runs(telling: bool) -> Vec<Run> {
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        let mut window = |n: usize| {
            // READY in half of the seconds, so that the commonest mode is one.
            let mode = MODES[[0, 1, 0, 2][n % 4]];
            let mut features = [0.0; FEATURES];
            features.iter_mut().for_each(|feature| *feature = f64::from(rng.next_u32() % 100));
            features[2] += if telling { 1_000.0 * f64::from(mode as u8) } else { 0.0 };
            Window { mode, features }
        };
        (0..200).map(|seed| Run { seed, windows: (0..12).map(&mut window).collect() }).collect()
    }

    /// Lengths that give the mode away make the guess right, and only for an observer that sees that link.
    #[test]
    fn telling_lengths_are_guessed_on_their_link_only() {
        let leak = measure(&runs(true), Sees::Telemetry, 1).expect("both halves have runs");
        assert!(leak.accuracy > 0.99 && leak.balanced > 0.99, "{leak:?}");
        assert!(leak.by_run.lower_95 > 0.9 && leak.balanced_by_run[1] > 0.9, "{leak:?}");
        assert!(leak.over_majority.interval_95[0] > 0.2 && leak.over_majority.p < 1e-6, "{leak:?}");
        let other = measure(&runs(true), Sees::Command, 1).expect("both halves have runs");
        assert!(other.balanced < 0.45, "{other:?}");
        let both = measure(&runs(true), Sees::Both, 1).expect("both halves have runs");
        assert!(both.accuracy > 0.9, "{both:?}");
    }

    #[test]
    fn where_lengths_say_nothing_the_guess_is_chance() {
        let leak = measure(&runs(false), Sees::Both, 1).expect("both halves have runs");
        assert!((leak.accuracy - leak.majority).abs() < 0.03, "{leak:?}");
        assert!((leak.majority - 0.5).abs() < 1e-9 && leak.commonest == Mode::Ready, "{leak:?}");
        assert!((leak.balanced - leak.chance).abs() < 0.03, "{leak:?}");
        let [_, lower, upper] = leak.balanced_by_run;
        assert!(lower < leak.chance && leak.chance < upper, "{leak:?}");
        assert!(leak.over_majority.p > 0.05, "{leak:?}");
    }

    /// Half a set of runs gives no measurement.
    #[test]
    fn measurement_is_reproducible_by_seed() {
        assert_eq!(measure(&runs(true), Sees::Both, 3), measure(&runs(true), Sees::Both, 3));
        let even: Vec<Run> = runs(true).into_iter().filter(|run| run.seed.is_multiple_of(2)).collect();
        assert_eq!(measure(&even, Sees::Both, 3), None);
        let leak = measure(&runs(true), Sees::Both, 3).expect("both halves have runs");
        assert_eq!((leak.runs, leak.seconds), ([100, 100], [1_200, 1_200]));
    }
}
