//! Context of every verb beside its own arguments.

use std::path::{Path, PathBuf};

use parallel::progress::{Stop, Talk};
use results::catalogue::Catalogue;
use scenario::{Problems, Scenario};

use crate::failure::{Exit, Failure};

/// Context of a verb beside its own arguments.
#[derive(Clone, Debug)]
pub struct Context {
    /// True if results are printed as one JSON object.
    pub json: bool,
    /// Base seed; trial i has seed + i.
    pub seed: u64,
    /// Verbosity on stderr.
    pub talk: Talk,
    /// The directory with the scenarios, where it was named.
    pub root: Option<PathBuf>,
    /// The user's request to stop.
    pub stop: Stop,
    /// SHA-256 over the sources of the program.
    pub program: &'static str,
}

impl Context {
    /// The directory with the scenarios.
    ///
    /// # Errors
    /// There is none here or above.
    pub fn root(&self) -> Result<PathBuf, Failure> {
        let found = match &self.root {
            Some(root) => Some(root.clone()),
            None => std::env::current_dir().ok().and_then(|here| scenario::find_root(&here)),
        };
        found.ok_or_else(|| {
            Failure::new(
                Exit::Usage,
                "no scenarios/ and platforms/ here or above; name their directory with --root DIR",
            )
        })
    }

    /// The scenario in this file, which may extend the shipped ones.
    ///
    /// # Errors
    /// Every problem found in it.
    pub fn scenario(&self, file: &Path) -> Result<Scenario, Problems> {
        scenario::load_with(file, self.root().ok().as_deref())
    }

    /// The threat catalogue, and every shipped scenario.
    ///
    /// # Errors
    /// A file of them cannot be used.
    pub fn catalogue(&self) -> Result<(Catalogue, Vec<Scenario>), Failure> {
        let files = scenario::shipped(&self.root()?)?;
        let scenarios = files.iter().map(|file| scenario::load(file)).collect::<Result<_, _>>()?;
        Ok((Catalogue::load()?, scenarios))
    }
}

/// The line that this process was started with, as a shell takes it.
pub fn own_line() -> String {
    std::env::args_os().map(|word| quoted(&word.to_string_lossy())).collect::<Vec<_>>().join(" ")
}

/// One word of a line, as a shell takes it.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,@%+".contains(c);
    match word.chars().all(plain) && !word.is_empty() {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}
