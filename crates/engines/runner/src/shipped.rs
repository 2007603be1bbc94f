//! Files that a program brings: the shipped scenarios and everything that they name, for a directory without a checkout.
//!
//! They are unpacked into the user's cache, in a folder named by their content, and compared with the program's own bytes before each use.
//! A folder in which a killed process was writing stays beside them. The choice between them, a checkout and a named directory is left to
//! `context`.

use std::collections::BTreeSet;
use std::fs::{self, DirBuilder, Permissions};
use std::io::{self, Error, ErrorKind};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use evidence::log::hex;
use nix::unistd::mkdtemp;
use rustix::process::geteuid;
use sha2::{Digest, Sha256};

use crate::failure::{Exit, Failure};

/// Path of a file below the root, and its content.
pub type ShippedFile = (&'static str, &'static [u8]);

/// Bytes of the files' digest that name their folder.
const NAMED_BY: usize = 8;

/// Files that a program brings, and the folder that this process has unpacked them into.
#[derive(Clone, Debug, Default)]
pub struct Shipped {
    files: &'static [ShippedFile],
    unpacked: Arc<OnceLock<Result<PathBuf, Failure>>>,
}

impl Shipped {
    /// Files of a program; none where it needs a checkout.
    pub fn new(files: &'static [ShippedFile]) -> Self {
        Self { files, unpacked: Arc::default() }
    }

    /// The folder with the files, checked once in a process; `None` where the program brings none.
    pub fn folder(&self) -> Option<Result<PathBuf, Failure>> {
        let unpacked = || self.unpacked.get_or_init(|| unpack(self.files, &list_caches())).clone();
        (!self.files.is_empty()).then(unpacked)
    }
}

/// Folders that may take the files, in order: one in the user's cache, one of the user's own in the temporary directory.
fn list_caches() -> Vec<PathBuf> {
    // The XDG base directory specification has relative paths ignored.
    let named = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let cache = named("XDG_CACHE_HOME").or_else(|| Some(named("HOME")?.join(".cache")));
    let temporary = std::env::temp_dir().join(format!("holdsafe.{}", geteuid().as_raw()));
    cache.map(|cache| cache.join("holdsafe")).into_iter().chain([temporary]).collect()
}

/// Unpacks the files into the first of the caches that is the user's own; gives their folder.
fn unpack(files: &[ShippedFile], caches: &[PathBuf]) -> Result<PathBuf, Failure> {
    let mut refused = Vec::new();
    let name = digest_files(files);
    // A cache of the user's own may still refuse a new folder: a read-only home, or a full disk.
    let private = caches.iter().find(|cache| {
        let made = make_private(cache).and_then(|()| make_private(&cache.join(&name)));
        made.map_err(|error| refused.push(format!("{}: {error}", cache.display()))).is_ok()
    });
    let unusable = |reason: &str| {
        let remedy = "set XDG_CACHE_HOME to a folder of yours, or name a checkout with --root DIR";
        Failure::new(Exit::Environment, format!("no place for the shipped files: {reason}; {remedy}"))
    };
    let folder = private.ok_or_else(|| unusable(&refused.join("; ")))?.join(name);
    let repaired = refuse_foreign_entries(&folder, files).and_then(|()| write_damaged(&folder, files));
    repaired.map_err(|error| unusable(&format!("{}: {error}", folder.display())))?;
    Ok(folder)
}

/// Makes a folder that no other user can change, or checks that an existing one is such: another user may have made it, or a link in its
/// place.
fn make_private(folder: &Path) -> io::Result<()> {
    let mut builder = DirBuilder::new();
    builder.mode(0o700).recursive(true);
    folder.parent().map_or(Ok(()), |parent| builder.create(parent))?;
    match builder.recursive(false).create(folder) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
        made => made?,
    }
    let metadata = folder.symlink_metadata()?;
    let reason = match (metadata.is_dir(), metadata.uid() == geteuid().as_raw(), metadata.mode() & 0o022 == 0) {
        (true, true, true) => return Ok(()),
        (false, _, _) => "not a folder, perhaps a link to one",
        (true, false, _) => "of another user",
        (true, true, false) => "may be changed by other users",
    };
    Err(Error::new(ErrorKind::PermissionDenied, reason))
}

