//! What a reviewer is handed, made from results as `holdsafe … --json` prints them and from nothing else.
//!
//! Every output is a pure function of a [`Dossier`]: no clock, no chance and no other file reaches it, so the same results
//! give the same bytes. Nothing here judges a trial or computes a bound; what a result does not say is not said.
//!
//! `results` reads, `objects` and `measured` are what is read; `story` is one run as whoever has its recording tells it. `page` makes the
//! HTML file, `figure` its drawings, `files` the same as files.

pub mod figure;
pub mod files;
pub mod measured;
pub mod objects;
pub mod page;
pub mod results;
pub mod story;

/// Everything that a dossier is made of.
#[derive(Clone, Debug, Default)]
pub struct Dossier {
    /// What it is about, in a line.
    pub title: String,
    /// Version of the program that makes it.
    pub version: String,
    /// Results.
    pub results: results::Results,
    /// Runs that are told one by one.
    pub stories: Vec<story::Story>,
}
