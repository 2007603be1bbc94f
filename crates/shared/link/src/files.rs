//! Opening and creating the files of a run, in folders where another program may have put files; the paths of the logs that
//! a process writes itself.
//!
//! A path may lead to a pipe, on which a reader waits forever, or to an endless device: only a regular file is opened, and
//! read up to the bound of its reader. The content is left to that reader, and the other files of a run's folder to
//! `recording::layout`.

use std::fs::{File, OpenOptions};
use std::io::{Error, ErrorKind, Read, Result};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use nix::fcntl::OFlag;
use wire::id::{Boot, NodeId};

/// The folder of the input journals below that of a run.
pub const INPUT_JOURNALS: &str = "inputs";
/// Its name in runs that were recorded before the folder had that name; such runs are still read.
const FORMER_INPUT_JOURNALS: &str = "mouth";
/// The folder of the guards' logs, and of the launcher's notes, below that of a run.
pub const GUARD_LOGS: &str = "guard";

/// The folder of the input journals of a run: under its former name if the run has that one alone.
pub fn input_journals(run_dir: &Path) -> PathBuf {
    let (folder, former) = (run_dir.join(INPUT_JOURNALS), run_dir.join(FORMER_INPUT_JOURNALS));
    if !folder.exists() && former.is_dir() { former } else { folder }
}

/// The input journal of `node`'s start `boot` below the folder of a run.
pub fn input_journal(run_dir: &Path, node: NodeId, boot: Boot) -> PathBuf {
    input_journals(run_dir).join(log_name(node, boot))
}

/// The log of the guard in the process of `node`, of its start `boot`, below the folder of a run.
pub fn guard_log(run_dir: &Path, node: NodeId, boot: Boot) -> PathBuf {
    run_dir.join(GUARD_LOGS).join(log_name(node, boot))
}

/// The name of a log of one start: `<node>.cbor` for the first, `<node>-<boot>.cbor` for later ones.
fn log_name(node: NodeId, boot: Boot) -> String {
    match boot.0 {
        0 | 1 => format!("{node}.cbor"),
        boot => format!("{node}-{boot}.cbor"),
    }
}

/// Opens a regular file, through links too, and never waits.
///
/// # Errors
/// When there is none at `path`, or something that is no regular file.
pub fn open(path: &Path) -> Result<File> {
    // O_NONBLOCK opens a pipe without a writer at once, so that it can be refused; it has no effect on a regular file.
    let file = OpenOptions::new().read(true).custom_flags(OFlag::O_NONBLOCK.bits()).open(path)?;
    match file.metadata()?.is_file() {
        true => Ok(file),
        false => Err(Error::new(ErrorKind::InvalidInput, "not a regular file")),
    }
}

/// Reads a regular file of at most `most` bytes whole.
///
/// # Errors
/// As [`open`], and when it is longer.
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>> {
    let file = open(path)?;
    let length = file.metadata()?.len();
    let too_long = |got: u64| Error::new(ErrorKind::FileTooLarge, format!("{got} bytes, at most {most} are read"));
    if length > most {
        return Err(too_long(length));
    }
    let mut bytes = Vec::with_capacity(length as usize);
    // The file may grow between the check of its length and the read.
    file.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most { Err(too_long(bytes.len() as u64)) } else { Ok(bytes) }
}

/// Opens an empty file that the launcher created, to write to it; creates it where there is none.
///
/// # Errors
/// When it has content already, is a link, or cannot be made.
pub(crate) fn begin(path: &Path) -> Result<File> {
    // O_NOFOLLOW: a link that another program put here could lead the log into any file of this user.
    match File::options().write(true).custom_flags((OFlag::O_NONBLOCK | OFlag::O_NOFOLLOW).bits()).open(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => create(path),
        opened => {
            let file = opened?;
            let metadata = file.metadata()?;
            if metadata.is_file() && metadata.len() == 0 { Ok(file) } else { Err(ErrorKind::AlreadyExists.into()) }
        }
    }
}

/// Creates a new file, readable by its owner only, and the folders above it.
///
/// # Errors
/// When there is one already, or it cannot be created.
pub fn create(path: &Path) -> Result<File> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    File::options().write(true).create_new(true).mode(0o600).open(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    /// A link to a regular file is read; anything else is neither read nor waited for.
    #[test]
    fn only_regular_files_are_opened() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link, pipe, device] = ["file", "link", "pipe", "device"].map(|name| folder.path().join(name));
        std::fs::write(&file, [7; 10]).unwrap();
        symlink(&file, &link).unwrap();
        symlink("/dev/zero", &device).unwrap();
        nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRUSR).unwrap();
        assert_eq!(read(&link, 10).unwrap(), [7; 10]);
        assert_eq!(read(&link, 9).unwrap_err().to_string(), "10 bytes, at most 9 are read");
        for other in [&pipe, &device, &folder.path().to_owned()] {
            assert_eq!(read(other, 10).unwrap_err().to_string(), "not a regular file", "{}", other.display());
        }
    }

    #[test]
    fn run_under_the_former_folder_name_is_read() {
        let run = tempfile::tempdir().unwrap();
        assert!(input_journals(run.path()).ends_with(INPUT_JOURNALS));
        std::fs::create_dir(run.path().join(FORMER_INPUT_JOURNALS)).unwrap();
        assert!(input_journal(run.path(), NodeId::CONSOLE, Boot(1)).ends_with("mouth/console.cbor"));
        std::fs::create_dir(run.path().join(INPUT_JOURNALS)).unwrap();
        assert!(input_journals(run.path()).ends_with(INPUT_JOURNALS));
    }
}
