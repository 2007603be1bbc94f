//! One service process: started with its specification on a pipe, ended by closing that pipe.

use std::ffi::OsString;
use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::PathBuf;
use std::process::{Child as Process, ChildStdin, Command, Stdio};
use std::sync::mpsc::Sender;

use nix::sys::signal::Signal;
use nix::unistd::Pid;

use link::spec::{Control, ServiceSpec, SpecError};
use serde_json::Value;
use wire::id::NodeId;

/// Longest line of a service's output, bytes.
const MAX_LINE: usize = 256 * 1024;

/// Number of looks at the process table for a process that is stopping or ending.
const STOP_LOOKS: u32 = 10_000;

/// Environment variables that a service may see.
const ENVIRONMENT: [&str; 4] = ["RUST_LOG", "RUST_BACKTRACE", "PATH", "ORT_DYLIB_PATH"];

/// Environment variables that the console may see too, for its window.
const WINDOW: [&str; 7] =
    ["DISPLAY", "WAYLAND_DISPLAY", "XAUTHORITY", "XDG_RUNTIME_DIR", "HOME", "LD_LIBRARY_PATH", "LIBGL_ALWAYS_SOFTWARE"];

/// Location of the service programs.
#[derive(Clone, Debug)]
pub enum Services {
    /// This very program, started again for each service.
    Own(PathBuf),
    /// A folder with the separate binaries.
    Folder(PathBuf),
}

impl Services {
    /// The command that starts `service`.
    pub(super) fn command(&self, service: &str) -> Command {
        match self {
            Services::Own(program) => {
                let mut command = Command::new(program);
                command.args(["service", service]);
                command
            }
            Services::Folder(folder) => Command::new(folder.join(format!("holdsafe-{service}"))),
        }
    }
}

/// A line of a service's standard output.
#[derive(Clone, Debug, PartialEq)]
pub enum Line {
    /// The service is ready: its links are open.
    Ready(Value),
    /// Closing statistics.
    Stats(Value),
    /// Text for a person.
    Text(String),
    /// Reason for which it does not come up.
    Refused(String),
    /// End of its window; with a reason where that could not be opened.
    Closed(Option<String>),
    /// An encoded audit entry that a step may wait for.
    Entry(Vec<u8>),
    /// End of its output.
    Ended,
}

impl Line {
    /// Parses a line; `None` for an unknown one.
    pub fn parse(line: &str) -> Option<Line> {
        let (word, json) = line.split_once(' ')?;
        let value: Value = serde_json::from_str(json).ok()?;
        match word {
            "ready" => Some(Line::Ready(value)),
            "stats" => Some(Line::Stats(value)),
            "refused" => value.as_str().map(|reason| Line::Refused(reason.to_owned())),
            "text" => value.as_str().map(|text| Line::Text(text.to_owned())),
            "closed" => Some(Line::Closed(value.as_str().map(str::to_owned))),
            "entry" => serde_json::from_value(value).ok().map(Line::Entry),
            _ => None,
        }
    }
}

/// Reason for which a process cannot be started.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// Its log files cannot be made.
    #[error("logs of {node}: {error}")]
    Logs {
        /// The service.
        node: NodeId,
        /// Error of the host.
        error: io::Error,
    },
    /// The host starts no such process.
    #[error("cannot start {program:?}: {error}")]
    Spawn {
        /// Path of the program.
        program: OsString,
        /// Error of the host.
        error: io::Error,
    },
    /// It has no standard input.
    #[error("no pipe to the service")]
    NoPipe,
    /// It did not take its specification.
    #[error("holdsafe-{service} took no specification: {error}")]
    Specification {
        /// Name of the service.
        service: String,
        /// Reason.
        error: SpecError,
    },
}

impl StartError {
    /// Error of the host for this command.
    pub(super) fn spawn(command: &Command, error: io::Error) -> Self {
        Self::Spawn { program: command.get_program().to_owned(), error }
    }
}

/// A running service.
pub struct Child {
    /// Node of the service.
    pub node: NodeId,
    process: Process,
    pipe: Option<ChildStdin>,
}

