//! A recorder with a full disk: the kernel refuses its writes, and its recording is examined from outside.
//!
//! There is no full file system without root. In its place the limit on the size of the recorder's files is lowered to zero on the
//! running process (`prlimit`). From then on the kernel refuses every write to a file with EFBIG in place of a full disk's ENOSPC; the recorder
//! treats both errors alike. Pipes, sockets and memory that is mapped already still work, as on a full disk. A raised limit gives the disk
//! room again. The recorder itself takes no part in it.

use std::path::{Path, PathBuf};

use ground_truth::Note;
use rustix::process::{Pid, Resource, Rlimit, getrlimit, prlimit};

/// Makes the kernel refuse every write of the process `pid` to files. Gives the limit before, if the kernel reports the new one.
pub(super) fn fill(pid: u32) -> Option<Rlimit> {
    // Services inherit the launcher's own limit as the most that they can have.
    set(pid, Rlimit { current: Some(0), maximum: getrlimit(Resource::Fsize).maximum })
}

/// Makes the kernel accept writes of the process `pid` again, up to its `usual` limit. True only if the kernel then reports that limit.
pub(super) fn free(pid: u32, usual: Rlimit) -> bool {
    set(pid, usual).is_some()
}

fn set(pid: u32, limit: Rlimit) -> Option<Rlimit> {
    let pid = i32::try_from(pid).ok().and_then(Pid::from_raw)?;
    let set = || prlimit(Some(pid), Resource::Fsize, limit).ok();
    let before = set()?;
    // The second call returns the limit that the first has set.
    set().filter(|now| now.current == limit.current).map(|_| before)
}

/// Growth of the recording, as the launcher sees it.
pub(super) struct Growth {
    folder: PathBuf,
    bytes: u64,
}

impl Growth {
    /// Growth of the recording in `folder`.
    pub(super) fn new(folder: PathBuf) -> Self {
        Self { folder, bytes: 0 }
    }

    /// The recording's length, when it is longer than at any look before.
    pub(super) fn look(&mut self) -> Option<Note> {
        let bytes = length(&self.folder).ok().filter(|bytes| *bytes > self.bytes)?;
        self.bytes = bytes;
        Some(Note::Kept { bytes })
    }
}

fn length(folder: &Path) -> std::io::Result<u64> {
    std::fs::read_dir(folder)?.try_fold(0, |sum, file| Ok(sum + file?.metadata()?.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recording_growth_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let mut growth = Growth::new(folder.path().to_owned());
        assert_eq!(growth.look(), None);
        std::fs::write(folder.path().join("audit-0.mcap"), [0; 10]).unwrap();
        assert_eq!((growth.look(), growth.look()), (Some(Note::Kept { bytes: 10 }), None));
        std::fs::write(folder.path().join("audit-1.mcap"), [0; 5]).unwrap();
        assert_eq!(growth.look(), Some(Note::Kept { bytes: 15 }));
    }

    /// An ended process has no limit to set.
    #[test]
    fn file_limit_of_a_process_is_adjustable() {
        let guard = crate::child::tests::exclude_forks();
        let mut running = std::process::Command::new("cat").stdin(std::process::Stdio::piped()).spawn().unwrap();
        drop(guard);
        let usual = fill(running.id()).unwrap();
        assert_eq!(usual, getrlimit(Resource::Fsize));
        assert_eq!(fill(running.id()).unwrap().current, Some(0));
        assert!(free(running.id(), usual));
        assert_eq!(fill(running.id()), Some(usual));
        running.kill().and_then(|()| running.wait()).unwrap();
        assert_eq!(fill(running.id()), None);
    }
}
