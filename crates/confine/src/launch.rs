//! The launcher's side of a start: the helper as a child process, its specification, its reports and its end.

use std::collections::BTreeMap;
use std::io::{PipeReader, PipeWriter, Write, pipe};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Child, Command};
use std::time::Duration;

use guest::file::{Limits, Program};
use guest::{Channel, Failure, Launcher};
use rustix::event::{PollFd, PollFlags, poll};
use rustix::process::{Pid, PidfdFlags, pidfd_open};
use wire::guest::Fault;

use crate::channel::{Deadline, Lines};
use crate::level::Level;
use crate::spec::{self, Report, Spec};

/// Time that the helper has to end by itself before it is killed.
const GRACE: Duration = Duration::from_secs(5);

/// A program that calls [`crate::inside::main`].
pub(crate) struct Helper {
    pub(crate) program: PathBuf,
    pub(crate) leading: Vec<String>,
}

impl Launcher for Helper {
    fn launch(&self, program: &Program) -> Result<Box<dyn Channel>, Failure> {
        if !program.folder.is_absolute() {
            return Err(not_started(format!("an absolute folder expected, got {}", program.folder.display())));
        }
        let spec = Spec {
            command: program.command.clone(),
            folder: program.folder.clone(),
            environment: program.environment.clone(),
            limits: program.limits.clone(),
        };
        let deadline = Deadline::after_ms(program.limits.start_ms);
        let (process, input, output, _level) = self.start(&spec, &deadline)?;
        let lines = Lines::new(process, input, output, deadline, program.limits.step_ms).map_err(not_started)?;
        Ok(Box::new(lines))
    }
}

impl Helper {
    /// The level that the helper reaches, by a start without a program.
    pub(crate) fn level(&self) -> Result<Level, Failure> {
        let limits = Limits::default();
        let deadline = Deadline::after_ms(limits.start_ms);
        let spec = Spec { command: Vec::new(), folder: "/".into(), environment: BTreeMap::new(), limits };
        self.start(&spec, &deadline).map(|(_, _, _, level)| level)
    }

    /// The process with its standard input and output, and its level.
    fn start(&self, spec: &Spec, deadline: &Deadline) -> Result<(Process, PipeWriter, PipeReader, Level), Failure> {
        let (their_input, input) = pipe().map_err(not_started)?;
        let (output, their_output) = pipe().map_err(not_started)?;
        let (control, theirs) = UnixStream::pair().map_err(not_started)?;
        let child = Command::new(&self.program)
            .args(&self.leading)
            .env_clear()
            .process_group(0)
            .stdin(their_input)
            .stdout(their_output)
            .stderr(OwnedFd::from(theirs))
            .spawn()
            .map_err(|why| not_started(format!("{}: {why}", self.program.display())))?;
        let mut process = Process { child, control };
        let level = process.begin(spec, deadline)?;
        Ok((process, input, output, level))
    }
}

/// A helper's processes, which end with this.
pub(crate) struct Process {
    child: Child,
    control: UnixStream,
}

impl Process {
    fn begin(&mut self, spec: &Spec, deadline: &Deadline) -> Result<Level, Failure> {
        let mut line = serde_json::to_string(spec).map_err(not_started)?;
        line.push('\n');
        self.control.set_write_timeout(Some(deadline.left())).map_err(not_started)?;
        self.control
            .write_all(line.as_bytes())
            .map_err(|why| not_started(format!("the helper takes no specification: {why}")))?;
        match self.report(deadline.left()) {
            Some(Report::Started(level)) => Ok(level),
            Some(Report::NotStarted(why)) => Err(not_started(why)),
            Some(Report::Ended { how, .. }) => Err(not_started(how.unwrap_or_default())),
            None => Err(not_started("the helper gives no report of the start")),
        }
    }

    /// The next report within this time. The text of a helper that failed otherwise is the reason of a start that was none.
    fn report(&mut self, within: Duration) -> Option<Report> {
        self.control.set_read_timeout(Some(within.max(Duration::from_millis(1)))).ok()?;
        let line = spec::line(&mut self.control).ok()??;
        Some(
            serde_json::from_str(&line)
                .unwrap_or_else(|_| Report::NotStarted(format!("the helper failed: {}", said(&line)))),
        )
    }

    /// Ends the program unless it has ended; its exit in words where it ended by itself within `grace`, and its last words.
    pub(crate) fn end(&mut self, grace: Duration) -> (Option<String>, String) {
        let mut report = self.report(grace);
        if report.is_none() {
            // The warden sees the end of the stream, and reports once more.
            let _gone = self.control.shutdown(std::net::Shutdown::Write);
            report = self.report(GRACE);
        }
        match report {
            Some(Report::Ended { how, words }) => (how, said(&words)),
            Some(Report::NotStarted(why)) => (Some(why), String::new()),
            Some(Report::Started(_)) | None => (None, String::new()),
        }
    }
}

impl Drop for Process {
    /// Returns when every process of the guest is gone: the entry ends after the warden, and the warden after all others.
    fn drop(&mut self) {
        let _gone = self.control.shutdown(std::net::Shutdown::Both);
        let ended = Pid::from_raw(self.child.id() as i32)
            .and_then(|pid| pidfd_open(pid, PidfdFlags::empty()).ok())
            .and_then(|pid| poll(&mut [PollFd::new(&pid, PollFlags::IN)], Some(&timeout(GRACE))).ok());
        if ended != Some(1) {
            let _gone = self.child.kill();
        }
        let _status = self.child.wait();
    }
}

/// A duration as `poll` takes it.
pub(crate) fn timeout(within: Duration) -> rustix::event::Timespec {
    rustix::event::Timespec { tv_sec: within.as_secs() as i64, tv_nsec: i64::from(within.subsec_nanos()) }
}

/// A guest's words on one line without control characters, the last line first: that of a traceback has the reason.
fn said(words: &str) -> String {
    let plain = |line: &str| line.chars().map(|c| if c.is_control() { ' ' } else { c }).collect::<String>();
    let lines: Vec<String> =
        words.lines().map(|line| plain(line).trim().to_owned()).filter(|line| !line.is_empty()).collect();
    match lines.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, before)) => format!("{last} (after: {})", before.join(" / ")),
        None => String::new(),
    }
}

fn not_started(why: impl ToString) -> Failure {
    Failure::new(Fault::NotStarted, why.to_string())
}
