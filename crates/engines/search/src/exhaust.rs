//! Every sequence over a small part of an attack space: each move at its weakest and at its strongest, at the first moment and at
//! each change of mode, in sequences of up to k actions. So there is "none up to k" in place of "none found".

use super::moments::Moments;
use super::sequence::{Action, AttackSequence};
use super::tried::SearchConfig;

impl SearchConfig {
    /// The sequences of exactly `k` actions; none where there are more than `most` of them.
    pub fn sequences(&self, k: usize, moments: &Moments, most: usize) -> Option<Vec<AttackSequence>> {
        let actions = self.actions(moments);
        if choices(actions.len(), k).is_none_or(|n| n > most) {
            return None;
        }
        let mut sequences = vec![Vec::new()];
        for _ in 0..k {
            // Actions in rising order: each set of them once.
            let longer = sequences.iter().flat_map(|sequence: &Vec<usize>| {
                let from = sequence.last().map_or(0, |last| last + 1);
                (from..actions.len()).map(move |next| sequence.iter().copied().chain([next]).collect::<Vec<usize>>())
            });
            sequences = longer.collect();
        }
        let sequence =
            |chosen: Vec<usize>| AttackSequence::new(chosen.into_iter().map(|i| actions[i].clone()).collect());
        Some(sequences.into_iter().map(sequence).collect())
    }

    fn actions(&self, moments: &Moments) -> Vec<Action> {
        let (first, _) = self.space.begins();
        let begins: Vec<u32> = std::iter::once(first).chain(moments.changes.iter().copied()).collect();
        let mut actions = Vec::new();
        for (kind, table) in self.space.moves.iter().enumerate() {
            let (weakest, strongest) = (vec![0; table.ranges().count()], table.strongest());
            for begins in &begins {
                actions.extend([&weakest, &strongest].map(|places| Action {
                    begins: *begins,
                    kind,
                    places: places.clone(),
                }));
            }
        }
        actions.sort();
        actions.dedup();
        actions
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
