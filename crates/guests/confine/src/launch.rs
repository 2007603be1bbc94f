//! The launcher's side of a start: the helper as a child process, and its specification.

use std::collections::BTreeMap;
use std::io::{PipeReader, PipeWriter, pipe};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::Command;

use guest::file::{Limits, Program};
use guest::{Failure, GuestChannel, Launcher};

use crate::channel::Lines;
use crate::deadline::Deadline;
use crate::level::Level;
use crate::process::{Process, not_started};
use crate::spec::Spec;

/// Program that runs [`crate::inside::main`], with its leading arguments and the folder that it hides from guests.
pub(crate) struct Helper {
    pub(crate) program: PathBuf,
    pub(crate) leading: Vec<String>,
    pub(crate) hidden: Option<PathBuf>,
}

impl Launcher for Helper {
    fn launch(&self, program: &Program) -> Result<Box<dyn GuestChannel>, Failure> {
        if !program.folder.is_absolute() {
            return Err(not_started(format!("an absolute folder expected, got {}", program.folder.display())));
        }
        let spec = Spec {
            command: program.command.clone(),
            folder: program.folder.clone(),
            hidden: self.hidden.clone(),
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
        let spec = Spec { command: Vec::new(), folder: "/".into(), hidden: None, environment: BTreeMap::new(), limits };
        self.start(&spec, &deadline).map(|(_, _, _, level)| level)
    }

    /// The process with its standard input and output, and its level.
    fn start(&self, spec: &Spec, deadline: &Deadline) -> Result<(Process, PipeWriter, PipeReader, Level), Failure> {
        let (their_input, input) = pipe().map_err(not_started)?;
        let (output, their_output) = pipe().map_err(not_started)?;
        let (control, their_stream) = UnixStream::pair().map_err(not_started)?;
        let child = Command::new(&self.program)
            .args(&self.leading)
            .env_clear()
            .process_group(0)
            .stdin(their_input)
            .stdout(their_output)
            .stderr(OwnedFd::from(their_stream))
            .spawn()
            .map_err(|error| not_started(format!("{}: {error}", self.program.display())))?;
        let mut process = Process { child, control };
        let level = process.begin(spec, deadline)?;
        Ok((process, input, output, level))
    }
}
