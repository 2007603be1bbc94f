//! Remains of runs with a killed launcher and janitor: found by the next run and by `holdsafe doctor`.
//!
//! A launcher keeps a mark among the shared memory of its run, a file that lists the remains, locked until the launcher has
//! read and removed the last of them; the janitor locks it too. A run is over when that lock has no holder any more (the
//! kernel releases it when a process ends) and no process has the run's shared memory mapped. So neither a reused process id
//! nor a stopped service is mistaken for the end of a run. A run that cannot be shown to be over is left alone.

use std::fs::File;
use std::io::{Read, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use link::bus::sweep::{SHARED_MEMORY, mapped};
use nix::fcntl::OFlag;

use super::remains::Remains;

/// Suffix of a mark's name, after the run's prefix.
const MARK: &str = "mark";
/// The longest mark that is read.
const MAX_MARK: u64 = 64 * 1024;

/// Counts of runs with remains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Leftovers {
    /// Runs that are over, with removed remains.
    pub removed: usize,
    /// Runs without a launcher while a process still has their shared memory mapped: left alone.
    pub held: usize,
}

/// Remains of a run, in its launcher's hands: removed with this, unkept logs too, and last the mark.
#[derive(Debug)]
pub struct Marked {
    remains: Remains,
    mark: Mark,
}

impl Marked {
    /// Marks a run that begins now, before it has left anything.
    ///
    /// # Errors
    /// When the mark cannot be made.
    pub fn begin(remains: Remains) -> std::io::Result<Marked> {
        Ok(Marked { mark: Mark::set(&remains)?, remains })
    }

    /// The remains.
    pub fn remains(&self) -> &Remains {
        &self.remains
    }
}

impl Drop for Marked {
    fn drop(&mut self) {
        self.remains.remove_all();
        self.mark.clear();
    }
}

/// The lock on a run's mark. Its holder will remove the remains.
#[derive(Debug)]
pub struct Mark {
    path: PathBuf,
    _locked: File,
}

impl Mark {
    /// Marks a run that begins now.
    ///
    /// # Errors
    /// When the mark cannot be made.
    pub fn set(remains: &Remains) -> std::io::Result<Mark> {
        let path = path(&remains.prefix);
        // The mark gets its name when it is locked: another run would take an unlocked one for a finished run's.
        let draft = path.with_file_name(format!(".{}{MARK}", remains.prefix));
        let mut file = File::options().write(true).create_new(true).mode(0o600).open(&draft)?;
        file.write_all(&serde_json::to_vec(remains)?)?;
        file.lock_shared()?;
        std::fs::rename(&draft, &path)?;
        Ok(Mark { path, _locked: file })
    }

    /// Locks the mark of a run that another process has begun.
    ///
    /// # Errors
    ///
    /// When there is none.
    pub fn join(remains: &Remains) -> std::io::Result<Mark> {
        let path = path(&remains.prefix);
        let file = File::open(&path)?;
        file.lock_shared()?;
        Ok(Mark { path, _locked: file })
    }

    /// Removes the mark: the run has no remains.
    pub fn clear(&self) {
        if let Err(error) = std::fs::remove_file(&self.path) {
            tracing::debug!(%error, "the mark of a run was gone already");
        }
    }
}

/// Removes the remains of this user's finished runs.
///
/// # Errors
///
/// When shared memory cannot be listed.
pub fn remove() -> std::io::Result<Leftovers> {
    let mut found = Leftovers::default();
    for entry in std::fs::read_dir(SHARED_MEMORY)? {
        let path = entry?.path();
        let named =
            path.file_name().and_then(|n| n.to_str()).is_some_and(|n| n.starts_with("hs_") && n.ends_with(MARK));
        let Some((mark, remains)) = named.then(|| abandoned(&path)).flatten() else { continue };
        if mapped(&remains.prefix) {
            found.held += 1;
            continue;
        }
        remains.remove_all();
        mark.clear();
        found.removed += 1;
    }
    Ok(found)
}

/// Removes the remains of killed runs, before another adds to them.
pub(super) fn make_room() {
    match remove() {
        Ok(found) if found.removed > 0 => tracing::info!(runs = found.removed, "removed the remains of killed runs"),
        Ok(_) => {}
        Err(error) => tracing::warn!(%error, "remains of killed runs were not searched for"),
    }
}

