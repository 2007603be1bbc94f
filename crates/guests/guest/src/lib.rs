//! Guests: third-party autonomy programs, tested in place of the platform's own mission and navigation.
//!
//! A guest is a program beside the run. Its file ([`mod@file`]) says how it is started and what it promises; the core's
//! requests reach it as lines of JSON ([`jsonl`]), and its answers are held against both ([`session`]). [`bus`] has attacks on
//! the messages among the guest's own programs, [`pool`] keeps a process for the next trial. [`check`] exercises a program
//! without a run. No code here starts a process or knows a clock: a [`Launcher`] does, for which see the crate `confine`.

pub mod bus;
pub mod check;
pub mod file;
pub mod jsonl;
pub mod pool;
pub mod session;

use std::fmt;
use std::sync::Arc;

use wire::codec::Text;
use wire::guest::{Answer, Fault};

pub use bus::{BusOrder, BusReceipt};
pub use file::{FileError, Program};
pub use session::Session;

/// Longest line of the protocol in either direction, bytes, its end included.
pub const MAX_LINE: usize = 64 * 1024;

/// Where a guest's set-points go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Conduct {
    /// Set-points go to the plant unchanged.
    Bare,
    /// Through the platform's guards, envelope, leases and state machine.
    Guarded,
}

impl Conduct {
    /// The name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Conduct::Bare => "bare",
            Conduct::Guarded => "guarded",
        }
    }
}

/// A guest as a run takes it.
#[derive(Clone)]
pub struct Guest {
    /// Its program.
    pub program: Arc<Program>,
    /// Where its set-points go.
    pub conduct: Conduct,
    /// True unless the same trial, run twice, gave two logs.
    pub repeatable: bool,
    /// Refusals of confinement, where its processes are not kept apart from the machine's.
    pub unconfined: Option<String>,
    /// Starts its process, once for each start of the unit.
    pub launcher: Arc<dyn Launcher>,
}

impl Guest {
    /// A session of one run.
    pub fn session(&self) -> Session {
        Session::new(Arc::clone(&self.program), Arc::clone(&self.launcher))
    }
}

impl fmt::Debug for Guest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Guest").field("program", &self.program.name).field("conduct", &self.conduct).finish()
    }
}

impl PartialEq for Guest {
    fn eq(&self, other: &Self) -> bool {
        self.program == other.program && self.conduct == other.conduct
    }
}

/// The end of a guest, by kind and reason.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: {why}", fault.name())]
pub struct Failure {
    /// Kind of the failure.
    pub fault: Fault,
    /// Expected and got.
    pub why: String,
}

impl Failure {
    /// A failure of this kind.
    pub fn new(fault: Fault, reason: impl Into<String>) -> Self {
        Self { fault, why: reason.into() }
    }

    /// The answer in place of one from the guest.
    pub fn answer(&self) -> Answer {
        Answer::Failed { fault: self.fault, why: Text::new(&self.why) }
    }
}

/// Time limit of an exchange.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Patience {
    /// That of the start: the program loads, and plans its mission.
    Start,
    /// That of a step.
    Step,
}

/// A running guest's standard input and output.
pub trait GuestChannel: Send + Sync {
    /// Writes one line, without its end, and waits for the one line that answers it.
    ///
    /// # Errors
    /// The program ended, was silent for longer than its file allows, or wrote a line longer than [`MAX_LINE`] or more than one.
    fn exchange(&mut self, line: &str, patience: Patience) -> Result<String, Failure>;

    /// True if the program has served a trial before.
    fn is_reused(&self) -> bool {
        false
    }

    /// Ends the program, which a channel of its own does when it is dropped.
    fn end(&mut self) {}
}

/// Starts guests.
pub trait Launcher: Send + Sync {
    /// Starts a process of `program`, which ends with the channel.
    ///
    /// # Errors
    /// The program could not be started.
    fn launch(&self, program: &Program) -> Result<Box<dyn GuestChannel>, Failure>;
}
