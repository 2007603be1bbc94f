//! A first-choice classifier: naive Bayes over features that are cut into bins where that tells modes apart (U. Fayyad
//! and K. Irani, *Multi-interval discretization of continuous-valued attributes for classification learning*, IJCAI
//! 1993: the cut that leaves the least entropy, as long as it is worth more than it costs to write down), each count
//! one higher than it is (Laplace). A feature that carries no information is not cut and has no say.
//!
//! It takes the features of a mode for independent, which they are not; a classifier without that assumption may guess
//! better. So its accuracy is a lower bound of the information in lengths and times.

use std::ops::Range;

use wire::mode::Mode;

use super::Window;

/// Cuts of a feature, at most.
const CUTS: usize = 32;
/// Modes there are.
const MODES: usize = Mode::ALL.len();

/// Prior of a guess.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Before {
    /// Its share of the training windows: makes the fewest mistakes.
    Share,
    /// An equal weight for every mode that was learned: makes no mode the loser of being rare.
    Equal,
}

/// A trained classifier.
#[derive(Clone, Debug)]
pub struct Guess {
    features: Range<usize>,
    /// Cuts of each feature.
    cuts: Vec<Vec<f64>>,
    /// Counts by feature, bin and mode.
    counts: Vec<Vec<[u64; MODES]>>,
    /// Windows by mode.
    windows: [u64; MODES],
}

impl Guess {
    /// Learns from windows, of each only these features.
    pub fn learn(windows: &[&Window], features: Range<usize>) -> Self {
        let cuts: Vec<Vec<f64>> = features.clone().map(|feature| cuts(windows, feature)).collect();
        let counts = cuts.iter().map(|cuts| vec![[0; MODES]; cuts.len() + 1]).collect();
        let mut this = Self { counts, features, cuts, windows: [0; MODES] };
        for window in windows {
            this.windows[window.mode as usize] += 1;
            for (n, bin) in this.bins(window).into_iter().enumerate() {
                this.counts[n][bin][window.mode as usize] += 1;
            }
        }
        this
    }

    /// The mode that was met most often.
    pub fn commonest(&self) -> Mode {
        likeliest(self.windows.map(|n| n as f64))
    }

    /// The likeliest mode of a window; the earlier of two that are as likely.
    pub fn mode(&self, window: &Window, before: Before) -> Mode {
        let bins = self.bins(window);
        let mut scores = [0.0; MODES];
        for (mode, score) in scores.iter_mut().enumerate().filter(|(mode, _)| self.windows[*mode] > 0) {
            let of = self.windows[mode] as f64;
            *score = if before == Before::Share { of } else { 1.0 };
            for (n, bin) in bins.iter().enumerate() {
                *score *= (self.counts[n][*bin][mode] + 1) as f64 / (of + (self.cuts[n].len() + 1) as f64);
            }
        }
        likeliest(scores)
    }

    fn bins(&self, window: &Window) -> Vec<usize> {
        let values = &window.features[self.features.clone()];
        self.cuts.iter().zip(values).map(|(cuts, value)| cuts.partition_point(|cut| cut < value)).collect()
    }
}

fn likeliest(scores: [f64; MODES]) -> Mode {
    let best = scores.iter().copied().fold(0.0, f64::max);
    Mode::ALL.into_iter().find(|mode| scores[*mode as usize] >= best).unwrap_or_default()
}

/// Cuts of `feature`, in order.
fn cuts(windows: &[&Window], feature: usize) -> Vec<f64> {
    let mut values: Vec<(f64, Mode)> = windows.iter().map(|w| (w.features[feature], w.mode)).collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut cuts = Vec::new();
    cut(&values, &mut cuts);
    cuts.sort_by(f64::total_cmp);
    cuts
}

/// Cuts `values` and then both parts, as long as that is worth it.
fn cut(values: &[(f64, Mode)], cuts: &mut Vec<f64>) {
    let whole = Part::from_values(values);
    let (mut below, mut best) = (Part::default(), None::<(f64, usize)>);
    for at in 1..values.len() {
        below.0[values[at - 1].1 as usize] += 1;
        if values[at - 1].0 < values[at].0 {
            let left = below.entropy() * at as f64 + whole.remove(&below).entropy() * (values.len() - at) as f64;
            if best.is_none_or(|(least, _)| left < least) {
                best = Some((left, at));
            }
        }
    }
    let Some((_, index)) = best.filter(|_| cuts.len() < CUTS) else { return };
    let (low, high) = values.split_at(index);
    if whole.is_worth([Part::from_values(low), Part::from_values(high)]) {
        cuts.push(values[index - 1].0);
        cut(low, cuts);
        cut(high, cuts);
    }
}

/// Counts of each mode in a part of the values.
#[derive(Clone, Copy, Debug, Default)]
struct Part([u64; MODES]);

impl Part {
    fn from_values(values: &[(f64, Mode)]) -> Self {
        let mut part = Self::default();
        values.iter().for_each(|(_, mode)| part.0[*mode as usize] += 1);
        part
    }

    fn remove(&self, other: &Part) -> Part {
        Part(std::array::from_fn(|mode| self.0[mode] - other.0[mode]))
    }

    fn len(&self) -> f64 {
        self.0.iter().sum::<u64>() as f64
    }

    fn modes(&self) -> f64 {
        self.0.iter().filter(|n| **n > 0).count() as f64
    }

    fn entropy(&self) -> f64 {
        let shares = self.0.iter().filter(|n| **n > 0).map(|n| *n as f64 / self.len());
        -shares.map(|share| share * libm::log2(share)).sum::<f64>()
    }

    /// True if a cut into these parts saves more than it costs to write down its place and the modes on either side.
    fn is_worth(&self, parts: [Part; 2]) -> bool {
        let n = self.len();
        let gain = self.entropy() - parts.iter().map(|part| part.entropy() * part.len() / n).sum::<f64>();
        let told = |part: &Part| part.modes() * part.entropy();
        let sides = libm::log2(libm::pow(3.0, self.modes()) - 2.0) - told(self) + parts.iter().map(told).sum::<f64>();
        gain * n > libm::log2(n - 1.0) + sides
    }
}