impl Child {
    /// Starts `service` as `node` and hands it `spec`. Its output goes to `lines`.
    pub fn start(
        services: &Services,
        service: &str,
        node: NodeId,
        lines: &Sender<(NodeId, Line)>,
        spec: &ServiceSpec,
    ) -> Result<Child, StartError> {
        // A confined service can make no file, so the files that it writes exist before its start.
        if spec.confinement.is_some() {
            link::confined::prepare(spec).map_err(|error| StartError::Logs { node, error })?;
        }
        let mut child = Self::spawn(services, service, node, lines)?;
        let pipe = child.pipe.as_mut().ok_or(StartError::NoPipe)?;
        spec.write(pipe).map_err(|error| StartError::Specification { service: service.to_owned(), error })?;
        Ok(child)
    }

    /// Starts `service` without a specification; the caller writes to its pipe.
    pub fn spawn(
        services: &Services,
        service: &str,
        node: NodeId,
        lines: &Sender<(NodeId, Line)>,
    ) -> Result<Child, StartError> {
        let mut command = services.command(service);
        let is_listed = |name: &str| ENVIRONMENT.contains(&name) || (node == NodeId::CONSOLE && WINDOW.contains(&name));
        command.env_clear().envs(std::env::vars().filter(|(name, _)| is_listed(name)));
        // The allocator reserves 1 GiB at once otherwise: the whole address space of most services.
        command.env("MIMALLOC_ARENA_RESERVE", "32MiB");
        // A separate process group: an interrupt from the keyboard reaches the launcher alone, which then seals the run up to there.
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).process_group(0);
        let mut process = command.spawn().map_err(|error| StartError::spawn(&command, error))?;
        let pipe = process.stdin.take();
        if let Some(stdout) = process.stdout.take() {
            let lines = lines.clone();
            std::thread::spawn(move || listen(node, BufReader::new(stdout), &lines));
        }
        Ok(Child { node, process, pipe })
    }

    /// Writes raw bytes to the service.
    pub fn write(&mut self, bytes: &[u8]) -> bool {
        self.pipe.as_mut().is_some_and(|pipe| pipe.write_all(bytes).and_then(|()| pipe.flush()).is_ok())
    }

    /// Sends it a control message, such as to quiesce or to finish.
    pub fn send(&mut self, control: &Control) {
        // A service that has ended takes no message; its end is noticed elsewhere.
        let _ = self.write(control.line().as_bytes());
    }

    /// Process id.
    pub fn pid(&self) -> u32 {
        self.process.id()
    }

    /// Ends it with SIGKILL and waits for it. True only when its wait status says that this signal ended it.
    pub fn kill(&mut self) -> bool {
        let sent = self.process.kill().is_ok();
        let status = self.process.wait();
        sent && status.is_ok_and(|status| status.signal() == Some(Signal::SIGKILL as i32))
    }

    /// Stops it with SIGSTOP. True only when the kernel's process table then shows it stopped.
    pub fn halt(&mut self) -> bool {
        self.signal(Signal::SIGSTOP) && (0..STOP_LOOKS).any(|_| is_stopped(self.pid()) || yield_once())
    }

    /// Resumes it with SIGCONT.
    pub fn resume(&mut self) -> bool {
        self.signal(Signal::SIGCONT)
    }

    fn signal(&mut self, signal: Signal) -> bool {
        let Ok(pid) = i32::try_from(self.pid()) else { return false };
        !self.has_ended() && nix::sys::signal::kill(Pid::from_raw(pid), signal).is_ok()
    }

    /// True if it has ended.
    pub fn has_ended(&mut self) -> bool {
        !matches!(self.process.try_wait(), Ok(None))
    }

    /// The signal that ended it, soon after the end of its output; none for a process that continues without an output.
    pub fn ending_signal(&mut self) -> Option<u8> {
        // A bounded number of looks: a wait would block the launcher where a service closes its output and continues.
        let status = (0..STOP_LOOKS).find_map(|_| self.process.try_wait().ok().flatten().or_else(no_status))?;
        status.signal().and_then(|number| u8::try_from(number).ok())
    }

    /// Closes its pipe, which ends it.
    pub fn release(&mut self) {
        self.pipe = None;
    }

    /// Waits for its end.
    pub fn wait(&mut self) {
        let _ = self.process.wait();
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        self.release();
        if !self.has_ended() {
            self.kill();
        }
    }
}

