//! Failure of a command: exit code, one message, the one line that reproduces it.

use std::fmt;

use evidence::SCHEMA_VERSION;
use parallel::paint::{Stream, takes_colours};
use recording::RecordingError;
use scenario::{ProblemRow, Problems};
use serde::Serialize;

use crate::error::EngineError;

/// Exit codes; documented in `--help` and stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// Every trial within its expected classes.
    Fine,
    /// Internal error.
    Internal,
    /// Usage, or a file that cannot be used.
    Usage,
    /// An outcome that was not expected.
    Unexpected,
    /// No trial ran, or an unexpected INVALID.
    NoEvidence,
    /// The environment lacks something.
    Environment,
    /// Interrupted.
    Interrupted,
}

impl Exit {
    /// The code.
    pub fn code(self) -> u8 {
        match self {
            Exit::Fine => 0,
            Exit::Internal => 1,
            Exit::Usage => 2,
            Exit::Unexpected => 3,
            Exit::NoEvidence => 4,
            Exit::Environment => 5,
            Exit::Interrupted => 130,
        }
    }

    /// The exit with this code.
    pub fn from_code(code: u8) -> Option<Self> {
        use Exit::{Environment, Fine, Internal, Interrupted, NoEvidence, Unexpected, Usage};
        let all = [Fine, Internal, Usage, Unexpected, NoEvidence, Environment, Interrupted];
        all.into_iter().find(|exit| exit.code() == code)
    }
}

/// Reason for which a command failed.
#[derive(Clone, Debug)]
pub struct Failure {
    exit: Exit,
    message: String,
    problems: Vec<ProblemRow>,
    reproduce: Option<String>,
}

impl Failure {
    /// Failure with a message that includes the remedy.
    pub fn new(exit: Exit, message: impl Into<String>) -> Self {
        Self { exit, message: message.into(), problems: Vec::new(), reproduce: None }
    }

    /// Failure by a defect of this program.
    pub fn internal(error: impl std::fmt::Display) -> Self {
        Self::new(Exit::Internal, error.to_string())
    }

    /// Adds the line that reproduces it.
    #[must_use]
    pub fn reproduced_by(mut self, line: impl Into<String>) -> Self {
        self.reproduce = Some(line.into());
        self
    }

    /// The exit code.
    pub fn exit(&self) -> Exit {
        self.exit
    }

    /// Prints the message on stderr, and with `json` an object on stdout.
    pub fn report(&self, json: bool) -> Exit {
        link::note!("{}", self.message.trim_end());
        if let Some(line) = &self.reproduce {
            link::note!("reproduce: {line}");
        }
        if json {
            #[derive(Serialize)]
            struct ErrorObject<'a> {
                schema_version: u32,
                error: &'a str,
                exit: u8,
                #[serde(skip_serializing_if = "<[_]>::is_empty")]
                problems: &'a [ProblemRow],
                reproduce: Option<&'a str>,
            }
            let object = ErrorObject {
                schema_version: SCHEMA_VERSION,
                error: self.message.lines().next().unwrap_or_default(),
                exit: self.exit.code(),
                problems: &self.problems,
                reproduce: self.reproduce.as_deref(),
            };
            if let Ok(text) = serde_json::to_string(&object) {
                link::terminal::say(format_args!("{text}"));
            }
        }
        self.exit
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Failure {}

impl From<Problems> for Failure {
    fn from(problems: Problems) -> Self {
        let message = problems.render(takes_colours(Stream::Stderr));
        Self { problems: problems.rows(), ..Self::new(Exit::Usage, message) }
    }
}

impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        Self::new(Exit::Environment, format!("{error}; `holdsafe doctor` checks what a run needs"))
    }
}

impl From<RecordingError> for Failure {
    fn from(error: RecordingError) -> Self {
        match error {
            RecordingError::Io(error) => error.into(),
            RecordingError::NotOneRun { .. }
            | RecordingError::TooManyFolders { .. }
            | RecordingError::NoAnchors { .. }
            | RecordingError::Unreadable { .. } => Self::new(Exit::Usage, error.to_string()),
        }
    }
}

impl From<EngineError> for Failure {
    fn from(error: EngineError) -> Self {
        let exit = match &error {
            EngineError::Failed(_) => Exit::Internal,
            EngineError::Environment(_) => Exit::Environment,
            EngineError::Stopped => Exit::Interrupted,
        };
        Self::new(exit, error.to_string())
    }
}
