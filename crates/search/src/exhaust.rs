//! Every word over a small part of an alphabet: each move at its weakest and at its strongest, at the first moment and at
//! each change of mode, in words of up to k letters. So there is "none up to k" in place of "none found".

use super::moments::Moments;
use super::sequence::{Action, AttackSequence};
use super::tried::SearchConfig;

impl SearchConfig {
    /// The words of exactly `k` letters; none where there are more than `most` of them.
    pub fn words(&self, k: usize, moments: &Moments, most: usize) -> Option<Vec<AttackSequence>> {
        let letters = self.letters(moments);
        if choices(letters.len(), k).is_none_or(|n| n > most) {
            return None;
        }
        let mut words = vec![Vec::new()];
        for _ in 0..k {
            // Letters in rising order: each set of them once.
            let longer = words.iter().flat_map(|word: &Vec<usize>| {
                let from = word.last().map_or(0, |last| last + 1);
                (from..letters.len()).map(move |next| word.iter().copied().chain([next]).collect::<Vec<usize>>())
            });
            words = longer.collect();
        }
        let word = |chosen: Vec<usize>| AttackSequence::new(chosen.into_iter().map(|i| letters[i].clone()).collect());
        Some(words.into_iter().map(word).collect())
    }

    fn letters(&self, moments: &Moments) -> Vec<Action> {
        let (first, _) = self.alphabet.begins();
        let begins: Vec<u32> = std::iter::once(first).chain(moments.changes.iter().copied()).collect();
        let mut letters = Vec::new();
        for (kind, table) in self.alphabet.moves.iter().enumerate() {
            let (weakest, strongest) = (vec![0; table.ranges().count()], table.strongest());
            for begins in &begins {
                letters.extend([&weakest, &strongest].map(|places| Action {
                    begins: *begins,
                    kind,
                    places: places.clone(),
                }));
            }
        }
        letters.sort();
        letters.dedup();
        letters
    }
}

/// Number of sets of `k` out of `n`; `None` where that overflows.
fn choices(n: usize, k: usize) -> Option<usize> {
    (0..k).try_fold(1_usize, |sets, i| Some(sets.checked_mul(n.checked_sub(i)?)? / (i + 1)))
}

#[cfg(test)]
mod tests {
    use super::choices;

    #[test]
    fn sets_are_counted_without_making_them() {
        assert_eq!([choices(5, 0), choices(5, 2), choices(5, 5), choices(2, 3)], [Some(1), Some(10), Some(1), Some(0)]);
        assert_eq!(choices(usize::MAX, 2), None);
    }
}
