//! A reviewer's report, made from results as `holdsafe … --json` prints them and from no other source.
//!
//! Every output is a pure function of a [`Dossier`] or of its results, the bill of materials one of the lock that was built with: it
//! depends on no clock, no chance and no other file, so the same results give the same bytes. No code here judges a trial or computes a
//! bound; a report adds no statement to its results.
//!
//! `results` reads, `objects` and `measured` are the inputs; `summary` is the summary of one run, from its recording. `page` makes the HTML
//! file, `figure` its drawings, `files` the same as files. For other tools are `junit`, `sarif`, `navigator` and `sbom`, from `tried`, one
//! view of a variation's results. `evaluation` sets the paper's claims against results.

mod evaluation;
pub mod figure;
pub mod files;
mod junit;
pub mod measured;
mod navigator;
pub mod objects;
pub mod page;
#[cfg(feature = "pdf")]
pub mod pdf;
pub mod results;
mod sarif;
mod sbom;
pub mod summary;
pub mod tried;

pub use evaluation::evaluation;
pub use junit::junit;
pub use navigator::layers;
pub use sarif::sarif;
pub use sbom::sbom;

/// Everything that a dossier is made of.
#[derive(Clone, Debug, Default)]
pub struct Dossier {
    /// Subject, in a line.
    pub title: String,
    /// Version of the program that makes it.
    pub version: String,
    /// Results.
    pub results: results::Results,
    /// Runs that are told one by one.
    pub stories: Vec<summary::RunSummary>,
    /// Every recording that was read or lies among the results, whether its run is told or not.
    pub recordings: Vec<summary::Recording>,
}
