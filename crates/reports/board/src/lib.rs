//! The leaderboard of guests: rows of trials, each signed by its contributor, in one file that anybody can add to, verify and run again.
//!
//! `row` has a row and `bounds` its limits, `key` a contributor's keys, `signed` a row with its signature, `file` the file of rows, `shown`
//! the table of a verified file, and `replay` the comparison of a row with its trials run again. Running trials is left to `runner`, reading
//! files from disk to the callers.

mod bounds;
mod file;
mod key;
mod replay;
mod row;
mod shown;
mod signed;
#[cfg(test)]
mod tests;

pub use bounds::{MAX_TRIALS, RowFault, check_draft};
pub use file::{Board, BoardError, Finding, MAX_FILE_BYTES, MAX_ROWS, VERSION};
pub use key::{ContributorKey, KeyError, MAX_KEY_BYTES, public_key};
pub use replay::{ClassPair, Differing, Replay, ReplayVerdict};
pub use row::{Availability, BoardRow, BoardTrial, Contributor, GuestIdentity, Host, Inputs, ProgramIdentity};
pub use shown::{Half, ShownBoard, ShownRow};
pub use signed::SignedRow;

/// SHA-256 of `bytes`, lower-case hexadecimal.
pub fn digest(bytes: &[u8]) -> String {
    use sha2::Digest;
    evidence::log::hex(&sha2::Sha256::digest(bytes))
}
