//! Recorded runs in a directory, for every command that takes one: the folder of one trial, that of a scenario, or the whole
//! of an `--out`. Verification is left to `checked`.

use std::fs;
use std::path::{Path, PathBuf};

use super::failure::{Exit, Failure};
use super::recording;

/// From the folder of `--out` to a trial are four levels (mode, scenario, cell, seed); a folder of several such is one more.
const DEEPEST: usize = 6;
/// Folders that are looked into.
const MOST: usize = 10_000;
/// Trials that are listed.
const LISTED: usize = 20;

/// Files beside a trial's recording; some are there even if others were removed.
const BESIDE: [&str; 4] = ["held.json", "events.jsonl", "site.json", "verdict.json"];

/// True if this is the folder of one trial. A live one has its site and input journals before anything is recorded.
pub(crate) fn is_trial(dir: &Path) -> bool {
    let has = |folder: &str| dir.join(folder).is_dir();
    (has("recording") || has("mouth")) && BESIDE.iter().any(|file| dir.join(file).is_file())
}

/// The folders of single trials at or below `dir`, in the order of their names.
///
/// # Errors
/// When `dir` cannot be read, or more lies below it than is looked into.
pub fn below(dir: &Path) -> Result<Vec<PathBuf>, Failure> {
    let mut found = Vec::new();
    let mut left = MOST;
    look(dir, DEEPEST, &mut left, &mut found)?;
    Ok(found)
}

fn look(dir: &Path, deep: usize, left: &mut usize, found: &mut Vec<PathBuf>) -> Result<(), Failure> {
    if is_trial(dir) {
        found.push(dir.to_owned());
        return Ok(());
    }
    *left = left.checked_sub(1).ok_or_else(|| {
        let message = format!("more than {MOST} folders below {}; name the directory of one run", dir.display());
        Failure::new(Exit::Usage, message)
    })?;
    if deep == 0 {
        return Ok(());
    }
    let unreadable = |e: std::io::Error| Failure::new(Exit::Usage, format!("{}: {e}", dir.display()));
    let mut inside = Vec::new();
    for entry in fs::read_dir(dir).map_err(unreadable)? {
        let entry = entry.map_err(unreadable)?;
        // A link may lead anywhere, in a circle too.
        if entry.file_type().map_err(unreadable)?.is_dir() && !recording::is_aside(&entry.path()) {
            inside.push(entry.path());
        }
    }
    // Seeds by their number: the tenth comes behind the second.
    inside
        .sort_by_key(|path| (path.file_name().is_some_and(is_number).then_some(path.as_os_str().len()), path.clone()));
    inside.iter().try_for_each(|path| look(path, deep - 1, left, found))
}

fn is_number(name: &std::ffi::OsStr) -> bool {
    name.as_encoded_bytes().iter().all(u8::is_ascii_digit)
}

/// The one trial at or below `dir`.
///
/// # Errors
/// When there is none, or several: these are then named.
pub fn one(dir: &Path) -> Result<PathBuf, Failure> {
    let refused = |message: String| Failure::new(Exit::Usage, format!("{}: {message}", dir.display()));
    if !dir.is_dir() {
        let message = if dir.exists() { "not a run directory" } else { "no such run directory" };
        return Err(refused(format!("{message}; name the directory that `run … --out DIR` made")));
    }
    let mut found = below(dir)?;
    match found.as_slice() {
        [] => Err(refused(
            "no recorded run at or below it; name the directory of one run, as `run … --out DIR` makes (`recording/` is in it)"
                .to_owned(),
        )),
        [_] => Ok(found.remove(0)),
        several => {
            let named: Vec<String> = several.iter().take(LISTED).map(|run| format!("  {}", run.display())).collect();
            let more = several.len().saturating_sub(LISTED);
            let more = if more > 0 { format!("\n  and {more} more") } else { String::new() };
            let n = several.len();
            Err(refused(format!("{n} recorded runs; name the directory of one run:\n{}{more}", named.join("\n"))))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of several each is named.
    #[test]
    fn trial_is_found_from_any_level() {
        let root = tempfile::tempdir().expect("a folder");
        let trial = |name: &str| {
            let path = root.path().join(name);
            fs::create_dir_all(path.join("recording")).expect("a folder");
            fs::write(path.join("held.json"), "{}").expect("a file");
            path
        };
        let first = trial("x/live/loss/1");
        for level in ["x/live/loss/1", "x/live/loss", "x/live", "x", ""] {
            assert_eq!(one(&root.path().join(level)).expect("one run"), first, "{level}");
        }
        let (tenth, second) = (trial("x/live/loss/10"), trial("x/live/loss/2"));
        assert_eq!(below(root.path()).expect("three"), [first.clone(), second, tenth.clone()]);
        let told = one(root.path()).expect_err("three").to_string();
        assert!(told.contains(&first.display().to_string()) && told.contains(&tenth.display().to_string()), "{told}");
        let empty = root.path().join("x/live/loss/1/recording");
        assert!(one(&empty).expect_err("no run").to_string().contains("name the directory of one run"));
        assert!(one(&root.path().join("none")).is_err());
        // As a corpus may be named.
        fs::create_dir_all(root.path().join("y/corpus/recording")).expect("a folder");
        assert!(one(&root.path().join("y")).is_err());
    }

    #[test]
    fn a_link_in_a_circle_is_not_followed() {
        let root = tempfile::tempdir().expect("a folder");
        std::os::unix::fs::symlink(root.path(), root.path().join("again")).expect("a link");
        assert_eq!(below(root.path()).expect("nothing"), Vec::<PathBuf>::new());
    }
}