/// The mark at `path`, locked, if it belongs to this user and no process has it locked.
fn abandoned(path: &Path) -> Option<(Mark, Remains)> {
    // Every user may write to this folder: a link, or a mark of another user, must not name what this user removes.
    let file = File::options().read(true).custom_flags(OFlag::O_NOFOLLOW.bits()).open(path).ok()?;
    let metadata = file.metadata().ok()?;
    if !metadata.is_file() || metadata.uid() != rustix::process::geteuid().as_raw() || file.try_lock().is_err() {
        return None;
    }
    let mut text = Vec::new();
    Read::take(&file, MAX_MARK).read_to_end(&mut text).ok()?;
    let remains: Remains = serde_json::from_slice(&text).ok()?;
    let mark = Mark { path: path.to_owned(), _locked: file };
    (self::path(&remains.prefix) == path).then_some((mark, remains))
}

fn path(prefix: &str) -> PathBuf {
    Path::new(SHARED_MEMORY).join(format!("{prefix}{MARK}"))
}

/// Removes the remains of a run. The logs and the mark of a launcher that is `done` stay until it has read the logs.
pub(super) fn sweep(remains: &Remains, mark: Option<Mark>, done: bool) {
    if done {
        return remains.remove();
    }
    remains.remove_all();
    mark.iter().for_each(Mark::clear);
}

#[cfg(test)]
mod tests {
    use super::*;
    // While one test removes leftovers it holds each run's mark, and another would take that run for a living one.
    use crate::child::tests::exclude_forks;
    use crate::remains::SCRATCH;

    /// A run with a file in shared memory and a folder.
    fn run(name: &str) -> (Remains, PathBuf) {
        let id = format!("t{:x}{name}", std::process::id());
        let prefix = format!("hs_{id}_");
        let folder = std::env::temp_dir().join(format!("holdsafe-{id}"));
        std::fs::create_dir_all(folder.join("vehicle")).unwrap();
        let segment = Path::new(SHARED_MEMORY).join(format!("{prefix}0_segment"));
        std::fs::write(&segment, "left").unwrap();
        let domains = vec![(format!("{prefix}0_"), folder.join("vehicle"))];
        (Remains { prefix, domains, folder, scratch: None }, segment)
    }

    #[test]
    fn locked_run_is_kept_and_finished_one_removed() {
        let _guard = exclude_forks();
        let (living, living_segment) = run("living");
        let (finished, finished_segment) = run("over");
        let held = Mark::set(&living).unwrap();
        let joined = Mark::join(&living).unwrap();
        drop(Mark::set(&finished).unwrap());
        drop(held);
        remove().unwrap();
        assert!(living_segment.exists() && living.folder.exists(), "its janitor lives");
        assert!(!finished_segment.exists() && !finished.folder.exists() && !path(&finished.prefix).exists());
        drop(joined);
        remove().unwrap();
        assert!(!living_segment.exists() && !living.folder.exists());
    }

    /// The launcher was killed while it read the logs, after its janitor.
    #[test]
    fn logs_of_a_doubly_killed_run_are_removed() {
        let _guard = exclude_forks();
        let (mut read, _segment) = run("read");
        let logs = read.folder.with_file_name(format!("{SCRATCH}{}", read.prefix));
        std::fs::create_dir_all(logs.join("recording")).unwrap();
        read.scratch = Some(logs.clone());
        let reader = Mark::set(&read).unwrap();
        sweep(&read, Mark::join(&read).ok(), true);
        remove().unwrap();
        assert!(logs.exists() && !read.folder.exists(), "they are being read");
        // As its death leaves it: the lock is gone, the mark is not.
        drop(reader);
        remove().unwrap();
        assert!(!logs.exists() && !path(&read.prefix).exists());
    }

    #[test]
    fn finished_launcher_leaves_neither_logs_nor_mark() {
        let (mut done, segment) = run("done");
        let logs = done.folder.with_file_name(format!("{SCRATCH}{}", done.prefix));
        std::fs::create_dir_all(&logs).unwrap();
        done.scratch = Some(logs.clone());
        drop(Marked::begin(done.clone()).unwrap());
        assert!(!logs.exists() && !done.folder.exists() && !segment.exists() && !path(&done.prefix).exists());
    }

    /// The mark names another run, or a foreign folder.
    #[test]
    fn foreign_mark_removes_no_file() {
        let _guard = exclude_forks();
        let (mut liar, segment) = run("liar");
        let prefix = std::mem::replace(&mut liar.prefix, "hs_other_run_".to_owned());
        std::fs::write(path(&prefix), serde_json::to_vec(&liar).unwrap()).unwrap();
        remove().unwrap();
        assert!(segment.exists() && liar.folder.exists());
        liar.prefix = prefix;
        liar.remove_all();
        std::fs::remove_file(path(&liar.prefix)).unwrap();
        assert!(!segment.exists());
    }
}