/// The start of the SHA-256 over paths and content, hexadecimal.
fn digest_files(files: &[ShippedFile]) -> String {
    let mut digest = Sha256::new();
    for (path, bytes) in files {
        digest.update(format!("{path}\n{}\n", bytes.len()));
        digest.update(bytes);
    }
    hex(&digest.finalize()[..NAMED_BY])
}

/// Checks that the folders of the files have no other entries: an added scenario would be mistaken for a shipped one.
fn refuse_foreign_entries(root: &Path, files: &[ShippedFile]) -> io::Result<()> {
    let paths: BTreeSet<&Path> = files.iter().map(|(path, _)| Path::new(path)).collect();
    let parents = paths.iter().flat_map(|path| path.ancestors().skip(1));
    // The root's own entries are not listed by any reader.
    let folders: BTreeSet<&Path> = parents.filter(|folder| !folder.as_os_str().is_empty()).collect();
    let foreign = |path: &Path, fault: &str| {
        let message = format!("{} {fault}; remove the folder, which is then unpacked anew", path.display());
        Error::new(ErrorKind::InvalidData, message)
    };
    for folder in &folders {
        let entries = match root.join(folder).symlink_metadata() {
            Ok(metadata) if !metadata.is_dir() => return Err(foreign(folder, "is no folder")),
            Ok(_) => fs::read_dir(root.join(folder))?,
            Err(error) if error.kind() == ErrorKind::NotFound => continue,
            Err(error) => return Err(error),
        };
        for entry in entries {
            let path = folder.join(entry?.file_name());
            if !paths.contains(path.as_path()) && !folders.contains(path.as_path()) {
                return Err(foreign(&path, "is no file of the program"));
            }
        }
    }
    Ok(())
}

/// Writes each file that is missing or not as the program has it.
fn write_damaged(root: &Path, files: &[ShippedFile]) -> io::Result<()> {
    let damaged: Vec<&ShippedFile> = files.iter().filter(|(path, bytes)| !is_whole(&root.join(path), bytes)).collect();
    if damaged.is_empty() {
        return Ok(());
    }
    let staging = mkdtemp(root.with_extension("XXXXXX").as_path())?;
    let written = damaged.iter().try_for_each(|(path, bytes)| {
        let written = write(&staging.join("file"), &root.join(path), bytes);
        written.map_err(|error| Error::new(error.kind(), format!("{path}: {error}")))
    });
    written.and(fs::remove_dir_all(&staging))
}

/// True if a file has these bytes; a file with others is reported.
fn is_whole(file: &Path, bytes: &[u8]) -> bool {
    let Ok(metadata) = file.symlink_metadata() else { return false };
    let whole = metadata.is_file() && link::files::read(file, bytes.len() as u64).is_ok_and(|read| read == bytes);
    if !whole {
        tracing::warn!("{}: not as the program has it; it is written anew", file.display());
    }
    whole
}

