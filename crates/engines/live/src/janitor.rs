//! The janitor: a separate process that outlives a killed launcher and removes the run's remains. Where it was killed too, the next run
//! removes them ([`super::leftovers`]).
//!
//! It receives the run's prefixes and folder over its pipe, and waits for the end of that pipe. Then it gives the services a moment to end
//! themselves, since the pipes of the services end too, and sweeps.

use std::io::{BufRead, Read};
use std::process::ExitCode;
use std::time::Duration;

use link::clock::pause;

use super::leftovers::{Mark, sweep};
use super::remains::Remains;

/// Time for services to end themselves, in steps.
const STEP: Duration = Duration::from_millis(50);
const STEPS: u32 = 20;

/// The line of a launcher that ends by itself: it removes its logs, and then the mark, itself.
pub const DONE: &str = "done\n";

/// The process. Standard input: one line of JSON ([`Remains`]), then process ids and perhaps [`DONE`],
/// one a line, until the end.
pub fn main() -> ExitCode {
    let mut input = std::io::stdin().lock();
    let mut first = String::new();
    let read = Read::take(&mut input, 64 * 1024).read_line(&mut first);
    let Ok(remains) = serde_json::from_str::<Remains>(&first) else {
        link::note!("holdsafe janitor: expected a line of JSON, got {read:?}");
        return ExitCode::from(2);
    };
    let mark = Mark::join(&remains);
    let (mut pids, mut done) = (Vec::new(), false);
    for line in input.lines().map_while(Result::ok).take(256) {
        pids.extend(line.trim().parse::<i32>());
        done |= line.trim() == DONE.trim();
    }
    for _ in 0..STEPS {
        if !pids.iter().any(|pid| is_service(*pid)) {
            break;
        }
        pause(STEP);
    }
    for pid in pids.into_iter().filter(|pid| is_service(*pid)) {
        let _ = nix::sys::signal::kill(nix::unistd::Pid::from_raw(pid), nix::sys::signal::Signal::SIGKILL);
    }
    pause(STEP);
    sweep(&remains, mark.ok(), done);
    ExitCode::SUCCESS
}

/// True if the process still runs and is a service of this program; a process with a recycled id is not.
fn is_service(pid: i32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    let command = std::fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
    let running = !status.is_empty() && !status.contains(") Z ");
    running && String::from_utf8_lossy(&command).contains("holdsafe")
}
