//! Files that no report replaces: the files of a recorded trial, and the results of a run.

use std::fs;
use std::path::{Path, PathBuf};

use recording::RunFolder;

use super::failure::{Exit, Failure};
use super::out;

/// Folders between a file of a recorded trial and the trial's folder, and one more.
const TRIAL_DEPTH: usize = 4;
/// Endings of the files beside a manifest that are results.
const EVIDENCE: [&str; 4] = ["json", "jsonl", "parquet", "mcap"];

/// Checks that a report may be written to `path`, which an option named: it is none of the files that are read for it, lies in no recorded
/// trial, and replaces no result of a run.
///
/// # Errors
/// It would change evidence or its own input; links are followed.
pub fn check_report_path<'a>(
    option: &str,
    path: &Path,
    inputs: impl IntoIterator<Item = &'a Path>,
) -> Result<(), Failure> {
    let refused = |reason: String| {
        let message = format!("{option} {}: {reason}; name another file", path.display());
        Err(Failure::new(Exit::Usage, message))
    };
    let places = places(path);
    let Some(whole) = places.first() else { return Ok(()) };
    let is_read = |input: &PathBuf| {
        let is_run = RunFolder::new(input).is_run();
        places.iter().any(|place| place == input || is_run && place.starts_with(input))
    };
    if let Some(input) = inputs.into_iter().filter_map(|input| fs::canonicalize(input).ok()).find(is_read) {
        return refused(format!("{} is read for it", input.display()));
    }
    let mut parents = whole.ancestors().skip(1).take(TRIAL_DEPTH);
    if let Some(trial) = parents.find(|dir| RunFolder::new(*dir).is_run()) {
        return refused(format!("it lies in the recorded run {}, which no report changes", trial.display()));
    }
    if whole.is_dir() {
        return refused("it is a folder".to_owned());
    }
    let has_neighbour = |name: &str| whole.with_file_name(name).exists();
    let ending = whole.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    let is_result =
        whole.exists() && (has_neighbour(out::MANIFEST) || has_neighbour("plan.json")) && EVIDENCE.contains(&ending);
    if is_result { refused("it is a result of a run, which no report replaces".to_owned()) } else { Ok(()) }
}

/// The target of a path, if it exists, and the place of the path itself, by its folder.
fn places(path: &Path) -> Vec<PathBuf> {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let place = fs::canonicalize(parent).ok().zip(path.file_name()).map(|(parent, name)| parent.join(name));
    fs::canonicalize(path).into_iter().chain(place).collect()
}