/// Writes a file under another name and renames it, so that other processes find all of it or none.
fn write(staged: &Path, file: &Path, bytes: &[u8]) -> io::Result<()> {
    file.parent().map_or(Ok(()), fs::create_dir_all)?;
    fs::write(staged, bytes)?;
    fs::set_permissions(staged, Permissions::from_mode(0o444))?;
    fs::rename(staged, file)
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    const FILES: &[ShippedFile] =
        &[("platforms/ground.toml", b"ground"), ("scenarios/a.toml", b"a"), ("scenarios/scenes/b.toml", b"")];

    fn unpacked(cache: &Path) -> Result<PathBuf, Failure> {
        unpack(FILES, &[cache.to_owned()])
    }

    fn assert_whole(folder: &Path) {
        for (path, bytes) in FILES {
            assert_eq!(fs::read(folder.join(path)).unwrap(), *bytes, "{path}");
        }
        let folders = fs::read_dir(folder.parent().unwrap()).unwrap().count();
        assert_eq!(folders, 1, "nothing is left beside the folder");
    }

    #[test]
    fn files_are_unpacked_and_found_again() {
        let place = tempfile::tempdir().unwrap();
        let folder = unpacked(&place.path().join("cache")).unwrap();
        assert_whole(&folder);
        let made = |path: &str| folder.join(path).metadata().unwrap().ino();
        let first = FILES.iter().map(|(path, _)| made(path)).collect::<Vec<_>>();
        assert_eq!(unpacked(&place.path().join("cache")).unwrap(), folder);
        assert_eq!(
            FILES.iter().map(|(path, _)| made(path)).collect::<Vec<_>>(),
            first,
            "a whole file was written again"
        );
        assert_ne!(digest_files(&FILES[1..]), digest_files(FILES), "other files have another folder");
        assert!(Shipped::default().folder().is_none());
    }

    /// Damage: other content, of equal length too, a missing file, or a link.
    #[test]
    fn damaged_files_are_written_anew() {
        let place = tempfile::tempdir().unwrap();
        let cache = place.path().join("cache");
        let folder = unpacked(&cache).unwrap();
        let [ground, a, b] = FILES else { unreachable!() };
        let elsewhere = place.path().join("elsewhere");
        fs::write(&elsewhere, "a").unwrap();
        fs::remove_file(folder.join(ground.0)).unwrap();
        fs::write(folder.join(ground.0), "grOund").unwrap();
        fs::remove_file(folder.join(a.0)).unwrap();
        symlink(&elsewhere, folder.join(a.0)).unwrap();
        fs::remove_dir_all(folder.join("scenarios/scenes")).unwrap();
        assert_eq!(unpacked(&cache).unwrap(), folder);
        assert_whole(&folder);
        assert!(folder.join(a.0).symlink_metadata().unwrap().is_file() && folder.join(b.0).is_file());
    }

    #[test]
    fn folder_with_other_entries_is_refused() {
        let place = tempfile::tempdir().unwrap();
        let cache = place.path().join("cache");
        let folder = unpacked(&cache).unwrap();
        fs::write(folder.join("scenarios/more.toml"), "").unwrap();
        let failure = unpacked(&cache).unwrap_err();
        assert!(failure.to_string().contains("scenarios/more.toml is no file of the program"), "{failure}");
        assert_eq!(failure.exit(), Exit::Environment);
        fs::remove_dir_all(folder.join("scenarios")).unwrap();
        symlink(place.path(), folder.join("scenarios")).unwrap();
        let failure = unpacked(&cache).unwrap_err();
        assert!(failure.to_string().contains("scenarios is no folder"), "{failure}");
    }

    /// A cache that is a link, or that others may write to, is not used: the next one is, and without one the reasons are reported.
    #[test]
    fn cache_that_others_control_is_passed_over() {
        let place = tempfile::tempdir().unwrap();
        let [real, planted, open, private] = ["real", "planted", "open", "own"].map(|name| place.path().join(name));
        [&real, &open].iter().for_each(|folder| fs::create_dir(folder).unwrap());
        symlink(&real, &planted).unwrap();
        fs::set_permissions(&open, Permissions::from_mode(0o777)).unwrap();
        let failure = unpack(FILES, &[planted.clone(), open.clone()]).unwrap_err().to_string();
        for reason in ["planted: not a folder, perhaps a link", "open: may be changed by other users", "XDG_CACHE_HOME"]
        {
            assert!(failure.contains(reason), "{failure}");
        }
        assert_eq!(fs::read_dir(&real).unwrap().count() + fs::read_dir(&open).unwrap().count(), 0);
        let folder = unpack(FILES, &[planted, open, private.clone()]).unwrap();
        assert!(folder.starts_with(&private));
        assert_eq!(private.metadata().unwrap().mode() & 0o777, 0o700);
    }

    #[test]
    fn processes_may_unpack_at_the_same_time() {
        let place = tempfile::tempdir().unwrap();
        let cache = place.path().join("cache");
        let folders = std::thread::scope(|scope| {
            let started = [(); 8].map(|()| scope.spawn(|| unpacked(&cache).unwrap()));
            started.map(|one| one.join().unwrap())
        });
        folders.iter().for_each(|folder| assert_whole(folder));
    }
}
