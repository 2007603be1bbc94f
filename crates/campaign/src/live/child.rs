//! One service process: started with its specification on a pipe, ended by closing that pipe.

use std::io::{BufRead, BufReader, Write};
use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::{Child as Process, ChildStdin, Command, Stdio};
use std::sync::mpsc::Sender;

use link::spec::{Control, ServiceSpec};
use serde_json::Value;
use wire::id::NodeId;

/// Longest line a service may print, bytes.
const MAX_LINE: usize = 256 * 1024;

/// Environment variables that a service may see.
const ENVIRONMENT: [&str; 4] = ["RUST_LOG", "RUST_BACKTRACE", "PATH", "ORT_DYLIB_PATH"];

/// Where the service programs are.
#[derive(Clone, Debug)]
pub enum Services {
    /// This very program, started again for each service.
    Own(PathBuf),
    /// A folder with the separate binaries.
    Folder(PathBuf),
}

impl Services {
    fn command(&self, service: &str) -> Command {
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

/// What a service said on its standard output.
#[derive(Clone, Debug, PartialEq)]
pub enum Line {
    /// Its links are open.
    Ready(Value),
    /// Its closing statistics.
    Stats(Value),
    /// Words for a person.
    Text(String),
    /// It said its last.
    Ended,
}

/// A running service.
pub struct Child {
    /// Who it is.
    pub node: NodeId,
    process: Process,
    pipe: Option<ChildStdin>,
}

impl Child {
    /// Starts `service` as `node` and hands it `spec`. What it prints goes to `lines`.
    pub fn start(
        services: &Services,
        service: &str,
        node: NodeId,
        lines: &Sender<(NodeId, Line)>,
        spec: &ServiceSpec,
    ) -> Result<Child, String> {
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
        command.env_clear().envs(std::env::vars().filter(|(name, _)| ENVIRONMENT.contains(&name.as_str())));
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
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
    pub fn tell(&mut self, control: Control) {
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
        sent && status.is_ok_and(|status| status.signal() == Some(nix::sys::signal::Signal::SIGKILL as i32))
    }

    /// Whether it has ended.
    pub fn ended(&mut self) -> bool {
        !matches!(self.process.try_wait(), Ok(None))
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

fn listen(node: NodeId, mut from: impl BufRead, lines: &Sender<(NodeId, Line)>) {
    let mut line = String::new();
    loop {
        line.clear();
        match std::io::Read::take(&mut from, MAX_LINE as u64).read_line(&mut line) {
            Ok(0) | Err(_) => break,
            Ok(_) => {
                if let Some(line) = parse(line.trim_end())
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

fn parse(line: &str) -> Option<Line> {
    let (word, json) = line.split_once(' ')?;
    let value: Value = serde_json::from_str(json).ok()?;
    match word {
        "ready" => Some(Line::Ready(value)),
        "stats" => Some(Line::Stats(value)),
        "text" => value.as_str().map(|text| Line::Text(text.to_owned())),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    /// A child that runs `script` in place of a service.
    fn child(folder: &tempfile::TempDir, script: &str) -> Child {
        let program = folder.path().join("holdsafe-script");
        std::fs::write(&program, format!("#!/bin/sh\n{script}\n")).unwrap();
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o700)).unwrap();
        let (lines, _unheard) = std::sync::mpsc::channel();
        Child::spawn(&Services::Folder(folder.path().to_owned()), "script", NodeId::SIM, &lines).unwrap()
    }

    #[test]
    fn only_a_process_that_sigkill_ended_counts_as_killed() {
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
