//! Files of leaderboards and of contributors' keys. Their forms are the crate `board`'s.

use std::fs;
use std::io::{Read, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use board::{Board, BoardError, ContributorKey, MAX_FILE_BYTES, MAX_KEY_BYTES};

use crate::failure::{Exit, Failure};

/// Reads a leaderboard of the right form. Its rows are not checked.
///
/// # Errors
/// The file cannot be read, or is no leaderboard.
pub fn parse(path: &Path) -> Result<Board, Failure> {
    let unread = |reason: String| Failure::new(Exit::Usage, format!("{}: {reason}", path.display()));
    let bytes = link::files::read(path, MAX_FILE_BYTES).map_err(|e| unread(e.to_string()))?;
    let text = String::from_utf8(bytes).map_err(|_| unread("UTF-8 expected".to_owned()))?;
    Board::parse(&text).map_err(|error| failure(path, &error))
}

/// Reads a leaderboard and checks each row.
///
/// # Errors
/// As [`parse`], or the first row with a fault.
pub fn verified(path: &Path) -> Result<Board, Failure> {
    let board = parse(path)?;
    board.findings().into_iter().next().map_or(Ok(board), |finding| Err(failure(path, &finding.into())))
}

/// The failure of a file by an error of `board`.
pub fn failure(path: &Path, error: &BoardError) -> Failure {
    let exit = match error {
        BoardError::Row(_) => Exit::NoEvidence,
        BoardError::TooLong { .. }
        | BoardError::Head
        | BoardError::Version { .. }
        | BoardError::End
        | BoardError::TooMany { .. }
        | BoardError::Line { .. } => Exit::Usage,
    };
    Failure::new(exit, format!("{}: {error}", path.display()))
}

/// Writes a leaderboard in the place of the one before.
///
/// # Errors
/// The file beside it, which takes its place when it is whole, cannot be written.
pub fn write(path: &Path, board: &Board) -> Result<(), Failure> {
    let mut name = path.as_os_str().to_owned();
    name.push(".new");
    let temporary = PathBuf::from(name);
    fs::write(&temporary, board.text())?;
    Ok(fs::rename(&temporary, path)?)
}

/// Reads a contributor's key.
///
/// # Errors
/// The file cannot be read, others may read it, or it is no key.
pub fn read_key(path: &Path) -> Result<ContributorKey, Failure> {
    let refused = |reason: String| Failure::new(Exit::Usage, format!("{}: {reason}", path.display()));
    let mode = fs::metadata(path).map_err(|e| refused(format!("{e}; `holdsafe guest board key FILE` writes a key")))?;
    if mode.permissions().mode() & 0o077 != 0 {
        return Err(refused(format!("others may read this key; `chmod 600 {}` keeps it", path.display())));
    }
    let bytes = link::files::read(path, MAX_KEY_BYTES).map_err(|e| refused(e.to_string()))?;
    let text = String::from_utf8(bytes).map_err(|_| refused("UTF-8 expected".to_owned()))?;
    ContributorKey::from_pem(&text).map_err(|error| refused(error.to_string()))
}

/// Writes a new key into a new file that its owner alone may read; gives the public half, hexadecimal.
///
/// # Errors
/// There is a file already, or it cannot be written.
pub fn create_key(path: &Path) -> Result<String, Failure> {
    let mut secret = [0; 32];
    fs::File::open("/dev/urandom")?.read_exact(&mut secret)?;
    let key = ContributorKey::from_bytes(&secret);
    let mut file = link::files::create(path).map_err(|e| {
        Failure::new(Exit::Usage, format!("{}: {e}; name a file that is not there yet", path.display()))
    })?;
    file.write_all(key.to_pem().as_bytes())?;
    Ok(key.public())
}
