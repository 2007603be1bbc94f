//! The janitor: a process of its own that outlives a killed launcher and removes what the run left. Where it was killed too, the
//! next run does ([`super::leftovers`]).
//!
//! It is told the run's prefixes and folder over its pipe, waits for the pipe to end, gives the services a moment to
//! end themselves (they see the same end of their own pipes), and sweeps.

use std::io::{BufRead, Read};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use link::clock::pause;
use serde::{Deserialize, Serialize};

use super::leftovers::Mark;

/// How long services get to end themselves, in steps.
const STEP: Duration = Duration::from_millis(50);
const STEPS: u32 = 20;

/// What there is to remove.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Remains {
    /// How every shared-memory name of the run begins.
    pub prefix: String,
    /// Shared-memory domains: (prefix, root).
    pub domains: Vec<(String, PathBuf)>,
    /// The run's folder for sockets.
    pub folder: PathBuf,
    /// The run's logs, where they are nobody's to keep: removed when the launcher was killed and so nobody reads them.
    pub scratch: Option<PathBuf>,
}

/// The line by which a launcher says that it ends in its own time: its logs, and then the mark, it takes away itself.
pub const DONE: &str = "done\n";
/// How the folder of logs that nobody keeps begins.
pub const SCRATCH: &str = "holdsafe-run-";

impl Remains {
    /// Removes everything; to be called when no service is left.
    pub fn remove(&self) {
        for (prefix, root) in &self.domains {
            if let Err(error) = link::bus::sweep::sweep(prefix, root) {
                tracing::warn!(%error, prefix, "shared memory not swept");
            }
        }
        remove(&self.folder);
    }

    /// Removes everything and the logs that nobody keeps.
    pub fn remove_all(&self) {
        self.remove();
        self.scratch.iter().for_each(|scratch| remove(scratch));
    }
}

fn remove(folder: &Path) {
    if is_ours(folder)
        && folder.exists()
        && let Err(error) = std::fs::remove_dir_all(folder)
    {
        tracing::warn!(%error, "run folder not removed");
    }
}

/// A folder of a run and nothing else.
fn is_ours(folder: &Path) -> bool {
    let name = folder.file_name().and_then(|n| n.to_str()).unwrap_or_default();
    name.starts_with("holdsafe-") && folder.parent() == Some(&std::env::temp_dir())
}

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

/// Removes what a run left; of a launcher that is `done` neither logs nor mark, which are there until it has read the logs.
pub(super) fn sweep(remains: &Remains, mark: Option<Mark>, done: bool) {
    if done {
        return remains.remove();
    }
    remains.remove_all();
    mark.iter().for_each(Mark::clear);
}

/// Whether the process still runs and is a service of ours (a recycled id is not).
fn is_service(pid: i32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    let command = std::fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
    let running = !status.is_empty() && !status.contains(") Z ");
    running && String::from_utf8_lossy(&command).contains("holdsafe")
}
