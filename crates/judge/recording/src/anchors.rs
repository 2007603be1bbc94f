//! `held.json`: the trust anchors of a run, and the digest of every other file in its folder.
//!
//! Chains and signatures prove writer and order of an entry; the digests prove that not one byte of the run has changed, bytes outside
//! entries included. They cover the files in the folder when the run is over, except for `held.json`, which contains them. Its own digest
//! authenticates that file; the command that made the run prints it. Judging a log by its anchors is left to [`crate::log`].

use std::collections::BTreeMap;
use std::io::{Error, Read, Result, Write};
use std::path::Path;

use evidence::anchors::{FileDigest, TrustAnchors};
use evidence::log::hex;
use link::files;
use sha2::{Digest, Sha256};

use crate::layout::RunFolder;

/// The longest `held.json` that is read, bytes.
const MAX_ANCHORS_BYTES: u64 = 1 << 20;
/// Most files of a run.
const MAX_FILES: usize = 4096;
/// Depth of the folders of a run.
const MAX_DEPTH: usize = 4;
/// The longest file that a digest covers, bytes: more than an input journal takes.
const MAX_BYTES: u64 = 2 << 30;

/// Writes the trust anchors of a run and the digest of every file in its folder, so it is called last. Returns the SHA-256 of the
/// written file, hexadecimal, which authenticates the whole run.
///
/// # Errors
/// When the file is there already or cannot be written, or as [`file_digests`].
pub fn write_anchors(run: &RunFolder, anchors: &TrustAnchors) -> Result<String> {
    let anchors = TrustAnchors { files: Some(file_digests(run.path())?), ..anchors.clone() };
    let bytes = serde_json::to_vec_pretty(&anchors)?;
    files::create(&run.anchors())?.write_all(&bytes)?;
    Ok(hex(&Sha256::digest(&bytes)))
}

/// Reads the trust anchors of a run, and the SHA-256 of their file, hexadecimal.
///
/// # Errors
/// When the file is missing, too long, no regular file or no such object.
pub fn read_anchors(run: &RunFolder) -> Result<(TrustAnchors, String)> {
    let bytes = files::read(&run.anchors(), MAX_ANCHORS_BYTES)?;
    Ok((parse_anchors(bytes.as_slice())?, hex(&Sha256::digest(&bytes))))
}

/// Parses the bytes of `held.json`, up to a bounded number.
///
/// # Errors
/// When they are no such object.
pub fn parse_anchors(from: impl Read) -> Result<TrustAnchors> {
    Ok(serde_json::from_reader(from.take(MAX_ANCHORS_BYTES))?)
}

/// The length and the SHA-256 of every file in `directory`, by its path below it.
///
/// # Errors
/// When one cannot be read, is no regular file, or there are more than a run leaves.
pub fn file_digests(directory: &Path) -> Result<BTreeMap<String, FileDigest>> {
    let names = names(directory)?;
    names.into_iter().map(|name| file_digest(directory, &name).map(|file| (name, file))).collect()
}

/// Differences between the files in `directory` and these digests, each with its file, in order of paths.
///
/// # Errors
///
/// When the directory cannot be listed, or has more files than a run leaves.
pub(crate) fn file_differences(directory: &Path, digests: &BTreeMap<String, FileDigest>) -> Result<Vec<String>> {
    let found = names(directory)?;
    let mut differences = Vec::new();
    for (name, was) in digests {
        if !found.contains(name) {
            differences.push(format!("{name}: missing"));
            continue;
        }
        match file_difference(directory, name, was) {
            Ok(None) => {}
            Ok(Some(differs)) => differences.push(format!("{name}: {differs}")),
            Err(error) => differences.push(format!("{name}: {error}")),
        }
    }
    let extra = found.iter().filter(|name| !digests.contains_key(*name));
    differences.extend(extra.map(|name| format!("{name}: the run did not leave this file")));
    differences.sort();
    Ok(differences)
}

/// Difference of the file, if any.
fn file_difference(directory: &Path, name: &str, was: &FileDigest) -> Result<Option<String>> {
    let length = files::open(&directory.join(name))?.metadata()?.len();
    if length != was.bytes {
        return Ok(Some(format!("{length} bytes, the run left {}", was.bytes)));
    }
    let now = file_digest(directory, name)?;
    let differs = || format!("SHA-256 {}, of what the run left {}", now.sha256, was.sha256);
    Ok((now.sha256 != was.sha256).then(differs))
}

fn file_digest(directory: &Path, name: &str) -> Result<FileDigest> {
    let (file, mut digest) = (files::open(&directory.join(name))?, Sha256::new());
    // One byte more than is allowed: a file that grows while it is read ends in an error, and not in a digest of its beginning.
    let mut from = file.take(MAX_BYTES + 1);
    let (mut bytes, mut buffer) = (0, vec![0; 1 << 16]);
    loop {
        match from.read(&mut buffer)? {
            0 => return Ok(FileDigest { bytes, sha256: hex(&digest.finalize()) }),
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

/// The paths in `directory` that are no folders, except for `held.json`, which has the digests.
fn names(directory: &Path) -> Result<Vec<String>> {
    let (mut found, mut folders) = (Vec::new(), vec![(String::new(), 0)]);
    while let Some((above, depth)) = folders.pop() {
        for entry in std::fs::read_dir(directory.join(&above))? {
            let entry = entry?;
            let name = entry.file_name();
            let name = name.to_str().ok_or_else(|| Error::other(format!("{}: no UTF-8", name.display())))?;
            let path = if above.is_empty() { name.to_owned() } else { format!("{above}/{name}") };
            // A link to a folder is listed as a file: its target is outside the run.
            if entry.file_type()?.is_dir() && depth < MAX_DEPTH {
                folders.push((path, depth + 1));
            } else if path != RunFolder::ANCHORS {
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
        let path = |name: &str| folder.path().join(name);
        fs::create_dir(path("guard")).expect("a folder");
        for name in ["a", "b", "c", "d", "guard/e", RunFolder::ANCHORS] {
            fs::write(path(name), name).expect("a file");
        }
        let digests = file_digests(folder.path()).expect("it can be read");
        assert_eq!(digests.keys().collect::<Vec<_>>(), ["a", "b", "c", "d", "guard/e"]);
        assert_eq!(file_differences(folder.path(), &digests).expect("it can be read"), [""; 0]);
        fs::write(path("a"), "A").expect("a file");
        fs::write(path("b"), "bb").expect("a file");
        fs::remove_file(path("c")).expect("it is there");
        fs::remove_file(path("d")).expect("it is there");
        std::os::unix::fs::symlink("/dev/zero", path("d")).expect("a link");
        fs::write(path("guard/f"), "f").expect("a file");
        let found = file_differences(folder.path(), &digests).expect("it can be read");
        let found: Vec<&str> = found.iter().map(|line| &line[..line.len().min(17)]).collect();
        let expected = [
            "a: SHA-256 559aead",
            "b: 2 bytes, the run left 1",
            "c: missing",
            "d: not a regular file",
            "guard/f: the run ",
        ];
        let expected: Vec<&str> = expected.iter().map(|line| &line[..line.len().min(17)]).collect();
        assert_eq!(found, expected);
    }
}
