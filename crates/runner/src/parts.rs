//! `--partition` and `--from`: a command's trials on several machines, and their results put together.
//!
//! A partition runs its share of the trials and keeps them (`kept`). The command itself, given the folders of all partitions, finds
//! nothing left to run, and what is lost it runs itself: so no order, repetition or loss of partitions can change a result.

use std::path::{Path, PathBuf};

use results::campaign::partition::Partition;
use serde::Serialize;

use super::failure::Failure;
use super::{Context, out};

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

/// Answer of a partition to other programs.
#[derive(Serialize)]
struct Told<'a> {
    directory: &'a Path,
}

impl Parts {
    /// Twin trials at a time.
    pub fn threads(&self) -> usize {
        self.threads.map_or_else(parallel::cores, usize::from)
    }

    /// True if the work of this number is to be done.
    pub fn holds(&self, number: u64) -> bool {
        self.partition.is_none_or(|partition| partition.holds(number))
    }

    /// Says where the trials of a partition are.
    pub fn tell(&self, context: &Context, directory: &Path) -> Result<(), Failure> {
        if context.json {
            return out::print_json("partition", &Told { directory });
        }
        let folder = super::quoted(&directory.to_string_lossy());
        out::say(format_args!("its trials are kept; to put the parts together: the same command with --from {folder}"));
        Ok(())
    }
}