/// True if the process table shows this process stopped.
fn is_stopped(pid: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    // The name, in brackets, may hold anything; the state follows it.
    stat.rsplit_once(") ").is_some_and(|(_, rest)| rest.starts_with('T'))
}

/// Gives the process time to stop; always false.
fn yield_once() -> bool {
    std::thread::yield_now();
    false
}

/// Gives the process time to end; always none.
fn no_status() -> Option<std::process::ExitStatus> {
    std::thread::yield_now();
    None
}

fn listen(node: NodeId, mut output: impl BufRead, lines: &Sender<(NodeId, Line)>) {
    let mut line = String::new();
    loop {
        line.clear();
        // A service may write without a line end, so the length of a line is limited here and not by its sender.
        match std::io::Read::take(&mut output, MAX_LINE as u64).read_line(&mut line) {
            Ok(0) | Err(_) => break,
            Ok(_) => {
                if let Some(line) = Line::parse(line.trim_end())
                    && lines.send((node, line)).is_err()
                {
                    return;
                }
            }
        }
    }
    // After the run the launcher receives no more lines.
    let _ = lines.send((node, Line::Ended));
}

#[cfg(test)]
pub(super) mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    /// Lock for tests that write and start a program, fork otherwise, or lock files: a fork in between would keep the program open for
    /// writing, and so busy, and a lock held.
    pub(crate) fn exclude_forks() -> std::sync::MutexGuard<'static, ()> {
        static WRITING: std::sync::Mutex<()> = std::sync::Mutex::new(());
        WRITING.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// A child that runs `script` in place of a service.
    fn child(folder: &tempfile::TempDir, script: &str) -> Child {
        child_with_lines(folder, script).0
    }

    /// A child that runs `script` in place of a service, with its lines.
    fn child_with_lines(
        folder: &tempfile::TempDir,
        script: &str,
    ) -> (Child, std::sync::mpsc::Receiver<(NodeId, Line)>) {
        let _guard = exclude_forks();
        let program = folder.path().join("holdsafe-script");
        std::fs::write(&program, format!("#!/bin/sh\n{script}\n")).unwrap();
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o700)).unwrap();
        let (lines, received) = std::sync::mpsc::channel();
        (Child::spawn(&Services::Folder(folder.path().to_owned()), "script", NodeId::SIM, &lines).unwrap(), received)
    }

    /// A process that has ended is not halted.
    #[test]
    fn halted_process_is_listed_as_stopped() {
        let folder = tempfile::tempdir().unwrap();
        let mut running = child(&folder, "exec cat");
        assert!(!is_stopped(running.pid()));
        assert!(running.halt() && is_stopped(running.pid()));
        assert!(running.resume() && running.kill(), "it can be ended after it was resumed");
        let mut halted = child(&folder, "exec cat");
        assert!(halted.halt() && halted.kill(), "and while it is stopped");
        let mut ended = child(&folder, "exit 0");
        ended.wait();
        assert!(!ended.halt());
    }

    /// The launcher does not wait for it.
    #[test]
    fn process_that_only_closed_its_output_has_no_signal() {
        let folder = tempfile::tempdir().unwrap();
        let mut silent = child(&folder, "exec cat >/dev/null");
        assert_eq!(silent.ending_signal(), None);
        assert!(!silent.has_ended() && silent.kill());
        let (mut killed, lines) = child_with_lines(&folder, "kill -SYS $$");
        assert_eq!(lines.recv().unwrap(), (NodeId::SIM, Line::Ended));
        assert_eq!(killed.ending_signal(), Some(31));
    }

    #[test]
    fn only_sigkill_counts_as_killed() {
        let folder = tempfile::tempdir().unwrap();
        assert!(child(&folder, "exec cat").kill());
        assert!(!child(&folder, "exit 0").killed_after_its_end(), "it ended by itself");
        assert!(!child(&folder, "kill -TERM $$").killed_after_its_end(), "another signal ended it");
    }

    impl Child {
        fn killed_after_its_end(&mut self) -> bool {
            self.wait();
            self.kill()
        }
    }
}
