//! Context of every verb beside its own arguments.

use std::path::{Path, PathBuf};

use parallel::progress::{Stop, Talk};
use results::catalogue::Catalogue;
use scenario::{Problems, Scenario};

use crate::failure::{Exit, Failure};
use crate::shipped::Shipped;

/// Context of a verb beside its own arguments.
#[derive(Clone, Debug)]
pub struct Context {
    /// True if results are printed as one JSON object.
    pub json: bool,
    /// Base seed; trial i has seed + i.
    pub seed: u64,
    /// True if the command line names it.
    pub seed_is_named: bool,
    /// Verbosity on stderr.
    pub talk: Talk,
    /// The directory with the scenarios, where it was named.
    pub root: Option<PathBuf>,
    /// The user's request to stop.
    pub stop: Stop,
    /// Start of the command on the clock of traces, microseconds; for the terminal only.
    pub started_us: u64,
    /// SHA-256 over the sources of the program.
    pub program: &'static str,
    /// Files that the program brings, for where no directory has them.
    pub shipped: Shipped,
}

/// The directory with the scenarios, by the reason for it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Root {
    /// Named with `--root`.
    Named(PathBuf),
    /// A checkout: this directory, or the nearest one above.
    Checkout(PathBuf),
    /// The program's own files, unpacked. No result is written there, and no other machine has it.
    BuiltIn(PathBuf),
}

impl Root {
    /// The directory.
    pub fn path(&self) -> &Path {
        let (Root::Named(path) | Root::Checkout(path) | Root::BuiltIn(path)) = self;
        path
    }
}

/// Seeds that are drawn from the program's sources: the first, above all that tests name; the step, longer than any command's trials; their
/// number.
const FRESH: (u64, u64, u64) = (1_000_000_000, 1_000_000, 9_000);
impl Context {
    /// This context with a base seed that nobody can have tried before the program was written: the named one, or else one drawn from the
    /// digest of the program's sources.
    pub fn with_fresh_seed(&self) -> Self {
        let (first, step, count) = FRESH;
        let digest = self.program.get(..8).and_then(|hex| u64::from_str_radix(hex, 16).ok());
        let drawn = digest.filter(|_| !self.seed_is_named).map(|digest| first + digest % count * step);
        Self { seed: drawn.unwrap_or(self.seed), ..self.clone() }
    }

    /// The named root; else a checkout here or above; else the program's own files.
    ///
    /// # Errors
    /// There is none of these, or the files cannot be unpacked.
    pub fn choose_root(&self) -> Result<Root, Failure> {
        if let Some(root) = &self.root {
            return Ok(Root::Named(root.clone()));
        }
        let directory = std::env::current_dir().ok();
        if let Some(checkout) = directory.and_then(|directory| scenario::find_root(&directory)) {
            return Ok(Root::Checkout(checkout));
        }
        let none = "no scenarios/ and platforms/ here or above; name their directory with --root DIR";
        let built_in = self.shipped.folder().unwrap_or_else(|| Err(Failure::new(Exit::Usage, none)));
        built_in.map(Root::BuiltIn)
    }

    /// The directory with the scenarios.
    ///
    /// # Errors
    /// As [`Context::choose_root`].
    pub fn root(&self) -> Result<PathBuf, Failure> {
        Ok(self.choose_root()?.path().to_owned())
    }

    /// The folder of runs without an `--out`: below a named root or a checkout, else below the current directory.
    ///
    /// # Errors
    /// As [`Context::choose_root`], or there is no current directory.
    pub fn runs_folder(&self) -> Result<PathBuf, Failure> {
        let above = match self.choose_root()? {
            Root::Named(root) | Root::Checkout(root) => root,
            Root::BuiltIn(_) => std::env::current_dir()?,
        };
        Ok(above.join("runs"))
    }

    /// A command of this program to go on with, quoted for a shell: the program as it was called, and the root where it was named.
    pub fn command<'a>(&self, words: impl IntoIterator<Item = &'a str>) -> String {
        let words: Vec<String> = words.into_iter().map(quoted).collect();
        self.own_command(&words.join(" "))
    }

    /// As [`Context::command`], of arguments that are quoted already; a line of `holdsafe …` may be given too.
    pub fn own_command(&self, arguments: &str) -> String {
        let arguments = arguments.strip_prefix("holdsafe ").unwrap_or(arguments);
        let program = std::env::args_os().next().unwrap_or_else(|| "holdsafe".into());
        let root = self.root.as_ref().map(|root| format!(" --root {}", quoted(&root.to_string_lossy())));
        format!("{} {arguments}{}", quoted(&program.to_string_lossy()), root.unwrap_or_default())
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

/// The command line of this process, quoted for a shell.
pub fn own_line() -> String {
    std::env::args_os().map(|word| quoted(&word.to_string_lossy())).collect::<Vec<_>>().join(" ")
}

/// The arguments of this process with `more` behind them, quoted for a shell; without a root, which a next command names anyway.
pub fn own_arguments(more: &[&str]) -> String {
    let mut words: Vec<String> = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect();
    if let Some(place) = words.iter().position(|word| word == "--root") {
        words.drain(place..words.len().min(place + 2));
    }
    words.retain(|word| !word.starts_with("--root="));
    words.extend(more.iter().map(|word| (*word).to_owned()));
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

/// One argument of a command line, quoted for a shell.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,@%+".contains(c);
    match word.chars().all(plain) && !word.is_empty() {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}
