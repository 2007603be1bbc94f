//! The files of a recording: those that were named, and of a bag's folder the ones that it was split into, in their order.
//!
//! Names come from the folder alone and not from its `metadata.yaml`, which could lead elsewhere. Nothing is parsed here.

use std::path::{Path, PathBuf};

use assess::log::MAX_LOG;
use runner::failure::{Exit, Failure};

/// Most files of a recording.
const MAX_FILES: usize = 1024;
/// Ends of the names of recordings, with the one packed as a whole behind each.
const ENDS: [&str; 6] = [".mcap", ".mcap.zst", ".mcap.zstd", ".ulg", ".ulg.zst", ".ulg.zstd"];

/// A file's name and bytes.
pub(super) type Named = (String, Vec<u8>);

/// Reads the files that these paths name, in their order.
pub(super) fn read(paths: &[PathBuf]) -> Result<Vec<Named>, Failure> {
    let mut files: Vec<Named> = Vec::new();
    let mut left = MAX_LOG;
    for path in paths {
        let parts = if path.is_dir() { of_folder(path)? } else { vec![path.clone()] };
        for part in parts {
            let bytes = super::read(&part, left)?;
            left -= bytes.len() as u64;
            let name =
                part.file_name().map_or_else(|| part.display().to_string(), |name| name.to_string_lossy().into_owned());
            files.push((name, bytes));
            if files.len() > MAX_FILES {
                return Err(Failure::new(Exit::Usage, format!("{}: more than {MAX_FILES} files", path.display())));
            }
        }
    }
    Ok(files)
}

/// Recordings in a folder. Files of another kind are handed on only without any, so that their own error is reported.
fn of_folder(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let failed = |reason: &dyn std::fmt::Display| Failure::new(Exit::Usage, format!("{}: {reason}", folder.display()));
    let entries = std::fs::read_dir(folder).map_err(|error| failed(&error))?.take(16 * MAX_FILES);
    let mut names: Vec<String> = Vec::new();
    for entry in entries {
        let entry = entry.map_err(|error| failed(&error))?;
        names.extend(entry.file_name().into_string().ok());
    }
    let with_ending = |ends: &[&str]| -> Vec<&String> {
        names.iter().filter(|name| ends.iter().any(|end| name.to_lowercase().ends_with(end))).collect()
    };
    let mut found = with_ending(&ENDS);
    if found.is_empty() {
        found = with_ending(&[".tlog", ".tlog.zst", ".tlog.zstd", ".db3", ".db3.zstd", ".bag"]);
    }
    if found.is_empty() {
        return Err(failed(
            &"a folder without a recording: expected files that end in .mcap, .ulg or .tlog, be it with .zst behind it",
        ));
    }
    found.sort_by_cached_key(|name| in_order(name));
    Ok(found.into_iter().map(|name| folder.join(name)).collect())
}

/// Sort key of a name, with its numbers as numbers: `bag_10` comes after `bag_2`.
fn in_order(name: &str) -> Vec<(String, u64)> {
    let mut parts = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let text = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        let (before, from) = rest.split_at(text);
        let digits = from.find(|c: char| !c.is_ascii_digit()).unwrap_or(from.len());
        let (number, remainder) = from.split_at(digits);
        parts.push((before.to_owned(), number.parse().unwrap_or(0)));
        rest = remainder;
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn split_bags_stand_in_the_order_of_their_numbers() {
        let mut names = ["bag_10.mcap", "bag_2.mcap", "bag_1.mcap", "bag_0.mcap"];
        names.sort_by_cached_key(|name| in_order(name));
        assert_eq!(names, ["bag_0.mcap", "bag_1.mcap", "bag_2.mcap", "bag_10.mcap"]);
    }
}
