//! Removal of a run's shared memory, after the end of all its processes.

use std::fs::Permissions;
use std::io;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

/// The kernel's folder of shared-memory files.
pub const SHARED_MEMORY: &str = "/dev/shm";

/// A prefix that names exactly one run: `hs_`, then 3 to 40 lower-case letters, digits or `_`.
pub fn checked_prefix(prefix: &str) -> Option<&str> {
    let run = prefix.strip_prefix("hs_")?;
    let sound = |b: u8| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_';
    ((3..=40).contains(&run.len()) && run.bytes().all(sound)).then_some(prefix)
}

/// Removes the shared-memory files of the domain `prefix`, and its root directory. Returns the number of files removed.
/// The caller makes sure that no process of the run is left.
///
/// # Errors
/// When the prefix is not one of ours, or a directory cannot be read.
pub fn sweep(prefix: &str, root: &Path) -> io::Result<usize> {
    let prefix = checked_prefix(prefix).ok_or_else(|| io::Error::other("not a prefix of a run"))?;
    let mut removed = 0;
    for entry in std::fs::read_dir(SHARED_MEMORY)? {
        let entry = entry?;
        let in_domain = entry.file_name().to_str().is_some_and(|name| name.starts_with(prefix));
        if in_domain && entry.file_type()?.is_file() && std::fs::remove_file(entry.path()).is_ok() {
            removed += 1;
        }
    }
    match std::fs::remove_dir_all(root) {
        Ok(()) => Ok(removed),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(removed),
        Err(error) => Err(error),
    }
}

/// Allocates memory for every byte of this domain's files, which are created with holes. Without it, SIGBUS ends a process that touches
/// a page when the memory is full; with it, a channel that finds no room is not opened.
///
/// # Errors
/// When there is no room.
pub(super) fn reserve(prefix: &[u8]) -> io::Result<()> {
    for entry in std::fs::read_dir(SHARED_MEMORY)? {
        let entry = entry?;
        if !entry.file_name().as_bytes().starts_with(prefix) {
            continue;
        }
        // A file that another process has removed since, or that is read-only by now, needs no room.
        let Ok(file) = std::fs::File::options().write(true).open(entry.path()) else { continue };
        let length = file.metadata()?.len();
        if length > 0 {
            nix::fcntl::posix_fallocate(&file, 0, length as nix::libc::off_t)?;
        }
    }
    Ok(())
}

/// Removes permissions of group and others from the shared-memory files with names that start with `prefix`.
///
/// # Errors
///
/// When the directory cannot be read, or a file of this user keeps its mode.
pub(super) fn restrict(prefix: &[u8]) -> io::Result<()> {
    for entry in std::fs::read_dir(SHARED_MEMORY)? {
        let entry = entry?;
        if !entry.file_name().as_bytes().starts_with(prefix) {
            continue;
        }
        // Another process may remove a file between the listing and this line.
        let Ok(metadata) = entry.metadata() else { continue };
        let mode = metadata.permissions().mode();
        if metadata.is_file() && mode & 0o077 != 0 {
            std::fs::set_permissions(entry.path(), Permissions::from_mode(mode & 0o700))?;
        }
    }
    Ok(())
}

/// True if a process, running or stopped, has shared memory of the domain `prefix` mapped. Processes of other users, whose maps
/// this user may not read, are not covered.
pub fn mapped(prefix: &str) -> bool {
    let file_prefix = format!("{SHARED_MEMORY}/{prefix}");
    let maps = |process: io::Result<std::fs::DirEntry>| std::fs::read_to_string(process?.path().join("maps"));
    // Unknown counts as mapped: memory in use must not be removed.
    let Ok(processes) = std::fs::read_dir("/proc") else { return true };
    processes.map(maps).any(|maps| maps.is_ok_and(|maps| maps.contains(&file_prefix)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_run_prefix_may_be_swept() {
        assert!(checked_prefix("hs_run1_v_").is_some());
        for prefix in ["", "hs_", "hs_a", "iox2_", "hs_../x", "hs_A12", "hs_*", "xhs_run1"] {
            assert!(checked_prefix(prefix).is_none(), "{prefix}");
            assert!(sweep(prefix, Path::new("/nonexistent-root")).is_err());
        }
    }

    /// Shared memory is closed to group and others.
    #[test]
    fn other_users_cannot_open_a_domains_memory() {
        let folder = tempfile::tempdir().unwrap();
        let prefix = format!("hs_t{:x}_modes_", std::process::id());
        let domain = crate::bus::Domain::new(folder.path(), &prefix).unwrap();
        let publisher = domain.publisher("vehicle", wire::core::Topic::Seals).unwrap();
        let files = std::fs::read_dir(SHARED_MEMORY).unwrap().map(Result::unwrap);
        let domain_files: Vec<_> = files.filter(|f| f.file_name().to_string_lossy().starts_with(&prefix)).collect();
        assert!(!domain_files.is_empty());
        for file in &domain_files {
            let mode = file.metadata().unwrap().permissions().mode();
            assert_eq!(mode & 0o077, 0, "{:?} has mode {mode:o}", file.file_name());
        }
        drop((publisher, domain));
        sweep(&prefix, &folder.path().join("root")).unwrap();
    }

    #[test]
    fn memory_counts_as_mapped_while_processes_hold() {
        let folder = tempfile::tempdir().unwrap();
        let prefix = format!("hs_t{:x}_mapped_", std::process::id());
        assert!(!mapped(&prefix));
        let domain = crate::bus::Domain::new(folder.path(), &prefix).unwrap();
        let publisher = domain.publisher("vehicle", wire::core::Topic::Seals).unwrap();
        assert!(mapped(&prefix));
        drop((publisher, domain));
        assert!(!mapped(&prefix));
        sweep(&prefix, &folder.path().join("root")).unwrap();
    }
}
