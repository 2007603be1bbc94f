//! Lines to and from a running guest, each exchange within its time and its bytes.

use std::io::{ErrorKind, PipeReader, PipeWriter, Read, Write};
use std::time::Duration;

use guest::{Failure, GuestChannel, MAX_LINE, Patience};
use rustix::event::{PollFd, PollFlags, poll};
use rustix::io::ioctl_fionbio;
use wire::guest::Fault;

use crate::deadline::{Deadline, timeout};
use crate::process::Process;

/// Time in which the exit of a guest that closed its output is awaited.
const EXIT: Duration = Duration::from_millis(500);
/// Bytes of one read.
const CHUNK: usize = 8 * 1024;

/// A guest's standard input and output.
pub(crate) struct Lines {
    /// None once the guest has closed its end.
    input: Option<PipeWriter>,
    output: PipeReader,
    /// Bytes read and not yet returned, fewer than [`MAX_LINE`] and one read.
    read: Vec<u8>,
    start: Deadline,
    /// True once a start has been answered: each later one has the whole time.
    started: bool,
    step_ms: u64,
    process: Process,
}

impl Lines {
    pub(crate) fn new(
        process: Process,
        input: PipeWriter,
        output: PipeReader,
        start: Deadline,
        step_ms: u64,
    ) -> std::io::Result<Self> {
        ioctl_fionbio(&input, true)?;
        ioctl_fionbio(&output, true)?;
        Ok(Self { input: Some(input), output, read: Vec::new(), start, started: false, step_ms, process })
    }

    /// Failure of a guest that has written more than one line for a request.
    fn unasked(&mut self) -> Result<(), Failure> {
        self.take()?;
        if self.read.is_empty() {
            return Ok(());
        }
        Err(Failure::new(Fault::Flood, format!("one line for a request expected, got {} bytes more", self.read.len())))
    }

    /// Reads once from the guest's output.
    fn take(&mut self) -> Result<(), Failure> {
        let mut chunk = [0; CHUNK];
        match self.output.read(&mut chunk) {
            Ok(0) => Err(self.ended()),
            Ok(n) => {
                self.read.extend_from_slice(&chunk[..n]);
                Ok(())
            }
            Err(why) if matches!(why.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => Ok(()),
            Err(why) => Err(Failure::new(Fault::Ended, why.to_string())),
        }
    }

    /// Writes as much of `rest` as the pipe takes, and returns what is left. Nothing is left once the guest has closed
    /// its end: it may still answer.
    fn give<'a>(&mut self, rest: &'a [u8]) -> &'a [u8] {
        let Some(input) = &mut self.input else { return &[] };
        match input.write(rest) {
            Ok(n) => &rest[n..],
            Err(why) if matches!(why.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => rest,
            Err(_) => {
                self.input = None;
                &[]
            }
        }
    }

    /// True if an answer has been read; a line without an end is bounded here.
    fn answered(&self) -> Result<bool, Failure> {
        let end = self.read.iter().position(|byte| *byte == b'\n');
        if end.unwrap_or(self.read.len()) >= MAX_LINE {
            return Err(Failure::new(Fault::Flood, format!("a line of at most {MAX_LINE} bytes expected, got more")));
        }
        Ok(end.is_some())
    }

    /// The first line of the bytes read, without its end.
    fn line(&mut self) -> Result<String, Failure> {
        let end = self.read.iter().position(|byte| *byte == b'\n').map_or(self.read.len(), |end| end + 1);
        let rest = self.read.split_off(end);
        let mut line = std::mem::replace(&mut self.read, rest);
        line.pop();
        String::from_utf8(line).map_err(|error| {
            let index = error.utf8_error().valid_up_to();
            Failure::new(Fault::Malformed, format!("UTF-8 expected, got another byte at offset {index}"))
        })
    }

    /// The failure of a guest whose output is closed.
    fn ended(&mut self) -> Failure {
        let (manner, words) = self.process.end(EXIT);
        let manner = manner.unwrap_or_else(|| "its standard output is closed, the program went on".into());
        Failure::new(Fault::Ended, with_words(manner, &words))
    }

    fn silent(&mut self, rest: &[u8], ms: u64) -> Failure {
        let (_, words) = self.process.end(Duration::ZERO);
        let unread =
            if rest.is_empty() { String::new() } else { format!(", {} bytes of the request unread", rest.len()) };
        Failure::new(Fault::Silent, with_words(format!("an answer within {ms} ms expected, got none{unread}"), &words))
    }

    /// Waits until the guest takes bytes or, where one is still awaited, gives an answer; false when the time is over.
    fn wait(&self, writing: bool, awaited: bool, deadline: &Deadline) -> Result<bool, Failure> {
        let left = deadline.left();
        let output = awaited.then(|| PollFd::new(&self.output, PollFlags::IN));
        let input = self.input.as_ref().filter(|_| writing).map(|input| PollFd::new(input, PollFlags::OUT));
        let mut fds: Vec<PollFd<'_>> = output.into_iter().chain(input).collect();
        match poll(&mut fds, Some(&timeout(left))) {
            Ok(n) => Ok(n > 0 && !left.is_zero()),
            Err(rustix::io::Errno::INTR) => Ok(true),
            Err(why) => Err(Failure::new(Fault::Ended, why.to_string())),
        }
    }
}

impl GuestChannel for Lines {
    fn exchange(&mut self, line: &str, patience: Patience) -> Result<String, Failure> {
        self.unasked()?;
        if patience == Patience::Start && std::mem::replace(&mut self.started, true) {
            self.start = Deadline::after_ms(self.start.ms());
        }
        let step = Deadline::after_ms(self.step_ms);
        let request = [line.as_bytes(), b"\n"].concat();
        let mut rest = self.give(&request);
        loop {
            let answered = self.answered()?;
            // Not before the whole request is written: the next one would run into its rest.
            if answered && rest.is_empty() {
                return self.line();
            }
            let deadline = if patience == Patience::Start { &self.start } else { &step };
            if !self.wait(!rest.is_empty(), !answered, deadline)? {
                let ms = deadline.ms();
                return Err(self.silent(rest, ms));
            }
            // An answer may come before the request is written whole: reading between writes keeps both pipes from
            // filling up.
            rest = self.give(rest);
            if !answered {
                self.take()?;
            }
        }
    }
}

fn with_words(manner: String, words: &str) -> String {
    if words.is_empty() { manner } else { format!("{manner}; its last words: {words}") }
}
