//! One service process: started with its specification on a pipe, ended by closing that pipe.

use std::io::{BufRead, BufReader, Write};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::PathBuf;
use std::process::{Child as Process, ChildStdin, Command, Stdio};
use std::sync::mpsc::Sender;

use nix::sys::signal::Signal;
use nix::unistd::Pid;

use link::spec::{Control, ServiceSpec};
use serde_json::Value;
use wire::id::NodeId;

/// Longest line a service may print, bytes.
const MAX_LINE: usize = 256 * 1024;

/// Number of looks at the process table for a process that was told to stop, or is ending.
const STOP_LOOKS: u32 = 10_000;

/// Environment variables that a service may see.
const ENVIRONMENT: [&str; 4] = ["RUST_LOG", "RUST_BACKTRACE", "PATH", "ORT_DYLIB_PATH"];

/// And those that the console may see, for its window.
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
    /// Its links are open.
    Ready(Value),
    /// Its closing statistics.
    Stats(Value),
    /// Words for a person.
    Text(String),
    /// It does not come up, and why.
    Refused(String),
    /// Its window was closed; why, where it could not be opened.
    Closed(Option<String>),
    /// An encoded audit entry that a step may wait for.
    Entry(Vec<u8>),
    /// It said its last.
    Ended,
}

impl Line {
    /// Reads a line; `None` where the launcher does not know it.
    pub fn parse(line: &str) -> Option<Line> {
        let (word, json) = line.split_once(' ')?;
        let value: Value = serde_json::from_str(json).ok()?;
        match word {
            "ready" => Some(Line::Ready(value)),
            "stats" => Some(Line::Stats(value)),
            "refused" => value.as_str().map(|why| Line::Refused(why.to_owned())),
            "text" => value.as_str().map(|text| Line::Text(text.to_owned())),
            "closed" => Some(Line::Closed(value.as_str().map(str::to_owned))),
            "entry" => serde_json::from_value(value).ok().map(Line::Entry),
            _ => None,
        }
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
    ) -> Result<Child, String> {
        if spec.confinement.is_some() {
            link::confined::prepare(spec).map_err(|e| format!("logs of {node}: {e}"))?;
        }
        let mut child = Self::spawn(services, service, node, lines)?;
        let pipe = child.pipe.as_mut().ok_or("no pipe to the service")?;
        spec.write(pipe).map_err(|e| format!("holdsafe-{service} took no specification: {e}"))?;
        Ok(child)
    }

    /// Starts `service` without a specification; the caller writes to its pipe.
    pub fn spawn(
        services: &Services,
        service: &str,
        node: NodeId,
        lines: &Sender<(NodeId, Line)>,
    ) -> Result<Child, String> {
        let mut command = services.command(service);
        let seen = |name: &str| ENVIRONMENT.contains(&name) || (node == NodeId::CONSOLE && WINDOW.contains(&name));
        command.env_clear().envs(std::env::vars().filter(|(name, _)| seen(name)));
        // The allocator reserves 1 GiB at once otherwise: the whole address space of most services.
        command.env("MIMALLOC_ARENA_RESERVE", "32MiB");
        // A group of its own: an interrupt from the keyboard is the launcher's, which seals what there is of the run.
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).process_group(0);
        let mut process = command.spawn().map_err(|e| format!("cannot start {:?}: {e}", command.get_program()))?;
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

    /// Tells it to quiesce or to finish.
    pub fn tell(&mut self, control: &Control) {
        // A service that is gone hears nothing; its exit is noticed elsewhere.
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
        self.signal(Signal::SIGSTOP) && (0..STOP_LOOKS).any(|_| is_stopped(self.pid()) || look_again())
    }

    /// Lets it run again.
    pub fn go_on(&mut self) -> bool {
        self.signal(Signal::SIGCONT)
    }

    fn signal(&mut self, signal: Signal) -> bool {
        let Ok(pid) = i32::try_from(self.pid()) else { return false };
        !self.ended() && nix::sys::signal::kill(Pid::from_raw(pid), signal).is_ok()
    }

    /// True if it has ended.
    pub fn ended(&mut self) -> bool {
        !matches!(self.process.try_wait(), Ok(None))
    }

    /// The signal that ended it, soon after its output has ended; none of a process that goes on without an output.
    pub fn ended_by(&mut self) -> Option<u8> {
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
        if !self.ended() {
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

/// Gives the process the time to stop; never an answer.
fn look_again() -> bool {
    std::thread::yield_now();
    false
}

/// The same for a process that is ending.
fn no_status() -> Option<std::process::ExitStatus> {
    std::thread::yield_now();
    None
}

fn listen(node: NodeId, mut from: impl BufRead, lines: &Sender<(NodeId, Line)>) {
    let mut line = String::new();
    loop {
        line.clear();
        match std::io::Read::take(&mut from, MAX_LINE as u64).read_line(&mut line) {
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
    // Nobody listens any more once the run is over.
    let _ = lines.send((node, Line::Ended));
}

#[cfg(test)]
pub(super) mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    /// Held while a program is written and started, by every other fork, and by tests that lock files: a fork in between
    /// would keep the program open for writing, and so busy, and a lock held.
    pub(crate) fn alone() -> std::sync::MutexGuard<'static, ()> {
        static WRITING: std::sync::Mutex<()> = std::sync::Mutex::new(());
        WRITING.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// A child that runs `script` in place of a service.
    fn child(folder: &tempfile::TempDir, script: &str) -> Child {
        heard(folder, script).0
    }

    /// The same with its lines.
    fn heard(folder: &tempfile::TempDir, script: &str) -> (Child, std::sync::mpsc::Receiver<(NodeId, Line)>) {
        let _alone = alone();
        let program = folder.path().join("holdsafe-script");
        std::fs::write(&program, format!("#!/bin/sh\n{script}\n")).unwrap();
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o700)).unwrap();
        let (lines, heard) = std::sync::mpsc::channel();
        (Child::spawn(&Services::Folder(folder.path().to_owned()), "script", NodeId::SIM, &lines).unwrap(), heard)
    }

    /// One that ended is not.
    #[test]
    fn halted_process_is_listed_as_stopped() {
        let folder = tempfile::tempdir().unwrap();
        let mut running = child(&folder, "exec cat");
        assert!(!is_stopped(running.pid()));
        assert!(running.halt() && is_stopped(running.pid()));
        assert!(running.go_on() && running.kill(), "it can be ended after it went on");
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
        assert_eq!(silent.ended_by(), None);
        assert!(!silent.ended() && silent.kill());
        let (mut killed, lines) = heard(&folder, "kill -SYS $$");
        assert_eq!(lines.recv().unwrap(), (NodeId::SIM, Line::Ended));
        assert_eq!(killed.ended_by(), Some(31));
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
