//! The processes of one guest, seen from outside: begun by a specification, ended with their handle.

use std::io::Write;
use std::os::unix::net::UnixStream;
use std::process::Child;
use std::time::Duration;

use guest::Failure;
use rustix::event::{PollFd, PollFlags, poll};
use rustix::process::{Pid, PidfdFlags, pidfd_open};
use wire::guest::Fault;
use wire::plain;

use crate::deadline::{Deadline, timeout};
use crate::level::Level;
use crate::spec::{self, Report, Spec};

/// Time that the helper has to end by itself before it is killed.
const GRACE: Duration = Duration::from_secs(5);

/// A helper's processes, which end with this.
pub(crate) struct Process {
    pub(crate) child: Child,
    pub(crate) control: UnixStream,
}

impl Process {
    /// Hands the specification over; gives the level that the program was started at.
    ///
    /// # Errors
    /// The program could not be started, in the helper's words.
    pub(crate) fn begin(&mut self, spec: &Spec, deadline: &Deadline) -> Result<Level, Failure> {
        let mut line = serde_json::to_string(spec).map_err(not_started)?;
        line.push('\n');
        self.control.set_write_timeout(Some(deadline.left())).map_err(not_started)?;
        // A helper that fails before it reads breaks the stream, and still reports the reason.
        let written = self.control.write_all(line.as_bytes());
        match self.report(deadline.left()) {
            Some(Report::Started(level)) => Ok(level),
            Some(Report::NotStarted(why)) => Err(not_started(why)),
            Some(Report::Ended { how, .. }) => Err(not_started(how.unwrap_or_default())),
            None => Err(not_started(match written {
                Err(why) => format!("the helper takes no specification: {why}"),
                Ok(()) => "the helper gives no report of the start".to_owned(),
            })),
        }
    }

    /// Next report within `limit`. Text in another form, such as that of a panic, counts as the reason for a failed
    /// start.
    fn report(&mut self, limit: Duration) -> Option<Report> {
        self.control.set_read_timeout(Some(limit.max(Duration::from_millis(1)))).ok()?;
        let line = spec::line(&mut self.control).ok()??;
        Some(
            serde_json::from_str(&line)
                .unwrap_or_else(|_| Report::NotStarted(format!("the helper failed: {}", guest_line(&line)))),
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
            Some(Report::Ended { how, words }) => (how, guest_line(&words)),
            Some(Report::NotStarted(why)) => (Some(why), String::new()),
            Some(Report::Started(_)) | None => (None, String::new()),
        }
    }
}

impl Drop for Process {
    /// Returns when every process of the guest is gone, or after a time of grace: the entry ends after the warden, and the warden after all others.
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

/// Text of a guest on one line, without control characters. The last line comes first: in a traceback it has the
/// reason.
fn guest_line(words: &str) -> String {
    let plain = |line: &str| line.chars().map(plain::shown).collect::<String>();
    let lines: Vec<String> =
        words.lines().map(|line| plain(line).trim().to_owned()).filter(|line| !line.is_empty()).collect();
    match lines.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, before)) => format!("{last} (after: {})", before.join(" / ")),
        None => String::new(),
    }
}

/// Failure of a start, with its reason.
pub(crate) fn not_started(reason: impl ToString) -> Failure {
    Failure::new(Fault::NotStarted, reason.to_string())
}
