//! Files that no report replaces: those of a recorded trial, and the results of a run.

use std::fs;
use std::path::Path;

use super::failure::{Exit, Failure};
use super::{out, runs};

/// Folders between a file of a recorded trial and that of the trial, and one more.
const TRIAL_DEPTH: usize = 4;
/// Endings of the files beside a manifest that are results.
const EVIDENCE: [&str; 4] = ["json", "jsonl", "parquet", "mcap"];

/// Checks that a report may be written to `path`: it is in no recorded trial, and replaces no file of a run.
///
/// # Errors
/// It would change evidence; links are followed.
pub fn evidence(path: &Path) -> Result<(), Failure> {
    let refused = |what: String| {
        let message = format!("{}: {what}, which no report replaces; name another file", path.display());
        Err(Failure::new(Exit::Usage, message))
    };
    // The file may not be there yet; what it leads to counts.
    let whole = match fs::canonicalize(path) {
        Ok(whole) => whole,
        Err(_) => {
            let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let Ok(parent) = fs::canonicalize(parent) else { return Ok(()) };
            parent.join(path.file_name().unwrap_or_default())
        }
    };
    let mut around = whole.ancestors().skip(1).take(TRIAL_DEPTH);
    if let Some(trial) = around.find(|dir| runs::is_trial(dir)) {
        return refused(format!("it lies in the recorded run {}", trial.display()));
    }
    if whole.is_dir() {
        return refused("it is a folder".to_owned());
    }
    let beside = |name: &str| whole.with_file_name(name).exists();
    let ending = whole.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    let of_a_run = whole.exists() && (beside(out::MANIFEST) || beside("plan.json")) && EVIDENCE.contains(&ending);
    if of_a_run { refused("it is a result of a run".to_owned()) } else { Ok(()) }
}
