//! A process that does nothing but [`load`](super::load) one detector and say whether that went well.
//!
//! The runtime's backend ends its process where it fails on a graph that it did not expect, and no caller can catch
//! that. So a file that somebody brings is tried here first, within the limits of CPU time and memory that the starter
//! has set: what goes wrong ends this process and no other.

use std::io::Read;
use std::process::ExitCode;

use crate::detector::Brought;

/// Longest request, bytes.
const MAX_REQUEST: u64 = 64 * 1024;
/// Reads a [`Brought`] as JSON on standard input up to its end. It is fit where the exit status is 0; else a line
/// `refused "why"` says what is wrong with it.
pub fn main() -> ExitCode {
    match vet() {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => link::drive::refuse("vet", &why.to_string()),
    }
}

fn vet() -> Result<(), Box<dyn std::error::Error>> {
    let mut request = Vec::new();
    std::io::stdin().take(MAX_REQUEST).read_to_end(&mut request)?;
    let brought: Brought = serde_json::from_slice(&request)?;
    super::load(&brought)?;
    Ok(())
}
