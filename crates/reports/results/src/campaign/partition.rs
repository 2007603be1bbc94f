//! One of n parts of a campaign, a pure function of trial numbers: the assignment of trials.

use core::str::FromStr;

use super::MAX_TRIALS;

/// Every n-th trial of a campaign, so that all parts are equally long, and each variation's share of them too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Partition {
    part: u64,
    of: u64,
}

impl Partition {
    /// The only part.
    pub const WHOLE: Partition = Partition { part: 0, of: 1 };

    /// True if the trial of this number belongs to it.
    pub fn holds(self, number: u64) -> bool {
        number % self.of == self.part
    }

    /// True if it is all there is.
    pub fn is_whole(self) -> bool {
        self.of == 1
    }
}

impl FromStr for Partition {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts =
            text.split_once('/').and_then(|(i, name)| Some((i.parse::<u64>().ok()?, name.parse::<u64>().ok()?)));
        match parts {
            Some((i, of)) if (1..=of).contains(&i) && of <= MAX_TRIALS => Ok(Self { part: i - 1, of }),
            Some(_) | None => Err(format!("a partition is i/N, from 1/N to N/N, N at most {MAX_TRIALS}")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::example::plan;
    use super::*;

    /// Over the campaign and within each variation.
    #[test]
    fn parts_partition_trials_evenly() {
        for (trials, of) in [(10, 7), (299, 7), (3, 7), (100, 2), (7, 1)] {
            let plan = plan(trials);
            let parts: Vec<Partition> = (1..=of).map(|i| format!("{i}/{of}").parse().unwrap()).collect();
            let mut counts = vec![[0u64; 2]; parts.len()];
            for number in 0..plan.total() {
                let holders: Vec<usize> = (0..parts.len()).filter(|p| parts[*p].holds(number)).collect();
                assert_eq!(holders.len(), 1, "trial {number} of {of} parts");
                counts[holders[0]][plan.place(number).0] += 1;
            }
            let even = |all: Vec<u64>| all.iter().max().unwrap() - all.iter().min().unwrap() <= 1;
            assert!(even(counts.iter().map(|c| c[0] + c[1]).collect()) && even(counts.iter().map(|c| c[1]).collect()));
        }
        for wrong in ["0/7", "8/7", "1", "a/b", "1/0"] {
            assert!(wrong.parse::<Partition>().is_err(), "{wrong}");
        }
    }
}
