//! Recorded runs in a directory, for every command that takes one: the folder of one trial, of a scenario, or of a whole `--out`.
//! Verification is left to [`crate::checked`].

use std::fs;
use std::path::Path;

use crate::error::RecordingError;
use crate::layout::RunFolder;

/// Depth of the search: a trial is four levels below the folder of `--out` (mode, scenario, cell, seed), and a folder of several
/// `--out` is one level above.
const MAX_DEPTH: usize = 6;
/// Folders that the search reads at most.
const MAX_FOLDERS: usize = 10_000;
/// Runs that are listed.
const MAX_LISTED: usize = 20;

/// The folders of single runs at or below `dir`, in the order of their names. Folders aside and links are left out.
///
/// # Errors
/// When `dir` cannot be read, or more folders are below it than the search reads.
pub fn find_runs(dir: &Path) -> Result<Vec<RunFolder>, RecordingError> {
    let mut found = Vec::new();
    let mut left = MAX_FOLDERS;
    search(dir, MAX_DEPTH, &mut left, &mut found)?;
    Ok(found)
}

fn search(dir: &Path, depth: usize, left: &mut usize, found: &mut Vec<RunFolder>) -> Result<(), RecordingError> {
    let run = RunFolder::new(dir);
    if run.is_run() {
        found.push(run);
        return Ok(());
    }
    let too_many = || RecordingError::TooManyFolders { path: dir.to_owned(), most: MAX_FOLDERS };
    *left = left.checked_sub(1).ok_or_else(too_many)?;
    if depth == 0 {
        return Ok(());
    }
    let unreadable =
        |error: std::io::Error| RecordingError::NotOneRun { path: dir.to_owned(), message: error.to_string() };
    let mut subfolders = Vec::new();
    for entry in fs::read_dir(dir).map_err(unreadable)? {
        let entry = entry.map_err(unreadable)?;
        // A link may lead out of the directory or in a circle.
        if entry.file_type().map_err(unreadable)?.is_dir() && !RunFolder::new(entry.path()).is_aside() {
            subfolders.push(entry.path());
        }
    }
    // Seeds by their number: the tenth comes after the second.
    subfolders
        .sort_by_key(|path| (path.file_name().is_some_and(is_number).then_some(path.as_os_str().len()), path.clone()));
    subfolders.iter().try_for_each(|path| search(path, depth - 1, left, found))
}

fn is_number(name: &std::ffi::OsStr) -> bool {
    name.as_encoded_bytes().iter().all(u8::is_ascii_digit)
}

/// The folder of the one run at or below `dir`.
///
/// # Errors
/// When there is none, or several: these are then named.
pub fn find_one_run(dir: &Path) -> Result<RunFolder, RecordingError> {
    let refused = |message: String| RecordingError::NotOneRun { path: dir.to_owned(), message };
    if !dir.is_dir() {
        let message = if dir.exists() { "not a run directory" } else { "no such run directory" };
        return Err(refused(format!("{message}; name the directory that `run … --out DIR` made")));
    }
    let mut found = find_runs(dir)?;
    match found.as_slice() {
        [] => Err(refused(
            "no recorded run at or below it; name the directory of one run, as `run … --out DIR` makes (`recording/` is in it)"
                .to_owned(),
        )),
        [_] => Ok(found.remove(0)),
        several => {
            let named: Vec<String> = several.iter().take(MAX_LISTED).map(|run| format!("  {}", run.path().display())).collect();
            let more = several.len().saturating_sub(MAX_LISTED);
            let more = if more > 0 { format!("\n  and {more} more") } else { String::new() };
            let n = several.len();
            Err(refused(format!("{n} recorded runs; name the directory of one run:\n{}{more}", named.join("\n"))))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Several runs are each named.
    #[test]
    fn trial_is_found_from_any_level() {
        let root = tempfile::tempdir().expect("a folder");
        let trial = |name: &str| {
            let path = root.path().join(name);
            fs::create_dir_all(path.join("recording")).expect("a folder");
            fs::write(path.join("held.json"), "{}").expect("a file");
            RunFolder::new(path)
        };
        let first = trial("x/live/loss/1");
        for level in ["x/live/loss/1", "x/live/loss", "x/live", "x", ""] {
            assert_eq!(find_one_run(&root.path().join(level)).expect("one run"), first, "{level}");
        }
        let (tenth, second) = (trial("x/live/loss/10"), trial("x/live/loss/2"));
        assert_eq!(find_runs(root.path()).expect("three"), [first.clone(), second, tenth.clone()]);
        let error = find_one_run(root.path()).expect_err("three").to_string();
        assert!(
            error.contains(&first.path().display().to_string()) && error.contains(&tenth.path().display().to_string()),
            "{error}"
        );
        let empty = root.path().join("x/live/loss/1/recording");
        assert!(find_one_run(&empty).expect_err("no run").to_string().contains("name the directory of one run"));
        assert!(find_one_run(&root.path().join("none")).is_err());
        // A corpus may have a folder of that name; none of a run's files is beside it.
        fs::create_dir_all(root.path().join("y/corpus/recording")).expect("a folder");
        assert!(find_one_run(&root.path().join("y")).is_err());
    }

    #[test]
    fn a_link_in_a_circle_is_not_followed() {
        let root = tempfile::tempdir().expect("a folder");
        std::os::unix::fs::symlink(root.path(), root.path().join("again")).expect("a link");
        assert_eq!(find_runs(root.path()).expect("nothing"), Vec::<RunFolder>::new());
    }
}
