//! Trial of a custom detector in a process of its own before it is loaded anywhere else.
//!
//! The process has limits of CPU time and memory from the kernel, set before it learns the file. So a file that loops,
//! grows or brings its runtime down ends that process, and is refused with the reason.

use std::io::{Read, Write};
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, ExitStatus, Stdio};

use nix::sys::signal::Signal;
use perception::detector::Brought;
use rustix::process::{Pid, Resource, Rlimit, prlimit};

use super::child::{Line, Services};

/// Resource limits of a process that tries a detector.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// CPU time, seconds.
    pub cpu_s: u64,
    /// Address space, bytes.
    pub memory: u64,
}

impl Limits {
    /// A hundred times the shipped detector's time, and a hundred times the size of a small one's file.
    pub const USUAL: Limits = Limits { cpu_s: 10, memory: 2 << 30 };
}

/// Longest answer, bytes.
const MAX_ANSWER: u64 = 16 * 1024;

/// Tries the detector within `limits`.
///
/// # Errors
/// Why it is refused.
pub fn try_detector(services: &Services, brought: &Brought, limits: Limits) -> Result<(), String> {
    let request = serde_json::to_vec(brought).map_err(|e| e.to_string())?;
    let mut command = services.command("try-detector");
    command.env_clear().stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut child = command.spawn().map_err(|e| format!("cannot start {:?}: {e}", command.get_program()))?;
    let said = limit(&child, limits).and_then(|()| ask(&mut child, &request));
    if said.is_err() {
        // It may be waiting still; whether it had ended already is all the same.
        let _ended = child.kill();
    }
    let status = child.wait().map_err(|e| e.to_string())?;
    match said?.lines().find_map(Line::parse) {
        Some(Line::Refused(why)) => Err(why),
        Some(_) | None if status.success() => Ok(()),
        Some(_) | None => Err(end(status, limits)),
    }
}

fn limit(child: &Child, limits: Limits) -> Result<(), String> {
    let pid = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
    for (resource, most) in [(Resource::Cpu, limits.cpu_s), (Resource::As, limits.memory), (Resource::Core, 0)] {
        let both = Rlimit { current: Some(most), maximum: Some(most) };
        prlimit(pid, resource, both).map_err(|e| format!("cannot limit the process that tries the detector: {e}"))?;
    }
    Ok(())
}

/// Its output until it ends. A process that ends before it has read the request reports by its status.
fn ask(child: &mut Child, request: &[u8]) -> Result<String, String> {
    if let Some(mut pipe) = child.stdin.take() {
        let _unread = pipe.write_all(request);
    }
    let mut said = String::new();
    let answer = child.stdout.take().ok_or("no pipe from the process that tries the detector")?;
    answer.take(MAX_ANSWER).read_to_string(&mut said).map_err(|e| e.to_string())?;
    Ok(said)
}

/// Reason for which a process ended without an answer.
fn end(status: ExitStatus, limits: Limits) -> String {
    let signal = status.signal().and_then(|number| Signal::try_from(number).ok());
    match signal {
        Some(Signal::SIGXCPU | Signal::SIGKILL) => {
            format!("the detector was not loaded and tried within {} s of CPU", limits.cpu_s)
        }
        Some(Signal::SIGABRT) => {
            format!("the runtime failed on the detector: it panicked, or wanted more than {} MiB", limits.memory >> 20)
        }
        Some(signal) => format!("the runtime failed on the detector: {signal}"),
        None => format!("the detector could not be tried: {status}"),
    }
}
