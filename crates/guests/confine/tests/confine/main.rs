//! Guests that mean harm or are broken, each as a process: every one ends with its named fault, and leaves no process behind.

mod fuzz;
mod hostile;
mod killed;
mod measure;
mod sealed;

use std::fs;
use std::path::PathBuf;
use std::process::{Command, id};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use guest::{Failure, GuestChannel, Launcher, Patience, Program};
use tempfile::TempDir;
use wire::guest::{MissionStart, Request};
use wire::time::{Instant, Span};

/// Start of every Python guest: a line in, a line out.
const PYTHON: &str = "import os, sys, time, socket, signal, json\n\
    def take(): return sys.stdin.readline()\n\
    def give(text): sys.stdout.write(text + '\\n'); sys.stdout.flush()\n";

/// A guest's file and program in its own folder.
struct Case {
    program: Program,
    launcher: Arc<dyn Launcher>,
    /// An argument on the command lines of the guest and its helpers that no other process has.
    mark: String,
    folder: TempDir,
}

impl Case {
    /// A guest of these lines of Python; none where there is no Python.
    fn python(text: &str, limits: &str) -> Option<Self> {
        let requested = Command::new("python3").args(["-c", "import sys; print(sys.executable)"]).output();
        let found = requested.ok().filter(|requested| requested.status.success());
        let Some(found) = found else {
            println!("skipped: no python3");
            return None;
        };
        let python = String::from_utf8_lossy(&found.stdout).trim().to_owned();
        Some(Self::new(&python, &format!("{PYTHON}{text}"), limits))
    }

    /// A guest of these lines of the shell.
    fn shell(text: &str, limits: &str) -> Self {
        Self::new("/bin/sh", text, limits)
    }

    fn new(interpreter: &str, text: &str, limits: &str) -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let mark = format!("mark-{}-{}-", id(), NEXT.fetch_add(1, Ordering::Relaxed));
        let folder = TempDir::new().expect("a folder");
        fs::write(folder.path().join("guest"), text).expect("a written file");
        let file = format!(
            "name = \"t\"\ncommand = [{interpreter:?}, \"{{dir}}/guest\", {mark:?}]\nprotocol = \"jsonl/1\"\ngives = [\"drive\"]\n\
             [environment]\nONLY = \"this\"\n[limits]\nstart_ms = 30000\n{limits}\n"
        );
        let program = Program::parse(&file, folder.path(), |_| Err("none".into())).expect("a guest file");
        Self { program, launcher: confine::launcher(helper(), vec![mark.clone()], None), mark, folder }
    }

    /// The case without namespaces.
    fn plain(mut self) -> Self {
        self.launcher = confine::launcher(helper(), vec![self.mark.clone(), "--no-namespaces".into()], None);
        self
    }

    fn with_start_ms(mut self, ms: u64) -> Self {
        self.program.limits.start_ms = ms;
        self
    }

    fn launch(&self) -> Result<Box<dyn GuestChannel>, Failure> {
        self.launcher.launch(&self.program)
    }

    /// The failure of a guest that is asked once at the start and then `steps` times, its channel dropped and no process left.
    fn failure(&self, steps: usize) -> Failure {
        let requested = self.launch().and_then(|mut channel| {
            channel.exchange("start", Patience::Start)?;
            (0..steps).try_for_each(|_| channel.exchange("step", Patience::Step).map(drop))
        });
        assert_eq!(self.left(), Vec::<i32>::new(), "processes are left");
        requested.expect_err("a failure")
    }

    /// Processes with the mark.
    fn left(&self) -> Vec<i32> {
        marked(&self.mark)
    }
}

/// An empty mission.
fn start() -> Request {
    Request::Start(Box::new(MissionStart {
        now: Instant(0),
        period: Span::ms(50),
        max_speed_mm_s: 1000,
        braking_mm_s2: 1000,
        route: [].into_iter().collect(),
        looped: false,
        fence: [].into_iter().collect(),
        obstacles: [].into_iter().collect(),
        blocks: None,
        pose: None,
        body: None,
    }))
}

/// The helper program of this crate.
fn helper() -> PathBuf {
    env!("CARGO_BIN_EXE_holdsafe-confine").into()
}

/// Processes of the machine with this word in their command line.
fn marked(mark: &str) -> Vec<i32> {
    let all =
        fs::read_dir("/proc").expect("/proc").filter_map(|entry| entry.ok()?.file_name().to_str()?.parse::<i32>().ok());
    let is_running = |pid: &i32| {
        fs::read(format!("/proc/{pid}/cmdline")).is_ok_and(|line| String::from_utf8_lossy(&line).contains(mark))
    };
    all.filter(is_running).collect()
}
