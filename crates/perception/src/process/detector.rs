//! A process that only [`load`](super::load)s one detector and reports the result.
//!
//! The runtime's backend ends its process where it fails on a graph that it did not expect, and no caller can catch
//! that. So a custom model is tried here first, within the limits of CPU time and memory that the starter has set, and with
//! no right but to read it: a failure ends this process and no other.

use std::io::Read;
use std::process::ExitCode;

use crate::detector::Brought;

/// Longest request, bytes.
const MAX_REQUEST: u64 = 64 * 1024;
/// Reads a [`Brought`] as JSON on standard input up to its end. Exit status 0 accepts it; else a line `refused "why"`
/// names the fault.
pub fn main() -> ExitCode {
    match try_detector() {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => link::drive::refuse("try-detector", &why.to_string()),
    }
}

fn try_detector() -> Result<(), Box<dyn std::error::Error>> {
    let mut request = Vec::new();
    std::io::stdin().take(MAX_REQUEST).read_to_end(&mut request)?;
    let brought: Brought = serde_json::from_slice(&request)?;
    link::confined::reader("try-detector", vec![std::path::absolute(&brought.model.path)?])?;
    super::load(&brought)?;
    Ok(())
}
