//! Places of the shipped scenarios, and their lists.

use std::path::{Path, PathBuf};

use super::Interface;

/// The nearest directory at or above `from` that holds scenarios and platforms.
pub fn find_root(from: &Path) -> Option<PathBuf> {
    let is_root = |dir: &&Path| dir.join("scenarios").is_dir() && dir.join("platforms").is_dir();
    from.ancestors().find(is_root).map(Path::to_path_buf)
}

/// The folder of the shipped scenarios, when `file` lies in it or below it.
pub(super) fn shipped_folder(file: &Path) -> Option<PathBuf> {
    let file = std::path::absolute(file).ok()?;
    let folder = find_root(file.parent()?)?.join("scenarios");
    file.starts_with(&folder).then_some(folder)
}

/// The file of the shipped scenario of this name.
pub fn find(root: &Path, name: &str) -> Option<PathBuf> {
    let folders = Interface::FOLDERS.into_iter().chain(["rendered", "demo", "honest"]);
    let mut paths = folders.map(|folder| root.join("scenarios").join(folder).join(format!("{name}.toml")));
    paths.find(|path| path.is_file())
}

/// Every shipped scenario of the reference evaluation, by name; a folder holds the scenarios of an interface.
///
/// # Errors
/// When a directory cannot be listed.
pub fn shipped(root: &Path) -> std::io::Result<Vec<PathBuf>> {
    let folders = Interface::FOLDERS.into_iter().map(|folder| files(&root.join("scenarios").join(folder)));
    let mut all = folders.collect::<std::io::Result<Vec<_>>>()?.concat();
    all.sort_by(|a, b| a.file_name().cmp(&b.file_name()));
    Ok(all)
}

/// The shipped scenarios that run rendered alone.
///
/// # Errors
/// The folder cannot be read.
pub fn rendered(root: &Path) -> std::io::Result<Vec<PathBuf>> {
    files(&root.join("scenarios/rendered"))
}

/// The shipped scenarios that are for showing: too long for the reference evaluation, and no part of it.
///
/// # Errors
/// The folder cannot be read.
pub fn demo(root: &Path) -> std::io::Result<Vec<PathBuf>> {
    files(&root.join("scenarios/demo"))
}

/// The shipped faults without an adversary, each with the attacks that look like it ([`super::Scenario::twin_of`]): measured beside these,
/// and no part of the reference evaluation.
///
/// # Errors
/// The folder cannot be read.
pub fn honest(root: &Path) -> std::io::Result<Vec<PathBuf>> {
    files(&root.join("scenarios/honest"))
}

/// The shipped platforms.
///
/// # Errors
/// The folder cannot be read.
pub fn platform_files(root: &Path) -> std::io::Result<Vec<PathBuf>> {
    files(&root.join("platforms"))
}

/// The TOML files of a folder, by name.
pub(super) fn files(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e == "toml") && path.is_file() {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}
