//! Every file of a run directory as a whole: its length and the SHA-256 of all its bytes.
//!
//! Chains and signatures prove writer and order of an entry; this proves that not one byte of the run has changed, bytes outside
//! entries included. It covers the files in the directory when the run is over, but for the file that holds the digests. That one
//! is authenticated by its own digest, which the command that made the run prints.

use std::collections::BTreeMap;
use std::io::{Error, Read, Result};
use std::path::Path;

use evidence::log::hex;
use evidence::verification::HeldFile;
use link::files;
use sha2::{Digest, Sha256};

use super::HELD;

/// Most files of a run.
const MAX_FILES: usize = 4096;
/// Their depth.
const MAX_DEPTH: usize = 4;
/// The longest that is covered, bytes: more than an input journal takes.
const MAX_BYTES: u64 = 2 << 30;

/// The digest of every file in `directory`, by path.
///
/// # Errors
/// When one cannot be read, is no regular file, or there are more than a run leaves.
pub fn survey(directory: &Path) -> Result<BTreeMap<String, HeldFile>> {
    let names = names(directory)?;
    names.into_iter().map(|name| digest(directory, &name).map(|file| (name, file))).collect()
}

/// Differences between the files in `directory` and those that are `held`, each with its file, in order of paths.
///
/// # Errors
///
/// When the directory cannot be listed, or has more files than a run leaves.
pub fn differences(directory: &Path, held: &BTreeMap<String, HeldFile>) -> Result<Vec<String>> {
    let found = names(directory)?;
    let mut told = Vec::new();
    for (name, was) in held {
        if !found.contains(name) {
            told.push(format!("{name}: missing"));
            continue;
        }
        match is(directory, name, was) {
            Ok(None) => {}
            Ok(Some(differs)) => told.push(format!("{name}: {differs}")),
            Err(error) => told.push(format!("{name}: {error}")),
        }
    }
    let others = found.iter().filter(|name| !held.contains_key(*name));
    told.extend(others.map(|name| format!("{name}: the run did not leave this file")));
    told.sort();
    Ok(told)
}

/// Difference of the file, if any.
fn is(directory: &Path, name: &str, was: &HeldFile) -> Result<Option<String>> {
    let length = files::open(&directory.join(name))?.metadata()?.len();
    if length != was.bytes {
        return Ok(Some(format!("{length} bytes, the run left {}", was.bytes)));
    }
    let now = digest(directory, name)?;
    let differs = || format!("SHA-256 {}, of what the run left {}", now.sha256, was.sha256);
    Ok((now.sha256 != was.sha256).then(differs))
}

fn digest(directory: &Path, name: &str) -> Result<HeldFile> {
    let (file, mut digest) = (files::open(&directory.join(name))?, Sha256::new());
    let mut from = file.take(MAX_BYTES + 1);
    let (mut bytes, mut buffer) = (0, vec![0; 1 << 16]);
    loop {
        match from.read(&mut buffer)? {
            0 => return Ok(HeldFile { bytes, sha256: hex(&digest.finalize()) }),
            n => {
                digest.update(&buffer[..n]);
                bytes += n as u64;
            }
        }
        if bytes > MAX_BYTES {
            return Err(Error::other(format!("{name}: more than the {MAX_BYTES} bytes that any file of a run has")));
        }
    }
}

/// The paths of all that is in `directory` and is no folder, but for the digests' own file.
fn names(directory: &Path) -> Result<Vec<String>> {
    let (mut found, mut folders) = (Vec::new(), vec![(String::new(), 0)]);
    while let Some((above, depth)) = folders.pop() {
        for entry in std::fs::read_dir(directory.join(&above))? {
            let entry = entry?;
            let name = entry.file_name();
            let name = name.to_str().ok_or_else(|| Error::other(format!("{}: no UTF-8", name.display())))?;
            let path = if above.is_empty() { name.to_owned() } else { format!("{above}/{name}") };
            // A link to a folder is none: what it leads to is elsewhere.
            if entry.file_type()?.is_dir() && depth < MAX_DEPTH {
                folders.push((path, depth + 1));
            } else if path != HELD {
                found.push(path);
            }
            if found.len() + folders.len() > MAX_FILES {
                return Err(Error::other(format!("more than the {MAX_FILES} files that a run leaves")));
            }
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn directory_differences_are_listed_by_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("guard")).expect("a folder");
        for name in ["a", "b", "c", "d", "guard/e", HELD] {
            fs::write(at(name), name).expect("a file");
        }
        let held = survey(folder.path()).expect("it can be read");
        assert_eq!(held.keys().collect::<Vec<_>>(), ["a", "b", "c", "d", "guard/e"]);
        assert_eq!(differences(folder.path(), &held).expect("it can be read"), [""; 0]);
        fs::write(at("a"), "A").expect("a file");
        fs::write(at("b"), "bb").expect("a file");
        fs::remove_file(at("c")).expect("it is there");
        fs::remove_file(at("d")).expect("it is there");
        std::os::unix::fs::symlink("/dev/zero", at("d")).expect("a link");
        fs::write(at("guard/f"), "f").expect("a file");
        let told = differences(folder.path(), &held).expect("it can be read");
        let told: Vec<&str> = told.iter().map(|what| &what[..what.len().min(17)]).collect();
        let expected = [
            "a: SHA-256 559aead",
            "b: 2 bytes, the run left 1",
            "c: missing",
            "d: not a regular file",
            "guard/f: the run ",
        ];
        let expected: Vec<&str> = expected.iter().map(|what| &what[..what.len().min(17)]).collect();
        assert_eq!(told, expected);
    }
}
