//! The trials of a campaign as `trials.parquet` in its folder, in a program that was built with feature `parquet`; in any
//! other the file is left out and a message says how to get it. Its columns are in `results::report`.

use std::path::Path;

use results::campaign::Plan;
use results::campaign::row::TrialRow;
use runner::failure::Failure;

/// True if this program writes the file.
pub(super) const IS_BUILT: bool = cfg!(feature = "parquet");

/// Message of a program that does not write the file.
pub(super) const LEFT_OUT: &str = "no trials.parquet: a program built with `--features parquet` writes it";

/// The file while it is written; it gets its name when it is whole.
#[cfg(feature = "parquet")]
pub(super) struct TrialFile<'p> {
    dir: &'p Path,
    rows: results::report::TrialTable<'p, std::fs::File>,
}

/// The file's place in a program that does not write it.
#[cfg(not(feature = "parquet"))]
pub(super) struct TrialFile;

#[cfg(feature = "parquet")]
impl<'p> TrialFile<'p> {
    /// Starts the file in `dir`.
    pub(super) fn create(dir: &'p Path, plan: &'p Plan) -> Result<Self, Failure> {
        let file = std::fs::File::create(dir.join("trials.parquet.new"))?;
        Ok(Self { dir, rows: results::report::TrialTable::new(file, plan).map_err(unwritable)? })
    }

    /// Adds trial `i` of variation `v`; in order.
    pub(super) fn add_trial(&mut self, v: usize, i: u64, row: &TrialRow) -> Result<(), Failure> {
        self.rows.put(v, i, row.clone()).map_err(unwritable)
    }

    /// Completes the file.
    pub(super) fn finish(self) -> Result<(), Failure> {
        self.rows.finish().map_err(unwritable)?;
        Ok(std::fs::rename(self.dir.join("trials.parquet.new"), self.dir.join("trials.parquet"))?)
    }
}

#[cfg(not(feature = "parquet"))]
impl TrialFile {
    /// Moves a file that another build left aside: its trials may be fewer than the trials of the result beside it.
    pub(super) fn create(dir: &Path, _: &Plan) -> Result<Self, Failure> {
        match std::fs::rename(dir.join("trials.parquet"), dir.join("trials.earlier.parquet")) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error.into()),
            Ok(()) | Err(_) => Ok(Self),
        }
    }

    /// Leaves a trial out.
    pub(super) fn add_trial(&mut self, _: usize, _: u64, _: &TrialRow) -> Result<(), Failure> {
        Ok(())
    }

    /// Ends without a file.
    pub(super) fn finish(self) -> Result<(), Failure> {
        Ok(())
    }
}

#[cfg(feature = "parquet")]
fn unwritable(error: results::report::TableError) -> Failure {
    Failure::new(runner::failure::Exit::Environment, error.to_string())
}
