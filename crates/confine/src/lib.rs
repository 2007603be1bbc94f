//! Programs of others as confined processes. The crate `guest` says what is asked of them.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use guest::{Channel, Failure, Launcher, Patience, Program};
use wire::guest::Fault;

/// TEMPORARY.
pub fn launcher(_program: std::path::PathBuf, _arguments: Vec<String>) -> Arc<dyn Launcher> {
    Arc::new(Plain)
}

struct Plain;

struct Running {
    child: Child,
    stdin: ChildStdin,
    lines: Mutex<Receiver<String>>,
    limits: guest::file::Limits,
}

impl Launcher for Plain {
    fn launch(&self, program: &Program) -> Result<Box<dyn Channel>, Failure> {
        let mut child = Command::new(&program.command[0])
            .args(&program.command[1..])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .current_dir(&program.folder)
            .spawn()
            .map_err(|e| Failure::new(Fault::NotStarted, e.to_string()))?;
        let (stdin, stdout) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        let (tx, rx) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                if tx.send(line).is_err() {
                    return;
                }
            }
        });
        Ok(Box::new(Running { child, stdin, lines: Mutex::new(rx), limits: program.limits.clone() }))
    }
}

impl Channel for Running {
    fn exchange(&mut self, line: &str, patience: Patience) -> Result<String, Failure> {
        writeln!(self.stdin, "{line}").map_err(|e| Failure::new(Fault::Ended, e.to_string()))?;
        let ms = if patience == Patience::Start { self.limits.start_ms } else { self.limits.step_ms };
        self.lines.lock().unwrap().recv_timeout(Duration::from_millis(ms)).map_err(|e| match e {
            std::sync::mpsc::RecvTimeoutError::Timeout => Failure::new(Fault::Silent, "no answer"),
            std::sync::mpsc::RecvTimeoutError::Disconnected => Failure::new(Fault::Ended, "ended"),
        })
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
