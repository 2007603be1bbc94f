//! A reviewer's report, made from results as `holdsafe … --json` prints them and from no other source.
//!
//! Every output is a pure function of a [`Dossier`] or of its results, the bill of materials one of the lock that was built with: it
//! depends on no clock, no chance and no other file, so the same results give the same bytes. No code here judges a trial; of bounds it
//! computes the exact one on the share of a class, from the counts in the results.
//!
//! `reader` reads them as the objects that `results` defines, in which the summary of one run from its recording is defined too. `page`
//! makes the HTML file, `figure` its drawings, `files` the same as files. For other tools are `junit`, `sarif`, `navigator` and `sbom`, from
//! `tried`, one view of a variation's results. `evaluation` sets the paper's claims against results.

mod evaluation;
pub mod figure;
pub mod files;
mod junit;
mod navigator;
pub mod page;
#[cfg(feature = "pdf")]
pub mod pdf;
pub mod reader;
mod sarif;
mod sbom;
pub mod tried;

use std::collections::BTreeMap;

use results::summary::RunSummary;

pub use evaluation::evaluation;
pub use junit::junit;
pub use navigator::layers;
pub use sarif::sarif;
pub use sbom::sbom;

/// Everything that a dossier is made of.
#[derive(Clone, Debug, Default)]
pub struct Dossier {
    /// Subject, in a line; empty where the finding is enough.
    pub title: String,
    /// Version of the program that makes it.
    pub version: String,
    /// Results.
    pub results: reader::Results,
    /// Runs that are reported one by one.
    pub stories: Vec<RunSummary>,
    /// Names of those that are trials of the results, each by the SHA-256 of its `held.json`.
    pub kept: BTreeMap<String, String>,
    /// Folder of each run that is reported, by its name.
    pub folders: BTreeMap<String, String>,
    /// Watermarks of ablations among the results, by the manifests beside them.
    pub watermarks: Vec<String>,
    /// Seconds after which a browser reads the page again.
    pub renew_s: Option<u32>,
    /// Every recording that was read or lies among the results, whether its run is reported or not.
    pub recordings: Vec<Recording>,
}

/// A recording behind results or runs over time, and its verification.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Its folder.
    pub name: String,
    /// SHA-256 of its files, one behind the other.
    pub sha256: String,
    /// True if its chains, signatures, seals and heads hold.
    pub holds: bool,
    /// The class in which its trial ended, where that is reported.
    pub outcome: Option<String>,
    /// Reason for which it is INVALID, by its verification or by the class of its trial; `None` if it is valid.
    pub invalid: Option<String>,
}
