//! `--partition` and `--from`: a command's trials on several machines, and their results put together.
//!
//! A partition runs its share of the trials and keeps them (`trial_store`). The command itself, given the folders of all partitions, runs
//! only trials that are missing, so no order, repetition or loss of partitions can change a result.

use std::path::PathBuf;

use results::campaign::partition::Partition;

/// The options.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct Parts {
    /// Run and keep only part i of N; the same command with --from puts the parts together.
    #[arg(long, value_name = "i/N", conflicts_with = "from")]
    pub partition: Option<Partition>,
    /// Take the finished trials of a partition's folder too, so that only trials that are nowhere run; may be repeated.
    #[arg(long, value_name = "DIR")]
    pub from: Vec<PathBuf>,
    /// Twin trials at a time [default: as many as there are cores].
    #[arg(long, value_name = "J", value_parser = clap::value_parser!(u16).range(1..=1_024))]
    pub threads: Option<u16>,
}

impl Parts {
    /// Twin trials at a time.
    pub fn threads(&self) -> usize {
        self.threads.map_or_else(parallel::cores, usize::from)
    }

    /// True if the work of this number is in the partition.
    pub fn holds(&self, number: u64) -> bool {
        self.partition.is_none_or(|partition| partition.holds(number))
    }
}
